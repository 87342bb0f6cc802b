"""A figure for each effect, of the recordings by label: panels, each a function that draws them into its axis."""
import numpy as np
from matplotlib.patches import Polygon, Rectangle

from youbot_base_sim.base import Base
from youbot_base_sim.figures import BLACK, BLUE, RED, WHEEL_COLOURS, WHEEL_NAMES, curve
from .drawing import finish_paths, finished, letter, panels, path
from .effects import at
from .runs import DEGREES

WITHOUT = dict(color=BLACK, linestyle="--", zorder=3)


def drawn(runs):
    """Recordings with their styles: of two, the second is without the effect; of three, the first."""
    styles = [dict(color=RED), WITHOUT] if len(runs) == 2 else [WITHOUT, dict(color=BLUE), dict(color=RED)]
    return [(label, run, style) for (label, run), style in zip(runs.items(), styles)]


def over_time(values, ylabel, until=None):
    def draw(axis, runs):
        for label, run, style in drawn(runs):
            curve(axis, run.truth["t"], values(run.truth), label=label, **style)
        axis.set(xlabel="t, s", ylabel=ylabel, xlim=(0, until or run.truth["t"][-1]))
    return draw


def paths(axis, runs):
    for _, run, style in drawn(runs):
        path(axis, run.truth, **style)
    finish_paths(axis, next(iter(runs.values())).truth)


def reactions(label, is_smooth=True, **style):
    """The normal reactions, smoothed over a twentieth of a second: rollers that switch make them jump."""
    def draw(axis, runs):
        t, normal = runs[label].contacts["t"], runs[label].contacts["normal"]
        count = max(1, int(0.05 / (t[1] - t[0]))) if is_smooth else 1
        for colour, name, N in zip(WHEEL_COLOURS.values(), WHEEL_NAMES, normal.T):
            smooth = np.convolve(N, np.full(count, 1 / count), mode="valid")
            curve(axis, t[count // 2:][:len(smooth)], smooth, color=colour, label=name, **style)
        axis.set(xlabel="t, s", ylabel="$N_i$, N", xlim=(t[0], t[-1]), ylim=(0, None))
        axis.legend(ncol=2, loc="best", frameon=False, handlelength=1, columnspacing=1)
    return draw


def patch(axis, runs):
    """Paths over the wet patch, with the rectangle of the wheels at some instants."""
    paths(axis, runs)
    axis.add_patch(Rectangle((0.1, 0.4), 0.5, 0.5, color=BLUE, alpha=0.25, linewidth=0))
    corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * (Base.half_wheelbase, Base.half_track)
    for _, run, style in drawn(runs):
        for place in (at(run, t) for t in ((0, 1.6, 2.3, 3) if style is not WITHOUT else (3,))):
            c, s = np.cos(place["psi"]), np.sin(place["psi"])
            axis.add_patch(Polygon(corners @ [[c, s], [-s, c]] + (place["x"], place["y"]), fill=False,
                                   color=style["color"], linewidth=0.8, alpha=0.7))
    axis.autoscale()


def braking(label, tips=False):
    def draw(axis, runs):
        reactions(label, is_smooth=False, linewidth=0.9)(axis, runs)
        axis.axvline(0.5, color="0.5", linewidth=0.8, linestyle=":")
        axis.set(xlim=(0.48, 0.56), ylim=(0, 420))
        if tips:
            end = runs[label].contacts["t"][-1]
            axis.axvspan(end, 0.56, color="0.93", zorder=0)
            axis.text(end + 0.002, 240, "tips over its left wheels:\nthe run ends here", va="top", fontsize=8)
    return draw


def slip_shares(axis, runs):
    for _, run, style in drawn(runs):
        slip = np.sort(run.contacts["slip"].ravel()) * 1e3
        curve(axis, slip, 100 * np.arange(1, len(slip) + 1) / len(slip), **style)
    axis.set(xscale="log", xlim=(0.1, 300), ylim=(0, 100), xlabel="slip speed, mm/s",
             ylabel="share of time below it, %")


LATERAL_VELOCITY = lambda truth: truth["V_Y"], "$V_Y$, m/s"
HEADING = over_time(lambda truth: truth["psi"] * DEGREES, "$\\psi$, degrees")
FIGURES = {  # height, inches; grey stretch of time, s; panels by their titles
    "slope": (2.5, (0, 1.5), {"position (grey: motors on)": over_time(lambda truth: truth["x"], "x, m"),
                              "normal reactions on the slope": reactions("5° uphill")}),
    "patch": (3.4, None, {"path of O; the base at 0, 1.6, 2.3 and 3 s; blue: f = 0.03": patch, "heading": HEADING}),
    "load": (2.5, None, {"lateral velocity": over_time(*LATERAL_VELOCITY), "heading": HEADING,
                         "normal reactions": reactions("with the load")}),
    "push": (2.5, (0.2, 0.6), {"lateral position (grey: the push)": over_time(lambda truth: 1e3 * truth["y"], "y, mm"),
                               "heading": HEADING}),
    "braking": (2.5, None, {f"reactions, {label} (dotted: braking starts)": braking(label, tips)
                            for label, tips in (("25 kg at 0.8 m", True), ("25 kg at 0.3 m", False))}),
    "preload": (2.5, None, {"distance from the line": over_time(lambda truth: 1e3 * truth["x"], "x, mm"),
                            "heading": HEADING}),
    "spin": (2.5, None, {"lateral velocity": over_time(*LATERAL_VELOCITY, 2),
                         "slip of the four contacts": slip_shares}),
    "dry": (3.2, None, {"lateral velocity": over_time(*LATERAL_VELOCITY, 5),
                        "trajectory of O (square: start; dots: after 30 s)": paths})}


def draw(name, runs, title):
    """The figure of an effect; the legend of its curves over time stands below all panels."""
    height, grey, contents = FIGURES[name]
    figure, axes = panels(1, len(contents), title, height)
    for axis, content in zip(axes, contents.values()):
        content(axis, runs)
        if grey:
            axis.axvspan(*grey, color="0.93", zorder=0)
    letter(axes, contents)
    legends = [axis.get_legend_handles_labels() for axis in axes if not axis.get_legend()]
    return finished(figure, *max(legends, key=lambda legend: len(legend[0]), default=((), ())))
