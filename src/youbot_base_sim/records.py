"""The topics of a base in a bag, as arrays over time in SI units: a row per message, without what cannot be used."""
import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from . import agreement, ground_truth
from .bags import absolute
from .base import WHEELS, Base
from .command_line import LONGEST_QUOTE, Refused, shown
from .series import POSE, Missing, Series, Unusable, differentiated, middles

LARGEST = 1e9  # in SI units: beyond, a number is damaged
MAX_NAMES = 12  # of joints, in a message
FASTEST, RARE = 100, 0.01  # rad/s, of wheels; share of steps
FASTEST_BASE = 10.0  # m/s: beyond, poses jump
MIN_FIT, MAX_APART = 0.8, 0.05  # of velocities to positions: squared correlation; relative difference of factors
OTHER_PERIOD = 0.03  # a counter that ends so much earlier than a known one is another
EMPTY = "is not there"  # of fields: why they cannot be used
POWERS = ("drive", "bearing", "roller", "floor", "external")


@dataclass
class Record:
    """The series of a bag by the names of TOPICS: poses with velocities in the frame of the base, wheels positive
    forward, commands as V_X, V_Y and Omega, held until the next."""
    base: Base
    sign: str = "auto"   # of velocities and efforts: "consistent" with the positions, "driver_exact", "auto": found
    series: dict = field(default_factory=dict)
    topics: dict = field(default_factory=dict)  # of each series
    origins: dict = field(default_factory=dict)  # of each topic, in words: publisher, frames, joints
    alignment: object = None  # of a marker's ground truth, see ground_truth.Alignment
    poses: Series = None      # of the base by ground truth, which series has smoothed where a tracker measured it
    has_rates: bool = True    # rather than differences of the wheels' positions
    has_sign: bool = True     # found by positions, or given
    unusable: dict = field(default_factory=dict)  # name -> why no message of its topic can be used
    notes: list = field(default_factory=list)   # what was left out or is assumed, a line each
    part: tuple = (-math.inf, math.inf)  # from when to when it is read, s
    put: str = ""             # when and by what the base was put elsewhere; empty: it was not

    def get(self, name, *columns):
        """The rows of a series in which these columns are known, None if there are none."""
        return self.series[name].known(*columns) or None if name in self.series else None

    def need(self, name, *columns):
        series = self.get(name, *columns)
        if not series:
            raise Missing(self.lack(name, *columns))
        return series

    def lack(self, name, *columns):
        """The reason why `get` has none."""
        if name in self.series:
            unknown = [column for column in columns if not self.series[name].known(column)]
            return f"{shown(self.topics[name])} has no {', '.join(unknown or columns)}"
        if name in self.unusable:
            return str(self.unusable[name])
        return f"no {' or '.join(TOPICS[name].usual)} ({' or '.join(TOPICS[name].kinds)})" + (
            " and no --frames of /tf" if name == "ground_truth" else "")


COMMANDS = ("cmd_vel", "velocity_command", "torques_command")


