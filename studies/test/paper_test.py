"""scripts/study paper_figures, and the numbers of docs/paper/claims.md: each is measured anew and compared with the page.

Usage: paper_test.py SIMULATE [ARGUMENT OF UNITTEST...]
"""
import csv
import math
import re
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from harness import ROOT, STUDY
from measured_page import SIMULATE, MeasuredPage

from studies import claims, runs


class Page(MeasuredPage, unittest.TestCase):
    part, picture_names = claims.PAGE, [f"fig{number:02}.png" for number in range(4, 12)]

    @staticmethod
    def measure(recorder):
        cases = claims.Cases(ROOT / "config" / "scenes", recorder)
        findings = [claim.measure(cases) for claim in claims.CLAIMS]
        return findings, [claims.row(number, finding) for number, finding in enumerate(findings, 1)]

    def test_would_fail_without_a_row(self):
        rows = self.page().split("\n| 7 |")
        self.assertEqual(len(rows), 2)
        self.assertIn(7, self.wrong_rows(rows[0] + rows[1].partition("\n")[2]))

    def test_has_no_measured_number_outside_the_table(self):
        before, _, after = self.part.parts(self.page())
        prose = before + after + (ROOT / "docs" / "paper.md").read_text()
        numbers = set(re.findall(r"(?<![\d.])\d+\.\d+", prose))
        self.assertLessEqual(numbers, {"5.3", "5.4"})  # sections of the paper


class Contact(unittest.TestCase):
    """The bag's slip and friction at the contacts, by the paper's formulas from the state."""

    def test_obeys_the_papers_formulas(self):
        h, l, R, R_d, m, m_1, a_X, a_Y, nu = 0.235, 0.15, 0.05, 0.0355, 30, 1.4, 0.016, -0.026, 1e-3
        with tempfile.TemporaryDirectory() as folder:
            for model in ("viscous", "coulomb"):
                scene = Path(folder) / "scene.yaml"
                text = (ROOT / "config/scenes/case2.yaml").read_text()
                scene.write_text(text.replace("duration: 30.0", "duration: 0.3").replace("rate: 100.0", "rate: 1000.0"))
                bag, table = Path(folder) / "x.bag", Path(folder) / "x.csv"
                subprocess.run([SIMULATE, scene, "--model", model, "--bag", bag, "--contacts", "--csv", table,
                                "--quiet"], check=True)
                contacts = runs.Recording(bag).contacts
                with open(table, newline="") as file:
                    rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
                self.assertEqual(len(rows), len(contacts["t"]))
                for i, row in enumerate(rows):
                    for wheel, (name, X, Y) in enumerate((("fl", h, l), ("fr", h, -l), ("bl", -h, l), ("br", -h, -l))):
                        delta = math.radians(-45 if name in ("fl", "br") else 45)
                        angle = (row["phi_" + name] + math.pi / 6) % (math.pi / 3) - math.pi / 6  # (2.1)
                        if math.pi / 6 - abs(angle) < 1e-6:
                            continue  # on an edge
                        Delta_Y = R_d * math.tan(angle) * math.tan(delta)  # (3.4)
                        r = R - R_d / math.cos(angle)
                        V_PX = (row["V_X"] - (Y + Delta_Y) * row["Omega"] - R * row["dphi_" + name] -
                                r * math.sin(delta) * row["dgamma_" + name])  # (3.3), with the signs of docs/model.md
                        V_PY = (row["V_Y"] + X * row["Omega"] +
                                r * math.cos(angle) * math.cos(delta) * row["dgamma_" + name])
                        slip = math.hypot(V_PX, V_PY)
                        N = m_1 * 9.81 + m * 9.81 / 4 * (1 + a_X / X + a_Y / Y)  # (4.17)
                        limit = 0.5 * (N if model == "coulomb" else (m + 4 * m_1) * 9.81 / 4)
                        force = limit * slip / (nu if model == "viscous" else math.hypot(nu, slip))
                        self.assertAlmostEqual(contacts["slip"][i, wheel], slip, delta=1e-9)
                        self.assertAlmostEqual(contacts["force"][i, wheel], force, delta=1e-4)


