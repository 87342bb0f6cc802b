"""The source tree of this package, and what is built from it."""
import os
import shlex
import subprocess
import sys
from pathlib import Path

import youbot_base_sim
from youbot_base_sim.command_line import Failed

ROOT = Path(__file__).resolve().parents[1]


def run_quietly(command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise Failed(f"{shlex.join(map(str, command))} failed\n{done.stdout}")
    return done.stdout


def build(*targets, packages=(), ros=False):
    """Installs packages, builds targets in build/bench/ or, with ROS, build/bench_ros/, and returns the paths of programs."""
    if packages:
        subprocess.run([ROOT / "scripts" / "install_dependencies", *packages], check=True)
    folder = ROOT / "build" / ("bench_ros" if ros else "bench")
    print("building (some minutes the first time)", file=sys.stderr, flush=True)
    options = ["-DCATKIN_ENABLE_TESTING=OFF"] if ros else ["-DYOUBOT_BASE_SIM_ROS=OFF", "-DBUILD_TESTING=OFF"]
    run_quietly(["cmake", "-S", ROOT, "-B", folder, "-DYOUBOT_BASE_SIM_STUDIES=ON", *options])
    run_quietly(["cmake", "--build", folder, "-j", str(os.cpu_count()), "--target", *targets])
    # With catkin programs are built into its devel space.
    places = [folder / "devel" / "lib" / "youbot_base_sim", folder, folder / "studies" / "bench"]
    return [place / name for name in targets for place in places if (place / name).is_file()]


def add_module(parser):
    parser.add_argument("--module", type=Path, metavar="FOLDER",
                        help="take the simulator's Python module there rather than build it, and install nothing")


def use_module(parser, arguments):
    """Has the package find its simulator (docs/python.md): that of the folder given, or one that is built."""
    folder = arguments.module or ROOT / "build" / "bench" / "python" / "youbot_base_sim"
    if not arguments.module:
        build("youbot_base_sim_simulator", packages=("pybind11-dev", "python3-dev", "python3-numpy",
                                                     "python3-matplotlib", "python3-pil", "python3-yaml"))
    elif not (folder / "_simulator.py").is_file():
        parser.error(f"--module {folder}: must have _simulator.py")
    youbot_base_sim.__path__.append(str(folder))
