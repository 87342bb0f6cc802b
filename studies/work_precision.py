"""Measures error against run time of this package and of other solvers on the same equations, in about 15 minutes.
Writes work_precision.md, its tables in CSV and the diagram .png. With --quick it takes a minute, and prints how Cases 1
and 2 compare with CVODE and rosenbrock4. Builds what it needs in build/bench/, and installs SUNDIALS, matplotlib and
PyYAML if they are missing."""
import json
import math
import re
import subprocess
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

from youbot_base_sim.command_line import Parser
from youbot_base_sim.files import make_folder, write_whole
from youbot_base_sim.report import csv_text
from .builds import ROOT, build
from .pages import WrittenPart, figures, paragraph, table
from .work_precision_runs import (CONTESTANTS, EXPLICIT_SPAN, HELD_WHEEL, LONG_ENOUGH, LONG_RUN, SCENES,
                                  USEFUL_ERROR, make_reference, measure, run_solver)

PAGE = WrittenPart(ROOT / "docs" / "work_precision" / "work_precision.md", "scripts/study work_precision")
ERRORS = ("position_error_m heading_error_rad velocity_error_m_s yaw_rate_error_rad_s wheel_rate_error_rad_s "
          "roller_rate_error_rad_s")
COUNTS = "steps rejected_steps location_steps evaluations jacobians factorizations switches"
# Columns of the tables by their files' names: all runs, checks of what errors are measured by, and a wheel that is held
# between two rollers.
TABLES = {name: columns.split() for name, columns in {
    "work_precision": "scene scene_title contestant contestant_title relative_tolerance span_s run_time_s repeats "
                      f"run_time_per_simulated_s real_time_factor {ERRORS} {COUNTS} failure",
    "references": f"scene scene_title span_s switches reference checked_by {ERRORS} failure",
    "held_wheel": "contestant relative_tolerance end_off_m position_error_m switches run_time_s failure"}.items()}

# What --quick runs: the tolerances on both sides of an error of USEFUL_ERROR.
QUICK = {"youbot_base_sim": (1e-4, 1e-5, 1e-6), "cvode": (1e-7, 1e-8, 1e-9),
         "odeint_rosenbrock4_corrected": (1e-5, 1e-6, 1e-7)}
QUICK_SCENES = ("case1_ccw_coulomb", "case2_coulomb")


def say(row):
    found = row["failure"] or f"{row['run_time_s']:9.4f} s {row['position_error_m']:9.1e} m {row['steps']:9} steps"
    print(f"  {row['contestant']:30} {row['relative_tolerance']:<8g} {found}")


def sweep(solve, scene, span, contestants=CONTESTANTS):
    """Rows of references.csv and of work_precision.csv."""
    print(scene.title)
    reference = make_reference(solve, scene, span)
    checks = [{"scene": scene.key, "scene_title": scene.title, "span_s": reference["span"], "switches":
               reference["switches"], "reference": reference["title"], "checked_by": title, "failure": "", **check}
              for title, check in reference["checks"]]
    rows = []
    for contestant in contestants:
        for tolerance in contestant.tolerances:
            own_span = min(reference["span"], EXPLICIT_SPAN) if contestant.explicit else reference["span"]
            rows.append(row := measure(solve, scene, reference, contestant, tolerance, own_span))
            say(row)
            # Finer tolerances would but take longer. A failure says nothing about them.
            if not row["failure"] and row["run_time_s"] > (LONG_RUN, LONG_ENOUGH)[row["position_error_m"] <= USEFUL_ERROR]:
                break
    return checks, rows


def run(solve, arguments):
    """Rows of all tables by their names."""
    tables = {name: [] for name in TABLES}
    reference = solve(HELD_WHEEL, "radau", 1e-10, 10.0)
    tables["held_wheel"] = [measure(solve, HELD_WHEEL, reference, contestant, tolerance, 10.0)
                            for contestant in CONTESTANTS if contestant.key in ("youbot_base_sim", "cvode")
                            for tolerance in (1e-3, 1e-4, 1e-5, 1e-6, 1e-8)]
    for scene in SCENES:
        if arguments.scene in (None, scene.key):
            checks, rows = sweep(solve, scene, arguments.span)
            tables["references"] += checks
            tables["work_precision"] += rows
    return tables


def seconds(t):
    return f"{1e3 * t:.2g} ms" if t < 0.0995 else f"{1e3 * t:.0f} ms" if t < 0.9995 else f"{t:.3g} s"


def time_within(rows, scene, contestant, error):
    """Least run time (s) in which a contestant came within `error` (m), by the lower envelope of its points in
    logarithms, and "<= " if its coarsest setting is more accurate already. None if it never did."""
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


