"""What slip odometry gains by the number of rollers: errors after 20 s on simulated drives, all parameters known but, where
said, the wheels' angles, beside kinematics fitted to another drive. Writes a table, such as docs/validation/rollers.csv.

Takes 15 s of processor time; installs and builds what it needs.
"""
import tempfile

from youbot_base_sim.command_line import Parser
from youbot_base_sim.files import Outputs, write_whole
from .builds import add_module, use_module

ROLLERS = (4, 6, 8, 10, 12, 16)


def main():
    parser = Parser("slip_by_rollers", __doc__, "rollers.csv")
    parser.add_argument("output", metavar="TABLE.csv", help="where to write the table")
    add_module(parser)
    arguments = parser.parse_args()
    Outputs([]).claim("TABLE.csv", arguments.output)
    use_module(parser, arguments)
    from youbot_base_sim.report import csv_text
    from .simulated_odometry import errors  # with what has been installed
    columns = ["rollers", *(f"{name}_{unit}" for name in ("kinematics", "slip_unknown_angles", "slip_known_angles")
                            for unit in ("mm", "mrad"))]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for rollers in ROLLERS:
            rows.append(dict(zip(columns, (rollers, *map("{:.3g}".format, errors(rollers, folder))))))
            print(", ".join(f"{name} {value}" for name, value in rows[-1].items()), flush=True)
    write_whole(arguments.output, csv_text(columns, rows, str))
