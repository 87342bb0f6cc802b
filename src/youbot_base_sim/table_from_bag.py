"""Makes a velocity_table, torque_table or wheel_angle_table, for the drive of a scene, from a bag.

Without --measured the table has the commands: cmd_vel and velocity_command for a velocity table, torques_command for a
torque table. With --measured it has the velocities or efforts of joint_states, one row per message. A
wheel_angle_table has their positions, from t = 0 on.

Angular velocities are in rad/s, torques in N m, both positive forward on all four wheels. t = 0 is the start of the
bag. A wheel is at zero until its first command. A bag that is cut or has no index is read up to where it breaks, and a
warning gives that instant. A bag whose times go back, such as one of two runs, is rejected, and so is one in which
~set_state put the base elsewhere. docs/replay.md says more.
"""
from .bags import Bag
from .base import DRIVER_RADIUS, WHEELS, Base
from .command_line import Parser, Refused, complain, positive, shown
from .files import Outputs, write_whole
from .reading import add_bag_options, base_of, chosen_topics
from .records import COMMANDS, commands_of, find_topics, read_record
from .report import csv_text


def command_names(bag, chosen, namespace, field):
    """The topics of commands for a table of velocities, or of efforts. Throws Refused where the bag has the
    other kind too."""
    found = {name: topics for name, topics in find_topics(bag, chosen, chosen or COMMANDS, namespace).items() if topics}
    names = COMMANDS[:2] if field == "velocity" else COMMANDS[2:]
    others = [shown(topics[0]) for name, topics in found.items() if name not in names]
    if others and set(names) & set(found):
        raise Refused(f"{shown(bag.path)} has commands on {', '.join(others)} too: choose the topics of one table with "
                      "--topic")
    return [name for name in names if name in found] or names


def rows_of(bag, base, field, arguments):
    """Times, s, and rows of four values: commands, or "position", "velocity" or "effort" that was measured."""
    chosen = chosen_topics(bag, arguments)
    is_measured = arguments.measured or field == "position"
    names = ["joint_states"] if is_measured else command_names(bag, chosen, arguments.namespace, field)
    record = read_record(bag, base, {name: chosen[name] for name in names if name in chosen}, only=names,
                         namespace=arguments.namespace, sign=arguments.joint_velocity_sign)
    columns = (field,) if is_measured else ()
    if not any(record.get(name, *columns) for name in names):
        raise Refused(f"{shown(bag.path)}: {'; '.join(record.lack(name, *columns) for name in names)}; it has "
                      f"{bag.shown_topics()}" + ". For a bag without commands, use --measured" * (not is_measured))
    if record.put:
        raise Refused(f"{shown(bag.path)}: {record.put}: must be one run")
    if is_measured and field != "position" and not record.has_sign:
        raise Refused(f"{shown(bag.path)}: the sign of the velocities cannot be found from the positions; give "
                      "--joint-velocity-sign")
    for note in record.notes:
        complain("table_from_bag", f"warning: {shown(bag.path)}: {note}")
    if not is_measured:
        driver = Base(wheel_radius=arguments.wheel_radius, half_wheelbase=arguments.half_lengths, half_track=0)
        return commands_of(record, driver, names)
    states = record.need("joint_states", field)
    return states.t - (states.t[0] if field == "position" else 0), states[field]


def write(path, t, values):
    """Keeps the last of rows with equal times."""
    last = {f"{time:.9f}": row for time, row in zip(t.tolist(), values.tolist())}
    cells = ([time, *(value + 0.0 for value in row)] for time, row in last.items())  # no -0.0
    write_whole(path, csv_text(["t", *WHEELS], cells))
    print(f"{shown(path)}: {len(last)} rows from {t[0]:.3f} to {t[-1]:.3f} s")


def main():
    parser = Parser("table_from_bag", __doc__, "drive.bag --velocity commands.csv",
                    "drive.bag --measured --velocity velocities.csv --torque torques.csv")
    parser.add_argument("bag", metavar="BAG")
    parser.add_argument("--velocity", metavar="FILE", help="velocity table to write")
    parser.add_argument("--torque", metavar="FILE", help="torque table to write")
    parser.add_argument("--angles", metavar="FILE", help="wheel_angle_table to write; not with the others")
    add_bag_options(parser)
    parser.add_argument("--measured", action="store_true", help="what the wheels did, instead of the commands")
    parser.add_argument("--joint-velocity-sign", choices=("auto", "consistent", "driver_exact"), default="auto",
                        help="sign of measured velocities and efforts: that of the positions, or, as from the real "
                             "driver, negated for fl and bl; auto (default): found from the positions")
    parser.add_argument("--wheel-radius", type=positive, default=DRIVER_RADIUS, metavar="M",
                        help="wheel radius in the driver that executed cmd_vel, m; default 0.0475, the youBot driver's")
    parser.add_argument("--half-lengths", type=positive, default=Base().half_lengths, metavar="M",
                        help="half the wheelbase plus half the track in that driver, m; default 0.385")
    arguments = parser.parse_args()
    wanted = [one for one in (("--velocity", arguments.velocity, "velocity"), ("--torque", arguments.torque, "effort"),
                              ("--angles", arguments.angles, "position")) if one[1]]
    if not wanted or (arguments.angles and len(wanted) > 1):
        parser.error("give --velocity FILE, --torque FILE or both, or --angles FILE alone")
    base, outputs = base_of(arguments), Outputs([arguments.bag])
    for option, path, _ in wanted:
        outputs.claim(option, path)
    bag = Bag(arguments.bag, arguments.clock_offset, arguments.publisher)
    tables = [rows_of(bag, base, field, arguments) for *_, field in wanted]
    if bag.problem:
        complain("table_from_bag", "warning: " + bag.problem)
    for (_, path, _), table in zip(wanted, tables):
        write(path, *table)
