"""Drift of wheel odometry on simulated bases with the measured profile, as a Markdown table: the driver's, calibrated
kinematics and slip_odometry. Each is fitted to one drive of two minutes and tried on another of ten. Takes some minutes of
processor time a base; builds what it needs in build/bench/ and installs Ceres if it is missing.
"""
import argparse
import subprocess

from youbot_base_sim.command_line import Parser
from .builds import build


def count(text):
    """The type of both options."""
    if not (text.isdecimal() and 1 <= int(text) < 10000):
        raise argparse.ArgumentTypeError(f"{text!r}: must be a whole number from 1 to 9999")
    return int(text)


def main():
    parser = Parser("odometry_twin", __doc__, "", "--seed 7 --bases 3")
    parser.add_argument("--seed", type=count, default=1, metavar="N", help="of the first base; default: 1")
    parser.add_argument("--bases", type=count, default=3, metavar="N", help="how many; default: 3")
    arguments = parser.parse_args()
    program, = build("odometry_twin", packages=("libceres-dev",))
    subprocess.run([program, str(arguments.seed), str(arguments.bases)], check=True)
