#!/usr/bin/python3
"""Where the paper's Case 1, a circle by translation, ends if all four wheels start at random angles: many runs at
once, drawn into random_starts.png. Usage: random_starts.py [RUNS]"""
import sys
from pathlib import Path

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from youbot_base_sim import Batch

CASE1 = Path(__file__).resolve().parents[2] / "config" / "scenes" / "case1_counter_clockwise.yaml"
runs = sys.argv[1] if len(sys.argv) > 1 else "1000"
if not runs.isdigit() or not 0 < int(runs) <= 1000000:
    sys.exit(f"RUNS = {runs}: must be a whole number, 1 to 1000000")
runs = int(runs)

batch = Batch(CASE1, runs)
batch.expand("initial.wheel_angles", np.random.default_rng(1).uniform(0, np.pi / 3, (runs, 4)))  # within a roller
t = np.linspace(0, 30, 61)
x, y = np.empty((2, len(t), runs))
for k, now in enumerate(t):
    batch.advance(now)
    x[k], y[k] = batch.state["x"], batch.state["y"]

figure, (paths, ends) = plt.subplots(1, 2, figsize=(9, 4))
paths.plot(x[:, :100], y[:, :100], color="tab:blue", alpha=0.2, linewidth=0.7)
paths.plot(2.5, 0, "ks", label="start")
paths.set(xlabel="x, m", ylabel="y, m", title="100 paths over 30 s", aspect="equal")
paths.legend()
ends.plot(x[-1], y[-1], ".", markersize=3)
ends.plot(2.5, 0, "ks", label="without slip")
ends.legend()
ends.set(xlabel="x, m", ylabel="y, m", title=f"{runs} ends", aspect="equal")
figure.tight_layout()
figure.savefig("random_starts.png", dpi=120)
print(f"ends spread by {np.ptp(x[-1]):.3f} m in x, {np.ptp(y[-1]):.3f} m in y; all reliable: {batch.reliable.all()}")
