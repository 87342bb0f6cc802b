"""Draws a table written by `sweep`, and prints what it draws.

Usage: plot_sweep scatter TABLE.csv PLOT.png X Y [--color COLUMN]
       plot_sweep histogram TABLE.csv PLOT.png COLUMN...
       plot_sweep rank TABLE.csv PLOT.png QUANTITY...
       plot_sweep effects TABLE.csv PLOT.png QUANTITY...

scatter: a point for each run. histogram: the distribution of each column. rank: which axes matter for a quantity, by
Sobol' index, the share of its variance that vanishes if the axis is fixed (estimated from any table, as the variance
between slices of the axis). effects: each quantity against each axis, and its mean in slices of the axis. Runs without
a value are left out.
"""
import re
from pathlib import Path

import numpy as np

from .command_line import Parser, Refused, shown
from .figures import BLUE, RED, WHEEL_NAMES, new_figure, plain, save
from .files import Outputs
from .report import read_csv

MAX_SLICES = 100
MIN_RANKED = 10  # runs: fewer tell nothing about which axes matter
LARGEST = 1e150  # whose square is a number
QUANTITIES = {  # of sweep, in words and units
    "x": "final x, m", "y": "final y, m", "psi": "final heading, rad", "V_X": "final forward velocity, m/s",
    "V_Y": "final lateral velocity, m/s", "Omega": "final yaw rate, rad/s", "path_length": "path length, m",
    "odometry_error": "odometry error, m", "odometry_heading_error": "odometry heading error, rad",
    "largest_slip": "largest slip speed, m/s", "kinetic_energy": "final kinetic energy, J",
    "drive_work": "drive work, J", "energy_balance_error": "energy balance error, J", "switches": "roller switches"}
UNITS = {key: unit for unit, keys in {  # of a scene's keys by their last part; others have none
    "s": "duration start end period step control_period command_delay", "Hz": "output_rate",
    "kg": "mass body_mass wheel_mass", "kg m^2": "total_inertia wheel_inertia roller_inertia inertia",
    "m": "com com_height half_wheelbase half_track wheel_radius roller_axis_radius spin_radius rectangle edge position "
         "point", "rad": "angle uphill wheel_angles resolution", "degrees": "roller_angle", "m/s": "slip_regularization holding_speed",
    "rad/s": "wheel_rates roller_rates dry_friction_rate roller_dry_friction_rate max_wheel_rate", "m/s^2": "gravity",
    "N": "diagonal_preload force", "N m": "dry_friction roller_dry_friction torque constant cos sin max_wheel_torque",
    "N m s": "wheel_damping roller_damping", "N s/m": "viscous_friction", "N m s/rad": "velocity_proportional_gain",
    "N m/rad": "velocity_integral_gain"}.items() for key in keys.split()}


def unit(name):
    """The unit of a scene's key; empty if it has none."""
    *sections, last = re.sub(r"\[\d+\]", "", name).split(".")
    turns = name.endswith("[2]") if last in ("pose", "twist") else "Omega" in sections
    if last in ("pose", "twist") or "reference_motion" in sections and last != "period":
        return ("rad" if turns else "m") + ("" if last == "pose" else "/s")
    return "" if "profile" in sections else UNITS.get(last, "")


def label(name):
    """A column in words, with its unit, and the wheel or direction of a key's index."""
    if name in QUANTITIES:
        return QUANTITIES[name]
    return plain(key_label(name)) + (f", {unit(name)}" if unit(name) else "")


def key_label(name):
    parts = re.fullmatch(r"(.*)\.(\w+)(?:\[([0-3])\])?", name)
    if not parts:
        return name
    section, key, index = parts.groups()
    places = WHEEL_NAMES if re.search("wheel|roller|friction|constant|cos|sin", key) else (
        "xyz" if key in ("com", "position", "point", "force") and index != "3" else "0123")
    return f"{section}: {key.replace('_', ' ')}" + (f", {places[int(index)]}" if index else "")


