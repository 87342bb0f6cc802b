"""Ground truth of a tracking system: reads poses of any type as x, y and heading; finds by the wheels where the marker
sits on the base, how far its clock is off, and how its fixed frame lies to odometry's."""
import math
from collections import namedtuple

import numpy as np

from .command_line import shown
from .series import Missing, Series, Unusable, differentiated

KINDS = {"geometry_msgs/PoseStamped": lambda message: (message.pose.position, message.pose.orientation),
         "geometry_msgs/PoseWithCovarianceStamped":
             lambda message: (message.pose.pose.position, message.pose.pose.orientation),
         "geometry_msgs/TransformStamped": lambda message: (message.transform.translation, message.transform.rotation)}
TRANSFORMS = ("tf2_msgs/TFMessage", "tf/tfMessage")
NO_ROTATION = "has a quaternion that is no rotation"
LARGEST_TILT = 15  # deg
SMOOTHING = 0.05     # s to either side, over which velocities are the slopes of fitted lines
RARE_PERIOD = 0.1    # s, from one pose to the next: means would move the base in starts and turns
WINDOW, LONG_WINDOW = 0.1, 0.3  # s, over which motions of marker and wheels are compared; the long one of noisy poses
NOISY = 0.1          # share of a marker's motion that the wheels' does not explain
FEWEST = 20          # windows of a drive are too few
LARGEST_CLOCK = 1.5  # s, offset that is searched
CLOCK_STEP = 0.02    # s, of the search
MIN_ERROR = 1e-3   # m/s, that velocities are assumed to be off
ALONG = 2.0        # s: errors of slip last no longer
DOUBT = 5e-3       # m/s: where the wheels contradict each other by more, the base is not where they roll
SLIP = np.array([5e-3, 2e-3, 3e-3, 3e-3])  # what slip of hard starts adds to sigma of clock, yaw, X and Y
LAG = 0.2            # s/(m/s)^2, sigma of the clock where the base lags behind wheels that start, from simulated bags
TURNS, LEVEL = 0.98, 2  # mean of unit vectors that head like a base that turns, at most; deg: larger tilts are named
START = 0.02         # m and rad: until odometry has moved so far, it has hardly drifted


def pose_fields(kind, message):
    position, q = KINDS[kind](message)
    return {"pose": sum(matrix(position, q)[:3], []) if is_rotation(q) else Unusable(NO_ROTATION, 12)}


def is_rotation(q):
    """Zeros stand for a body that is out of sight."""
    return 0.9 < q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w < 1.1


def pose_series(t, values, record, topic):
    """A series of poses from three of the four rows of matrices."""
    known = np.isfinite(values).all(axis=1)
    poses, t = values[known].reshape(-1, 3, 4), t[known]
    turned, places = poses[:, :, :3], poses[:, :, 3]
    vertical, sizes, of_body = np.linalg.svd(np.mean(turned, axis=0) if len(t) else np.eye(3))
    if sizes[1] < TURNS:  # else any axis may be that of yaw
        up, own = vertical[:, 0], of_body[0]
        surest = next((one[2] for one in (up, own) if abs(one[2]) > 0.7), up[np.argmax(np.abs(up))])
        up, own = np.sign(surest) * up, np.sign(surest) * own
        turned, places = upright(up).T @ turned @ upright(own), places @ upright(up)
        tilts = [math.degrees(math.acos(np.clip(one[2], -1, 1))) for one in (up, own)]
        if max(tilts) > LEVEL:
            record.notes.append(f"{topic}: the axis of yaw is {tilts[0]:.0f} deg off the tracker's z axis, "
                                f"{tilts[1]:.0f} deg off the marker's: levelled")
    return Series(t, {"x": places[:, 0], "y": places[:, 1], "z": places[:, 2], "upright": turned[:, 2, 2],
                      "psi": np.unwrap(np.arctan2(turned[:, 1, 0], turned[:, 0, 0]))})


def upright(axis):
    """A rotation that turns z to this axis, and x as little as that allows."""
    x = np.eye(3)[int(abs(axis[0]) > 0.9)]
    x = x - (x @ axis) * axis
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=1)


def check_upright(series, topic):
    """Throws Missing where a body that hardly turns is tilted: its axis of yaw is not known."""
    tilt = math.degrees(math.acos(np.clip(np.median(series["upright"]), -1, 1)))
    if tilt > LARGEST_TILT:
        raise Missing(f"{topic}: its z axis is {tilt:.0f} deg off the vertical: must be at most {LARGEST_TILT:g} in "
                      "a drive without turns, which would show the axis of yaw")


