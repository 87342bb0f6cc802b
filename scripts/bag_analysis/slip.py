"""What the wheels would turn if they rolled, minus what they turn; and slip at the contact points."""
import numpy as np

from .record import Missing
from .section import COLORS, Section, rms, thinned
from .wheels import WHEELS

SATURATED = 0.99  # share of the friction limit


def analyse(record):
    truth, joints = record.need("ground_truth"), record.need("joint_states")
    rolling = record.base.rolling_rates(*[truth.at(joints.t, name) for name in ("V_X", "V_Y", "Omega")])
    both = np.isfinite(rolling).all(axis=1)
    if not both.any():
        raise Missing("ground_truth and joint_states are never there at the same time")
    t, rolling, actual = joints.t[both], rolling[both], joints["rate"][both]
    slip = rolling - actual
    R = record.base.wheel_radius
    section = Section("slip", "Slip of the wheels: what the true motion would roll (R = %g m), minus what they turn" % R)
    section.wheel_header()
    section.wheels("rms, rad/s", rms(slip), "%.4f", "slip_rms", "rad/s")
    section.wheels("at most, rad/s", np.abs(slip).max(axis=0), "%.4f", "slip_maximal", "rad/s")
    section.wheels("mean, rad/s", slip.mean(axis=0), "%.4f", "slip_mean", "rad/s")
    section.wheels("rms at the rim, mm/s", 1e3 * R * rms(slip), "%.2f", "rim_slip_rms", "mm/s")
    section.wheels("rms of the rates, rad/s", rms(actual), "%.3f", "rate_rms", "rad/s")
    section.tables["slip.csv"] = (
        ["t_s"] + ["%s_%s_rad_per_s" % (what, wheel) for what in ("rolling", "actual", "slip") for wheel in WHEELS],
        np.column_stack([t, rolling, actual, slip]))
    contacts = record.get("contacts")
    if contacts:
        add_contacts(section, contacts)
    section.draw = lambda figure: draw(figure, t, slip, R, contacts)
    return section


def add_contacts(section, contacts):
    speed = np.linalg.norm(contacts["slip"], axis=2)
    section.say("at the contact points", "")
    section.wheels("  rms, mm/s", 1e3 * rms(speed), "%.3f", "contact_slip_rms", "mm/s")
    section.wheels("  at most, mm/s", 1e3 * speed.max(axis=0), "%.2f", "contact_slip_maximal", "mm/s")
    section.wheels("  at the friction limit, %", 100 * np.mean(contacts["share"] > SATURATED, axis=0), "%.1f",
                   "saturated", "%")
    section.tables["contact_slip.csv"] = (
        ["t_s"] + ["slip_speed_%s_m_per_s" % wheel for wheel in WHEELS] + ["friction_share_%s" % wheel for wheel in WHEELS],
        np.column_stack([contacts.t, speed, contacts["share"]]))


def draw(figure, t, slip, R, contacts):
    rows = figure.subplots(2 if contacts else 1, 1, sharex=True, squeeze=False)[:, 0]
    i = thinned(len(t))
    for wheel, column in zip(WHEELS, slip.T):
        rows[0].plot(t[i], column[i], color=COLORS[wheel], linewidth=0.8, label=wheel)
    rows[0].set_ylabel("rolling minus actual, rad/s")
    rows[0].secondary_yaxis("right", functions=(lambda rate: 1e3 * R * rate, lambda speed: speed / (1e3 * R))).set_ylabel(
        "at the rim, mm/s")
    rows[0].legend(ncol=4)
    if contacts:
        i = thinned(len(contacts))
        for k, wheel in enumerate(WHEELS):
            speed = np.linalg.norm(contacts["slip"][:, k], axis=1)
            rows[1].plot(contacts.t[i], 1e3 * speed[i], color=COLORS[wheel], linewidth=0.8)
        rows[1].set_ylabel("slip at the contact points, mm/s")
    rows[-1].set_xlabel("t, s")
