"""The paper's figures, drawn from a Study. Each function returns a figure of matplotlib."""

import io

import matplotlib
import numpy as np
from PIL import Image

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402: the backend comes first
from matplotlib.lines import Line2D  # noqa: E402

from recording import DEGREES, MODELS, WHEELS  # noqa: E402

matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "paper_figures", "path.simplify_threshold": 0.3,
                            "font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "axes.titlesize": 9,
                            "legend.fontsize": 8, "lines.linewidth": 1.1})

# Okabe and Ito's colours, told apart by the colour-blind.
STYLES = {"no_slip": dict(color="#000000", linestyle="--", zorder=3), "viscous": dict(color="#0072B2"),
          "coulomb": dict(color="#D55E00", linewidth=0.9)}
NAMES = {"no_slip": "1, no slip", "viscous": "2a, viscous friction", "coulomb": "2b, Coulomb friction"}
WHEEL_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
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


def with_models(figure, models=MODELS):
    return finished(figure, [Line2D([], [], **STYLES[model]) for model in models], [NAMES[model] for model in models])


def letter(axes, titles):
    for name, axis, title in zip("abcdef", axes, titles):
        axis.set_title(f"({name}) {title}")


def wheel_style(i, name):
    """Of the wheels' torques in one diagram, where the front ones may lie beneath the rear ones."""
    return dict(color=WHEEL_COLOURS[i], label=name, linestyle="-" if i < 2 else "--", linewidth=2.4 if i < 2 else 1.2)


def torques(study, title):
    """Fig. 4: the wheels' torques over time; of each model, where they differ."""
    runs = {model: run.wheels for model, run in study.whole.items()}
    same = all(np.allclose(run["torque"], runs["coulomb"]["torque"], atol=1e-6) for run in runs.values())
    names = [f"$M_{i + 1}$ ({wheel})" for i, wheel in enumerate(WHEELS)]
    figure, axes = panels(*((1, 1) if same else (2, 2)), title)
    for i, name in enumerate(names):
        axis = axes[0 if same else i]
        for model in ["coulomb"] if same else MODELS:
            axis.plot(*thinned(runs[model]["t"], runs[model]["torque"][:, i]),
                      **(wheel_style(i, name) if same else STYLES[model]))
        axis.set(xlabel="t, s", ylabel="M, N m" if same else name + ", N m", xlim=(0, study.scene.duration))
    return finished(figure, *axes[0].get_legend_handles_labels()) if same else with_models(figure)


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


def motion(study, title):
    """Figs. 5 and 8: trajectory of O and heading."""
    figure, axes = panels(1, 2, title, 3.7)
    for model in MODELS:
        truth = study.whole[model].truth
        style = dict(STYLES[model], **(dict(linewidth=2) if model == "viscous" else {}))  # often beneath 2b
        path(axes[0], truth, **style)
        axes[1].plot(*thinned(truth["t"], truth["psi"] * DEGREES), **style)
    finish_paths(axes[0], study.whole["no_slip"].truth)
    axes[1].set(xlabel="t, s", ylabel="$\\psi$, degrees", xlim=(0, study.scene.duration))
    letter(axes, ("trajectory of O (square: start; dots: ends)", "heading"))
    return with_models(figure)


def draw_velocities(runs, until, title):
    figure, axes = panels(2, 2, title)
    for model in MODELS:
        truth, wheels = runs[model].truth, runs[model].wheels
        shown = truth["t"] <= until * (1 + 1e-9)
        for axis, values in zip(axes, (truth["V_X"], truth["V_Y"], truth["Omega"], wheels["dphi"][:, 0])):
            axis.plot(*thinned(truth["t"][shown], values[shown]), **dict(STYLES[model], linewidth=0.8))
    for axis, name in zip(axes, ("$V_X$, m/s", "$V_Y$, m/s", "$\\Omega$, rad/s", "$\\dot\\varphi_1$, rad/s")):
        axis.set(xlabel="t, s", ylabel=name, xlim=(0, until))
    letter(axes, ("velocity ahead", "velocity to the left", "yaw rate", "rate of the first wheel (fl)"))
    return with_models(figure)


def velocities(study, title):
    """Fig. 6: velocities of the platform and rate of the first wheel over the first half of the motion."""
    return draw_velocities(study.whole, study.scene.duration / 2, title)


def beginning(study, title):
    """Fig. 9: the same in the beginning, where each vibration can be seen."""
    runs = study.beginning
    return draw_velocities(runs, runs["coulomb"].truth["t"][-1], title)


def spread(study, title):
    """Fig. 7: motion of model 2b from several initial wheel angles."""
    figure, axes = panels(1, 2, title, 3.7)
    runs = study.spread(study.half_pitch_angles())
    colours = ["black", *plt.get_cmap("viridis")(np.linspace(0, 0.9, len(runs) - 1))]
    for run, colour in zip(runs, colours):
        style = dict(color=colour, linewidth=1.6 if run is runs[0] else 0.7)
        path(axes[0], run.truth, **style)
        axes[1].plot(run.truth["t"], run.truth["psi"] * DEGREES, **style)
    finish_paths(axes[0], runs[0].truth)
    axes[1].set(xlabel="t, s", ylabel="$\\psi$, degrees", xlim=(0, study.scene.duration))
    pitch = study.scene.roller_pitch * DEGREES
    letter(axes, ("trajectories of O, model 2b (black: angles of the scene)",
                  f"heading (each wheel as in the scene or {pitch / 2:.3g}° further)"))
    figure.tight_layout()
    return figure


def contact(study, title):
    """Fig. 10: friction force and slip speed at P_1, with the switches of the first wheel marked."""
    figure, axes = panels(3, 1, title, 2)
    for model, run in study.contact.items():
        contacts = run.contacts
        t, force, slip = contacts["t"], contacts["force"][:, 0], contacts["slip"][:, 0]
        own = axes[1 if model == "viscous" else 2]
        axes[0].plot(*thinned(t, force), **STYLES[model])
        own.plot(*thinned(t, slip), **STYLES[model])
        settled = t > 0.01 * t[-1]
        own.set_ylim(0, 1.1 * slip[settled].max() or None)
        for time in run.switches[0][0]:
            own.axvline(time, color="0.4", linewidth=0.7, linestyle=":")
            axes[0].axvline(time, color=STYLES[model]["color"], linewidth=0.7, linestyle=":")
    highest = max(run.contacts["force"][run.contacts["t"] > 0.01 * run.contacts["t"][-1], 0].max()
                  for run in study.contact.values())
    axes[0].set_ylim(0, 1.1 * highest or None)
    for axis, name in zip(axes, ("$|F_1|$, N", "$|v_{P_1}|$, m/s", "$|v_{P_1}|$, m/s")):
        axis.set(xlabel="t, s", ylabel=name, xlim=(0, t[-1]))
    letter(axes, ("friction force at the first wheel (fl); dotted: its roller switches", "slip speed, model 2a",
                  "slip speed, model 2b"))
    return with_models(figure, ("viscous", "coulomb"))


def save(figure, name):
    """Writes NAME.png, in 256 colours, which makes it half as large, and NAME.svg."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=110)
    Image.open(picture).convert("RGB").quantize(256).save(f"{name}.png", optimize=True)
    figure.savefig(f"{name}.svg", metadata={"Date": None})
    plt.close(figure)
