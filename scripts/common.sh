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

# Reads the output of CMake or, with APT::Status-Fd=1, of apt. In a terminal it shows each second what is done, how much of
# it, for how long and for how long still; in a pipe nothing.
show_progress() {
  local piece line='' status step shown='' percent start left=''
  while IFS= read -r -t 1 piece && status=0 || { status=$? && [ $status -gt 128 ]; }; do
    line+=$piece
    if [ $status -eq 0 ]; then
      if [ -t 1 ] && [[ $line =~ ^(\[\ *|[dp][lm]status:[^:]*:)([0-9]+) ]]; then
        case $line in
          \[*) step=building ;;
          dlstatus:*) step=downloading ;;
          *) step=installing ;;
        esac
        percent=${BASH_REMATCH[2]}
        [ "$step" = "$shown" ] || { start=$SECONDS left='' && echo; }
        shown=$step
        [ $((SECONDS - start)) -lt 5 ] ||
          left=", about $(((SECONDS - start) * (100 - percent) / (percent + 1))) s more"
      fi
      line=''
    fi
    [ -z "$shown" ] || printf '\r\033[K%s: %d %%, %d s%s' "$shown" "$percent" $((SECONDS - start)) "$left"
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
