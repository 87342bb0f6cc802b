"""scripts/plot_sweep: indices that are known, tables with gaps, and what is refused."""

import math
import os
import random
import sys
import tempfile
import unittest
from unittest import mock

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from script import load_script  # noqa: E402: the path comes first

SCRIPT, plot_sweep = load_script("plot_sweep")
np = plot_sweep.np


class Indices(unittest.TestCase):
    def test_of_the_ishigami_function(self):
        a, b, c = np.random.default_rng(1).uniform(-math.pi, math.pi, (3, 20000))
        y = np.sin(a) + 7 * np.sin(b) ** 2 + 0.1 * c ** 4 * np.sin(a)
        for axis, index in ((a, 0.314), (b, 0.442), (c, 0)):  # as its integrals give them
            self.assertAlmostEqual(plot_sweep.sobol(axis, y), index, delta=0.02)

    def test_of_a_grid(self):
        a, b = (axis.ravel() for axis in np.meshgrid([0, 1, 2], [0, 1, 2]))
        self.assertAlmostEqual(plot_sweep.sobol(a, 2 * a + b), 0.8, delta=0.1)
        self.assertEqual(plot_sweep.sobol(a, 0 * a), 0)

    def test_of_what_does_not_matter(self):
        a, y = np.random.default_rng(2).uniform(size=(2, 2000))
        self.assertLess(plot_sweep.sobol(a, y), 0.02)

    def test_correlation_is_of_ranks(self):
        x = np.linspace(1, 5, 40)
        self.assertAlmostEqual(plot_sweep.correlation(x, np.exp(x)), 1)
        self.assertAlmostEqual(plot_sweep.correlation(x, -x ** 3), -1)
        self.assertEqual(plot_sweep.correlation(x, 0 * x), 0)
        self.assertEqual(list(plot_sweep.ranks(np.array([5, 1, 5]))), [1.5, 0, 1.5])


class Plots(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.table, self.plot = (os.path.join(folder.name, name) for name in ("t.csv", "p.png"))
        draw = random.Random(3)
        with open(self.table, "w") as file:
            file.write("run,floor.friction,model,status,reliable,x,reason\n")
            for run in range(60):
                friction, model = draw.random(), draw.choice(["viscous", "coulomb"])
                end = "failed,false,,\"tipped, over\"" if run == 7 else "done,true,%r," % (friction + len(model))
                file.write("%d,%r,%s,%s\n" % (run, friction, model, end))

    def run_with(self, *arguments):
        with mock.patch.object(sys, "argv", ["plot_sweep", *arguments]), mock.patch("builtins.print") as printed:
            plot_sweep.main()
        return " ".join(str(argument) for call in printed.call_args_list for argument in call[0])

    def test_each_kind(self):
        self.assertIn("59 of 60 runs", self.run_with("scatter", self.table, self.plot, "floor.friction", "x", "--color", "x"))
        self.assertIn("x: 59 runs", self.run_with("histogram", self.table, self.plot, "x"))
        self.assertRegex(self.run_with("rank", self.table, self.plot, "x"), "runs: +floor.friction +0.9")
        self.run_with("rank", self.table, self.plot, "x", "--by", "correlation")
        self.assertGreater(os.path.getsize(self.plot), 1000)

    def test_refusals(self):
        empty = self.plot + ".csv"
        with open(empty, "w") as file:
            file.write("run,status\n")
        for arguments in (("scatter", self.table, self.plot, "no", "x"), ("histogram", self.table, self.plot, "model"),
                          ("rank", empty, self.plot, "x"), ("rank", SCRIPT, self.plot, "x"),
                          ("rank", self.plot + "none", self.plot, "x")):
            with self.assertRaises(SystemExit) as end:
                self.run_with(*arguments)
            self.assertEqual(end.exception.code, 2)
            self.assertFalse(os.path.exists(self.plot))


if __name__ == "__main__":
    unittest.main()
