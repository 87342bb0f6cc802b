"""The alignment of ground truth of a tracking system: its clock, the marker on the base, its fixed frame."""
import math

from .section import Section


def analyse(record):
    truth, found = record.need("ground_truth"), record.alignment
    section = Section("alignment", "Ground truth" + bool(found) * ", moved to base, wheels' clock, odometry's frame")
    if not found:
        section.say(record.topics["ground_truth"], "taken as the base's own pose, at the bag's clock")
        return section
    clock, sigma = found.clock
    section.say("clock", f"{clock:+.4f} s +- {sigma:.4f} s are added to its stamps, {truth.period:.4g} s apart",
                clock=(clock, "s"), clock_sigma=(sigma, "s"))
    unknown = (math.nan,) * 3
    for what, name, pose in (("marker on the base", "marker", found.marker), ("its frame in odometry's", "fixed",
                                                                              found.fixed or (unknown, unknown))):
        texts, numbers = [], {}
        for axis, unit, value, sigma in zip(("x", "y", "yaw"), ("m", "m", "rad"), *pose):
            texts.append(f"{axis} {value:.4f} {unit} +- {sigma:.4f} {unit}")
            numbers.update({f"{name}_{axis}": (value, unit), f"{name}_{axis}_sigma": (sigma, unit)})
        section.say(what, ", ".join(texts) if found.fixed or name == "marker" else "no odometry", **numbers)
    return section
