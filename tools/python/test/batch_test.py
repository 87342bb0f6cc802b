"""Batch and simulate_many of the Python module beside single runs; warnings, threads, help and types of the module."""
import inspect
import os
import re
import signal
import threading
import time
import unittest
import warnings
from pathlib import Path

import numpy as np
import youbot_base_sim
from youbot_base_sim import Batch, Simulation, run, simulate_many

CASE2 = str(Path(__file__).resolve().parents[3] / "config" / "scenes" / "case2.yaml")
STEPPED = {"duration": 100, "solver": {"control_period": 0.001}}
TIPPING = {**STEPPED, "robot": {"normal_reactions": "dynamic", "com_height": 0.2}}
LONG = {"duration": 1e5, "drive": {"torque": [{"start": 0, "sin": [1, 1.1, 0.9, 1], "period": 2}]}}
FRICTION = np.linspace(0.1, 0.9, 5)


def control(rates):
    return np.array([2, 2, 2, -2]) - 0.3 * rates


class ManyRuns(unittest.TestCase):
    def test_each_has_the_bits_of_a_single_run(self):
        batch = Batch(STEPPED, 5, threads=3)
        batch.expand("floor.friction", FRICTION)
        start = np.array([[0, 0, 0, angle] for angle in FRICTION])
        poses = np.zeros((5, 3))
        batch.set_state(poses, [0.1, 0, 0], wheel_angles=start)
        singles = [Simulation(STEPPED, {"floor.friction": f}) for f in FRICTION]
        for single, angles in zip(singles, start):
            single.set_state([0, 0, 0], [0.1, 0, 0], angles)
        rates = batch.state["dphi"]
        self.assertTrue(np.shares_memory(rates, batch.state_vector))
        for k in range(300):
            batch.step(control(rates))
            for single in singles:
                single.step(control(single.state["dphi"]))
            if k == 100:
                batch.set_wrench([0, 20, 0], torque=[0, 1, 2, 3, 4])
                batch.set_loads([{"mass": 5, "position": [0, 0, 0.1]}])
                for torque, single in enumerate(singles):
                    single.set_wrench([0, 20, 0], torque=torque)
                    single.set_loads([{"mass": 5, "position": [0, 0, 0.1]}])
        for name in "t", "energy", "rollers", "torque", "state_vector", "reliable", "doubt", "ended":
            for mine, single in zip(getattr(batch, name), singles):
                np.testing.assert_array_equal(mine, getattr(single, name), name)
        for mine, single in zip(batch.contacts(), singles):
            self.assertEqual(mine.tobytes(), single.contacts().tobytes())
        for name, values in batch.statistics.items():
            self.assertEqual(values.tolist(), [single.statistics[name] for single in singles], name)
        self.assertEqual(len({state.tobytes() for state in batch.state}), 5)

    def test_simulate_many_gives_the_rows_of_run(self):
        settings = [{"floor.friction": f, "duration": 2} for f in FRICTION]
        for mine, own in zip(simulate_many([CASE2] * 5, settings, threads=3), settings):
            self.assertEqual(mine.tobytes(), run(CASE2, own).tobytes())

    def test_runs_are_reset_and_placed_one_by_one(self):
        batch, where = Batch(STEPPED, 3), np.array([True, False, True])
        batch.step([1, 1, 1, 1], periods=50)
        kept = batch.state_vector.copy()
        batch.reset(where)
        self.assertEqual(batch.t.tolist(), [0, 0.05, 0])
        batch.set_state([1, 2, 3], [0, 0, 0], where=where)
        self.assertEqual(batch.state["x"].tolist(), [1, kept[1][0], 1])
        self.assertEqual(batch.state_vector[1].tobytes(), kept[1].tobytes())

    def test_a_run_that_ends_stands_still_until_it_is_reset(self):
        batch = Batch(TIPPING, 2)
        batch.set_wrench([[0, 0, 0], [400, 0, 0]], point=[0, 0, 2])
        batch.step([3, 3, 3, 3], periods=1000)
        self.assertEqual(batch.ended.tolist(), [False, True])
        self.assertRegex(batch.doubt[1], "tips over")
        self.assertEqual(batch.t[0], 1)
        ended = batch.t[1]
        batch.advance(1.1)
        np.testing.assert_array_equal(batch.t, [1.1, ended])
        batch.reset(batch.ended)
        batch.step(periods=10)
        self.assertEqual(batch.ended.tolist(), [False, False])
        with self.assertWarnsRegex(UserWarning, r"scenes\[0\]: .*tips over"):
            rows = simulate_many([{**TIPPING, "drive": LONG["drive"], "wrenches": [
                {"force": [400, 0, 0], "point": [0, 0, 2], "start": 1}]}])
        self.assertLess(rows[0]["t"][-1], 2)

    def test_invalid_input_leaves_all_as_they_were(self):
        batch = Batch(STEPPED, 3)
        batch.step([1, 1, 1, 1], periods=10)
        before = batch.state_vector.tobytes(), batch.torque.tobytes(), batch.t.tobytes()
        for call, pattern in (
                (lambda: batch.step(np.ones((2, 4))), r"torque = .*must be of shape \(3, 4\)"),
                (lambda: batch.step([[1] * 4, [1] * 4, [1, 1, 1, np.nan]]), "torque = "),
                (lambda: batch.reset([True]), r"where = .*shape \(3,\)"), (lambda: batch.advance(0.001), "t = 0.001"),
                (lambda: batch.expand("floor.friction", [0.1, 0.2, -1]), "friction = -1: must be"),
                (lambda: batch.expand("floor.friction", [0.1]), "3 values"),
                *((lambda key=key: batch.expand(key, [{}] * 3), "must be a key besides") for key in ("drive", 3, None)),
                *((lambda values=values: batch.expand("floor.friction", values), "must be a list of 3")
                  for values in (1, None, "abc", {1: 1, 2: 2, 3: 3})),
                *((lambda n=n: Batch(STEPPED, n), f"n = {n!r}: must be a whole number") for n in (0, "a", 1.5, None, 1j)),
                (lambda: Batch(STEPPED, 2, threads=-1), "threads = -1"), (lambda: simulate_many([LONG], threads="a"), "threads"),
                *((lambda scene=scene: make(scene), "scene = .*must be a file's path, YAML text or a dict")
                  for scene in (3, None, [], 1j, np.ones(3), b"a: 1") for make in (Simulation, run)),
                (lambda: run(LONG, 3), "settings = 3: must be a dict"), (lambda: run(LONG, {3: 4}), "3 = 4: must be a key"),
                *((lambda wrong=wrong: simulate_many(wrong), "scenes = .*must be a list") for wrong in ([], 3, "ab", LONG)),
                (lambda: simulate_many([STEPPED]), "drive is left out"),
                (lambda: simulate_many([LONG] * 3, [{}] * 2), "must be a dict, or a list of 3")):
            with self.subTest(pattern=pattern), self.assertRaisesRegex(ValueError, f"^[^\n]*{pattern}[^\n]*$"):
                call()
            self.assertEqual(before, (batch.state_vector.tobytes(), batch.torque.tobytes(), batch.t.tobytes()))


