"""What a bag tells of a base, as arrays over time in SI units: a row a message, cleaned of what cannot be used."""
import math
from dataclasses import dataclass, field

import numpy as np

from .bag import Refused, shown
from .wheels import JOINTS, WHEELS, sign_factors, velocity_sign

# name -> message type, and the usual names of its topic, in any namespace, the best first
TOPICS = {
    "odom": ("nav_msgs/Odometry", ("odom",)),
    "ground_truth": ("nav_msgs/Odometry", ("ground_truth", "base_pose_ground_truth")),
    "joint_states": ("sensor_msgs/JointState", ("joint_states",)),
    "roller_switches": ("youbot_base_sim/RollerSwitchStamped", ("roller_switches",)),
    "contacts": ("youbot_base_sim/ContactsStamped", ("contacts",)),
    "cmd_vel": ("geometry_msgs/Twist", ("cmd_vel",)),
    "velocity_command": ("brics_actuator/JointVelocities", ("velocity_command",)),
}
POSE = ("x", "y", "psi", "V_X", "V_Y", "Omega")
LARGEST = 1e9  # in SI units: beyond, a number is damaged
POWERS = ("drive", "bearing", "roller", "floor", "external")


class Missing(Exception):
    """What an analysis needs and the bag lacks, in one line."""


@dataclass
class Series:
    """Times, s, and columns of values with a row for each; `columns` are (n,) or, of the wheels, (n, 4)."""
    t: np.ndarray
    columns: dict

    def __getitem__(self, name):
        return self.columns[name]

    def __len__(self):
        return len(self.t)

    @property
    def period(self):
        """The usual time from one sample to the next, s."""
        return float(np.median(np.diff(self.t))) if len(self) > 1 else math.inf

    def at(self, t, name):
        """Values at times t, linear in between; NaN before, after and within gaps."""
        values = self.columns[name]
        wide = values.reshape(len(self), -1)
        result = np.stack([np.interp(t, self.t, column, left=np.nan, right=np.nan) for column in wide.T], axis=-1)
        if len(self) > 1:
            after = np.clip(np.searchsorted(self.t, t), 1, len(self) - 1)
            in_gap = (self.t[after] - self.t[after - 1] > self.max_step) & ~np.isin(t, self.t)
            result[in_gap] = np.nan
        return result.reshape(np.shape(t) + values.shape[1:])

    @property
    def max_step(self):
        """A longer step than this is a gap in the record, s."""
        return 5 * self.period + 1e-9

    def stretches(self):
        """Slices without gaps, of two samples at least."""
        breaks = np.flatnonzero(np.diff(self.t) > self.max_step) + 1
        bounds = [0, *breaks, len(self)]
        return [slice(a, b) for a, b in zip(bounds, bounds[1:]) if b - a > 1]


@dataclass
class Base:
    """The size of the base; the defaults are the youBot's, those of a scene without section `robot`."""
    wheel_radius: float = 0.05         # R, m
    roller_axis_radius: float = 0.0355  # R_d, m
    half_wheelbase: float = 0.235      # h, m
    half_track: float = 0.15           # l, m
    rollers_per_wheel: int = 6         # n

    def rolling_rates(self, V_X, V_Y, Omega):
        """Rates of the wheels, (n, 4), that roll at these velocities, by the kinematics of an ideal Mecanum wheel."""
        turn = (self.half_wheelbase + self.half_track) * Omega
        speeds = [V_X - V_Y - turn, V_X + V_Y + turn, V_X + V_Y - turn, V_X - V_Y + turn]
        return np.stack(speeds, -1) / self.wheel_radius

    def velocities(self, rates):
        """V_X, V_Y and Omega that wheels of these rates roll, the least squares' where they contradict each other."""
        fl, fr, bl, br = self.wheel_radius / 4 * rates.T
        return fl + fr + bl + br, -fl + fr + bl - br, (-fl + fr - bl + br) / (self.half_wheelbase + self.half_track)

    def jump_of_offset(self):
        """How far a contact point jumps along the axle when the next roller takes over, m."""
        return 2 * self.roller_axis_radius * math.tan(math.pi / self.rollers_per_wheel)


@dataclass
class Record:
    """The series of a bag, None for those that it lacks.

    odom, ground_truth: pose and velocity in the frame of the base. joint_states: rates positive forward, and, where the
    bag has them, position and effort. commands: V_X, V_Y, Omega that were commanded, held until the next.
    """
    base: Base
    series: dict = field(default_factory=dict)
    topics: dict = field(default_factory=dict)  # of each series
    notes: list = field(default_factory=list)   # what was left out or is assumed, a line each

    def get(self, name):
        return self.series.get(name)

    def need(self, name):
        if name not in self.series:
            kind, names = TOPICS[name]
            raise Missing("no %s (%s)" % (" or ".join(names), kind))
        return self.series[name]


