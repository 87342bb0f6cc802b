"""Reads the messages of a bag, also of an unfinished one. Never writes to it, and runs nothing that is in it."""
import bz2
import io
import math
import os
import struct
from array import array
from collections import Counter, namedtuple
from pathlib import Path

import numpy as np

from .command_line import Refused, one_line, quoted, shown
from .definitions import Time, Unreadable, reader_of

MAGIC, OLD_MAGIC, ROS_2_MAGIC = b"#ROSBAG V2.0\n", b"#ROSRECORD V1.", (b"SQLite format", b"\x89MCAP")
MESSAGE, FILE_HEADER, CHUNK, CONNECTION = 2, 3, 5, 7  # op codes of records
LARGEST, LARGEST_HEADER = 1 << 27, 1 << 20  # bytes, of a record or unpacked chunk; beyond, the length is damaged
LZ4_PIECE = 4096  # bytes that are unpacked at once: to 1 MB at most
MAX_CLOCKS_APART = 1  # s, between a stamp and its arrival; beyond, the stamp is another clock's
MAX_STEP_BACK = 0.1  # s: messages that overtake each other by less are of one run
MIN_NEAR = 0.95  # share of stamps near their arrival, where both are of one clock
NAMED_APART, FEWEST = 0.2, 10  # s; stamps: of fewer, one that is damaged may be the median
STATE_SET = "state_set"  # last part of the topic that says where ~set_state has put the base


def absolute(topic):
    """rosbag record keeps the names that it is given, with a slash or without."""
    return "/" + topic.lstrip("/")


