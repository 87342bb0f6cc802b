"""What the stress suite requires, and its report. A run is a row of stress.csv: a dictionary of what was measured."""
import math

from youbot_base_sim.base import Base
from youbot_base_sim.report import csv_text
from .builds import ROOT
from .pages import WrittenPart, figures, paragraph, table
from .stress_cells import RANDOM_GROUP, ROBOT_MASS

MAX_TIMES_BASE = 20  # processor time over that of the base scene
FAST = 10_000  # switches a simulated second, beyond which real time is enough
MAX_MS = 1e-3  # s of processor time for 1 ms
MIN_PERMITTED = 0.05  # s of processor time, always allowed
SMALL_ANGLE = 1e-6  # rad: how far apart neighbours start; far above the tight tolerance, so that the motion decides
SMALLEST = 1e-3  # absolute / relative tolerance, SI units: the least scale of a path or a speed
SMALLEST_ENERGY = 0.5 * ROBOT_MASS * SMALLEST**2  # J, of the robot at that speed
WHEELS_CENTRE = math.hypot(Base.half_wheelbase, Base.half_track)  # m from O

PAGE = WrittenPart(ROOT / "docs" / "stress" / "stress.md", "scripts/study stress")

COLUMNS = (  # of stress.csv
    "group cell tolerance ending message outcome duration reached cpu_time base_cpu_time slowest_ms energy_error energy path "
    "halving amplification_minus amplification_plus x y psi switches shared_contacts cost_ratio ms_ratio energy_ratio "
    "halving_ratio").split()
BRACES = str.maketrans({"{": "{{", "}": "}}"})  # for str.format


class Row(dict):
    """What was measured of a run; NaN for what was not."""
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
        permitted = self["duration"] if self.is_fast else MAX_TIMES_BASE * self["base_cpu_time"]
        self["cost_ratio"] = self["cpu_time"] / max(MIN_PERMITTED, permitted)
        self["ms_ratio"] = self["slowest_ms"] / MAX_MS
        self["energy_ratio"] = self["energy_error"] / (self["tolerance"] * (self["energy"] + SMALLEST_ENERGY))
        self["halving_ratio"] = self["halving"] / self.permitted_distance
        self["outcome"] = "fails" if self.failures() else "holds" if self["halving_ratio"] <= 1 else "explained"

    def failures(self):
        """The requirements that the run fails: a text with a field for the number measured, and that number."""
        ending = self["ending"]
        late = [("a millisecond takes {} ms", 1e3 * self["slowest_ms"])] if self["ms_ratio"] > 1 else []
        if ending in ("refused", "failed", "not finite"):
            return [(f"{ending}: {self['message'].translate(BRACES)}", math.nan)]
        if ending != "finished":
            until = f"at {{}} of {self['duration']:g} s" if "reached" in self else self["message"]
            return [(f"{ending} {until}".strip(), self["reached"]), *late]
        found = late if self["ms_ratio"] >= 0 else [("milliseconds not measured", math.nan)]
        found += [(f"{name} {{}} times", self[f"{name}_ratio"]) for name in ("cost", "energy")
                  if not self[f"{name}_ratio"] <= 1]
        if math.isnan(self["halving_ratio"]):
            found.append(("halving: a run to compare with did not finish", math.nan))
        elif self["halving_ratio"] > 1 and not self.is_sensitive:
            found.append((f"halving {{}} times (A {shown('.2g', self.amplification, 'unknown')})",
                          self["halving_ratio"]))
        return found


def grouped(items, key):
    """Lists of items by their key, in the order in which the keys first appear."""
    groups = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups


def by_cell(rows):
    """The rows of each cell, and of all random runs together."""
    return grouped(rows, lambda row: RANDOM_GROUP if row["group"] == RANDOM_GROUP else row.full_name)


def shown(form, value, missing="-"):
    return missing if math.isnan(value) else format(value, form)


def worst(values):
    return max((value for value in values if not math.isnan(value)), default=math.nan)


def least_to_most(values):
    return " to ".join(dict.fromkeys(map(figures, (min(values), max(values)))))


def power(tolerance):
    """1e-3 rather than the 0.001 of {:g}."""
    digits, exponent = f"{tolerance:e}".split("e")
    return f"{float(digits):g}e{int(exponent)}"


# Columns of the table of cells: which of their runs are counted, and of which ratio the worst is shown.
RUNS = {"runs": lambda row: True, "finish": lambda row: row["ending"] == "finished",
        "hold or are explained": lambda row: row["outcome"] != "fails", "sensitive": lambda row: row.is_sensitive}
RATIOS = {"cost": "cost_ratio", "slowest ms": "ms_ratio", "energy": "energy_ratio", "halving": "halving_ratio"}


def cells_csv(rows):
    """One line for each cell, with the worst over its tolerances."""
    return csv_text(["cell", *RUNS, *RATIOS, "A"], [
        [name, *(f"{sum(map(holds, of_cell))}" for holds in RUNS.values()),
         *(figures(worst(row[key] for row in of_cell)) for key in RATIOS.values()), shown(".2g", worst(row.amplification for row in of_cell))]
        for name, of_cell in by_cell(rows).items()])


def failure_table(failing):
    """A line for each cell and requirement that it fails, over the tolerances."""
    found = grouped([(row.full_name, text, row["tolerance"], value) for row in failing
                     for text, value in row.failures()], lambda failure: failure[:2])
    return table(["cell", "tolerance", "what fails"], [
        [name, ", ".join(power(failure[2]) for failure in failures),
         text.format(least_to_most([failure[3] for failure in failures]))] for (name, text), failures in found.items()])


def written_part(rows):
    """What the script writes into the page."""
    failing, explained = ([row for row in rows if row["outcome"] == outcome] for outcome in ("fails", "explained"))
    sensitive = [f"{row.full_name} at {power(row['tolerance'])} (halving {figures(row['halving_ratio'])}, "
                 f"A {figures(row.amplification)})" for row in explained]
    cells, tolerances = len({row.full_name for row in rows}), sorted({row["tolerance"] for row in rows}, reverse=True)
    return "\n".join([
        paragraph(f"{cells} motions, each at {len(tolerances)} tolerances from {power(tolerances[0])} to "
                  f"{power(tolerances[-1])}: {len(rows) - len(failing) - len(explained)} of {len(rows)} runs hold all "
                  f"requirements, {len(explained)} more are explained by a sensitive motion."),
        "[cells.csv](cells.csv) has every motion with its worst figures over the tolerances.\n",
        "### What does not hold\n", failure_table(failing) if failing else "Everything holds.\n",
        paragraph(f"Explained by a sensitive motion: {', '.join(sensitive) or 'none'}.")])
