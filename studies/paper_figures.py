"""Simulates the motions of Adamov and Saipulaev's paper and draws its Figs. 4 to 10, as PNG.

Without a scene it draws these and one on the number of rollers in docs/paper/, and writes docs/paper/claims.md:
what the paper claims, and what was measured. With one it draws of that scene: 4 torques, 5 trajectory and heading,
6 velocities, 7 the spread over initial wheel angles, 9 velocities in the beginning, 10 force and slip at the first
wheel's contact.

Installs and builds what it needs.
"""
from pathlib import Path

from youbot_base_sim.command_line import Parser, Refused, complain
from youbot_base_sim.figures import save
from youbot_base_sim.files import make_folder
from .builds import ROOT, add_module, use_module
from .pages import table

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
    add_module(parser)
    arguments = parser.parse_args()
    figures = [number for number in FIGURES if not arguments.scene or number not in (8, 11)]
    if arguments.only is not None and arguments.only not in figures:
        parser.error(f"--only {arguments.only}: must be {', '.join(map(str, figures[:-1]))} or {figures[-1]}")
    if arguments.claims is not None and (arguments.scene or arguments.only or arguments.output):
        parser.error("--claims: must be given without a scene, --only and -o")
    arguments.figures = [] if arguments.claims is not None else [arguments.only] if arguments.only else figures
    use_module(parser, arguments)
    return arguments


def models_of(scene):
    """Those that take the scene: what goes beyond the paper is not for all; a warning names the others."""
    from .runs import MODELS, Motion
    models = []
    for model in MODELS:
        try:
            Motion(scene.changed(duration=min(scene.duration, 1e-3)), model)
            models.append(model)
        except ValueError as error:
            complain("paper_figures", f"without model {model}: {error}")
    return models


def draw(arguments, cases):
    """Draws the paper's figures, or those of a scene. Returns their folder."""
    from . import claim_figures
    from .runs import Scene, Study
    own = arguments.scene and Scene(arguments.scene)
    own = own and Study(own, models_of(own))
    output = arguments.output or (Path(own.scene.name + "_figures") if own else ROOT / "docs" / "paper")
    make_folder(output)
    for number in arguments.figures:
        kind, shows = FIGURES[number]
        case, study = (1, cases.case1) if number < 8 else (2, cases.case2)
        file, title = f"fig{number:02}", f"Fig. {number}. Case {case}: {shows}"
        if own:
            study, file, title = own, f"{own.scene.name}_{kind}", f"{own.scene.name}: {shows}"
        save(getattr(claim_figures, kind)(study, title), output / f"{file}.png", dpi=110)
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
    cases = Cases()
    output = draw(arguments, cases) if figures else None
    rows = [row(number, CLAIMS[number - 1].measure(cases)) for number in numbers]
    if not figures:
        return print(table(COLUMNS, rows), end="")
    print(f"{len(figures)} figure{'s' * (len(figures) > 1)}: {output}/")
    if rows:
        PAGE.write(table(COLUMNS, rows))
        print(f"table of {len(rows)} claims: {PAGE.page}")
