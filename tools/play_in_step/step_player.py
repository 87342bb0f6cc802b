"""Plays bags to unmodified nodes in step: /clock and each message go out once all nodes that follow /clock rest, so that
what the nodes make of them is the same in every run, as fast as they answer. Needs a roscore, and /use_sim_time true before
the nodes start."""
import contextlib
import hashlib
import heapq
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter

from youbot_base_sim.bags import Damaged, absolute, require_bag, scan
from youbot_base_sim.command_line import Failed, Parser, Progress, Refused, positive, shown

SETTLE = 1.0  # s of wall time without a new node, after which time begins
SHORTEST = 1e-6  # s, step of /clock
NOT_OUTPUTS = {"/clock", "/rosout", "/rosout_agg", "/tf_static"}


def read_arguments():
    parser = Parser("play_in_step", __doc__, "drive.bag --output result.bag --wait-for /my_filter --wait-for /my_follower",
                    epilog="Exit status: 0 done, 1 it could not be completed or another run may differ, 2 rejected input.")
    parser.add_argument("bag", nargs="+", help="messages of all bags by their times of arrival")
    parser.add_argument("--output", metavar="BAG", help="records what the nodes publish, which must not exist yet")
    parser.add_argument("--wait-for", action="append", default=[], metavar="NODE",
                        help=f"time begins when this node follows /clock; may be repeated. Without, {SETTLE:g} s after the "
                        "last node came")
    parser.add_argument("--topic", action="append", default=[], metavar="TOPIC", help="plays these alone; may be repeated")
    parser.add_argument("--period", type=positive, default=0.01, metavar="S", help="longest step of /clock; 0.01 unless given")
    parser.add_argument("--timeout", type=positive, default=10.0, metavar="S",
                        help="wall time for a node to rest, after which time goes on without it; 10 unless given")
    given = sys.argv[1:]
    while given and given[-1].startswith(("__name:=", "__log:=")):  # which roslaunch appends
        given.pop()
    arguments = parser.parse_args(given)
    if arguments.period < SHORTEST:
        parser.error(f"--period = {arguments.period:g}: must be a number of {SHORTEST:g} or more")
    return arguments


class Messages:
    """Messages of bags by time. Bags are read twice: what is out of order in them, they are sorted over."""

    def __init__(self, paths, topics):
        """Throws Refused for files that are no bags or damaged, and for topics that they lack."""
        self.paths, self.topics = paths, {absolute(topic) for topic in topics}
        self.connections, self.count, self.back, latest, found = {}, 0, 0.0, None, set()
        for path in paths:
            require_bag(path)
            latest = None
            try:
                for connection, arrival, _ in scan(path):
                    found.add(absolute(connection.topic))
                    if self.is_played(connection):
                        known = self.connections.setdefault(absolute(connection.topic), connection)
                        if known.md5sum != connection.md5sum:
                            raise Refused(f"{shown(path)}: {shown(connection.topic)} has two types")
                        latest = max(latest or arrival, arrival)
                        self.back = max(self.back, seconds_between(arrival, latest))
                        self.count += 1
            except Damaged as damage:
                raise Refused(f"{shown(path)} {damage}: must be whole; rosbag reindex mends a copy")
        for topic in self.topics - found:
            raise Refused(f"--topic {shown(topic)}: must be one of {', '.join(map(shown, sorted(found)))}")
        if not self.count:
            raise Refused(f"{shown(paths[0])} has no messages to play")

    def is_played(self, connection):
        topic = absolute(connection.topic)
        return topic != "/clock" and (not self.topics or topic in self.topics)

    def of_bag(self, k):
        waiting = []
        for number, (connection, arrival, data) in enumerate(scan(self.paths[k])):
            if not self.is_played(connection):
                continue
            heapq.heappush(waiting, (arrival, k, number, connection, data))
            while seconds_between(waiting[0][0], arrival) > self.back:
                yield heapq.heappop(waiting)
        while waiting:
            yield heapq.heappop(waiting)

    def __iter__(self):
        """Time of arrival, connection and bytes."""
        for arrival, _, _, connection, data in heapq.merge(*map(self.of_bag, range(len(self.paths)))):
            yield arrival, connection, data


def seconds_between(early, late):
    return late.secs - early.secs + 1e-9 * (late.nsecs - early.nsecs)


def raw_class(connection):
    """A class of messages that are published as the bytes that they are."""
    import rospy
    return type("Raw", (rospy.AnyMsg,), {"_type": connection.type, "_md5sum": connection.md5sum,
                                         "_full_text": connection.definition})


class Gate:
    """A clock_gate: waits until all nodes rest."""

    def __init__(self, name, process):
        import rospy
        from std_msgs.msg import String, Time as TimeMessage
        self.answer, self.answered, self.message, self.process = "", threading.Event(), TimeMessage, process
        self.publisher = rospy.Publisher(name + "/advance", TimeMessage, queue_size=10, tcp_nodelay=True)
        self.subscriber = rospy.Subscriber(name + "/done", String, self.take, queue_size=10, tcp_nodelay=True)

    def is_there(self):
        return self.publisher.get_num_connections() > 0 and self.subscriber.get_num_connections() > 0

    def take(self, message):
        self.answer = message.data
        self.answered.set()

    def advance(self, now):
        """Sends `now` on /clock, if it is not there yet, and waits. Throws Failed where that has no end."""
        import genpy
        import rospy
        self.answered.clear()
        self.publisher.publish(self.message(genpy.Time(*now)))
        while not self.answered.wait(1):
            if self.process.poll() is not None or rospy.is_shutdown():
                raise Failed(f"interrupted at t = {now[0]}.{now[1]:09} s")


