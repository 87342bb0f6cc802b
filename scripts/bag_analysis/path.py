"""Where the base went, and how far off the path that was desired."""
import numpy as np

from .section import Section


def analyse(record):
    truth = record.get("ground_truth", "x", "y", "psi")
    seen = truth or record.need("odom", "x", "y", "psi")
    section = Section("path", "The motion")
    section.say("its end", "t = %.3f s" % seen.t[-1])
    x, y, psi = (seen[name][-1] for name in ("x", "y", "psi"))
    if not truth:
        section.say("way by odometry", "%.3f m, %.1f deg" % (
            np.sum(np.hypot(np.diff(seen["x"]), np.diff(seen["y"]))), np.degrees(np.sum(np.abs(np.diff(seen["psi"]))))))
    section.say("true pose" if truth else "pose by odometry", "x %.4f m, y %.4f m, psi %.4f rad" % (x, y, psi))
    for name, value, unit in (("final_x", x, "m"), ("final_y", y, "m"), ("final_psi", psi, "rad")):
        section.number(name, value, unit)
    desired = record.get("desired")
    if desired and truth:
        off = np.hypot(truth["x"] - desired.at(truth.t, "x"), truth["y"] - desired.at(truth.t, "y"))
        there = np.isfinite(off)
        if there.any():
            off, t = off[there], truth.t[there]
            section.say("off the desired path", "%.3f m at the end, %.3f m at most (t = %.1f s)" % (
                off[-1], off.max(), t[np.argmax(off)]))
            section.number("final_deviation", off[-1], "m")
            section.number("maximal_deviation", off.max(), "m")
    return section
