"""The source tree of this package, and the programs that are built from it."""
import hashlib
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

from youbot_base_sim.command_line import Failed

ROOT = Path(__file__).resolve().parents[1]
SIMULATE = ROOT / "devel" / "lib" / "youbot_base_sim" / "simulate"


def install(*packages):
    """Installs Debian packages, if they are missing."""
    subprocess.run([ROOT / "scripts" / "install_dependencies", *packages], check=True)


def run_quietly(command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise Failed(f"{shlex.join(map(str, command))} failed\n{done.stdout}")


def build(*targets, packages=(), ros=False):
    """Installs packages, builds programs in build/bench/ or, with ROS, build/bench_ros/, and returns their paths.
    CMAKE_ARGUMENTS go to cmake's configure step."""
    if packages:
        install(*packages)
    folder = ROOT / "build" / ("bench_ros" if ros else "bench")
    print("building (some minutes the first time)", file=sys.stderr, flush=True)
    options = ["-DCATKIN_ENABLE_TESTING=OFF"] if ros else ["-DYOUBOT_BASE_SIM_ROS=OFF", "-DBUILD_TESTING=OFF"]
    run_quietly(["cmake", "-S", ROOT, "-B", folder, "-DYOUBOT_BASE_SIM_STUDIES=ON", *options,
                 *shlex.split(os.environ.get("CMAKE_ARGUMENTS", ""))])
    run_quietly(["cmake", "--build", folder, "-j", str(os.cpu_count()), "--target", *targets])
    # With catkin programs are built into its devel space.
    places = [folder / "devel" / "lib" / "youbot_base_sim", folder, folder / "studies" / "bench"]
    return [next(place / name for place in places if (place / name).is_file()) for name in targets]


def add_simulate(parser):
    parser.add_argument("--simulate", type=Path, metavar="FILE",
                        help="run this program rather than build it, and install nothing")


def simulate_of(parser, arguments, packages):
    """The program that is given, or the devel space's, for which it installs the packages and builds."""
    if arguments.simulate:
        if not arguments.simulate.is_file():
            parser.error(f"--simulate {arguments.simulate}: must be a program")
        return arguments.simulate
    install(*packages)
    if SIMULATE.exists() and (ROOT / "build" / "CMakeCache.txt").exists():
        run_quietly(["cmake", "-DYOUBOT_BASE_SIM_ROS=ON", ROOT / "build"])  # it may have been without, after ROS
        run_quietly(["cmake", "--build", ROOT / "build", "--target", "simulate"])
    else:
        subprocess.run([ROOT / "scripts" / "build"], check=True)
    return SIMULATE


def digest(program):
    """A hash of the program and of this package's libraries that it loads, which distinguishes builds."""
    loaded = subprocess.run(["ldd", program], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout
    files = [program, *re.findall(r"=> (\S*libyoubot_base_sim\S*)", loaded)]
    return hashlib.sha256(b"".join(Path(file).read_bytes() for file in files)).hexdigest()
