"""The share of the commanded velocity, and of the rolled one, that the base reaches: forward, lateral and in yaw."""
import numpy as np

from .. import agreement
from ..agreement import fit
from ..figures import BLACK, BLUE, RED, curve
from ..records import Missing
from .section import Section

DIRECTIONS = (("forward", "V_X", "m/s"), ("lateral", "V_Y", "m/s"), ("yaw", "Omega", "rad/s"))


def analyse(record):
    V = [name for _, name, _ in DIRECTIONS]
    no_command = f"{record.lack('cmd_vel')}; {record.lack('velocity_command')}"
    truth, joints = record.get("ground_truth", *V), record.get("joint_states", "velocity")
    if truth:
        t, true = truth.t, [truth[name] for name in V]
        sources = [commanded(record, t), ("rolled", rolled(record, t))]
        section = Section("efficiency", "Efficiency: the true velocity as a share of others, by least squares")
    elif joints:
        t, true = joints.t, rolled(record, joints.t)
        sources = [commanded(record, t)]
        section = Section("efficiency", "Efficiency, no true velocity: what the wheels roll as a share of others")
    else:
        raise Missing(f"{record.lack('ground_truth', *V)}; {record.lack('joint_states', 'rate')}")
    if not any(velocities for _, velocities in sources):
        raise Missing(no_command)
    section.say("", "".join(f"{direction:>11}" for direction, _, _ in DIRECTIONS))
    for what, source in sources:
        if not source:
            section.say(f"of the {what} velocity", "not computed: " + (
                no_command if what == "commanded" else record.lack("joint_states", "velocity")))
            continue
        # Of coarse positions and rare poses over pieces: noise would lower the factors.
        factors = agreement.factors(record, "ground_truth")[0] if what == "rolled" else [
            fit(true[k], source, k, record.base) for k in range(3)]
        section.say(f"of the {what} velocity", "".join(f"{e:>11.4f}" if e == e else f"{'-':>11}" for e in factors),
                    **{f"{direction}_of_{what}": (e, "1")
                       for (direction, _, _), e in zip(DIRECTIONS, factors) if e == e})
        ratio, sigma = agreement.lateral_way(record) if what == "rolled" else (np.nan,) * 2
        if sigma == sigma:
            section.say("lateral over forward way", f"{ratio:>11.4f} +- {sigma:.4f} a revolution of the wheels, k_Y/k_X",
                        lateral_over_forward=(ratio, "1"), lateral_over_forward_sigma=(sigma, "1"))
    sources, label = [(what, source) for what, source in sources if source], "true" if truth else "rolled"
    columns = [f"{what}_{name}_{unit.replace('/', '_per_')}" for what, _ in [(label, true), *sources]
               for _, name, unit in DIRECTIONS]
    section.tables["efficiency.csv"] = (
        ["t_s", *columns], np.column_stack([t, *true, *(column for _, source in sources for column in source)]))
    section.draw = lambda figure: draw(figure, t, true, sources, label)
    return section


def commanded(record, t):
    """The last command before each instant; NaN before the first one."""
    for name in ("desired", "cmd_vel", "velocity_command"):
        series = record.get(name)
        if series:
            at = np.searchsorted(series.t, t, side="right") - 1
            return "desired" if name == "desired" else "commanded", [
                np.where(at >= 0, series[column][at], np.nan) for _, column, _ in DIRECTIONS]
    return "commanded", None


def rolled(record, t):
    joints = record.get("joint_states", "velocity")
    return list(record.base.velocities(joints.at(t, "velocity"))) if joints else None


def draw(figure, t, true, sources, label):
    for k, (axes, (direction, _, unit)) in enumerate(zip(figure.subplots(3, 1, sharex=True), DIRECTIONS)):
        for (what, source), (color, linestyle) in zip(sources, ((BLUE, "--"), (RED, "-"))):
            curve(axes, t, source[k], color=color, linestyle=linestyle, linewidth=1, label=what)
        curve(axes, t, true[k], color=BLACK, linewidth=1.2, label=label)
        axes.set_ylabel(f"{direction}, {unit}")
    figure.axes[0].legend(ncol=3)
    figure.axes[-1].set_xlabel("t, s")
