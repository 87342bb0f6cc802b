"""scripts/plot_sweep and scripts/plot_identification: indices that are known, tables with gaps, what is refused, what is
written."""
import contextlib
import csv
import io
import math
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
import warnings
from pathlib import Path

import numpy as np
from harness import ROOT

from youbot_base_sim import command_line, plot_identification, plot_sweep


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


class Plots(unittest.TestCase):
    """What holds of all programs that plot; here of a table by sweep."""

    program = plot_sweep

    @staticmethod
    def make_table():
        draw = random.Random(3)
        lines = ["run,floor.friction,model,status,reliable,x,reason"]
        for run in range(60):
            friction, model = draw.random(), draw.choice(["viscous", "coulomb"])
            end = 'failed,false,,"tipped, over"' if run == 7 else f"done,true,{friction + len(model)!r},"
            lines.append(f"{run},{friction!r},{model},{end}")
        return "\n".join(lines) + "\n"

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.table, self.plot = self.folder / "t.csv", self.folder / "p.png"
        self.table.write_text(self.make_table())
        self.name = self.program.__name__.rpartition(".")[2]

    def arguments(self, plot):
        return ["scatter", self.table, plot, "floor.friction", "x"]

    def run_with(self, *arguments, status=0):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            ended = command_line.run(self.name, self.program.main, [*map(str, arguments)])
        self.assertEqual(ended, status, err.getvalue())
        self.assertEqual(err.getvalue().count("\n"), 1 if status else 0)
        return err.getvalue() if status else out.getvalue()

    def files(self):
        return sorted(path.name for path in self.folder.iterdir())

    def test_what_is_read_is_never_written(self):
        content = self.table.read_bytes()
        for link in (os.symlink, os.link, None):
            plot = self.table
            if link:
                plot = self.plot
                link(self.table, plot)
            said = self.run_with(*self.arguments(plot), status=2)
            self.assertIn(f"PLOT = {plot}: must not be a file that is read", said)
            self.assertEqual(self.table.read_bytes(), content)
            if link:
                plot.unlink()

    def test_a_plot_is_whole_or_not_there(self):
        """On a disk that has no room, an older plot stays."""
        self.assertIn("/dev/full: cannot be written: no space left for it", self.run_with(*self.arguments("/dev/full"),
                                                                                          status=1))
        for older in (None, b"older"):
            if older:
                self.plot.write_bytes(older)
            before = self.files()
            ran = subprocess.run(
                [sys.executable, ROOT / "scripts" / self.name, *self.arguments(self.plot)], capture_output=True,
                text=True, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (99, 99)))
            self.assertEqual((ran.returncode, ran.stderr), (
                1, f"{self.name}: {self.plot}: cannot be written: no space left for it (File too large)\n"))
            self.assertEqual(self.files(), before)
        self.assertEqual(self.plot.read_bytes(), older)

    def test_what_is_read_is_a_file_or_a_pipe_that_ends(self):
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        for table, words in ((pipe, "is a pipe without a writer"), ("/dev/zero", "is neither a file nor a pipe")):
            arguments = [table if one == self.table else one for one in self.arguments(self.plot)]
            self.assertIn(f"{self.name}: {table}: {words}; must be a", self.run_with(*arguments, status=2))
        self.assertFalse(self.plot.exists())

    def test_where_nothing_can_be_written_nothing_is_drawn(self):
        for plot, words in ((self.folder, "Is a directory"), (self.folder / "none" / "p.png", "No such file"),
                            (self.folder / "p.xyz", "'xyz' is not supported")):
            self.assertIn(words, self.run_with(*self.arguments(plot), status=2))
        self.assertEqual(self.files(), ["t.csv"])


