"""What the stress suite requires, and its report. A run is a row of stress.csv: a dictionary of what was measured."""

import math
from itertools import groupby

from report import table
from stress_cells import RANDOM_GROUP

DEFAULT_TOLERANCE = 3e-7  # as shipped, see `simulate --help`
MAX_TIMES_BASE = 20  # processor time over that of the base scene
FAST = 10_000  # switches a simulated second, beyond which real time is enough
MAX_MS = 1e-3  # s of processor time for 1 ms
MIN_PERMITTED = 0.05  # s of processor time, always allowed
SMALL_ANGLE = 1e-6  # rad: how far apart neighbours start; far above the tight tolerance, so that the motion decides
MAX_HELD_ERROR = 1e-5  # m, of a motion in which a wheel is held, at the default tolerance or tighter
SMALLEST = 1e-3  # absolute / relative tolerance, SI units: the least scale of a path or a speed
SMALLEST_ENERGY = 0.5 * 35.6 * SMALLEST**2  # J, of the robot at that speed
WHEELS_CENTRE = math.hypot(0.235, 0.15)  # m from O

EXPLANATION = """
Every cell is one motion at one tolerance tol (the relative one; the absolute one is 1e-3 of it). Run time is processor
time of the simulation. Required is:

- **finishes**: the whole duration with a finite state, in a process of its own; not refused, cut for its run time,
  hung (20 s of wall time beyond what its limit explains) or crashed.
- **cost**: at most 20 times the run time of Case 1 (2b, counter-clockwise) for the same simulated time at the same
  tolerance, which is measured before each group. Cut at 26 times; less than 0.05 s is never too much. A motion with
  more than 10,000 switches a simulated second needs only real time; it is cut at 1.3 times that.
- **1 ms**: at most 1 ms of run time for each simulated millisecond. Where one takes longer the run is repeated, up to
  twice, and the run with the quickest slowest millisecond counts.
- **energy**: the largest energy_balance_error (looked at every 10 ms or 1/4000 of the run) is at most
  tol (E + 1.8e-5 J). E is the larger of the greatest kinetic energy and the integral of the sum of |M dphi|.
- **halving**: half the tolerance moves the end pose by at most tol S (m; the turn counts at the wheels' centres, 0.28 m
  from O). Where it moves further, by no more than A tol S, the motion is *sensitive*, which explains it; beyond that it
  fails.
- **held wheel**: of the random runs at the default tolerance, 3e-7, or else the next tighter one, those in which a
  wheel was held between two rollers end within 1e-5 m of where they end with a hundredth of the tolerance.

S is the path: 1 mm more than the longer of the base's path and the longest that a wheel rolled. A is the amplification,
shown by two neighbours: wheel angles that start 1e-6 rad less and 1e-6 rad more, at tolerance 1e-9. A is the distance
of their ends from the motion's own, over R 1e-6 rad, the lesser of the two; runs with fallback steps show nothing. The
echo is the distance at the end of two runs at the cell's own tolerance that start 1e-12 rad apart. A and echo are
looked for only where halving moves the end by more than tol S. 1.8e-5 J and 1 mm are the robot's energy and path at
1e-3 SI units, where relative and absolute tolerance meet.

The numbers below are measured over allowed: up to 1 is right. `stress.csv` has every run.
"""

# Columns of stress.csv besides the counters of the integration: numbers but for the words of the first line.
WORDS = ["group", "cell", "build", "ending", "message", "outcome"]
NUMBERS = ["tolerance", "duration", "reached", "cpu_time", "base_cpu_time", "slowest_ms", "slowest_ms_at", "ms_99_9",
           "late_ms", "energy_error", "energy", "path", "halving", "echo", "amplification_minus", "amplification_plus",
           "x", "y", "psi", "hundredth_distance", "hundredth_heading", "switches_per_s", "cost_ratio", "ms_ratio",
           "energy_ratio", "halving_ratio", "held_ratio"]


def number(row, key):
    return row.get(key, math.nan)


def counters(row):
    return [key for key in row if key not in WORDS and key not in NUMBERS]


def switch_rate(row):
    return row["switches"] / row["reached"] if row.get("reached") else math.nan


def is_fast(row):
    return switch_rate(row) > FAST


def permitted_distance(row):
    """How far the end may move with half the tolerance, m, if the motion does not amplify."""
    return row["tolerance"] * (row["path"] + SMALLEST)


def times_held(row):
    """Times that a wheel was held between two rollers, by whatever name it is counted."""
    words = ("shared", "held", "sliding")
    told = [row[key] for key in counters(row) if any(word in key for word in words)]
    return sum(told) if told else math.nan


