"""What the benchmark scripts share: the folder, the command line, and the programs that they build."""

import argparse
import os
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
REFUSED = 2


class Parser(argparse.ArgumentParser):
    """Refuses bad input in one line."""

    def __init__(self, **options):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **options)

    def error(self, message):
        self.exit(REFUSED, f"{self.prog}: {message}; see {self.prog} --help\n")


def run_quietly(command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{shlex.join(map(str, command))} failed\n{done.stdout}")


def build(*targets, packages=(), ros=False):
    """Builds programs in build/bench/, or with ROS, if it is there, in build/bench_ros/, and returns their paths.
    Installs Debian packages first, if they are missing; CMAKE_ARGUMENTS go to cmake's configure step."""
    if packages:
        subprocess.run([ROOT / "scripts" / "install_dependencies", *packages], check=True)
    folder = ROOT / "build" / ("bench_ros" if ros else "bench")
    print("building (some minutes the first time)", file=sys.stderr, flush=True)
    options = ["-DCATKIN_ENABLE_TESTING=OFF"] if ros else ["-DYOUBOT_BASE_SIM_ROS=OFF", "-DBUILD_TESTING=OFF"]
    run_quietly(["cmake", "-S", ROOT, "-B", folder, "-DYOUBOT_BASE_SIM_BENCH=ON", *options,
                 *shlex.split(os.environ.get("CMAKE_ARGUMENTS", ""))])
    run_quietly(["cmake", "--build", folder, "-j", str(os.cpu_count()), "--target", *targets])
    # With catkin programs are built into its devel space.
    places = [folder / "devel" / "lib" / "youbot_base_sim", folder, folder / "bench"]
    return [next(place / name for place in places if (place / name).is_file()) for name in targets]
