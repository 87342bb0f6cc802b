"""Draws the benchmark's table: a diagram for each scene, of the largest position error against the run time for each
simulated second, with a curve for each solver."""
import math

from matplotlib.ticker import LogLocator, NullFormatter

from youbot_base_sim.figures import GREY, new_figure, save
from .work_precision_runs import CONTESTANTS

STYLES = {one.key: one.style for one in CONTESTANTS}
EXPLICIT = [one.key for one in CONTESTANTS if one.explicit]
FLOOR = 1e-10  # m; errors below are those of the reference


def curves_of(rows):
    """Returns {scene: {contestant: [(error, run time per simulated s), ...]}} and titles, in the table's order."""
    scenes, titles = {}, {}
    for row in rows:
        titles.update({row["scene"]: row["scene_title"], row["contestant"]: row["contestant_title"]})
        points = scenes.setdefault(row["scene"], {}).setdefault(row["contestant"], [])
        if not row["failure"]:
            points.append((max(row["position_error_m"], FLOOR), row["run_time_per_simulated_s"]))
    return scenes, titles


def draw_scene(axes, curves):
    """Draws one scene; returns the drawn lines by contestant."""
    lines = {}
    for contestant, points in ((contestant, points) for contestant, points in curves.items() if points):
        style = dict(linewidth=1.3, markersize=4.5) | STYLES.get(contestant, {})
        if contestant in EXPLICIT:  # the same whatever the error, which is of a shorter span
            lines[contestant] = axes.axhline(min(time for _, time in points), **(style | dict(marker=None)))
        else:
            lines[contestant], = axes.plot(*zip(*points), **style)
    axes.axhline(1, color="#bbbbbb", linewidth=0.8, zorder=0)
    axes.set(xscale="log", yscale="log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=20))
        axis.set_minor_locator(LogLocator(subs=(2, 5), numticks=60))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    return lines


def draw(scenes, titles):
    columns = min(3, len(scenes))
    rows = math.ceil(len(scenes) / columns)
    legend_height = 0.25 * math.ceil(len(STYLES) / columns) + 0.2  # inches
    figure = new_figure(figsize=(4.2 * columns + 0.4, 3.6 * rows + legend_height))
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    lines = {}
    for axes, (scene, curves) in zip(grid.flat, scenes.items()):
        lines = draw_scene(axes, curves) | lines
        axes.set_title(titles[scene], fontsize=11)
        axes.tick_params(labelsize=9, labelbottom=True)
    for axes in grid.flat[len(scenes):]:
        axes.set_visible(False)
    first = grid[0][0]
    first.invert_xaxis()  # shared
    first.text(0.02, 1, "real time", transform=first.get_yaxis_transform(), fontsize=8, color=GREY, va="bottom")
    for axes in grid[:, 0]:
        axes.set_ylabel("run time for each simulated second, s", fontsize=9)
    for column in grid.T:
        [axes for axes in column if axes.get_visible()][-1].set_xlabel("largest position error, m (more exact to the right)", fontsize=9)
    labels = [titles[one] + (" (explicit; over a short span)" if one in EXPLICIT else "") for one in lines]
    figure.tight_layout(rect=(0, legend_height / figure.get_figheight(), 1, 1))
    figure.legend(lines.values(), labels, loc="lower center", ncol=columns, fontsize=9.5, frameon=False)
    return figure


def plot(rows, path):
    """Draws the table."""
    save(draw(*curves_of(rows)), path, dpi=140)
