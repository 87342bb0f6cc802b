"""The Python programs of scripts/ as their user meets them: --help from any folder, which installs, builds and writes
nothing; in the devel space too.

Usage: programs_test.py DEVEL      the devel space
"""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from harness import ROOT

DEVEL = None
INSTALLED = ("analyse", "identification_drive", "table_from_bag")


def programs():
    return [path for path in sorted((ROOT / "scripts").iterdir())
            if path.is_file() and path.suffix == "" and path.read_text().startswith("#!/usr/bin/python3")]


class ProgramsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        # What installs and builds, and the Python of pyenv or conda, which has no module of ROS.
        for name in ("apt-get", "dpkg-query", "sudo", "cmake", "python", "python3"):
            program = self.folder / name
            program.write_text(f"#!/bin/sh\ntouch {self.folder}/called-$(basename $0)\n")
            program.chmod(0o755)
        self.environment = {**os.environ, "PATH": f"{self.folder}:{os.environ['PATH']}"}

    def helps(self, command, name, folder):
        ran = subprocess.run(command, cwd=folder, env=self.environment, text=True, capture_output=True,
                             stdin=subprocess.DEVNULL, timeout=60)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""), command)
        self.assertIn(name, ran.stdout.split("\n")[0])
        self.assertEqual(sorted(self.folder.glob("called-*")), [], command)

    def test_there_are_some(self):
        expected = {*INSTALLED, "plot_sweep", "paper_figures", "validation"}
        self.assertLessEqual(expected, {path.name for path in programs()})

    def test_all_name_the_python_that_has_the_modules_of_ros(self):
        for path in (path for folder in ("examples", "scripts", "test") for path in (ROOT / folder).rglob("*")):
            first = path.open("rb").readline() if path.is_file() else b""
            if first.startswith(b"#!") and b"python" in first:
                self.assertEqual(first, b"#!/usr/bin/python3\n", path)

    def test_help_from_the_root_and_from_elsewhere(self):
        for program in programs():
            self.helps([sys.executable, program.relative_to(ROOT), "--help"], program.name, ROOT)
            self.helps([sys.executable, program, "--help"], program.name, self.folder)

    def test_help_in_the_devel_space(self):
        for name in INSTALLED:
            command = f"source {DEVEL}/setup.bash && rosrun youbot_base_sim {name} --help"
            self.helps(["bash", "-c", command], name, self.folder)

    def test_another_distribution_is_refused(self):
        release = self.folder / "os-release"
        release.write_text('ID=ubuntu\nVERSION_ID="20.04"\n')
        ran = subprocess.run([ROOT / "scripts" / "install_dependencies"], text=True, capture_output=True,
                             env={**self.environment, "OS_RELEASE": str(release)})
        self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (1, "", 1), ran.stderr)
        self.assertIn("this is ubuntu 20.04; must be debian 11, 12 or 13", ran.stderr)
        self.assertEqual(sorted(self.folder.glob("called-*")), [])

    def test_a_module_that_is_missing_is_named(self):
        (self.folder / "numpy.py").write_text("raise ModuleNotFoundError(name='numpy')")
        for name in ("analyse", "plot_sweep"):
            ran = subprocess.run([sys.executable, ROOT / "scripts" / name, "--help"], text=True, capture_output=True,
                                 env={**os.environ, "PYTHONPATH": str(self.folder)})
            self.assertEqual((ran.returncode, ran.stderr), (
                1, f"{name}: needs the Python module numpy: scripts/install_dependencies python3-numpy\n"))

    def test_no_module_has_the_name_of_another(self):
        names = [path.stem for path in (ROOT / "src" / "youbot_base_sim").rglob("*.py") if path.stem != "__init__"]
        self.assertEqual(len(names), len(set(names)), sorted(names))


if __name__ == "__main__":
    DEVEL = Path(sys.argv.pop(1)).resolve()
    unittest.main()
