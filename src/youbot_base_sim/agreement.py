"""Checks that the wheels of a record and its odometry or ground truth tell of one motion: their units and sizes."""
import math

import numpy as np

from .base import WHEELS
from .command_line import shown
from .ground_truth import RARE_PERIOD
from .series import POSE, Missing, Series, differentiated, middles

PIECE = 0.5   # s, over which motions are compared
JUMP = 1.0    # m/s and rad/s: poses that differ by more from their velocities jump
SMALL = 0.05  # of the whole speed: the factor of a smaller part says nothing
APART = 1.25  # a larger factor is named, as is one that is smaller than its inverse
LENGTHS = {"mm": 1000, "cm": 100}
KNOWN = {"sqrt(2)": math.sqrt(2), "1 / sqrt(2)": math.sqrt(0.5), "degrees in place of rad": math.pi / 180,
         "rpm in place of rad/s": math.pi / 30, "degrees": 180 / math.pi, "rpm": 30 / math.pi}
CLEAR = 0.2    # share of what no base moves in the least of what it does, at most, to tell one wheel from the others


def fit(true, source, k, base):
    """The least squares' e in true = e source for one direction; NaN if the source hardly moves in it."""
    sizes = np.array([1, 1, base.half_lengths])[:, None] * np.array(source)
    known = np.isfinite(sizes).all(axis=0) & np.isfinite(true)
    if not known.any() or np.mean(sizes[k, known] ** 2) <= SMALL ** 2 * np.mean(np.sum(sizes[:, known] ** 2, axis=0)):
        return np.nan
    return np.sum(true[known] * source[k][known]) / np.sum(source[k][known] ** 2)


