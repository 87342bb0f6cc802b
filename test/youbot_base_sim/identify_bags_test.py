"""scripts/identify: bags as recorders write them become tables of what was driven, and odd ones a line.

Usage: identify_bags_test.py DEVEL      the devel space
"""
import contextlib
import csv
import io
import math
import os
import signal
import subprocess
import sys
import time
import unittest
from types import SimpleNamespace

import numpy as np
import rosbag
from geometry_msgs.msg import Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion, TransformStamped, Twist
from harness import RunsAnalyse, odometry, stamp_of
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

DEVEL = None
WHEELS = ("fl", "fr", "bl", "br")
RADIUS, LENGTHS = 0.052, 0.4  # m, of the base that is recorded
RATE = 50
# V_X, V_Y, Omega; each for a second
VELOCITIES = ((0, 0, 0), (0.1, 0, 0), (-0.2, 0, 0), (0, 0.1, 0), (0, 0, 0.4), (0.1, 0.05, -0.2), (0, -0.2, 0),
              (0.05, 0, -0.05), (0, 0, 0))
START = np.array((100., 200, 300, 400))  # rad
MARKER, FRAME, CLOCK = (0.12, -0.07, 0.5), (2, -1, 2.5), 0.137  # on the base, its frame (m, m, rad); s that it is early
ARRIVAL = 2e-3  # s, from a stamp to the recorder


def rates_of(V_X, V_Y, Omega, radius=RADIUS, lengths=LENGTHS):
    turn = lengths * Omega
    return np.array((V_X - V_Y - turn, V_X + V_Y + turn, V_X + V_Y - turn, V_X - V_Y + turn)) / radius


def placed(frame, pose):
    c, s = math.cos(frame[2]), math.sin(frame[2])
    return np.array((frame[0] + c * pose[0] - s * pose[1], frame[1] + s * pose[0] + c * pose[1], frame[2] + pose[2]))


def put(p, q, pose, tilt=0):
    p.x, p.y, half = pose[0], pose[1], pose[2] / 2
    q.x, q.y = math.sin(tilt / 2) * math.cos(half), math.sin(tilt / 2) * math.sin(half)
    q.z, q.w = math.cos(tilt / 2) * math.sin(half), math.cos(tilt / 2) * math.cos(half)


def seen(kind, t, pose, tilt):
    message = kind()
    message.header.stamp = stamp_of(t)
    body = {PoseStamped: lambda: message.pose, PoseWithCovarianceStamped: lambda: message.pose.pose}.get(kind)
    if body:
        put(body().position, body().orientation, pose, tilt)
    else:
        put(message.transform.translation, message.transform.rotation, pose, tilt)
        message.header.frame_id, message.child_frame_id = "mocap", "body"
    return message


