"""Makes a velocity_table, torque_table or wheel_angle_table, for the drive of a scene, from a bag.

Without --measured the table has the commands: on /cmd_vel and /base/base_controller/velocity_command for a velocity
table, on /base/base_controller/torques_command for a torque table. With --measured it has the velocities or
efforts of /joint_states or /base/joint_states, one row per message. A wheel_angle_table has their positions, from
t = 0 on.

Angular velocities are in rad/s, torques in N m, both positive forward on all four wheels. t = 0 is the start of the
bag. A wheel is at zero until its first command. A bag that is cut or has no index is read up to where it breaks, and a
warning gives that instant. A bag whose times go back, such as one of two runs, is rejected, and so is one in which
~set_state put the base elsewhere. docs/replay.md says more.
"""
import math
from collections import Counter

from .bags import Bag, absolute
from .base import DRIVER_RADIUS, JOINTS, WHEELS, Base
from .command_line import Parser, Refused, complain, one_line, positive, shown
from .files import Outputs, write_whole
from .reading import add_bag_options, encoders_of
from .records import Missing, read_record
from .report import csv_text

TWIST, VELOCITIES, TORQUES, STATES = (
    "geometry_msgs/Twist", "brics_actuator/JointVelocities", "brics_actuator/JointTorques", "sensor_msgs/JointState")
TOPICS = {TWIST: ["/cmd_vel"],
          VELOCITIES: ["/base/base_controller/velocity_command"],
          TORQUES: ["/base/base_controller/torques_command"],
          STATES: ["/joint_states", "/base/joint_states"]}


def warn(text):
    complain("table_from_bag", "warning: " + text)


class ChosenTopics:
    """The messages of a bag on the given topics, else on those of the base."""

    def __init__(self, path, arguments):
        self.path, self.topics = shown(path), list(map(absolute, arguments.topic))
        self.bag = Bag(path, arguments.clock_offset, arguments.publisher)
        types = {absolute(topic): kind for topic, kind in self.bag.types.items()}
        for topic in self.topics:
            if topic not in types:
                raise Refused(f"{shown(path)}: no topic {shown(topic)}; it has {self.bag.shown_topics()}")
            if types[topic] not in TOPICS:
                raise Refused(f"{shown(path)}: {shown(topic)} is {shown(types[topic])}: must be "
                              f"{', '.join(sorted(TOPICS))}")

    def find(self, *types):
        return [topic for topic, kind in sorted(self.bag.types.items())
                if kind in types and absolute(topic) in (self.topics or TOPICS[kind])]

    def need(self, *types, advice=""):
        """The same; throws Refused where there are none."""
        found = self.find(*types)
        if not found:
            usual = " or ".join(topic for kind in types for topic in TOPICS[kind])
            raise Refused(f"{self.path}: no {usual}; it has {self.bag.shown_topics()}{advice}")
        return found


def twist_rates(twist, driver):
    """{wheel's index: rate} by the driver's kinematics, and complaints; no rates where the driver refuses the twist."""
    velocity = twist.linear.x, twist.linear.y, twist.angular.z
    if not all(map(math.isfinite, velocity)):
        return {}, ["a twist is not finite"]
    return dict(enumerate(driver.rolling_rates(*velocity))), []


def joint_values(entries, unit):
    """The same of a command that names wheels, as the base reads it: the first value with the right unit counts."""
    values, complaints = {}, []
    for entry in entries:
        if entry.joint_uri in JOINTS and entry.unit != unit:
            complaints.append(f"{entry.joint_uri} has the unit \"{shown(entry.unit)}\" instead of \"{unit}\"")
        elif entry.joint_uri in JOINTS:
            values.setdefault(JOINTS.index(entry.joint_uri), entry.value)
    complaints += [f"{JOINTS[i]} is {value}" for i, value in values.items() if not math.isfinite(value)]
    return {i: value for i, value in values.items() if math.isfinite(value)}, complaints


def commanded(chosen, types, arguments):
    """Rows of the commands; only those that change anything."""
    topics = chosen.need(*types, advice=". For a bag without commands, use --measured")
    others = chosen.find(*set(TOPICS) - {STATES} - set(types))
    if others:
        raise Refused(f"{chosen.path} has commands on {', '.join(others)} too: choose the topics of one table with "
                      "--topic")
    driver = Base(wheel_radius=arguments.wheel_radius, half_wheelbase=arguments.half_lengths, half_track=0)
    read = {TWIST: lambda message: twist_rates(message, driver),
            VELOCITIES: lambda message: joint_values(message.velocities, "s^-1 rad"),
            TORQUES: lambda message: joint_values(message.torques, "m^2 kg s^-2 rad^-1")}
    rows, now, complaints = [], [0.0] * 4, Counter()
    for t, connection, message in sorted(chosen.bag.messages_of_one_run(topics), key=lambda one: one[0]):
        command, wrong = read[connection.type](message)
        complaints.update(wrong)
        after = [command.get(i, old) for i, old in enumerate(now)]
        if not rows and len(command) < 4 and types == (TORQUES,):
            warn(f"{chosen.path}: its first torques leave out wheels: the table has zero, but the base held them at "
                 "rest")
        if not rows or after != now:
            rows.append((t, after))
        now = after
    for complaint, count in sorted(complaints.items()):
        warn(f"{chosen.path}: {complaint}: skipped, as the base does ({count} times)")
    return rows


