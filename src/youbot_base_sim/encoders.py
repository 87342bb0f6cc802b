"""How a base names, signs and counts its wheels in joint_states: options of the programs that read them."""
import argparse
import math

from .base import Base
from .command_line import positive


def joint_names(text):
    """Names of the joints, and whether each turns forward (1) or backward (-1)."""
    names = text.split(",")
    if len({name.lstrip("-") for name in names} - {""}) != 4 or len(names) != 4:
        raise argparse.ArgumentTypeError(f"{text!r}: must be four joints, fl, fr, bl and br, separated by commas; with "
                                         "-NAME for one that counts backward")
    return tuple(name.lstrip("-") for name in names), tuple(-1 if name.startswith("-") else 1 for name in names)


def add_encoder_options(parser):
    parser.add_argument("--joints", metavar="FL,FR,BL,BR", type=joint_names, default=(Base.joints, Base.turns),
                        help="joints of the wheels in joint_states; -NAME counts backward: --joints=-a,b,-c,d")
    parser.add_argument("--ticks", metavar="N", type=positive, default=2 * math.pi,
                        help="positions in joint_states are encoder ticks, N per turn of the wheel; default: rad")


def encoders_of(arguments):
    """Names of the joints, and rad forward for one unit of their positions, as class Base has them."""
    joints, signs = arguments.joints
    return joints, tuple(sign * 2 * math.pi / arguments.ticks for sign in signs)