def transforms_to_poses(bag, fixed, body, choose):
    """Rows like those of `pose_fields` after their times, from the chain of transforms between two frames. Leaves out
    what tf2 would: frames without a name, rotations that are none. `choose`: which publisher's rows of a transform."""
    links, left_out = {}, 0
    topics = [topic for topic, kind in bag.types.items() if kind in TRANSFORMS]
    for connection, message, arrival in bag.messages(topics):
        for link in message.transforms:
            child, parent = link.child_frame_id.strip("/"), link.header.frame_id.strip("/")
            p, q = link.transform.translation, link.transform.rotation
            if not (child and parent and is_rotation(q) and np.isfinite((p.x, p.y, p.z)).all()):
                left_out += 1
                continue
            t = 0 if connection.topic.endswith("static") else bag.time_of(link, arrival, connection.topic)
            if t == t:
                links.setdefault((parent, child), {}).setdefault(connection.publisher, []).append((t, matrix(p, q)))
    chain = {f"{parent} -> {child}": (dict(choose(f"{parent} -> {child}", links[parent, child])), is_forward)
             for parent, child, is_forward in chain_between(fixed.strip("/"), body.strip("/"), links)}
    if not chain:
        raise Missing(f"no transforms from {shown(fixed)} to {shown(body)}: it has " + (
            ", ".join(f"{shown(parent)} -> {shown(child)}" for parent, child in sorted(links)) or "none") + (
                f"; {left_out} are left out, which lack a frame's name, a finite position or a rotation"
                if left_out else ""))
    t = np.array(sorted(max((link for link, _ in chain.values()), key=len)))
    pose = np.eye(4)
    for link, is_forward in chain.values():  # rotations are interpolated by entries: headings hardly change in a step
        series = Series(np.array(sorted(link)), {"link": np.array([link[time] for time in sorted(link)])})
        step = series.at(t, "link") if len(link) > 1 else series["link"]
        pose = pose @ (step if is_forward else np.linalg.inv(step))
    rows = np.column_stack([t, pose[:, :3].reshape(-1, 12)])
    return rows[np.isfinite(rows).all(axis=1)].tolist()


def chain_between(first, last, links):
    """The fewest of these pairs of frames that lead from one to the other, and whether forward; () without any."""
    ways = {first: ()}
    for frame in (queue := [first]):
        for parent, child in sorted(links):
            for begin, end in ((parent, child), (child, parent)):
                if begin == frame and end not in ways:
                    ways[end] = *ways[frame], (parent, child, begin == parent)
                    queue.append(end)
    return ways.get(last, ())


def matrix(p, q):
    """Of a position and a quaternion, whose length need not be one."""
    x, y, z, w = q.x, q.y, q.z, q.w
    s = 2 / (x * x + y * y + z * z + w * w)
    return [[1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y), p.x],
            [s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x), p.y],
            [s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y), p.z], [0, 0, 0, 1]]


class Unexplained(Missing):
    """The motion of the wheels leaves much of the marker's unexplained."""


# Each: values and their sigmas. clock: s, to be added to stamps. marker: x, y (m) and yaw (rad) on the base. fixed:
# those of the tracker's fixed frame in odometry's; None without odometry.
Alignment = namedtuple("Alignment", "clock marker fixed")


def align(truth, wheels, odom, topic, base, largest_clock):
    """Turns poses of a marker into the base's, at the wheels' clock and in odometry's frame. `wheels`: what they roll
    since the beginning, and contradict each other. `largest_clock`: offset that is searched, s; 0: none. Returns series
    and Alignment. Throws Missing where the motion does not tell."""
    try:
        return aligned(truth, wheels, odom, topic, base, largest_clock, max(WINDOW, 3 * truth.period), 0)
    except Unexplained:  # by noise and spikes, perhaps
        length = max(LONG_WINDOW, 3 * truth.period)
        return aligned(truth, wheels, odom, topic, base, largest_clock, length, round(length / 2 / truth.period))


