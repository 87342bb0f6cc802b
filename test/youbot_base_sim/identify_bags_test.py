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
from geometry_msgs.msg import PoseStamped, Twist
from harness import RunsPrograms, joint_state, odometry, path_of, placed, rolling_rates, seen, stamp_of, twist

PROGRAM = None
SIZES = RADIUS, LENGTHS = 0.052, 0.4  # m, of the base that is recorded
RATE = 50
# V_X, V_Y, Omega; each for a second
VELOCITIES = ((0, 0, 0), (0.1, 0, 0), (-0.2, 0, 0), (0, 0.1, 0), (0, 0, 0.4), (0.1, 0.05, -0.2), (0, -0.2, 0),
              (0.05, 0, -0.05), (0, 0, 0))
START = np.array((100., 200, 300, 400))  # rad
MARKER, FRAME, CLOCK = (0.12, -0.07, 0.5), (2, -1, 2.5), 0.137  # on the base, its frame (m, m, rad); s that it is early
JOINTS = ["wheel_joint_" + wheel for wheel in ("bl", "fl", "br", "fr")]
ORDER = [2, 0, 3, 1]  # of these in fl, fr, bl, br


class IdentifyBagsTest(RunsPrograms):
    def record(self, odom=True, truth=False, marker=False, velocities=True, effort=True, signs=(1, 1, 1, 1),
               motions=VELOCITIES, noise=0.0):
        """A bag of wheels that follow at once and need 0.3 N m, of a base that is where its odometry says."""
        motion = np.repeat(motions, RATE, axis=0)
        poses, rates = path_of(motion, RATE, (0, 0, 3)), rolling_rates(*motion.T, *SIZES)  # the heading passes pi
        turned = START + (np.cumsum(rates, axis=0) - rates) / RATE
        with rosbag.Bag(self.path("x.bag"), "w") as bag:
            for k, one in enumerate(motions):
                bag.write("/cmd_vel", twist(*one), stamp_of(k + 0.005))
            for k, (velocity, pose, phi, dphi) in enumerate(zip(motion, poses, turned, rates)):
                states = joint_state(k / RATE, phi[ORDER], (signs * dphi)[ORDER] if velocities else (),
                                     (signs * np.copysign(0.3, dphi))[ORDER] if effort else (), JOINTS)
                told = odometry(k / RATE, pose, velocity + noise * math.sin(17 * k))
                where = seen(PoseStamped, k / RATE - CLOCK, placed(FRAME, placed(pose, MARKER)))
                for topic, message, is_there in (("/joint_states", states, True), ("/odom", told, odom),
                                                 ("/mocap/ground_truth", told, truth), ("/mocap/pose", where, marker)):
                    if is_there:
                        bag.write(topic, message, stamp_of(k / RATE + 2e-3))
        return self.path("x.bag")

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
        np.testing.assert_allclose(table["dphi"][1][4 * RATE + 10], rolling_rates(*VELOCITIES[4], *SIZES), atol=1e-12)
        np.testing.assert_allclose(table["torque"][1][4 * RATE + 10], (-0.3, 0.3, -0.3, 0.3), atol=1e-12)
        self.assertNotIn("x", table)
        self.assertEqual(sorted(self.read(self.record(velocities=False, effort=False))), ["command", "phi"])

    def test_commands_by_the_lengths_of_odometry(self):
        for options in (dict(), dict(signs=(-1, 1, -1, 1))):
            table = self.read(self.record(**options))
            t, commands = table["command"]
            np.testing.assert_allclose(t - table["phi"][0][0], np.arange(len(VELOCITIES)) + 0.005, atol=1e-6)
            np.testing.assert_allclose(commands, [rolling_rates(*one, *SIZES) for one in VELOCITIES], atol=1e-9)
            np.testing.assert_allclose(table["dphi"][1][75], rolling_rates(*VELOCITIES[1], *SIZES), atol=1e-12)
            np.testing.assert_allclose(table["torque"][1][75], 0.3, atol=1e-12)
        commands = self.read(self.record(odom=False))["command"][1]
        np.testing.assert_allclose(commands[5], rolling_rates(*VELOCITIES[5], 0.0475, 0.385), atol=1e-12)

    def test_ground_truth_with_its_heading_unwrapped(self):
        table = self.read(self.record(truth=True))
        t, poses = table["x"]
        np.testing.assert_allclose(t, table["phi"][0], atol=1e-9)
        self.assertAlmostEqual(poses[5 * RATE][2], 3.4, delta=1e-6)

    def test_ground_truth_of_a_marker_is_moved_onto_the_base(self):
        table = self.read(self.record(marker=True))
        t, poses = table["x"]
        self.assertAlmostEqual(t[10] - table["phi"][0][0], 10 / RATE, delta=5e-3)
        self.assertRegex(self.said, r"clock +\+0\.13.* s are added")
        self.assertRegex(self.said, r"marker on the base +x 0\.1")
        for k, velocity in enumerate(VELOCITIES):  # moves of the base in its own frame, in the midst of each motion
            a, b = poses[k * RATE + 20], poses[k * RATE + 30]
            moved = placed((0, 0, -(a[2] + b[2]) / 2), b - a)[:2]
            np.testing.assert_allclose([*moved, b[2] - a[2]], np.multiply(velocity, 10 / RATE), atol=3e-4)
        self.assertNotIn("x", self.read(self.record(marker=True), frames=("mocap", "body")))
        self.assertIn("ground truth is not used: no transforms from mocap to body", self.said)

    def test_one_drive_alone(self):
        bag = self.record()
        with rosbag.Bag(bag, "a") as more:
            for topic in ("/robot/state_set", "/state_set"):
                more.write(topic, odometry(3.5, (1, 2, 3)), stamp_of(3.5))
        self.expect_refused(bag, "the base was put elsewhere at t = 3.498 s, by /state_set: must be one drive")
        with rosbag.Bag(self.record(), "a") as more:
            more.write("/base/base_controller/torques_command", Twist(), stamp_of(3))
        self.expect_refused(bag, "has torques_command")
        self.read(bag, encoders=True)

    def test_a_base_of_other_sizes_or_joints_is_refused(self):
        from youbot_base_sim.base import Base
        larger = Base(1.5 * RADIUS, half_wheelbase=LENGTHS, half_track=0)
        for options, words in ((dict(truth=True), "/odom: the base moves forward 0.667"),
                               (dict(odom=False, truth=True), "ground_truth: the base moves forward 0.667"),
                               (dict(odom=False, marker=True), "pose: the base moves forward 0.66")):
            bag = self.record(**options)
            self.read(bag)
            self.expect_refused(bag, words, "--scene", base=larger)
        self.expect_refused(bag, "has the joints wheel_joint_bl, ", "not the wheels a, b, c, d", "--joints",
                            base=Base(joints=tuple("abcd")))

    def test_a_direction_that_was_not_driven_is_not_judged(self):
        directions = [(V_X, V_Y, 0) for V_X, V_Y, _ in VELOCITIES]
        for motions in (directions, [(V_X, 0, 0) for V_X, _, _ in VELOCITIES]):
            for noise in (0, 1e-4):
                table = self.read(self.record(truth=True, motions=motions, noise=noise))
                np.testing.assert_allclose(table["command"][1][1], rolling_rates(*motions[1], *SIZES), rtol=1e-3)
                self.assertIn("x", table)

    def start(self, bag, output, redirection=""):
        """Starts the program on a bag of this base."""
        with open(self.path("scene.yaml"), "w") as file:
            file.write(f"duration: 1\nrobot: {{profile: measured, wheel_radius: {RADIUS}, "
                       f"half_wheelbase: {LENGTHS - 0.15}}}\n")
        return subprocess.Popen(["bash", "-c", f'exec "$@" {redirection}', "", PROGRAM, bag, "--scene",
                                 self.path("scene.yaml"), "-o", self.path(output)], stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def test_the_program_fits_a_cut_bag_and_says_what_it_read(self):
        bag = self.record(effort=False)  # which has less to fit
        os.truncate(bag, os.path.getsize(bag) - 1000)
        ran = self.start(bag, "fitted.yaml")
        out, err = ran.communicate(timeout=200)
        self.assertEqual((ran.returncode, err), (0, ""), out)
        for words in (f"note: {bag} has no complete index", "/joint_states: 450, 50 Hz", "no effort in joint_states"):
            self.assertIn(words, out)
        with open(self.path("fitted.yaml")) as file:
            self.assertIn(f"# By identify, from {bag}. Error", file.readline())
        for redirection in (">&-", "> /dev/full"):
            ran = self.start(bag, "full.yaml", redirection)
            self.assertEqual(ran.communicate(timeout=200)[1],
                             "identify: standard output: cannot be written: Bad file descriptor\n")
            self.assertTrue(ran.returncode == 1 and os.path.exists(self.path("full.yaml")))
            os.remove(self.path("full.yaml"))
        for arguments, words in (((), "BAG"), (("--colour",), "--help"), ((self.path("none"),), "none: No such file"),
                                 ((bag, "--frames", "a"), "FIXED,BODY"), ((bag, "--ticks", "0"), "must be a number"),
                                 ((bag, "--scene", self.path("scene.yaml"), "-o", bag), "must not be a file that is read")):
            ran = subprocess.run([PROGRAM, *arguments, "--quiet"], capture_output=True, text=True, timeout=100)
            self.assertEqual((ran.returncode, ran.stdout, ran.stderr.count("\n")), (2, "", 1), ran.stderr)
            self.assertTrue(ran.stderr.startswith("identify: "), ran.stderr)
            self.assertIn(words, ran.stderr)

    def test_a_signal_ends_it_in_a_line(self):
        bag = self.record()
        for fits in (False, True):  # while it reads, and amid a fit
            ran = self.start(bag, "ended.yaml")

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
    PROGRAM = os.path.join(os.path.abspath(sys.argv.pop(1)), "lib", "youbot_base_sim", "identify")
    unittest.main()
