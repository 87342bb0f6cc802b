"""Reports on a bag of base_node, of `simulate --bag` or of a real base.

Drift of the odometry, slip of the wheels, roller switches, energy balance, ripple of the wheels' angular velocities,
and how much of the commanded motion arrived. Uses odom, ground_truth, joint_states, roller_switches, contacts, cmd_vel
and velocity_command, in any namespace, and says in one line each what it cannot compute and why. docs/analyse.md
explains the numbers.

A bag that is cut, damaged or without an index is read up to where it breaks; the file is never written to.
"""
import argparse
import importlib
import warnings
from pathlib import Path

import numpy as np

from . import figures, page
from .command_line import DONE, Failed, Parser, Refused, complain, shown
from .files import Outputs, make_folder, write_whole
from .reading import add_reading_options, base_of, print_read, print_section, read
from .records import TOPICS, Missing
from .report import csv_text, read_columns
from .series import Series

SECTIONS = ("alignment", "path", "odometry", "slip", "switches", "energy", "spectrum",
            "efficiency")  # modules of analysis/


def analyse(path, base, desired, arguments, tables, plots):
    """Returns the bag's part of --html."""
    bag, record = read(path, base, arguments)
    if not record.series:
        below = f" with --namespace {shown(arguments.namespace)}" if arguments.namespace else ""
        reasons = [bag.problem] * bool(bag.problem) + record.notes + list(map(str, record.unusable.values()))
        raise Refused(f"{shown(path)}: no topic of a base{below}: must have one of {', '.join(TOPICS)}; "
                      f"{'; '.join(reasons) or 'it has ' + bag.shown_topics()}")
    if bag.problem:
        complain("analyse", "warning: " + bag.problem)
    if desired:
        record.series["desired"] = desired
    lines_read = print_read(bag, record)
    sections, missing = [], []
    for name in arguments.only:
        try:
            section = importlib.import_module(f".analysis.{name}", __package__).analyse(record)
            print_section(section.title, section.lines)
            sections.append(section)
        except Missing as reason:
            missing.append((name, reason))
    if missing:
        print_section("Not computed", missing)
    if tables:
        write_all(tables, csv_files(sections), ".csv")
    pictures = png_files(sections, Path(path).name) if plots or arguments.html else {}
    if plots:
        write_all(plots, pictures, ".png")
    return page.article(Path(path).name, [("What was read", lines_read, None), *(
        (section.title, section.lines, pictures.get(section.name + ".png")) for section in sections),
        *([("Not computed", missing, None)] if missing else [])])


def csv_files(sections):
    files = {name: csv_text(columns, rows.tolist() if hasattr(rows, "tolist") else rows)
             for section in sections for name, (columns, rows) in section.tables.items()}
    numbers = [(section.name, *number) for section in sections for number in section.numbers]
    return {**files, "summary.csv": csv_text(["section", "quantity", "value", "unit"], numbers)}