class Table:
    """Columns of a table by their names; cells without a number are NaN."""

    def __init__(self, path):
        self.path, self.name = shown(path), plain(Path(path).stem)
        self.names, *self.rows = read_csv("", path, "a table by sweep")
        if self.names[0] != "run" or "status" not in self.names:
            raise Refused(f"{self.path}: no columns run and status; must be a table by sweep")
        self.axes = self.names[1:self.names.index("status")]

    def need_axes(self):
        """Throws Refused where there are none."""
        if not self.axes:
            raise Refused(f"{self.path}: no axes; must have a column between run and status")
        return self.axes

    def texts(self, name):
        if name not in self.names:
            raise Refused(f"{self.path}: column = {shown(name)}: must be one of {', '.join(self.names[:-1])}")
        index = self.names.index(name)
        return [row[index] for row in self.rows]

    def numbers(self, name):
        values = as_numbers(self.texts(name))
        known = values[np.isfinite(values)]
        if not len(known) or np.abs(known).max() > LARGEST:
            raise Refused(f"{self.path}: column = {shown(name)}: must have numbers, up to {LARGEST:g}")
        return values

    def axis(self, name):
        """An axis as numbers: those of texts are their places among all of them in order."""
        values = as_numbers(self.texts(name))
        return values if np.isfinite(values).all() else np.unique(self.texts(name), return_inverse=True)[1].astype(float)


def as_numbers(texts):
    """NaN for what is no number."""
    def number(text):
        try:
            return float(text)
        except ValueError:
            return np.nan
    return np.array([number(text) for text in texts])


def slices(x):
    """Runs in slices of an axis, about as many as each has runs: one for each of a few values, else of equal size."""
    count = int(np.clip(np.sqrt(len(x)), 2, MAX_SLICES))
    values = np.unique(x)
    if len(values) <= count:
        return [np.flatnonzero(x == value) for value in values]
    return np.array_split(np.argsort(x, kind="stable"), count)


def sobol(x, y):
    """First-order Sobol' index: variance of the slices' means over all variance, less what chance adds."""
    parts = slices(x)
    if len(parts) < 2 or np.ptp(y) == 0 or len(y) <= len(parts):
        return 0.0
    between = sum(len(part) * (y[part].mean() - y.mean()) ** 2 for part in parts) / len(y)
    within = sum(((y[part] - y[part].mean()) ** 2).sum() for part in parts) / (len(y) - len(parts))
    return max(0.0, (between - within * (len(parts) - 1) / len(y)) / y.var())


def scatter(table, arguments):
    names, color = arguments.columns, arguments.color
    x, y = map(table.numbers, names)
    both = np.isfinite(x) & np.isfinite(y)
    if not both.any():
        raise Refused(f"{table.path}: columns {' and '.join(map(shown, names))}: must both have a number in some run")
    axis = new_figure(figsize=(6.4, 5)).subplots()
    points = axis.scatter(x, y, s=np.clip(2000 / len(x), 1.5, 25), c=table.numbers(color) if color else BLUE,
                          alpha=1 if color else float(np.clip(500 / len(x), 0.15, 1)), linewidths=0)
    if color:
        axis.figure.colorbar(points, label=label(color))
    axis.set(xlabel=label(names[0]), ylabel=label(names[1]), title=f"{table.name}: {both.sum()} runs")
    if sorted(names) == ["x", "y"]:
        axis.set_aspect("equal", "datalim")
    axis.grid(alpha=0.3)
    print(f"{both.sum()} of {len(x)} runs")
    return axis.figure


def histogram(table, arguments):
    names = arguments.columns
    figure = new_figure(figsize=(max(6.4, 3.4 * len(names)), 3.6))
    axes = figure.subplots(1, len(names), squeeze=False)[0]
    for axis, name in zip(axes, names):
        values = table.numbers(name)
        values = values[np.isfinite(values)]
        low, median, high = np.percentile(values, (5, 50, 95))
        axis.hist(values, bins=int(np.clip(np.sqrt(len(values)), 5, 60)), color=BLUE)
        for place, style in ((low, ":"), (median, "-"), (high, ":")):
            axis.axvline(place, color=RED, linestyle=style, linewidth=1.2)
        axis.set_xlabel(label(name))
        deviation = values.std(ddof=1) if len(values) > 1 else 0
        print(f"{shown(name)}: {len(values)} runs, mean {values.mean():.6g}, standard deviation {deviation:.3g}, "
              f"minimum {values.min():.6g}, 5 % {low:.6g}, median {median:.6g}, 95 % {high:.6g}, maximum {values.max():.6g}")
    axes[0].set_ylabel("number of runs")
    figure.suptitle(f"{table.name}: {len(table.rows)} runs; solid: median; dotted: 5 and 95 %", fontsize=11)
    return figure