def read_record(bag, base, chosen=(), progress=lambda n: None, only=None, namespace="", frames=(),
                of_marker=None, sign="auto"):
    """Reads a Record of `only` these TOPICS, all unless given. `chosen`: topics by name that replace the usual ones.
    `frames`: fixed and moving, whose transforms are ground truth. `of_marker`: whether it is a marker's, at a clock of
    its own, or the base's; None: by its type."""
    topics = find_topics(bag, chosen, only or TOPICS, namespace)
    names = {topic: name for name, candidates in topics.items() for topic in candidates}
    rows, state_sets = {topic: {} for topic in names}, {topic: [] for topic in bag.state_sets(names)}
    record, left_out = Record(base, sign, notes=[*bag.notes]), LeftOut()
    record.notes += [f"{shown(topic)}: {offset:+.6g} s are added to its times" for topic, offset in bag.offsets.items()]
    sampled = [topic for topic, name in names.items() if TOPICS[name].is_sampled] or list(names)
    others = [*set(names) - set(sampled), *state_sets]
    for n, (t, connection, message) in enumerate(bag.messages_of_one_run(sampled, others)):
        progress(n)
        topic = connection.topic
        if topic not in names:
            state_sets[topic].append(t)
            continue
        try:
            fields = TOPICS[names[topic]].kinds[bag.types[topic]][0](message, base)
        except (AttributeError, TypeError):  # another definition of this type
            fields = None
        row = left_out.cleaned(topic, fields, getattr(message, "name", ()))
        if t != t:
            left_out.stale[topic] += 1
        elif row:
            rows[topic].setdefault(connection.publisher, []).append((t, *row))
            record.origins.setdefault((topic, connection.publisher), origin(connection.publisher, message))
    record.notes += left_out.notes(names)
    record.origins = {topic: record.origins[topic, largest_first(found)[0]]
                      for topic, found in rows.items() if found}
    rows = {topic: choose_publisher(record, topic, found, TOPICS[names[topic]].is_sampled)
            for topic, found in rows.items()}
    choose_part(record, bag, {topic: found for topic, found in rows.items() if found}, state_sets)
    for name, candidates in topics.items():
        for topic in candidates:
            rows[topic] = within(record.part, rows[topic], is_held=name in COMMANDS)
        used = [topic for topic in candidates if rows[topic]]
        if not used:
            record.unusable.update((name, left_out.why_none(topic, base)) for topic in reversed(candidates))
            continue
        if len(used) > 1:
            record.notes.append(f"uses {shown(used[0])}, not {', '.join(map(shown, used[1:]))} (to choose: "
                                f"--topic {name}=TOPIC)")
        add_series(record, name, used[0], rows[used[0]], TOPICS[name].kinds[bag.types[used[0]]][1])
    add_truth(record, bag, frames, of_marker)
    record.notes += agreement.contradictions(record)
    return record


def origin(publisher, message):
    """The sender of a message, its frames, and joints that it names twice."""
    names = getattr(message, "name", ())
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    frame, child = (getattr(part, name, "") for part, name in (
        (getattr(message, "header", None), "frame_id"), (message, "child_frame_id")))
    return f", by {shown(publisher)}" * bool(publisher) + f", in {shown(frame)}" * bool(frame) + (
        f" of {shown(child)}" * bool(child)) + f", with {', '.join(map(shown, twice))} twice: the first" * bool(twice)


def commands_of(record, driver, names):
    """Times and commanded values of the wheels, of all these topics in order, without what is said again. `driver`: the
    base by which twists become rates."""
    commands = []
    for series in filter(None, map(record.get, names)):
        rates = series["rates"] if "rates" in series.columns else np.stack(
            driver.rolling_rates(*(series[one] for one in POSE[3:])), -1)
        commands += zip(series.t.tolist(), rates.tolist())
    table, before = {}, None
    for t, rates in sorted(commands, key=lambda command: command[0]):
        if rates != before:
            table[t] = before = rates
    return np.array(list(table)), np.array(list(table.values())).reshape(-1, 4)


def largest_first(rows):
    """Publishers, that with the most messages first, the first of equals."""
    return sorted(rows, key=lambda publisher: -len(rows[publisher]))


def choose_publisher(record, topic, rows, is_sampled):
    """The rows of a topic: of several nodes that publish samples, those of the one with the most, the first of equals.
    Commands and events may come from several."""
    used, *others = largest_first(rows) or [""]
    if others:
        left = ", not " + ", ".join(f"{shown(one)} ({len(rows[one])})" for one in others)
        which = f"{shown(used)} ({len(rows[used])} messages){left}" if is_sampled else f"all, {', '.join(map(shown, rows))}"
        record.notes.append(f"{shown(topic)} has {len(rows)} publishers: uses {which} (to choose: --publisher TOPIC=NODE)")
    return rows[used] if others and is_sampled else sorted(sum(rows.values(), []), key=lambda row: row[0])


def choose_part(record, bag, rows, state_sets):
    """The longest part in which the base was not put elsewhere."""
    if not rows or not any(state_sets.values()):
        return
    first, last = (choose(row[0] for found in rows.values() for row in found) for choose in (min, max))
    of_base = bag.state_sets(rows)
    times = sorted(t for topic in of_base for t in state_sets[topic] if first <= t < last)
    bounds = [first, *times, last]
    begin, end = max(zip(bounds, bounds[1:]), key=lambda part: part[1] - part[0])
    if times:
        record.part = (begin if begin > first else -math.inf, end if end < last else math.inf)
        record.put = (f"the base was put elsewhere at t = {', '.join(f'{t:.3f}' for t in times)} s, by "
                      f"{', '.join(map(shown, of_base))}")
        record.notes.append(f"{record.put}: judged is the longest part, from t = {begin:.3f} s to {end:.3f} s")


