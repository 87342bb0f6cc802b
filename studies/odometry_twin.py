"""Drift of wheel odometry on simulated bases with the measured profile, as a Markdown table: the driver's, calibrated
kinematics and slip_odometry. Each is fitted to one drive of two minutes and tried on another of ten. Takes some minutes of
processor time a base; installs and builds what it needs.
"""
import tempfile
from pathlib import Path

from youbot_base_sim.command_line import Parser
from .builds import add_module, build, use_module


def main():
    parser = Parser("odometry_twin", __doc__, "", "--seed 7 --bases 3")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the first base; default: 1")
    parser.add_argument("--bases", type=int, default=3, metavar="N", help="how many; default: 3")
    add_module(parser)
    arguments = parser.parse_args()
    fitter, follower = build("identify_tables", "follow_slip", packages=("libceres-dev",))
    use_module(parser, arguments)
    from .simulated_odometry import twin_table  # with what has been installed
    with tempfile.TemporaryDirectory() as folder:
        print(twin_table(range(arguments.seed, arguments.seed + arguments.bases), Path(folder), fitter, follower), end="")