def stamp_of(message):
    """None where a message has none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return stamp if isinstance(stamp, Time) else None


# A topic of a node that publishes it: "" where the bag does not say; `latching`: "1" or "0".
Connection = namedtuple("Connection", "topic type definition publisher md5sum latching")


def begins_with_stamp(definition):
    """True if the first field of a message is a Header."""
    lines = (line.partition("#")[0].split() for line in definition.split("\n"))
    return next((line[0].rpartition("/")[2] for line in lines if line), "") == "Header"


def number_of(time):
    """s"""
    return time.secs + 1e-9 * time.nsecs


class Damaged(Exception):
    """The reason why a bag cannot be read further, and the byte."""


class Bag:
    """The messages of a bag. types: {topic: type}. counts: {topic: messages}. start: the earliest time of arrival.
    problem: None or, at the end of `messages`, in one line why not all of it can be read. notes: lines on its clocks.
    offsets: {topic: s added to its times}, by names as `absolute` has them."""

    def __init__(self, path, offsets=(), publishers=()):
        """`offsets`: pairs of a topic and s; `publishers`: pairs of a topic and the only node whose messages are read.
        Throws Refused for a file that is not a bag, for one without a message that can be read, and for topics and
        publishers that it lacks."""
        self.path, self.problem, self.types, self.counts, self.start = path, None, {}, Counter(), None
        self.offsets, self._publishers = ({absolute(topic): value for topic, value in pairs}
                                          for pairs in (offsets, publishers))
        require_bag(path)
        self._last, connections, stamped = Time(0, 0), {}, {}
        for connection, arrival, data in self._scan():
            if connection not in connections:
                connections[connection] = len(connections) + 1 if begins_with_stamp(connection.definition) else 0
            if connections[connection] and len(data) >= 12:
                stamped.setdefault(connection.topic, array("d")).extend(
                    (number_of(arrival), number_of(Time(*struct.unpack_from("<II", data, 4))), connections[connection]))
            self.types[connection.topic] = connection.type
            self.counts[connection.topic] += 1
            self.start, self._last = min(self.start or arrival, arrival), max(self._last, arrival)
        if not self.counts:
            raise Refused(f"{shown(path)} has no messages{' that can be read' if self.problem else ''}")
        self._check_chosen(connections)
        self.notes, self._shifts, self._steady, self._disordered = [], {}, set(), set()
        self._at_arrival = self._at_stamp = self.seconds
        self._choose_clock({topic: np.frombuffer(both).reshape(-1, 3) for topic, both in stamped.items()})

    def _check_chosen(self, connections):
        nodes = {}
        for connection in connections:
            nodes.setdefault(absolute(connection.topic), []).append(connection.publisher)
        for option, chosen in (("--clock-offset", self.offsets), ("--publisher", self._publishers)):
            for topic in set(chosen) - set(nodes):
                raise Refused(f"{shown(self.path)}: {option} {shown(topic)}: must be one of its topics; it has "
                              f"{self.shown_topics()}")
        for topic, node in self._publishers.items():
            if node not in nodes[topic]:
                raise Refused(f"{shown(self.path)}: --publisher {shown(topic)}={shown(node)}: must be "
                              f"{' or '.join(map(shown, filter(None, nodes[topic]))) or 'left out: it names none'}")

    def _choose_clock(self, stamped):
        """The clock of arrivals, if any topic has stamps near them; else that of the stamps, as where simulated time was
        recorded by the wall clock. `stamped`: {topic: rows of arrival and stamp, s, and who sent it}."""
        unset = [topic for topic, both in stamped.items() if not (both[:, 1] > 1e-9).any()]
        if unset:
            self.notes.append(f"stamps of {', '.join(map(shown, unset))} are not set: times are those of arrival")
        stamped = {topic: both[both[:, 1] > 0] for topic, both in stamped.items()
                   if np.mean(both[:, 1] > 0) > MIN_NEAR and len(both) > 1}
        near = [np.mean(np.abs(both[:, 0] - both[:, 1]) < MAX_CLOCKS_APART) for both in stamped.values()]
        if max(near, default=1) >= MIN_NEAR:
            for topic, both in stamped.items():
                self._choose_stamps(topic, *both.T)
            return
        arrival, stamp, _ = max(stamped.values(), key=len).T
        if (np.diff(arrival) < 0).any() or (np.diff(stamp) < -MAX_STEP_BACK).any() or stamp[-1] <= stamp[0]:
            return
        rate = (stamp[-1] - stamp[0]) / max(arrival[-1] - arrival[0], 1e-9)
        self.notes.append(f"stamps are of another clock than times of arrival: {rate:.3g} s for each second, from "
                          f"{stamp[0]:.3f} s on: times are those of the stamps")
        self._at_arrival = lambda time: float(np.interp(number_of(time), arrival, stamp - stamp[0]))
        self._at_stamp = lambda time: float(number_of(time) - stamp[0])

    def _choose_stamps(self, topic, arrival, stamp, source):
        """Stamps of a topic as they are; moved by what they are usually apart from arrival, where that is much; none."""
        order = np.lexsort((arrival, source))
        is_back = (np.diff(stamp[order]) < 0) & (np.diff(source[order]) == 0)
        if np.mean(is_back) > 1 - MIN_NEAR and absolute(topic) not in self.offsets:
            self._disordered.add(topic)
            self._shifts[topic] = math.nan
            self.notes.append(f"stamps of {shown(topic)} go back {np.sum(is_back)} times: times are those of arrival")
            return
        apart = np.median(stamp - arrival)
        is_steady = np.mean(np.abs(stamp - arrival - apart) < NAMED_APART) > MIN_NEAR
        if is_steady and len(stamp) >= FEWEST:
            self._steady.add(topic)
        if len(stamp) < FEWEST or abs(apart) < NAMED_APART or absolute(topic) in self.offsets:
            return
        how = f" (is its clock off? --clock-offset {shown(topic)}={-apart:.3g})"
        if abs(apart) > MAX_CLOCKS_APART:
            self._shifts[topic] = -apart if is_steady else math.nan
            how = ": moved by so much" if is_steady else ": times are those of arrival"
        self.notes.append(f"stamps of {shown(topic)} are {abs(apart):.3g} s {'after' if apart > 0 else 'before'} their "
                          f"arrival{how}")

    def messages(self, topics):
        """Yields Connection, message and time of arrival, as they lie in the file. Where the bag is damaged, it ends,
        and `problem` says so. Throws Refused for a topic whose definition is not one."""
        readers, last = {}, self.start
        for connection, arrival, data in self._scan():
            if connection.topic not in topics or (
                    connection.publisher != self._publishers.get(absolute(connection.topic), connection.publisher)):
                continue
            try:
                if connection not in readers:
                    readers[connection] = reader_of(connection.type, connection.definition)
            except Unreadable as reason:
                raise Refused(f"{shown(self.path)}: {shown(connection.topic)}: {reason}")
            try:
                message = readers[connection](data)
            except Unreadable as reason:
                self.problem = (f"{shown(self.path)} is damaged ({shown(connection.topic)}: {reason}): read up to "
                                f"t = {self.seconds(last):.3f} s")
                return
            last = max(last, arrival)
            yield connection, message, arrival

    def state_sets(self, topics):
        """Topics that say where a base was put elsewhere, of those in whose namespaces one of `topics` is."""
        return [one for one, kind in self.types.items()
                if kind == "nav_msgs/Odometry" and one.rsplit("/", 1)[-1] == STATE_SET and
                any(absolute(topic).startswith(absolute(one)[:-len(STATE_SET)]) for topic in topics)]

    def messages_of_one_run(self, topics, others=()):
        """Yields seconds, Connection and message of both. Throws Refused where the times of one of `topics` go back, as
        in a bag of two runs."""
        latest = {}

        def follow(source, t):
            before = latest.setdefault(source, t)
            if t < before - MAX_STEP_BACK:
                raise Refused(f"{shown(self.path)}: the times of {shown(source[0])} go back from t = {before:.3f} s to "
                              f"{t:.3f} s: must be one run")
            latest[source] = max(before, t)
        for connection, message, arrival in self.messages([*topics, *others]):
            topic, stamp, t = connection.topic, stamp_of(message), self.time_of(message, arrival, connection.topic)
            if topic in topics:
                follow((topic,), self.seconds(arrival))
                if stamp and t == t and topic not in self._disordered:  # goes back where a bag was played in a loop
                    follow((*connection, *getattr(message, "name", ())), self.seconds(stamp))
            yield t, connection, message

    def shown_topics(self):
        return ", ".join(f"{shown(topic)} ({shown(kind)})" for topic, kind in sorted(self.types.items()))

    def seconds(self, stamp):
        """Time since the bag's beginning; simulated time if the bag began with it."""
        # ROS has no time zero: in simulated time the first nanosecond stands for it.
        if self.start > Time(0, 1):
            return stamp.secs - self.start.secs + 1e-9 * (stamp.nsecs - self.start.nsecs)
        return stamp.secs + 1e-9 * stamp.nsecs if stamp != self.start else 0.0

    def time_of(self, message, arrival, topic):
        """Seconds of a message, with the offset of its topic: by the stamp in its header, unless that is not set, or of
        another clock. NaN of one that waited or is damaged: far from its arrival, where others are not."""
        stamp, offset = stamp_of(message), self.offsets.get(absolute(topic))
        by_arrival = self._at_arrival(arrival)
        by_stamp = self._at_stamp(stamp) if stamp else by_arrival
        if offset is not None:  # of stamps too that are far from their arrival
            return offset + (by_stamp if stamp else by_arrival)
        by_stamp += self._shifts.get(topic, 0)  # decided for all of a topic, whose clock is one
        is_late = not abs(by_stamp - by_arrival) < 2 * MAX_CLOCKS_APART
        return (math.nan if topic in self._steady else by_arrival) if is_late else by_stamp

    def _scan(self):
        """Yields what `scan` does; at a break says so in `problem`."""
        try:
            yield from scan(self.path)
        except Damaged as damage:
            read = f"read up to t = {self.seconds(self._last):.3f} s" if self.start else "nothing can be read"
            self.problem = f"{shown(self.path)} {damage}: {read}"


