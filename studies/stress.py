"""Runs `simulate` on 302 hard motions at several tolerances and judges each run by the requirements in stress.md.
Writes to FOLDER: stress.csv with every run, stress.md with its tables, and the scenes."""
import time
from functools import partial
from pathlib import Path

from youbot_base_sim.command_line import Parser, Progress
from youbot_base_sim.files import make_folder, write_whole
from youbot_base_sim.report import csv_text
from . import stress_report, stress_runs
from .builds import ROOT, build
from .stress_cells import BASE, stress_cells


def read_arguments():
    parser = Parser("stress", __doc__, "--list", "--only nu --only load/100_kg --tolerance 1e-4",
                    epilog="Exit status: 0 all holds or is explained, 1 something does not, 2 rejected input.")
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "build" / "stress", metavar="FOLDER",
                        help="build/stress/ unless given")
    parser.add_argument("--only", action="append", default=[], metavar="GROUP[/CELL]",
                        help="run this group or cell; may be repeated")
    parser.add_argument("--tolerance", type=float, action="append", default=[], metavar="X",
                        help="relative tolerance; may be repeated; 1e-3 to 1e-10 unless given")
    parser.add_argument("--simulate", type=Path, metavar="FILE", help="run this program rather than build one")
    parser.add_argument("--list", action="store_true", help="print the names of the cells and run nothing")
    arguments = parser.parse_args()
    arguments.tolerances = arguments.tolerance or [float(f"1e-{n}") for n in range(3, 11)]
    cells = list(stress_cells())
    for name in arguments.only:
        if not any(name in (cell.group, cell.full_name) for cell in cells):
            parser.error(f"--only = {name}: must be a group or cell of --list")
    arguments.cells = [cell for cell in cells
                       if not arguments.only or {cell.group, cell.full_name}.intersection(arguments.only)]
    return arguments


def run(arguments, progress):
    """Runs all cells one after the other: parallel runs would disturb the timing."""
    make_folder(scenes := arguments.folder / "scenes")
    simulate = partial(stress_runs.run_cell, arguments.simulate or build("simulate")[0], scenes)
    start = time.monotonic()
    rows, base, group = [], {}, None
    for cell in arguments.cells:
        if cell.group != group:  # measure the base again, for the machine's speed may have changed
            base, group = {}, cell.group
        for tolerance in arguments.tolerances:
            failed = sum(row["outcome"] == "fails" for row in rows)
            progress.show(len(rows), f"{time.monotonic() - start:.0f} s, {failed} failed: {cell.full_name} at "
                          f"{tolerance:g}")
            if tolerance not in base:
                base[tolerance] = stress_runs.base_cost(simulate, BASE, tolerance)
            rows.append(stress_runs.measure(simulate, cell, tolerance, base[tolerance]))
            rows[-1].judge()
        write_whole(arguments.folder / "stress.csv", csv_text(stress_report.COLUMNS, rows, "{:.10g}".format))
    write_whole(arguments.folder / "cells.csv", stress_report.cells_csv(rows))
    stress_report.PAGE.write(stress_report.written_part(rows), arguments.folder / "stress.md")
    return rows


def main():
    arguments = read_arguments()
    if arguments.list:
        print("\n".join(cell.full_name for cell in arguments.cells))
        return 0
    with Progress(len(arguments.cells) * len(arguments.tolerances)) as progress:
        rows = run(arguments, progress)
    good = sum(row["outcome"] != "fails" for row in rows)
    print(f"{good} of {len(rows)} runs hold all requirements or are explained; see {arguments.folder}/stress.md")
    return int(good < len(rows))
