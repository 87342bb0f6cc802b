# What the shell scripts share: they source it before they do anything else. For --help it prints the comment at the
# script's head.
# shellcheck shell=bash
refuse() {
  echo "${0##*/}: $*" >&2
  exit 2
}

# accept PATTERN ARGUMENT...: refuses each argument that the whole pattern does not match.
accept() {
  local argument
  for argument in "${@:2}"; do [[ $argument =~ ^($1)$ ]] || refuse "$argument: unknown argument; see --help"; done
}

# Reads the output of CMake or, with APT::Status-Fd=1, of apt. In a terminal it shows what is done, how much of it, for how
# long and for how long still; in a pipe nothing.
show_progress() {
  local line step shown='' start left
  while IFS= read -r line; do
    case $line in
      \[*) step=building ;;
      dlstatus:*) step=downloading ;;
      pmstatus:*) step=installing ;;
      *) continue ;;
    esac
    [[ -t 1 && $line =~ ^(\[\ *|[dp][lm]status:[^:]*:)([0-9]+) ]] || continue
    [ "$step" = "$shown" ] || { start=$SECONDS; echo; }
    shown=$step
    left=$(((SECONDS - start) * (100 - BASH_REMATCH[2]) / (BASH_REMATCH[2] + 1)))
    printf '\r\033[K%s: %d %%, %d s, about %d s more' "$step" "${BASH_REMATCH[2]}" $((SECONDS - start)) $left
  done
  [ -z "$shown" ] || echo
}

for argument; do
  case $argument in
    -h | --help)
      sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"
      exit
      ;;
  esac
done
