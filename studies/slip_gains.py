"""How a Mecanum base moves on average over where its rollers stand, as the simulator finds it, for every direction."""
import numpy as np

from youbot_base_sim._simulator import Batch
from .odometry_records import BASE

BODY_MASS, WHEEL_MASS, FRICTION = 3, 0.1, 0.5           # assumed; only dry friction over f N matters, nearly
LIMIT = FRICTION * (BODY_MASS + 4 * WHEEL_MASS) * 9.81 / 4  # f N of a wheel, N
FLOOR = {"friction": FRICTION, "spin_radius": 2e-3, "slip_regularization": 3e-4}  # m, m/s
PITCH = 2 * np.pi / BASE.rollers_per_wheel
# A velocity loop holds each wheel to its rate, as motors do, and gives way where rollers change. In lateral circles the
# encoders of the records show by how much, a ripple of 1 to 4 % at 8 cycles a turn; with these gains simulated ones do.
MOTORS = {"velocity_proportional_gain": 0.07, "velocity_integral_gain": 1.4}  # N m s/rad, N m/rad
# Wheels turn at constant rates, and go on to other angles of their rollers once a PERIOD, in the first RAMP of it.
PERIOD, RAMP, BEGIN, END, TABLE_STEP = 1.8, 0.2, 0.8, 1.6, 0.025  # s; motion is measured from BEGIN to END
SPEED = 2 * PITCH / (END - BEGIN) * BASE.wheel_radius  # m/s: two rollers pass meanwhile


def robot(friction, contacts="located"):
    """A scene's section; `friction` of rollers is over f N, m."""
    return {"body_mass": BODY_MASS, "wheel_mass": WHEEL_MASS, "total_inertia": 0.05, "wheel_inertia": 1e-4,
            "com": [0, 0], "wheel_damping": 1e-3, "roller_damping": 1e-6, "roller_dry_friction": friction * LIMIT,
            "contacts": contacts, **dict(list(vars(BASE).items())[:5])}  # the numbers


def drive(angles, step, section, every=1):
    """x, y, psi (m, rad) and wheel angles (rad) of bases whose motors turn the wheels to `angles` (rows, bases, 4), of
    which a row is `step` s later than the last: (rows, bases, 7), of each `every`-th row."""
    batch = Batch({"duration": len(angles) * step, "robot": section, "motors": MOTORS, "floor": FLOOR, "initial": {
        "wheel_angles": angles[0, 0]}, "solver": {"control_period": 1e-3, "relative_tolerance": 1e-5}}, angles.shape[1])
    rows = []
    for k, rates in enumerate(np.diff(angles, axis=0, append=angles[-1:]) / step):
        if k % every == 0:
            rows.append(batch.state_vector[:, [0, 1, 2, 8, 9, 10, 11]])
        batch.set_points("velocity", rates)
        batch.step(periods=round(step / 1e-3))
    return np.array(rows)


def scattered(count):
    """Angles (count, 4) in a roller, evenly scattered, in no order: Roberts' additive recurrence."""
    root = 1.1673039782614187  # of x^5 = x + 1
    order = np.random.default_rng(1).permutation(count)  # else each step has the same sign, and leaves wheels strained
    return PITCH * ((0.5 + np.outer(order, root ** -np.arange(1.0, 5))) % 1)


def mean_motions(directions, section, phases):
    """By how much bases depart from the motion by ideal kinematics of their wheels, in X, Y, (h + l) psi: means over
    SPEED, in directions (n, 3) by the same."""
    rates = np.array(BASE.rolling_rates(*(directions * SPEED / [1, 1, BASE.half_lengths]).T)).T
    angle = scattered(phases)
    steps = (np.diff(angle, axis=0, prepend=angle[:1]) + PITCH / 2) % PITCH - PITCH / 2
    t = np.arange(round(phases * PERIOD / TABLE_STEP) + 1) * TABLE_STEP
    done = ((t[:, None] - PERIOD * np.arange(phases)) / RAMP).clip(0, 1)
    angles = (angle[0] + done**2 * (3 - 2 * done) @ steps)[:, None] + t[:, None, None] * rates
    rows = drive(angles, TABLE_STEP, section, round(RAMP / TABLE_STEP))
    begin, end = (rows[round(instant / RAMP)::round(PERIOD / RAMP)][:phases] for instant in (BEGIN, END))
    yaw = end[..., 2] - begin[..., 2] + 1e-12
    moved = ((end - begin)[..., :2] @ [1, 1j]) * np.exp(-1j * begin[..., 2])
    velocity = (moved * 1j * yaw / (np.exp(1j * yaw) - 1)).mean(axis=0)  # along an arc
    moved = np.array([velocity.real, velocity.imag, yaw.mean(axis=0)]).T
    rolled = np.array(BASE.velocities((end - begin)[..., 3:].mean(axis=0))).T
    return (moved - rolled) * [1, 1, BASE.half_lengths] / (SPEED * (END - BEGIN))


class SlipGains:
    """Departures for directions of an octant, which has them all by symmetry, and some frictions of the rollers."""

    def __init__(self, contacts="located", points=17, phases=128):
        located = contacts == "located"
        self.frictions = 1e-3 * np.array([1.1, 2.2, 3.3] if located else [2.2, 5, 5.4, 5.6])  # they lock soon
        self.points = points
        azimuth, e = np.meshgrid(*[np.linspace(0, np.pi / 2, points)] * 2, indexing="ij")
        directions = np.stack([np.cos(e) * np.cos(azimuth), np.cos(e) * np.sin(azimuth), np.sin(e)], -1)
        directions[:, -1] = 0, 0, 1
        self.table = np.array([mean_motions(directions.reshape(-1, 3), robot(friction, contacts),
                                            phases if located else 1).reshape(directions.shape)
                               for friction in self.frictions])

    def motion(self, nominal, friction):
        """What wheels move the base on average that by ideal kinematics move it by `nominal` (n, 3), m, m, rad."""
        scale = np.array([1, 1, BASE.half_lengths])
        X, Y, Z = np.abs(nominal * scale).T
        place = np.array([np.arctan2(Y, X), np.arctan2(Z, np.hypot(X, Y))]) / (np.pi / 2) * (self.points - 1)
        cell = np.minimum(place.astype(int), self.points - 2)
        (i, j), (u, v) = cell, (place - cell)[:, :, None]
        k = int(np.clip(np.searchsorted(self.frictions, friction) - 1, 0, len(self.frictions) - 2))
        share = (friction - self.frictions[k]) / (self.frictions[k + 1] - self.frictions[k])
        table = (1 - share) * self.table[k] + share * self.table[k + 1]
        off = (1 - u) * ((1 - v) * table[i, j] + v * table[i, j + 1]) + u * ((1 - v) * table[i + 1, j] +
                                                                            v * table[i + 1, j + 1])
        return nominal + off * np.where(nominal < 0, -1, 1) * np.sqrt(X * X + Y * Y + Z * Z)[:, None] / scale