class SweepPlots(Plots):
    def test_other_formats(self):
        for ending, begin in (("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")):
            self.run_with(*self.arguments(self.folder / f"p.{ending}"))
            self.assertTrue((self.folder / f"p.{ending}").read_bytes().startswith(begin))

    def test_each_kind(self):
        self.assertIn("59 of 60 runs", self.run_with(*self.arguments(self.plot), "--color", "x"))
        self.assertIn("x: 59 runs", self.run_with("histogram", self.table, self.plot, "x"))
        self.assertRegex(self.run_with("rank", self.table, self.plot, "x"), "runs:\n +floor.friction +0.9")
        self.assertRegex(self.run_with("effects", self.table, self.plot, "x"),
                         "x, floor.friction: means of 7 slices from 7.* to 7.*\nx, model: means of 2 slices")
        self.assertGreater(self.plot.stat().st_size, 1000)

    def test_refusals(self):
        empty = self.folder / "empty.csv"
        empty.write_text("run,status\n")
        for arguments in (("scatter", self.table, self.plot, "no", "x"), ("histogram", self.table, self.plot, "model"),
                          ("rank", empty, self.plot, "x"), ("rank", __file__, self.plot, "x"),
                          ("rank", self.folder / "none", self.plot, "x"), ("rank", self.table, "", "x"),
                          ("pie", self.table, self.plot, "x")):
            self.run_with(*arguments, status=2)
            self.assertFalse(self.plot.exists())

    def test_names_are_shown_as_they_are(self):
        """A "$" begins no mathematics, and control characters reach neither terminal nor picture."""
        table = self.folder / "m$x_$.csv"
        table.write_text(self.table.read_text().replace("floor.friction", "a$\x1b[31m$"))
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of glyphs that are missing
            for kind in ("rank", "effects", "histogram"):
                self.assertNotIn("\x1b", self.run_with(kind, table, self.plot, "x"))
                self.assertTrue(self.plot.exists())

    def test_columns_are_shown_in_words(self):
        table = (ROOT / "tools" / "sweep" / "src" / "quantities.cpp").read_text()
        quantities = re.findall(r'^ +{"(\w+)", "', table, re.MULTILINE)
        self.assertEqual(set(quantities), set(plot_sweep.QUANTITIES))
        for name, words in (("largest_slip", "largest slip speed, m/s"), ("floor.friction", "floor: friction"),
                            ("initial.wheel_angles[3]", "initial: wheel angles, back right, rad"),
                            ("own", "own"), ("loads[0].position[1]", "loads[0]: position, y, m"),
                            ("initial.pose[2]", "initial: pose, 2, rad"), ("duration", "duration, s"),
                            ("wrenches[0].force[3]", "wrenches[0]: force, 3, N")):
            self.assertEqual(plot_sweep.label(name), words)

    def test_keys_have_their_units(self):
        with open(ROOT / "docs" / "limits" / "scenes.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertGreater(len(rows), 70)
        for row in rows:
            key, named = row["key"].replace("[]", "[0]"), row["unit"].split(" or ")
            if "reference_motion" in key:
                self.assertIn(plot_sweep.unit(key), named, key)
            else:
                self.assertEqual({plot_sweep.unit(f"{key}[{index}]") for index in (0, 2)}, set(named), key)

    def test_tables_that_tell_nothing(self):
        for lines, arguments, words in (
                (["run,status,x", "0,done,1"], ["rank", "x"], "no axes; must have a column between run and status"),
                (["run,a,status,x", "0,1,done,", "1,,done,1"], ["scatter", "a", "x"],
                 "columns a and x: must both have a number in some run"),
                (["run,a,status", "0,1e308,done", "1,-1e308,done"], ["histogram", "a"],
                 "column = a: must have numbers, up to 1e+150"),
                (["run,a,status,x", "0,1,done,1", "1,2,done,2"], ["rank", "x"],
                 "2 runs have x: rank needs at least 10"),
                (["run,a,status", "0,1"], ["rank", "a"], "line 2 has 2 cells instead of 3; must be a table by sweep"),
                (["a,b", "0,1"], ["rank", "a"], "no columns run and status; must be a table by sweep")):
            self.table.write_text("\n".join(lines) + "\n")
            kind, *columns = arguments
            self.assertIn(words, self.run_with(kind, self.table, self.plot, *columns, status=2))
        self.assertEqual(self.files(), ["t.csv"])

    def test_a_byte_order_mark_and_blank_lines_are_passed_over(self):
        expected = self.run_with("rank", self.table, self.plot, "x")
        self.table.write_text("\ufeff\n" + self.table.read_text().replace("\n", "\n\n"))
        self.assertEqual(self.run_with("rank", self.table, self.plot, "x"), expected)


class IdentificationPlot(Plots):
    program = plot_identification

    @staticmethod
    def make_table():
        names = [f"{fitted}{series}_{mode}" for fitted in ("", "fitted_") for series in ("rate", "torque")
                 for mode in ("ahead", "sideways", "turning")]
        rows = [[0.1 * k, int(3 < k < 6), *(math.sin(k + i) for i in range(len(names)))] for k in range(9)]
        return "\n".join([",".join(["t", "held_out", *names]), *(",".join(map(repr, row)) for row in rows)]) + "\n"

    def arguments(self, plot):
        return [self.table, plot]

    def test_refusals(self):
        whole = self.table.read_text()
        for text, words in (("", "no rows"), (whole.replace("held_out", "held"), "no column 'held_out'"),
                            (whole.replace("0.1", "x"), "could not convert")):
            self.table.write_text(text)
            self.assertIn(words, self.run_with(*self.arguments(self.plot), status=2))
        self.assertIn("No such file", self.run_with(self.folder / "none", self.plot, status=2))
        self.assertEqual(self.files(), ["t.csv"])

    def test_grey_is_what_was_held_out(self):
        spans = []
        axis = unittest.mock.Mock(axvspan=lambda begin, end, **_: spans.append((begin, end)))
        plot_identification.shade_held_out(axis, np.arange(6.0), np.array([1, 0, 1, 1, 0, 1]))
        self.assertEqual(spans, [(0, 1), (2, 4), (5, 5)])


del Plots  # the tests are those of its subclasses


if __name__ == "__main__":
    unittest.main()
