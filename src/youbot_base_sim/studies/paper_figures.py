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
from . import workshop
from .builds import ROOT, simulate_of

# What the paper's figures show: a function each in drawing.py. The first four are of Case 1, the others of Case 2.
KINDS = {4: "torques", 5: "motion", 6: "velocities", 7: "spread", 8: "motion", 9: "beginning", 10: "contact"}
TITLES = {"torques": "torques of the wheels", "motion": "trajectory and heading",
          "velocities": "velocities, first half of the motion", "spread": "dependence on the wheels' initial angles",
          "beginning": "velocities in the beginning", "contact": "force and slip at the contact of the first wheel"}


def read_arguments():
    parser = Parser("paper_figures", __doc__,
                    epilog="Exit status: 0 done, 2 refused input, 1 it could not be completed.")
    parser.add_argument("scene", nargs="?", type=Path, metavar="SCENE.yaml", help="a scene of your own")
    parser.add_argument("--only", type=int, metavar="N", help="draw this figure alone")
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


class Work(workshop.Workshop):
    """The paper's figures and claims."""

    def __init__(self, simulate, folder, count):
        super().__init__("paper_figures", simulate, folder, count)
        from . import claims
        self.claims = claims
        self.cases = claims.Cases(ROOT / "config" / "scenes", self.recorder)

    def figure(self, number, study, motion, path):
        """Draws a figure, with a title that begins with that of the motion."""
        title = f"{motion}: {TITLES[KINDS[number]]}"

        def draw():
            from . import claim_figures
            return getattr(claim_figures, KINDS[number])(study, title)
        self.picture(f"figure {number}", ("figure", study.scene.key(), number, title), draw, path)

    def row(self, number):
        """That row of the table of claims."""
        scenes = [study.scene.key() for study in (self.cases.case1, self.cases.as_printed, self.cases.case2)]
        return self.cells(f"claim {number}", ("claim", number, *scenes),
                          lambda: self.claims.row(number, self.claims.CLAIMS[number - 1].measure(self.cases)))


def draw_scene(work, arguments):
    from .runs import Scene
    study = work.claims.Study(Scene(arguments.scene), work.recorder)
    work.recorder.check(study.scene)
    name = study.scene.name
    output = arguments.output or Path(name + "_figures")
    make_folder(output)
    for number in arguments.figures:
        work.figure(number, study, name, output / f"{name}_{KINDS[number]}.png")
    return output


def draw_paper(work, arguments):
    output = arguments.output or ROOT / "docs" / "paper"
    make_folder(output)
    for number in arguments.figures:
        case, study = (1, work.cases.case1) if number < 8 else (2, work.cases.case2)
        work.figure(number, study, f"Fig. {number}. Case {case}", output / f"fig{number:02}.png")
    return output


def rows_of(arguments):
    """Numbers of the rows of the table that are measured: those of --claims, else all with the whole of docs/paper."""
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
    numbers, figures = rows_of(arguments), [] if is_table else arguments.figures
    with interruptible(workshop.INTERRUPTED), \
            Work(arguments.simulate, arguments.keep, len(figures) + len(numbers)) as work:
        output = (draw_scene if arguments.scene else draw_paper)(work, arguments) if figures else None
        rows = [work.row(number) for number in numbers]
    if output:
        print(f"{len(figures)} figure{'s' * (len(figures) > 1)}: {output}/")
    if is_table:
        print(work.claims.TABLE.text(rows), end="")
    elif rows:
        work.claims.TABLE.write(rows)
        print(f"table of {len(rows)} claims: docs/paper.md")
