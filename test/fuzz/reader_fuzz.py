"""Reads damaged bags until the time is over: whatever is in them must yield a result or one line, never a traceback.

Usage: reader_fuzz.py SECONDS FOLDER [SEED]     keeps what breaks this promise in FOLDER; exit status 1 if anything did
"""
import contextlib
import io
import random
import resource
import sys
import tempfile
import time
import traceback
from pathlib import Path

import genpy
import rosbag
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src"))
from youbot_base_sim import analyse, command_line, table_from_bag  # noqa: E402

MEMORY, SLOWEST = 1 << 30, 20  # bytes more than at the start; s
WORDS = (b"\xff\xff\xff\xff", b"\x00\x00\x00\x00", b"\x00\x00\x00\x80", b"op=", b"float64[] x\n", b"=\n", b"\x00",
         b"[999999999]")


def seeds():
    """Bags of the topics that are read, packed in each way."""
    names = ["wheel_joint_" + wheel for wheel in ("fl", "fr", "bl", "br")]
    for compression in ("none", "bz2", "lz4"):
        with tempfile.NamedTemporaryFile(suffix=".bag") as file:
            with rosbag.Bag(file.name, "w", compression=compression, chunk_threshold=2000) as bag:
                for k in range(60):
                    stamp = genpy.Time(1700000000) + genpy.Duration.from_sec(0.02 * k)
                    for topic, message in (("/joint_states", JointState(name=names, position=[0.1 * k] * 4,
                                                                        velocity=[5] * 4, effort=[0.1] * 4)),
                                           ("/odom", Odometry()), ("/pose", PoseStamped()), ("/cmd_vel", Twist()),
                                           ("/tf", TFMessage())):
                        if hasattr(message, "header"):
                            message.header.stamp = stamp
                        bag.write(topic, message, stamp)
            yield Path(file.name).read_bytes()


def damaged(content, draw):
    content = bytearray(content)
    for _ in range(draw.choice((1, 1, 2, 5, 20))):
        at, other = draw.randrange(len(content)), draw.randrange(len(content))
        length = draw.randrange(1, 200)
        what = draw.randrange(5)
        if what == 0:
            content[at] ^= 1 << draw.randrange(8)
        elif what == 1:
            word = draw.choice(WORDS)
            content[at:at + len(word)] = word
        elif what == 2:
            content[at:at] = content[other:other + length]
        elif what == 3:
            del content[at:at + length]
        elif draw.random() < 0.2:
            del content[at + 100:]
    return bytes(content)


def broken_promise(main, name, arguments):
    """Why a run broke it; empty if it held."""
    out, err, start = io.StringIO(), io.StringIO(), time.monotonic()
    sys.argv[1:] = arguments
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = command_line.run(name, main)
    except Exception:
        return traceback.format_exc()
    lines = err.getvalue().splitlines()
    if status == command_line.REFUSED and len(lines) != 1 or not all(line.startswith(name + ": ") for line in lines):
        return f"exit status {status} with the lines\n" + "\n".join(lines)
    slow = time.monotonic() - start
    return f"took {slow:.0f} s" if slow > SLOWEST else ""


def main():
    seconds, folder, seed = float(sys.argv[1]), Path(sys.argv[2]), (sys.argv + [""])[3] or time.time_ns()
    draw, bags, end = random.Random(seed), list(seeds()), time.monotonic() + seconds
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    tried = broken = 0
    with tempfile.TemporaryDirectory() as work:
        bag, table = Path(work) / "bag.bag", Path(work) / "table.csv"
        while time.monotonic() < end:
            bag.write_bytes(content := damaged(draw.choice(bags), draw))
            tried += 1
            for program, name, arguments in (
                    (analyse.main, "analyse", [str(bag)]), (analyse.main, "analyse", [str(bag), "--frames", "a,b"]),
                    (table_from_bag.main, "table_from_bag", [str(bag), "--angles", str(table)]),
                    (table_from_bag.main, "table_from_bag", [str(bag), "--velocity", str(table)])):
                reason = broken_promise(program, name, arguments)
                if reason:
                    broken += 1
                    (folder / f"{seed}_{tried}.bag").write_bytes(content)
                    print(f"broken promise: {name} {' '.join(arguments[1:])}: {folder}/{seed}_{tried}.bag: {reason}")
    print(f"stat::number_of_executed_units: {tried}")
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main())
