"""Simulation of the Python module beside the program simulate. Usage: simulation_test.py SIMULATE"""
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np
import yaml
from youbot_base_sim import Simulation, run

SIMULATE = sys.argv.pop()
ROOT = Path(__file__).resolve().parents[3]
WHEELS = ["fl", "fr", "bl", "br"]
SCENES = ROOT / "config" / "scenes"
STEPPED = {"duration": 100, "solver": {"control_period": 0.001}}
LONG = {"duration": 1e5, "drive": {"torque": [{"start": 0, "sin": [1, 1.1, 0.9, 1], "period": 2}]}}
BAD_WHEELS = ([1, 2, 3], [[1, 2, 3, 4]], [1, 2, 3, float("nan")], [1, 2, float("inf"), 4], 1.0, "abcd", None, {},
              np.full(4, 1e7), [True] * 4, ["1"] * 4, [1j] * 4, [1, None, 1, 1], b"abcd", np.ones(4, "M8[s]"), [2**80] * 4)


def simulated(folder, scene, *options):
    """The rows, switches and summary of simulate; its status and error."""
    files = [Path(folder, name) for name in ("rows.csv", "switches.csv", "summary.json")]
    done = subprocess.run([SIMULATE, str(scene), *options, "--quiet", "--csv", files[0], "--switches", files[1],
                           "--summary", files[2]], stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        return None, None, None, done.stderr.strip()
    rows = np.genfromtxt(files[0], delimiter=",", names=True)
    switches = re.sub("fl|fr|bl|br", lambda wheel: str(WHEELS.index(wheel[0])), files[1].read_text())
    return rows, switches.splitlines()[1:], json.loads(files[2].read_text()), ""


class SameAsSimulate(unittest.TestCase):
    def compare(self, scene, settings, *options):
        with self.subTest(scene=scene, settings=settings), tempfile.TemporaryDirectory() as folder:
            rows, lines, summary, error = simulated(folder, scene, *options)
            simulation = Simulation(scene, settings)
            if error:
                self.assertRaisesRegex(RuntimeError, re.escape(error[10:].partition(";")[0]), simulation.run)
                return
            mine = simulation.run()
            self.assertEqual(mine.dtype.names, rows.dtype.names)
            self.assertEqual(len(mine), len(rows))
            for name in mine.dtype.names:
                self.assertEqual(mine[name].tobytes(), np.ascontiguousarray(rows[name]).tobytes(), name)
            mine = simulation.take_switches().tolist()
            self.assertEqual(mine, [tuple(float(cell) for cell in line.split(",")) for line in lines])
            self.assertEqual(simulation.reliable, summary["reliable"])
            for name, value in simulation.statistics.items():
                self.assertEqual(value, summary[name], name)
            for name, value in summary["final"].items():
                self.assertEqual(simulation.state[name], value)

    def test_all_scenes_have_the_same_bits(self):
        for scene in sorted(SCENES.glob("*.yaml")):
            self.compare(scene, None)
        for name in "case2.yaml", "demo.yaml":
            for model in "viscous", "no_slip":
                self.compare(SCENES / name, {"model": model}, "--model", model)
        self.compare(SCENES / "case2.yaml", {"solver.relative_tolerance": 1e-10}, "--relative-tolerance", "1e-10")
        self.compare(ROOT / "test" / "fuzz" / "scene" / "every_key.yaml", None)

    def test_refuses_a_scene_with_its_line(self):
        with tempfile.TemporaryDirectory() as folder:
            for text in ("duration: -1\n", "duration: 1\nrobot: {wheel_radius: 0}\n", "duration: 1\nflor: {}\n",
                         "a: [1\n", "", "duration: 1\n---\nduration: 2\n", "[" * 40 + "]" * 40, "duration: 1\n"):
                path = Path(folder, "scene.yaml")
                path.write_text(text)
                line = simulated(folder, path)[-1].partition("simulate: ")[2]
                with self.subTest(text=text), self.assertRaises(ValueError) as refused:
                    run(path)
                self.assertEqual(str(refused.exception).replace("run needs", "simulate needs"), line)

    def test_a_scene_is_a_file_a_text_or_a_dict(self):
        path = SCENES / "case1_counter_clockwise.yaml"
        expected = run(path, {"duration": 1})
        text = path.read_text()
        self.assertEqual(run(text, {"duration": 1}).tobytes(), expected.tobytes())
        self.assertEqual(run(yaml.safe_load(text), {"duration": np.float64(1)}).tobytes(), expected.tobytes())
        angles = np.array([0.1, 0.2, 0.3, 0.4])
        self.assertTrue((Simulation({"duration": 1, "initial": {"wheel_angles": angles}}).state["phi"] == angles).all())


class Driven(unittest.TestCase):
    def test_periods_are_steps(self):
        one, many = Simulation(STEPPED), Simulation(STEPPED)
        one.step([1, 1, 1, 1.2], periods=50)
        for _ in range(50):
            many.step([1, 1, 1, 1.2])
        self.assertEqual(one.state_vector.tobytes(), many.state_vector.tobytes())

    def test_reset_repeats_the_same_bits(self):
        simulation = Simulation(SCENES / "demo.yaml", {"duration": 1})
        rows = simulation.run().tobytes()
        simulation.reset()
        self.assertEqual((simulation.t, simulation.run().tobytes()), (0, rows))

    def test_set_points_are_tracked(self):
        simulation = Simulation({**STEPPED, "robot": {"profile": "measured"}})
        simulation.set_points("velocity", [4, 4, 4, 4])
        simulation.step(periods=3000)
        np.testing.assert_allclose(simulation.state["dphi"], 4, rtol=0.05)

    def test_loads_are_put_on_and_taken_off(self):
        simulation = Simulation({**STEPPED, "loads": [{"mass": 5, "position": [0, 0, 0.1]}]})
        own = simulation.contacts()["N"].sum()
        simulation.set_loads([{"mass": 10, "position": [0.05, 0, 0.1]}])
        self.assertAlmostEqual(simulation.contacts()["N"].sum(), own + 10 * 9.81, places=6)
        simulation.set_loads([])
        self.assertAlmostEqual(simulation.contacts()["N"].sum(), own, places=6)

    def test_state_is_a_view_that_nothing_writes(self):
        simulation = Simulation(STEPPED)
        state, vector, kept = simulation.state, simulation.state_vector, simulation.state.copy()
        simulation.step([1, 1, 1, 1], periods=100)
        self.assertGreater(state["V_X"], 0)
        self.assertEqual(state["V_X"], vector[4])
        self.assertEqual(kept["V_X"], 0)
        self.assertTrue(np.shares_memory(state["phi"], vector))
        del simulation  # the views keep it
        self.assertEqual(state["V_X"], vector[4])
        for write in (lambda: vector.__setitem__(0, 1), lambda: state["phi"].__setitem__(0, 1)):
            with self.assertRaises(ValueError):
                write()


class BadInput(unittest.TestCase):
    def refuses(self, simulation, call, pattern):
        before = simulation.state_vector.tobytes(), simulation.t, simulation.torque.tobytes(), simulation.statistics
        with self.assertRaisesRegex(ValueError, pattern) as refused:
            call()
        self.assertNotIn("\n", str(refused.exception).replace("run needs", "simulate needs"))
        self.assertEqual(before, (simulation.state_vector.tobytes(), simulation.t, simulation.torque.tobytes(),
                                  simulation.statistics))

    def test_one_clear_exception_and_the_simulation_unchanged(self):
        simulation, other = Simulation(STEPPED), Simulation(STEPPED)
        for each in simulation, other:
            each.step([1, 1, 1, 1], periods=10)
        for wrong in BAD_WHEELS:
            with self.subTest(wrong=wrong):
                self.refuses(simulation, lambda: setattr(simulation, "torque", wrong), "torque = .*must be of shape")
                if wrong is not None:
                    self.refuses(simulation, lambda: simulation.step(wrong), "torque = .*must be")
                    self.refuses(simulation, lambda: simulation.set_state([0] * 3, [0] * 3, wrong), "wheel_angles = ")
                self.refuses(simulation, lambda: simulation.set_points("velocity", wrong), "values = .*rad/s")
                if np.shape(wrong) != (3,):
                    self.refuses(simulation, lambda: simulation.set_state(wrong, [0] * 3), "pose = ")
                    self.refuses(simulation, lambda: simulation.set_wrench(wrong), "force = ")
        nan = float("nan")
        for call, pattern in (
                (lambda: simulation.advance(0.009), "t = 0.009: must be .* from 0.01 .*not in the past"),
                *((lambda t=t: simulation.advance(t), f"t = {t!r}: must") for t in (nan, float("inf"), "1", None, 1j, True)),
                (lambda: simulation.run(), "drive is left out"),
                *((lambda n=n: simulation.step(periods=n), f"periods = {n!r}: .* whole") for n in (0, -1, 1.0, "a", None, True)),
                *((lambda mode=mode: simulation.set_points(mode, [1] * 4), f"mode = {mode!r}: must be 'off', 'torque' or")
                  for mode in ("rates", 3, None, b"off")), (lambda: simulation.set_wrench([0, 0, 0], nan), "torque = nan"),
                (lambda: simulation.set_wrench([0, 0, 0], fixed="no"), "fixed = 'no': must be True or False"),
                (lambda: simulation.set_loads([], keep_momentum=1), "keep_momentum = 1: must be True or False"),
                (lambda: simulation.reset(1.0), "where = 1.0: must be True or False"),
                *((lambda loads=loads: simulation.set_loads(loads), r"loads(\[0\])? = .*: must be")
                  for loads in (5, None, "a", {}, [5], np.ones(2))),
                (lambda: simulation.set_wrench([0, 0, 0], point=[0, nan, 0]), "point = "),
                (lambda: simulation.set_loads([{"mass": -1, "position": [0, 0, 0]}]), r"loads\[0\].mass = -1: must be"),
                (lambda: simulation.set_loads([{"mass": 1}]), "position"),
                (lambda: simulation.set_loads([{"mass": 1, "position": [0, 0, 0], "start": 3}]), "must be left out"),
                (lambda: simulation.set_loads([{"mass": 1e4, "position": [1, 0, 0]}]), "every wheel presses")):
            with self.subTest(pattern=pattern):
                self.refuses(simulation, call, pattern)
        for each in simulation, other:
            each.step(periods=10)
        self.assertEqual(simulation.state_vector.tobytes(), other.state_vector.tobytes())

    def test_without_control_period_or_drive(self):
        simulation = Simulation({"duration": 1})
        self.refuses(simulation, simulation.step, "control_period = 0: must be more than 0")
        self.refuses(simulation, lambda: simulation.set_points("velocity", [1] * 4), "set points need a control_period")
        self.refuses(simulation, simulation.run, "scene: drive is left out; run needs one")
        running = Simulation(SCENES / "case2.yaml")
        running.advance(1)
        self.refuses(running, running.run, "run begins at t = 0, not at 1 s")

    def test_a_motion_that_ends_says_so_until_reset(self):
        simulation = Simulation({"duration": 10, "robot": {"normal_reactions": "dynamic", "com_height": 0.2},
                                 "drive": {"torque": [{"start": 0, "constant": [3, 3, 3, 3]}]}})
        simulation.set_wrench([400, 0, 0], point=[0, 0, 2])
        with self.assertRaisesRegex(RuntimeError, "tip|balance") as ended:
            simulation.advance(5)
        self.assertEqual(simulation.doubt, str(ended.exception))
        self.assertFalse(simulation.reliable)
        for call in lambda: simulation.advance(9), lambda: simulation.set_wrench([0, 0, 0]):
            with self.assertRaisesRegex(RuntimeError, r"the motion has ended: .*reset\(\)"):
                call()
        simulation.reset()
        simulation.advance(1)
        self.assertEqual(simulation.t, 1)


class Threads(unittest.TestCase):
    def test_interrupts_end_a_long_run(self):
        for call in (lambda s: s.run(), lambda s: s.advance(1e5)):
            simulation = Simulation(LONG, {"output_rate": 1})
            timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
            start = time.monotonic()
            timer.start()
            with self.assertRaises(KeyboardInterrupt):
                call(simulation)
            self.assertLess(time.monotonic() - start, 10)
            reached = simulation.t
            self.assertGreater(reached, 0)
            simulation.advance(reached + 0.1)
            self.assertTrue(simulation.reliable, simulation.doubt)

    def test_importing_it_loads_nothing_heavy(self):
        code = ("import sys, youbot_base_sim; assert 'numpy' not in sys.modules; youbot_base_sim.run; "
                "print([m for m in ('rospy', 'matplotlib', 'yaml', 'scipy') if m in sys.modules])")
        done = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True)
        self.assertEqual(done.stdout, "[]\n")


if __name__ == "__main__":
    unittest.main()