def aligned(truth, wheels, odom, topic, base, largest_clock, length, reach):
    """Aligns pieces of this length, s, between medians over `reach` poses to either side."""
    ends = np.flatnonzero(np.diff(np.floor(truth.t / length), prepend=-math.inf) > 0)
    around = np.clip(ends[:, None] + np.arange(-reach, reach + 1), 0, len(truth) - 1)
    coarse = Series(truth.t[ends], {name: np.median(truth[name][around], axis=1) for name in ("x", "y", "psi")})
    whole = np.diff(coarse.t) < 1.5 * length
    seen = np.stack(list(differentiated(coarse).values()), -1)[whole] * (1, 1, base.half_lengths)
    times = np.stack([coarse.t[:-1][whole], coarse.t[1:][whole]])
    rolling = Series(wheels.t, {"rolled": wheels["rolled"] * (1, 1, base.half_lengths, 1)})

    def wheels_at(clock):
        before, after = rolling.at(times + clock, "rolled")
        return (after - before) / (times[1] - times[0])[:, None]

    def rolled(clock):
        return wheels_at(clock)[:, :3]

    if len(seen) <= FEWEST:
        raise Missing(f"{topic}: {len(seen)} pieces of {length:.1f} s are too few: must be more than {FEWEST}, by a "
                      "longer drive or more poses a second")
    clock, shares = search_clock(rolled, seen, topic, largest_clock)
    trust = 1 / np.hypot(1, wheels_at(clock)[:, 3] / DOUBT)
    yaw = math.atan2(shares[1, 0] - shares[0, 1], shares[0, 0] + shares[1, 1])
    start = np.array([clock, yaw, 0, 0, 1, 1, 1])
    estimate, sigma = refine(lambda unknowns: expected(rolled, unknowns, base.half_lengths), seen, start, trust,
                             round(ALONG / length), largest_clock)
    check(sigma, topic)
    (clock, yaw, X, Y), sigma = estimate[:4], np.hypot(sigma[:4], SLIP)
    starts = np.sum(np.diff(rolled(clock), axis=0) ** 2, axis=1)
    sigma[0] = largest_clock and math.hypot(sigma[0], LAG * np.nansum(starts ** 2) / np.nansum(starts))
    psi = truth["psi"] - yaw
    poses = Series(truth.t + clock, {"x": truth["x"] - np.cos(psi) * X + np.sin(psi) * Y,
                                     "y": truth["y"] - np.sin(psi) * X - np.cos(psi) * Y, "psi": psi})
    fixed = to_odometry(poses, odom, sigma) if odom else None
    return poses, Alignment((clock, sigma[0]), ((X, Y, yaw), (*sigma[2:], sigma[1])), fixed)


def search_clock(rolled, seen, topic, largest_clock):
    """The offset at which the wheels' motion explains the marker's best by any linear map, and this map. Pieces in which
    it explains least, as spikes of a tracker, count little from the second search on."""
    offsets = np.arange(-largest_clock, largest_clock + CLOCK_STEP / 2, CLOCK_STEP)
    weight = np.ones(len(seen))
    for _ in range(4):
        unexplained, maps = np.ones(len(offsets)), np.zeros((len(offsets), 3, 3))
        for k, offset in enumerate(offsets):
            V = rolled(offset)
            known = np.isfinite(V).all(axis=1)
            root = np.sqrt(weight[known])[:, None]
            if np.sum(known) > FEWEST and np.any(seen[known]):
                maps[k] = np.linalg.lstsq(root * V[known], root * seen[known], rcond=None)[0]
                unexplained[k] = (np.sum((root * (seen[known] - V[known] @ maps[k])) ** 2) /
                                  np.sum((root * seen[known]) ** 2))
        best = int(np.argmin(unexplained))
        off = np.linalg.norm(np.nan_to_num(seen - rolled(offsets[best]) @ maps[best]), axis=1)
        usual = max(np.median(off), 0.1 * np.sqrt(np.median(np.sum(seen ** 2, axis=1))), MIN_ERROR)
        weight = np.minimum(1, (3 * usual / np.maximum(off, 1e-9)) ** 2)
    if unexplained[best] > 0.3 or (largest_clock and best in (0, len(offsets) - 1)):
        clocks = f"any clock within {largest_clock:g} s" if largest_clock else "the clock that --clock-offset gives"
        raise Unexplained(f"{topic}: its motion does not fit the wheels' with {clocks}: "
                          f"{100 * unexplained[best]:.0f} % of it stays unexplained")
    low = (unexplained <= np.roll(unexplained, 1)) & (unexplained <= np.roll(unexplained, -1))
    other = offsets[low & (np.abs(offsets - offsets[best]) > 0.1) & (unexplained < 2 * unexplained[best] + 0.02)]
    if len(other):
        kind = Unexplained if unexplained[best] > NOISY else Missing
        raise kind(f"{topic}: its clock cannot be determined: {offsets[best]:.2f} s and {other[0]:.2f} s fit alike")
    return offsets[best], maps[best]


def expected(rolled, unknowns, half_lengths):
    """The motion of a marker at (X, Y, yaw) on a base that moves by these shares of what the wheels roll."""
    clock, yaw, X, Y, *shares = unknowns
    forward, left, turn = (rolled(clock) * shares).T
    forward, left = forward - Y * turn / half_lengths, left + X * turn / half_lengths
    return np.stack([math.cos(yaw) * forward + math.sin(yaw) * left, math.cos(yaw) * left - math.sin(yaw) * forward,
                     turn], -1)


