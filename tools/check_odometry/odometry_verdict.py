"""Finds from records of a node's odometry what it computes from the wheels, and what is wrong with it."""
import itertools
from collections import namedtuple

import numpy as np

from youbot_base_sim.base import DRIVER_RADIUS, WHEELS

# One drive; s, m, rad. Rows: `wheels` t and four angles, `truth` t, x, y, psi, `odometry` arrival, stamp, x, y, psi, V_X,
# V_Y, Omega, `commands` t, V_X, V_Y, Omega. `frames`: header.frame_id and child_frame_id. `transform`: the last one on /tf
# between these frames, as stamp, parent, child, x, y, psi, or None.
Record = namedtuple("Record", "wheels truth odometry frames transform commands")
Finding = namedtuple("Finding", "verdict what text")  # verdict: ok, note or FAULT

WINDOW = 0.1                                    # s, over which motions are compared
LAGS = np.arange(-0.2, 0.2001, 0.005)           # s, tried
LENGTHS, FACTOR, CENTRE, LATE = 0.01, 0.02, 5e-3, 0.015  # allowed: relative, relative, m, s
UNEXPLAINED = 0.05                              # share of the motion that no combination of the wheels gives
WEIGHTS = np.array([1, 1, 0.4])                 # of X, Y and yaw
# The motion of the base by wheels of radius 1 at half lengths of 1: rows X, Y, yaw. The fourth combination is slip.
IDEAL = np.array([[1, 1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]]) / 4


def at(rows, t):
    """The columns of rows at these times, between the rows linearly."""
    return np.array([np.interp(t, rows[:, 0], column) for column in rows[:, 1:].T]).T


def moved(poses):
    """The motion from each pose to the next, in the frame of the base: rows X, Y, yaw."""
    (x, y, yaw), middle = np.diff(poses, axis=0).T, (poses[1:, 2] + poses[:-1, 2]) / 2
    chord = 1 / np.sinc(yaw / (2 * np.pi))
    return np.array([chord * (np.cos(middle) * x + np.sin(middle) * y),
                     chord * (np.cos(middle) * y - np.sin(middle) * x), yaw]).T


def rms(values):
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else 0.0


def check_stamps(record, findings):
    """True if stamps can be the times of the poses."""
    arrival, stamp = record.odometry[:, :2].T
    fault = lambda text: findings.append(Finding("FAULT", "stamps", text))
    if not stamp.any():
        fault("are zero: must be those of joint_states")
    elif np.abs(stamp - arrival).max() > 1:
        fault(f"are {np.abs(stamp - arrival).max():.4g} s off simulated time: of the wall clock? must be those of joint_states")
    elif np.diff(stamp).min() < 0:
        fault("go back")


class Drive:
    """A record in windows: times, what odometry says and what the wheels turned."""

    def __init__(self, record, stamps):
        self.record = record
        first = np.unique(stamps, return_index=True)[1]
        t = stamps[first]
        step = max(1, round(WINDOW / np.median(np.diff(t))))
        self.rows = first[(t >= record.wheels[0, 0]) & (t <= record.wheels[-1, 0])][::step]
        self.t = stamps[self.rows]
        self.poses = record.odometry[self.rows, 2:5]
        self.moved = moved(self.poses)

    def turned(self, lag=0.0):
        return np.diff(at(self.record.wheels, self.t - lag), axis=0)

    def mean_twists(self):
        """Means of the messages' twists over the windows: V_X, V_Y, Omega."""
        sums = np.cumsum(np.vstack([np.zeros(3), self.record.odometry[:, 5:8]]), axis=0)
        return np.diff(sums[self.rows + 1], axis=0) / np.diff(self.rows)[:, None]


def matrix_of(drives, lag):
    """The odometry's matrix of the wheels' angles, (3, 4), and the share of its motion that this leaves, by rows."""
    turned, given = (np.vstack(parts) for parts in ([drive.turned(lag) for drive in drives],
                                                   [drive.moved for drive in drives]))
    A = np.linalg.lstsq(turned, given, rcond=None)[0].T
    size = np.array([rms(given[:, :2]), rms(given[:, :2]), rms(given[:, 2])])
    return A, np.array([rms(left) for left in (given - turned @ A.T).T]) / np.where(size > 0, size, 1)


Reading = namedtuple("Reading", "order signs swapped factors centre left")