def amplification(row):
    """What both neighbours show: the lesser of the two."""
    sides = number(row, "amplification_minus"), number(row, "amplification_plus")
    return math.nan if any(map(math.isnan, sides)) else min(sides)


def judge(row):
    """Adds what was measured over what is allowed, and the outcome: holds, explained or fails."""
    row["switches_per_s"] = switch_rate(row)
    permitted = row["duration"] if is_fast(row) else MAX_TIMES_BASE * row["base_cpu_time"]
    row["cost_ratio"] = number(row, "cpu_time") / max(MIN_PERMITTED, permitted)
    row["ms_ratio"] = number(row, "slowest_ms") / MAX_MS
    row["energy_ratio"] = number(row, "energy_error") / (row["tolerance"] * (number(row, "energy") + SMALLEST_ENERGY))
    row["halving_ratio"] = number(row, "halving") / permitted_distance(row) if "path" in row else math.nan
    held = number(row, "hundredth_distance") if number(row, "hundredth_distance") >= 0 and times_held(row) > 0 else 0
    row["held_ratio"] = held / MAX_HELD_ERROR
    row["outcome"] = "fails" if failures(row) else "holds" if row["halving_ratio"] <= 1 else "explained"


def failures(row):
    """The requirements that a run fails, in words."""
    if row["ending"] in ("refused", "failed", "not finite"):
        return [f"{row['ending']}: {row['message']}"]
    words = []
    if row["ending"] != "finished":
        reached = f"at {row['reached']:.4g} of {row['duration']:g} s" if "reached" in row else row["message"]
        words.append(f"{row['ending']} {reached}".strip())
    elif not row["cost_ratio"] <= 1:
        words.append(f"cost {row['cost_ratio']:.4g} times")
    if row["ms_ratio"] > 1 or (row["ending"] == "finished" and math.isnan(row["ms_ratio"])):
        words.append(f"1 ms {row['ms_ratio']:.4g} times")
    if row["ending"] != "finished":
        return words
    if not row["energy_ratio"] <= 1:
        words.append(f"energy {row['energy_ratio']:.4g} times")
    if math.isnan(row["halving_ratio"]):
        words.append("halving: a run to compare with did not finish")
    elif row["halving_ratio"] > 1 and not row["halving_ratio"] <= amplification(row):
        A = amplification(row)
        shown = "unknown" if math.isnan(A) else f"{A:.2g}"
        words.append(f"halving {row['halving_ratio']:.4g} times (A {shown})")
    if row["held_ratio"] > 1:
        words.append(f"held wheel {row['held_ratio']:.3g} times")
    return words


def ratio(value):
    return "-" if math.isnan(value) else f"{value:.3g}" if value <= 1 else f"**{value:.3g}**"


def worst(rows, value):
    return max((v for v in map(value, rows) if not math.isnan(v)), default=math.nan)


def lines(rows):
    """The rows of each line of the summary: of a cell, or of all random runs."""
    return [(name, list(of_line)) for name, of_line in groupby(
        rows, lambda row: RANDOM_GROUP if row["group"] == RANDOM_GROUP else f"{row['group']}/{row['cell']}")]


def cell_table(rows):
    def line(name, of_line):
        def column(key):
            return worst(of_line, lambda row: number(row, key))

        def count(what):
            return sum(map(what, of_line))

        def of(n):
            return f"{n} of {len(of_line)}"

        def shown(text, value):
            return "-" if math.isnan(value) else text.format(value)

        finished, holding = count(lambda row: row["ending"] == "finished"), count(lambda row: row["outcome"] != "fails")
        sensitive = count(lambda row: row["halving_ratio"] > 1 and row["halving_ratio"] <= amplification(row))
        return [name, of(finished) if finished == len(of_line) else f"**{of(finished)}**", ratio(column("cost_ratio")),
                ratio(column("ms_ratio")), shown("{:.2g} ms", 1e3 * column("ms_99_9")), ratio(column("energy_ratio")),
                ratio(column("halving_ratio")) + (f", {sensitive} sensitive" if sensitive else ""),
                shown("{:.2g}", worst(of_line, amplification)), shown("{:.1e} m", column("echo")),
                "all" if holding == len(of_line) else of(holding)]

    return table(["cell", "finished", "cost", "slowest ms", "its 99.9 %", "energy", "halving", "A", "echo", "all hold"],
                 [line(*item) for item in lines(rows)])


def failure_table(rows):
    failed = [[f"{row['group']}/{row['cell']}", f"{row['tolerance']:g}", "; ".join(failures(row))]
              for row in rows if row["outcome"] == "fails"]
    return "\n## What does not hold\n\n" + table(["cell", "tol", ""], failed) if failed else ""


