"""Draws a table written by `sweep`, and prints what it draws.

Usage: plot_sweep scatter TABLE.csv PLOT.png X Y [--color COLUMN]
       plot_sweep histogram TABLE.csv PLOT.png COLUMN...
       plot_sweep rank TABLE.csv PLOT.png QUANTITY... [--by sobol|correlation]

scatter: a point for each run. histogram: the distribution of each column. rank: which axes matter for a quantity, by
Sobol' index, the share of its variance that vanishes if the axis is fixed (estimated from the table, however it was
sampled, as the variance between slices of the axis), or by Spearman's rank correlation. Runs without a value are left
out. Needs python3-numpy and python3-matplotlib.
"""
import numpy as np

from .command_line import Parser, Refused, shown
from .figures import BLUE, RED, new_figure, save
from .files import Outputs
from .report import read_csv

MAX_SLICES = 100
LARGEST = 1e150  # whose square is a number


class Table:
    """Columns of a table by their names; cells without a number are NaN."""

    def __init__(self, path):
        self.path = shown(path)
        self.names, *self.rows = read_csv("", path, "a table by sweep")
        if self.names[0] != "run" or "status" not in self.names:
            raise Refused(f"{self.path}: no columns run and status; must be a table by sweep")
        self.axes = self.names[1:self.names.index("status")]

    def texts(self, name):
        if name not in self.names:
            raise Refused(f"{self.path}: column = {shown(name)}: must be one of {', '.join(self.names[:-1])}")
        index = self.names.index(name)
        return [row[index] for row in self.rows]

    def column(self, name):
        return np.array([number(text) for text in self.texts(name)])

    def numbers(self, name):
        values = self.column(name)
        known = values[np.isfinite(values)]
        if not len(known) or np.abs(known).max() > LARGEST:
            raise Refused(f"{self.path}: column = {shown(name)}: must have numbers, up to {LARGEST:g}")
        return values

    def axis(self, name):
        """An axis as numbers: those of texts are their places among all of them in order."""
        values = self.column(name)
        if np.isfinite(values).all():
            return values
        texts = self.texts(name)
        order = sorted(set(texts))
        return np.array([float(order.index(text)) for text in texts])


def number(text):
    try:
        return float(text)
    except ValueError:
        return np.nan


def slices(x):
    """The runs in slices of an axis, about as many as each has runs: one for each of a few values, else of equal
    size."""
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


def ranks(x):
    """Places in order, from 0; equal values share the mean of theirs."""
    values, inverse, counts = np.unique(x, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts + 1) / 2)[inverse]


def correlation(x, y):
    """Spearman's."""
    a, b = ranks(x), ranks(y)
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])


def scatter(table, arguments):
    x, y = table.numbers(arguments.x), table.numbers(arguments.y)
    both = np.isfinite(x) & np.isfinite(y)
    if not both.any():
        raise Refused(f"{table.path}: columns {shown(arguments.x)} and {shown(arguments.y)}: must both have a number "
                      "in some run")
    figure = new_figure(figsize=(6.4, 5))
    axis = figure.subplots()
    size = np.clip(2000 / len(x), 1.5, 25)
    if arguments.color:
        points = axis.scatter(x, y, s=size, c=table.numbers(arguments.color), cmap="viridis", linewidths=0)
        figure.colorbar(points, label=arguments.color)
    else:
        axis.scatter(x, y, s=size, color=BLUE, alpha=float(np.clip(500 / len(x), 0.15, 1)), linewidths=0)
    axis.set(xlabel=arguments.x, ylabel=arguments.y)
    axis.grid(alpha=0.3)
    print(f"{both.sum()} of {len(x)} runs; rank correlation {correlation(x[both], y[both]):.3f}")
    return figure


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
        axis.set_xlabel(name)
        deviation = values.std(ddof=1) if len(values) > 1 else 0
        print(f"{name}: {len(values)} runs, mean {values.mean():.6g}, standard deviation {deviation:.3g}, least "
              f"{values.min():.6g}, 5 % {low:.6g}, median {median:.6g}, 95 % {high:.6g}, largest {values.max():.6g}")
    axes[0].set_ylabel("runs")
    return figure


def rank(table, arguments):
    names, is_sobol = arguments.columns, arguments.by == "sobol"
    if not table.axes:
        raise Refused(f"{table.path}: no axes; must have a column between run and status")
    figure = new_figure(figsize=(max(6.4, 3.6 * len(names)), 1.4 + 0.4 * len(table.axes)))
    axes = figure.subplots(1, len(names), squeeze=False, sharey=True)[0]
    places = np.arange(len(table.axes))
    for axis, name in zip(axes, names):
        y = table.numbers(name)
        known = np.isfinite(y)
        shares = [(sobol if is_sobol else correlation)(table.axis(key)[known], y[known]) for key in table.axes]
        axis.barh(places, shares, color=[BLUE if share >= 0 else RED for share in shares])
        axis.axvline(0, color="0.3", linewidth=0.8)
        axis.set_xlim(-1.05 if min(shares) < 0 else 0, 1.05)
        axis.set_title(name, fontsize=10, loc="left")
        axis.set_xlabel("Sobol' index" if is_sobol else "rank correlation")
        axis.grid(alpha=0.3, axis="x")
        print(f"{name}, {known.sum()} runs:")
        for share, key in sorted(zip(shares, table.axes), key=lambda pair: -abs(pair[0])):
            print(f"  {key:34}{share:6.3f}")
        if is_sobol:
            print(f"  {'(interaction of axes)':34}{max(0.0, 1 - sum(shares)):6.3f}")
    axes[0].set_yticks(places)
    axes[0].set_yticklabels(table.axes)
    axes[0].invert_yaxis()
    return figure


def parse_arguments(argv):
    parser = Parser("plot_sweep", __doc__, "scatter wheel_angles.csv wheel_angles.png x y --color psi",
                    "rank payload.csv payload.png y psi largest_slip")
    kinds = parser.add_subparsers(prog="plot_sweep", metavar="KIND", required=True,
                                  parser_class=lambda prog: Parser(prog, __doc__))
    for draw in (scatter, histogram, rank):
        kind = kinds.add_parser(draw.__name__)
        kind.set_defaults(draw=draw)
        kind.add_argument("table")
        kind.add_argument("plot")
        if draw is scatter:
            kind.add_argument("x")
            kind.add_argument("y")
            kind.add_argument("--color", metavar="COLUMN")
        else:
            kind.add_argument("columns", nargs="+", metavar="COLUMN")
        if draw is rank:
            kind.add_argument("--by", choices=("sobol", "correlation"), default="sobol")
    return parser.parse_args(argv)


def main(argv=None):
    arguments = parse_arguments(argv)
    Outputs([arguments.table]).claim("PLOT", arguments.plot)
    figure = arguments.draw(Table(arguments.table), arguments)
    figure.tight_layout()
    save(figure, arguments.plot, dpi=80)
