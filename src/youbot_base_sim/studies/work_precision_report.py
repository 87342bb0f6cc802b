"""The report of scripts/work_precision: its CSV, and tables in Markdown."""

import math
import re
import time
from pathlib import Path

from ..report import table
from .builds import ROOT
from .work_precision_runs import CONTESTANTS, LONG_ENOUGH, LONG_RUN, USEFUL_ERROR

CSV_COLUMNS = ("scene scene_title contestant contestant_title setting_kind setting span_s run_time_s repeats "
               "run_time_per_simulated_s real_time_factor position_error_m heading_error_rad velocity_error_m_s "
               "yaw_rate_error_rad_s wheel_rate_error_rad_s roller_rate_error_rad_s steps rejected_steps "
               "location_steps evaluations jacobians factorizations switches failure").split()

TEMPLATE = ROOT / "docs" / "work_precision" / "template.md"


def seconds(t):
    return f"{1e3 * t:.2g} ms" if t < 0.0995 else f"{1e3 * t:.0f} ms" if t < 0.9995 else f"{t:.3g} s"


def figures(x):
    """Three figures, without an exponent while that is short."""
    return f"{x:.0f}" if x >= 1000 else f"{x:.3g}"


def setting(row):
    return f"h = {row['setting']:g} s" if row["setting_kind"] == "step_s" else f"{row['setting']:g}"


def span(row):
    return f"{row['span_s']:g} s"


# Columns of a listing: their heads, and how they are written.
REFERENCE_COLUMNS = {"position_error_m": ("position", "{:.1e} m".format),
                     "heading_error_rad": ("heading", "{:.1e} rad".format),
                     "velocity_error_m_s": ("velocity", "{:.1e} m/s".format),
                     "wheel_rate_error_rad_s": ("wheel rates", "{:.1e} rad/s".format)}
EXPLICIT_COLUMNS = {"position_error_m": ("position", "{:.1e} m".format),
                    "run_time_per_simulated_s": ("run time per simulated s", seconds),
                    "real_time_factor": ("real time", lambda factor: f"{figures(factor)} x")}
RUN_COLUMNS = {"run_time_s": ("run time", seconds), "run_time_per_simulated_s": ("per simulated s", seconds),
               "position_error_m": ("position, m", "{:.1e}".format),
               "heading_error_rad": ("heading, rad", "{:.1e}".format),
               "velocity_error_m_s": ("velocity, m/s", "{:.1e}".format),
               "wheel_rate_error_rad_s": ("wheel rates, rad/s", "{:.1e}".format),
               "steps": ("steps", str), "rejected_steps": ("rejected", str), "location_steps": ("locating", str),
               "evaluations": ("evaluations", str), "jacobians": ("Jacobians", str), "factorizations": ("LU", str),
               "switches": ("switches", str)}
HELD_COLUMNS = {"end_off_m": ("end off, m", "{:.1e}".format),
                "position_error_m": ("largest distance, m", "{:.1e}".format), "switches": ("switches", str),
                "run_time_s": ("run time, s", "{:.3f}".format)}


def listing(head, columns, rows):
    """A table of (cells under `head`, row): of each row its columns, or in the first of them why it failed."""
    def cells(row):
        if row["failure"]:
            return [f"failed: {row['failure']}"] + [""] * (len(columns) - 1)
        return [text(row[key]) if key in row else "-" for key, (_, text) in columns.items()]

    return table([*head, *(title for title, _ in columns.values())], [[*lead, *cells(row)] for lead, row in rows])


def time_within(rows, scene, contestant, error):
    """Least run time (s) in which a contestant came within `error` (m): on the lower envelope of its points, straight
    in the logarithms; then "<= " if its coarsest setting is more accurate already. None if it never did."""
    points = sorted((row["run_time_s"], row["position_error_m"]) for row in rows
                    if (row["scene"], row["contestant"], row["failure"]) == (scene.key, contestant.key, ""))
    coarse = None
    for fine in points:
        if coarse and fine[1] >= coarse[1]:
            continue
        if fine[1] <= error:
            if not coarse:
                return fine[0], "<= "
            share = math.log(error / coarse[1]) / math.log(fine[1] / coarse[1])
            return coarse[0] * (fine[0] / coarse[0]) ** share, ""
        coarse = fine
    return None