class IdentifyBagsTest(RunsAnalyse):
    def record(self, name="x.bag", odom=True, truth=False, tracker=None, tilt=0.0, unseen=(-1, -1), gap=(-1, -1),
               velocities=True, effort=True, names=None, turns=np.ones(4), signs=np.ones(4), stamps=True, arm=False,
               joints="/joint_states", start=0.0, velocities_of_base=VELOCITIES, noise=0.0):
        """A bag of wheels that follow at once and need 0.3 N m, of a base that is where its odometry says."""
        phi, pose = START.copy(), np.array((0., 0, 3))  # the heading passes pi
        with rosbag.Bag(self.path(name), "w") as bag:
            for k, velocity in enumerate(velocities_of_base):
                twist = Twist()
                twist.linear.x, twist.linear.y, twist.angular.z = velocity
                bag.write("/cmd_vel", twist, stamp_of(start + k + 0.005))
            for k in range(RATE * len(velocities_of_base)):
                t, velocity = start + k / RATE, np.array(velocities_of_base[k // RATE])
                rates, arrival = rates_of(*velocity), stamp_of(t + ARRIVAL)
                marker = placed(FRAME, placed(pose, MARKER))
                if tracker and not unseen[0] <= t < unseen[1]:
                    message = seen(tracker if tracker is not TFMessage else TransformStamped, t - CLOCK, marker, tilt)
                    is_link = tracker is TFMessage
                    bag.write("/tf" if is_link else "/mocap/base/pose", TFMessage([message]) if is_link else message,
                              arrival)
                middle = pose[2] + velocity[2] / RATE / 2
                before = pose.copy()
                pose += np.array((math.cos(middle) * velocity[0] - math.sin(middle) * velocity[1],
                                  math.sin(middle) * velocity[0] + math.cos(middle) * velocity[1],
                                  velocity[2])) / RATE
                if not gap[0] <= t < gap[1]:
                    order, message = (2, 0, 3, 1), JointState()
                    if stamps:
                        message.header.stamp = stamp_of(t)
                    message.name = [(names or ["wheel_joint_" + wheel for wheel in WHEELS])[i] for i in order]
                    message.position = [phi[i] / turns[i] for i in order]
                    message.velocity = [signs[i] * rates[i] for i in order] if velocities else []
                    message.effort = [signs[i] * math.copysign(0.3, rates[i]) for i in order] if effort else []
                    bag.write(joints, message, arrival)
                if arm:
                    bag.write(joints, JointState(name=["arm_joint_1"], position=[1], velocity=[1], effort=[1]), arrival)
                if odom:
                    bag.write("/odom", odometry(t, before, velocity + noise * math.sin(17 * k)), arrival)
                if truth:
                    bag.write("/mocap/ground_truth", odometry(t, before, velocity), arrival)
                phi += rates / RATE
        return self.path(name)

    def read(self, path, base=None, **options):
        """{group: (times, values)} of the table, and in self.said what is printed."""
        from youbot_base_sim.base import Base
        from youbot_base_sim.identify import table_of
        arguments = SimpleNamespace(**{**dict(encoders=False, quiet=False, topic=(), namespace=None, frames=(),
                                              truth=None, clock_offset=(), publisher=()), **options})
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            text = table_of(path, base or Base(RADIUS, half_wheelbase=LENGTHS, half_track=0), arguments)
        self.said = out.getvalue()
        names, *rows = csv.reader(text.splitlines())
        table = np.array([[float(cell or "nan") for cell in row] for row in rows])
        self.assertTrue((np.diff(table[:, 0]) >= 0).all())
        groups = {}
        for group, last in (("phi_fl", "phi_br"), ("dphi_fl", "dphi_br"), ("torque_fl", "torque_br"),
                            ("command_fl", "command_br"), ("x", "psi")):
            if group in names:
                values = table[:, names.index(group):names.index(last) + 1]
                there = np.isfinite(values).all(axis=1)
                groups[group.split("_")[0]] = table[there, 0], values[there]
        return groups

    def expect_refused(self, path, *words, **options):
        from youbot_base_sim.command_line import Refused
        with self.assertRaises(Refused) as refusal:
            self.read(path, **options)
        for word in (os.path.basename(path), *words):
            self.assertIn(word, str(refusal.exception))
        self.assertNotIn("\n", str(refusal.exception))

    def test_wheels_in_their_order(self):
        table = self.read(self.record())
        t, phi = table["phi"]
        self.assertEqual(len(t), RATE * len(VELOCITIES))
        np.testing.assert_allclose(t - t[0], np.arange(len(t)) / RATE, atol=1e-6)
        np.testing.assert_array_equal(phi[0], START)
        np.testing.assert_allclose(table["dphi"][1][4 * RATE + 10], rates_of(*VELOCITIES[4]), atol=1e-12)
        np.testing.assert_allclose(table["torque"][1][4 * RATE + 10], (-0.3, 0.3, -0.3, 0.3), atol=1e-12)
        self.assertNotIn("x", table)

    def test_commands_by_the_lengths_of_odometry(self):
        for options in (dict(), dict(signs=np.array((-1, 1, -1, 1)))):
            table = self.read(self.record(**options))
            t, commands = table["command"]
            np.testing.assert_allclose(t - table["phi"][0][0], np.arange(len(VELOCITIES)) + 0.005, atol=1e-6)
            np.testing.assert_allclose(commands, [rates_of(*one) for one in VELOCITIES], atol=1e-9)
            np.testing.assert_allclose(table["dphi"][1][75], rates_of(*VELOCITIES[1]), atol=1e-12)
            np.testing.assert_allclose(table["torque"][1][75], 0.3, atol=1e-12)
        commands = self.read(self.record(odom=False))["command"][1]
        np.testing.assert_allclose(commands[5], rates_of(*VELOCITIES[5], 0.0475, 0.385), atol=1e-12)

    def test_ground_truth_with_its_heading_unwrapped(self):
        table = self.read(self.record(truth=True))
        t, poses = table["x"]
        np.testing.assert_allclose(t, table["phi"][0], atol=1e-9)
        self.assertAlmostEqual(poses[5 * RATE][2], 3.4, delta=1e-6)

    def test_ground_truth_of_a_marker_is_moved_onto_the_base(self):
        for tracker in (PoseStamped, PoseWithCovarianceStamped, TransformStamped, TFMessage):
            frames = dict(frames=("mocap", "/body"), truth="marker") if tracker is TFMessage else {}
            table = self.read(self.record(tracker=tracker, unseen=(6.2, 6.7)), **frames)
            t, poses = table["x"]
            t = t - table["phi"][0][0]
            self.assertEqual(len(t), RATE * len(VELOCITIES) - RATE // 2)
            self.assertAlmostEqual(t[10], 10 / RATE, delta=5e-3)
            self.assertIn("a gap of 0.52", self.said)
            self.assertRegex(self.said, r"clock +\+0\.13.* s are added")
            self.assertRegex(self.said, r"marker on the base +x 0\.1")
            for k in range(RATE, len(t) - 25, 25):  # moves of the base in its own frame
                middle = t[k] + 0.25
                if abs(middle - round(middle)) < 0.26 or t[k + 5] - t[k] > 0.2:
                    continue  # the velocity changes, or the marker was not seen
                velocity, step = np.array(VELOCITIES[int(middle)]), poses[k + 5] - poses[k]
                span, c, s = t[k + 5] - t[k], math.cos(poses[k + 2][2]), math.sin(poses[k + 2][2])
                moved = (c * step[0] + s * step[1], c * step[1] - s * step[0], step[2])
                np.testing.assert_allclose(moved, velocity * span, atol=3e-4)

    def test_ground_truth_that_does_not_tell_is_left_out(self):
        for options, words in ((dict(gap=(0.5, 8.4)), "ground truth is not used"),
                               (dict(tilt=math.pi / 2), "its z axis is 90 deg off the vertical")):
            self.assertNotIn("x", self.read(self.record(tracker=PoseStamped, **options)))
            self.assertIn(words, self.said)
        bag = self.record("two.bag", tracker=PoseStamped)
        with rosbag.Bag(bag, "a") as more:
            more.write("/mocap/other/pose", PoseStamped(pose=Pose(orientation=Quaternion(w=1))), stamp_of(1))
        self.assertIn("x", self.read(bag))
        self.assertIn("uses /mocap/base/pose, not /mocap/other/pose", self.said)
        self.expect_refused(bag, "ground_truth=/odometry: must be a topic of type",
                            topic=[("ground_truth", "/odometry")])
        self.assertNotIn("x", self.read(bag, frames=("mocap", "body")))
        self.assertIn("no transforms from mocap to body", self.said)

    def test_one_drive_alone(self):
        for t, is_refused in ((3.5, True), (-1, False)):
            bag = self.record("put.bag")
            with rosbag.Bag(bag, "a") as more:
                more.write("/robot/state_set", odometry(t, (1, 2, 3), (0, 0, 0)), stamp_of(t))
                more.write("/state_set", odometry(t, (1, 2, 3), (0, 0, 0)), stamp_of(t))
            if is_refused:
                self.expect_refused(bag, "the base was put elsewhere at t = 3.498 s, by /state_set: must be one drive")
            else:
                self.assertEqual(len(self.read(bag)["phi"][0]), RATE * len(VELOCITIES))
        with rosbag.Bag(bag, "a") as more:
            more.write("/base/base_controller/torques_command", Twist(), stamp_of(3))
        self.expect_refused(bag, "has torques_command")
        self.read(bag, encoders=True)

    def test_a_base_of_other_sizes_is_refused(self):
        from youbot_base_sim.base import Base
        larger = Base(1.5 * RADIUS, half_wheelbase=LENGTHS, half_track=0)
        for options, words in ((dict(), "/odom: the base moves forward 0.667"),
                               (dict(odom=False), "ground_truth: the base moves forward 0.667"),
                               (dict(odom=False, truth=False, tracker=PoseStamped), "pose: the base moves forward 0.67")):
            bag = self.record(**{**dict(truth=True), **options})
            self.read(bag)
            self.expect_refused(bag, words, "--scene", base=larger)

    def test_a_direction_that_was_not_driven_is_not_judged(self):
        directions = [(V_X, V_Y, 0) for V_X, V_Y, _ in VELOCITIES]
        for velocities in (directions, [(V_X, 0, 0) for V_X, _, _ in VELOCITIES]):
            for noise in (0, 1e-4):
                table = self.read(self.record(truth=True, velocities_of_base=velocities, noise=noise))
                np.testing.assert_allclose(table["command"][1][1], rates_of(*velocities[1]), rtol=1e-3)
                self.assertIn("x", table)

    def test_encoders_of_other_bases(self):
        from youbot_base_sim.base import Base
        names, unit = ("front_left", "front_right", "rear_left", "rear_right"), 2 * math.pi / 1440
        turns = np.array((-unit, unit, -unit, unit))
        bag = self.record(velocities=False, effort=False, names=names, turns=turns)
        base = Base(RADIUS, half_wheelbase=LENGTHS, half_track=0, joints=names, turns=tuple(turns))
        table = self.read(bag, base)
        np.testing.assert_allclose(table["phi"][1][0], START)
        self.assertEqual(sorted(table), ["command", "phi"])
        self.assertIn("it has no velocities", self.said)
        self.expect_refused(bag, "has the joints rear_left, front_left, rear_right, front_right, not the wheels",
                            "--joints")

    def test_arrival_where_stamps_are_not_set(self):
        table = self.read(self.record(stamps=False))
        start = table["phi"][0][0]
        self.assertAlmostEqual(table["phi"][0][1] - start, 1 / RATE, delta=1e-6)
        self.assertAlmostEqual(table["command"][0][1] - start, 1.005 - ARRIVAL, delta=1e-6)

    def test_any_namespace_and_no_arm(self):
        self.assertEqual(len(self.read(self.record(joints="/youbot/base/joint_states", arm=True))["phi"][0]),
                         RATE * len(VELOCITIES))

    def test_the_program_fits_a_cut_bag_and_says_what_it_read(self):
        bag = self.record(effort=False)  # which has less to fit
        program, scene = os.path.join(DEVEL, "lib", "youbot_base_sim", "identify"), self.path("scene.yaml")
        with open(scene, "w") as file:
            file.write(f"duration: 1\nrobot: {{profile: measured, wheel_radius: {RADIUS}, "
                       f"half_wheelbase: {LENGTHS - 0.15}}}\n")
        os.truncate(bag, os.path.getsize(bag) - 1000)
        ran = subprocess.run([program, bag, "--scene", scene, "-o", self.path("fitted.yaml")], capture_output=True,
                             text=True, timeout=200)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""), ran.stdout)
        self.assertIn("note: " + bag + " has no complete index", ran.stdout)
        self.assertRegex(ran.stdout, "joint_states +/joint_states: 450, 50 Hz")
        self.assertIn("no effort in joint_states", ran.stdout)
        with open(self.path("fitted.yaml")) as file:
            self.assertIn(f"# By identify, from {bag}. Error", file.readline())
        for out in (">&-", "> /dev/full"):
            ran = subprocess.run(["bash", "-c", f'"$@" {out}', "", program, bag, "--scene", scene, "-o",
                                  self.path("full.yaml")], capture_output=True, text=True, timeout=200)
            self.assertEqual((ran.returncode, ran.stderr),
                             (1, "identify: standard output: cannot be written: Bad file descriptor\n"))
            self.assertTrue(os.path.exists(self.path("full.yaml")))
            os.remove(self.path("full.yaml"))
        for arguments, words in (((), "BAG"), (("--colour",), "--help"), ((self.path("none"),), "none: No such file"),
                                 ((bag, "--frames", "a"), "FIXED,BODY"), ((bag, "--ticks", "0"), "must be a number"),
                                 ((bag, "--scene", scene, "-o", bag), "must not be a file that is read")):
            ran = subprocess.run([program, *arguments, "--quiet"], capture_output=True, text=True, timeout=100)
            self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (2, "", 1), ran.stderr)
            self.assertTrue(ran.stderr.startswith("identify: "), ran.stderr)
            self.assertIn(words, ran.stderr)

    def test_a_signal_ends_it_in_a_line(self):
        bag, program = self.record(), os.path.join(DEVEL, "lib", "youbot_base_sim", "identify")
        scene = self.path("sizes.yaml")
        with open(scene, "w") as file:
            file.write(f"duration: 1\nrobot: {{wheel_radius: {RADIUS}, half_wheelbase: {LENGTHS - 0.15}}}\n")
        for fits in (False, True):  # while it reads, and amid a fit
            ran = subprocess.Popen([program, bag, "--scene", scene, "-o", self.path("ended.yaml"), "--quiet"],
                                   stderr=subprocess.PIPE, text=True)

            def is_ready(process):
                with open(f"/proc/{process}/status") as status:
                    lines = dict(line.rstrip().partition(":\t")[::2] for line in status)
                return (lines["Name"] == "identify_tables") == fits and int(lines["SigCgt"], 16) >> 14 & 1
            while not is_ready(ran.pid):
                time.sleep(1e-3)
            ran.send_signal(signal.SIGTERM)
            self.assertEqual(ran.communicate(timeout=60)[1], "identify: stopped by signal 15, Terminated\n")
            self.assertEqual(ran.returncode, 1)
        self.assertFalse(os.path.exists(self.path("ended.yaml")))


if __name__ == "__main__":
    DEVEL = os.path.abspath(sys.argv.pop(1))
    unittest.main()
