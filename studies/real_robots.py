"""Measurements on real youBots, and the same on the simulated base."""
import math

import numpy as np

from youbot_base_sim._simulator import Batch
from youbot_base_sim.analysis.section import rms
from youbot_base_sim.base import DRIVER_RADIUS, Base
from youbot_base_sim.figures import BLUE, GREEN, ORANGE, RED, new_figure, save
from .builds import ROOT
from .odometry_records import BASE
from .pages import table
from .slip_gains import FLOOR, MOTORS, robot

YOUBOT = Base()
SCALES = {"A": 1.3, "B": 0.76}
GAINS = (0.4, 1.2)           # of the velocity loops, N m s/rad and N m/rad
PERIODS, RATE = 5, 200       # of 1 ms from row to row; of rows, Hz
STARTS = 32                  # sets of angles at which wheels may start
ROW, SCATTER = 0.1, 0.03     # s between A's rows; of a speed, by which their means of four wheels scatter ahead
PROFILES = {**{name: {"profile": name} for name in ("paper", "measured", "measured_a", "measured_b")},
            **{robot: {"profile": {"name": "measured", "friction_scale": scale}} for robot, scale in SCALES.items()}}


class Runs:
    """Motions of a base whose wheels track the constant rates at which one like it rolls at `velocities` (n, 3), after 5 s
    at `before`: `x`, `y`, `psi` (rows, n), `phi`, `dphi`, `torque` of wheels (rows, n, 4). `starts`: of `initial`."""

    def __init__(self, section, velocities, duration, floor=None, gains=GAINS, base=YOUBOT, before=None, **starts):
        self.rates = np.array(base.rolling_rates(*np.transpose(velocities).astype(float))).T
        batch = Batch({"duration": duration, "robot": section, "floor": floor or {},
                       "solver": {"control_period": 1 / RATE / PERIODS, "relative_tolerance": 1e-5},
                       "motors": {"velocity_proportional_gain": gains[0], "velocity_integral_gain": gains[1]}},
                      len(self.rates))
        for key, values in starts.items():
            batch.expand(f"initial.{key}", values)
        if before:
            batch.set_points("velocity", base.rolling_rates(*before))
            batch.step(periods=5 * RATE * PERIODS)
        batch.set_points("velocity", self.rates)
        states, torques = [batch.state.copy()], []
        for _ in range(duration * RATE):
            batch.step(periods=PERIODS)
            states.append(batch.state.copy())
            torques.append(batch.torque)
        self.torque, states = np.array(torques), np.array(states)
        self.x, self.y, self.psi, self.phi, self.dphi = (states[name] for name in ("x", "y", "psi", "phi", "dphi"))


def steady_torques(base, section, velocities, floor=None):
    """Mean torque of each wheel as the base's records have it, N m: A at constant speed, B over 4 s from rest, here
    without the first half second: at 45 degrees two wheels keep the torque that they stopped with."""
    duration, skipped = (20, 10) if base == "A" else (4, 0.5)
    return Runs(section, velocities, duration, floor).torque[int(skipped * RATE):].mean(axis=0)


def mean_torques(base, name, velocities):
    """Means over the wheels of |mean torque|, N m."""
    return np.abs(steady_torques(base, PROFILES[name], velocities)).mean(axis=1)


def directions_of_B():
    """Direction of travel, degrees, and torque on linoleum, N m, as recorded."""
    return np.loadtxt(ROOT / "docs" / "validation" / "robot_b.csv", delimiter=",", skiprows=1, usecols=(0, 1))


def velocity_along(degrees, speed=0.2):
    return speed * math.cos(math.radians(degrees)), speed * math.sin(math.radians(degrees)), 0


