"""scripts/beyond_figures, and the numbers of docs/beyond.md: each is measured anew and compared with the page.

Usage: beyond_figures_test.py SIMULATE [ARGUMENT OF UNITTEST...]
"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from harness import ROOT
from measured_page import MeasuredPage

from youbot_base_sim.studies import effects, runs

SIMULATE = Path(sys.argv.pop(1)).resolve()


class Page(MeasuredPage, unittest.TestCase):
    """The script runs once; the findings are of the runs that it kept."""

    table = effects.TABLE

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        kept, cls.drawn = Path(folder.name) / "kept", Path(folder.name) / "figures"
        cls.script = subprocess.run([sys.executable, ROOT / "scripts" / "beyond_figures", "--simulate", SIMULATE, "--keep",
                                     kept, "-o", cls.drawn], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        recorder = runs.Recorder(SIMULATE, runs.Kept(kept, SIMULATE))
        cls.findings = [effect.measure(effect.record(recorder)) for effect in effects.EFFECTS]
        cls.rows = [effect.row(finding) for effect, finding in zip(effects.EFFECTS, cls.findings)]
        cls.warnings = recorder.warnings

    def test_script_draws_every_figure(self):
        self.assertEqual((self.script.returncode, self.script.stderr), (0, ""))
        self.assertEqual(self.warnings, [])
        names = {f"{effect.name}.png" for effect in effects.EFFECTS}
        self.assertEqual({path.name for path in self.drawn.iterdir()}, names)
        for name in names:
            self.assertGreater((self.drawn / name).stat().st_size, 5000, name)

    def test_page_has_every_figure(self):
        for effect in effects.EFFECTS:
            self.assertIn(f"](beyond/{effect.name}.png)", self.page())
            self.assertGreater((ROOT / "docs" / "beyond" / f"{effect.name}.png").stat().st_size, 5000)


if __name__ == "__main__":
    unittest.main()
