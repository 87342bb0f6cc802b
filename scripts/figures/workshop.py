"""What the scripts that make figures from runs of `simulate` share: the program, the runs, and what is kept of them."""

import shutil
import signal
import subprocess
import sys
from pathlib import Path

from program import ROOT, run_quietly

SIMULATE = ROOT / "devel" / "lib" / "youbot_base_sim" / "simulate"
PACKAGES = ("python3-numpy", "python3-matplotlib", "python3-rosbag", "python3-yaml")
NOT_COMPLETED = 1  # exit status


def add_arguments(parser, folder):
    """Of all these scripts; `folder`: in build/, where runs and figures are kept."""
    parser.add_argument("--simulate", type=Path, metavar="FILE",
                        help="run this program rather than build it, and install nothing")
    parser.add_argument("--keep", type=Path, default=ROOT / "build" / folder, metavar="FOLDER",
                        help=f"where runs and figures are kept; build/{folder} unless given")


def simulate_of(parser, arguments):
    """The program to run: the one that is given, or one that is built."""
    if not arguments.simulate:
        return built_simulate()
    if not arguments.simulate.is_file():
        parser.error(f"--simulate {arguments.simulate}: must be a program")
    return arguments.simulate


def built_simulate():
    subprocess.run([ROOT / "scripts" / "install_dependencies", *PACKAGES], check=True)
    if SIMULATE.exists() and (ROOT / "build" / "CMakeCache.txt").exists():
        run_quietly(["cmake", "--build", ROOT / "build", "--target", "simulate"])
    else:
        subprocess.run([ROOT / "scripts" / "build"], check=True)
    return SIMULATE


class Progress:
    """A bar on the terminal: of so many items, each perhaps with runs of its own."""

    WIDTH = 40

    def __init__(self, count):
        self.count, self.done, self.name = count, 0, ""
        self.shown = sys.stderr.isatty()

    def begin(self, name):
        self.name = name
        self.show()

    def show(self, run=0, runs=0):
        if self.shown:
            filled = int(self.WIDTH * (self.done + (run / runs if runs else 0)) / self.count)
            part = f", run {run} of {runs}" if runs else ""
            print(f"\r\033[K[{'#' * filled:{self.WIDTH}}] {self.name}{part}", end="", file=sys.stderr, flush=True)

    def end(self):
        self.done += 1
        if self.shown and self.done == self.count:
            self.clear()

    def clear(self):
        if self.shown:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


class Workshop:
    """Draws and measures with one `simulate`; what was drawn and measured before is taken from where it is kept.
    `sources`: the folder of what it depends on besides the modules here; `count`: of figures and findings."""

    def __init__(self, simulate, folder, sources, count):
        import recording  # with what has been installed
        self.progress = Progress(count)
        self.kept = recording.Kept(folder, simulate)
        self.recorder = recording.Recorder(simulate, self.kept, self.progress.show)
        self.sources = [file.read_text() for where in (sources, Path(__file__).parent)
                        for file in sorted(where.glob("*.py"))]

    def picture(self, what, key, draw, name, extensions):
        """Writes NAME.png and the like, of the figure that draw() returns; `key`: all it depends on but the sources."""
        self.progress.begin(what)

        def make(folder):
            import style  # takes a second
            folder.mkdir()
            style.save(draw(), folder / "figure")
        made = self.kept.file("figure-" + self.kept.key(*key, *self.sources), make)
        for extension in extensions:
            part = Path(f"{name}.{extension}.part")
            shutil.copyfile(made / f"figure.{extension}", part)
            part.replace(f"{name}.{extension}")
        self.progress.end()

    def cells(self, what, key, measure):
        """A row of a table, the texts that measure() returns; `key` likewise."""
        self.progress.begin(what)
        made = self.kept.file("row-" + self.kept.key(*key, *self.sources),
                              lambda file: file.write_text("\n".join(measure())))
        self.progress.end()
        return made.read_text().split("\n")

    def finish(self, name):
        """Clears the bar and tells the warnings of runs."""
        self.progress.clear()
        for warning in self.recorder.warnings:
            print(f"{name}: {warning}", file=sys.stderr)


def run_script(name, run):
    """Exit status of run(), with the reason in one line where it fails."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return run()
    except KeyboardInterrupt:
        reason, status = "interrupted; what was finished is kept", NOT_COMPLETED
    except (RuntimeError, OSError, subprocess.CalledProcessError) as error:
        reason, status = str(error), getattr(error, "status", NOT_COMPLETED)
    print(f"{name}: {reason}", file=sys.stderr)
    return status