def rank(table, arguments):
    names, keys = arguments.columns, table.need_axes()
    figure = new_figure(figsize=(max(6.4, 2 + 3 * len(names)), 1.7 + 0.4 * len(keys)))
    axes = figure.subplots(1, len(names), squeeze=False, sharey=True)[0]
    places = np.arange(len(keys))
    for axis, name in zip(axes, names):
        y = table.numbers(name)
        known = np.isfinite(y)
        if known.sum() < MIN_RANKED:
            raise Refused(f"{table.path}: {known.sum()} runs have {shown(name)}: rank needs at least {MIN_RANKED}")
        shares = [sobol(table.axis(key)[known], y[known]) for key in keys]
        axis.barh(places, shares, color=BLUE)
        axis.set_xlim(0, 1.05)
        axis.set_title(label(name), fontsize=10, loc="left")
        axis.set_xlabel("share of variance")
        axis.grid(alpha=0.3, axis="x")
        print(f"{shown(name)}, {known.sum()} runs:")
        for share, key in sorted(zip(shares, keys), reverse=True):
            print(f"  {shown(key):34}{share:6.3f}")
        print(f"  {'(several axes together, chance)':34}{max(0.0, 1 - sum(shares)):6.3f}")
    axes[0].set_yticks(places)
    axes[0].set_yticklabels(list(map(label, keys)))
    axes[0].invert_yaxis()
    figure.suptitle(f"{table.name}: what matters, by Sobol' indices of {len(table.rows)} runs", fontsize=11)
    return figure


def effects(table, arguments):
    names, keys = arguments.columns, table.need_axes()
    figure = new_figure(figsize=(max(6.4, 1 + 2.4 * len(keys)), 0.8 + 2.2 * len(names)))
    plots = figure.subplots(len(names), len(keys), squeeze=False, sharex="col", sharey="row")
    for row, name in zip(plots, names):
        y = table.numbers(name)
        known = np.isfinite(y)
        row[0].set_ylabel(label(name), fontsize=9)
        for plot, key in zip(row, keys):
            x = table.axis(key)
            plot.scatter(x, y, s=float(np.clip(1000 / len(x), 1, 15)), color=BLUE, linewidths=0,
                         alpha=float(np.clip(300 / len(x), 0.1, 1)))
            parts = [np.flatnonzero(known)[part] for part in slices(x[known])]
            means = [(x[part].mean(), y[part].mean()) for part in parts]
            plot.plot(*zip(*means), color=RED, linewidth=1.2)
            plot.grid(alpha=0.3)
            lowest, highest = (extreme(mean for _, mean in means) for extreme in (min, max))
            print(f"{shown(name)}, {shown(key)}: means of {len(means)} slices from {lowest:.6g} to {highest:.6g}")
    for plot, key in zip(plots[-1], keys):
        plot.set_xlabel(label(key), fontsize=9)
    figure.suptitle(f"{table.name}: {len(table.rows)} runs; line: mean in slices of the axis", fontsize=11)
    return figure


def main(argv=None):
    parser = Parser("plot_sweep", __doc__, "scatter wheel_angles.csv wheel_angles.png x y --color psi",
                    "rank payload.csv payload.png y psi largest_slip")
    kinds = parser.add_subparsers(prog="plot_sweep", metavar="KIND", required=True,
                                  parser_class=lambda prog: Parser(prog, __doc__))
    for draw in (scatter, histogram, rank, effects):
        kind = kinds.add_parser(draw.__name__)
        kind.set_defaults(draw=draw)
        kind.add_argument("table")
        kind.add_argument("plot")
        kind.add_argument("columns", nargs=2 if draw is scatter else "+", metavar="COLUMN")
        if draw is scatter:
            kind.add_argument("--color", metavar="COLUMN")
    arguments = parser.parse_args(argv)
    Outputs([arguments.table]).claim("PLOT", arguments.plot)
    figure = arguments.draw(Table(arguments.table), arguments)
    figure.tight_layout()
    save(figure, arguments.plot, dpi=80)