def readings(A):
    """All ways to read A as that of Mecanum wheels: (share of A that is left, faults, Reading). `factors`: of the rows of
    IDEAL, m, m, rad; `centre`: the point whose motion it gives, m in X and Y; `left`: the rest of A by that order and signs."""
    for order in itertools.permutations(range(4)):
        for signs in itertools.product((1, -1), repeat=4):
            B = A[:, order] * signs
            for swapped in (False, True):
                rows = B[[1, 0, 2]] if swapped else B
                parts = 4 * rows @ IDEAL.T  # of each row, along the three of IDEAL
                turn = parts[2, 2]
                left = rows - np.array([[parts[0, 0], 0, parts[0, 2]], [0, parts[1, 1], parts[1, 2]],
                                        [0, 0, turn]]) @ IDEAL
                centre = np.array([parts[1, 2], -parts[0, 2]]) / turn if turn else np.zeros(2)
                factors = np.diag(parts)
                faults = (sum(k != wheel for k, wheel in enumerate(order)) + signs.count(-1) + 1.5 * swapped
                          + np.sum(factors < 0) + 1.5 * (np.abs(centre).max() > CENTRE))
                share = np.linalg.norm(left.T * WEIGHTS) / np.linalg.norm(A.T * WEIGHTS)
                yield share, faults, Reading(order, signs, swapped, factors, centre, left)


def read(A):
    """The simplest of the readings that leave least."""
    found = list(readings(A))
    least = min(share for share, _, _ in found)
    return min((one for one in found if one[0] < least + 0.02), key=lambda one: (one[1], one[0]))[2]


def judge_matrix(A, turned, base, findings):
    """The share is that of the motion: what a node makes of slip, in which wheels seldom turn, hardly moves its pose."""
    reading = read(A)
    share = rms((turned[:, reading.order] * reading.signs) @ reading.left.T * WEIGHTS) / rms(turned @ A.T * WEIGHTS)
    add = lambda good, what, text: findings.append(Finding("ok" if good else "FAULT", what, text))
    if share > UNEXPLAINED:
        add(False, "kinematics", f"are not those of Mecanum wheels: {100 * share:.0f} % of them fits no order, sign or size")
    wrong = [k for k, wheel in enumerate(reading.order) if k != wheel]
    add(not wrong, "order of wheels", "; ".join(f"takes {WHEELS[reading.order[k]]} for {WHEELS[k]}" for k in wrong)
        or "fl, fr, bl, br by their names")
    backward = [wheel for wheel, sign in zip(WHEELS, reading.signs) if sign < 0]
    hint = ": the driver's velocities have the motors' signs" if backward == ["fl", "bl"] else ""
    add(not backward, "signs of wheels", f"{' and '.join(backward)} count backwards{hint}" if backward else "forward on all")
    along, across, turn = reading.factors
    add(not reading.swapped, "axes", "X and Y are exchanged" if reading.swapped else "X forward, Y to the left")
    for name, factor in (("forward", along), ("lateral", across), ("yaw", turn)):
        if factor < 0:
            add(False, "handedness", f"{name} motion is mirrored" + (
                ": wheels whose rollers form an O on the floor?" if name == "lateral" else ""))
        elif abs(factor) < 1e-3 * base.wheel_radius:
            add(False, "kinematics", f"{name} motion is missing")
    radius = abs(along)
    if abs(radius - DRIVER_RADIUS) < LENGTHS * DRIVER_RADIUS < abs(base.wheel_radius - DRIVER_RADIUS):
        findings.append(Finding("note", "wheel radius", f"{radius:.4f} m, the youBot driver's; the wheels have "
                                f"{base.wheel_radius:g} m"))
    else:
        add(abs(radius / base.wheel_radius - 1) < LENGTHS, "wheel radius", f"{radius:.4f} m; the wheels have "
            f"{base.wheel_radius:g} m")
    lateral = abs(across) / (radius or 1)
    if abs(lateral - 1) > FACTOR and lateral > 1e-3:
        findings.append(Finding("note", "lateral factor", f"{lateral:.3f} of what the wheels roll: a calibration?"))
    if turn:
        lengths = radius / abs(turn)
        add(abs(lengths / base.half_lengths - 1) < FACTOR, "l + h", f"{lengths:.4f} m; the base has "
            f"{base.half_lengths:g} m")
    add(np.abs(reading.centre).max() < CENTRE, "centre", "the middle of the wheels" if np.abs(reading.centre).max() < CENTRE
        else "a point %.3f m ahead and %.3f m to the left of the middle of the wheels" % tuple(reading.centre.round(3) + 0))


def judge_twist(drives, findings):
    """Twists against the poses of the same messages."""
    given = np.vstack([drive.mean_twists() for drive in drives])
    spans = [np.diff(drive.t)[:, None] for drive in drives]
    body = np.vstack([drive.moved / span for drive, span in zip(drives, spans)])
    fixed = np.vstack([np.diff(drive.poses, axis=0) / span for drive, span in zip(drives, spans)])
    size = rms(body)
    if not given.any():
        findings.append(Finding("FAULT", "twist", "is always zero"))
    elif rms(given - body) < 0.15 * size:
        findings.append(Finding("ok", "twist", "in the child frame"))
    elif rms(given - fixed) < 0.15 * size:
        findings.append(Finding("FAULT", "twist", "is in the frame of the pose: must be in the child frame (REP 105)"))
    else:
        ratios = [float(a @ b / (b @ b)) if b.any() else np.nan for a, b in zip(given.T, body.T)]
        findings.append(Finding("FAULT", "twist", "does not fit the pose: V_X, V_Y and Omega are %.3g, %.3g and %.3g times "
                                "its changes" % tuple(ratios)))


