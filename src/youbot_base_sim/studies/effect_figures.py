"""A figure for each effect, of the recordings by label. Each function returns a figure of matplotlib."""

import numpy as np
from matplotlib.patches import Polygon, Rectangle

from ..base import WHEELS, Base
from ..figures import curve
from ..palette import BLACK, BLUE, RED, WHEEL_COLOURS
from ..runs import DEGREES
from .drawing import finish_paths, finished, letter, panels, path
from .effects import at

WITHOUT = dict(color=BLACK, linestyle="--", zorder=3)


def drawn(runs):
    """Recordings with their styles: of two, the second is without the effect; of three, the first."""
    styles = [dict(color=RED), WITHOUT] if len(runs) == 2 else [WITHOUT, dict(color=BLUE), dict(color=RED)]
    return [(label, run, style) for (label, run), style in zip(runs.items(), styles)]


def over_time(axis, runs, values, ylabel, until=None):
    for label, run, style in drawn(runs):
        curve(axis, run.truth["t"], values(run.truth), label=label, **style)
    axis.set(xlabel="t, s", ylabel=ylabel, xlim=(0, until or run.truth["t"][-1]))


def paths(axis, runs):
    for _, run, style in drawn(runs):
        path(axis, run.truth, **style)
    finish_paths(axis, next(iter(runs.values())).truth)


def heading(truth):
    return truth["psi"] * DEGREES


def of_wheels(axis, run, **style):
    """The normal reactions, smoothed over a twentieth of a second: rollers that switch make them jump."""
    t = run.contacts["t"]
    count = max(1, int(0.05 / (t[1] - t[0]))) if style.pop("smooth", True) else 1
    for i, wheel in enumerate(WHEELS):
        N = run.contacts["normal"][:, i]
        padded = np.pad(N, count // 2, mode="edge")[:len(N) + count - 1]
        smooth = np.convolve(padded, np.full(count, 1 / count), mode="valid")[:len(N)]
        curve(axis, t[:len(smooth)], smooth, color=WHEEL_COLOURS[wheel], label=wheel, **style)
    axis.set(xlabel="t, s", ylabel="N, N", xlim=(t[0], t[-1]), ylim=(0, None))
    axis.legend(ncol=4, loc="lower center", frameon=False, handlelength=1, columnspacing=1)


def together(figure, axis):
    """With the legend of one axis below all."""
    return finished(figure, *axis.get_legend_handles_labels())


def slope(runs, title):
    figure, axes = panels(1, 2, title)
    over_time(axes[0], runs, lambda truth: truth["x"], "x, m")
    of_wheels(axes[1], runs["5° uphill"])
    for axis in axes:
        axis.axvspan(0, 1.5, color="0.93", zorder=0)
    letter(axes, ("way (grey: the drives push)", "normal reactions on the slope"))
    return together(figure, axes[0])


def base(axis, place, **style):
    """The rectangle of the wheels."""
    corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * (Base.half_wheelbase, Base.half_track)
    turn = np.array([[np.cos(place["psi"]), -np.sin(place["psi"])], [np.sin(place["psi"]), np.cos(place["psi"])]])
    axis.add_patch(Polygon(corners @ turn.T + (place["x"], place["y"]), fill=False, **style))


def patch(runs, title):
    figure, axes = panels(1, 2, title, 3.4)
    paths(axes[0], runs)
    axes[0].add_patch(Rectangle((0.1, 0.4), 0.5, 0.5, color=BLUE, alpha=0.25, linewidth=0))
    for _, run, style in drawn(runs):
        for t in (0, 1.6, 2.3, 3) if style is not WITHOUT else (3,):
            base(axes[0], at(run, t), color=style["color"], linewidth=0.8, alpha=0.7)
    axes[0].autoscale()
    over_time(axes[1], runs, heading, "$\\psi$, degrees")
    letter(axes, ("way of O; the base at 0, 1.6, 2.3 and 3 s; blue: f = 0.03", "heading"))
    return together(figure, axes[1])


def load(runs, title):
    figure, axes = panels(1, 3, title)
    over_time(axes[0], runs, lambda truth: truth["V_Y"], "$V_Y$, m/s")
    over_time(axes[1], runs, heading, "$\\psi$, degrees")
    of_wheels(axes[2], runs["with the load"])
    letter(axes, ("velocity to the left", "heading", "normal reactions"))
    return together(figure, axes[0])


def push(runs, title):
    figure, axes = panels(1, 2, title)
    over_time(axes[0], runs, lambda truth: 1e3 * truth["y"], "y, mm")
    over_time(axes[1], runs, heading, "$\\psi$, degrees")
    for axis in axes:
        axis.axvspan(0.2, 0.6, color="0.93", zorder=0)
    letter(axes, ("way to the left (grey: the push)", "heading"))
    return together(figure, axes[0])


def braking(runs, title):
    figure, axes = panels(1, 2, title)
    for axis, run in zip(axes, runs.values()):
        of_wheels(axis, run, smooth=False, linewidth=0.9)
        axis.axvline(0.5, color="0.5", linewidth=0.8, linestyle=":")
        axis.set(xlim=(0.48, 0.56), ylim=(-35, 320))
    tips = runs["25 kg at 0.8 m"].contacts["t"][-1]
    axes[0].axvspan(tips, 0.56, color="0.93", zorder=0)
    axes[0].text(tips + 0.002, 290, "tips over its left wheels:\nthe run ends here", va="top", fontsize=8)
    letter(axes, [f"normal reactions, {label} (dotted: brakes)" for label in runs])
    figure.tight_layout()
    return figure


def preload(runs, title):
    figure, axes = panels(1, 2, title)
    over_time(axes[0], runs, lambda truth: 1e3 * truth["x"], "x, mm")
    over_time(axes[1], runs, heading, "$\\psi$, degrees")
    letter(axes, ("off the line sideways", "heading"))
    return together(figure, axes[0])


def spin(runs, title):
    figure, axes = panels(1, 2, title)
    over_time(axes[0], runs, lambda truth: truth["V_Y"], "$V_Y$, m/s", until=2)
    for label, run, style in drawn(runs):
        slip = np.sort(run.contacts["slip"].ravel()) * 1e3
        curve(axes[1], slip, 100 * np.arange(1, len(slip) + 1) / len(slip), **style)
    axes[1].set(xscale="log", xlim=(0.1, 300), ylim=(0, 100), xlabel="slip speed, mm/s", ylabel="of the time below it, %")
    letter(axes, ("velocity to the left", "slip of the four contacts"))
    return together(figure, axes[0])


def dry(runs, title):
    figure, axes = panels(1, 2, title, 3.2)
    over_time(axes[0], runs, lambda truth: truth["V_Y"], "$V_Y$, m/s", until=5)
    paths(axes[1], runs)
    letter(axes, ("velocity to the left", "trajectory of O (square: start; dots: after 30 s)"))
    return together(figure, axes[0])
