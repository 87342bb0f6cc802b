"""Records the motions of Adamov and Saipulaev's paper in bags and draws its Figs. 4 to 10 from them, as PNG.

Without a scene it draws the paper's figures in docs/paper/ and writes the table of docs/paper.md: what the paper
claims, and what was measured. With one it draws the same of that scene: 4 torques, 5 trajectory and heading,
6 velocities, 7 the spread over initial wheel angles, 9 velocities in the beginning, 10 force and slip at the first
wheel's contact.

Installs and builds what it needs. Runs and figures are kept in build/paper_figures/: what is there is not made again.
"""

from pathlib import Path

from ..command_line import Parser, Refused, interruptible
from ..files import make_folder
from ..report import table
from . import workshop
from .builds import ROOT, simulate_of

# What the paper's figures show: a function each in drawing.py. The first four are of Case 1, the others of Case 2.
KINDS = {4: "torques", 5: "motion", 6: "velocities", 7: "spread", 8: "motion", 9: "beginning", 10: "contact"}
TITLES = {"torques": "torques of the wheels", "motion": "trajectory and heading",
          "velocities": "velocities, first half of the motion", "spread": "dependence on the wheels' initial angles",
          "beginning": "velocities in the beginning", "contact": "force and slip at the contact of the first wheel"}


def read_arguments():
    parser = Parser("paper_figures", __doc__, "--only 8", "config/scenes/case1_as_printed.yaml -o figures")
    parser.add_argument("scene", nargs="?", type=Path, metavar="SCENE.yaml", help="a scene of your own")
    parser.add_argument("--only", type=int, metavar="N", help="draw only this figure")
    parser.add_argument("-o", "--output", type=Path, metavar="FOLDER",
                        help="draw here, and leave docs/ alone; unless given docs/paper, or NAME_figures for NAME.yaml")
    parser.add_argument("--claims", type=int, nargs="*", metavar="N",
                        help="print the table of the paper's claims, or these rows of it, and draw nothing")
    workshop.add_arguments(parser, "paper_figures")
    arguments = parser.parse_args()
    figures = [number for number in KINDS if number != 8 or not arguments.scene]
    if arguments.only is not None and arguments.only not in figures:
        parser.error(f"--only {arguments.only}: must be {', '.join(map(str, figures[:-1]))} or {figures[-1]}")
    if arguments.claims is not None and (arguments.scene or arguments.only or arguments.output):
        parser.error("--claims: must be given without a scene, --only and -o")
    arguments.figures = figures if arguments.only is None else [arguments.only]
    arguments.simulate = simulate_of(parser, arguments, workshop.PACKAGES)
    return arguments


def draw(work, arguments, cases):
    """Draws the paper's figures, or those of a scene. Returns their folder."""
    from .runs import Scene, Study
    own = arguments.scene and Study(Scene(arguments.scene), work.recorder)
    if own:
        work.recorder.check(own.scene)
    output = arguments.output or (Path(own.scene.name + "_figures") if own else ROOT / "docs" / "paper")
    make_folder(output)
    for number in arguments.figures:
        kind = KINDS[number]
        if own:
            study, motion, file = own, own.scene.name, f"{own.scene.name}_{kind}"
        else:
            case, study = (1, cases.case1) if number < 8 else (2, cases.case2)
            motion, file = f"Fig. {number}. Case {case}", f"fig{number:02}"
        title = f"{motion}: {TITLES[kind]}"
        work.picture(f"figure {number}", ("figure", study.scene.key(), number, title),
                     lambda: figure(kind, study, title), output / f"{file}.png")
    return output


def figure(kind, study, title):
    from . import claim_figures
    return getattr(claim_figures, kind)(study, title)


def rows_of(work, numbers, cases):
    """Those rows of the table of claims."""
    from .claims import CLAIMS, row
    scenes = [study.scene.key() for study in (cases.case1, cases.as_printed, cases.case2)]
    return [work.cells(f"claim {number}", ("claim", number, *scenes),
                       lambda: row(number, CLAIMS[number - 1].measure(cases))) for number in numbers]


def row_numbers(arguments):
    """Of the rows of the table that are measured: those of --claims, else all with the whole of docs/paper."""
    from .claims import CLAIMS  # with what has been installed
    everything = range(1, len(CLAIMS) + 1)
    for number in arguments.claims or ():
        if number not in everything:
            raise Refused(f"--claims {number}: must be from 1 to {len(everything)}")
    whole = not arguments.scene and arguments.only is None and arguments.output is None
    return arguments.claims or everything if whole else []


def main():
    arguments = read_arguments()
    is_table = arguments.claims is not None
    numbers, figures = row_numbers(arguments), [] if is_table else arguments.figures
    from .claims import COLUMNS, PAGE, Cases
    with interruptible(workshop.INTERRUPTED), workshop.Workshop(
            "paper_figures", arguments.simulate, arguments.keep, len(figures) + len(numbers)) as work:
        cases = Cases(ROOT / "config" / "scenes", work.recorder)
        output = draw(work, arguments, cases) if figures else None
        rows = rows_of(work, numbers, cases)
    if output:
        print(f"{len(figures)} figure{'s' * (len(figures) > 1)}: {output}/")
    if is_table:
        print(table(COLUMNS, rows), end="")
    elif rows:
        PAGE.write(table(COLUMNS, rows))
        print(f"table of {len(rows)} claims: docs/paper.md")