class Script(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def write(self, name, text):
        path = self.path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        return path

    def program(self, text):
        """A script of the shell in place of simulate."""
        path = self.write("program", "#!/bin/sh\n" + text)
        path.chmod(0o755)
        return path

    def start(self, *arguments, simulate=SIMULATE):
        return subprocess.Popen([sys.executable, STUDY, "paper_figures", "--simulate", simulate, "--keep",
                                 self.path / "kept", *arguments], cwd=self.path, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def finish(self, program):
        out, err = program.communicate(timeout=300)
        return program.returncode, out, err

    def files(self, folder):
        return {path.relative_to(self.path): path.stat().st_mtime_ns for path in (self.path / folder).rglob("*")
                if path.is_file() and path.name != "lock"}

    def expect_refused(self, arguments, *words):
        status, out, err = self.finish(self.start(*arguments))
        self.assertEqual((status, out), (2, ""), err)
        self.assertEqual(err.count("\n"), 1, err)
        self.assertTrue(err.startswith("paper_figures: "), err)
        for word in words:
            self.assertIn(word, err)

    def test_draws_a_scene_once(self):
        self.write("scenes/rates.csv", "t,fl,fr,bl,br\n0,-3,3,3,-3\n0.5,3,3,3,3\n")
        scene = self.write("scenes/my_base.yaml",
                           "duration: 1\nrobot: {rollers_per_wheel: 8, profile: measured}\n"
                           "initial: {wheel_rates: [-1, 1, 1, -1]}\ndrive: {velocity_table: rates.csv}\n")
        status, out, err = self.finish(self.start(scene))
        self.assertEqual((status, err), (0, ""))
        self.assertIn("my_base_figures", out)
        kinds = ("torques", "motion", "velocities", "spread", "beginning", "contact")
        drawn = self.files("my_base_figures")
        self.assertEqual({path.name for path in drawn},
                         {f"my_base_{kind}.png" for kind in kinds})
        kept = self.files("kept")
        self.assertEqual(self.finish(self.start(scene))[0], 0)
        self.assertEqual(self.files("kept"), kept)
        # Of another table other figures.
        self.write("scenes/rates.csv", "t,fl,fr,bl,br\n0,2,2,2,2\n")
        self.assertEqual(self.finish(self.start(scene, "--only", "4"))[0], 0)
        self.assertGreater(len(self.files("kept")), len(kept))

    def test_draws_a_scene_beyond_the_paper_with_the_models_that_take_it(self):
        scene = self.write("ramp.yaml", "duration: 0.2\nrobot: {normal_reactions: dynamic}\n"
                           "drive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n")
        status, out, err = self.finish(self.start(scene))
        self.assertEqual((status, out), (0, "6 figures: ramp_figures/\n"), err)
        self.assertEqual([line.split(": ")[1] for line in err.splitlines()],
                         ["without model no_slip", "without model viscous"])

    def test_refuses_in_one_line(self):
        good = self.write("good.yaml", "duration: 1\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n")
        bad = self.write("bad.yaml", "duration: -1\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n")
        self.expect_refused([bad], str(bad), "duration", "-1")
        self.expect_refused([self.write("list.yaml", "[1, 2]\n")], "list.yaml")
        self.expect_refused([self.write("broken.yaml", "duration: [1\n")], "broken.yaml", "YAML")
        self.expect_refused([self.path / "missing.yaml"], "missing.yaml", "No such file")
        self.expect_refused([self.path], str(self.path))
        self.expect_refused([good, "--only", "8"], "--only 8", "4, 5, 6, 7, 9 or 10")
        self.expect_refused(["--only", "3"], "--only 3", "10")
        self.expect_refused(["--claims", "99"], "--claims 99", str(len(claims.CLAIMS)))
        self.expect_refused([good, "--claims"], "--claims")
        self.assertEqual(list(self.path.glob("*_figures")), [])

    def test_leaves_nothing_half_made_when_interrupted(self):
        scene = self.write("long.yaml", "duration: 3\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n")
        slow = self.program(f'case "$*" in *--bag*) : >"$5"; touch "{self.path}/begun"; exec sleep 100;; esac\n')
        program = self.start(scene, "--only", "5", simulate=slow)
        while not (self.path / "begun").exists():
            self.assertIsNone(program.poll())
            time.sleep(0.01)
        program.terminate()
        status, _, err = self.finish(program)
        self.assertEqual((status, err), (1, "paper_figures: interrupted; what was finished is kept\n"))
        self.assertEqual(self.files("kept"), {})
        self.assertEqual(self.files("long_figures"), {})

    def test_tells_of_a_run_that_fails(self):
        scene = self.write("failing.yaml", "duration: 3\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n")
        failing = self.program('case "$*" in *--bag*) echo "simulate: it broke" >&2; exit 1;; esac\n')
        status, _, err = self.finish(self.start(scene, "--only", "5", simulate=failing))
        self.assertEqual((status, err), (1, "paper_figures: it broke\n"))
        self.assertEqual(self.files("kept"), {})


if __name__ == "__main__":
    unittest.main()
