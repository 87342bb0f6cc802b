"""The common part of the programs that read bags: options that say which base, topics and ground truth, and the report
of what was read."""
import argparse
import contextlib
import math
from pathlib import Path

import numpy as np

from .bags import Bag, absolute
from .base import Base
from .command_line import Progress, Refused, one_line, positive, quoted, shown
from .files import read_whole
from .records import LARGEST, TOPICS, read_record

LARGEST_SCENE = 1000000  # bytes, as simulate reads
ALLOWED = {"rollers_per_wheel": ("a whole number from 3 to 255", lambda value: 3 <= value <= 255 and value % 1 == 0),
           "roller_angle": ("a number between -90 and 90, but 0, or four of these", lambda value: 0 < abs(value) < 90)}
LENGTHS = "a number from 0.001 to 1000", lambda value: 1e-3 <= value <= 1e3  # m; all as simulate allows
SHORTEST_LEVER = 1e-3  # m


def joint_names(text):
    """Names of the joints, and whether each turns forward (1) or backward (-1)."""
    names = text.split(",")
    if len({name.lstrip("-") for name in names} - {""}) != 4 or len(names) != 4:
        raise argparse.ArgumentTypeError(f"{text!r}: must be four joints, fl, fr, bl and br, separated by commas; with "
                                         "-NAME for one that counts backward")
    return tuple(name.lstrip("-") for name in names), tuple(-1 if name.startswith("-") else 1 for name in names)


def add_bag_options(parser):
    """Adds the options of each program that reads bags."""
    parser.add_argument("--namespace", metavar="NAME",
                        help="of several robots in a bag, the one with this namespace; left out: the shortest names")
    parser.add_argument("--topic", metavar="[NAME=]TOPIC", action="append", default=[],
                        type=pair_of(f"NAME=TOPIC, NAME of {', '.join(TOPICS)}", str, TOPICS),
                        help="read this topic instead of the usual one; may be repeated; NAME, if its type leaves a "
                             f"choice, of {', '.join(TOPICS)}")
    parser.add_argument("--joints", metavar="FL,FR,BL,BR", type=joint_names, default=(Base.joints, Base.turns),
                        help="joints of the wheels in joint_states; -NAME counts backward: --joints=-a,b,-c,d")
    parser.add_argument("--ticks", metavar="N", type=positive, default=2 * math.pi,
                        help="positions in joint_states are encoder ticks, N per turn of the wheel; default: rad")
    parser.add_argument("--clock-offset", metavar="TOPIC=S", action="append", default=[],
                        type=pair_of(f"TOPIC=S, S a number of seconds up to {LARGEST:g}", finite),
                        help="add S, in s, to the times of this topic, whose clock is off; may be repeated")
    parser.add_argument("--publisher", metavar="TOPIC=NODE", action="append", default=[],
                        type=pair_of("TOPIC=NODE", absolute),
                        help="where several nodes publish a topic, read the messages of this one; may be repeated")


def add_reading_options(parser):
    parser.add_argument("--truth", choices=("base", "marker"), help="whose pose ground truth is: the base's own at the "
                        "bag's clock, or a marker's, whose offset and clock are estimated; default: base for "
                        "nav_msgs/Odometry and --frames, else marker")
    parser.add_argument("--frames", metavar="FIXED,BODY", type=two_frames, default=(),
                        help="ground truth from the transforms between these frames in /tf and /tf_static")
    add_bag_options(parser)


def read(path, base, arguments, is_quiet=False):
    """The Bag, and its Record as these options say."""
    bag = Bag(path, arguments.clock_offset, arguments.publisher)
    with Progress(sum(bag.counts.values()), is_quiet) as progress:
        return bag, read_record(bag, base, chosen_topics(bag, arguments), namespace=arguments.namespace,
                                progress=lambda n: n % 256 or progress.show(n, Path(path).name),
                                frames=arguments.frames, of_marker=arguments.truth and arguments.truth == "marker")


def chosen_topics(bag, arguments):
    """{name: topic} of --topic; a topic without a name has the first one that its type may have."""
    chosen, types = {}, {absolute(topic): kind for topic, kind in bag.types.items()}
    for name, topic in arguments.topic:
        names = [name] if name else [one for one in TOPICS if types.get(absolute(topic)) in TOPICS[one].kinds]
        if not names:
            raise Refused(f"{shown(bag.path)}: --topic {shown(topic)}: must be a topic of a base; it has "
                          f"{bag.shown_topics()}")
        chosen[names[0]] = topic
    return chosen


