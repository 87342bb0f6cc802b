"""scripts/study beyond_figures, and the numbers of docs/beyond/effects.md: each is measured anew and compared with the page.

Usage: beyond_figures_test.py SIMULATE [ARGUMENT OF UNITTEST...]
"""
import subprocess
import sys
import unittest

from harness import ROOT, STUDY
from measured_page import SIMULATE, MeasuredPage

from studies import effects


class Page(MeasuredPage, unittest.TestCase):
    """The script runs once; the findings are of the runs that it kept."""

    part, picture_names = effects.PAGE, [f"{effect.name}.png" for effect in effects.EFFECTS]

    @classmethod
    def prepare(cls):
        cls.drawn = cls.folder / "figures"
        cls.script = subprocess.run([sys.executable, STUDY, "beyond_figures", "--simulate", SIMULATE, "--keep",
                                     cls.folder / "kept", "-o", cls.drawn], capture_output=True, text=True)

    @staticmethod
    def measure(recorder):
        findings = [effect.measure(effect.record(recorder)) for effect in effects.EFFECTS]
        return findings, [effect.row(finding) for effect, finding in zip(effects.EFFECTS, findings)]

    def test_script_draws_every_figure(self):
        self.assertEqual((self.script.returncode, self.script.stderr), (0, ""))
        self.assertEqual({path.name for path in self.drawn.iterdir()}, set(self.picture_names))
        for name in self.picture_names:
            self.assertGreater((self.drawn / name).stat().st_size, 5000, name)


if __name__ == "__main__":
    unittest.main()
