"""What the stress suite requires, and its report. A run is a row of stress.csv: a dictionary of what was measured."""

import csv
import math
import re
from itertools import groupby

from ..base import Base
from ..report import csv_text, table
from .builds import ROOT
from .stress_cells import RANDOM_GROUP, ROBOT_MASS

DEFAULT_TOLERANCE = 3e-7  # as shipped, see `simulate --help`
MAX_TIMES_BASE = 20  # processor time over that of the base scene
FAST = 10_000  # switches a simulated second, beyond which real time is enough
MAX_MS = 1e-3  # s of processor time for 1 ms
MIN_PERMITTED = 0.05  # s of processor time, always allowed
SMALL_ANGLE = 1e-6  # rad: how far apart neighbours start; far above the tight tolerance, so that the motion decides
MAX_HELD_ERROR = 1e-5  # m, of a motion in which a wheel is held, at the default tolerance or tighter
SMALLEST = 1e-3  # absolute / relative tolerance, SI units: the least scale of a path or a speed
SMALLEST_ENERGY = 0.5 * ROBOT_MASS * SMALLEST**2  # J, of the robot at that speed
WHEELS_CENTRE = math.hypot(Base.half_wheelbase, Base.half_track)  # m from O

# Columns of stress.csv besides the counters of the integration: numbers but for WORDS.
COLUMNS = ("group cell tolerance build ending message outcome duration reached cpu_time base_cpu_time slowest_ms "
           "slowest_ms_at ms_99_9 late_ms energy_error energy path halving echo amplification_minus amplification_plus "
           "x y psi hundredth_distance hundredth_heading switches_per_s cost_ratio ms_ratio energy_ratio halving_ratio "
           "held_ratio").split()
WORDS = ("group", "cell", "build", "ending", "message", "outcome")


class Row(dict):
    """What was measured of a run; what was not is not a number."""

    def __missing__(self, key):
        return math.nan

    @property
    def full_name(self):
        return f"{self['group']}/{self['cell']}"

    @property
    def is_fast(self):
        return self["switches"] > FAST * self["reached"]

    @property
    def permitted_distance(self):
        """How far the end may move with half the tolerance, m, if the motion does not amplify."""
        return self["tolerance"] * (self["path"] + SMALLEST)

    @property
    def amplification(self):
        """What both neighbours show: the lesser of the two."""
        sides = self["amplification_minus"], self["amplification_plus"]
        return math.nan if any(map(math.isnan, sides)) else min(sides)

    @property
    def is_sensitive(self):
        return 1 < self["halving_ratio"] <= self.amplification

    def judge(self):
        """Adds what was measured over what is allowed, and the outcome: holds, explained or fails."""
        self["switches_per_s"] = self["switches"] / self["reached"] if self["reached"] else math.nan
        permitted = self["duration"] if self.is_fast else MAX_TIMES_BASE * self["base_cpu_time"]
        self["cost_ratio"] = self["cpu_time"] / max(MIN_PERMITTED, permitted)
        self["ms_ratio"] = self["slowest_ms"] / MAX_MS
        self["energy_ratio"] = self["energy_error"] / (self["tolerance"] * (self["energy"] + SMALLEST_ENERGY))
        self["halving_ratio"] = self["halving"] / self.permitted_distance
        compared = self["hundredth_distance"] >= 0 and self["shared_contacts"] > 0
        self["held_ratio"] = self["hundredth_distance"] / MAX_HELD_ERROR if compared else 0.0
        self["outcome"] = "fails" if self.failures() else "holds" if self["halving_ratio"] <= 1 else "explained"

    def failures(self):
        """The requirements that the run fails, in words."""
        ending = self["ending"]
        if ending in ("refused", "failed", "not finite"):
            return [f"{ending}: {self['message']}"]
        if ending != "finished":
            reached = f"at {self['reached']:.4g} of {self['duration']:g} s" if "reached" in self else self["message"]
            slow = [f"1 ms {self['ms_ratio']:.4g} times"] if self["ms_ratio"] > 1 else []
            return [f"{ending} {reached}".strip(), *slow]
        words = [f"{name} {self[key]:.4g} times"
                 for name, key in (("cost", "cost_ratio"), ("1 ms", "ms_ratio"), ("energy", "energy_ratio"))
                 if not self[key] <= 1]
        if math.isnan(self["halving_ratio"]):
            words.append("halving: a run to compare with did not finish")
        elif self["halving_ratio"] > 1 and not self.is_sensitive:
            A = self.amplification
            words.append(f"halving {self['halving_ratio']:.4g} times (A {'unknown' if math.isnan(A) else f'{A:.2g}'})")
        if self["held_ratio"] > 1:
            words.append(f"held wheel {self['held_ratio']:.3g} times")
        return words


def csv_of_rows(rows):
    """One line for each cell and tolerance."""
    return csv_text(COLUMNS + counter_names(rows), rows, "{:.10g}".format)


def kept_rows(path, build):
    """The rows of `csv_of_rows` in a file that this build gave, by group, cell, tolerance and duration."""
    with open(path, newline="") as file:
        rows = [Row({key: value if key in WORDS else float(value) for key, value in line.items()
                     if key in WORDS or value}) for line in csv.DictReader(file) if line["build"] == build]
    return {(row["group"], row["cell"], row["tolerance"], row["duration"]): row for row in rows}


def ratio(value):
    return "-" if math.isnan(value) else f"{value:.3g}" if value <= 1 else f"**{value:.3g}**"


def shown(text, value):
    return "-" if math.isnan(value) else text.format(value)


def worst(values):
    return max((value for value in values if not math.isnan(value)), default=math.nan)