def png_files(sections, name):
    files, title = {}, figures.plain(name)
    for section in filter(lambda section: section.draw, sections):
        figure = figures.new_figure(figsize=(9, 6), dpi=100, constrained_layout=True)
        figure.suptitle(f"{title}: {section.name}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a logarithmic axis without data
            section.draw(figure)
            files[section.name + ".png"] = figures.picture(figure)
    return files


def write_all(folder, files, ending):
    for name, content in files.items():
        write_whole(folder / name, content)
    print(f"{shown(folder)}: {', '.join(files) or 'nothing to write'}")
    if older := sorted(set(file_names(SECTIONS, ending)) & {path.name for path in folder.iterdir()} - set(files)):
        complain("analyse", f"warning: {shown(folder)}: from an earlier run: {', '.join(older)}")


def file_names(sections, ending):
    """Names of all files that the sections may write; alignment has only numbers, path no table."""
    tables = ["summary"] + ["contact_slip"] * ("slip" in sections) if ending == ".csv" else []
    no_file = ("alignment", "path") if ending == ".csv" else ("alignment",)
    return [name + ending for name in (*sections, *tables) if name not in no_file]


def read_desired(path):
    """The desired motion, from rows of `simulate --csv`."""
    columns = read_columns("--desired", path, ("t", "x", "y", "V_X", "V_Y", "Omega"), "rows of simulate --csv")
    if not np.isfinite(list(columns.values())).all() or not (np.diff(columns["t"]) > 0).all():
        raise Refused(f"--desired {shown(path)}: must be rows of simulate --csv: finite numbers, t rising")
    return Series(columns.pop("t"), columns)


def output_folders(arguments):
    """For each bag where its tables and plots go: the folder that is named, with several bags one in it for each."""
    if arguments.plots or arguments.html:
        try:
            import matplotlib  # noqa: F401: only whether it is there
        except ImportError:
            raise Refused(f"--{'plots' if arguments.plots else 'html'} needs the package python3-matplotlib")
    names = [Path(bag).stem for bag in arguments.bag]
    if len(set(names)) < len(names) and (arguments.csv or arguments.plots):
        raise Refused(f"{shown(next(name for name in names if names.count(name) > 1))}: two bags of this name: analyse "
                      "them one by one")
    outputs = Outputs([*arguments.bag, *filter(None, (arguments.scene, arguments.desired))])
    if arguments.html:
        outputs.claim("--html", arguments.html)
    folders = []
    for name in names:
        folders.append([folder and (Path(folder) / name if len(names) > 1 else Path(folder))
                        for folder in (arguments.csv, arguments.plots)])
        for option, folder, ending in zip(("--csv", "--plots"), folders[-1], (".csv", ".png")):
            if folder:
                make_folder(folder)
                for file in file_names(arguments.only, ending):
                    outputs.claim(option, folder / file)
    return folders


def section_names(text):
    names = text.split(",")
    if not set(names) <= set(SECTIONS):
        raise argparse.ArgumentTypeError(f"{text!r}: must be of {', '.join(SECTIONS)}, separated by commas")
    return list(dict.fromkeys(names))


def main(argv=None):
    """Returns the exit status."""
    parser = Parser("analyse", __doc__, "case1.bag", "drive.bag --only odometry,slip --csv tables --plots plots")
    parser.add_argument("bag", metavar="BAG", nargs="+")
    parser.add_argument("--csv", metavar="DIR", help="write tables there: summary.csv and one or two for each section")
    parser.add_argument("--plots", metavar="DIR", help="write PNG figures there")
    parser.add_argument("--html", metavar="FILE", help="write report and figures into one file, for any browser")
    parser.add_argument("--only", metavar="SECTION,...", type=section_names, default=list(SECTIONS),
                        help=f"only these sections of {', '.join(SECTIONS)}")
    parser.add_argument("--desired", metavar="FILE.csv", help="the desired motion: rows of simulate --csv, with "
                        "--model no_slip for the paper's cases")
    parser.add_argument("--scene", metavar="SCENE.yaml", help="take the size of the base from section robot of this "
                        "scene; default is the youBot's: wheel_radius 0.05, half_wheelbase 0.235, half_track 0.15")
    add_reading_options(parser)
    arguments = parser.parse_args(argv)
    base = base_of(arguments)
    desired = read_desired(arguments.desired) if arguments.desired else None
    status, articles = DONE, []
    for k, (bag, folders) in enumerate(zip(arguments.bag, output_folders(arguments))):
        if k:
            print()
        try:
            articles.append(analyse(bag, base, desired, arguments, *folders))
        except (Refused, Failed) as error:
            complain("analyse", error)
            status = max(status, error.status)
    if arguments.html and articles:
        write_whole(arguments.html, page.HEAD + "".join(articles))
        print(f"{shown(arguments.html)}: report and figures")
    return status