def joint_states(chosen, base, field, sign="auto"):
    """Rows of what the wheels did: "position", "velocity" or "effort"."""
    topics = chosen.need(STATES)
    record = read_record(chosen.bag, base, {"joint_states": topics[0]}, only=["joint_states"], sign=sign)
    for note in record.notes:
        warn(f"{chosen.path}: {note}")
    try:
        states = record.need("joint_states", field)
    except Missing as reason:
        raise Refused(f"{chosen.path}: {reason}")
    if field != "position" and not record.has_sign:
        raise Refused(f"{chosen.path}: the sign of the velocities cannot be found from the positions; give "
                      "--joint-velocity-sign")
    if record.put:
        raise Refused(f"{chosen.path}: {record.put}: must be one run")
    return list(zip(states.t.tolist(), states[field].tolist()))


def write(path, rows):
    """Of rows with equal times, keeps the last."""
    last = {f"{t:.9f}": values for t, values in rows}
    cells = ([t, *(value + 0.0 for value in row)] for t, row in last.items())  # no -0.0
    write_whole(path, csv_text(["t", *WHEELS], cells))
    print(f"{shown(path)}: {len(last)} rows from {rows[0][0]:.3f} to {rows[-1][0]:.3f} s")


def main():
    parser = Parser("table_from_bag", __doc__, "drive.bag --velocity commands.csv",
                    "drive.bag --measured --velocity velocities.csv --torque torques.csv")
    parser.add_argument("bag", metavar="BAG")
    parser.add_argument("--velocity", metavar="FILE", help="velocity table to write")
    parser.add_argument("--torque", metavar="FILE", help="torque table to write")
    parser.add_argument("--angles", metavar="FILE", help="wheel_angle_table to write; not with the others")
    add_bag_options(parser)
    parser.add_argument("--measured", action="store_true", help="what the wheels did, instead of the commands")
    parser.add_argument("--topic", action="append", default=[],
                        help="read this topic instead of the usual ones; may be repeated")
    parser.add_argument("--joint-velocity-sign", choices=("auto", "consistent", "driver_exact"), default="auto",
                        help="sign of measured velocities and efforts: that of the positions, or, as from the real "
                             "driver, negated for fl and bl; auto (default): found from the positions")
    parser.add_argument("--wheel-radius", type=positive, default=DRIVER_RADIUS, metavar="M",
                        help="wheel radius in the driver that executed cmd_vel, m; default 0.0475, the youBot driver's")
    parser.add_argument("--half-lengths", type=positive, default=Base().half_lengths, metavar="M",
                        help="half the wheelbase plus half the track in that driver, m; default 0.385")
    arguments = parser.parse_args()
    wanted = [one for one in (("--velocity", arguments.velocity, "velocity", (TWIST, VELOCITIES)),
                              ("--torque", arguments.torque, "effort", (TORQUES,))) if one[1]]
    if bool(wanted) == bool(arguments.angles):
        parser.error("give --velocity FILE, --torque FILE or both, or --angles FILE alone")
    base = Base()
    base.joints, base.turns = encoders_of(arguments)
    outputs = Outputs([arguments.bag])
    paths = {"--angles": arguments.angles} if arguments.angles else {option: path for option, path, *_ in wanted}
    for option, path in paths.items():
        outputs.claim(option, path)
    chosen = ChosenTopics(arguments.bag, arguments)
    try:
        if arguments.angles:
            rows = joint_states(chosen, base, "position")
            tables = [[(t - rows[0][0], angles) for t, angles in rows]]
        elif arguments.measured:
            tables = [joint_states(chosen, base, field, arguments.joint_velocity_sign) for _, _, field, _ in wanted]
        else:
            tables = [commanded(chosen, types, arguments) for _, _, _, types in wanted]
    except (AttributeError, TypeError) as error:  # another definition of a type
        raise Refused(f"{chosen.path}: its messages are not of the types that they say: {one_line(error)}")
    if chosen.bag.note and not (arguments.measured or arguments.angles):
        warn(f"{chosen.path}: {chosen.bag.note}")
    if chosen.bag.problem:
        warn(chosen.bag.problem)
    for path, rows in zip(paths.values(), tables):
        write(path, rows)
