"""Records the motions of Adamov and Saipulaev's paper in bags and draws its Figs. 4 to 10 from them, as PNG.

Without a scene it draws these and one on the number of rollers in docs/paper/, and writes docs/paper/claims.md:
what the paper claims, and what was measured. With one it draws of that scene: 4 torques, 5 trajectory and heading,
6 velocities, 7 the spread over initial wheel angles, 9 velocities in the beginning, 10 force and slip at the first
wheel's contact.

Installs and builds what it needs. Runs and figures are kept in build/paper_figures/: what is there is not made again.
"""
from pathlib import Path

from youbot_base_sim.command_line import Parser, Refused
from youbot_base_sim.files import make_folder
from . import workshop
from .builds import ROOT, simulate_of
from .pages import interruptible, table

# By number: a function of claim_figures.py, and what it shows. The first four are of Case 1, the others of Case 2.
FIGURES = {4: ("torques", "torques of the wheels"), 5: ("motion", "trajectory and heading"),
           6: ("velocities", "velocities, first half of the motion"),
           7: ("spread", "dependence on the wheels' initial angles"), 8: ("motion", "trajectory and heading"),
           9: ("beginning", "velocities in the beginning"),
           10: ("contact", "force and slip at the contact of the front left wheel"),
           11: ("rollers", "wheels with more or fewer rollers (not in the paper)")}


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
    figures = [number for number in FIGURES if not arguments.scene or number not in (8, 11)]
    if arguments.only is not None and arguments.only not in figures:
        parser.error(f"--only {arguments.only}: must be {', '.join(map(str, figures[:-1]))} or {figures[-1]}")
    if arguments.claims is not None and (arguments.scene or arguments.only or arguments.output):
        parser.error("--claims: must be given without a scene, --only and -o")
    arguments.figures = [] if arguments.claims is not None else [arguments.only] if arguments.only else figures
    arguments.simulate = simulate_of(parser, arguments, workshop.PACKAGES)
    return arguments


def draw(work, arguments, cases):
    """Draws the paper's figures, or those of a scene. Returns their folder."""
    from .runs import Scene, Study
    scene = arguments.scene and Scene(arguments.scene)
    own = scene and Study(scene, work.recorder, work.recorder.models_of(scene))
    output = arguments.output or (Path(own.scene.name + "_figures") if own else ROOT / "docs" / "paper")
    make_folder(output)
    for number in arguments.figures:
        kind, shows = FIGURES[number]
        case, study = (1, cases.case1) if number < 8 else (2, cases.case2)
        file, title = f"fig{number:02}", f"Fig. {number}. Case {case}: {shows}"
        if own:
            study, file, title = own, f"{own.scene.name}_{kind}", f"{own.scene.name}: {shows}"

        def figure():
            from . import claim_figures
            return getattr(claim_figures, kind)(study, title)
        work.picture(f"figure {number}", ("figure", study.scene.key(), number, title), figure, output / f"{file}.png")
    return output


def main():
    arguments = read_arguments()
    from .claims import CLAIMS, COLUMNS, PAGE, Cases, row  # with what has been installed
    figures, numbers = arguments.figures, range(1, len(CLAIMS) + 1)
    for number in arguments.claims or ():
        if number not in numbers:
            raise Refused(f"--claims {number}: must be from 1 to {len(numbers)}")
    if arguments.claims or arguments.scene or arguments.only or arguments.output:
        numbers = arguments.claims or []
    with interruptible(workshop.INTERRUPTED), workshop.Workshop(
            "paper_figures", arguments.simulate, arguments.keep, len(figures) + len(numbers)) as work:
        cases = Cases(ROOT / "config" / "scenes", work.recorder)
        output = draw(work, arguments, cases) if figures else None
        scenes = [study.scene.key() for study in (cases.case1, cases.as_printed, cases.case2)]
        rows = [work.cells(f"claim {number}", ("claim", number, *scenes),
                           lambda: row(number, CLAIMS[number - 1].measure(cases))) for number in numbers]
    if not figures:
        return print(table(COLUMNS, rows), end="")
    print(f"{len(figures)} figure{'s' * (len(figures) > 1)}: {output}/")
    if rows:
        PAGE.write(table(COLUMNS, rows))
        print(f"table of {len(rows)} claims: {PAGE.page}")
