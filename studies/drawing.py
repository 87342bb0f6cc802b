"""What the figures of the studies have in common: their style, panels and paths."""
import matplotlib
import numpy as np

from youbot_base_sim.figures import new_figure

matplotlib.rcParams.update({"path.simplify_threshold": 0.3, "font.size": 9, "axes.grid": True, "grid.alpha": 0.3,
                            "axes.titlesize": 9, "legend.fontsize": 8, "lines.linewidth": 1.1})


def panels(rows, columns, title, height=2.5):
    figure = new_figure(figsize=(8, height * rows + 0.7))
    figure.suptitle(title, fontsize=10)
    return figure, figure.subplots(rows, columns, squeeze=False).flatten()


def finished(figure, handles, labels):
    """The figure, with its legend, if there is one, below all axes."""
    if handles:
        figure.legend(handles, labels, loc="lower center", ncol=len(labels), frameon=False)
    figure.tight_layout(rect=(0, 0.3 / figure.get_figheight() if handles else 0, 1, 1))
    return figure


def letter(axes, titles):
    for name, axis, title in zip("abcdef", axes, titles):
        axis.set_title(f"({name}) {title}")


def path(axis, truth, **style):
    """The path of O, with a dot at its end."""
    axis.plot(truth["x"], truth["y"], **style)
    axis.plot(truth["x"][-1], truth["y"][-1], "o", markersize=4, color=style["color"], alpha=style.get("alpha", 1))


def finish_paths(axis, truth):
    """Marks the start, and by an arrow the direction of `truth`."""
    axis.plot(truth["x"][0], truth["y"][0], "ks", markersize=5, fillstyle="none")
    x, y, count = truth["x"], truth["y"], len(truth["x"])
    first, then = count // 8, count // 8 + max(1, count // 100)
    if np.hypot(x[then] - x[first], y[then] - y[first]) > 0:
        arrow = axis.annotate("", (x[then], y[then]), (x[first], y[first]),
                              arrowprops=dict(arrowstyle="-|>", color="black", mutation_scale=14))
        arrow.set_in_layout(False)  # it may lie outside of enlarged axes, which Matplotlib 3.3 would make room for
    axis.set(xlabel="$x_O$, m", ylabel="$y_O$, m")
    axis.set_aspect("equal", "datalim")
