"""Wheel odometry by kinematics and by this simulator's slip, held out against optical ground truth.

FOLDER is your clone of github.com/sousarbarb/optiodom (MIT licence). Of it the program reads
data/omni4/{circular,square}/*/*_metadata.csv and *_run-NN.csv, 116 runs of a Mecanum base on two days. Each model is
fitted to half of the runs, split within a day, by day and by figure, and predicts the other half. Takes about twelve
minutes of processor time; installs and builds what it needs.
"""
from youbot_base_sim.command_line import Parser, Refused
from youbot_base_sim.files import Outputs
from .builds import add_module, use_module


def main():
    parser = Parser("validate_odometry", __doc__, "optiodom", "optiodom --quick --figure odometry.png")
    parser.add_argument("folder", metavar="FOLDER", help="clone of the data set")
    parser.add_argument("--quick", action="store_true", help="coarser gains: 12 s of processor time")
    parser.add_argument("--figure", metavar="PLOT.png", help="draw the ratios, too")
    add_module(parser)
    arguments = parser.parse_args()
    if arguments.figure:
        Outputs([]).claim("--figure", arguments.figure)
    use_module(parser, arguments)
    from . import odometry_models as models  # with what has been installed
    from .odometry_records import read_runs
    from .slip_gains import SlipGains
    runs = read_runs(arguments.folder)
    if any(len({getattr(run, key) for run in runs}) < 2 for key in ("day", "figure")):
        raise Refused(f"FOLDER = {arguments.folder}: must have runs of two days and of both figures")
    gains = {of: SlipGains(of, *((7, 16) if arguments.quick else ())) for of in ("located", "averaged")}
    print(f"{len(runs)} runs")
    comparison = models.Comparison(runs, gains)
    for part in (comparison.ratio_table, comparison.error_table, comparison.parameter_table):
        print("\n" + part(), end="")
    if arguments.figure:
        comparison.draw(arguments.figure)
