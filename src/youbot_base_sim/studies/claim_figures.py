"""The paper's figures, drawn from a Study. Each function returns a figure of matplotlib."""

import numpy as np
from matplotlib.cm import viridis
from matplotlib.lines import Line2D

from ..base import WHEELS
from ..figures import BLACK, BLUE, RED, curve
from .drawing import finish_paths, finished, letter, panels, path, wheel_style
from .runs import DEGREES, MODELS

STYLES = {"no_slip": dict(color=BLACK, linestyle="--", zorder=3), "viscous": dict(color=BLUE),
          "coulomb": dict(color=RED, linewidth=0.9)}
NAMES = {"no_slip": "1, no slip", "viscous": "2a, viscous friction", "coulomb": "2b, Coulomb friction"}


def with_models(figure, models=MODELS):
    return finished(figure, [Line2D([], [], **STYLES[model]) for model in models], [NAMES[model] for model in models])


def torques(study, title):
    """Fig. 4: the wheels' torques over time; of each model, where they differ."""
    runs = {model: run.wheels for model, run in study.whole.items()}
    same = all(np.allclose(run["torque"], runs["coulomb"]["torque"], atol=1e-6) for run in runs.values())
    names = [f"$M_{i + 1}$ ({wheel})" for i, wheel in enumerate(WHEELS)]
    figure, axes = panels(*((1, 1) if same else (2, 2)), title)
    for i, name in enumerate(names):
        axis = axes[0 if same else i]
        for model in ["coulomb"] if same else MODELS:
            curve(axis, runs[model]["t"], runs[model]["torque"][:, i],
                  **(wheel_style(WHEELS[i], name) if same else STYLES[model]))
        axis.set(xlabel="t, s", ylabel="M, N m" if same else name + ", N m", xlim=(0, study.scene.duration))
    return finished(figure, *axes[0].get_legend_handles_labels()) if same else with_models(figure)


def motion(study, title):
    """Figs. 5 and 8: trajectory of O and heading."""
    figure, axes = panels(1, 2, title, 3.7)
    for model in MODELS:
        truth = study.whole[model].truth
        style = dict(STYLES[model], **(dict(linewidth=2) if model == "viscous" else {}))  # often beneath 2b
        path(axes[0], truth, **style)
        curve(axes[1], truth["t"], truth["psi"] * DEGREES, **style)
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
            curve(axis, truth["t"][shown], values[shown], **dict(STYLES[model], linewidth=0.8))
    for axis, name in zip(axes, ("$V_X$, m/s", "$V_Y$, m/s", "$\\Omega$, rad/s", "$\\dot\\varphi_1$, rad/s")):
        axis.set(xlabel="t, s", ylabel=name, xlim=(0, until))
    letter(axes, ("forward velocity", "lateral velocity", "yaw rate", "angular velocity of wheel 1 (fl)"))
    return with_models(figure)


def velocities(study, title):
    """Fig. 6: velocities of the platform and of the first wheel over the first half of the motion."""
    return draw_velocities(study.whole, study.scene.duration / 2, title)


def beginning(study, title):
    """Fig. 9: the same in the beginning, where each vibration can be seen."""
    runs = study.beginning
    return draw_velocities(runs, runs["coulomb"].truth["t"][-1], title)


def spread(study, title):
    """Fig. 7: motion of model 2b from several initial wheel angles."""
    figure, axes = panels(1, 2, title, 3.7)
    runs = study.spread(study.half_pitch_angles())
    colours = ["black", *viridis(np.linspace(0, 0.9, len(runs) - 1))]
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
        curve(axes[0], t, force, **STYLES[model])
        curve(own, t, slip, **STYLES[model])
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