def lines(rows):
    """The rows of each line of the summary: of a cell, or of all random runs."""
    return [(name, list(of_line)) for name, of_line in groupby(
        rows, lambda row: RANDOM_GROUP if row["group"] == RANDOM_GROUP else row.full_name)]


def cell_line(name, rows):
    most = {key: worst(row[key] for row in rows) for key in COLUMNS if key not in WORDS}
    finished = sum(row["ending"] == "finished" for row in rows)
    holding = sum(row["outcome"] != "fails" for row in rows)
    sensitive = sum(row.is_sensitive for row in rows)
    return [name, f"{finished} of {len(rows)}" if finished == len(rows) else f"**{finished} of {len(rows)}**",
            ratio(most["cost_ratio"]), ratio(most["ms_ratio"]), shown("{:.2g} ms", 1e3 * most["ms_99_9"]),
            ratio(most["energy_ratio"]),
            ratio(most["halving_ratio"]) + (f", {sensitive} sensitive" if sensitive else ""),
            shown("{:.2g}", worst(row.amplification for row in rows)), shown("{:.1e} m", most["echo"]),
            "all" if holding == len(rows) else f"{holding} of {len(rows)}"]


def cell_table(rows):
    return table(["cell", "finished", "cost", "slowest ms", "its 99.9 %", "energy", "halving", "A", "echo", "all hold"],
                 [cell_line(*item) for item in lines(rows)])


def section(title, head, rows):
    """A table with its title, if there is anything in it."""
    return f"\n## {title}\n\n{table(head, rows)}" if rows else ""


def failure_table(rows):
    return section("What does not hold", ["cell", "tol", ""], [
        [row.full_name, f"{row['tolerance']:g}", "; ".join(row.failures())]
        for row in rows if row["outcome"] == "fails"])


def explained_table(rows):
    return section("Explained by a sensitive motion",
                   ["cell", "tol", "halving", "A, turned less", "A, turned more", "echo"],
                   [[row.full_name, f"{row['tolerance']:g}", f"{row['halving_ratio']:.4g}",
                     f"{row['amplification_minus']:.3g}", f"{row['amplification_plus']:.3g}", f"{row['echo']:.1e} m"]
                    for row in rows if row["outcome"] == "explained"])


def held_table(rows, torques):
    """The random runs in which a wheel was held, beside what a hundredth of the tolerance makes of them."""
    compared = [row for row in rows if "hundredth_distance" in row]
    if not compared:
        return ""
    held = [row for row in compared if row["shared_contacts"] > 0]
    within = sum(row["held_ratio"] <= 1 for row in held)
    distance = worst(row["hundredth_distance"] for row in compared if row not in held)
    others = shown(" Of the others, the largest such\ndistance is {:.1e} m.", distance)
    text = f"""
## A wheel held between two rollers

Of {len(compared)} random runs at {compared[0]["tolerance"]:g}, {len(held)} tell of a wheel that was held; the end
position of {within} of these is within 1e-5 m of the run at a hundredth of the tolerance.{others}
"""
    if not held:
        return text
    head = ["run", "torque fl, fr, bl, br, N m", "times held", "distance, m", "heading, rad", "within"]
    return text + "\n" + table(head, [
        [row["cell"], ", ".join(f"{x:+.4f}" for x in torques[row["cell"]]), f"{row['shared_contacts']:g}",
         f"{row['hundredth_distance']:.2e}", f"{row['hundredth_heading']:.2e}",
         "yes" if row["held_ratio"] <= 1 else "**no**"] for row in held])


def base_table(rows):
    costs = {}
    for row in rows:
        costs.setdefault(row["tolerance"], []).append(1e3 * row["base_cpu_time"] / row["duration"])
    return table(["tol", "base scene, ms of run time a simulated second: least to most over the suite"],
                 [[f"{tolerance:g}", f"{min(costs[tolerance]):.3g} to {max(costs[tolerance]):.3g}"]
                  for tolerance in sorted(costs, reverse=True)])


def counter_names(rows):
    return list(dict.fromkeys(key for row in rows for key in row if key not in COLUMNS))


def counter_table(rows):
    """The counters at the default tolerance, or else at the first that was run; those of the random runs summed."""
    ran = {row["tolerance"] for row in rows}
    tolerance = DEFAULT_TOLERANCE if DEFAULT_TOLERANCE in ran else rows[0]["tolerance"]
    at = [row for row in rows if row["tolerance"] == tolerance]
    names = counter_names(at)
    return section(f"Counters at {tolerance:g}", ["cell", *names], [
        [line, *(f"{sum(counts):.0f}" if (counts := [row[name] for row in of_line if name in row]) else "-"
                 for name in names)] for line, of_line in lines(at)])


def requirements():
    """In words, as docs/stress.md has them."""
    page = (ROOT / "docs" / "stress.md").read_text()
    return re.search(r"(?s)\nEvery cell is .*?`stress\.csv` has every run\.\n", page)[0]


def markdown(rows, torques):
    """The report; `torques` (N m) of the random runs by their names."""
    failed = sum(row["outcome"] == "fails" for row in rows)
    explained = sum(row["outcome"] == "explained" for row in rows)
    head = f"# Stress suite\n\n{len(rows) - failed - explained} of {len(rows)} runs hold all requirements"
    if explained:
        head += f", {explained} more {'is' if explained == 1 else 'are'} explained by a sensitive motion"
    return "".join([head, ".\n", requirements(), "\n", base_table(rows),
                    "\n## Cells, each with the worst over its tolerances\n\n", cell_table(rows),
                    held_table(rows, torques), failure_table(rows), explained_table(rows), counter_table(rows)])
