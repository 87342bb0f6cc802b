"""Errors of odometry by kinematics and by slip on simulated drives of bases with other numbers of rollers, and of twins."""
import math
from pathlib import Path

import numpy as np
import yaml

from youbot_base_sim._simulator import Simulation, run
from youbot_base_sim.analysis.section import rms
from youbot_base_sim.base import DRIVER_RADIUS, WHEELS, Base
from youbot_base_sim.records import POSE
from .builds import run_quietly
from .odometry_models import least_squares
from .pages import table

DRIVES = 3
RATE, SPAN = 100, 20            # Hz of the rows, s over which errors count
FITTED, TESTED = 60, 100        # s of the drives
SPEEDS = 0.4, 0.3, 0.8          # m/s, m/s, rad/s: largest commands
# Of twins: drives, and how often they are read, s; what wheels read in ticks (rad), rpm (rad/s) and mA (N m), with noise of
# efforts (N m), and a tracker's (m, m, rad).
TRAINED, TRIED, INTERVAL, GEAR = 120, 600, 0.02, 364 / 9405
TICK, RPM, MILLIAMPERE = math.tau * GEAR / 4000, math.tau * GEAR / 60, 0.0335e-3 / GEAR
EFFORT_NOISE, POSE_NOISE = 5e-3, (3e-4, 3e-4, 5e-4)
# Twins begin to fit 10 % off.
GUESS = {"duration": 1, "drive": {"torque": [{"start": 0}]}, "robot": {
    "profile": "measured", "wheel_radius": 0.045, "roller_axis_radius": 0.03195, "half_track": 0.135, "com": [0.0144, -0.0234],
    "roller_dry_friction": 0.0657}, "solver": {"relative_tolerance": 1e-5, "absolute_tolerance": 1e-8}}
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
        """Poses, by name, whose motion in X, Y and yaw is this many times that of wheels that roll: 3 numbers, or 12 if each
        wheel's share in each of them has its own."""
        X, Y, yaw = (np.reshape(factors, (3, -1)) * self.base.velocities(np.eye(4))) @ np.diff(angles_of(rows), axis=0).T
        psi = np.concatenate([[0], np.cumsum(yaw)])
        moved = np.concatenate([[0], np.cumsum((X + 1j * Y) * np.exp(0.5j * (psi[1:] + psi[:-1])))])
        return {"x": moved.real, "y": moved.imag, "psi": psi}

    def fitted_factors(self, rows, count, length=2 * RATE):
        """So many of them, by least squares, to displacements over so many rows."""
        true = displacements(rows, length)
        return least_squares(
            lambda factors: (displacements(self.by_kinematics(rows, factors), length) - true).ravel(), np.ones(count))


def angles_of(rows):
    return np.column_stack([rows["phi_" + wheel] for wheel in WHEELS])


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
        factors, rows = bases.fitted_factors(bases.driven(10 * seed, FITTED), 3), bases.driven(10 * seed + 1, TESTED)
        offsets = (REPLICAS + np.random.default_rng(99).uniform(0, 1, 4)) * bases.pitch
        unknown = np.mean([displacements(bases.replayed(rows, offset), length) for offset in offsets], axis=0)
        known = displacements(bases.replayed(rows, np.zeros(4)), length)
        for errors_of, moved in zip(found, (displacements(bases.by_kinematics(rows, factors), length), unknown, known)):
            errors_of.append(moved - displacements(rows, length))
    return [1e3 * np.sqrt((np.concatenate(e)[:, axes]**2).sum(axis=1).mean()) for e in found
            for axes in (slice(0, 2), slice(2, 3))]


