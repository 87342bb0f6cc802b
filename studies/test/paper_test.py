"""scripts/study paper_figures, and the numbers of docs/paper/claims.md: each is measured anew and compared with the page.

Usage: paper_test.py MODULE [ARGUMENT OF UNITTEST...]
"""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
from harness import ROOT, STUDY
from measured_page import MODULE, MeasuredPage

from studies import claims, runs


class Page(MeasuredPage, unittest.TestCase):
    part, picture_names = claims.PAGE, [f"fig{number:02}.png" for number in range(4, 12)]

    @staticmethod
    def measure():
        cases = claims.Cases()
        findings = [claim.measure(cases) for claim in claims.CLAIMS]
        return findings, [claims.row(number, finding) for number, finding in enumerate(findings, 1)]

    def test_has_no_measured_number_outside_the_table(self):
        before, _, after = self.part.parts(self.page())
        prose = before + after + (ROOT / "docs" / "paper.md").read_text()
        numbers = set(re.findall(r"(?<![\d.])\d+\.\d+", prose))
        self.assertLessEqual(numbers, {"5.3", "5.4"})  # sections of the paper


class Contact(unittest.TestCase):
    """Slip and friction at the contacts, by the paper's formulas from the state."""

    def test_obeys_the_papers_formulas(self):
        R, R_d, m, m_1, a_X, a_Y, nu = 0.05, 0.0355, 30, 1.4, 0.016, -0.026, 1e-3
        X, Y = 0.235 * np.array([1, 1, -1, -1]), 0.15 * np.array([1, -1, 1, -1])
        delta = np.radians([-45, 45, 45, -45])
        for model in ("viscous", "coulomb"):
            motion = runs.Motion(runs.Scene(ROOT / "config/scenes/case2.yaml").sampled(0.3, 300), model)
            V_X, V_Y, Omega = (motion.truth[name][:, None] for name in ("V_X", "V_Y", "Omega"))
            dphi, dgamma = motion.truth["dphi"], motion.truth["dgamma"]
            angle = (motion.truth["phi"] + np.pi / 6) % (np.pi / 3) - np.pi / 6  # (2.1)
            Delta_Y = R_d * np.tan(angle) * np.tan(delta)  # (3.4)
            r = R - R_d / np.cos(angle)
            V_PX = V_X - (Y + Delta_Y) * Omega - R * dphi - r * np.sin(delta) * dgamma  # (3.3), signs as in docs/model.md
            V_PY = V_Y + X * Omega + r * np.cos(angle) * np.cos(delta) * dgamma
            slip = np.hypot(V_PX, V_PY)
            N = m_1 * 9.81 + m * 9.81 / 4 * (1 + a_X / X + a_Y / Y)  # (4.17)
            limit = 0.5 * (N if model == "coulomb" else (m + 4 * m_1) * 9.81 / 4)
            force = limit * slip / (nu if model == "viscous" else np.hypot(nu, slip))
            inside = np.pi / 6 - abs(angle) > 1e-6  # not on an edge
            self.assertGreater(inside.sum(), 1000)
            np.testing.assert_allclose(motion.contacts["slip"][inside], slip[inside], rtol=0, atol=1e-9)
            np.testing.assert_allclose(motion.contacts["force"][inside], force[inside], rtol=0, atol=1e-4)


class Script(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def write(self, name, text):
        path = self.path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        return path

    def draw(self, *arguments):
        done = subprocess.run([sys.executable, STUDY, "paper_figures", "--module", MODULE, *arguments], cwd=self.path,
                              capture_output=True, text=True, timeout=300)
        return done.returncode, done.stdout, done.stderr

    def expect_refused(self, arguments, *words):
        status, out, err = self.draw(*arguments)
        self.assertEqual((status, out), (2, ""), err)
        self.assertEqual(err.count("\n"), 1, err)
        self.assertTrue(err.startswith("paper_figures: "), err)
        for word in words:
            self.assertIn(word, err)

    def test_draws_a_scene_with_its_table(self):
        self.write("scenes/rates.csv", "t,fl,fr,bl,br\n0,-3,3,3,-3\n0.5,3,3,3,3\n")
        scene = self.write("scenes/my_base.yaml",
                           "duration: 1\nrobot: {rollers_per_wheel: 8, profile: measured}\n"
                           "initial: {wheel_rates: [-1, 1, 1, -1]}\ndrive: {velocity_table: rates.csv}\n")
        self.assertEqual(self.draw(scene), (0, "6 figures: my_base_figures/\n", ""))
        kinds = ("torques", "motion", "velocities", "spread", "beginning", "contact")
        self.assertEqual({path.name for path in (self.path / "my_base_figures").iterdir()},
                         {f"my_base_{kind}.png" for kind in kinds})

    def test_draws_a_scene_beyond_the_paper_with_the_models_that_take_it(self):
        scene = self.write("ramp.yaml", "duration: 0.2\nrobot: {normal_reactions: dynamic}\n"
                           "drive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n")
        status, out, err = self.draw(scene)
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


if __name__ == "__main__":
    unittest.main()
