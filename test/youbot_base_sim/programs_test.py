"""The Python programs of scripts/ as their user meets them: --help from any folder, which installs, builds and writes
nothing; in the devel space too.

Usage: programs_test.py DEVEL      the devel space
"""
import io
import os
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

from harness import ROOT, STUDY

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
        expected = {*INSTALLED, "plot_sweep", "study"}
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

    def test_help_of_each_study(self):
        names = [path.stem for path in (ROOT / "studies").glob("*.py") if "\ndef main(" in path.read_text()]
        self.assertIn("paper_figures", names)
        for name in names:
            self.helps([sys.executable, STUDY, name, "--help"], name, self.folder)

    def test_an_unknown_study_is_refused(self):
        ran = subprocess.run([STUDY, "../x"], text=True, capture_output=True)
        self.assertEqual((ran.returncode, ran.stdout), (2, ""))
        self.assertIn("study: '../x': must be one of beyond_figures, ", ran.stderr)

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

    def analyse(self, before):
        """Its help, after commands of bash."""
        command = f'{before}; exec "$0" "$@"'
        return subprocess.run(["bash", "-c", command, sys.executable, ROOT / "scripts" / "analyse", "--help"],
                              capture_output=True, stdin=subprocess.DEVNULL)

    def test_a_closed_standard_output_is_an_error(self):
        ran = self.analyse("exec >&-")
        self.assertEqual((ran.returncode, ran.stderr),
                         (1, b"analyse: standard output: cannot be written: Bad file descriptor\n"))

    def test_names_that_the_locale_lacks_are_escaped(self):
        from youbot_base_sim import command_line
        out = io.TextIOWrapper(io.BytesIO(), encoding="latin-1")
        with unittest.mock.patch("sys.stdout", out):
            self.assertEqual(command_line.run("x", print, "\u0141\xf3d\u017a a\x1b[31mb"), 0)
        self.assertEqual(out.buffer.getvalue(), b"\\u0141\xf3d\\u017a a\\x1b[31mb\n")

    def test_rviz_is_opened_with_frames_of_this_prefix(self):
        rviz = self.folder / "rviz"
        rviz.write_text('#!/bin/sh\ncat "$2"\n')
        rviz.chmod(0o755)

        def opened(*prefix):
            return subprocess.run(["bash", ROOT / "scripts" / "open_rviz", "--tf-prefix", *prefix, "-d",
                                   ROOT / "rviz" / "base.rviz"], cwd=self.folder, text=True, capture_output=True,
                                  env={**self.environment, "ROS_HOME": str(self.folder)})
        plain = opened("unset").stdout
        self.assertEqual((plain, opened().stdout), ((ROOT / "rviz" / "base.rviz").read_text(),) * 2)
        expected = plain.replace('TF Prefix: ""', "TF Prefix: a.b/c-1")
        for name in ("Frame: base_footprint", "Frame: ground_truth", "TF Prefix: ground_truth"):
            expected = expected.replace(name, name.replace(": ", ": a.b/c-1/"))
        self.assertEqual(opened("a.b/c-1").stdout, expected)
        before = sorted(self.folder.iterdir())
        for prefix in (";touch CANARY;#e;s#(zz)(zz)#", "a&b", "\\1", "$(touch CANARY)", "a\nb", "a b", "a" * 201):
            ran = opened(*prefix.split(" ") if prefix == "a b" else [prefix])
            self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (2, "", 1), prefix)
            self.assertIn("must be at most 200 letters", ran.stderr)
        self.assertEqual(sorted(self.folder.iterdir()), before)

    def test_no_module_has_the_name_of_another(self):
        names = [path.stem for path in (ROOT / "src" / "youbot_base_sim").rglob("*.py") if path.stem != "__init__"]
        self.assertEqual(len(names), len(set(names)), sorted(names))


if __name__ == "__main__":
    DEVEL = Path(sys.argv.pop(1)).resolve()
    unittest.main()
