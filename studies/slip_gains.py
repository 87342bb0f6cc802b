"""How a Mecanum base moves on average over where its rollers stand, as `simulate` finds it, for every direction."""
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from youbot_base_sim.base import WHEELS
from .odometry_records import BASE

SPIN_RADIUS, CREEP = 2e-3, 3e-4                         # m; m/s, the regularization speed
BODY_MASS, WHEEL_MASS, FRICTION = 3, 0.1, 0.5           # assumed; only dry friction over f N matters, nearly
LIMIT = FRICTION * (BODY_MASS + 4 * WHEEL_MASS) * 9.81 / 4  # f N of a wheel, N
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


def simulated(simulate, t, wheels, **scene):
    """Columns by their names of the rows of a scene whose drive names table.csv: times (s) and four wheels each."""
    with tempfile.TemporaryDirectory() as folder:
        file, table, rows = (Path(folder) / name for name in ("scene.yaml", "table.csv", "rows.csv"))
        np.savetxt(table, np.c_[t, wheels], "%.17g", ",", header=",".join(("t", *WHEELS)), comments="")
        file.write_text(json.dumps({"solver": {"relative_tolerance": 1e-5}, **scene}))
        subprocess.run([simulate, file, "--quiet", "--csv", rows], check=True)
        with open(rows) as csv:
            return dict(zip(csv.readline().strip().split(","), np.loadtxt(csv, delimiter=",").T))


def drive(simulate, t, angles, section, output_rate):
    """Rows t, x, y, psi and the wheels' angles of a base whose motors turn the wheels to `angles` (rad) at t (s)."""
    rates = np.diff(angles, axis=0, append=angles[-1:]) / np.diff(t, append=t[-1] + 1)[:, None]
    rows = simulated(simulate, t, rates, duration=t[-1], output_rate=output_rate, robot=section, motors=MOTORS, floor={
        "friction": FRICTION, "spin_radius": SPIN_RADIUS, "slip_regularization": CREEP}, drive={
            "velocity_table": "table.csv"}, initial={"wheel_angles": list(angles[0])})
    return np.stack([rows[name] for name in ("t", "x", "y", "psi", *(f"phi_{wheel}" for wheel in WHEELS))], -1)


def scattered(count):
    """Angles (count, 4) in a roller, evenly scattered, in no order: Roberts' additive recurrence."""
    root = 1.1673039782614187  # of x^5 = x + 1
    order = np.random.default_rng(1).permutation(count)  # else each step has the same sign, and leaves wheels strained
    return PITCH * ((0.5 + np.outer(order, root ** -np.arange(1.0, 5))) % 1)


def mean_motion(simulate, direction, section, phases):
    """By how much a base departs from the motion by ideal kinematics of its wheels, in X, Y, (h + l) psi: a mean over
    SPEED, in a direction by the same."""
    rates = np.array(BASE.rolling_rates(*np.array(direction) * SPEED / [1, 1, BASE.half_lengths]))
    angle = scattered(phases)
    steps = (np.diff(angle, axis=0, prepend=angle[:1]) + PITCH / 2) % PITCH - PITCH / 2
    t = np.arange(round(phases * PERIOD / TABLE_STEP) + 1) * TABLE_STEP
    done = ((t[:, None] - PERIOD * np.arange(phases)) / RAMP).clip(0, 1)
    angles = angle[0] + np.outer(t, rates) + done**2 * (3 - 2 * done) @ steps
    rows = drive(simulate, t, angles, section, round(1 / RAMP))
    begin, end = (rows[round(instant / RAMP)::round(PERIOD / RAMP)][:phases] for instant in (BEGIN, END))
    yaw = end[:, 3] - begin[:, 3] + 1e-12
    moved = ((end - begin)[:, 1:3] @ [1, 1j]) * np.exp(-1j * begin[:, 3])
    velocity = (moved * 1j * yaw / (np.exp(1j * yaw) - 1)).mean()  # along an arc
    moved = np.array([velocity.real, velocity.imag, yaw.mean()])
    rolled = BASE.velocities((end - begin)[:, 4:].mean(axis=0))
    return (moved - rolled) * [1, 1, BASE.half_lengths] / (SPEED * (END - BEGIN))


class SlipGains:
    """Departures for directions of an octant, which has them all by symmetry, and some frictions of the rollers."""

    def __init__(self, simulate, contacts="located", points=17, phases=128):
        located = contacts == "located"
        self.frictions = 1e-3 * np.array([1.1, 2.2, 3.3] if located else [2.2, 5, 5.4, 5.6])  # they lock soon
        self.points = points
        angles, phases = np.linspace(0, np.pi / 2, points), phases if located else 1

        def along_meridian(azimuth, section):
            return [mean_motion(simulate, (np.cos(e) * np.cos(azimuth), np.cos(e) * np.sin(azimuth), np.sin(e)),
                                section, phases) for e in angles[:-1]]
        self.table = []
        for friction in self.frictions:
            section = robot(friction, contacts)
            pole = mean_motion(simulate, (0, 0, 1), section, phases)
            self.table.append([[*along_meridian(azimuth, section), pole] for azimuth in angles])
        self.table = np.array(self.table)

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

    def ratios(self, friction, turn=0.4):
        """k_Y / k_X and q, of a circle with (h + l) Omega = `turn` times the speed, as docs/validation.md has them."""
        Omega = turn / BASE.half_lengths
        forward, lateral, around, across = self.motion(
            np.array([[1, 0, 0], [0, 1, 0], [1, 0, Omega], [0, 1, Omega]], float), friction)
        return lateral[1] / forward[0], across[2] / around[2]