def require_bag(path):
    """Throws Refused for another file, and for a bag of version 1."""
    try:
        if not Path(path).is_file():
            Path(path).stat()
            kind = "a folder" if Path(path).is_dir() else "not a regular file"
            raise Refused(f"{shown(path)} is {kind}: must be a bag")
        with open(path, "rb") as file:
            begin = file.read(len(OLD_MAGIC))
    except (OSError, ValueError) as error:
        raise Refused(f"{shown(path)}: {getattr(error, 'strerror', None) or one_line(error)}; must be a bag")
    if begin.startswith(OLD_MAGIC):
        raise Refused(f"{shown(path)} is of a version before 2.0: run rosbag reindex on a copy")
    if begin.startswith(ROS_2_MAGIC):
        raise Refused(f"{shown(path)} is of ROS 2: must be a bag of ROS 1, as rosbags-convert makes of it")
    if not begin.startswith(MAGIC):
        raise Refused(f"{shown(path)} is not a bag: must begin with #ROSBAG V2.0" if begin else
                      f"{shown(path)} is empty: must be a bag")


def scan(path):
    """Yields Connection, time of arrival and bytes of the messages of a bag of version 2.0 as they lie in the file. Throws
    Damaged at the first record that is cut or damaged, and where the index is not complete; it is not needed."""
    connections, index, end = {}, 0, 0
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        file.seek(len(MAGIC))
        try:
            for header, data in records(file, size):
                op = header[b"op"][0]
                if op == FILE_HEADER:
                    if header.get(b"encryptor"):
                        raise Refused(f"{shown(path)} is encrypted: run rosbag decrypt on a copy")
                    index, = struct.unpack("<Q", header[b"index_pos"])
                elif op == CONNECTION:
                    fields = fields_of(data)
                    connections[header[b"conn"]] = Connection(*(text.decode(errors="replace") for text in (
                        header[b"topic"], fields[b"type"], fields[b"message_definition"],
                        fields.get(b"callerid", b""), fields[b"md5sum"], fields.get(b"latching", b"0"))))
                elif op == MESSAGE:
                    yield connections[header[b"conn"]], Time(*struct.unpack("<II", header[b"time"])), data
                end = file.tell()
        except (LookupError, ValueError, struct.error, OSError, EOFError) as error:
            if end < index <= size:
                raise Damaged(f"is damaged ({one_line(error)} after byte {end})")
            index = 0
    if not 0 < index <= size:
        raise Damaged("has no complete index, as if it was cut or its recorder was killed")


