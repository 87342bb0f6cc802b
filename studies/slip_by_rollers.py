"""What slip odometry gains by the number of rollers: errors after 20 s on simulated drives, all parameters known but, where
said, the wheels' angles, beside kinematics fitted to another drive. Prints docs/validation/rollers.csv.

Takes 15 s of processor time; installs and builds what it needs.
"""
import tempfile

from youbot_base_sim.command_line import Parser
from .builds import add_module, use_module

ROLLERS = (4, 6, 8, 10, 12, 16)


def main():
    parser = Parser("slip_by_rollers", __doc__, "> rollers.csv")
    add_module(parser)
    use_module(parser, parser.parse_args())
    from .simulated_odometry import errors  # with what has been installed
    print("rollers", *(f"{name}_{unit}" for name in ("kinematics", "slip_unknown_angles", "slip_known_angles")
                       for unit in ("mm", "mrad")), sep=",")
    with tempfile.TemporaryDirectory() as folder:
        for rollers in ROLLERS:
            print(rollers, *map("{:.3g}".format, errors(rollers, folder)), sep=",", flush=True)