def refine(expect, seen, unknowns, trust, along, largest_clock):
    """The unknowns of `expected` and their sigmas, by robust least squares: Gauss-Newton with Huber's weights, for
    the wheels slip in hard starts. Weights of zero would leave nothing there that shows the clock. `trust`: a factor of
    each row; `along`: the number of neighbouring rows whose errors are alike; `largest_clock`: 0 holds the clock."""
    steps, prior = 1e-4 * np.eye(7), np.array([1 if largest_clock else 1e-9, 10, 0.5, 0.5, 0.3, 0.3, 0.3])
    for _ in range(40):
        off = (seen - expect(unknowns)) * trust[:, None]
        slopes = np.stack([expect(unknowns + step) - expect(unknowns - step) for step in steps], -1) / 2e-4
        slopes *= trust[:, None, None]
        known = np.isfinite(off).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2))
        usual = np.maximum(1.4826 * np.median(np.abs(off[known]), axis=0), MIN_ERROR)
        weight = np.minimum(1, np.sum((off[known] / usual) ** 2 + 1e-9, axis=1) ** -0.25)
        residual = (off[known] / usual * weight[:, None]).ravel()
        rows = (slopes[known] * (weight[:, None] / usual)[..., None]).reshape(-1, 7)
        normal = rows.T @ rows + np.diag(prior ** -2)
        change = np.linalg.solve(normal, rows.T @ residual)
        unknowns = unknowns + change
        if np.all(np.abs(change) < 1e-7):
            break
    inverse = np.linalg.inv(normal)
    spread = 2 * np.sum(residual ** 2) / (3 * np.sum(weight))  # twice: residuals of neighbours are alike
    pulls = np.add.reduceat(rows * residual[:, None], np.arange(0, len(rows), 3 * along))  # of pieces, on the unknowns
    pulled = np.sum((pulls @ inverse) ** 2, axis=0) * len(pulls) / max(1, len(pulls) - 7)
    return unknowns, np.sqrt(np.maximum(np.diag(inverse) * max(spread, 0.1), pulled))


def check(sigma, topic):
    """Throws Missing where the motion does not tell."""
    if sigma[0] > CLOCK_STEP:
        raise Unexplained(f"{topic}: its clock cannot be determined: sigma is {sigma[0]:.2g} s; must be at most "
                          f"{CLOCK_STEP:g} s: drive with starts and stops")
    if sigma[1] > 0.1:
        raise Missing(f"{topic}: the marker's yaw on the base cannot be determined: drive forward and lateral too")


def to_odometry(poses, odom, sigma):
    """Moves poses into odometry's frame: by their means until odometry has moved by START."""
    both = np.flatnonzero(np.isfinite(odom.at(poses.t, "psi")))
    if not len(both):
        return None
    own, target = (np.stack([series.at(poses.t[both], name) for name in ("x", "y", "psi")]) for series in (poses, odom))
    still = np.abs(target - target[:, :1]).max(axis=0) <= START
    n = len(both) if still.all() else np.argmin(still)
    x, y, _ = own[:, :n]
    turn = np.mean(target[2, :n] - own[2, :n])
    c, s = math.cos(turn), math.sin(turn)
    shifts = target[:, :n] - [c * x - s * y, s * x + c * y, own[2, :n]]
    shift = np.mean(shifts, axis=1)
    sigma = np.hypot(np.std(shifts, axis=1) / math.sqrt(n) + 0.05 * START, (*sigma[2:], sigma[1]))
    sigma[:2] = np.hypot(sigma[:2], sigma[2] * math.hypot(np.mean(x), np.mean(y)))
    x, y = poses["x"], poses["y"]
    poses.columns.update(x=c * x - s * y + shift[0], y=s * x + c * y + shift[1], psi=poses["psi"] + turn)
    return tuple(shift), tuple(sigma)


def smoothed(poses):
    """Means over SMOOTHING to either side, unless poses are rare, and velocities from its ends: noise would lengthen
    the path."""
    is_rare = poses.period > RARE_PERIOD
    reach = max(SMOOTHING, (1 if is_rare else 1.5) * poses.period)
    values = np.stack([poses[name] for name in ("x", "y", "psi")], -1)
    area = np.cumsum(np.diff(poses.t, prepend=poses.t[0])[:, None] * (values + np.roll(values, 1, axis=0)) / 2, axis=0)
    series = Series(poses.t, {"pose": values, "area": area})
    means, slopes = ((series.at(poses.t + reach, name) - series.at(poses.t - reach, name)) / (2 * reach)
                     for name in ("area", "pose"))
    x, y, psi = (values if is_rare else means).T
    dx, dy, turn = slopes.T
    return Series(poses.t, {"x": x, "y": y, "psi": psi, "V_X": np.cos(psi) * dx + np.sin(psi) * dy,
                            "V_Y": np.cos(psi) * dy - np.sin(psi) * dx, "Omega": turn})
