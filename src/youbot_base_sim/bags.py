"""Reads the messages of a bag, also of an unfinished one. Never writes to it."""
import bz2
import io
import logging
import os
import struct
from collections import Counter
from pathlib import Path

import genpy
import genpy.dynamic
import rosbag

from .command_line import Refused, one_line, shown

MAGIC = (b"#ROSBAG V2.0\n", b"#ROSRECORD V1.")
MESSAGE, CHUNK, CONNECTION, FILE_HEADER = 2, 5, 7, 3  # op codes of records
MAX_CLOCKS_APART = 1  # s, between a stamp and its arrival; beyond, the stamp is another clock's
MAX_STEP_BACK = 0.1  # s: messages that overtake each other by less are of one run
STATE_SET = "state_set"  # last part of the topic that says where ~set_state has put the base

logging.getLogger("rosout").addHandler(logging.NullHandler())  # genpy's, which prints what it replaces in damaged text


def absolute(topic):
    """rosbag record keeps the names that it is given, with a slash or without."""
    return "/" + topic.lstrip("/")


def stamp_of(message):
    """None where a message has none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return stamp if isinstance(stamp, genpy.Time) else None


class Bag:
    """The messages of a bag. types: {topic: type}. counts: {topic: messages}. start: the earliest time of arrival.
    problem: None or, at the end of `messages`, in one line why not all of it can be read."""

    def __init__(self, path):
        """Throws Refused for a file that is not a bag, and for one without a message that can be read."""
        self.path, self.problem, self._bag = path, None, None
        is_new = is_of_version_2(path)
        try:
            self._bag = rosbag.Bag(path)
            topics = self._bag.get_type_and_topic_info().topics
            self.types = {name: info.msg_type for name, info in topics.items()}
            self.counts = {name: info.message_count for name, info in topics.items()}
            if self.counts:
                self.start = next(self._bag.read_messages(raw=True))[2]
        except Exception as error:  # rosbag lets through whatever a damaged file provokes
            if "encrypt" in type(error).__name__.lower():
                raise Refused(f"{shown(path)} is encrypted: {one_line(error)}")
            self.close()
            if not is_new:
                raise Refused(f"{shown(path)} has no index and is of an old version: run rosbag reindex on a copy")
            self._scan()
        if not self.counts:
            self.close()
            raise Refused(f"{shown(path)} has no messages{' that can be read' if self.problem else ''}")

    def close(self):
        if self._bag:
            self._bag.close()
            self._bag = None

    def messages(self, topics):
        """Yields topic, message and time of arrival. Where the bag is damaged, it ends, and `problem` says so."""
        if not topics:
            return  # rosbag takes none for all
        messages = self._bag.read_messages(topics) if self._bag else self._scanned_messages(topics)
        last = self.start
        try:
            for topic, message, arrival in messages:
                last = max(last, arrival)
                yield topic, message, arrival
        except Exception as error:  # as above
            self.problem = (f"{shown(self.path)} is damaged ({one_line(error)}): read up to "
                            f"t = {self.seconds(last):.3f} s")

    def state_sets(self, topics):
        """Topics that say where a base was put elsewhere, of those in whose namespaces one of `topics` is."""
        return [one for one, kind in self.types.items()
                if kind == "nav_msgs/Odometry" and one.rsplit("/", 1)[-1] == STATE_SET and
                any(absolute(topic).startswith(absolute(one)[:-len(STATE_SET)]) for topic in topics)]

    def messages_of_one_run(self, topics, others=()):
        """Yields seconds, topic and message. Throws Refused where the times of one of `topics` go back, as in a bag of
        two runs, and where the base was put elsewhere between two messages, unless `others` has the topic of that."""
        latest, state_sets, put = {}, set(self.state_sets(topics)) - set(others), None

        def follow(source, t):
            before = latest.setdefault(source, t)
            if t < before - MAX_STEP_BACK:
                raise Refused(f"{shown(self.path)}: the times of {shown(source[0])} go back from t = {before:.3f} s to "
                              f"{t:.3f} s: must be one run")
            latest[source] = max(before, t)
        for connection, arrival, _ in scan(self.path):  # as they lie in the file: rosbag puts them in order of time
            topic = connection["topic"]
            if topic in state_sets and latest:
                put = put or (topic, self.seconds(arrival))
            if topic in topics:
                follow((topic,), self.seconds(arrival))
                if put:
                    raise Refused(f"{shown(self.path)}: the base was put elsewhere at t = {put[1]:.3f} s, by "
                                  f"{shown(put[0])}: must be one run")
        latest.clear()
        for topic, message, arrival in self.messages([*topics, *others]):
            stamp = stamp_of(message)
            if stamp and topic in topics:  # goes back where a bag was played in a loop
                follow((topic, *getattr(message, "name", ())), self.seconds(stamp))
            yield self.time_of(message, arrival), topic, message

    def shown_topics(self):
        return ", ".join(f"{shown(topic)} ({shown(kind)})" for topic, kind in sorted(self.types.items()))

    def seconds(self, stamp):
        """Time since the bag's beginning; simulated time if the bag began with it."""
        # ROS has no time zero: in simulated time the first nanosecond stands for it.
        if self.start.to_nsec() > 1:
            return stamp.secs - self.start.secs + 1e-9 * (stamp.nsecs - self.start.nsecs)
        return stamp.secs + 1e-9 * stamp.nsecs if stamp != self.start else 0.0

    def time_of(self, message, arrival):
        """Seconds of a message: by the stamp in its header, unless that is not set, or of another clock."""
        stamp, by_arrival = stamp_of(message), self.seconds(arrival)
        by_stamp = self.seconds(stamp) if stamp else by_arrival
        return by_stamp if abs(by_stamp - by_arrival) < MAX_CLOCKS_APART else by_arrival

    def _scan(self):
        self.types, self.counts, times = {}, Counter(), []
        for connection, arrival, _ in scan(self.path):
            self.types[connection["topic"]] = connection["type"]
            self.counts[connection["topic"]] += 1
            times = [min([*times, arrival]), max([*times, arrival])]
        self.start, last = times or (None, None)
        self.problem = (
            f"{shown(self.path)} has no complete index, as if it was cut or its recorder was killed: " +
            (f"read up to t = {self.seconds(last):.3f} s" if times else "nothing can be read"))

    def _scanned_messages(self, topics):
        classes = {}
        for connection, arrival, data in scan(self.path):
            if connection["topic"] not in topics:
                continue
            kind = connection["type"], connection["message_definition"]
            if kind not in classes:
                classes[kind] = genpy.dynamic.generate_dynamic(*kind)[kind[0]]
            yield connection["topic"], classes[kind]().deserialize(data), arrival