def twin(seed, duration, angles):
    """What encoders and a tracker read of a base whose wheels begin at these angles (rad), by columns of identify_tables."""
    draw, base, command, rows = np.random.default_rng(seed), Base(wheel_radius=DRIVER_RADIUS), 0.1, []
    simulation = Simulation({"duration": duration + 1, "robot": {"profile": "measured"}, "motors": {"quantized": True},
                             "initial": {"wheel_angles": angles.tolist()}, "solver": {
                                 **GUESS["solver"], "control_period": 1e-3}})
    simulation.set_points("velocity", np.zeros(4))
    for t in np.arange(round(duration / INTERVAL) + 1) * INTERVAL:
        state = simulation.state
        effort = np.rint((simulation.torque + EFFORT_NOISE * draw.normal(size=4)) / MILLIAMPERE) * MILLIAMPERE
        pose = np.array([state[name] for name in POSE[:3]]) + POSE_NOISE * draw.normal(size=3)
        rows.append((t, *np.floor(state["phi"] / TICK) * TICK, *np.rint(state["dphi"] / RPM) * RPM, *effort, *pose))
        if t >= command:
            simulation.set_points("velocity", base.rolling_rates(*SPEEDS * draw.uniform(-1, 1, 3)))
            command = t + draw.uniform(2, 5)
        simulation.step(periods=round(INTERVAL / 1e-3))
    return dict(zip(("t", *(f"{what}_{wheel}" for what in ("phi", "dphi", "torque") for wheel in WHEELS), *POSE[:3]),
                    np.transpose(rows)))


def twin_errors(seed, folder, fitter, follower):
    """By odometry: errors over windows of SPAN (n, 3), m, m, rad; covariances (n, 3, 3), none of kinematics."""
    angles, found, wheel_error = np.random.default_rng(seed).uniform(0, math.tau, 4), {}, {}
    drives = {name: twin(2 * seed + k, duration, angles) for k, (name, duration) in enumerate(
        (("trained", TRAINED), ("tried", TRIED)))}
    for name, drive in drives.items():
        np.savetxt(folder / f"{name}.csv", np.transpose(list(drive.values())), "%.12g", ",", header=",".join(drive), comments="")
    guess, known, unknown = (folder / f"{name}.yaml" for name in ("guess", "known", "unknown"))
    guess.write_text(yaml.safe_dump(GUESS))
    for scene, options in (known, []), (unknown, ["--unknown-angles"]):
        text = run_quietly([fitter, folder / "trained.csv", "--encoders", "--scene", guess, "-o", scene, *options])
        wheel_error[scene] = text.split("~wheel_error: ")[1].split()[0]
    at_zero = np.array(yaml.safe_load(known.read_text())["initial"]["wheel_angles"]) - angles_of(drives["trained"])[0]
    bases, length = Bases(6, folder), round(SPAN / INTERVAL)
    true = displacements(drives["tried"], length)[::2]
    for name, factors in (
            ("the driver's odometry", np.full(3, DRIVER_RADIUS / bases.base.wheel_radius)),
            *((f"kinematics: {what} fitted", bases.fitted_factors(drives["trained"], count, round(2 / INTERVAL)))
              for count, what in ((3, "radius, track and lateral factor"), (12, "12 factors")))):
        moved = displacements(bases.by_kinematics(drives["tried"], factors), length)[::2]
        found[name] = moved - true, np.empty((0, 3, 3))
    for name, scene, *options in (
            ("parameters 10 % off, unknown angles", guess, "none"),
            ("fitted for unknown angles", unknown, "none"),
            ("fitted with angles, which efforts then tell", known, "efforts"),
            ("fitted with angles", known, "none", *at_zero)):
        options[1:1] = length, wheel_error.get(scene, 0)
        rows = np.loadtxt(run_quietly([follower, scene, folder / "tried.csv", *map(str, options)]).splitlines())
        found["slip odometry, " + name] = rows[:, :3] - true, rows[:, 3:].reshape(-1, 3, 3)
    return found


def twin_table(seeds, folder, fitter, follower):
    bases, rows = [twin_errors(seed, folder, fitter, follower) for seed in seeds], []
    for name in bases[0]:
        off, covariance = (np.concatenate([base[name][k] for base in bases]) for k in (0, 1))
        sizes = 1e3 * np.array([np.hypot(*off[:, :2].T), np.abs(off[:, 2])])
        squared = [x @ np.linalg.solve(P, x) for x, P in zip(off, covariance)]
        rows.append([name, *(f"{rms(size):.1f}, {np.median(size):.1f}" for size in sizes),
                     f"{np.mean(squared):.2g}" if squared else ""])
    return table(["odometry", f"off after {SPAN} s, mm: rms, median", "mrad", "squared over its covariance"], rows)
