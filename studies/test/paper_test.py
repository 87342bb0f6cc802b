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
            motion = runs.Motion(runs.Scene("case2").sampled(0.3, 300), model)
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
    def draw(self, *arguments):
        return subprocess.run([sys.executable, STUDY, "paper_figures", "--module", MODULE, *arguments],
                              capture_output=True, text=True, timeout=300)

    def test_draws_a_figure(self):
        with tempfile.TemporaryDirectory() as folder:
            done = self.draw("--only", "10", "-o", folder)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, f"1 figure: {folder}/\n", ""))
            self.assertGreater(Path(folder, "fig10.png").stat().st_size, 5000)

    def test_refuses_in_one_line(self):
        for arguments in ("--only", "3"), ("--claims", "--only", "4"), ("--claims", "a"):
            done = self.draw(*arguments)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (2, "", 1), done.stderr)
            self.assertTrue(done.stderr.startswith("paper_figures: "), done.stderr)


if __name__ == "__main__":
    unittest.main()
