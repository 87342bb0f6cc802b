"""Drift of wheel odometry on simulated bases with the measured profile, as a Markdown table: the driver's, calibrated
kinematics and slip_odometry. Each is fitted to one drive of two minutes and tried on another of ten. Takes some minutes of
processor time a base; builds what it needs in build/bench/ and installs Ceres if it is missing.
"""
import subprocess

from youbot_base_sim.command_line import Parser
from .builds import build


def main():
    parser = Parser("odometry_twin", __doc__, "", "--seed 7 --bases 3")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the first base; default: 1")
    parser.add_argument("--bases", type=int, default=3, metavar="N", help="how many; default: 3")
    arguments = parser.parse_args()
    program, = build("odometry_twin", packages=("libceres-dev",))
    subprocess.run([program, str(arguments.seed), str(arguments.bases)], check=True)