def records(stream, size):
    """Yields header and data of the records of a bag, those within chunks in place of the chunks."""
    while stream.tell() < size:
        header = fields_of(block(stream, size))
        is_chunk = header[b"op"][0] == CHUNK
        if is_chunk and header[b"compression"] == b"none":
            stream.read(4)  # the records within follow, even where the chunk was never ended
            continue
        data = block(stream, size)
        if is_chunk:
            data = decompressed(data, header[b"compression"], *struct.unpack("<I", header[b"size"]))
            yield from records(io.BytesIO(data), len(data))
        else:
            yield header, data


def block(stream, size):
    """Bytes that follow their length. Throws EOFError or struct.error where they are cut."""
    length, = struct.unpack("<I", stream.read(4))
    if length > min(size - stream.tell(), LARGEST):
        raise EOFError(f"a record of {length} bytes")
    return stream.read(length)


def fields_of(header):
    fields, at = {}, 0
    if len(header) > LARGEST_HEADER:
        raise ValueError(f"a header of {len(header)} bytes")
    while at < len(header):
        length, = struct.unpack_from("<I", header, at)
        if not 0 < length <= len(header) - at - 4:
            raise ValueError(f"a field of {length} bytes")
        at += 4 + length
        name, _, value = header[at - length:at].partition(b"=")
        fields[name] = value
    return fields


def decompressed(data, compression, size):
    """Unpacks at most `size` bytes: more may be packed than the bag says."""
    if size > LARGEST:
        raise ValueError(f"a chunk of {size} bytes")
    if compression == b"bz2":
        unpacked = bz2.BZ2Decompressor().decompress(data, size + 1)
    elif compression == b"lz4":
        unpacked = lz4_decompressed(data, size)
    else:
        raise ValueError(f"compression {quoted(compression)}")
    if len(unpacked) != size:
        raise ValueError(f"a chunk that is not of the {size} bytes that it says")
    return unpacked


def lz4_decompressed(data, size):
    try:
        import roslz4
    except ImportError:
        raise Refused("a bag compressed with lz4 needs the package python3-roslz4")
    decompressor, unpacked = roslz4.LZ4Decompressor(), bytearray()
    try:
        for at in range(0, len(data), LZ4_PIECE):
            unpacked += decompressor.decompress(data[at:at + LZ4_PIECE])
            if len(unpacked) > size:
                break
    except Exception as error:  # its C code names no type
        raise ValueError(one_line(error))
    return bytes(unpacked)
