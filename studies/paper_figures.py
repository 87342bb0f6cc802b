"""Simulates the motions of Adamov and Saipulaev's paper, draws its Figs. 4 to 10 and one on the number of rollers in
docs/paper/, as PNG, and writes docs/paper/claims.md: what the paper claims, and what was measured.

Installs and builds what it needs.
"""
from pathlib import Path

from youbot_base_sim.command_line import Parser
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
    parser = Parser("paper_figures", __doc__, "--only 8", "-o figures")
    parser.add_argument("--only", type=int, choices=FIGURES, help="draw only this figure")
    parser.add_argument("-o", "--output", type=Path, metavar="FOLDER", help="draw here, and leave docs/ alone")
    parser.add_argument("--claims", type=int, nargs="*", metavar="N",
                        help="print the table of the paper's claims, or these rows of it, and draw nothing")
    add_module(parser)
    arguments = parser.parse_args()
    if arguments.claims is not None and (arguments.only or arguments.output):
        parser.error("--claims: must be given without --only and -o")
    use_module(parser, arguments)
    return arguments


def main():
    arguments = read_arguments()
    from . import claim_figures  # with what has been installed
    from .claims import CLAIMS, COLUMNS, PAGE, Cases, row
    cases, all_rows = Cases(), range(1, len(CLAIMS) + 1)
    if arguments.claims is not None:
        numbers = [number for number in arguments.claims or all_rows if number in all_rows]
        return print(table(COLUMNS, [row(number, CLAIMS[number - 1].measure(cases)) for number in numbers]), end="")
    output = arguments.output or ROOT / "docs" / "paper"
    make_folder(output)
    figures = [arguments.only] if arguments.only else FIGURES
    for number in figures:
        kind, shows = FIGURES[number]
        case, study = (1, cases.case1) if number < 8 else (2, cases.case2)
        figure = getattr(claim_figures, kind)(study, f"Fig. {number}. Case {case}: {shows}")
        save(figure, output / f"fig{number:02}.png", dpi=110)
    print(f"{len(figures)} figure{'s' * (len(figures) > 1)}: {output}/")
    if not arguments.only and not arguments.output:
        PAGE.write(table(COLUMNS, [row(number, CLAIMS[number - 1].measure(cases)) for number in all_rows]))
        print(f"table of {len(CLAIMS)} claims: {PAGE.page}")