def best_table(rows, contestants=CONTESTANTS):
    """Run time of each method on each scene at USEFUL_ERROR, with the real-time factor or the ratio to this package."""
    spans = {row["scene"]: row["span_s"] for row in reversed(rows)}  # explicit methods, which come last, have their own
    scenes = {row["scene"]: row["scene_title"] for row in rows}
    own = {scene: time_within(rows, scene, CONTESTANTS[0].key, USEFUL_ERROR) for scene in scenes}

    def cell(contestant, scene):
        reached = time_within(rows, scene, contestant.key, USEFUL_ERROR)
        if not reached:
            return "never"
        run_time = reached[1] + seconds(reached[0])
        if contestant.key == CONTESTANTS[0].key:
            return f"{run_time} ({figures(spans[scene] / reached[0])} x real time)"
        return f"{run_time} ({reached[0] / own[scene][0]:.3g} x)" if own[scene] else run_time

    return table(["method", *scenes.values()], [[one.title, *(cell(one, scene) for scene in scenes)]
                                                for one in contestants if not one.explicit])


def written_part(program, rows, references):
    """What the script writes into the page; `program` says what it was built with."""
    about = json.loads(subprocess.check_output([program]))
    processor = re.findall(r"(?m)^model name\s*: (.*)", Path("/proc/cpuinfo").read_text()) or ["unknown processor"]
    machine = f"{time.strftime('%F', time.gmtime())}; {processor[0]}; {about['compiler']}, `{about['flags']}`; {about['libraries']}."
    checks = [check["position_error_m"] for check in references if not check["failure"]]
    trust = f" The references agree with those that check them within {max(checks):.1e} m." if checks else ""
    return "\n".join([paragraph(machine + trust), best_table(rows)])


def main():
    parser = Parser("work_precision", __doc__, "", "--scene case2_coulomb --span 2 --output build/case2")
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "work_precision", metavar="FOLDER",
                        help="where to write; docs/work_precision/ unless given")
    parser.add_argument("--scene", choices=[scene.key for scene in SCENES], help="run only this one")
    parser.add_argument("--span", type=float, default=1e9, metavar="S",
                        help="simulate no more than the first S seconds of each scene, at least 1; all unless given")
    parser.add_argument("--solve", type=Path, metavar="FILE",
                        help="run this program rather than build one, and install nothing")
    parser.add_argument("--quick", action="store_true", help="compare at an error of 1e-5 m alone, and write nothing")
    parser.add_argument("--beside", type=Path, metavar="FILE",
                        help="--quick, with this program too: build/bench/solve of the last release's checkout")
    arguments = parser.parse_args()
    if not arguments.span >= 1:
        parser.error(f"--span = {arguments.span}: must be a number of seconds, 1 or more")
    (compare_quickly if arguments.quick or arguments.beside else measure_all)(arguments)


def program_of(arguments):
    return arguments.solve or build("solve", packages=["libsundials-dev", "python3-matplotlib", "python3-yaml"])[0]


def compare_quickly(arguments):
    """Prints what the paper's cases take at USEFUL_ERROR, by the tolerances about it."""
    solve, other = partial(run_solver, program_of(arguments)), arguments.beside
    contestants = [replace(one, tolerances=QUICK[one.key]) for one in CONTESTANTS if one.key in QUICK]
    if other:
        contestants.insert(1, replace(contestants[0], key="beside", title=str(other), solver=f"radau of {other}"))
    rows = [row for scene in SCENES if scene.key in ([arguments.scene] if arguments.scene else QUICK_SCENES)
            for row in sweep(solve, scene, arguments.span, contestants)[1]]
    print(f"\nAt an error of {USEFUL_ERROR:g} m:\n\n{best_table(rows, contestants)}")


def measure_all(arguments):
    """Writes page and tables into the folder."""
    program = program_of(arguments)
    tables = run(partial(run_solver, program), arguments)
    make_folder(arguments.output)
    files = {name: arguments.output / f"{name}.csv" for name in tables}
    for name, rows in tables.items():
        write_whole(files[name], csv_text(TABLES[name], rows, "{:.4g}".format))
    from .plot_work_precision import plot  # with what has been installed
    plot(tables["work_precision"], arguments.output / "work_precision.png")
    part = written_part(program, tables["work_precision"], tables["references"])
    PAGE.write(part, arguments.output / "work_precision.md")
    print(f"\n{part}\nwritten: {arguments.output}/work_precision.md and .png, {', '.join(files)} as CSV")
