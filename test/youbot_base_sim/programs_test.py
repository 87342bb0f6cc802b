"""The programs of scripts/ and the studies as their user meets them: --help and wrong arguments install, build and write
nothing, from any folder and without a network; in the devel space too.

Usage: programs_test.py DEVEL      the devel space
"""
import contextlib
import io
import os
import pty
import shutil
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

from harness import ROOT, STUDY

DEVEL = None
INSTALLED = ("analyse", "identification_drive", "table_from_bag")


# Empty where the kernel forbids it, as in some containers.
WITHOUT_NETWORK = [shutil.which("unshare"), "--map-root-user", "--net"]
if subprocess.run([*WITHOUT_NETWORK, "true"], capture_output=True).returncode != 0:
    WITHOUT_NETWORK = []


def commands(root):
    """The programs of scripts/ in a tree, and its studies, by name."""
    programs = {path.name: [path] for path in sorted((root / "scripts").iterdir()) if path.is_file() and not path.suffix}
    studies = {path.stem: [root / "scripts" / "study", path.stem] for path in sorted((root / "studies").iterdir())
               if path.is_file() and (not path.suffix or "\ndef main(" in path.read_text())}
    return {name: [sys.executable if "python" in path.read_text().split("\n")[0] else shutil.which("bash"), path, *rest]
            for name, (path, *rest) in {**programs, **studies}.items()}


def all_of(terminal):
    """What was written to a pseudo-terminal whose other end is closed: the kernel hands it over in pieces, then EIO."""
    pieces = []
    with contextlib.suppress(OSError):
        while piece := os.read(terminal, 1000):
            pieces.append(piece)
    return b"".join(pieces)


class ProgramsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        # A copy of the tree, and no program but those that --help needs: what installs or builds is not found.
        self.root = self.folder / "tree"
        for name in ("scripts", "src/youbot_base_sim", "studies"):
            shutil.copytree(ROOT / name, self.root / name, ignore=shutil.ignore_patterns("__pycache__"))
        (self.folder / "bin").mkdir()
        for name in ("bash", "dirname", "env", "sed"):
            (self.folder / "bin" / name).symlink_to(shutil.which(name))
        for name in ("python", "python3"):  # of pyenv or conda, without the modules of ROS
            self.stub(name, "exit 1")
        self.environment = {**os.environ, "PATH": str(self.folder / "bin"), "HOME": str(self.folder),
                            "TMPDIR": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1"}
        self.with_programs = {**self.environment, "PATH": f"{self.folder}/bin:{os.environ['PATH']}"}

    def stub(self, name, command):
        program = self.folder / "bin" / name
        program.write_text(f"#!/bin/sh\n{command}\n")
        program.chmod(0o755)

    def run_only(self, command, folder, environment):
        """Runs a command, which must write nothing."""
        def files():
            return {path: path.lstat().st_mtime_ns for path in self.folder.rglob("*") if path.is_file()}

        before = files()
        ran = subprocess.run([*WITHOUT_NETWORK, *command], cwd=folder, env=environment, text=True, capture_output=True,
                             stdin=subprocess.DEVNULL, timeout=60)
        self.assertEqual(files(), before, command)
        return ran

    def helps(self, command, name, folder, environment):
        ran = self.run_only(command, folder, environment)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""), command)
        self.assertIn(name, ran.stdout.split("\n")[0])

    def test_there_are_some(self):
        expected = {*INSTALLED, "plot_sweep", "study", "build", "demo", "test", "lint", "soak", "paper_figures"}
        self.assertLessEqual(expected, commands(ROOT).keys())

    def test_all_name_the_python_that_has_the_modules_of_ros(self):
        for path in (path for folder in ("examples", "scripts", "test") for path in (ROOT / folder).rglob("*")):
            first = path.read_bytes().split(b"\n")[0] if path.is_file() else b""
            if first.startswith(b"#!") and b"python" in first:
                self.assertEqual(first, b"#!/usr/bin/python3", path)

    def test_help_from_the_root_and_from_elsewhere(self):
        for name, (interpreter, program, *study) in commands(self.root).items():
            self.helps([interpreter, program, *study, "--help"], name, self.folder, self.environment)
            self.helps([interpreter, program.relative_to(self.root), *study, "--help"], name, self.root, self.environment)

    def test_an_unknown_argument_is_refused(self):
        for name, command in commands(self.root).items():
            if name == "open_rviz":  # rviz's own arguments follow
                continue
            ran = self.run_only([*command, "--unknown"], self.folder, self.environment)
            self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (2, "", 1), (command, ran.stderr))

    def test_an_unknown_study_is_refused(self):
        ran = subprocess.run([STUDY, "../x"], text=True, capture_output=True)
        self.assertEqual((ran.returncode, ran.stdout), (2, ""))
        self.assertIn("study: '../x': must be one of beyond_figures, ", ran.stderr)

    def test_help_in_the_devel_space(self):
        for name in INSTALLED:
            command = f"source {DEVEL}/setup.bash && rosrun youbot_base_sim {name} --help"
            self.helps(["bash", "-c", command], name, self.folder, self.with_programs)

    def test_progress_is_for_terminals(self):
        def shown(out):
            lines = "printf 'dlstatus:1:50.1:Retrieving\n-- Found\n[  7%%] Building\n'; sleep 2; echo '[100%] Linking'"
            subprocess.run(["bash", "-ec", f'source "$0"; {{ {lines}; }} | show_progress', ROOT / "scripts" / "common.sh"],
                           check=True, stdout=out)

        master, terminal = pty.openpty()
        self.addCleanup(os.close, master)
        shown(terminal)
        os.close(terminal)
        steps = [line.split(",")[0] for line in all_of(master).decode().replace("\x1b[K", "").splitlines() if line]
        self.assertEqual(list(dict.fromkeys(steps)), ["downloading: 50 %", "building: 7 %", "building: 100 %"])
        self.assertGreater(steps.count("building: 7 %"), 1, "while no line comes")
        with open(self.folder / "pipe", "w") as pipe:
            shown(pipe)
        self.assertEqual((self.folder / "pipe").read_text(), "")

    def test_another_distribution_is_refused(self):
        release = self.folder / "os-release"
        release.write_text('ID=ubuntu\nVERSION_ID="20.04"\n')
        ran = subprocess.run([ROOT / "scripts" / "install_dependencies"], text=True, capture_output=True,
                             env={**self.with_programs, "OS_RELEASE": str(release)})
        self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (1, "", 1), ran.stderr)
        self.assertIn("this is ubuntu 20.04; must be debian 11, 12 or 13", ran.stderr)

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
        self.stub("rviz", 'cat "$2"')

        def opened(*prefix, display=":0"):
            return subprocess.run(["bash", ROOT / "scripts" / "open_rviz", "--tf-prefix", *prefix, "-d",
                                   ROOT / "rviz" / "base.rviz"], cwd=self.folder, text=True, capture_output=True,
                                  env={**self.with_programs, "ROS_HOME": str(self.folder), "DISPLAY": display})
        self.assertIn("there is no display for rviz: set DISPLAY", opened("unset", display="").stderr)
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