def within(part, rows, is_held=False):
    """The rows of a part; also the last one before it, of commands that are held."""
    inside = [row for row in rows if part[0] < row[0] <= part[1]]
    before = [row for row in rows if row[0] <= part[0]] if is_held else []
    return [(part[0], *max(before, key=lambda row: row[0])[1:])] + inside if before else inside


def add_truth(record, bag, frames, of_marker):
    """Reads transforms, if they are asked for; aligns what is a marker's."""
    try:
        if frames:
            poses = ground_truth.transforms_to_poses(bag, *frames, lambda *of: choose_publisher(record, *of, True))
            rows = within(record.part, poses)
            add_series(record, "ground_truth", " -> ".join(frames), rows, ground_truth.pose_series)
        for name in ("odom", "ground_truth"):
            agreement.to_metres(record, name)
            note_jumps(record, name)
        poses, topic = record.get("ground_truth", "x", "y", "psi"), record.topics.get("ground_truth")
        record.poses = poses
        offset = bag.offsets.get("/tf" if frames else absolute(topic or ""))
        if is_tracked := poses and "upright" in poses.columns:
            ground_truth.check_upright(poses, shown(topic))
        if poses and (bag.types.get(topic) in ground_truth.KINDS if of_marker is None else of_marker):
            poses, record.alignment = ground_truth.align(poses, agreement.rolled(record),
                                                         record.get("odom", *POSE[:3]), shown(topic), record.base,
                                                         0 if offset is not None else ground_truth.LARGEST_CLOCK)
            record.poses = poses
            if offset is not None:
                record.alignment = record.alignment._replace(clock=(offset, 0))
        if record.alignment or is_tracked:
            record.series["ground_truth"] = ground_truth.smoothed(poses)
    except Missing as reason:
        record.unusable["ground_truth"], record.poses = reason, None
        for of_topics in (record.series, record.topics):
            of_topics.pop("ground_truth", None)
        record.notes.append(f"ground truth is not used: {reason}")


def note_jumps(record, name):
    """Says where poses jump, as of odometry that was set anew, or of a tracker that took another body for it."""
    series = record.get(name, "x", "y")
    steps, times = (np.hypot(*np.diff([series["x"], series["y"]])), np.diff(series.t)) if series else ((), ())
    jumps = np.flatnonzero(steps > FASTEST_BASE * times + 0.01) if series else ()
    if len(jumps):
        record.notes.append(f"{shown(record.topics[name])}: poses jump {len(jumps)} times, first at t = "
                            f"{series.t[jumps[0] + 1]:.3f} s (set anew, spikes, or two nodes?)")


