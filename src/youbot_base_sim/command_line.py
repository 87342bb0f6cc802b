"""A program's beginning and end: its arguments, what it refuses, standard output, exit status; as those in C++ do."""
import argparse
import contextlib
import errno
import importlib
import io
import math
import os
import reprlib
import subprocess
import sys
import time

DONE, NOT_COMPLETED, REFUSED, INTERRUPTED = 0, 1, 2, 130  # exit status
LONGEST_QUOTE = 60  # characters


class Failed(Exception):
    """The task cannot be completed; the text says why."""
    status = NOT_COMPLETED


class Refused(Failed):
    """The task cannot be done with this input; one line says why."""
    status = REFUSED


def shown(name):
    """A file's or topic's name as a message may show it: in one line, and only what a terminal can print."""
    name = str(name)
    return name if name.isprintable() else ascii(name)


def printable(text, kept=""):
    """Text with what a terminal would take for more than a character escaped."""
    return "".join(c if c.isprintable() or c in kept else ascii(c)[1:-1] for c in text)


def quoted(value):
    """A value of a file, cut where it is long: lists may hold each other a billion times."""
    try:
        text = reprlib.repr(value)
    except ValueError:  # Python prints whole numbers of 4300 digits at most
        text = hex(value)
    return text[:LONGEST_QUOTE] + "..." * (len(text) > LONGEST_QUOTE)


def one_line(error):
    return " ".join(str(error).split()) or type(error).__name__


def is_full(error):
    return error.errno in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)


def reason_of(error):
    """The reason why an output cannot be written, of an OSError; of those for a full disk, all say "no space"."""
    return f"no space left for it ({error.strerror})" if is_full(error) else error.strerror


def complain(name, text):
    """Prints a line on standard error. Where that takes no more, as on a full disk, the exit status has to do."""
    with contextlib.suppress(OSError):
        print(f"{name}: {printable(str(text))}", file=sys.stderr, flush=True)


class Parser(argparse.ArgumentParser):
    """Refuses in one line; empty texts too, as of unset variables. `examples`: what follows the program's name."""

    def __init__(self, name, description, *examples,
                 epilog="Exit status: 0 done, 2 rejected input, 1 it could not be completed."):
        lines = ["", "", "Examples:", *(f"  {name} {example}".rstrip() for example in examples)]
        super().__init__(prog=name, description=description, formatter_class=argparse.RawDescriptionHelpFormatter,
                         epilog=epilog + ("\n".join(lines) if examples else ""))

    def parse_args(self, argv=None):
        arguments = super().parse_args(argv)
        options = {action.dest: action.option_strings[-1] for action in self._actions if action.option_strings}
        for name, value in vars(arguments).items():
            if "" in (value if isinstance(value, list) else [value]):
                self.error(f'{options.get(name, name)} = "": must not be empty')
        return arguments

    def error(self, message):
        raise Refused(f"{message}; see {self.prog} --help")


def positive(text):
    """The type of an option."""
    try:
        number = float(text)
    except ValueError:
        number = 0
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r}: must be a number > 0")
    return number


class Progress:
    """A bar on standard error, if a terminal: from 1 s on, each 0.2 s at most. A context: clears it."""

    def __init__(self, total, is_quiet=False):
        self.total, self.is_shown = max(total, 1), False
        self.next_time = time.monotonic() + 1 if sys.stderr.isatty() and not is_quiet else math.inf

    def show(self, done, text):
        if time.monotonic() < self.next_time:
            return
        self.next_time, self.is_shown = time.monotonic() + 0.2, True
        share = min(done / self.total, 1)
        print(f"\r\033[K[{'#' * int(40 * share):40}] {100 * share:3.0f} % {text}", end="", file=sys.stderr, flush=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.is_shown:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


class StandardOutput:
    """Standard output: if it takes no more, the program still writes its other outputs; `error` keeps the reason."""

    def __init__(self, stream, is_closed):
        self.stream, self.is_closed, self.error = stream, is_closed, None

    def write(self, text):
        if self.is_closed:
            self.error = OSError(errno.EBADF, os.strerror(errno.EBADF))
        self.attempt(self.stream.write, printable(text, "\n"))
        if text.endswith("\n"):  # what reads a pipe sees each line at once, as a terminal does
            self.flush()

    def flush(self):
        self.attempt(self.stream.flush)

    def attempt(self, action, *arguments):
        try:
            action(*arguments)
        except OSError as error:
            self.error = error
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # takes what the interpreter still holds, and all that follows


def run(name, main, *arguments):
    """Runs main, which returns the exit status or None for DONE. Returns that of the whole program."""
    is_closed = sys.stdout is None
    for stream in ("stdin", "stdout", "stderr"):  # one that is closed must not become the number of an output
        if getattr(sys, stream) is None:
            setattr(sys, stream, open(os.devnull, "w"))
    if isinstance(sys.stdout, io.TextIOWrapper):  # names of files may have characters that the locale lacks
        sys.stdout.reconfigure(errors="backslashreplace")
    out = StandardOutput(sys.stdout, is_closed)
    with contextlib.redirect_stdout(out):
        try:
            status = main(*arguments) or DONE
        except (Failed, OSError, subprocess.CalledProcessError) as error:
            complain(name, error)
            status = getattr(error, "status", NOT_COMPLETED)
        except ModuleNotFoundError as error:
            if error.name.startswith(__package__):
                raise
            complain(name, f"needs the Python module {error.name}: scripts/install_dependencies "
                     f"python3-{error.name.partition('.')[0]}")
            status = NOT_COMPLETED
        except SystemExit as end:  # after --help
            status = end.code
        except KeyboardInterrupt:
            status = INTERRUPTED
        out.flush()
    if not out.error:
        return status
    if status == DONE and not isinstance(out.error, BrokenPipeError):  # as of `analyse BAG | head`
        complain(name, "standard output: cannot be written: " + reason_of(out.error))
    return max(status, NOT_COMPLETED)


def start(module):
    """Runs `main` of a module of this package as a program of its name, and ends with its exit status."""
    name = module.rpartition(".")[2]
    sys.exit(run(name, lambda: importlib.import_module(f"{__package__}.{module}").main()))
