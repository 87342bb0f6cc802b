"""Measures error against run time of this package and of other solvers on the same equations.

Writes work_precision.csv and .md and the diagram .png, then compares with CVODE on a wheel that is held
between two rollers, in held_wheel.md. Builds what it needs in build/bench/ and installs SUNDIALS and matplotlib if they
are missing. About 20 minutes; --quick: some seconds. CMAKE_ARGUMENTS go to cmake's configure step.
"""

import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..command_line import DONE, Parser
from ..files import make_folder, write_whole
from ..report import csv_text
from . import work_precision_runs as runs
from .builds import ROOT, build
from .work_precision_report import CSV_COLUMNS, comparison, held_wheel_table, markdown

QUICK_SPAN = 2.0  # s of the scene that a quick look runs over


@dataclass
class Results:
    """All that the benchmark found."""

    about: dict
    scenes: list
    contestants: list
    quick: bool
    references: dict = field(default_factory=dict)  # by scene
    rows: list = field(default_factory=list)
    growth: list = field(default_factory=list)  # quantity, its values, and rows for each contestant


def read_arguments():
    parser = Parser("work_precision", __doc__,
                    epilog="Exit status: 0 done, 2 refused input, 1 the run could not be completed.")
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "work_precision", metavar="FOLDER",
                        help="where to write; docs/work_precision/ unless given")
    parser.add_argument("--scene", choices=[scene.key for scene in runs.SCENES], metavar="KEY",
                        help="run this one alone")
    parser.add_argument("--contestant", choices=[one.key for one in runs.CONTESTANTS], metavar="KEY",
                        help="run this one alone")
    parser.add_argument("--span", type=float, metavar="S",
                        help="simulate no more than the first S seconds of each scene, at least 1; all unless given")
    parser.add_argument("--quick", action="store_true",
                        help="a few seconds: one scene, its beginning, two settings each")
    parser.add_argument("--list", action="store_true", help="print the keys of scenes and contestants")
    parser.add_argument("--solve", type=Path, metavar="FILE",
                        help="run this program rather than build one, and install nothing")
    arguments = parser.parse_args()
    if arguments.span is None:
        arguments.span = QUICK_SPAN if arguments.quick else 1e9
    if not arguments.span >= 1:
        parser.error(f"--span = {arguments.span}: must be a number of seconds, 1 or more")
    return arguments


def say(row):
    text = f"  {row['contestant']:30} {row['setting']:<8g} "
    if row["failure"]:
        text += f"failed: {row['failure']}"
    else:
        text += (f"{row['run_time_s']:9.4f} s {row['position_error_m']:9.1e} m {row['heading_error_rad']:9.1e} rad "
                 f"{row['steps']:9} steps {row['switches']:6} switches")
    print(text, flush=True)


def sweep(solve, scene, span, results):
    reference = runs.make_reference(solve, scene, span, "quick" if results.quick else "record")
    results.references[scene.key] = reference
    for title, check in reference["checks"]:
        found = check.get("failure") or f"{check['position_error_m']:.1e} m"
        print(f"  reference ({reference['title']}, {reference['switches']} switches) against {title}: {found}",
              flush=True)
    explicit_span = runs.QUICK_EXPLICIT_SPAN if results.quick else runs.EXPLICIT_SPAN
    for contestant in results.contestants:
        for setting in contestant.settings[1:3] if results.quick else contestant.settings:
            own_span = min(reference["span"], explicit_span) if contestant.explicit else reference["span"]
            row = runs.measure(solve, scene, reference, contestant, setting, own_span)
            results.rows.append(row)
            say(row)
            if runs.ends_sweep(row):
                break


def useful_setting(results, scene, contestant):
    """Loosest setting with which a contestant stays within USEFUL_ERROR on a scene."""
    return max((row["setting"] for row in results.rows if (row["scene"], row["contestant"], row["failure"]) ==
                (scene.key, contestant.key, "") and row["position_error_m"] <= runs.USEFUL_ERROR), default=None)


def grow(solve, quantity, scene, variants, span, results):
    """Run times of all contestants on variants of a scene: value of the quantity, and a line of YAML."""
    print(quantity, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        varied = []
        for k, (value, line) in enumerate(variants):
            path = Path(folder) / f"variant_{k}.yaml"
            path.write_text(f"{scene.path.read_text()}{line}\n")
            varied.append(replace(scene, key=f"{scene.key}, {value}", path=path, rows=""))
        references = [runs.make_reference(solve, variant, span, "comparison") for variant in varied]
        curves = []
        for contestant in results.contestants:
            setting = useful_setting(results, scene, contestant)
            if setting is None or contestant.explicit or contestant.solver in runs.FIXED_STEP:
                continue
            curves.append([])
            for variant, reference in zip(varied, references):
                curves[-1].append(runs.measure(solve, variant, reference, contestant, setting, span))
                say(curves[-1][-1])
    results.growth.append((quantity, [value for value, _ in variants], curves))


def run(solve, arguments):
    scenes = [scene for scene in runs.SCENES if arguments.scene in (None, scene.key)]
    contestants = [one for one in runs.CONTESTANTS if arguments.contestant in (None, one.key)]
    results = Results(solve.about, scenes[:1] if arguments.quick else scenes, contestants, arguments.quick)
    for scene in results.scenes:
        print(scene.title, flush=True)
        sweep(solve, scene, arguments.span, results)
    first = results.scenes[0]
    if not arguments.quick and first is runs.SCENES[0]:
        held = [(f"held over {period:g} s", f"solver: {{control_period: {period}}}") for period in (1e-2, 1e-3, 1e-4)]
        grow(solve, "torque", first, [("continuous", ""), *held], 1.0, results)
        rollers = [(str(n), f"robot: {{rollers_per_wheel: {n}, roller_axis_radius: 0.034}}") for n in (4, 6, 12, 24)]
        grow(solve, "rollers on a wheel", first, rollers, 5.0, results)
    return results


def main():
    arguments = read_arguments()
    if arguments.list:
        for title, items in (("scenes", runs.SCENES), ("contestants", runs.CONTESTANTS)):
            print(f"{title}:", *(f"  {item.key:30} {item.title}" for item in items), sep="\n")
        return DONE
    solve = runs.Solve(arguments.solve or build("solve", packages=["libsundials-dev", "python3-matplotlib"])[0])
    results = run(solve, arguments)
    make_folder(arguments.output)
    table = arguments.output / "work_precision.csv"
    write_whole(table, csv_text(CSV_COLUMNS, results.rows, "{:.6g}".format))
    write_whole(arguments.output / "work_precision.md", markdown(results))
    held = held_wheel_table(runs.held_wheel(solve))
    write_whole(arguments.output / "held_wheel.md", held)
    print(f"\n{comparison(results)}\n{held}\nwritten: {arguments.output}/work_precision.csv, .md, held_wheel.md")
    from .plot_work_precision import plot  # with what has been installed
    plot(table, table.with_suffix(".png"))
    return DONE