def torque_table():
    rows = []
    for robot, what, velocity, real in (
            ("A", "forward, 0.1 m/s", (0.1, 0, 0), 0.237), ("A", "lateral, 0.1 m/s", (0, 0.1, 0), 1.024),
            ("A", "yaw, 0.314 rad/s", (0, 0, 0.314), 0.666), ("B", "forward, 0.1 m/s", (0.1, 0, 0), 0.159),
            *(("B", what + ", 0.2 m/s", velocity_along(degrees), real) for degrees, what, real in (
                (0, "forward", 0.168), (30, "30 degrees", 0.451), (45, "45 degrees", 0.504),
                (60, "60 degrees", 0.698), (90, "lateral", 0.719)))):
        measured, paper = (mean_torques(robot, name, [velocity])[0] for name in (robot, "paper"))
        rows.append([robot, what, f"{real:.3f}", f"{measured:.3f}",
                     f"{measured - real:+.3f}, {100 * (measured / real - 1):+.0f} %", f"{paper:.3f}"])
    return table(["robot", "motion", "real, N m", "`measured`, N m", "off by", "`paper`, N m"], rows)


# What the records have of a base's torques, N m, as functions of the means of its four wheels.
SIZE, FORWARD, YAW = (lambda wheels: float(np.abs(wheels).mean()), lambda wheels: float(wheels @ [1, 1, 1, 1]) / 4,
                        lambda wheels: float(wheels @ [-1, 1, -1, 1]) / 4)
CIRCLE = (0.1, 0, 0.25)
STEADY_OF_A = [((0.1, 0, 0), SIZE, 0.237), ((0, 0.1, 0), SIZE, 1.024), ((0, 0, 0.314), SIZE, 0.666),
               (CIRCLE, FORWARD, 0.243), (CIRCLE, YAW, 0.492)]
TRANSIENT_OF_B = 0.01  # N m: of the start, which B's means include and the simulated ones leave out
FITTED = ("dry_friction", "wheel_damping", "roller_dry_friction", "roller_damping", "roller_dry_friction_rate")
MEASURED = np.array([0.18, 0.01, 0.073, 0.0025, 2])
STEPS = np.array([0.01, 0.003, 0.004, 0.0003, 0.2])  # by which the effect of each is measured
LEAST = np.array([0, 0, 0, 0, 0.3])


def off(values, spin_radius):
    """Differences of both robots with these frictions from the records, N m: five figures of A, 19 directions of B."""
    degrees, torques = directions_of_B().T
    records = {"A": STEADY_OF_A, "B": [(velocity_along(along), SIZE, torque - TRANSIENT_OF_B)
                                       for along, torque in zip(degrees, torques)]}
    for base, scale in SCALES.items():
        section = dict(zip(FITTED, (values * ([scale] * 4 + [1])).tolist()))
        velocities, parts, torques = zip(*records[base])
        found = steady_torques(base, section, velocities, {"spin_radius": spin_radius})
        yield np.array([part(wheels) - torque for part, wheels, torque in zip(parts, found, torques)])


def fit(free, spin_radius):
    """The first `free` of FITTED fitted to both records, each of which counts for half. Two rounds of Gauss and
    Newton's method are enough: the problem is nearly linear."""
    def residuals(values):
        return np.concatenate([part / math.sqrt(len(part)) for part in off(values, spin_radius)])
    values = MEASURED.copy()
    for _ in range(2):
        here = residuals(values)
        slopes = [(residuals(values + step) - here) / step.sum() for step in np.diag(STEPS)[:free]]
        values[:free] -= np.linalg.lstsq(np.array(slopes).T, here, rcond=None)[0]
        values = np.maximum(values, LEAST)
    return values


def fit_table():
    rows = []
    for what, free, spin_radius in (("`measured`", 0, 0), ("fitted again", 4, 0),
                                    ("`measured`, spin radius 2 mm", 0, 2e-3), ("fitted with it", 4, 2e-3),
                                    ("fitted with it, and the smoothing too", 5, 2e-3)):
        values = fit(free, spin_radius) if free else MEASURED
        rows.append([what, *(f"{value:.3g}" for value in values),
                     *(f"{rms(part):.4f}" for part in off(values, spin_radius))])
    return table(["friction", *(f"`{key}`" for key in FITTED), "off A, N m", "off B, N m"], rows)


