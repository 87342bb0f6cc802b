"""Shows what the physics beyond the paper does to motions: runs scenes of config/scenes with and without each feature,
draws a figure of each in docs/beyond/ and writes docs/beyond/effects.md, in a minute.

Installs and builds what it needs. Runs and figures are kept in build/beyond_figures/: what is there is not made again.
"""
from pathlib import Path

from youbot_base_sim.command_line import Parser
from youbot_base_sim.files import make_folder
from . import workshop
from .builds import ROOT, simulate_of
from .pages import interruptible, table


def main():
    parser = Parser("beyond_figures", __doc__, "", "-o figures")
    parser.add_argument("-o", "--output", type=Path, metavar="FOLDER", help="draw here, and leave docs/ alone")
    workshop.add_arguments(parser, "beyond_figures")
    arguments = parser.parse_args()
    simulate = simulate_of(parser, arguments, workshop.PACKAGES)
    from .effects import COLUMNS, EFFECTS, PAGE  # with what has been installed
    output = arguments.output or ROOT / "docs" / "beyond"
    make_folder(output)
    with interruptible(workshop.INTERRUPTED), workshop.Workshop(
            "beyond_figures", simulate, arguments.keep, 2 * len(EFFECTS)) as work:
        rows = [make(work, effect, output) for effect in EFFECTS]
    print(f"{len(rows)} figures: {output}/")
    if not arguments.output:
        PAGE.write(table(COLUMNS, rows))
        print(f"table of {len(rows)} effects: {PAGE.page}")


def make(work, effect, output):
    """Draws the figure of an effect. Returns its row of the table."""
    key = [effect.name, *(scene.key() for scene in effect.scenes().values())]

    def draw():
        from . import effect_figures
        return effect_figures.draw(effect.name, effect.record(work.recorder), f"{effect.scene}.yaml: {effect.what}")
    work.picture(f"figure {effect.name}", ("figure", *key), draw, output / f"{effect.name}.png")
    return work.cells(f"finding {effect.name}", ("finding", *key),
                      lambda: effect.row(effect.measure(effect.record(work.recorder))))
