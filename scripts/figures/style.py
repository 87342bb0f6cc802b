"""What the figures of this project have in common, with matplotlib."""

import io

import matplotlib
import numpy as np
from PIL import Image

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402: the backend comes first

matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "paper_figures", "path.simplify_threshold": 0.3,
                            "font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "axes.titlesize": 9,
                            "legend.fontsize": 8, "lines.linewidth": 1.1})

# Okabe and Ito's colours, told apart by the colour-blind.
BLACK, BLUE, ORANGE, GREEN, PINK, SKY = "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9"
WHEEL_COLOURS = (BLUE, ORANGE, GREEN, PINK)
BINS = 1200  # a curve's highest and lowest point in each are drawn: more could not be told apart


def thinned(t, y):
    """What is seen of a curve with many points: the extremes in each of BINS stretches, in order."""
    if len(t) <= 4 * BINS:
        return t, y
    chosen = {0, len(t) - 1}
    for stretch in np.array_split(np.arange(len(t)), BINS):
        part = y[stretch]
        chosen |= {stretch[part.argmin()], stretch[part.argmax()]}
    index = sorted(chosen)
    return t[index], y[index]


def panels(rows, columns, title, height=2.5):
    figure, axes = plt.subplots(rows, columns, figsize=(8, height * rows + 0.7), squeeze=False)
    figure.suptitle(title, fontsize=10)
    return figure, axes.flatten()


def finished(figure, handles, labels):
    """The figure, with its legend below all axes."""
    figure.legend(handles, labels, loc="lower center", ncol=len(labels), frameon=False)
    figure.tight_layout(rect=(0, 0.3 / figure.get_figheight(), 1, 1))
    return figure


def letter(axes, titles):
    for name, axis, title in zip("abcdef", axes, titles):
        axis.set_title(f"({name}) {title}")


def wheel_style(i, name):
    """Of the wheels' torques in one diagram, where the front ones may lie beneath the rear ones."""
    return dict(color=WHEEL_COLOURS[i], label=name, linestyle="-" if i < 2 else "--", linewidth=2.4 if i < 2 else 1.2)


def path(axis, truth, **style):
    """The way of O, with a dot where it ends."""
    axis.plot(truth["x"], truth["y"], **style)
    axis.plot(truth["x"][-1], truth["y"][-1], "o", markersize=4, color=style["color"], alpha=style.get("alpha", 1))


def finish_paths(axis, truth):
    """Marks the start, and by an arrow which way `truth` goes."""
    axis.plot(truth["x"][0], truth["y"][0], "ks", markersize=5, fillstyle="none")
    x, y, count = truth["x"], truth["y"], len(truth["x"])
    first, then = count // 8, count // 8 + max(1, count // 100)
    if np.hypot(x[then] - x[first], y[then] - y[first]) > 0:
        axis.annotate("", (x[then], y[then]), (x[first], y[first]),
                      arrowprops=dict(arrowstyle="-|>", color="black", mutation_scale=14))
    axis.set(xlabel="$x_O$, m", ylabel="$y_O$, m")
    axis.set_aspect("equal", "datalim")


def save(figure, name):
    """Writes NAME.png, in 256 colours, which makes it half as large, and NAME.svg."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=110)
    Image.open(picture).convert("RGB").quantize(256).save(f"{name}.png", optimize=True)
    figure.savefig(f"{name}.svg", metadata={"Date": None})
    plt.close(figure)
