"""check_odometry: faults planted in examples/wheel_odometry.py are found, by name and alone, and right nodes have none.

Usage: check_odometry_test.py SIMULATE ENV.SH      the program, and what sets up the devel space
"""
import csv
import math
import socket
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import genpy
import numpy as np
from sensor_msgs.msg import JointState

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "examples"), str(ROOT / "tools" / "check_odometry")]
from odometry_check import PROGRAMME, Listener  # noqa: E402
from odometry_verdict import judge  # noqa: E402
from wheel_odometry import WheelOdometry  # noqa: E402
from youbot_base_sim.base import DRIVER_RADIUS, JOINTS, WHEELS, Base  # noqa: E402

SIMULATE = ENVIRONMENT = None
BASE = Base()


def drive(model, folder):
    """Rows of the programme's wheel rates on a base of this model, 50 a second."""
    ends = np.cumsum([row[0] for row in PROGRAMME])
    (folder / "rates.csv").write_text("t,fl,fr,bl,br\n" + "".join(
        ",".join(map(str, (t, *BASE.rolling_rates(*row[1:])))) + "\n" for t, row in zip([0, *ends], PROGRAMME)))
    (folder / "scene.yaml").write_text(f"duration: {ends[-1]}\noutput_rate: 50\nrobot: {{profile: measured}}\n"
                                       "drive: {velocity_table: rates.csv}\n")
    subprocess.run([SIMULATE, folder / "scene.yaml", "--model", model, "--quiet", "--csv", folder / "rows.csv"], check=True)
    with open(folder / "rows.csv", newline="") as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


class Faulty(WheelOdometry):
    """The example with a change of the wheels' angles, of what they roll, and of the message."""

    def __init__(self, wheels=None, rolled=None, message=None, late=0):
        super().__init__()
        self.wheels, self.rolled, self.changed, self.late, self.waiting = wheels, rolled, message, late, []

    def motion(self, turned):
        motion = super().motion(self.wheels(*turned) if self.wheels else turned)
        return self.rolled(*motion) if self.rolled else motion

    def message(self, t, twist):
        made = super().message(t, twist)
        if self.changed:
            self.changed(made)
        self.waiting.append((made.pose, made.twist))
        made.pose, made.twist = self.waiting[max(0, len(self.waiting) - 1 - self.late)]
        return made


def in_fixed_frame(message):
    q, v = message.pose.pose.orientation, message.twist.twist.linear
    yaw = 2 * math.atan2(q.z, q.w)
    v.x, v.y = math.cos(yaw) * v.x - math.sin(yaw) * v.y, math.sin(yaw) * v.x + math.cos(yaw) * v.y


def elsewhere(message):
    q, p = message.pose.pose.orientation, message.pose.pose.position
    yaw = 2 * math.atan2(q.z, q.w)
    p.x, p.y = p.x + 0.2 * math.cos(yaw), p.y + 0.2 * math.sin(yaw)
    message.twist.twist.linear.y += 0.2 * message.twist.twist.angular.z


def exchanged(message):
    message.header.frame_id, message.child_frame_id = message.child_frame_id, message.header.frame_id


def stamped(change):
    def set_stamp(message):
        message.header.stamp = change(message.header.stamp)
    return set_stamp


