"""The paper's figures, drawn from a Study. Each function returns a figure of matplotlib."""
import numpy as np
from matplotlib.lines import Line2D

from youbot_base_sim.figures import BLACK, BLUE, RED, SKY, WHEEL_COLOURS, WHEEL_NAMES, curve
from .claims import R, R_D, by_rollers, part
from .drawing import finish_paths, finished, letter, panels, path
from .runs import DEGREES

# 2a is wide, to show on both sides of 2b, which often lies on it; zoomed in, both are thin.
STYLES = {"no_slip": dict(color=BLACK, linestyle="--", zorder=3), "viscous": dict(color=SKY, linewidth=2.4),
          "coulomb": dict(color=RED, linewidth=0.8)}
ZOOMED = {model: dict(style, linewidth=1) for model, style in STYLES.items()}
NAMES = {"no_slip": "1, no slip", "viscous": "2a, viscous friction", "coulomb": "2b, Coulomb friction"}


def with_models(figure, models):
    return finished(figure, [Line2D([], [], **STYLES[model]) for model in models], [NAMES[model] for model in models])


def torques(study, title):
    """Fig. 4: the wheels' torques over time; of each model, where they differ."""
    runs = {model: run.truth for model, run in study.whole.items()}
    same = all(np.allclose(run["torque"], runs["coulomb"]["torque"], atol=1e-6) for run in runs.values())
    figure, axes = panels(*((1, 1) if same else (2, 2)), title)
    for i, (wheel, colour) in enumerate(zip(WHEEL_NAMES, WHEEL_COLOURS.values())):
        axis, name = axes[0 if same else i], f"$M_{i + 1}$ ({wheel})"
        for model in ["coulomb"] if same else runs:
            curve(axis, runs[model]["t"], runs[model]["torque"][:, i],
                  **(STYLES[model] if not same else dict(  # the front wheels may lie beneath the back ones
                      color=colour, label=name, linestyle="--" if i > 1 else "-",
                      linewidth=1.2 if i > 1 else 2.4)))
        axis.set(xlabel="t, s", ylabel="M, N m" if same else name + ", N m", xlim=(0, study.scene.duration))
    return finished(figure, *axes[0].get_legend_handles_labels()) if same else with_models(figure, runs)


def motion(study, title):
    """Figs. 5 and 8: trajectory of O and heading."""
    figure, axes = panels(1, 2, title, 3.7)
    for model, run in study.whole.items():
        truth = run.truth
        path(axes[0], truth, **STYLES[model])
        curve(axes[1], truth["t"], truth["psi"] * DEGREES, **STYLES[model])
    finish_paths(axes[0], next(iter(study.whole.values())).truth)
    axes[1].set(xlabel="t, s", ylabel="$\\psi$, degrees", xlim=(0, study.scene.duration))
    letter(axes, ("trajectory of O (square: start; dots: ends)", "heading"))
    return with_models(figure, study.whole)


def draw_velocities(runs, until, title, styles):
    figure, axes = panels(2, 2, title)
    for model, run in runs.items():
        rows = part(run, 0, until)
        for axis, values in zip(axes, (rows["V_X"], rows["V_Y"], rows["Omega"], rows["dphi"][:, 0])):
            curve(axis, rows["t"], values, **styles[model])
    for axis, name in zip(axes, ("$V_X$, m/s", "$V_Y$, m/s", "$\\Omega$, rad/s", "$\\dot\\varphi_1$, rad/s")):
        axis.set(xlabel="t, s", ylabel=name, xlim=(0, until))
    letter(axes, ("forward velocity", "lateral velocity", "yaw rate", "angular velocity of the front left wheel"))
    return with_models(figure, runs)


def velocities(study, title):
    """Fig. 6: velocities of the platform and of the first wheel over the first half of the motion."""
    return draw_velocities(study.whole, study.scene.duration / 2, title, STYLES)


def beginning(study, title):
    """Fig. 9: the same in the beginning, where each vibration can be seen."""
    return draw_velocities(study.beginning, study.beginning["coulomb"].truth["t"][-1], title, ZOOMED)