class LeftOut:
    """Replaces the fields of messages that cannot be used by NaN, and counts them."""

    def __init__(self):
        self.foreign, self.stale = Counter(), Counter()  # numbers of messages
        self.fields = Counter()  # of messages by topic, field and reason
        self.seen, self.filled = set(), set()  # topics; their fields that are not always empty
        self.joints = {}  # in messages that are not of the wheels, in their order

    def cleaned(self, topic, fields, joints):
        """The numbers of a message in one row; None if nothing in it can be used. A number that is None is not known,
        and no error."""
        self.seen.add(topic)
        if fields is None:
            self.foreign[topic] += 1
            self.joints.setdefault(topic, {}).update(dict.fromkeys(joints))
            return None
        row, left_out = [], 0
        for name, values in fields.items():
            if not isinstance(values, Unusable) and not all(value is None or abs(value) <= LARGEST for value in values):
                values = Unusable(f"is not finite, or beyond {LARGEST:g}", len(values))
            if isinstance(values, Unusable):
                self.fields[topic, name, values.reason] += 1
                left_out += 1
            if getattr(values, "reason", "") != EMPTY:
                self.filled.add((topic, name))
            row += [math.nan if value is None else value for value in values]
        return row if left_out < len(fields) else None

    def why_none(self, topic, base):
        """The reason where no message of a topic can be used."""
        if self.joints.get(topic):
            if set(base.joints) <= set(self.joints[topic]):
                return f"{shown(topic)} has the wheels in separate messages: must have all four in one"
            joints = ", ".join(list(self.joints[topic])[:MAX_NAMES])[:MAX_NAMES * LONGEST_QUOTE]
            return (f"{shown(topic)} has the joints {shown(joints)}, not the wheels "
                    f"{', '.join(base.joints)}: name them, fl, fr, bl and br, with --joints")
        return f"{shown(topic)} has no message " + (
            "with the wheels fl, fr, bl and br or another part that is needed" if topic in self.foreign else
            "with usable numbers" if topic in self.seen else "that can be read")

    def notes(self, names):
        for (topic, field_name, reason), number in self.fields.items():
            if reason != EMPTY or (topic, field_name) in self.filled:
                yield f"{shown(topic)}: {field_name} of {number} messages {reason}: left out"
        for topic, number in self.stale.items():
            yield f"{shown(topic)}: stamps of {number} messages are far from their arrival, unlike others: left out"
        for topic, number in self.foreign.items():
            if names[topic] != "joint_states":  # where an arm's joints are at home too
                yield (f"{shown(topic)}: {number} messages lack the wheels fl, fr, bl and br or another part that is "
                       "needed: left out")


def find_topics(bag, chosen, names, namespace):
    """{name: topics that may have it, the likeliest first}"""
    found, begin = {}, f"/{namespace or ''}/".replace("//", "/")
    for name in names:
        wanted = TOPICS[name]
        topics = {topic: topic.rsplit("/", 1)[-1] for topic in bag.types if bag.types[topic] in wanted.kinds}
        if name not in chosen:
            usual = [topic for topic, last in topics.items()
                     if last in wanted.usual and absolute(topic).startswith(begin)]
            found[name] = sorted(usual, key=lambda topic: (wanted.usual.index(topics[topic]), topic.count("/"), topic))
            continue
        found[name] = [topic for topic in topics if absolute(topic) == absolute(chosen[name])]
        if not found[name]:
            raise Refused(f"{shown(bag.path)}: {name}={shown(chosen[name])}: must be a topic of type "
                          f"{' or '.join(wanted.kinds)}; it has {bag.shown_topics()}")
    return found


def pose_fields(message, _):
    pose, twist = message.pose.pose, message.twist.twist
    place = ground_truth.matrix(pose.position, pose.orientation) if ground_truth.is_rotation(pose.orientation) else None
    return {"pose": (pose.position.x, pose.position.y, math.atan2(place[1][0], place[0][0])) if place else (
        Unusable(ground_truth.NO_ROTATION, 3)),
            "twist": (twist.linear.x, twist.linear.y, twist.angular.z)}


def joint_fields(message, base):
    if not set(base.joints) <= set(message.name):
        return None
    index = [message.name.index(joint) for joint in base.joints]
    return {name: [scale * column[i] for i, scale in zip(index, scales)] if len(column) == len(message.name) else
            Unusable("has fewer or more numbers than there are names" if column else EMPTY, 4)
            for name, column, scales in (("position", message.position, base.turns),
                                         ("velocity", message.velocity, np.sign(base.turns)),
                                         ("effort", message.effort, np.sign(base.turns)))}


def switch_fields(message, _):
    wheel = message.wheel.rsplit("_", 1)[-1]
    return None if wheel not in WHEELS else {
        "switch": (WHEELS.index(wheel), message.direction, getattr(message, "count", 1)), "phi": (message.phi,)}


def contact_fields(message, _):
    contacts = {contact.wheel.rsplit("_", 1)[-1]: contact for contact in message.contacts}
    if set(contacts) != set(WHEELS):
        return None
    ordered = [contacts[wheel] for wheel in WHEELS]
    return {"kinetic_energy": (message.kinetic_energy,),
            **{name + "_power": (getattr(message, name + "_power", 0.0),) for name in POWERS},
            **{name: [number for contact in ordered for number in (getattr(contact, name).x, getattr(contact, name).y)]
               for name in ("slip_velocity", "friction_force")},
            **{name: [getattr(contact, name) for contact in ordered] for name in ("friction_share", "normal_force")}}


