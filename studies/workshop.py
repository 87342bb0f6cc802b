"""Figures and tables of runs of `simulate`, and the files kept of them."""
from pathlib import Path

from youbot_base_sim.command_line import Progress, complain
from youbot_base_sim.figures import picture
from youbot_base_sim.files import write_whole
from . import builds

PACKAGES = ("python3-numpy", "python3-matplotlib", "python3-rosbag", "python3-yaml")
INTERRUPTED = "interrupted; what was finished is kept"


def add_arguments(parser, folder):
    """Of all these programs; `folder`: in build/, where runs and figures are kept."""
    builds.add_simulate(parser)
    parser.add_argument("--keep", type=Path, default=builds.ROOT / "build" / folder, metavar="FOLDER",
                        help=f"where runs and figures are kept; build/{folder} unless given")


class Workshop:
    """Makes `count` figures and rows with one `simulate`, or takes kept ones. A context: prints the runs' warnings."""

    def __init__(self, name, simulate, folder, count):
        from .runs import Kept, Recorder  # with what has been installed
        self.name, self.progress, self.done, self.part = name, Progress(count), 0, ""
        self.kept = Kept(folder, simulate)
        self.recorder = Recorder(simulate, self.kept, self.report)
        files = *Path(__file__).parent.glob("*.py"), *(builds.ROOT / "src").rglob("*.py")
        self.sources = [file.read_text() for file in sorted(files)]

    def report(self, run, runs):
        self.progress.show(self.done + run / runs, f"{self.part}, run {run} of {runs}")

    def make(self, what, key, ending, make):
        """The file that make(path) writes; `key`: all that it depends on but the sources."""
        self.part = what
        self.progress.show(self.done, what)
        made = self.kept.file(self.kept.key(*key, *self.sources) + ending, make)
        self.done += 1
        return made

    def picture(self, what, key, draw, path):
        """Writes the figure that draw() returns."""
        kept = self.make(what, key, ".png", lambda file: file.write_bytes(picture(draw(), dpi=110)))
        write_whole(path, kept.read_bytes())

    def cells(self, what, key, measure):
        """A row of a table, the texts that measure() returns."""
        return self.make(what, key, ".row", lambda file: file.write_text("\n".join(measure()))).read_text().split("\n")

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.progress.__exit__(*error)
        for warning in self.recorder.warnings:
            complain(self.name, warning)
