"""Runs each listing of all pages as printed, from a fresh shell with the devel space sourced. A listing that cannot run
says why in a comment above it: <!-- not run: needs a robot -->. What one presupposes may stand there likewise and runs
before it: <!-- with: roslaunch youbot_base_sim base.launch -->.

A listing whose first line is a comment with a file's name is written to that file, which another one must use. One that
begins with a tag is part of a launch file, which roslaunch must accept. All others are commands, as are those of ROS in a
table. Each section of a page has its own ROS master and folder, in which the names of the repository's root lead there; its
listings run in order. roslaunch and `rostopic pub -r` run beside the commands that follow, until the listing ends.

Usage: listings_test.py DEVEL [NAME]      the devel space; only sections in whose name NAME is, such as howto.md
"""
import concurrent.futures
import os
import random
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EQUATIONS = ("docs/method.md", "docs/model.md")  # all of their listings
PAGES = sorted(str(path.relative_to(ROOT)) for path in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")))
NOT_RUN = re.compile(r"<!-- not run: \w.* -->")
WITH = re.compile(r"<!-- with: (.*) -->")
COMMAND = re.compile(r"`(ros(?:topic|node|service|param) [^`]+)`")  # in tables
FILE_NAME = re.compile(r"(?:#|<!--) ([\w-]+\.\w+)\b")
FAILURE = re.compile(r"Traceback|has died|Exception|\[(ERROR|FATAL)\]")
TIMEOUT = 100  # s, of a section, on a busy machine

# Commands that run until they are stopped, and how to know that they are up.
LASTING = {"roslaunch ": "rostopic list | grep -q odom", "rostopic pub -r": "rosnode list | grep -q rostopic"}
SHELL = """set -em
await() {{ while kill -0 $! && ! eval "$1"; do sleep 0.3; done 2>/dev/null; }}
trap 'for job in $(jobs -p); do kill -INT -- -$job || :; done 2>/dev/null; wait' EXIT
source {}/setup.bash
"""


def read_listings(page):
    """Pairs of a section's name and its listings, each with the line above it."""
    sections, listing, above, fenced = {}, [], "", False
    section = sections.setdefault(page, [])
    for line in [*(ROOT / page).read_text().split("\n"), "end"]:
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    ") or (listing and not line):
            listing.append(line if fenced else line[4:])
        elif line.startswith("|"):
            listing += COMMAND.findall(line)
        elif line:
            if listing:
                section.append(("\n".join(listing).strip() + "\n", above))
                listing = []
            above = line
            if line.startswith("## "):
                section = sections.setdefault(f"{page}, {line[3:]}", [])
    return sections.items()


def as_script(listing):
    """The listing as a script for bash: commands that last are put beside the others."""
    lines = []
    for line in listing.replace("\\\n", "").splitlines():
        condition = next((LASTING[start] for start in LASTING if line.startswith(start)), None)
        lines.append(f"{{ {line.partition('  #')[0]}; }} & await {condition!r}" if condition else line)
    return "\n".join(lines)


def run_section(name, section, folder):
    """What failed in a section, a text for each listing."""
    port = random.randrange(12000, 32000)  # below the ports that connections get
    environment = {"HOME": folder, "PATH": f"{os.path.dirname(sys.executable)}:/usr/bin:/bin",
                   "ROS_HOSTNAME": "localhost", "ROS_MASTER_URI": f"http://localhost:{port}"}
    if sys.version_info[:2] == (3, 9):
        environment["PYTHONPATH"] = str(ROOT / "test" / "debian_11")
    for path in ROOT.iterdir():
        (Path(folder) / path.name).symlink_to(path)
    for i, (listing, above) in enumerate(section):
        if NOT_RUN.fullmatch(above.strip()):
            continue
        file = FILE_NAME.match(listing)
        if file:
            (Path(folder) / file[1]).write_text(listing)
            if not any(file[1] in other for other, _ in section[:i] + section[i + 1:]):
                yield f"{name}: no listing uses {file[1]}"
            continue
        if listing.startswith("<"):
            (Path(folder) / "part.launch").write_text(f"<launch>{listing}</launch>")
            listing = "roslaunch --nodes part.launch\n"
        presupposed = WITH.fullmatch(above.strip())
        command = SHELL.format(DEVEL) + as_script((presupposed[1] + "\n" if presupposed else "") + listing)
        with subprocess.Popen(["bash", "-c", command], cwd=folder, env=environment, stdin=subprocess.DEVNULL, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True) as shell:
            try:
                output, _ = shell.communicate(timeout=TIMEOUT)
            except subprocess.TimeoutExpired:
                shell.terminate()
                output = f"{shell.communicate()[0]}\nno end after {TIMEOUT} s"
        if shell.returncode != 0 or FAILURE.search(output):
            yield f"{name}: this listing failed with status {shell.returncode}:\n{listing}\n{output}"


class ListingsTest(unittest.TestCase):
    def test_each_runs_as_printed(self):
        def run(section):
            with tempfile.TemporaryDirectory() as folder:
                return list(run_section(*section, folder))

        sections = [section for page in PAGES if page not in EQUATIONS
                    for section in read_listings(page) if section[1] and ONLY in section[0]]
        with concurrent.futures.ThreadPoolExecutor(3) as pool:
            failures = [failure for failed in pool.map(run, sections) for failure in failed]
        if failures:
            self.fail("\n".join(failures))


if __name__ == "__main__":
    ONLY = sys.argv.pop(2) if len(sys.argv) > 2 else ""
    DEVEL = Path(sys.argv.pop(1)).resolve()
    unittest.main()