def spread(study, title):
    """Fig. 7: motion of model 2b from several initial wheel angles; the ends enlarged."""
    figure, axes = panels(1, 3, title, 3)
    runs = study.spread(study.half_pitch_angles())
    for run in reversed(runs):
        style = dict(color=BLACK, linewidth=1.6) if run is runs[0] else dict(color=BLUE, linewidth=0.6)
        for axis in axes[:2]:
            path(axis, run, **style)
        axes[2].plot(run["t"], run["psi"] * DEGREES, **style)
    ends = np.array([[run[key][-1] for run in runs] for key in ("x", "y")])
    size, lowest = np.ptp(ends, axis=1), ends.min(axis=1)
    for axis in axes[:2]:
        finish_paths(axis, runs[0])
    (left, right), (bottom, top) = np.add.outer(lowest, (-0.1 * size.max(), 1.1 * size.max() or 1))
    axes[1].set(xlim=(left, right), ylim=(bottom, top), aspect="equal", adjustable="box")
    axes[2].set(xlabel="t, s", ylabel="$\\psi$, degrees", xlim=(0, study.scene.duration))
    further = study.scene.roller_pitch / 2 * DEGREES
    letter(axes, ("trajectories of O, model 2b", f"ends: {size[0]:.2f} m by {size[1]:.2f} m", "heading"))
    return finished(figure, [Line2D([], [], color=BLACK), Line2D([], [], color=BLUE)],
                    ["wheel angles of the scene", f"the other 15 combinations, some wheels {further:.3g}° further"])


def contact(study, title):
    """Fig. 10: friction force and slip speed at P_1, with the switches of the first wheel marked."""
    figure, axes = panels(1 + len(study.contact), 1, title, 2)
    nu = float(study.scene.values.get("floor", {}).get("slip_regularization", 1e-3))
    highest = 0
    for axis, (model, run) in zip(axes[1:], study.contact.items()):
        t = run.contacts["t"]
        force, slip, limit = (run.contacts[key][:, 0] for key in ("force", "slip", "limit"))
        curve(axes[0], t, force, **ZOOMED[model])
        curve(axis, t, slip, **ZOOMED[model])
        after_start = t > 0.01 * t[-1]
        highest = max(highest, force[after_start].max())
        axis.axhline(nu, color=BLACK, linewidth=0.6)
        axis.text(t[-1], nu, " $\\nu$", va="center")
        axis.set(yscale="log", ylim=(nu / 3, 3 * max(slip[after_start].max(), nu)), ylabel="$|v_{P_1}|$, m/s")
        for time in run.switches[0][0]:
            for one in (axes[0], axis):
                one.axvline(time, color=STYLES[model]["color"], linestyle=":")
    curve(axes[0], t, limit, color=BLACK, linewidth=0.6, zorder=1)
    axes[0].text(t[-1], limit[-1], " $f N_1$", va="center")
    axes[0].set(ylim=(0, 1.1 * highest or None), ylabel="$|F_1|$, N")
    for axis in axes:
        axis.set(xlabel="t, s", xlim=(0, t[-1]))
    letter(axes, ["friction force at the front left wheel (dotted: its roller switches)",
                  *(f"slip speed, model {NAMES[model].split(',')[0]}" for model in study.contact)])
    return with_models(figure, study.contact)


def rollers(study, title):
    """Fig. 11, which the paper lacks: mean and vibration of the lateral velocity over the number of rollers."""
    figure, axes = panels(1, 2, title, 2.8)
    for R_d, color in ((R_D, RED), (0.03, BLUE)):
        counts = [count for count in (4, 5, 6, 8, 10, 12, 16, 20, 24) if R * np.cos(np.pi / count) > R_d]
        lost, by_bearings, vibration = by_rollers(study, R_d, counts)
        axes[0].plot(counts, lost, "o-", color=color, markersize=3)
        axes[0].plot(counts, by_bearings, "--", color=color)
        axes[1].plot(counts, vibration, "o-", color=color, markersize=3, label=f"$R_d$ = {1e3 * R_d:g} mm, rollers "
                     f"{2e3 * (R - R_d):g} mm thick")
    axes[0].set_ylabel("mean $V_Y$ below model 1's, %")
    axes[1].set(ylabel="mm/s, root mean square", yscale="log")
    for axis in axes:
        axis.set(xlabel="rollers per wheel", xticks=range(4, 25, 4))
    letter(axes, ("loss of lateral velocity (dashed: bearings alone)", "vibration of the lateral velocity"))
    return finished(figure, *axes[1].get_legend_handles_labels())