def base_of(arguments):
    """The base of --joints, --ticks and, in programs that have it, --scene."""
    base = read_base(arguments.scene) if getattr(arguments, "scene", None) else Base()
    base.joints, signs = arguments.joints
    base.turns = tuple(sign * 2 * math.pi / arguments.ticks for sign in signs)
    return base


def read_base(path):
    """The sizes in section `robot` of a scene. simulate checks scenes; here only what is used must be a number. Nodes
    are not made values: aliases would multiply."""
    import yaml
    try:
        root = yaml.compose(read_whole("--scene", path, LARGEST_SCENE, "a scene").decode("utf-8-sig"), yaml.SafeLoader)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise Refused(f"--scene {shown(path)} is not YAML: {one_line(error)}")
    robot = entries_of(root, path).get("robot")
    given = entries_of(robot, path) if robot and not robot.tag.endswith(":null") else {}
    base = Base()
    for key, default in list(vars(base).items())[:6]:  # the numbers
        node = given.get(key, yaml.ScalarNode("", str(default)))
        of_wheels = key == "roller_angle" and isinstance(node, yaml.SequenceNode) and len(node.value) == 4
        values = [math.nan]
        with contextlib.suppress(TypeError, ValueError):  # a list or map, or text
            values = [float(one.value) for one in (node.value if of_wheels else [node])]
        what, is_allowed = ALLOWED.get(key, LENGTHS)
        if not all(map(is_allowed, values)):
            text = quoted(node.value) if isinstance(node.value, str) else "a list or map"
            raise Refused(f"--scene {shown(path)}: robot.{key} is {text}: must be {what}")
        setattr(base, key, tuple(values) if of_wheels else type(default)(values[0]))
    columns = base.wheel_radius * base.rates_by_velocity()
    sizes = np.abs(columns).max(axis=0)
    if sizes[2] * np.prod(np.linalg.svd(columns / np.maximum(sizes, 1e-12))[1]) / 8 < SHORTEST_LEVER:
        raise Refused(f"--scene {shown(path)}: robot.roller_angle: must be such that the wheels' rates decide V_X, V_Y "
                      "and Omega")
    return base


def entries_of(node, path):
    """{key: node} of a map. Throws Refused for another node."""
    import yaml
    if not isinstance(node, yaml.MappingNode):
        raise Refused(f"--scene {shown(path)}: must be a scene: a map of keys")
    entries = {key.value: value for key, value in node.value if isinstance(key, yaml.ScalarNode)}
    if "<<" in entries:
        raise Refused(f"--scene {shown(path)}: has the merge key <<: must be left out")
    return entries


def two_frames(text):
    names = text.split(",")
    if len(names) != 2 or not all(names) or names[0] == names[1]:
        raise argparse.ArgumentTypeError(f"{text!r}: must be FIXED,BODY, two different frames")
    return names


def pair_of(form, read, names=()):
    """The type of an option NAME=VALUE, VALUE by `read`; if there are `names`, NAME is one, or left out with "="."""
    def pair(text):
        name, is_given, value = text.partition("=")
        if names and not is_given:
            name, value = "", text
        with contextlib.suppress(ValueError):
            if value and (name in names if names and is_given else names or name):
                return name, read(value)
        raise argparse.ArgumentTypeError(f"{text!r}: must be {form}")
    return pair


def finite(text):
    if not abs(float(text)) <= LARGEST:
        raise ValueError
    return float(text)


def print_read(bag, record):
    """Returns the lines, as those of a section."""
    end = max(series.t[-1] for series in record.series.values())
    print(f"{shown(bag.path)}: {sum(bag.counts.values())} messages, to t = {end:.3f} s")
    lines = []
    for name, topic in record.topics.items():
        series = record.series[name]
        is_regular = TOPICS[name].is_sampled and 0 < series.period < math.inf
        rate = f", {1 / series.period:.4g} Hz" if is_regular else ""
        lines.append((name, f"{shown(topic)}: {len(series)}{rate}{record.origins.get(topic, '')}"))
    lines += [("note: " + note, "") for note in record.notes]
    print_section("What was read", lines)
    return lines


def print_section(title, lines):
    print("\n" + title)
    for what, text in lines:
        print(f"  {what:28}{text}".rstrip())
