"""Errors of odometry by kinematics and by slip on simulated drives of bases with other numbers of rollers."""
from pathlib import Path

import numpy as np

from youbot_base_sim._simulator import run
from youbot_base_sim.base import WHEELS, Base
from .odometry_models import least_squares

DRIVES = 3
RATE, SPAN = 100, 20            # Hz of the rows, s over which errors count
FITTED, TESTED = 60, 100        # s of the drives
SPEEDS = 0.4, 0.3, 0.8          # m/s, m/s, rad/s: largest commands
# Shares of a roller at which replicas begin that stand for unknown angles: their mean motion counts.
REPLICAS = np.array([[0, .5, .25, .75], [.25, .75, .5, 0], [.5, 0, .75, .25], [.75, .25, 0, .5]])


class Bases:
    """Simulated bases with so many rollers a wheel; tables of their drives are in a folder."""

    def __init__(self, rollers, folder):
        self.base = Base(rollers_per_wheel=rollers, roller_axis_radius=0.035)
        self.pitch, self.table = 2 * np.pi / rollers, Path(folder) / "table.csv"

    def run(self, duration, kind, table, angles):
        np.savetxt(self.table, table, "%.12g", ",", header=",".join(("t", *WHEELS)), comments="")
        robot = {"profile": "measured", "rollers_per_wheel": self.base.rollers_per_wheel,
                 "roller_axis_radius": self.base.roller_axis_radius}
        return run({"duration": duration, "output_rate": RATE, "robot": robot, "drive": {kind: str(self.table)},
                    "solver": {"relative_tolerance": 1e-5}, "initial": {"wheel_angles": angles}})

    def driven(self, seed, duration):
        """A drive by random commands of 2 to 5 s."""
        draw, t, table = np.random.default_rng(seed), 0.0, []
        while t < duration:
            table.append((t, *self.base.rolling_rates(*SPEEDS * draw.uniform(-1, 1, 3))))
            t += draw.uniform(2, 5)
        return self.run(duration, "velocity_table", table, draw.uniform(0, 2 * np.pi, 4))

    def replayed(self, rows, offset):
        """The motion of a base whose wheels turn as in these rows, from angles that are off by so much."""
        angles = angles_of(rows)
        return self.run(float(rows["t"][-1]), "wheel_angle_table", np.column_stack([rows["t"], angles]),
                        angles[0] + offset)

    def by_kinematics(self, rows, factors):
        """Poses, by name, whose motion in X, Y and yaw is this many times that of wheels that roll."""
        X, Y, yaw = np.array(self.base.velocities(np.diff(angles_of(rows), axis=0))) * np.reshape(factors, (3, 1))
        psi = np.concatenate([[0], np.cumsum(yaw)])
        moved = np.concatenate([[0], np.cumsum((X + 1j * Y) * np.exp(0.5j * (psi[1:] + psi[:-1])))])
        return {"x": moved.real, "y": moved.imag, "psi": psi}

    def fitted_factors(self, rows):
        """By least squares, to displacements over 2 s."""
        true = displacements(rows, 2 * RATE)
        return least_squares(
            lambda factors: (displacements(self.by_kinematics(rows, factors), 2 * RATE) - true).ravel(), np.ones(3))


def angles_of(rows):
    return np.column_stack([rows[f"phi_{wheel}"] for wheel in WHEELS])


def displacements(rows, length):
    """In the base's frame, over so many rows from each half of it on: (n, 3), m, m, rad."""
    begin = np.arange(0, len(rows["psi"]) - length, length // 2)
    x, y, psi = (rows[name][begin + length] - rows[name][begin] for name in ("x", "y", "psi"))
    moved = (x + 1j * y) * np.exp(-1j * rows["psi"][begin])
    return np.column_stack([moved.real, moved.imag, psi])


def errors(rollers, folder):
    """Root mean squares in mm and mrad: of kinematics, of slip with unknown and with known angles."""
    bases, length = Bases(rollers, folder), SPAN * RATE
    found = [[], [], []]
    for seed in range(1, DRIVES + 1):
        factors, rows = bases.fitted_factors(bases.driven(10 * seed, FITTED)), bases.driven(10 * seed + 1, TESTED)
        offsets = (REPLICAS + np.random.default_rng(99).uniform(0, 1, 4)) * bases.pitch
        unknown = np.mean([displacements(bases.replayed(rows, offset), length) for offset in offsets], axis=0)
        known = displacements(bases.replayed(rows, np.zeros(4)), length)
        for errors_of, moved in zip(found, (displacements(bases.by_kinematics(rows, factors), length), unknown, known)):
            errors_of.append(moved - displacements(rows, length))
    return [1e3 * np.sqrt((np.concatenate(e)[:, axes]**2).sum(axis=1).mean()) for e in found
            for axes in (slice(0, 2), slice(2, 3))]
