"""Writes a file whole or not at all."""
import os
import tempfile

from .bag import Refused, shown


def write_whole(path, content):
    """Writes text or bytes. An older file stays as it is until the new one is whole. Throws Refused."""
    part = None
    try:
        if os.path.isdir(path):
            raise IsADirectoryError(None, "is a folder")
        path = os.path.realpath(path)
        handle, part = tempfile.mkstemp(dir=os.path.dirname(path), prefix=os.path.basename(path) + ".incomplete-")
        with os.fdopen(handle, "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(part, 0o666 & ~umask)
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
