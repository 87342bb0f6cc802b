"""scripts/study beyond_figures, and the numbers of docs/beyond/effects.md: each is measured anew and compared with the page.

Usage: beyond_figures_test.py MODULE [ARGUMENT OF UNITTEST...]
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from harness import STUDY
from measured_page import MODULE, MeasuredPage

from studies import effects


class Page(MeasuredPage, unittest.TestCase):
    part, picture_names = effects.PAGE, [f"{effect.name}.png" for effect in effects.EFFECTS]

    @staticmethod
    def measure():
        findings = [effect.measure(effect.motions()) for effect in effects.EFFECTS]
        return findings, [effect.row(finding) for effect, finding in zip(effects.EFFECTS, findings)]

    def test_script_draws_every_figure(self):
        with tempfile.TemporaryDirectory() as folder:
            script = subprocess.run([sys.executable, STUDY, "beyond_figures", "--module", MODULE, "-o", folder],
                                    capture_output=True, text=True)
            self.assertEqual((script.returncode, script.stderr), (0, ""))
            sizes = {path.name: path.stat().st_size for path in Path(folder).iterdir()}
        self.assertEqual(set(sizes), set(self.picture_names))
        self.assertGreater(min(sizes.values()), 5000)


if __name__ == "__main__":
    unittest.main()
