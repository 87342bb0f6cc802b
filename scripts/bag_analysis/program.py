"""How a program begins and ends: its arguments, what it refuses, standard output, exit status; as those in C++ do."""
import argparse
import contextlib
import errno
import os
import reprlib
import sys

DONE, NOT_COMPLETED, REFUSED, INTERRUPTED = 0, 1, 2, 130  # exit status
LONGEST_QUOTE = 60  # characters


class Refused(Exception):
    """What is asked for cannot be done with this input, in one line."""
    status = REFUSED


class Failed(Exception):
    """An output cannot be written, in one line."""
    status = NOT_COMPLETED


def shown(name):
    """A file's or topic's name as a message may show it: in one line, and only what a terminal can print."""
    return name if name.isprintable() else ascii(name)


def quoted(value):
    """A value of a file, cut where it is long: lists may hold each other a billion times."""
    text = reprlib.repr(value)
    return text if len(text) <= LONGEST_QUOTE else text[:LONGEST_QUOTE] + "..."


def one_line(error):
    return " ".join(str(error).split()) or type(error).__name__


def is_full(error):
    return error.errno in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)


def reason_of(error):
    """Why an output cannot be written, of an OSError; of those for a full disk, all say "no space"."""
    return "no space left for it (%s)" % error.strerror if is_full(error) else error.strerror


def complain(name, text):
    """Where nobody can hear it, as on a full disk, the exit status has to do."""
    with contextlib.suppress(OSError):
        print("%s: %s" % (name, text), file=sys.stderr, flush=True)


class Parser(argparse.ArgumentParser):
    """Refuses in one line, and texts that are given but empty, as an unset variable of a shell is."""

    def __init__(self, name, description, positional):
        super().__init__(prog=name, description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
        self.positional = positional

    def parse_args(self, argv=None):
        arguments = super().parse_args(argv)
        for name, value in vars(arguments).items():
            if "" in (value if isinstance(value, list) else [value]):
                self.error('%s = "": must not be empty' % (
                    name if name == self.positional else "--" + name.replace("_", "-")))
        return arguments

    def error(self, message):
        line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in message)
        raise Refused("%s; see %s --help" % (line, self.prog))


class StandardOutput:
    """Where it takes no more, the program goes on to its other outputs; `error` tells."""

    def __init__(self, stream):
        self.stream, self.error = stream, None

    def write(self, text):
        self._attempt(lambda: self.stream.write(text))

    def flush(self):
        self._attempt(self.stream.flush)

    def _attempt(self, action):
        try:
            if not self.error:
                action()
        except OSError as error:
            self.error = error
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # takes what the interpreter still holds


def run(name, main, *arguments):
    """Runs main, which returns the exit status. Returns that of the whole program."""
    for stream in ("stdin", "stdout", "stderr"):  # one that is closed must not become the number of an output
        if getattr(sys, stream) is None:
            setattr(sys, stream, open(os.devnull, "w"))
    out = StandardOutput(sys.stdout)
    with contextlib.redirect_stdout(out):
        try:
            status = main(*arguments)
        except (Refused, Failed) as error:
            complain(name, error)
            status = error.status
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