def read_record(bag, base, chosen, progress):
    """Reads a Record. `chosen` has topics by name that go before the usual ones; `progress(n)` hears of n messages."""
    topics = find_topics(bag, chosen)
    names = {topic: name for name, candidates in topics.items() for topic in candidates}
    rows = {topic: [] for topic in names}
    record = Record(base)
    unusable, foreign = 0, {}
    for n, (topic, message, arrival) in enumerate(bag.messages(list(names))):
        progress(n)
        name = names[topic]
        try:
            row = ROWS[name](message)
            t = bag.time_of(message, arrival)
        except (AttributeError, TypeError):  # another definition of this type
            row = None
        if row is None:
            foreign[topic] = foreign.get(topic, 0) + 1
            continue
        if not all(abs(cell) <= LARGEST for cell in row):
            unusable += 1
            continue
        rows[topic].append((t, *row))
    if unusable:
        record.notes.append("%d messages have numbers that are not finite, or beyond %g: left out" % (
            unusable, LARGEST))
    for topic, count in foreign.items():
        if names[topic] != "joint_states":  # where an arm's joints are at home too
            record.notes.append("%s: %d messages lack what is needed, such as wheels fl, fr, bl and br: left out" % (
                shown(topic), count))
    for name, candidates in topics.items():
        used = [topic for topic in candidates if rows[topic]]
        if not used:
            continue
        record.topics[name] = used[0]
        if len(used) > 1:
            record.notes.append("takes %s; has also %s (another: --topic %s=TOPIC)" % (
                shown(used[0]), ", ".join(map(shown, used[1:])), name))
        add_series(record, name, rows[used[0]])
    return record


def find_topics(bag, chosen):
    """{name: topics that may tell it, the likeliest first}"""
    found = {}
    for name, (kind, usual) in TOPICS.items():
        if name in chosen:
            topic = chosen[name]
            if bag.types.get(topic) != kind:
                raise Refused("%s: %s=%s: must be a topic of type %s; it has %s" % (
                    shown(bag.path), name, shown(topic), kind, bag.shown_topics()))
            found[name] = [topic]
            continue
        found[name] = sorted((topic for topic in bag.types
                              if bag.types[topic] == kind and topic.rsplit("/", 1)[-1] in usual),
                             key=lambda topic: (usual.index(topic.rsplit("/", 1)[-1]), topic.count("/"), topic))
    return found


def pose_row(message):
    pose, twist = message.pose.pose, message.twist.twist
    q = pose.orientation
    psi = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
    return pose.position.x, pose.position.y, psi, twist.linear.x, twist.linear.y, twist.angular.z


def joints_row(message):
    """Positions, velocities and efforts of the wheels, NaN for a column that the message lacks; None without wheels."""
    if not set(JOINTS) <= set(message.name):
        return None
    index = [message.name.index(joint) for joint in JOINTS]
    row, has = [], []
    for column in (message.position, message.velocity, message.effort):
        has.append(len(column) == len(message.name))
        row += [column[i] for i in index] if has[-1] else [0.0] * 4
    return (*map(float, has), *row) if any(has[:2]) else None


def switch_row(message):
    wheel = message.wheel.rsplit("_", 1)[-1]
    return (WHEELS.index(wheel), message.direction, getattr(message, "count", 1)) if wheel in WHEELS else None


def contacts_row(message):
    contacts = {contact.wheel.rsplit("_", 1)[-1]: contact for contact in message.contacts}
    if set(contacts) != set(WHEELS):
        return None
    row = [message.kinetic_energy] + [getattr(message, name + "_power", 0.0) for name in POWERS]
    for wheel in WHEELS:
        contact = contacts[wheel]
        row += [contact.slip_velocity.x, contact.slip_velocity.y, contact.friction_share]
    return row


def twist_row(message):
    return message.linear.x, message.linear.y, message.angular.z


def rates_row(message):
    """Rates of the wheels; None unless all four are told: what else they do, their own loops decide."""
    rates = {entry.joint_uri: entry.value for entry in reversed(message.velocities) if entry.unit == "s^-1 rad"}
    return [rates[joint] for joint in JOINTS] if set(JOINTS) <= set(rates) else None