class Module(unittest.TestCase):
    def test_warnings_of_a_scene_are_those_of_python(self):
        doubtful = {**STEPPED, "robot": {"com_height": 0.2}}
        for make in Simulation, lambda scene: Batch(scene, 2):
            with self.assertWarnsRegex(UserWarning, "com_height = 0.2: has no effect"):
                make(doubtful)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.assertRaises(UserWarning, Simulation, doubtful)
            Simulation(STEPPED)

    def test_interrupts_end_many_long_runs(self):
        batch = Batch({**LONG, "output_rate": 1}, 4, threads=2)
        for call in lambda: batch.advance(1e5), lambda: simulate_many([LONG] * 4):
            timer, start = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)), time.monotonic()
            timer.start()
            self.assertRaises(KeyboardInterrupt, call)
            self.assertLess(time.monotonic() - start, 10)
        batch.advance(batch.t.max() + 0.1)
        self.assertTrue(batch.reliable.all(), batch.doubt)

    def test_other_threads_run_meanwhile(self):
        simulation, results, refused = Simulation(LONG, {"output_rate": 1}), [], []

        def other():
            time.sleep(0.2)
            try:
                simulation.advance(1e5)
            except RuntimeError as error:
                refused.append(str(error))
            results.append(run(CASE2, {"duration": 1}).tobytes())
            os.kill(os.getpid(), signal.SIGINT)

        thread = threading.Thread(target=other)
        thread.start()
        self.assertRaises(KeyboardInterrupt, simulation.advance, 1e5)
        thread.join()
        self.assertEqual(results, [run(CASE2, {"duration": 1}).tobytes()])
        self.assertEqual(refused, ["another thread advances this simulation; each thread needs its own"])

    def test_help_and_types_name_all(self):
        stub = {}
        exec((Path(youbot_base_sim.__file__).parent / "__init__.pyi").read_text(), stub)
        for name in "Simulation", "Batch", "run", "simulate_many":
            real, typed = getattr(youbot_base_sim, name), stub[name]
            self.assertGreater(len(inspect.getdoc(real)), 20, name)
            if inspect.isclass(real):
                members = {member for member in dir(real) if not member.startswith("_")}
                self.assertEqual(members, {member for member in [*dir(typed), "torque"] if not member.startswith("_")})
                for member in members:
                    doc, typing = inspect.getdoc(getattr(real, member)), getattr(typed, member, None)
                    self.assertGreater(len(doc), 5, f"{name}.{member}")
                    if inspect.isfunction(typing):  # functions in C++ say their arguments in the first line of the doc
                        stated = re.findall(r"(\w+): ", doc.split(" ->")[0]) if "(self: " in doc else inspect.signature(
                            getattr(real, member)).parameters
                        self.assertEqual(list(stated), list(inspect.signature(typing).parameters), member)
        self.assertRegex(Simulation.state.__doc__, r"dphi \(4,\) rad/s")


if __name__ == "__main__":
    unittest.main()
