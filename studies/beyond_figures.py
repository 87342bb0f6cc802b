"""Shows what the physics beyond the paper does to motions: runs scenes of config/scenes with and without each feature,
draws a figure of each in docs/beyond/ and writes docs/beyond/effects.md. Installs and builds what it needs.
"""
from pathlib import Path

from youbot_base_sim.command_line import Parser
from youbot_base_sim.figures import save
from youbot_base_sim.files import make_folder
from .builds import ROOT, add_module, use_module
from .pages import table


def main():
    parser = Parser("beyond_figures", __doc__, "", "-o figures")
    parser.add_argument("-o", "--output", type=Path, metavar="FOLDER", help="draw here, and leave docs/ alone")
    add_module(parser)
    arguments = parser.parse_args()
    use_module(parser, arguments)
    from . import effect_figures  # with what has been installed
    from .effects import COLUMNS, EFFECTS, PAGE
    output, rows = arguments.output or ROOT / "docs" / "beyond", []
    make_folder(output)
    for effect in EFFECTS:
        motions = effect.motions()
        figure = effect_figures.draw(effect.name, motions, f"{effect.scene}.yaml: {effect.what}")
        save(figure, output / f"{effect.name}.png", dpi=110)
        rows.append(effect.row(effect.measure(motions)))
    print(f"{len(rows)} figures: {output}/")
    if not arguments.output:
        PAGE.write(table(COLUMNS, rows))
        print(f"table of {len(rows)} effects: {PAGE.page}")
