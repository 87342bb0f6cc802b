"""Lets tests import the package of src/, as the programs of scripts/ do, and studies."""
import contextlib
import csv
import importlib
import io
import math
import os
import shutil
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
STUDY = ROOT / "scripts" / "study"
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT)]


WHEELS = ("fl", "fr", "bl", "br")
JOINTS = ["wheel_joint_" + wheel for wheel in WHEELS]


def rolling_rates(V_X, V_Y, Omega, radius=0.05, lengths=0.385):
    """rad/s, of the four wheels; of numbers or arrays."""
    turn = lengths * Omega
    return np.stack([V_X - V_Y - turn, V_X + V_Y + turn, V_X + V_Y - turn, V_X - V_Y + turn], -1) / radius


def placed(frame, pose):
    """Poses in a frame, as poses in the frame around it."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    return np.array((frame[0] + c * pose[0] - s * pose[1], frame[1] + s * pose[0] + c * pose[1], frame[2] + pose[2]))


def path_of(velocities, rate, start=(0, 0, 0)):
    """Poses at which a base begins its steps, `rate` a second, of these velocities in its own frame."""
    V_X, V_Y, Omega = np.transpose(velocities) / rate
    psi = start[2] + np.cumsum(Omega) - Omega
    steps = (V_X + 1j * V_Y) * np.exp(1j * (psi + Omega / 2))
    way = start[0] + 1j * start[1] + np.cumsum(steps) - steps
    return np.stack([way.real, way.imag, psi], -1)


def stamp_of(t):
    import genpy
    return genpy.Time(1700000000) + genpy.Duration.from_sec(t)


def twist(V_X, V_Y, Omega):
    from geometry_msgs.msg import Twist, Vector3
    return Twist(Vector3(V_X, V_Y, 0), Vector3(0, 0, Omega))


def odometry(t, pose, velocity=(0, 0, 0)):
    from nav_msgs.msg import Odometry
    message = Odometry()
    message.header.stamp = stamp_of(t)
    put(message.pose.pose.position, message.pose.pose.orientation, pose)
    message.twist.twist = twist(*velocity)
    return message


def joint_state(t, position, velocity=(), effort=(), names=JOINTS):
    from sensor_msgs.msg import JointState
    message = JointState(None, names, position, velocity, effort)
    message.header.stamp = stamp_of(t)
    return message


def put(p, q, pose, tilt=0):
    """Fills position and quaternion in from x, y, heading; or x, y, z, heading."""
    (p.x, p.y, *z), half = pose[:-1], pose[-1] / 2
    p.z = z[0] if z else 0
    q.x, q.y = math.sin(tilt / 2) * math.cos(half), math.sin(tilt / 2) * math.sin(half)
    q.z, q.w = math.cos(tilt / 2) * math.sin(half), math.cos(tilt / 2) * math.cos(half)


def seen(kind, t, pose, tilt=0):
    """A tracker's message of a body: PoseStamped, PoseWithCovarianceStamped, or TransformStamped from mocap to body."""
    message = kind()
    message.header.stamp = stamp_of(t)
    if hasattr(message, "transform"):
        put(message.transform.translation, message.transform.rotation, pose, tilt)
        message.header.frame_id, message.child_frame_id = "mocap", "body"
    else:
        body = getattr(message.pose, "pose", message.pose)
        put(body.position, body.orientation, pose, tilt)
    return message


class RunsPrograms(unittest.TestCase):
    """Runs programs of scripts/ on bags in a folder of its own."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def runs(self, program, *arguments, status=0):
        """Runs its main, which must end with one of these statuses; keeps what it says."""
        from youbot_base_sim import command_line
        main, out, err = importlib.import_module("youbot_base_sim." + program).main, io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), \
                unittest.mock.patch("sys.argv", [program, *arguments]):
            self.status = command_line.run(program, main)
        self.program, self.out, self.err = program, out.getvalue(), err.getvalue()
        self.assertIn(self.status, status if isinstance(status, tuple) else (status,), self.out + self.err)

    def analyse(self, *arguments, status=0):
        self.runs("analyse", *arguments, status=status)

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
        self.assertRegex(self.err, rf"\A{self.program}: .*\n\Z")
        for word in words:
            self.assertIn(word, self.err)
