"""scripts/study work_precision, with a stand-in for the solvers: it runs every scene and variant, and writes its files.

Usage: work_precision_test.py SIMULATE [ARGUMENT OF UNITTEST...]
"""
import csv
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from harness import ROOT, STUDY

from studies.work_precision import TABLES
from studies.work_precision_runs import CONTESTANTS, SCENES

SIMULATE = Path(sys.argv.pop(1)).resolve()
# In place of bench/solve: refuses what simulate refuses. CVODE alone fails, but for the references.
SOLVE = f"""#!{sys.executable} -SE
import json, subprocess, sys
if len(sys.argv) == 1:
    sys.exit(print(json.dumps(dict(compiler="a compiler", flags="-O2", libraries="none"))))
task = json.loads(sys.argv[1])
checked = subprocess.run(["{SIMULATE}", task["scene"], "--model", task["model"], "--cpu-limit", "1e-9", "--quiet"],
                         stderr=subprocess.PIPE)
if checked.returncode == 2:
    sys.exit(checked.stderr.decode())
if task["solver"] == "cvode" and "max_evaluations" not in task:
    sys.exit(print(json.dumps(dict(failure="too much work", run_time=7))))
rows = [[0.0] * 20] * (round(task["span"] * task["rate"]) + 1)
counts = dict(steps=100, fallback_steps=1, rejected_steps=0, location_steps=0, evaluations=300, jacobians=0,
              factorizations=9, switches=4)
print(json.dumps(dict(rows=rows, run_time=7, repeats=1, counts=counts)))
"""


class WorkPrecision(unittest.TestCase):
    def test_measures_every_scene(self):
        with tempfile.TemporaryDirectory() as folder:
            solve, output = Path(folder) / "solve", Path(folder) / "output"
            solve.write_text(SOLVE)
            solve.chmod(0o755)
            ran = subprocess.run([STUDY, "work_precision", "--solve", solve, "--span", "1", "--output",
                                  output], capture_output=True, text=True)
            self.assertEqual((ran.returncode, ran.stderr), (0, ""))
            self.assertEqual({file.name for file in output.iterdir()},
                             {f"{name}.csv" for name in TABLES} | {"work_precision.md", "work_precision.png"})
            with open(output / "work_precision.csv", newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertEqual({(row["scene"], row["contestant"]) for row in rows},
                             {(scene.key, contestant.key) for scene in SCENES for contestant in CONTESTANTS})
            for row in rows:
                self.assertEqual(row["failure"], "too much work" * (row["contestant"] == "cvode"))
            self.assertIn("never", (output / "work_precision.md").read_text())


if __name__ == "__main__":
    unittest.main()