ROWS = {"odom": pose_row, "ground_truth": pose_row, "joint_states": joints_row, "roller_switches": switch_row,
        "contacts": contacts_row, "cmd_vel": twist_row, "velocity_command": rates_row}


def in_order(rows, keep_equal=False):
    """Rows by time, and how many are left out since another one has their time."""
    array = np.array(rows, float)
    array = array[np.argsort(array[:, 0], kind="stable")]
    new = np.ones(len(array), bool)
    if not keep_equal:
        new[1:] = np.diff(array[:, 0]) > 0
    return array[new], int(np.sum(~new))


def add_series(record, name, rows):
    table, repeated = in_order(rows, keep_equal=name in ("roller_switches", "cmd_vel", "velocity_command"))
    if repeated:
        record.notes.append("%s: %d messages have a stamp that was there before: left out (was the clock set back?)" %
                            (record.topics[name], repeated))
    t, values = table[:, 0], table[:, 1:]
    if name in ("odom", "ground_truth"):
        columns = dict(zip(POSE, values.T))
        columns["psi"] = np.unwrap(columns["psi"])
        record.series[name] = with_velocities(Series(t, columns), record, name)
    elif name == "joint_states":
        record.series[name] = wheel_series(t, values, record)
    elif name == "roller_switches":
        record.series[name] = Series(t, {"wheel": values[:, 0].astype(int), "direction": values[:, 1],
                                         "count": values[:, 2]})
    elif name == "contacts":
        columns = {"kinetic_energy": values[:, 0], **dict(zip(POWERS, values[:, 1:1 + len(POWERS)].T))}
        wheels = values[:, 1 + len(POWERS):].reshape(-1, 4, 3)
        record.series[name] = Series(t, {**columns, "slip": wheels[:, :, :2], "share": wheels[:, :, 2]})
    else:
        V = values.T if name == "cmd_vel" else record.base.velocities(values)
        record.series[name] = Series(t, dict(zip(POSE[3:], V)))


def with_velocities(series, record, name):
    """Poses differentiated, where the twists are none of theirs, as in a motion capture's record."""
    if len(series) < 3:
        return series
    step = np.diff(series.t)
    middle = lambda column: (column[1:] + column[:-1]) / 2
    V = differentiated(series)
    way = np.hypot(V["V_X"], V["V_Y"])
    off = np.hypot(V["V_X"] - middle(series["V_X"]), V["V_Y"] - middle(series["V_Y"]))
    if np.sum(off * step) <= 0.5 * np.sum(way * step):
        return series
    record.notes.append("%s: its twists are not those of its poses: takes the differences of the poses" %
                        shown(record.topics[name]))
    for column, values in V.items():
        series.columns[column] = np.interp(series.t, middle(series.t), values)
    return series


def differentiated(series):
    """V_X, V_Y and Omega, means over the steps."""
    step, psi = np.diff(series.t), (series["psi"][1:] + series["psi"][:-1]) / 2
    dx, dy = np.diff(series["x"]) / step, np.diff(series["y"]) / step
    return {"V_X": np.cos(psi) * dx + np.sin(psi) * dy, "V_Y": -np.sin(psi) * dx + np.cos(psi) * dy,
            "Omega": np.diff(series["psi"]) / step}


def wheel_series(t, values, record):
    """Rates positive forward: velocities in the positions' sense, else differences of the positions."""
    topic = shown(record.topics["joint_states"])
    has_position, has_velocity, has_effort = values[:, :3].all(axis=0)
    position, velocity, effort = values[:, 3:7], values[:, 7:11], values[:, 11:15]
    sign = None
    if has_position and has_velocity:
        sign = velocity_sign(list(zip(position.tolist(), velocity.tolist())))
    if not has_position:
        record.notes.append("%s has no positions: the velocities are taken as positive forward" % topic)
    elif sign is None and len(t) > 1:
        record.notes.append("%s: %s: takes the differences of the positions" % (
            topic, "its velocities do not agree with its positions" if has_velocity else "has no velocities"))
        middle, rates = (t[1:] + t[:-1]) / 2, np.diff(position, axis=0) / np.diff(t)[:, None]
        velocity = np.stack([np.interp(t, middle, column) for column in rates.T], -1)
    elif sign == "driver_exact":
        record.notes.append("%s: velocities of fl and bl have the driver's opposite sign: turned round" % topic)
    factors = np.array(sign_factors(sign))
    columns = {"rate": velocity * factors}
    if has_position:
        columns["position"] = position
    if has_effort and effort.any():
        columns["effort"] = effort * factors
    return Series(t, columns)