def twist_fields(message, _):
    message = getattr(message, "twist", message)
    return {"twist": (message.linear.x, message.linear.y, message.angular.z)}


def command_fields(entries, unit, base):
    """Values of the wheels as the base reads them: the first with the right unit counts, and wheels that the command
    does not name keep theirs."""
    fields = {}
    for joint in base.joints:
        given = [entry for entry in entries if entry.joint_uri == joint]
        right = [entry.value for entry in given if entry.unit == unit]
        fields[joint] = (Unusable(f'has the unit "{given[0].unit}" instead of "{unit}"', 1) if given and not right else
                         (right or [None])[:1])
    return fields if {entry.joint_uri for entry in entries} & set(base.joints) else None


def add_series(record, name, topic, rows, series):
    """Sorts rows by time; keeps of those with equal times the first, but of commands and switches, which may share one."""
    record.topics[name], topic = topic, shown(topic)
    table = np.array(rows, float)
    table = table[np.argsort(table[:, 0], kind="stable")]
    new = np.diff(table[:, 0], prepend=-np.inf) > 0
    if TOPICS[name].is_sampled and not new.all():
        record.notes.append(f"{topic}: {np.sum(~new)} messages repeat an earlier stamp: left out (was the clock set "
                            "back?)")
        table = table[new]
    result = record.series[name] = series(table[:, 0], table[:, 1:], record, topic)
    steps = np.diff(result.t)
    gaps = np.flatnonzero(steps > result.max_step) if TOPICS[name].is_sampled else []
    if len(gaps):
        longest = gaps[np.argmax(steps[gaps])]
        record.notes.append(f"{topic}: a gap of {steps[longest]:.3f} s from t = {result.t[longest]:.3f} s" + (
            f", the longest of {len(gaps)}" if len(gaps) > 1 else ""))


def pose_series(t, values, record, topic):
    """Poses are differentiated if the twists do not fit them, as in a record of motion capture."""
    series = Series(t, dict(zip(POSE, values.T)))
    there = np.isfinite(series["psi"])
    series["psi"][there] = np.unwrap(series["psi"][there])
    poses = series.known("x", "y", "psi")
    if len(poses) < 3:
        return series
    V, step, psi = differentiated(poses), np.diff(poses.t), middles(poses["psi"])
    twist = middles(poses["V_X"]) + 1j * middles(poses["V_Y"])  # in the plane
    true, known = V["V_X"] + 1j * V["V_Y"], np.isfinite(twist)
    way, off, off_fixed = (np.sum((np.abs(one) * step)[known]) for one in (
        true, twist - true, twist * np.exp(-1j * psi) - true))
    if known.any() and off_fixed < 0.5 * min(off, way):
        record.notes.append(f"{topic}: its twists are in the fixed frame: turned into the base's")
        turned = (series["V_X"] + 1j * series["V_Y"]) * np.exp(-1j * series["psi"])
        series.columns.update(V_X=turned.real, V_Y=turned.imag)
        return series
    if known.any() and off <= 0.5 * way:
        return series
    record.notes.append(f"{topic}: its twists do not fit its poses: velocities are differences of the poses")
    series.columns.update((name, at_samples(t, poses.t, values)) for name, values in V.items())
    return series


def at_samples(t, known, means):
    """Means over the steps between the times `known`, at these times; NaN at the others of t."""
    return np.where(np.isin(t, known), np.interp(t, middles(known), means), np.nan)


def wheel_series(t, values, record, topic):
    """Positions that count on, and angular velocities in rad/s, positive forward: as the positions have it, else
    differences of the positions."""
    series = Series(t, dict(zip(("position", "velocity", "effort"), np.split(values, 3, axis=1))))
    count_on(series, record, topic)
    positions, both = series.known("position"), series.known("position", "velocity")
    signs, scale, why = velocity_scale(both, record.base) if both else ((1, 1, 1, 1), None, "it has no velocities")
    record.has_sign = record.sign != "auto" or bool(positions) and why != STILL
    if record.sign != "auto":
        signs, scale, why = SIGNS[record.sign], 1, ""
    if not positions:
        record.notes.append(f"{topic} has no positions: velocities are assumed in rad/s and positive forward")
    elif scale is None and len(positions) > 1:
        record.notes.append(f"{topic}: {why}: velocities are differences of the positions")
        record.has_rates, scale = False, 1
        means = np.diff(positions["position"], axis=0) / np.diff(positions.t)[:, None]
        series.columns["velocity"] = np.stack([at_samples(t, positions.t, wheel) for wheel in means.T], -1)
        series.columns["effort"] = series["effort"] * signs
        signs = (1, 1, 1, 1)
    elif why:
        record.notes.append(f"{topic}: {why}")
    series.columns["velocity"] = series["velocity"] * signs / (scale or 1)
    series.columns["effort"] = series["effort"] * signs
    if not np.nan_to_num(series["effort"]).any():
        del series.columns["effort"]
    return series


