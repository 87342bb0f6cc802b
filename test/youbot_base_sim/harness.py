"""Lets tests import the package of src/, as the programs of scripts/ do, and studies."""
import contextlib
import csv
import io
import math
import os
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STUDY = ROOT / "scripts" / "study"
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT)]


def stamp_of(t):
    import genpy
    return genpy.Time(1700000000) + genpy.Duration.from_sec(t)


def odometry(t, pose, twist=(0, 0, 0)):
    from nav_msgs.msg import Odometry
    message = Odometry()
    message.header.stamp = stamp_of(t)
    message.pose.pose.position.x, message.pose.pose.position.y = pose[0], pose[1]
    message.pose.pose.orientation.z, message.pose.pose.orientation.w = math.sin(pose[2] / 2), math.cos(pose[2] / 2)
    message.twist.twist.linear.x, message.twist.twist.linear.y, message.twist.twist.angular.z = twist
    return message


class RunsAnalyse(unittest.TestCase):
    """Runs scripts/analyse on bags in a folder of its own."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def analyse(self, *arguments, status=0):
        """Runs the script's main; keeps what it says."""
        from youbot_base_sim import analyse, command_line
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            ended = command_line.run("analyse", analyse.main, list(arguments))
        self.out, self.err = out.getvalue(), err.getvalue()
        self.assertEqual(ended, status, self.out + self.err)

    def numbers(self, bag, *arguments, folder="numbers"):
        """{quantity: value} of the summary."""
        folder = self.path(folder)
        shutil.rmtree(folder, ignore_errors=True)
        self.analyse(bag, "--csv", folder, *arguments)
        with open(os.path.join(folder, "summary.csv"), newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len({row["quantity"] for row in rows}), len(rows), "each name once")
        return {row["quantity"]: float(row["value"]) for row in rows if row["value"]}

    def table(self, name, folder="numbers"):
        with open(os.path.join(self.path(folder), name), newline="") as file:
            return list(csv.DictReader(file))

    def one_line(self, *words):
        lines = self.err.splitlines()
        self.assertEqual(len(lines), 1, self.err)
        self.assertTrue(lines[0].startswith("analyse: "), lines[0])
        for word in words:
            self.assertIn(word, lines[0])
