"""What of the commanded, and of the rolled, velocity the base reaches: ahead, sideways and turning."""
import numpy as np

from .record import Missing
from .section import Section, thinned

DIRECTIONS = (("ahead", "V_X", "m/s"), ("sideways", "V_Y", "m/s"), ("turning", "Omega", "rad/s"))
SMALL = 0.05  # of the whole speed: a part that is less tells nothing


def analyse(record):
    truth = record.need("ground_truth")
    true = [truth[name] for _, name, _ in DIRECTIONS]
    sources = [(what, velocities) for what, velocities in (
        commanded(record, truth.t), rolled(record, truth.t)) if velocities is not None]
    if not sources:
        raise Missing("no cmd_vel (geometry_msgs/Twist), velocity_command or joint_states to compare ground_truth with")
    section = Section("efficiency", "What of the velocity arrives: factor by which the true one follows it best")
    section.say("", "".join("%11s" % direction for direction, _, _ in DIRECTIONS))
    for what, source in sources:
        told = [fit(true[k], source, k, record.base) for k in range(3)]
        section.say("of what %s" % what, "".join("%11s" % ("%.4f" % e if e == e else "-") for e in told))
        for (direction, _, _), e in zip(DIRECTIONS, told):
            if e == e:
                section.number("%s_of_%s" % (direction, what.split()[-1]), e, "1")
    if not any(what == "was commanded" for what, _ in sources):
        section.say("of what was commanded", "not told: no cmd_vel (geometry_msgs/Twist) or velocity_command")
    columns, values = ["t_s"], [truth.t]
    for what, source in [("true", true)] + sources:
        columns += ["%s_%s_%s" % (what.split()[-1], name, unit.replace("/", "_per_")) for _, name, unit in DIRECTIONS]
        values += list(source)
    section.tables["efficiency.csv"] = (columns, np.column_stack(values))
    section.draw = lambda figure: draw(figure, truth.t, true, sources)
    return section


def commanded(record, t):
    """The last command before each instant; NaN before the first one."""
    for name in ("desired", "cmd_vel", "velocity_command"):
        series = record.get(name)
        if series:
            at = np.searchsorted(series.t, t, side="right") - 1
            return "was commanded" if name != "desired" else "was desired", [
                np.where(at >= 0, series[column][at], np.nan) for _, column, _ in DIRECTIONS]
    return "was commanded", None


def rolled(record, t):
    joints = record.get("joint_states")
    return "the wheels rolled", list(record.base.velocities(joints.at(t, "rate"))) if joints else None


def fit(true, source, k, base):
    """The least squares' e in true = e source for one direction; NaN where the source hardly has it."""
    sizes = np.array([1, 1, base.half_wheelbase + base.half_track])[:, None] * np.array(source)
    known = np.isfinite(sizes).all(axis=0)
    if not known.any() or np.mean(sizes[k, known] ** 2) <= SMALL ** 2 * np.mean(np.sum(sizes[:, known] ** 2, axis=0)):
        return np.nan
    return np.sum(true[known] * source[k][known]) / np.sum(source[k][known] ** 2)


def draw(figure, t, true, sources):
    i = thinned(len(t))
    for k, (axes, (direction, _, unit)) in enumerate(zip(figure.subplots(3, 1, sharex=True), DIRECTIONS)):
        for (what, source), style in zip(sources, (("#0072B2", "--"), ("#D55E00", "-"))):
            axes.plot(t[i], source[k][i], color=style[0], linestyle=style[1], linewidth=1, label=what)
        axes.plot(t[i], true[k][i], color="black", linewidth=1.2, label="the base did")
        axes.set_ylabel("%s, %s" % (direction, unit))
    figure.axes[0].legend(ncol=3)
    figure.axes[-1].set_xlabel("t, s")