def count_on(series, record, topic):
    """Mends positions that begin anew after a turn, where a counter of ticks ends, or as its driver does."""
    positions, unit = series.known("position"), min(map(abs, record.base.turns))
    if len(positions) < 2:
        return
    span, turned = np.ptp(positions["position"], axis=0).max(), np.diff(positions["position"], axis=0)
    periods = [2 * math.pi, *(unit * 2 ** bits for bits in range(8, 33) if unit != 1)]
    period = min((period for period in periods if period >= span * (1 - 1e-9)), default=math.inf)
    sizes = np.abs(turned)
    ends = sizes > 0.75 * span
    found = (sizes[1:] + np.where(ends, 0, sizes)[:-1])[ends[1:]]  # back by these, in place of a turn like the one before
    if np.sum(ends[1:].any(axis=1)) > 1 and np.ptp(found) < 0.02 * np.median(found) < period / (1 + OTHER_PERIOD):
        period = np.median(found)
    is_end = (np.abs(turned) > period / 2).any(axis=1) & (np.diff(positions.t) <= positions.max_step)
    if is_end.any():
        turned -= period * np.round(turned / period)
    steps = np.diff(positions.t)
    is_start = (np.abs(turned) > FASTEST * np.maximum(steps, np.median(steps))[:, None]).any(axis=1)
    is_start &= np.mean(is_start) < RARE  # rather than another unit
    turned[is_start] = 0
    for jumps, how in ((is_end & ~is_start, f"begin anew {{}} times, after {period:.6g} rad"),
                       (is_start, "jump {} times, first at t = {:.3f} s, as of a driver that starts")):
        if jumps.any():
            record.notes.append(f"{topic}: positions {how.format(np.sum(jumps), *positions.t[1:][jumps])}: counted on")
    if is_end.any() or is_start.any():
        series.columns["position"][np.isin(series.t, positions.t)] = positions["position"][0] + np.vstack(
            [np.zeros(4), np.cumsum(turned, axis=0)])


STILL = "no wheel turns: velocities are assumed in rad/s and positive forward"
SIGNS = {"consistent": (1, 1, 1, 1), "driver_exact": (-1, 1, -1, 1)}  # make all positive forward
UNITS = {"rpm of the wheel": 30 / math.pi, "rpm of the motor": 26 * 30 / math.pi, "degrees per second": 180 / math.pi}


def velocity_scale(series, base):
    """Signs and one factor that make the velocities of the wheels rad/s, by the changes of the positions over pieces of
    half a second, and in words what was found, if anything. None for the factor where velocities do not fit."""
    ends = np.unique([*np.arange(series.t[0], series.t[-1], agreement.PIECE), series.t[-1]])
    turned, said = np.diff(series.at(ends, "position"), axis=0), series.means(ends, "velocity") * np.diff(ends)[:, None]
    turned, said = (pieces[np.isfinite(turned).all(axis=1)] for pieces in (turned, said))
    products, squares, own = (np.sum(a * b, axis=0) for a, b in ((turned, said), (turned, turned), (said, said)))
    turns = squares > 1e-4 * np.max(squares, initial=0)
    signs = np.where(turns & (products < 0), -1, 1)
    if not turns.any():
        return signs, 1, STILL
    if not own.any():
        return signs, None, "its velocities are always zero"
    factors = np.abs(products[turns] / squares[turns])
    factor = np.median(factors)
    if (products[turns] ** 2 < MIN_FIT * squares[turns] * own[turns]).any() or np.ptp(factors) > MAX_APART * factor:
        return signs, None, (f"its velocities do not fit its positions (they are "
                             f"{', '.join(f'{one:.3g}' for one in factors * signs[turns])} times their changes)")
    notes = []
    if tuple(signs) == SIGNS["driver_exact"]:
        notes = ["velocities of fl and bl have the driver's opposite sign: negated"]
    elif (signs < 0).any():
        notes.append(f"velocities of {', '.join(wheel for wheel, sign in zip(WHEELS, signs) if sign < 0)} have the "
                     "opposite sign of the positions: negated")
    if abs(factor - 1) > MAX_APART:
        units = {**UNITS, "ticks per second": 1 / min(map(abs, base.turns))}
        unit = min(units, key=lambda name: abs(math.log(units[name] / factor)))
        is_known = abs(units[unit] / factor - 1) < 0.03
        notes.append(f"velocities are {factor:.4g} times the changes of the positions, "
                     f"{unit if is_known else 'in no known unit'}: converted to rad/s")
        return signs, units[unit] if is_known else factor, "; ".join(notes)
    return signs, 1, "; ".join(notes)


