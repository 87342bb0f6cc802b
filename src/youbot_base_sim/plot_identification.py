"""Plots a table written by `identify --csv`: angular velocities and torques, recorded and fitted, and their difference.

Grey stretches were held out from the fit. Needs python3-matplotlib.
"""
import numpy as np

from .command_line import Parser
from .figures import BLUE, RED, SKY, new_figure, save
from .files import Outputs
from .report import read_columns

MODES = {"ahead": "forward", "sideways": "lateral", "turning": "yaw"}  # in the columns' names, and in words
SERIES = {"rate": ("angular velocity", "rad/s"), "torque": ("torque", "N m")}


def shade_held_out(axis, t, held_out):
    bounds = np.flatnonzero(np.diff(held_out != 0, prepend=False, append=False))
    for begin, end in zip(bounds[::2], bounds[1::2]):
        axis.axvspan(t[begin], t[min(end, len(t) - 1)], color="0.9", linewidth=0, label="held out from the fit")


def draw(columns, series, mode, above, below):
    """Record and fit into the axis above, their difference into the one below."""
    t, recorded, fitted = columns["t"], columns[f"{series}_{mode}"], columns[f"fitted_{series}_{mode}"]
    above.plot(t, recorded, color=SKY, linewidth=4, label="recorded")
    above.plot(t, fitted, color=RED, linewidth=0.9, label="fitted")
    quantity, unit = SERIES[series]
    above.set_title(f"{MODES[mode]}: {quantity}", fontsize=10, loc="left")
    above.set_ylabel(unit)
    below.plot(t, recorded - fitted, color=BLUE, linewidth=0.8)
    below.set_ylabel(unit, fontsize=8)
    for axis in (above, below):
        shade_held_out(axis, t, columns["held_out"])
        axis.margins(x=0)
        axis.grid(alpha=0.3)


def main(argv=None):
    parser = Parser("plot_identification", __doc__, "fit.csv fit.png", "fit.csv fit.pdf")
    parser.add_argument("table", metavar="FILE.csv")
    parser.add_argument("plot", metavar="PLOT.png")
    arguments = parser.parse_args(argv)
    Outputs([arguments.table]).claim("PLOT", arguments.plot)
    columns = read_columns("", arguments.table, (
        "t", "held_out", *(f"{fitted}{series}_{mode}" for fitted in ("", "fitted_") for series in SERIES
                           for mode in MODES)), "a file by `identify --csv`")
    figure = new_figure(figsize=(11, 9))
    axes = figure.subplots(2 * len(MODES), len(SERIES), sharex=True, gridspec_kw={"height_ratios": [3, 1] * len(MODES)})
    for row, mode in enumerate(MODES):
        for column, series in enumerate(SERIES):
            draw(columns, series, mode, axes[2 * row][column], axes[2 * row + 1][column])
    handles, names = axes[0][0].get_legend_handles_labels()
    figure.legend(handles[:3], names[:3], loc="lower center", ncol=3, frameon=False)
    figure.suptitle("angular velocities and torques of the wheels, recorded and fitted, with differences")
    for axis in axes[-1]:
        axis.set_xlabel("t, s")
    figure.align_ylabels()
    figure.tight_layout(rect=(0, 0.02, 1, 1))
    save(figure, arguments.plot, dpi=72)
