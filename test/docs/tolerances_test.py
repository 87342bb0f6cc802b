"""docs/numerics.md has the errors of each tolerance. Usage: tolerances_test.py SIMULATE"""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
METRES = {"m": 1, "mm": 1e-3}


class TolerancesTest(unittest.TestCase):
    def test_errors_are_those_of_the_table(self):
        def positions(case, tolerance):
            subprocess.run([SIMULATE, ROOT / "config" / "scenes" / f"{case}.yaml", "--quiet", "--csv", file.name,
                            "--relative-tolerance", tolerance], check=True)
            return np.genfromtxt(file.name, delimiter=",", names=True)[["x", "y"]]

        rows = re.findall(r"^\| (\d\S+) \| (\S+) (m+) \| (\S+) (m+) \|", (ROOT / "docs" / "numerics.md").read_text(),
                          re.MULTILINE)
        self.assertEqual(len(rows), 5)
        with tempfile.NamedTemporaryFile(suffix=".csv") as file:
            for column, case in (1, "case1_counter_clockwise"), (3, "case2"):
                exact = positions(case, "1e-10")
                for row in rows:
                    run = positions(case, row[0])
                    error = np.hypot(run["x"] - exact["x"], run["y"] - exact["y"]).max()
                    printed = float(row[column]) * METRES[row[column + 1]]
                    self.assertEqual(f"{error:.1e}", f"{printed:.1e}", (case, row[0]))


if __name__ == "__main__":
    SIMULATE = Path(sys.argv.pop()).resolve()
    unittest.main()