def command_series(t, rates, record, topic):
    """Wheels that a command does not name keep the values before, at first zero."""
    if not np.isfinite(rates[0]).all():
        record.notes.append(f"{topic}: the first command leaves out wheels: taken as zero, but a base may hold them")
    for wheel in rates.T:
        latest = np.maximum.accumulate(np.where(np.isfinite(wheel), np.arange(len(wheel)), 0))
        wheel[:] = np.nan_to_num(wheel[latest])
    return Series(t, {**dict(zip(POSE[3:], record.base.velocities(rates))), "rates": rates})


def switch_series(t, values, *_):
    wheel, direction, count, phi = values.T
    return Series(t, {"wheel": wheel.astype(int), "direction": direction, "count": count, "phi": phi})


def contact_series(t, values, *_):
    slip, force, share, normal = np.split(values[:, 1 + len(POWERS):], [8, 16, 20], axis=1)
    return Series(t, {**dict(zip(("kinetic_energy", *POWERS), values.T)), "slip": slip.reshape(-1, 4, 2),
                      "force": force.reshape(-1, 4, 2), "share": share, "normal": normal})


@dataclass
class Topic:
    """A topic of a base."""
    kinds: dict         # of its messages, to two functions: fields, from message and base to {field: numbers}, each
    #                     used or left out as a whole, or None for one of something else; and series, from times, rows of
    #                     all fields, record (for its notes) and topic as it is shown
    usual: tuple        # names, in any namespace, the best first
    is_sampled: bool = True  # rather than sent when something happens


TOPICS = {
    "odom": Topic({"nav_msgs/Odometry": (pose_fields, pose_series)}, ("odom",)),
    "ground_truth": Topic({"nav_msgs/Odometry": (pose_fields, pose_series),
                           **{kind: (lambda message, _, kind=kind: ground_truth.pose_fields(kind, message),
                                         ground_truth.pose_series) for kind in ground_truth.KINDS}},
                          ("ground_truth", "base_pose_ground_truth", "pose")),
    "joint_states": Topic({"sensor_msgs/JointState": (joint_fields, wheel_series)}, ("joint_states",)),
    "roller_switches": Topic({"youbot_base_sim/RollerSwitchStamped": (switch_fields, switch_series)},
                             ("roller_switches",), is_sampled=False),
    "contacts": Topic({"youbot_base_sim/ContactsStamped": (contact_fields, contact_series)}, ("contacts",)),
    "cmd_vel": Topic(dict.fromkeys(("geometry_msgs/Twist", "geometry_msgs/TwistStamped"), (
        twist_fields, lambda t, twists, *_: Series(t, dict(zip(POSE[3:], twists.T))))), ("cmd_vel",), is_sampled=False),
    "velocity_command": Topic({"brics_actuator/JointVelocities": (
        lambda message, base: command_fields(message.velocities, "s^-1 rad", base), command_series)},
        ("velocity_command",), is_sampled=False),
    "torques_command": Topic({"brics_actuator/JointTorques": (
        lambda message, base: command_fields(message.torques, "m^2 kg s^-2 rad^-1", base), command_series)},
        ("torques_command",), is_sampled=False),
}
