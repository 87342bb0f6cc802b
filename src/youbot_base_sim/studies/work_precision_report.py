"""The report of scripts/work_precision: tables in CSV, and its part of the page."""

import math
import re
import time
from pathlib import Path

from ..report import WrittenPart, figures, paragraph, table
from .builds import ROOT
from .work_precision_runs import CONTESTANTS, USEFUL_ERROR

PAGE = WrittenPart(ROOT / "docs" / "work_precision" / "work_precision.md", "scripts/work_precision")
ERRORS = ("position_error_m heading_error_rad velocity_error_m_s yaw_rate_error_rad_s wheel_rate_error_rad_s "
          "roller_rate_error_rad_s")
COUNTS = "steps rejected_steps location_steps evaluations jacobians factorizations switches"
# Columns of the tables by their files' names: all runs, checks of what errors are measured by, run times over the
# length of held torques and over the number of rollers, and a wheel that is held between two rollers.
TABLES = {name: columns.split() for name, columns in {
    "work_precision": "scene scene_title contestant contestant_title setting_kind setting span_s run_time_s repeats "
                      f"run_time_per_simulated_s real_time_factor {ERRORS} {COUNTS} failure",
    "references": f"scene scene_title span_s switches reference checked_by {ERRORS} failure",
    "growth": "quantity value contestant contestant_title setting_kind setting span_s run_time_per_simulated_s "
              "position_error_m switches failure",
    "held_wheel": "contestant setting end_off_m position_error_m switches run_time_s failure"}.items()}


def seconds(t):
    return f"{1e3 * t:.2g} ms" if t < 0.0995 else f"{1e3 * t:.0f} ms" if t < 0.9995 else f"{t:.3g} s"


def time_within(rows, scene, contestant, error):
    """Least run time (s) in which a contestant came within `error` (m): on the lower envelope of its points, straight
    in the logarithms; then "<= " if its coarsest setting is more accurate already. None if it never did."""
    points = sorted((row["run_time_s"], row["position_error_m"]) for row in rows
                    if (row["scene"], row["contestant"], row["failure"]) == (scene, contestant, ""))
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


def best_table(rows):
    """Run time of each method on each scene at USEFUL_ERROR: of this package with the real-time factor, of the others
    with the ratio to it."""
    spans = {row["scene"]: row["span_s"] for row in reversed(rows)}  # explicit methods, which come last, have their own
    scenes = {row["scene"]: row["scene_title"] for row in rows}
    own = {scene: time_within(rows, scene, CONTESTANTS[0].key, USEFUL_ERROR) for scene in scenes}

    def cell(contestant, scene):
        reached = time_within(rows, scene, contestant.key, USEFUL_ERROR)
        if not reached:
            return "never"
        run_time = reached[1] + seconds(reached[0])
        if contestant is CONTESTANTS[0]:
            return f"{run_time} ({figures(spans[scene] / reached[0])} x real time)"
        return f"{run_time} ({reached[0] / own[scene][0]:.3g} x)" if own[scene] else run_time

    return table(["method", *scenes.values()], [[one.title, *(cell(one, scene) for scene in scenes)]
                                                for one in CONTESTANTS if not one.explicit])


def about_this_machine(about, quick):
    processor = re.findall(r"(?m)^model name\s*: (.*)", Path("/proc/cpuinfo").read_text()) or ["unknown processor"]
    return (f"{time.strftime('%Y-%m-%d', time.gmtime())}; {processor[0]}; {about['compiler']}, `{about['flags']}`; "
            f"{about['libraries']}.{' A quick look, not for the record.' if quick else ''}")


def written_part(about, rows, references):
    """What the script writes into the page."""
    checks = [check["position_error_m"] for check in references if not check["failure"]]
    trust = f" The references agree with those that check them within {max(checks):.1e} m." if checks else ""
    return "\n".join([paragraph(about + trust), best_table(rows)])
