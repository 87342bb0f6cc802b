"""Measures error against run time of this package and of other solvers on the same equations.

Writes work_precision.md, its tables in CSV and the diagram .png. Builds what it needs in build/bench/ and installs
SUNDIALS and matplotlib if they are missing. About 20 minutes; --quick: some seconds. CMAKE_ARGUMENTS go to cmake's
configure step.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

from ..command_line import DONE, Parser
from ..files import make_folder, write_whole
from ..report import csv_text
from . import work_precision_runs as runs
from .builds import ROOT, build
from .work_precision_report import PAGE, TABLES, about_this_machine, written_part

QUICK_SPAN = 2.0  # s of the scene that a quick look runs over


def read_arguments():
    parser = Parser("work_precision", __doc__,
                    epilog="Exit status: 0 done, 2 rejected input, 1 the run could not be completed.")
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "work_precision", metavar="FOLDER",
                        help="where to write; docs/work_precision/ unless given")
    parser.add_argument("--scene", choices=[scene.key for scene in runs.SCENES], metavar="KEY",
                        help="run only this one")
    parser.add_argument("--contestant", choices=[one.key for one in runs.CONTESTANTS], metavar="KEY",
                        help="run only this one")
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


def sweep(solve, scene, arguments, contestants):
    """Rows of references.csv and of work_precision.csv."""
    reference = runs.make_reference(solve, scene, arguments.span, "quick" if arguments.quick else "record")
    checks = [{"scene": scene.key, "scene_title": scene.title, "span_s": reference["span"], "switches":
               reference["switches"], "reference": reference["title"], "checked_by": title, "failure": "", **check}
              for title, check in reference["checks"]]
    for check in checks:
        found = check["failure"] or f"{check['position_error_m']:.1e} m"
        print(f"  reference ({check['reference']}, {check['switches']} switches) against {check['checked_by']}: "
              f"{found}", flush=True)
    explicit_span = runs.QUICK_EXPLICIT_SPAN if arguments.quick else runs.EXPLICIT_SPAN
    rows = []
    for contestant in contestants:
        for setting in contestant.settings[1:3] if arguments.quick else contestant.settings:
            own_span = min(reference["span"], explicit_span) if contestant.explicit else reference["span"]
            rows.append(runs.measure(solve, scene, reference, contestant, setting, own_span))
            say(rows[-1])
            if runs.ends_sweep(rows[-1]):
                break
    return checks, rows


def useful_setting(rows, scene, contestant):
    """Loosest setting with which a contestant stays within USEFUL_ERROR on a scene."""
    return max((row["setting"] for row in rows if (row["scene"], row["contestant"], row["failure"]) ==
                (scene.key, contestant.key, "") and row["position_error_m"] <= runs.USEFUL_ERROR), default=None)


def grow(solve, quantity, scene, variants, span, settings):
    """Rows of growth.csv: contestants with their settings on variants of a scene, each a value of the quantity and a
    line of YAML."""
    print(quantity, flush=True)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for value, line in variants:
            path = Path(folder) / "variant.yaml"
            path.write_text(f"{scene.path.read_text()}{line}\n")
            variant = replace(scene, key=f"{scene.key}, {value}", path=path, rows="")
            reference = runs.make_reference(solve, variant, span, "comparison")
            for contestant, setting in settings:
                row = runs.measure(solve, variant, reference, contestant, setting, span)
                rows.append({"quantity": quantity, "value": value, **row})
                say(row)
    return rows


def run(solve, arguments):
    """Rows of all tables by their names."""
    scenes = [scene for scene in runs.SCENES if arguments.scene in (None, scene.key)]
    contestants = [one for one in runs.CONTESTANTS if arguments.contestant in (None, one.key)]
    tables = {name: [] for name in TABLES}
    for scene in scenes[:1] if arguments.quick else scenes:
        print(scene.title, flush=True)
        checks, rows = sweep(solve, scene, arguments, contestants)
        tables["references"] += checks
        tables["work_precision"] += rows
    first = scenes[0]
    if not arguments.quick and first is runs.SCENES[0]:
        settings = [(one, setting) for one in contestants if not one.explicit and one.solver not in runs.FIXED_STEP
                    for setting in [useful_setting(tables["work_precision"], first, one)] if setting is not None]
        held = [(f"{period:g}", f"solver: {{control_period: {period}}}") for period in (1e-2, 1e-3, 1e-4)]
        tables["growth"] += grow(solve, "control_period, s", first, [("0", ""), *held], 1.0, settings)
        rollers = [(f"{n}", f"robot: {{rollers_per_wheel: {n}, roller_axis_radius: 0.034}}") for n in (4, 6, 12, 24)]
        tables["growth"] += grow(solve, "rollers_per_wheel", first, rollers, 5.0, settings)
    tables["held_wheel"] = runs.held_wheel(solve)
    return tables


def main():
    arguments = read_arguments()
    if arguments.list:
        for title, items in (("scenes", runs.SCENES), ("contestants", runs.CONTESTANTS)):
            print(f"{title}:", *(f"  {item.key:30} {item.title}" for item in items), sep="\n")
        return DONE
    solve = runs.Solve(arguments.solve or build("solve", packages=["libsundials-dev", "python3-matplotlib"])[0])
    tables = run(solve, arguments)
    make_folder(arguments.output)
    files = {name: arguments.output / f"{name}.csv" for name in tables}
    for name, rows in tables.items():
        write_whole(files[name], csv_text(TABLES[name], rows, "{:.6g}".format))
    about = about_this_machine(solve.about, arguments.quick)
    part = written_part(about, tables["work_precision"], tables["references"])
    PAGE.write(part, arguments.output / "work_precision.md")
    print(f"\n{part}\nwritten: {arguments.output}/work_precision.md and .png, {', '.join(files)} as CSV")
    from .plot_work_precision import plot  # with what has been installed
    plot(files["work_precision"], files["work_precision"].with_suffix(".png"))
    return DONE
