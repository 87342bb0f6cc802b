"""Runs a notebook, which must be kept without output: by nbconvert if it is installed, else its cells as a script. Usage:
notebook_test.py NOTEBOOK"""
import importlib.util
import json
import subprocess
import sys
import tempfile

import matplotlib

cells = [cell for cell in json.load(open(sys.argv[1]))["cells"] if cell["cell_type"] == "code"]
if any(cell["outputs"] or cell["execution_count"] for cell in cells):
    sys.exit(f"{sys.argv[1]}: must be kept without output")
if importlib.util.find_spec("nbconvert"):
    with tempfile.TemporaryDirectory() as folder:
        sys.exit(subprocess.run([sys.executable, "-m", "nbconvert", "--execute", "--to", "notebook", "--output-dir", folder,
                                 sys.argv[1]], check=False).returncode)
matplotlib.use("Agg")
names = {}
for cell in cells:
    exec("".join(cell["source"]), names)
x, y = names["rows"]["x"], names["rows"]["y"]
if not 0.1 < abs(x[-1] - 2.5) + abs(y[-1]) < 5 or not names["plt"].gca().lines:
    sys.exit("Case 2 must be drawn and end beside its start")