def is_of_version_2(path):
    """Of a bag. Throws Refused for another file."""
    try:
        if not Path(path).is_file():
            Path(path).stat()
            kind = "a folder" if Path(path).is_dir() else "not a regular file"
            raise Refused(f"{shown(path)} is {kind}: must be a bag")
        with open(path, "rb") as file:
            begin = file.read(max(map(len, MAGIC)))
    except (OSError, ValueError) as error:
        raise Refused(f"{shown(path)}: {getattr(error, 'strerror', None) or one_line(error)}; must be a bag")
    if not begin.startswith(MAGIC):
        raise Refused(f"{shown(path)} is not a bag: must begin with #ROSBAG V2.0" if begin else
                      f"{shown(path)} is empty: must be a bag")
    return begin.startswith(MAGIC[0])


def scan(path):
    """Yields connection, time of arrival and bytes of the messages of a bag of version 2.0, without its index, up to
    the first record that is cut or damaged. rosbag's reindexing drops the whole last chunk: all of a short bag."""
    connections = {}
    with open(path, "rb") as file:
        file.seek(len(MAGIC[0]))
        try:
            for header, data in records(file, os.fstat(file.fileno()).st_size):
                op = header[b"op"][0]
                if op == FILE_HEADER and header.get(b"encryptor"):
                    raise Refused(f"{shown(path)} is encrypted")
                if op == CONNECTION:
                    fields = {key.decode(): value.decode() for key, value in fields_of(data).items()}
                    fields["topic"] = header[b"topic"].decode()
                    connections[header[b"conn"]] = fields
                elif op == MESSAGE:
                    yield connections[header[b"conn"]], genpy.Time(*struct.unpack("<LL", header[b"time"])), data
        except (KeyError, IndexError, ValueError, struct.error, OSError, EOFError):
            return


def records(stream, size):
    """Yields header and data of the records of a bag, those within chunks in place of the chunks."""
    while (header := block(stream, size)) is not None:
        header = fields_of(header)
        if header[b"op"][0] == CHUNK and header[b"compression"] == b"none":
            stream.read(4)  # the records within follow, even where the chunk was never ended
            continue
        data = block(stream, size)
        if data is None:
            return
        if header[b"op"][0] == CHUNK:
            data = decompressed(data, header[b"compression"])
            yield from records(io.BytesIO(data), len(data))
        else:
            yield header, data


def block(stream, size):
    """Bytes that follow their length; None where they are cut."""
    head = stream.read(4)
    length = int.from_bytes(head, "little")
    return stream.read(length) if len(head) == 4 and stream.tell() + length <= size else None


def fields_of(header):
    fields = {}
    while header:
        length, = struct.unpack_from("<L", header)
        if not 0 < length <= len(header) - 4:
            raise ValueError(f"a field of {length} bytes")
        name, _, value = header[4:4 + length].partition(b"=")
        fields[name] = value
        header = header[4 + length:]
    return fields


def decompressed(data, compression):
    if compression == b"bz2":
        return bz2.decompress(data)
    if compression == b"lz4":
        try:
            import roslz4
        except ImportError:
            raise Refused("a bag compressed with lz4 needs the package python3-roslz4")
        try:
            return roslz4.decompress(data)
        except Exception as error:  # its C code names no type
            raise ValueError(one_line(error))
    raise ValueError(f"compression {compression!r}")