class Outputs:
    """The messages that the nodes publish: sorted within an instant by topic and node; of each topic count and hash."""

    def __init__(self, path, played):
        import rosbag
        self.bag = rosbag.Bag(path, "w") if path else None
        self.played, self.subscribers, self.waiting = played, {}, []
        self.hashes, self.counts = {}, Counter()

    def find(self, topics):
        """Listens to topics that have appeared: pairs of name and type."""
        import rospy
        for topic, _ in topics:
            if topic in self.subscribers or topic in self.played or topic in NOT_OUTPUTS or "/clock_gate" in topic:
                continue
            self.subscribers[topic] = rospy.Subscriber(topic, rospy.AnyMsg, self.take, topic, queue_size=1000,
                                                       tcp_nodelay=True)

    def take(self, message, topic):
        self.waiting.append((topic, message._connection_header["callerid"], len(self.waiting), message))

    def write(self, now):
        """The messages since the last call, with this time."""
        import genpy
        waiting, self.waiting = sorted(self.waiting, key=lambda one: one[:3]), []
        for topic, node, _, message in waiting:
            data, header = message._buff, message._connection_header
            self.hashes.setdefault(topic, hashlib.sha256()).update(b"%d %d %d " % (*now, len(data)) + data)
            self.counts[topic] += 1
            if self.bag:
                kind = {key: header[key] for key in ("type", "md5sum", "message_definition")}
                self.bag.write(topic, message, genpy.Time(*now), connection_header={"topic": topic, **kind, "callerid": node})


def await_nodes(arguments, gate):
    """Until the nodes that are waited for follow /clock. Throws Failed where they do not come."""
    import rospy
    known, since, deadline = None, time.monotonic(), time.monotonic() + 60
    own = {rospy.get_name(), "/clock_gate", "/rosout"}
    wanted = {absolute(name) for name in arguments.wait_for}
    while True:
        followers = {node for topic, nodes in rospy.get_master().getSystemState()[2][1] if topic == "/clock"
                     for node in nodes} - own
        if followers != known:
            known, since = followers, time.monotonic()
        is_settled = followers and time.monotonic() - since > SETTLE
        if gate.is_there() and (wanted <= followers if wanted else is_settled):
            return followers
        if gate.process.poll() is not None or rospy.is_shutdown():
            raise Failed("interrupted before time began")
        if time.monotonic() > deadline:
            raise Failed(f"waited 60 s for {', '.join(sorted(wanted - followers)) or 'a node that follows /clock'}: "
                         "must start after /use_sim_time is true")
        time.sleep(0.1)


def play(messages, arguments, gate, outputs):
    """Plays all. Returns the time played, s."""
    import rospy
    publishers = {topic: rospy.Publisher(topic, raw_class(one), queue_size=100, latch=one.latching == "1", tcp_nodelay=True)
                  for topic, one in messages.connections.items()}
    nodes = await_nodes(arguments, gate)
    outputs.find(rospy.get_published_topics())
    period, now, first = round(1e9 * arguments.period), None, None
    with Progress(messages.count) as progress:
        for number, (arrival, connection, data) in enumerate(messages):
            due = max(arrival.secs * 10 ** 9 + arrival.nsecs, 1)  # ROS has no time zero
            while now is None or now < due:
                now = due if now is None else min(due, now - now % period + period)
                gate.advance(divmod(now, 10 ** 9))
                outputs.write(divmod(now, 10 ** 9))
            first = first if first is not None else now
            publishers[absolute(connection.topic)].publish(rospy.AnyMsg().deserialize(data))
            gate.advance(divmod(now, 10 ** 9))
            outputs.write(divmod(now, 10 ** 9))
            if number % 100 == 0:
                outputs.find(rospy.get_published_topics())
                progress.show(number, f"t = {1e-9 * (now - first):.1f} s")
    return nodes, 1e-9 * (now - first)


@contextlib.contextmanager
def started_gate(arguments):
    command = ["rosrun", "youbot_base_sim", "clock_gate", "__name:=clock_gate", f"_timeout:={arguments.timeout}"]
    with subprocess.Popen(command, start_new_session=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as gate:
        try:
            yield gate
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(gate.pid, signal.SIGINT)


def main():
    arguments = read_arguments()
    messages = Messages(arguments.bag, arguments.topic)
    if arguments.output and os.path.lexists(arguments.output):
        raise Refused(f"--output {shown(arguments.output)}: exists already")
    del sys.argv[1:]
    import rospy
    try:
        if not rospy.get_param("/use_sim_time", False):
            raise Refused("/use_sim_time: must be true before the nodes start: rosparam set /use_sim_time true")
    except OSError:
        raise Failed(f"no roscore at {os.environ.get('ROS_MASTER_URI', 'ROS_MASTER_URI')}")
    part = arguments.output and arguments.output + ".incomplete"
    outputs = Outputs(part, messages.connections)
    with started_gate(arguments) as process:
        rospy.init_node("play_in_step")
        gate, begin = Gate("/clock_gate", process), time.monotonic()
        try:
            nodes, played = play(messages, arguments, gate, outputs)
        finally:
            if outputs.bag:
                outputs.bag.close()
    if part and not gate.answer:
        os.replace(part, arguments.output)
    wall = time.monotonic() - begin
    print(f"{messages.count} messages of {len(messages.connections)} topics, {played:.1f} s, to {', '.join(sorted(nodes))} in "
          f"{wall:.1f} s of wall time")
    for topic, count in sorted(outputs.counts.items()):
        print(f"  {topic}: {count} messages, sha256 {outputs.hashes[topic].hexdigest()[:16]}")
    if gate.answer:
        raise Failed(f"{gate.answer}{f'; {part} has what came back' if part else ''}")