def judge_frames(record, findings):
    frame, child = record.frames
    fault = lambda text: findings.append(Finding("FAULT", "frames", text))
    if not frame or not child or frame == child:
        fault(f'"{frame}" -> "{child}": must be two names')
    elif "odom" in child or "base" in frame:
        fault(f"{frame} -> {child} are exchanged: header.frame_id is the frame of the pose, child_frame_id the base's")
    elif record.transform and record.transform[1:3] != (frame, child):
        fault("/tf has %s -> %s, the message " % record.transform[1:3] + f"{frame} -> {child}")
    else:
        findings.append(Finding("ok", "frames", f"{frame} -> {child}" + ("" if record.transform else ", not on /tf")))
    if record.transform and record.transform[1:3] == (frame, child):
        t, _, _, *pose = record.transform
        row = record.odometry[np.abs(record.odometry[:, 1] - t).argmin()]
        if np.abs(np.subtract(pose, row[2:5])).max() > 1e-3 and abs(row[1] - t) < 1e-6:
            fault("the pose on /tf is not that of the message")


def judge_commands(record, findings):
    """The motion that is commanded, without slip and a little later, as the wheels' velocity loops follow."""
    t = np.arange(record.commands[0, 0], record.commands[-1, 0], 0.5)
    commanded = np.diff(at(np.c_[record.commands[:, :1], np.cumsum(record.commands[:, 1:] * np.diff(
        record.commands[:, 0], append=record.commands[-1, 0])[:, None], axis=0)], t), axis=0)
    gains = np.linalg.lstsq(commanded, moved(at(record.truth, t + 0.25)), rcond=None)[0]
    good = np.abs(gains * (1, 1, 0.4) / np.c_[[1, 1, 0.4]] - np.eye(3)).max() < 0.3
    findings.append(Finding("ok", "commands", "move the base in their directions") if good else Finding(
        "FAULT", "commands", "forward, lateral and yaw move the base %.2f, %.2f and %.2f times as far" % tuple(np.diag(gains))))


def off(record, poses, t):
    """Distance (m) and angle (rad) between the motions of poses and truth, over the whole drive."""
    truth = at(record.truth, t)
    def whole(poses):
        x, y = poses[-1, :2] - poses[0, :2]
        c, s = np.cos(poses[0, 2]), np.sin(poses[0, 2])
        return np.array([c * x + s * y, c * y - s * x, poses[-1, 2] - poses[0, 2]])
    apart = whole(poses) - whole(truth)
    return np.hypot(*apart[:2]), abs(apart[2])


def rolled(drive, base):
    """Poses by ideal kinematics of this base's wheels."""
    X, Y, yaw = base.velocities(drive.turned())
    middle = np.cumsum(yaw) - yaw / 2
    steps = np.array([np.cos(middle) * X - np.sin(middle) * Y, np.sin(middle) * X + np.cos(middle) * Y, yaw]).T
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def judge(rolling, slipping, base):
    """Findings on records of a drive without slip and of one with it, and lines on what each costs. Both may be one."""
    findings = []
    check_stamps(slipping, findings)
    by_arrival = bool(findings)
    if not by_arrival:
        findings.append(Finding("ok", "stamps", "of simulated time"))
    drives = [Drive(record, record.odometry[:, 0] if by_arrival else record.odometry[:, 1])
              for record in (rolling, slipping)]
    lag = min(LAGS, key=lambda one: (matrix_of(drives, one)[1].sum().round(4), abs(one)))
    A, left = matrix_of(drives, lag)
    if not by_arrival and abs(lag) > LATE:
        findings.append(Finding("FAULT", "stamps", f"poses are {lag:.3f} s older than their stamps"))
    if left.max() > UNEXPLAINED:
        findings.append(Finding("FAULT", "pose", f"{100 * left.max():.0f} % of its changes in {'X Y yaw'.split()[left.argmax()]} "
                                "do not follow from the wheels"))
    if not (np.isfinite(A).all() and A.any()):
        return [*findings, Finding("FAULT", "pose", "does not change")], []
    judge_matrix(A, np.vstack([drive.turned(lag) for drive in drives]), base, findings)
    judge_twist(drives, findings)
    judge_frames(slipping, findings)
    judge_commands(rolling, findings)
    lines = []
    for name, drive in zip(("without slip", "with slip"), drives):
        given, wheels = off(drive.record, drive.poses, drive.t), off(drive.record, rolled(drive, base), drive.t)
        way = np.abs(moved(at(drive.record.truth, drive.t))).sum(axis=0)
        lines.append(f"{name}: off by {1e3 * given[0]:.0f} mm and {1e3 * given[1]:.0f} mrad after {np.hypot(*way[:2]):.1f} m "
                     f"and {way[2]:.1f} rad; right kinematics would be by {1e3 * wheels[0]:.0f} mm and "
                     f"{1e3 * wheels[1]:.0f} mrad")
    return findings, lines