def explained_table(rows):
    explained = [[f"{row['group']}/{row['cell']}", f"{row['tolerance']:g}", f"{row['halving_ratio']:.4g}",
                  f"{row['amplification_minus']:.3g}", f"{row['amplification_plus']:.3g}", f"{row['echo']:.1e} m"]
                 for row in rows if row["outcome"] == "explained"]
    head = ["cell", "tol", "halving", "A, turned less", "A, turned more", "echo"]
    return "\n## Explained by a sensitive motion\n\n" + table(head, explained) if explained else ""


def held_table(rows, torques):
    """The random runs in which a wheel was held, beside what a hundredth of the tolerance makes of them."""
    compared = [row for row in rows if "hundredth_distance" in row]
    if not compared:
        return ""
    held = [row for row in compared if times_held(row) > 0]
    within = sum(row["held_ratio"] <= 1 for row in held)
    free = [row for row in compared if row not in held]
    distance = worst(free, lambda row: row["hundredth_distance"])
    others = f" Of the others, the largest such\ndistance is {distance:.1e} m." if free else ""
    text = f"""
## A wheel held between two rollers

Of {len(compared)} random runs at {compared[0]["tolerance"]:g}, {len(held)} tell of a wheel that was held; the end
position of {within} of these is within 1e-5 m of the run at a hundredth of the tolerance.{others}
"""
    if not held:
        return text
    head = ["run", "torque fl, fr, bl, br, N m", "times held", "distance, m", "heading, rad", "within"]
    return text + "\n" + table(head, [
        [row["cell"], torques[row["cell"]], f"{times_held(row):g}", f"{row['hundredth_distance']:.2e}",
         f"{row['hundredth_heading']:.2e}", "yes" if row["held_ratio"] <= 1 else "**no**"] for row in held])


def base_table(rows):
    costs = {}
    for row in rows:
        costs.setdefault(row["tolerance"], []).append(1e3 * row["base_cpu_time"] / row["duration"])
    return table(["tol", "base scene, ms of run time a simulated second: least to most over the suite"],
                 [[f"{tolerance:g}", f"{min(costs[tolerance]):.3g} to {max(costs[tolerance]):.3g}"]
                  for tolerance in sorted(costs, reverse=True)])


def counter_names(rows):
    return list(dict.fromkeys(name for row in rows for name in counters(row)))


def counter_table(rows):
    """The counters at the default tolerance, or else at the first that was run; those of the random runs summed."""
    ran = {row["tolerance"] for row in rows}
    tolerance = DEFAULT_TOLERANCE if DEFAULT_TOLERANCE in ran else rows[0]["tolerance"]
    at = [row for row in rows if row["tolerance"] == tolerance]
    names = counter_names(at)
    return f"\n## Counters at {tolerance:g}\n\n" + table(
        ["cell", *names],
        [[line] + [f"{sum(row[name] for row in of_line if name in row):.0f}"
                   if any(name in row for row in of_line) else "-" for name in names] for line, of_line in lines(at)])


def csv_text(rows):
    """One line for each cell and tolerance."""
    columns = WORDS[:2] + NUMBERS[:1] + WORDS[2:] + NUMBERS[1:] + counter_names(rows)

    def text(value):
        if isinstance(value, str):
            return '"' + value.replace('"', "'") + '"' if value and not value.isidentifier() else value
        return f"{value:.10g}" if isinstance(value, float) else str(value)

    return "\n".join([",".join(columns), *(",".join(text(row.get(key, "")) for key in columns) for row in rows)]) + "\n"


def read_rows(lines_of_csv):
    """Reads back what `csv_text` wrote, from csv.DictReader's rows."""
    for line in lines_of_csv:
        given = {key: value for key, value in line.items() if key in WORDS or value != ""}
        yield {key: value if key in WORDS else float(value) for key, value in given.items()}


def markdown(rows, torques):
    """The report; `torques` of the random runs by their names, as text."""
    failed = sum(row["outcome"] == "fails" for row in rows)
    explained = sum(row["outcome"] == "explained" for row in rows)
    head = f"# Stress suite\n\n{len(rows) - failed - explained} of {len(rows)} runs hold all requirements"
    if explained:
        head += f", {explained} more {'is' if explained == 1 else 'are'} explained by a sensitive motion"
    return "".join([head, ".\n", EXPLANATION, "\n", base_table(rows),
                    "\n## Cells, each with the worst over its tolerances\n\n", cell_table(rows),
                    held_table(rows, torques), failure_table(rows), explained_table(rows), counter_table(rows)])
