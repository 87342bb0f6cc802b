"""scripts/study validate_odometry on a data set of the same layout, made by the simulator with known parameters.

Usage: validate_odometry_test.py MODULE [ARGUMENT OF UNITTEST...]
"""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
from harness import STUDY
from measured_page import MODULE
from youbot_base_sim._simulator import run as simulate
from youbot_base_sim.analysis import spectrum
from youbot_base_sim.base import WHEELS, Base
from youbot_base_sim.records import Record
from youbot_base_sim.series import Series

from studies import odometry_records as records
from studies.builds import ROOT
from studies.slip_gains import drive, robot

RADIUS, FRICTION, STRETCH, DURATION = 1.02, 2e-3, 1.0625, 200  # friction over f N in m; s
SETS = [f"{figure}/{day}{k}" for k in "ABC" for figure in ("circular", "square") for day in ("0809", "2312")]


def write_run(folder, k):
    """A circle driven laterally, a "square" forward, by directions that swing so that wheels pass the others' rollers:
    what yaw the rollers lose differs."""
    instants = np.arange(0, DURATION + 1e-9, records.MESSAGE)
    speed = 0.065 * np.clip(np.minimum(instants - 1, DURATION - 2 - instants), 0, 1)
    direction = (folder.parent.name == "circular") * np.pi / 2 + 0.6 * np.sin((0.31 + 0.03 * k) * instants)
    yaw = 0.5 * (-1) ** k * speed / records.BASE.half_lengths
    rates = np.array(records.BASE.rolling_rates(speed * np.cos(direction), speed * np.sin(direction), yaw)).T
    angles = np.random.default_rng(k).random(4) + np.cumsum(rates, axis=0) * records.MESSAGE
    rows = drive(angles[:, None], records.MESSAGE, robot(FRICTION))[:, 0]
    ticks = np.rint(rows[:, 3:] / RADIUS / records.TICK).astype(int)
    t = np.arange(0, DURATION / STRETCH, records.ROW)
    pose = [np.interp(t * STRETCH, instants, column) for column in rows[:, :3].T]
    message = np.minimum((t * STRETCH / records.MESSAGE + 1e-9).astype(int), len(ticks) - 2)
    logged = np.diff(ticks, axis=0)[message] * records.FORWARD / records.TICKS_PER_ROW
    folder.mkdir(parents=True)
    np.savetxt(folder / f"{folder.name}_run-01.csv", np.c_[t, np.array(pose).T, logged], "%.15g", ",")
    (folder / f"{folder.name}_metadata.csv").write_text(
        f"\ufefftype,omni4\nN,1\ngt_ti,3\ngt_tf,{3 + 16 * STRETCH}\nodo_ti,0\nodo_tf,16\n", encoding="utf-8")


def run(*arguments):
    return subprocess.run([sys.executable, STUDY, "validate_odometry", "--module", MODULE, *arguments],
                          capture_output=True, text=True)


class ValidateOdometryTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def test_parameters_are_found_again_and_slip_predicts_better(self):
        for k, name in enumerate(SETS):
            write_run(self.folder / "data" / "omni4" / name, k)
        figure = self.folder / "figure.png"
        ran = run(self.folder, "--quick", "--figure", figure)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        self.assertIn("12 runs\n", ran.stdout)
        self.assertGreater(figure.stat().st_size, 5000)
        ratios = re.findall(r"^\| slip, 3 \| kinematics, 3 \| \w+ \| .* \| (.*) \| (.*) \|$", ran.stdout, re.M)
        self.assertEqual(len(ratios), 2)
        for cell in ratios[0] + ratios[1]:  # position and heading, both splits by figure
            self.assertLess(float(cell.split()[0]), 0.6, ran.stdout)
        cells = re.search(r"^\| slip, 3 \| radius, track, friction \| (.*) \|$", ran.stdout, re.M)[1].split(" | ")
        for cell in cells:
            radius, track, friction = map(float, cell.split(", "))
            self.assertAlmostEqual(radius, RADIUS, delta=0.003)
            self.assertAlmostEqual(track, 1, delta=0.003)
            self.assertAlmostEqual(friction, 100 * FRICTION, delta=0.04)  # of other phases it scatters by half of that

    def test_messages_are_counted(self):
        values = np.array([[5, 5, 5, 5], [7, 7, 7, 7], [7, 7, 7, 7], [6, 7, 7, 6], [6, 6, 6, 6], [0, 0, 0, 0]])
        held = np.repeat(values, [4, 4, 3, 1, 4, 8], axis=0)  # 7 twice; one row that two messages share; a rest
        np.testing.assert_array_equal(records.messages_of(held), values[[0, 1, 2, 4, 5, 5]])

    def test_another_folder_is_refused(self):
        for content, reason in (("", "must be a clone of"), ("N,1\n", "'gt_tf'; must be a folder of")):
            if content:
                (self.folder / "data/omni4/square/A").mkdir(parents=True)
                (self.folder / "data/omni4/square/A/A_metadata.csv").write_text(content)
            ran = run(self.folder)
            self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (2, "", 1), ran.stderr)
            self.assertIn(reason, ran.stderr)


class NumberOfRollersTest(unittest.TestCase):
    def test_simulated_wheels_show_it(self):
        """Forward, lateral, backward and in yaw, 10 s each, at 50 Hz by coarse encoders."""
        rates = 4 * np.array([(1, 1, 1, 1), (-1, 1, 1, -1), (-1, -1, -1, -1), (-1, 1, -1, 1)] * 2)
        for name, n in (("nexus_4wd", 9), ("polimi_omni", 15)):
            with tempfile.NamedTemporaryFile("w", suffix=".csv") as table:
                np.savetxt(table, np.c_[10 * np.arange(8), rates], "%g", ",", header="t,fl,fr,bl,br", comments="")
                table.flush()
                rows = simulate(str(ROOT / "config" / "robots" / f"{name}.yaml"), {
                    "duration": 80, "output_rate": 50, "drive": {"velocity_table": table.name}})
            phi, dphi = (np.array([rows[f"{what}_{wheel}"] for wheel in WHEELS]).T for what in ("phi", "dphi"))
            joints = Series(rows["t"], {"position": np.floor(phi / 2e-3) * 2e-3, "velocity": np.rint(dphi / 4e-3) * 4e-3})
            numbers = {key: value for key, value, _ in spectrum.analyse(Record(Base(), series={"joint_states": joints})).numbers}
            self.assertEqual(numbers["rollers"], n)
            self.assertGreater(numbers["odds_of_rollers"], spectrum.SURE)


if __name__ == "__main__":
    unittest.main()
