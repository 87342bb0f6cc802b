"""Reads text whole, and writes files whole or not at all; as the programs in C++ do."""
import contextlib
import errno
import os
import select
import stat
import sys
import tempfile
from pathlib import Path

from .command_line import Failed, Refused, is_full, reason_of, shown

WRITER_TIMEOUT = 1   # s, in which some program must have opened a pipe to write
MARK = ".incomplete-"
LONGEST_NAME = 255   # bytes


def read_whole(option, path, max_bytes, allowed):
    """The bytes of a file or pipe. Throws Refused, which says that it must be `allowed`; `option` may be empty."""
    def refuse(reason):
        raise Refused(f"{option} {shown(path)}: {reason}; must be {allowed}".lstrip())
    try:
        # Without O_NONBLOCK, open would wait for ever for a pipe without a writer.
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
            mode, content = os.fstat(file.fileno()).st_mode, b""
            if stat.S_ISFIFO(mode):
                select.select([file], [], [], WRITER_TIMEOUT)
                with contextlib.suppress(BlockingIOError):  # of a writer that has written nothing so far
                    content = os.read(file.fileno(), select.PIPE_BUF)
                    if not content:
                        refuse("is a pipe without a writer")
            elif not stat.S_ISREG(mode):
                refuse("is neither a file nor a pipe")
            os.set_blocking(file.fileno(), True)
            content += file.read(max_bytes + 1)
    except OSError as error:
        refuse(error.strerror)
    except ValueError:  # a NUL in it
        refuse("is no file's name")
    if len(content) > max_bytes:
        refuse(f"is longer than {max_bytes} bytes")
    return content


class Outputs:
    """The files that a program writes, claimed before anything runs. No two may be the same file, nor one that is read.
    Throws Refused where a claim is wrong, Failed where no space is left."""

    def __init__(self, inputs):
        self.taken = {identity(path): "a file that is read" for path in inputs if os.path.exists(path)}

    def claim(self, option, path):
        """`option` names the output where it is refused."""
        try:
            require_writable(path)
            this = identity(path)
        except OSError as error:
            raise (Failed if is_full(error) else Refused)(f"{shown(path)}: cannot be written: {reason_of(error)}")
        if this in self.taken:
            raise Refused(f"{option} = {shown(path)}: must not be {self.taken[this]}")
        if this != identity(os.devnull):
            self.taken[this] = "the file of " + option


def identity(path):
    """One value for all names that lead to one file, or to where one would be."""
    try:
        status = os.stat(path)
        return status.st_dev, status.st_ino
    except FileNotFoundError:
        return os.path.realpath(path)


def follow_links(path):
    """The file to which a name leads, also one that is not there yet. Throws OSError."""
    path = Path(path)
    with contextlib.suppress(FileNotFoundError):
        path.stat()  # refuses links that go round
    while path.is_symlink() and own_descriptor(path) is None:
        path = path.parent / os.readlink(path)
    return path


def own_descriptor(path):
    """N, if the path is /dev/fd/N by whatever name, else None."""
    with contextlib.suppress(OSError):
        if path.name.isdigit() and path.parent.samefile("/proc/self/fd"):
            return int(path.name)
    return None


def require_writable(path):
    target = follow_links(path)
    if target.is_dir() or str(path).endswith("/"):
        raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
    if target.exists() and not os.access(target, os.W_OK):  # renaming would replace it all the same
        raise OSError(errno.EACCES, os.strerror(errno.EACCES))
    if not goes_straight(target):
        handle, part = create_beside(target)
        os.close(handle)
        os.remove(part)


def goes_straight(target):
    return own_descriptor(target) is not None or (target.exists() and not target.is_file())


def create_beside(target):
    """Descriptor and name of a file of its own beside the target."""
    name = os.fsencode(target.name)[:LONGEST_NAME - len(MARK) - 8]
    return tempfile.mkstemp(dir=target.parent, prefix=os.fsdecode(name) + MARK)


def write_whole(path, content):
    """Writes text or bytes: a pipe or device straight, a file with the mode of an older one, whole or, throwing Failed,
    not at all."""
    content = content if isinstance(content, bytes) else content.encode()
    try:
        target = follow_links(path)
        (write_straight if goes_straight(target) else write_beside)(target, content)
    except OSError as error:
        raise Failed(f"{shown(path)}: cannot be written: {reason_of(error)}")


def write_straight(target, content):
    own = own_descriptor(target)
    sys.stdout.flush()  # which may be this one
    # A copy of an own descriptor shares its position, where opening it once more would begin at 0 and overwrite.
    with open(target if own is None else os.dup(own), "wb") as file:
        file.write(content)


def write_beside(target, content):
    handle, part = create_beside(target)
    try:
        with open(handle, "wb") as file:
            file.write(content)
        if target.exists():
            older = target.stat()
            with contextlib.suppress(PermissionError):  # for root, who may replace a file of others
                os.chown(part, older.st_uid, older.st_gid)
            mode = stat.S_IMODE(older.st_mode) & 0o777
        else:
            umask = os.umask(0)
            os.umask(umask)
            mode = 0o666 & ~umask
        os.chmod(part, mode)
        os.replace(part, target)
    except BaseException:
        os.remove(part)
        raise


def make_folder(path):
    """Throws Refused, or Failed where no space is left."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise (Failed if is_full(error) else Refused)(f"{shown(path)}: {error.strerror}; must be a folder to write to")