PLANTED = {  # what is found, words of it, and the fault
    "order": ("order of wheels", "takes br for fr", dict(wheels=lambda fl, fr, bl, br: (fl, br, fr, bl))),
    "sign": ("signs of wheels", "bl count backwards", dict(wheels=lambda fl, fr, bl, br: (fl, fr, -bl, br))),
    "driver's velocities": ("signs of wheels", "motors' signs", dict(wheels=lambda fl, fr, bl, br: (-fl, fr, -bl, br))),
    "radius": ("wheel radius", "0.0550 m", dict(wheels=lambda *turned: [1.1 * one for one in turned])),
    "l + h": ("l + h", "0.4235 m", dict(rolled=lambda X, Y, yaw: (X, Y, yaw / 1.1))),
    "handedness": ("handedness", "lateral motion is mirrored", dict(rolled=lambda X, Y, yaw: (X, -Y, yaw))),
    "lateral": ("kinematics", "lateral motion is missing", dict(rolled=lambda X, Y, yaw: (X, 0, yaw))),
    "axes": ("axes", "exchanged", dict(rolled=lambda X, Y, yaw: (Y, X, yaw))),
    "centre": ("centre", "0.200 m ahead and 0.000 m", dict(message=elsewhere)),
    "twist": ("twist", "must be in the child frame", dict(message=in_fixed_frame)),
    "no twist": ("twist", "always zero", dict(message=lambda message: setattr(message, "twist", type(message.twist)()))),
    "frames": ("frames", "exchanged", dict(message=exchanged)),
    "stamps of zero": ("stamps", "are zero", dict(message=stamped(lambda t: genpy.Time()))),
    "wall time": ("stamps", "wall clock", dict(message=stamped(lambda t: t + genpy.Duration(1700000000)))),
    "late": ("stamps", "0.060 s older", dict(late=3)),
}


class CheckOdometry(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            cls.drives = [drive(model, Path(folder)) for model in ("no_slip", "coulomb")]

    def judged(self, make):
        """Findings that are not ok on a node that `make` returns, fed with the drives."""
        records = []
        for rows in self.drives:
            node, heard = make(), Listener.__new__(Listener)
            heard.start()
            end = 0
            for duration, *velocity in PROGRAMME:
                heard.commands += [(t, *velocity) for t in np.arange(end, end + duration, 0.05)]
                end += duration
            for row in rows:
                heard.now = lambda row=row: row["t"]
                joints = JointState(name=list(JOINTS), position=[row["phi_" + wheel] for wheel in WHEELS])
                joints.header.stamp = genpy.Time.from_sec(row["t"])
                heard.take_wheels(joints)
                heard.truth.append([row[key] for key in ("t", "x", "y", "psi")])
                odometry = node.update(joints)
                if odometry:
                    heard.take_odometry(odometry)
            records.append(heard.record())
        findings, lines = judge(*records, BASE)
        self.assertEqual(len(lines), 2)
        return [one for one in findings if one.verdict != "ok"], lines

    def test_a_right_node_has_no_fault_and_slip_is_told_apart(self):
        findings, (rolling, slipping) = self.judged(Faulty)
        self.assertEqual(findings, [])
        self.assertIn("without slip: off by 0 mm and 0 mrad", rolling)
        self.assertRegex(slipping, r"with slip: off by (\d+) mm .* would be by \1 mm")

    def test_the_drivers_radius_is_a_note(self):
        share = DRIVER_RADIUS / BASE.wheel_radius
        (note,), _ = self.judged(lambda: Faulty(wheels=lambda *turned: [share * one for one in turned]))
        self.assertEqual((note.verdict, note.what), ("note", "wheel radius"))

    def test_each_planted_fault_is_found_alone(self):
        for name, (what, words, fault) in PLANTED.items():
            with self.subTest(fault=name):
                findings, _ = self.judged(lambda: Faulty(**fault))
                self.assertEqual([(one.verdict, one.what) for one in findings], [("FAULT", what)], findings)
                self.assertIn(words, findings[0].text)

    def test_as_a_user_runs_it(self):
        with socket.socket() as free:
            free.bind(("localhost", 0))
            port = free.getsockname()[1]
        ran = subprocess.run([ENVIRONMENT, "roslaunch", "-p", str(port), "youbot_base_sim", "check_odometry.launch"],
                             text=True, capture_output=True, timeout=100)
        self.assertIn("  ok     frames          wheel_odom -> base_footprint, not on /tf\n", ran.stdout, ran.stderr)
        self.assertIn("no faults", ran.stdout)


if __name__ == "__main__":
    SIMULATE, ENVIRONMENT = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
