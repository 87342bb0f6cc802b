"""Message definitions of bags: reads messages by them and runs nothing, where genpy would make Python of their text."""
import re
import struct
from collections import namedtuple
from types import SimpleNamespace

from .command_line import one_line, quoted

LARGEST = 1 << 24  # bytes of a message that is read; numbers in lists take up to eight times as much

Time = namedtuple("Time", "secs nsecs")
NUMBERS = dict(bool="?", int8="b", uint8="B", byte="b", char="B", int16="h", uint16="H", int32="i", uint32="I",
               int64="q", uint64="Q", float32="f", float64="d")
PAIRS = dict(time="II", duration="ii")
TYPE = r"([A-Za-z]\w*(?:/[A-Za-z]\w*)?)"
LINE = re.compile(TYPE + r"(?:\[(\d{0,9})\])?\s+([A-Za-z]\w*)\s*(=.*)?", re.ASCII)
BETWEEN = "\n" + 80 * "=" + "\n"


class Unreadable(ValueError):
    """The reason why a definition, or a message by it, cannot be read."""


def reader_of(kind, definition):
    """The function from a message's bytes to an object with the fields of its type `kind`. Throws Unreadable, now and
    for bytes of another length."""
    first, *others = definition.replace("\r\n", "\n").replace("roslib/Header", "std_msgs/Header").split(BETWEEN)
    texts = {kind: first}
    for text in others:
        head, _, rest = text.partition("\n")
        texts[head.partition("MSG:")[2].strip()] = rest
    try:
        read, least = Types(texts).reader(kind)
    except RecursionError:
        raise Unreadable("types nest too deep")

    def message(data):
        if len(data) > LARGEST:
            raise Unreadable(f"a message of {len(data)} bytes: must be at most {LARGEST}")
        try:
            value, end = read(data, 0)
        except (struct.error, OverflowError) as error:
            raise Unreadable(f"a message of {len(data)} bytes: {one_line(error)}")
        if end != len(data):
            raise Unreadable(f"a message of {len(data)} bytes: must have {end}")
        return value
    return message


class Types:
    """Readers of types: each takes bytes and where it begins, and returns a value and where that ends. Each comes with
    the fewest bytes of a value: as many or more are there before a list is made, and reading takes no longer than they
    are many."""

    def __init__(self, texts):
        self.texts, self.readers = texts, {}

    def reader(self, kind):
        if kind not in self.readers:
            if kind not in self.texts:
                raise Unreadable(f"the definition of {quoted(kind)} is missing")
            self.readers[kind] = None  # until its fields are known
            self.readers[kind] = self.record(kind)
        if not self.readers[kind]:
            raise Unreadable(f"{quoted(kind)} contains itself")
        return self.readers[kind]

    def record(self, kind):
        fields = []
        for line in self.texts[kind].split("\n"):
            line = line.partition("#")[0].strip()
            match = LINE.fullmatch(line)
            if not match and line:
                raise Unreadable(f"the definition of {quoted(kind)} has the line {quoted(line)}: must be TYPE NAME, or "
                                 "TYPE NAME=VALUE")
            if match and not match[4]:  # rather than a constant
                fields.append((match[3], *self.field(kind.partition("/")[0], match[1], match[2])))

        def read(data, at):
            values = {}
            for name, read_field, _ in fields:
                values[name], at = read_field(data, at)
            return SimpleNamespace(**values), at
        return read, sum(least for _, _, least in fields)

    def field(self, package, kind, count):
        """`count`: None for one value, empty for a list of any length."""
        if kind in NUMBERS and count is not None:
            return numbers(NUMBERS[kind], count)
        if kind in NUMBERS:
            one = fixed(NUMBERS[kind], lambda value: value)
        elif kind in PAIRS:
            one = fixed(PAIRS[kind], Time)
        elif kind == "string":
            one = text, 4
        else:
            one = self.reader("std_msgs/Header" if kind == "Header" else kind if "/" in kind else f"{package}/{kind}")
            if not one[1]:
                raise Unreadable(f"{quoted(kind)} has no fields")
        return one if count is None else list_of(*one, count)


def fixed(letters, make):
    form = struct.Struct("<" + letters)
    return lambda data, at: (make(*form.unpack_from(data, at)), at + form.size), form.size


def text(data, at):
    length, = struct.unpack_from("<I", data, at)
    end = at + 4 + length
    if end > len(data):
        raise Unreadable(f"a text of {length} bytes in a message of {len(data)}")
    return data[at + 4:end].decode(errors="replace"), end


def numbers(letter, count):
    size = struct.calcsize("<" + letter)

    def read(data, at):
        n, at = length_of(count, data, at, size)
        return struct.unpack_from(f"<{n}{letter}", data, at), at + n * size
    return read, size * int(count) if count else 4


def list_of(read_one, least, count):
    def read(data, at):
        n, at = length_of(count, data, at, least)
        found = []
        for _ in range(n):
            value, at = read_one(data, at)
            found.append(value)
        return found, at
    return read, least * int(count) if count else 4


def length_of(count, data, at, least):
    """The number of values in a list, and where they begin."""
    if count:
        n = int(count)
    else:
        (n,), at = struct.unpack_from("<I", data, at), at + 4
    if n * least > len(data) - at:
        raise Unreadable(f"a list of {n} in a message of {len(data)} bytes")
    return n, at