def compared(record, name):
    """Ends of pieces, s, and V_X, V_Y and Omega over these by the wheels, or without them by odometry; None without
    either. Of ground truth that is rare, pieces end at its poses."""
    series = record.get(name, "x", "y") or record.get(name, *POSE[3:])
    other = record.get("joint_states", "velocity") or (record.get("odom", *POSE[:3]) if name != "odom" else None)
    if not series or not other:
        return None
    t = np.arange(max(series.t[0], other.t[0]), min(series.t[-1], other.t[-1]), PIECE)
    if name == "ground_truth" and record.poses and (poses := record.poses.known(*POSE[:3])).period > RARE_PERIOD:
        t = poses.t[(poses.t >= t[0]) & (poses.t <= t[-1]) & (np.diff(poses.t // PIECE, prepend=-1) > 0)]
    if len(t) < 3:
        return None
    return t, record.base.velocities(other.means(t, "velocity")) if name == "odom" else (  # sampled like its twists
        np.diff(rolled(record).at(t, "rolled")[:, :3], axis=0).T / np.diff(t))


def rolled(record):
    """The motion that the wheels roll since the beginning, and their contradiction; without joint states, odometry's
    motion. Throws Missing."""
    if joints := record.get("joint_states", "position") or record.get("joint_states", "velocity"):
        turned = np.diff(joints["position"], axis=0)
        turned = middles(joints["velocity"]) * np.diff(joints.t)[:, None] if np.isnan(turned).all() else turned
        steps = [*record.base.velocities(turned), record.base.contradiction(turned)]
    elif odom := record.get("odom", *POSE[:3]):
        steps = [velocity * np.diff(odom.t) for velocity in differentiated(odom).values()]
        steps.append(np.zeros(len(odom) - 1))
    else:
        raise Missing("offset and clock of a marker need joint_states, or odom")
    sums = np.cumsum(np.stack(steps, -1), axis=0)
    return Series((joints or odom).t, {"rolled": np.vstack([np.zeros(4), sums])})


def to_metres(record, name):
    """Converts lengths of poses and twists that are in mm or cm, by how far the wheels roll, or else odometry goes."""
    series, pieces = record.get(name, "x", "y"), compared(record, name)
    if not series or not pieces:
        return
    t, (X, Y, _) = pieces
    speed, moved = np.hypot(X, Y), np.hypot(*(np.diff(series.at(t, axis)) for axis in "xy")) / np.diff(t)
    fast = np.isfinite(moved) & (speed > SMALL * np.nanmax(speed, initial=0))
    ratio = np.median(moved[fast] / speed[fast]) if fast.any() else 1
    for unit, size in LENGTHS.items():
        if 0.4 < ratio / size < 2.5:
            record.notes.append(f"{shown(record.topics[name])}: its lengths are in {unit}: converted to m")
            columns = record.series[name].columns
            columns.update((one, columns[one] / size) for one in ("x", "y", "z", "V_X", "V_Y") if one in columns)


def factors(record, name, left_out=(None,)):
    """The ratios of what a base moves to what its wheels roll, or without them to odometry: forward, laterally and in
    yaw, by this series, without each of these tenths of it (None: by all of it); NaN where it hardly moves."""
    series, pieces = record.get(name, *POSE[3:]), compared(record, name)
    if not series or not pieces:
        return [(math.nan,) * 3] * len(left_out)
    t, source = pieces[0], np.array(pieces[1])
    moved = np.array([series.means(t, column) for column in POSE[3:]])
    if name == "ground_truth" and (poses := record.poses and record.poses.known(*POSE[:3])):  # smoother are velocities
        by_poses = np.array([*differentiated(Series(t, {one: poses.at(t, one) for one in POSE[:3]})).values()])
        moved = np.where(np.abs(by_poses - moved) > JUMP, moved, by_poses)
    tenth = np.arange(len(t) - 1) * 10 // (len(t) - 1)
    return [[fit(moved[k][tenth != out], source[:, tenth != out], k, record.base) for k in range(3)] for out in left_out]


def lateral_way(record):
    """The lateral factor over that forward by ground truth, and its standard error by tenths left out one by one."""
    ratio, *without = (lateral / forward for forward, lateral, _ in factors(
        record, "ground_truth", (None, *range(10))))
    return ratio, 3 * np.std(without)


def odd_wheel(record):
    """A wheel that turns by another factor than the other three, and this factor; else None. A drive in all directions
    tells it by the one combination of the wheels' turns that no motion of a base has."""
    known = record.get("joint_states", "position") or record.get("joint_states", "velocity")
    t = np.arange(known.t[0], known.t[-1], PIECE) if known else ()
    if len(t) < 5:
        return None
    turned = np.diff(known.at(t, "position"), axis=0)
    turned = known.means(t, "velocity") if np.isnan(turned).all() else turned
    _, sizes, parts = np.linalg.svd(turned[np.isfinite(turned).all(axis=1)], full_matrices=False)
    if len(sizes) < 4 or sizes[3] >= CLEAR * sizes[2]:
        return None
    inverse = parts[3] / np.linalg.svd(record.base.rates_by_velocity())[0][:, 3]
    others = [np.delete(inverse, wheel) for wheel in range(4)]
    odd = int(np.argmin(list(map(np.ptp, others))))
    factor = np.mean(others[odd]) / (inverse[odd] or 1e-9)
    is_one = np.ptp(others[odd]) < CLEAR * np.abs(inverse).max()
    return (WHEELS[odd], factor) if is_one and not 1 / APART < factor < APART else None


def contradictions(record):
    """A line on each series by which the base moves much farther than its wheels roll, or less far; and on a wheel
    that does not fit the others."""
    if odd := odd_wheel(record):
        yield (f"{shown(record.topics['joint_states'])}: {odd[0]} turns {round(odd[1], 2) + 0.0:g} times as far as it must "
               "beside the other wheels: its positions or ticks are wrong")
    for name in ("odom", "ground_truth"):
        off = [f"{direction} {factor:.3g}" + "".join(f" ({known})" for known in KNOWN
                                                     if abs(factor / KNOWN[known] - 1) < 0.04)
               for direction, factor in zip(("forward", "lateral", "in yaw"), factors(record, name)[0])
               if factor == factor and not 1 / APART < factor < APART]
        if off:
            other = "its wheels roll" if "joint_states" in record.series else "by odometry"
            yield (f"{shown(record.topics[name])}: the base moves {', '.join(off)} times as far as {other}: must be "
                   f"{1 / APART:g} to {APART:g} times: it slid, or has other sizes (--scene), joints or ticks (--joints, "
                   "--ticks)")