def crossing(t, rate, share):
    """When the velocity first reaches a share of its final value, 1."""
    k = np.argmax(rate >= share)
    return t[k - 1] + (t[k] - t[k - 1]) * (share - rate[k - 1]) / (rate[k] - rate[k - 1])


def rises_and_overshoots(section, gains, velocity, before, starts):
    """Of the wheels' mean angular velocity, in rows as A's record has them: times from 10 to 90 % of what is commanded,
    s, and overshoots, %, (n, 2), after rest or `before`, from wheel angles `starts` (n, 4)."""
    runs = Runs(section, [velocity] * len(starts), 4, gains=gains, base=Base(wheel_radius=DRIVER_RADIUS), before=before,
                wheel_angles=starts)
    found, draw, every = [], np.random.default_rng(5), round(ROW * RATE)
    for share in (runs.dphi / runs.rates).mean(axis=2).T:
        rows = np.r_[share[0], share[draw.integers(0, every)::every]]
        rows += SCATTER * draw.normal(size=len(rows))
        t = np.arange(len(rows)) * ROW
        found.append((crossing(t, rows, 0.9) - crossing(t, rows, 0.1), 100 * (rows.max() - 1)))
    return np.array(found)


def rise_table():
    starts = np.random.default_rng(1).uniform(0, math.pi / 3, (STARTS, 4)).round(4).tolist()
    rows = [["base A", "", "0.26 s, 21 %", "0.54 s, 16 %; 0.50 s, 15 %", "0.32 s, 13 %"]]
    for name, gains in ("paper", GAINS), ("measured", GAINS), ("measured_a", (0.2, 1.5)), ("measured_b", (0.33, 0.5)):
        out_of = (0.1, 0, 0) if name == "measured_a" else None  # as A was driven
        rows.append([f"`{name}`", f"{gains[0]}, {gains[1]}", *(
            "{:.2f} +- {:.2f} s, {:.0f} +- {:.0f} %".format(*np.stack([found.mean(0), found.std(0)], 1).ravel())
            for found in (rises_and_overshoots(PROFILES[name], gains, velocity, before, starts)
                          for velocity, before in (((0.1, 0, 0), None), ((0, 0.1, 0), out_of), ((0, 0, 0.314), None))))])
    return table(["mean and deviation over wheel angles", "P, I", "forward", "lateral", "yaw"], rows)


def ripple_of_C():
    """Amplitudes of the track at 8 cycles a turn, in lateral motion: root mean squares over initial wheel angles."""
    starts, found = np.random.default_rng(1).uniform(0, 2 * math.pi, (96, 4)).round(4).tolist(), []
    runs = Runs(robot(2.2e-3), [(0, 0.065, 0)] * len(starts), 9, FLOOR, tuple(MOTORS.values()), BASE, wheel_angles=starts)
    t = np.linspace(0, 1, len(runs.x))
    for k, phi in enumerate(np.abs(runs.phi - runs.phi[0]).mean(axis=2).T):
        waves = np.array([t**0, t, t**2, t**3, np.cos(8 * phi), np.sin(8 * phi)])
        track = np.array([runs.y[:, k], runs.x[:, k], runs.psi[:, k]])
        found.append(np.hypot(*np.linalg.lstsq(waves[:, 300:].T, track[:, 300:].T, rcond=None)[0][-2:]))
    return ("C's track ripples by {:.3f} mm along, {:.3f} mm across, {:.3f} mrad (C: 0.198, 0.082, 0.64)\n".format(
        *(1e3 * rms(part) for part in np.transpose(found))))


