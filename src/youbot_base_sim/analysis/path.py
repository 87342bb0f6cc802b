"""The path of the base, and its distance from the desired one."""
import numpy as np

from ..figures import BLACK, RED, thinned
from ..records import POSE
from .section import Section, number


def analyse(record):
    truth = record.get("ground_truth", *POSE[:3])
    seen = truth or record.need("odom", *POSE[:3])
    section = Section("path", "The motion")
    section.say("end", f"t = {seen.t[-1]:.3f} s")
    x, y, psi = (seen[name][-1] for name in POSE[:3])
    if not truth:
        dx, dy, turn = (np.diff(seen[name]) for name in POSE[:3])
        section.say("path length by odometry",
                    f"{np.sum(np.hypot(dx, dy)):.3f} m, {np.degrees(np.sum(np.abs(turn))):.1f} deg")
        section.draw = lambda figure: draw_track(figure.subplots(), ("odometry", seen["x"], seen["y"]))
    section.say("true pose" if truth else "pose by odometry", "x {} m, y {} m, psi {} rad".format(
        *(number(value, ".4f") for value in (x, y, psi))),
                final_x=(x, "m"), final_y=(y, "m"), final_psi=(psi, "rad"))
    desired = record.get("desired")
    if desired and truth:
        off = np.hypot(truth["x"] - desired.at(truth.t, "x"), truth["y"] - desired.at(truth.t, "y"))
        off, t = off[np.isfinite(off)], truth.t[np.isfinite(off)]
        if len(off):
            section.say("off the desired path", f"{off[-1]:.3f} m at the end, {off.max():.3f} m at most "
                        f"(t = {t[np.argmax(off)]:.1f} s)", final_deviation=(off[-1], "m"),
                        maximal_deviation=(off.max(), "m"))
    return section


def draw_track(axes, *tracks):
    """tracks: (name, x, y), ground truth first."""
    for (name, x, y), color, style in zip(tracks, (BLACK, RED), ("-", "--")):
        i = thinned(x, y)
        axes.plot(x[i], y[i], color=color, linestyle=style, label=name)
    axes.plot(*([values[0]] for values in tracks[0][1:]), "o", color=BLACK, label="start")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x, m", ylabel="y, m")
    axes.legend()
