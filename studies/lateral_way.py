"""Lateral over forward way a turn of the wheels, k_Y/k_X, in bags with ground truth, and of the scene's base along their
wheels, averaged over where rollers stand: Markdown rows. Has the options of identify; takes a minute of processor time."""
import tempfile

from youbot_base_sim.command_line import Parser
from youbot_base_sim.reading import add_reading_options, base_of
from .builds import add_module, use_module


def main():
    parser = Parser("lateral_way", __doc__, "bag1.bag bag3.bag --scene fitted.yaml --ticks 210")
    parser.add_argument("bag", metavar="BAG", nargs="+")
    parser.add_argument("--scene", metavar="SCENE.yaml", required=True, help="such as identify writes")
    add_reading_options(parser)
    add_module(parser)
    arguments = parser.parse_args()
    base = base_of(arguments)
    use_module(parser, arguments)
    from .simulated_odometry import lateral_ways  # with what has been installed
    print("| bag | recorded, standard error | simulated |\n|---|---|---|")
    for path in arguments.bag:
        with tempfile.TemporaryDirectory() as folder:
            print("| {} | {:.4f}, {:.4f} | {:.4f} |".format(path, *lateral_ways(path, base, arguments, folder)), flush=True)