def references_table(results):
    return listing(["scene", "simulated", "switches", "reference", "checked by"], REFERENCE_COLUMNS, [
        ([scene.title, f"{reference['span']:g} s", str(reference["switches"]), reference["title"], title], check)
        for scene in results.scenes for reference in [results.references[scene.key]]
        for title, check in reference["checks"]])


def comparison_table(results, heads, entry):
    """A line for each contestant that is not explicit: `entry` of it for each of `heads`, by their titles."""
    return table(["contestant", *heads], [[one.title, *(entry(one, head) for head in heads.values())]
                                          for one in results.contestants if not one.explicit])


def useful_table(results):
    """Run time, ratio to this package and real-time factor of each contestant on each scene."""
    def entry(contestant, scene):
        reached = time_within(results.rows, scene, contestant, USEFUL_ERROR)
        if not reached:
            return "never"
        own = time_within(results.rows, scene, CONTESTANTS[0], USEFUL_ERROR)
        ratio = f"{reached[0] / own[0]:.3g}x, " if own else ""
        factor = figures(results.references[scene.key]["span"] / reached[0])
        return f"{reached[1]}{seconds(reached[0])}, {ratio}{factor} x real time"

    return comparison_table(results, {scene.title: scene for scene in results.scenes}, entry)


def accuracy_table(results, scene):
    """How run time grows with accuracy."""
    def entry(contestant, error):
        reached = time_within(results.rows, scene, contestant, error)
        return f"{reached[1]}{seconds(reached[0])}" if reached else "-"

    return comparison_table(results, {f"1e-{n} m": 10.0**-n for n in range(2, 9)}, entry)


def growth_table(quantity, values, curves):
    def entry(row):
        return row["failure"] or (f"{seconds(row['run_time_per_simulated_s'])} ({row['position_error_m']:.0e} m, "
                                  f"{row['switches']} switches)")

    return table([quantity, "tolerance", *values], [
        [rows[0]["contestant_title"], setting(rows[0]), *map(entry, rows)] for rows in curves])


def explicit_table(results):
    explicit = [one.key for one in results.contestants if one.explicit]
    return listing(["scene", "contestant", "tolerance or step", "span"], EXPLICIT_COLUMNS, [
        ([row["scene_title"], row["contestant_title"], setting(row), span(row)], row)
        for row in results.rows if row["contestant"] in explicit])


def runs_table(results, scene):
    return listing(["contestant", "tolerance or step", "span"], RUN_COLUMNS, [
        ([row["contestant_title"], setting(row), span(row)], row)
        for row in results.rows if row["scene"] == scene.key])


def held_wheel_table(rows):
    return listing(["solver", "tolerance"], HELD_COLUMNS, [([row["contestant"], setting(row)], row) for row in rows])


def comparison(results):
    """The part of the report that answers who takes how long at USEFUL_ERROR, for the terminal."""
    return (f"Run time at a largest position error of {USEFUL_ERROR:g} m, ratio to this package, simulated over run "
            f"time:\n\n{useful_table(results)}")


def markdown(results):
    about = results.about
    processor = re.findall(r"(?m)^model name\s*: (.*)", Path("/proc/cpuinfo").read_text()) or ["unknown processor"]
    machine = (f"{time.strftime('%Y-%m-%d', time.gmtime())}; {processor[0]}; {about['compiler']}, `{about['flags']}`; "
               f"{about['libraries']}.")
    if results.quick:
        machine += " A quick look, not for the record."

    def of_scenes(make):
        return "".join(f"\n{scene.title}:\n\n{make(results, scene)}" for scene in results.scenes)

    return TEMPLATE.read_text().format(
        machine=machine, useful=USEFUL_ERROR, long_run=LONG_RUN, long_enough=LONG_ENOUGH,
        references=references_table(results), useful_table=useful_table(results), accuracy=of_scenes(accuracy_table),
        growth="".join(f"\n{growth_table(*growth)}" for growth in results.growth) or "\nNot measured.\n",
        explicit=explicit_table(results), runs=of_scenes(runs_table))