def ripple_of_B():
    """A line on the torque in lateral motion at 0.2 m/s."""
    run = Runs(PROFILES["B"], [(0, 0.2, 0)], 20, twist=[[0, 0.2, 0]])
    wheel = run.torque[len(run.torque) // 2:, 0, 1]
    spectrum = np.abs(np.fft.rfft((wheel - wheel.mean()) * np.hanning(len(wheel)))) * 4 / len(wheel)
    frequency = np.fft.rfftfreq(len(wheel), 1 / RATE)
    turns = (run.phi[-1, 0, 1] - run.phi[len(run.phi) // 2, 0, 1]) / (2 * math.pi) / 10
    return (f"ripple in lateral motion: {frequency[spectrum.argmax()] / turns:.2f} per revolution of the wheel, "
            f"{spectrum.max():.3f} N m (B: 6.0, about 0.06)\n")


def gain_ratios(robot, base, floor=None, gains=GAINS):
    """Lateral over forward path length per revolution of the wheels; rotation on a circle driven laterally over that
    on one driven forward."""
    velocities = [(0.07, 0, 0), (0, 0.07, 0), (0.07, 0, 0.14), (0, 0.07, 0.14)]
    runs = Runs(robot, velocities, 30, floor, gains, base, twist=velocities)
    first = len(runs.x) // 3
    x, y, psi, phi = (of[first:] for of in (runs.x, runs.y, runs.psi, runs.phi))
    moved = np.sum((np.diff(x, axis=0) + 1j * np.diff(y, axis=0)) * np.exp(-0.5j * (psi[1:] + psi[:-1])), axis=0)
    rolled = np.abs(phi[-1] - phi[0]).mean(axis=1) * base.wheel_radius
    rotation = (psi[-1] - psi[0]) / rolled
    return (moved[1].imag / rolled[1]) / (moved[0].real / rolled[0]), rotation[3] / rotation[2]


def gain_table():
    free_C, dry_C = robot(0), robot(2.2e-3)
    gentle = (0.02, 0.1)  # gains for wheels of a sixtieth of the youBot's inertia
    return table(["wheels", "k_Y/k_X", "q"], [
        [what, *(f"{ratio:.4f}" for ratio in gain_ratios(*arguments))] for what, *arguments in (
            *((f"the youBot, {owner} friction", PROFILES[name], YOUBOT)
              for owner, name in (("paper's", "paper"), ("A's", "A"), ("B's", "B"))),
            ("C, rollers without friction", free_C, BASE, {}, gentle),
            ("C, dry rollers, 2.2 mm times f N", dry_C, BASE, {}, gentle),
            ("C, dry rollers and spin friction, 2 mm", dry_C, BASE, {"spin_radius": 2e-3}, gentle))])


def draw(path):
    degrees, torques = zip(*directions_of_B())
    axes = new_figure(figsize=(7, 4.6)).subplots()
    axes.errorbar(degrees, torques, 0.02, fmt="ko", markersize=4, capsize=2,
                  label="real base B on linoleum, 0.2 m/s (bars: largest standard error)")
    for key, label, style in (("B", "simulated B: profile measured, times 0.76", dict(linestyle="-", color=RED)),
                              ("paper", "simulated with the paper's friction", dict(linestyle="--", color=BLUE))):
        axes.plot(degrees, mean_torques("B", key, [velocity_along(angle) for angle in degrees]), label=label, **style)
    axes.errorbar((0, 90), (0.237, 1.024), ((0.057, 0.094), (0.063, 0.086)), fmt="s", color=GREEN, capsize=4,
                  label="real base A, 0.1 m/s (bars: range)")
    axes.plot((0, 90), mean_torques("A", "A", [velocity_along(angle, 0.1) for angle in (0, 90)]), "D", color=ORANGE,
              markersize=10, fillstyle="none", label="simulated A: profile measured, times 1.3")
    axes.set(xlabel="direction of travel, degrees (0 forward, 90 lateral)", ylabel="mean torque of a wheel, N m",
             ylim=(0, 1.9), xlim=(-2, 92), title="Torque over the direction of travel, real and simulated")
    axes.grid(alpha=0.3)
    axes.legend(loc="upper left", fontsize=9)
    axes.figure.tight_layout()
    save(axes.figure, path, dpi=120)
