"""Fits robot and motors of a scene to bags with joint_states (with effort) and cmd_vel or velocity_command.

With --encoders it fits the robot alone, to bags with positions in joint_states and ground truth. The program
identify_tables does the same with tables, which this one makes of the bags. docs/identify.md says more.
"""
import contextlib
import math
import os
import signal
import sys
from pathlib import Path

import numpy as np

from .agreement import contradictions, factors
from .analysis import alignment, spectrum
from .bags import absolute
from .base import DRIVER_RADIUS, WHEELS, Base
from .command_line import Failed, Parser, Refused, shown
from .reading import add_reading_options, base_of, print_read, print_section, read
from .records import COMMANDS, POSE, Missing, commands_of
from .report import csv_text

FITTER = "identify_tables"
RADII, LENGTHS = (0.01, 0.2), (0.05, 2)  # m, of bases


def table_of(path, base, arguments):
    """A bag as a table of identify_tables, in CSV. Throws Refused."""
    bag, record = read(path, base, arguments, arguments.quiet)

    def refuse(reason):
        raise Refused(f"{shown(path)}: {reason}")
    if not arguments.encoders and any(absolute(topic).endswith("/torques_command") for topic in bag.types):
        refuse("has torques_command; only drives under velocity commands can be fitted")
    if record.put:
        refuse(f"{record.put}: must be one drive; `rosbag filter` cuts it")
    if not record.get("joint_states", "position", "velocity"):
        refuse(f"no positions of the wheels: {record.lack('joint_states', 'position', 'velocity')}")
    for reason in contradictions(record):
        refuse(reason)
    if not arguments.quiet:
        print_read(bag, record)
        if bag.problem:
            print("  note: " + bag.problem)
        if record.alignment:
            print_section("Ground truth, moved onto the base", alignment.analyse(record).lines)
        with contextlib.suppress(Missing):
            ripple = spectrum.analyse(record)
            print_section(ripple.title, ripple.lines)
        print(flush=True)
    return csv_text(*columns_and_rows(record, commands_of(record, lengths_of_odometry(record), COMMANDS[:2])))


def lengths_of_odometry(record):
    """The base by which the driver turns cmd_vel into rates: that of odometry, which it makes of them."""
    forward, lateral, yaw = factors(record, "odom")[0]
    driver = Base(DRIVER_RADIUS, roller_angle=45 if abs(lateral / forward - 1) > 0.05 else record.base.roller_angle)
    size = np.nanmax((forward, lateral, 0))
    radius, lengths = record.base.wheel_radius * size, record.base.half_lengths * size / yaw
    if RADII[0] < radius < RADII[1]:
        driver.wheel_radius = round(radius, 4)
    if LENGTHS[0] < lengths < LENGTHS[1]:
        driver.half_wheelbase, driver.half_track = 0, round(lengths, 3)
    return driver


def columns_and_rows(record, commands):
    """The table for identify_tables: a row for each instant of wheels, commands and poses, NaN where nothing is known."""
    joints = record.get("joint_states", "position", "velocity")
    wheels = {"phi": joints["position"], **({"dphi": joints["velocity"]} if record.has_rates else {}),
              **({"torque": np.nan_to_num(joints["effort"])} if "effort" in joints.columns else {})}
    blocks = [(joints.t, [f"{name}_{wheel}" for name in wheels for wheel in WHEELS], np.hstack(list(wheels.values()))),
              (commands[0], ["command_" + wheel for wheel in WHEELS], commands[1])]
    if record.poses:
        poses = record.poses.known(*POSE[:3])
        blocks.append((poses.t, list(POSE[:3]), np.stack([poses[name] for name in POSE[:3]], -1)))
    t = np.concatenate([block[0] for block in blocks])
    columns = [name for block in blocks for name in block[1]]
    table = np.full((len(t), len(columns)), np.nan)
    row = column = 0
    for times, names, values in blocks:
        table[row:row + len(times), column:column + len(names)] = values
        row, column = row + len(times), column + len(names)
    order = np.argsort(t, kind="stable")
    return ["t", *columns], np.column_stack([t, table])[order].tolist()


def main():
    parser = Parser("identify", __doc__, "drive.bag --output fitted.yaml",
                    "first.bag second.bag --scene my_scene.yaml --csv comparison.csv",
                    "drive.bag --encoders --scene my_scene.yaml --ticks 2880 --output fitted.yaml",
                    epilog="Exit status: 0 done, 2 rejected input, 1 the fit could not be completed.")
    parser.add_argument("bag", metavar="BAG", nargs="+")
    parser.add_argument("--scene", metavar="START.yaml",
                        help="robot, floor and motors to start from; left out: the profile `measured`")
    parser.add_argument("-o", "--output", metavar="FITTED.yaml",
                        help="write the fitted scene, and beside it the commands as FITTED.csv")
    parser.add_argument("--csv", metavar="FILE", help="write the first bag's motion, recorded and fitted, for "
                        "scripts/plot_identification")
    add_reading_options(parser)
    parser.add_argument("--encoders", action="store_true",
                        help="fit robot, clocks and initial wheel angles to positions and ground truth alone")
    parser.add_argument("--unknown-angles", action="store_true", help="with --encoders: average over all wheel angles, "
                        "for slip_odometry without ~angles_at_zero")
    parser.add_argument("--quiet", action="store_true", help="print nothing but errors")
    arguments = parser.parse_args()
    fitter = fitter_beside(Path(sys.argv[0]).resolve().parent)

    def stop(number, _):
        raise Failed(f"stopped by signal {number}, {signal.strsignal(number)}")
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, stop)
    base = base_of(arguments)
    options = [text for name in ("scene", "output", "csv") if getattr(arguments, name)
               for text in (f"--{name}", getattr(arguments, name))]
    options += [f"--{name.replace('_', '-')}" for name in ("encoders", "unknown_angles", "quiet")
                if getattr(arguments, name)]
    if arguments.ticks != 2 * math.pi:
        options += ["--ticks", repr(arguments.ticks)]
    for path in arguments.bag:
        # In memory, under a name that the fitter inherits: nothing is left behind, and no folder is full.
        table = os.memfd_create("table", 0)
        with open(table, "w", closefd=False) as file:
            file.write(table_of(path, base, arguments))
        options += ["--name", path, f"/dev/fd/{table}"]
    sys.stdout.flush()
    if sys.stdout.error:  # the fitter goes on, and reports it
        os.close(1)
    os.execv(fitter, ["identify", *options])


def fitter_beside(folder):
    """Throws Failed where it is not built."""
    built = Path(__file__).resolve().parents[2] / "devel" / "lib" / "youbot_base_sim"
    for place in (folder, built):
        if os.access(place / FITTER, os.X_OK):
            return place / FITTER
    raise Failed(f"{FITTER} is not built: it needs Ceres 2 (scripts/install_dependencies libceres-dev)")
