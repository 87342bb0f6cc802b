"""What the wheels would turn if they rolled, minus what they turn; and slip at the contact points."""
import numpy as np

from .record import Missing
from .section import COLORS, Section, rms, thinned
from .wheels import WHEELS

SATURATED = 0.99  # share of the friction limit


def analyse(record):
    joints = record.need("joint_states", "rate")
    truth = record.get("ground_truth", "V_X", "V_Y", "Omega")
    if not truth:
        return contradiction(joints, record.lack("ground_truth", "V_X", "V_Y", "Omega"))
    rolling = record.base.rolling_rates(*[truth.at(joints.t, name) for name in ("V_X", "V_Y", "Omega")])
    both = np.isfinite(rolling).all(axis=1)
    if not both.any():
        raise Missing("ground_truth and joint_states are never there at the same time")
    t, rolling, actual = joints.t[both], rolling[both], joints["rate"][both]
    slip = rolling - actual
    R = record.base.wheel_radius
    section = Section(
        "slip", "Slip of the wheels: what the true motion would roll (R = %g m), minus what they turn" % R)
    section.wheel_header()
    section.wheels("rms, rad/s", rms(slip), "%.4f", "slip_rms", "rad/s")
    section.wheels("at most, rad/s", np.abs(slip).max(axis=0), "%.4f", "slip_maximal", "rad/s")
    section.wheels("mean, rad/s", slip.mean(axis=0), "%.4f", "slip_mean", "rad/s")
    section.wheels("rms at the rim, mm/s", 1e3 * R * rms(slip), "%.2f", "rim_slip_rms", "mm/s")
    section.wheels("rms of the rates, rad/s", rms(actual), "%.3f", "rate_rms", "rad/s")
    section.tables["slip.csv"] = (
        ["t_s"] + ["%s_%s_rad_per_s" % (what, wheel) for what in ("rolling", "actual", "slip") for wheel in WHEELS],
        np.column_stack([t, rolling, actual, slip]))
    contacts = record.get("contacts", "slip", "share")
    if contacts:
        add_contacts(section, contacts)
    section.draw = lambda figure: draw(figure, t, slip, R, contacts)
    return section


def contradiction(joints, reason):
    """Four rates of a base that has three velocities: what no motion of it explains, the same for all wheels but for
    the sign."""
    fl, fr, bl, br = joints["rate"].T
    apart = (fl + fr - bl - br) / 4
    section = Section(
        "slip", "Slip of the wheels, only how far their rates contradict each other: %s" % reason)
    section.say("(fl + fr - bl - br) / 4", "%.4f rad/s rms, %.4f rad/s at most" % (rms(apart), np.abs(apart).max()))
    section.number("contradiction_rms", rms(apart), "rad/s")
    section.number("contradiction_maximal", np.abs(apart).max(), "rad/s")
    return section


def add_contacts(section, contacts):
    speed = np.linalg.norm(contacts["slip"], axis=2)
    section.say("at the contact points", "")
    section.wheels("  rms, mm/s", 1e3 * rms(speed), "%.3f", "contact_slip_rms", "mm/s")
    section.wheels("  at most, mm/s", 1e3 * speed.max(axis=0), "%.2f", "contact_slip_maximal", "mm/s")
    section.wheels("  at the friction limit, %", 100 * np.mean(contacts["share"] > SATURATED, axis=0), "%.1f",
                   "saturated", "%")
    section.tables["contact_slip.csv"] = (
        ["t_s"] + [column % wheel for column in ("slip_speed_%s_m_per_s", "friction_share_%s") for wheel in WHEELS],
        np.column_stack([contacts.t, speed, contacts["share"]]))


def draw(figure, t, slip, R, contacts):
    panels = figure.subplots(4, 2 if contacts else 1, sharex=True, sharey="col", squeeze=False)
    i = thinned(len(t))
    for k, (wheel, axes) in enumerate(zip(WHEELS, panels)):
        axes[0].plot(t[i], slip[i, k], color=COLORS[wheel], linewidth=0.6)
        axes[0].axhline(0, color="black", linewidth=0.5)
        axes[0].set_ylabel("%s, rad/s" % wheel)
        if contacts:
            j = thinned(len(contacts))
            axes[1].plot(contacts.t[j], 1e3 * np.linalg.norm(contacts["slip"][j, k], axis=1), color=COLORS[wheel],
                         linewidth=0.6)
            axes[1].set_ylabel("%s, mm/s" % wheel)
    panels[0][0].set_title("rolling minus actual rate (1 rad/s is %g mm/s at the rim)" % (1e3 * R), fontsize="medium")
    if contacts:
        panels[0][1].set_title("slip speed at the contact point", fontsize="medium")
    for axes in panels[-1]:
        axes.set_xlabel("t, s")
