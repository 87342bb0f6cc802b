"""Writes a file whole or not at all."""
import os
import stat
import tempfile

from .bag import Refused, shown


def write_whole(path, content):
    """Writes text or bytes. An older file stays as it is until the new one is whole, which has its mode. What is no
    file, such as a pipe, is written straight. Throws Refused."""
    content = content if isinstance(content, bytes) else content.encode()
    part = None
    try:
        if os.path.isdir(path):
            raise IsADirectoryError(None, "is a folder")
        if os.path.exists(path) and not os.path.isfile(path):
            with open(path, "wb") as file:
                file.write(content)
            return
        path = os.path.realpath(path)
        handle, part = tempfile.mkstemp(dir=os.path.dirname(path), prefix=os.path.basename(path) + ".incomplete-")
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(part, stat.S_IMODE(os.stat(path).st_mode) if os.path.exists(path) else 0o666 & ~umask)
        os.replace(part, path)
    except OSError as error:
        raise Refused("%s cannot be written: %s" % (shown(path), error.strerror))
    finally:
        if part and os.path.exists(part):
            os.remove(part)


def table_text(columns, rows):
    """CSV with one line of names; numbers read back to the same value, what is not known is left empty."""
    lines = [",".join(columns)]
    for row in rows:
        lines.append(",".join("" if cell != cell else cell if isinstance(cell, str) else repr(cell) for cell in row))
    return "\n".join(lines) + "\n"
