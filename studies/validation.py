"""Repeats measurements on real bases with the simulated one: prints the tables of docs/validation.md.

Installs and builds what it needs.
"""
from youbot_base_sim.command_line import Parser
from youbot_base_sim.files import Outputs
from .builds import ROOT, add_module, use_module


def main():
    parser = Parser("validation", __doc__, "--figure torque.png", "--fit")
    parser.add_argument("--figure", metavar="PLOT.png", help="draw torque over the direction of travel, too")
    parser.add_argument("--fit", action="store_true", help="print only the friction fitted again")
    add_module(parser)
    arguments = parser.parse_args()
    if arguments.figure:
        Outputs([ROOT / "docs" / "validation" / "robot_b.csv"]).claim("--figure", arguments.figure)
    use_module(parser, arguments)
    from . import real_robots as robots  # with what has been installed
    parts = robots.torque_table, robots.rise_table, robots.ripple_of_B, robots.ripple_of_C, robots.gain_table
    for part in [robots.fit_table] if arguments.fit else parts:
        print("\n" + part(), end="")
    if arguments.figure:
        robots.draw(arguments.figure)
