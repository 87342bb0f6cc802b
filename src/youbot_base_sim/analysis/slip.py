"""Angular velocity at which the wheels would roll, minus the actual one; and slip at the contact points."""
import numpy as np

from ..base import WHEELS
from ..figures import BLACK, WHEEL_COLOURS, WHEEL_NAMES, curve
from ..records import POSE, Missing
from .section import Section, rms

SATURATED = 0.99  # share of the friction limit


def analyse(record):
    joints = record.need("joint_states", "velocity")
    truth = record.get("ground_truth", *POSE[3:])
    if not truth:
        return contradiction(joints, record.lack("ground_truth", *POSE[3:]))
    rolling = np.stack(record.base.rolling_rates(*[truth.at(joints.t, name) for name in POSE[3:]]), -1)
    both = np.isfinite(rolling).all(axis=1)
    if not both.any():
        raise Missing("ground_truth and joint_states do not overlap in time")
    t, rolling, actual = joints.t[both], rolling[both], joints["velocity"][both]
    slip = rolling - actual
    R = record.base.wheel_radius
    section = Section("slip", f"Slip of the wheels: angular velocity of ideal rolling (R = {R:g} m) minus the actual "
                              "one")
    section.wheel_header()
    section.wheels("rms, rad/s", rms(slip), ".4f", "slip_rms", "rad/s")
    section.wheels("at most, rad/s", np.abs(slip).max(axis=0), ".4f", "slip_maximal", "rad/s")
    section.wheels("mean, rad/s", slip.mean(axis=0), ".4f", "slip_mean", "rad/s")
    section.wheels("rms at the rim, mm/s", 1e3 * R * rms(slip), ".2f", "rim_slip_rms", "mm/s")
    section.wheels("rms of the actual, rad/s", rms(actual), ".3f", "rate_rms", "rad/s")
    section.tables["slip.csv"] = (
        ["t_s"] + [f"{what}_{wheel}_rad_per_s" for what in ("rolling", "actual", "slip") for wheel in WHEELS],
        np.column_stack([t, rolling, actual, slip]))
    contacts = record.get("contacts", "slip", "share")
    if contacts:
        add_contacts(section, contacts)
    section.draw = lambda figure: draw(figure, t, slip, R, contacts)
    return section


def contradiction(joints, reason):
    """The part of the wheels' velocities that no motion of a base explains: the same for all but for the sign."""
    fl, fr, bl, br = joints["velocity"].T
    apart = (fl + fr - bl - br) / 4
    largest = np.abs(apart).max()
    section = Section("slip", f"Slip of the wheels, only the part that no motion of the base explains: {reason}")
    section.say("(fl + fr - bl - br) / 4", f"{rms(apart):.4f} rad/s rms, {largest:.4f} rad/s at most",
                contradiction_rms=(rms(apart), "rad/s"), contradiction_maximal=(largest, "rad/s"))
    return section


def add_contacts(section, contacts):
    speed = np.linalg.norm(contacts["slip"], axis=2)
    section.say("at the contact points", "")
    section.wheels("  rms, mm/s", 1e3 * rms(speed), ".3f", "contact_slip_rms", "mm/s")
    section.wheels("  at most, mm/s", 1e3 * speed.max(axis=0), ".2f", "contact_slip_maximal", "mm/s")
    section.wheels("  at the friction limit, %", 100 * np.mean(contacts["share"] > SATURATED, axis=0), ".1f",
                   "saturated", "%")
    section.tables["contact_slip.csv"] = (
        ["t_s"] + [f"slip_speed_{wheel}_m_per_s" for wheel in WHEELS] + [f"friction_share_{wheel}" for wheel in WHEELS],
        np.column_stack([contacts.t, speed, contacts["share"]]))


def draw(figure, t, slip, R, contacts):
    panels = figure.subplots(4, 2 if contacts else 1, sharex=True, sharey="col", squeeze=False)
    for k, (wheel, colour, axes) in enumerate(zip(WHEEL_NAMES, WHEEL_COLOURS.values(), panels)):
        style = dict(color=colour, linewidth=0.6)
        curve(axes[0], t, slip[:, k], **style)
        axes[0].axhline(0, color=BLACK, linewidth=0.5)
        axes[0].set_ylabel(f"{wheel}, rad/s")
        if contacts:
            curve(axes[1], contacts.t, 1e3 * np.linalg.norm(contacts["slip"][:, k], axis=1), **style)
            axes[1].set_ylabel(f"{wheel}, mm/s")
    panels[0][0].set_title(f"ideal minus actual angular velocity (1 rad/s is {1e3 * R:g} mm/s at the rim)",
                           fontsize="medium")
    if contacts:
        panels[0][1].set_title("slip speed at the contact point", fontsize="medium")
    for axes in panels[-1]:
        axes.set_xlabel("t, s")
