"""Ground truth of tracking systems in scripts/analyse: bags of simulate whose truth is moved to a marker, another frame
and another clock, thinned and made noisy. What analyse finds must be what was done, within its sigmas.

Usage: ground_truth_test.py SIMULATE
"""
import csv
import math
import subprocess
import sys
import unittest

import genpy
import numpy as np
import rosbag
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped
from harness import RunsPrograms, placed, put, seen, stamp_of
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

SIMULATE = None
ROWS = ((0, 0, 0, 0, 0), (1, 4, 4, 4, 4), (3, -4, -4, -4, -4), (5, -4, 4, 4, -4), (7, 4, -4, -4, 4), (9, -3, 3, -3, 3),
        (11, 3, -3, 3, -3), (13, 6, 2, 2, 6), (15, 2, 6, 1, 4), (17, 0, 0, 0, 0))  # s, rad/s
# Set points above the motors' limit of 16.2 rad/s: what is left of them contradicts the others.
CLIPPED = ((0, 0, 0, 0, 0), (1, -15.8, -2.1, -0.5, -17.3), (2.2, -4.9, 4.8, 3, -3.1), (3.9, -30.4, 7.4, -1.4, -21.5),
           (4.9, -26, 7.6, -6.4, -11.9), (6.9, 8.7, -1.4, 4, 3.4), (8.2, -6.2, 0.8, 0.5, -5.9),
           (9.5, 5.6, -4.4, -1.1, 2.3), (10.9, 8.9, 4.1, -0.8, 13.8), (12.4, 0, 0, 0, 0))
MARKER, FRAME, CLOCK = (0.12, -0.07, 0.4), (2.0, -1.5, 2.2), 0.3137  # X, Y, yaw on the base; x, y, yaw; s


class GroundTruthTest(RunsPrograms):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.times, cls.motion = cls.simulate("drive", ROWS)
        cls.known = cls("numbers").numbers(cls("path").path("drive.bag"))

    @classmethod
    def simulate(cls, name, rows):
        """A bag at 50 Hz as the robot records it, and the motion (x, y, psi) every 2 ms."""
        path = cls("path").path
        with open(path(name + ".table"), "w") as file:
            file.write("t,fl,fr,bl,br\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
        for rate, option in ((50, "bag"), (500, "csv")):
            with open(path(name + ".yaml"), "w") as file:
                file.write(f"duration: {rows[-1][0] + 1}\noutput_rate: {rate}\nrobot: {{profile: measured}}\n"
                           "solver: {control_period: 1e-3, relative_tolerance: 1e-5}\nmotors: {quantized: true}\n"
                           f"drive: {{velocity_table: {name}.table}}\n")
            subprocess.run([SIMULATE, path(name + ".yaml"), "--quiet", "--" + option, path(f"{name}.{option}")],
                           check=True, timeout=60)
        with open(path(name + ".csv"), newline="") as file:
            columns = np.array([[float(row[key]) for key in ("t", "x", "y", "psi")] for row in csv.DictReader(file)]).T
        return columns[0], columns[1:]

    def recorded(self, name, kind=PoseStamped, drive="drive", rate=100, noise=3e-4, seed=1, out_of_sight=(6.0, 6.4),
                 clock=CLOCK, times=None, motion=None, marker=MARKER, as_transforms=False, **tilt):
        """A bag of the drive with a tracker's poses of a marker in place of ground_truth."""
        random = np.random.default_rng(seed)
        known, motion = self.times if times is None else times, self.motion if motion is None else motion
        times = np.arange(0.013, known[-1], 1 / rate)
        base = [np.interp(times, known, column) for column in motion]
        poses = placed(FRAME, placed(base, marker))
        with rosbag.Bag(self.path(f"{drive}.bag")) as bag, rosbag.Bag(self.path(name), "w") as live:
            for topic, message, t in bag.read_messages():
                if topic in ("/odom", "/base/joint_states"):
                    message.header.stamp = stamp_of(t.to_sec())
                    live.write(topic, message, stamp_of(t.to_sec() + 0.002))
            for t, x, y, yaw in zip(times, *poses):
                if out_of_sight[0] < t < out_of_sight[1] or random.random() < 0.05:
                    continue
                dx, dy, dz, turn = noise * random.standard_normal(4)
                message = seen(kind, t - clock, (x + dx, y + dy, 0.3 + dz, yaw + 1.5 * turn), **tilt)
                if as_transforms:
                    live.write("/tf", TFMessage([message]), stamp_of(t + 0.003))
                else:
                    live.write("/tracker/youbot/pose", message, stamp_of(t + 0.003))
            if as_transforms:  # where the marker's base is, turned upside down and back in two links
                x, y, _ = placed((0, 0, -marker[2]), (-marker[0], -marker[1], 0))
                for parent, child, place in (("body", "plate", (x, y, -0.3, -marker[2])),
                                             ("plate", "robot", (0, 0, 0))):
                    link = seen(TransformStamped, 0, place, math.pi)
                    link.header.frame_id, link.child_frame_id = parent, child
                    live.write("/tf_static", TFMessage([link]), stamp_of(0))
        return self.path(name)

    def expect_alignment(self, numbers, clock=CLOCK, marker=MARKER, sigmas=2.5):
        x, y, yaw = FRAME
        inverse = (*placed((0, 0, -yaw), (-x, -y, 0))[:2], -yaw)
        expected = {"clock": clock, **{f"marker_{axis}": value for axis, value in zip(("x", "y", "yaw"), marker)},
                    **{f"fixed_{axis}": value for axis, value in zip(("x", "y", "yaw"), inverse)}}
        for name, value in expected.items():
            off = numbers[name] - value
            if name.endswith("yaw"):
                off = math.remainder(off, 2 * math.pi)
            self.assertLess(abs(off), sigmas * numbers[name + "_sigma"], name)

    def expect_known(self, numbers):
        """What the simulator's own ground truth yields."""
        for name, delta in (("final_error", 8e-3), ("maximal_error", 8e-3), ("final_heading_error", 8e-3),
                            ("path_length", 0.05), ("forward_of_rolled", 0.01), ("lateral_of_rolled", 0.01),
                            ("yaw_of_rolled", 0.02), ("final_x", 0.02), ("final_y", 0.02), ("final_psi", 0.02)):
            self.assertAlmostEqual(numbers[name], self.known[name], delta=delta, msg=name)

    def test_a_marker_is_found_on_the_base_and_its_clock(self):
        for rate, noise, seed in ((100, 3e-4, 1), (30, 1e-5, 2), (240, 1e-3, 3)):
            bag = self.recorded("marker.bag", rate=rate, noise=noise, seed=seed)
            numbers = self.numbers(bag)
            self.expect_alignment(numbers)
            for name, largest in (("clock", 8e-3), ("marker_x", 0.012), ("marker_y", 0.012), ("marker_yaw", 0.015),
                                  ("fixed_yaw", 0.015)):
                self.assertLess(numbers[name + "_sigma"], largest)
        self.assertRegex(self.out, r"note: /tracker/youbot/pose: a gap of 0\.4\d\d s from t = 5\.6\d\d s\n")
        self.expect_known(self.numbers(self.recorded("marker.bag")))

    def test_the_clock_s_sigma_grows_with_slip(self):
        """Hard starts, in which the base lags behind its wheels, look like a clock that is late."""
        times, motion = self.simulate("hard", [(t, *(2.5 * rate for rate in rates)) for t, *rates in ROWS])
        numbers = self.numbers(self.recorded("hard_seen.bag", drive="hard", times=times, motion=motion))
        self.expect_alignment(numbers)
        self.assertGreater(abs(numbers["clock"] - CLOCK), 0.0125)  # 2.5 sigma of a base that hardly slips

    def test_wheels_that_contradict_each_other_count_less(self):
        """They slip for seconds, and in step with the turns that show where the marker is."""
        times, motion = self.simulate("clipped", CLIPPED)
        numbers = self.numbers(self.recorded("clipped_seen.bag", drive="clipped", times=times, motion=motion))
        self.expect_alignment(numbers)
        for axis, true in zip("xy", MARKER):
            self.assertAlmostEqual(numbers["marker_" + axis], true, delta=0.02)

    def test_a_yaw_with_noise_and_spikes(self):
        """As of optical trackers of few markers: 10 mrad, and 0.3 rad for a tenth of the time."""
        draw, motion = np.random.default_rng(5), self.motion.copy()
        motion[2] += 0.01 * draw.normal(size=len(self.times))
        motion[2] += 0.3 * (np.sin(2 * math.pi * self.times / 1.7) > 0.95)
        numbers = self.numbers(self.recorded("spikes.bag", rate=170, motion=motion, marker=(0, 0, MARKER[2])))
        self.assertLess(abs(numbers["clock"] - CLOCK), 3 * numbers["clock_sigma"])
        self.assertLess(abs(numbers["marker_yaw"] - MARKER[2]), 3 * numbers["marker_yaw_sigma"])
        self.assertAlmostEqual(numbers["forward_of_rolled"], self.known["forward_of_rolled"], delta=0.03)

    def test_a_clock_that_is_known(self):
        """Far from the bag's, too; and where a drive along one line does not show it."""
        for clock in (CLOCK, -7.5):
            bag = self.recorded("known.bag", clock=clock)
            numbers = self.numbers(bag, "--clock-offset", f"/tracker/youbot/pose={clock}")
            self.assertEqual((numbers["clock"], numbers["clock_sigma"]), (clock, 0))
            self.assertIn(f"note: /tracker/youbot/pose: {clock:+.6g} s are added to its times\n", self.out)
            self.expect_known(numbers)
            for axis, value in zip(("x", "y", "yaw"), MARKER):
                self.assertAlmostEqual(numbers["marker_" + axis], value, delta=0.02, msg=axis)
        self.analyse(bag, "--clock-offset", "/tracker/youbot/pose=-6.9")
        self.assertNotIn("-6.9000 s +-", self.out)
        self.assertIn("does not fit the wheels' with the clock that --clock-offset gives", self.out)
        transforms = self.recorded("known.bag", TransformStamped, as_transforms=True, clock=-7.5)
        numbers = self.numbers(transforms, "--frames", "mocap,robot", "--clock-offset", "tf=-7.5")
        for name in ("final_error", "final_heading_error", "path_length", "yaw_of_rolled"):
            self.assertAlmostEqual(numbers[name], self.known[name], delta=0.02)

    def test_a_marker_that_was_never_seen(self):
        with rosbag.Bag(self.path("unseen.bag"), "w") as bag:
            for k in range(100):
                pose = PoseStamped()
                pose.pose.orientation.x = 1e200 * (k % 2)  # whose square is no number
                bag.write("/pose", pose, stamp_of(0.01 * k))
                bag.write("/odom", Odometry(), stamp_of(0.01 * k))
        self.analyse(self.path("unseen.bag"))
        self.assertIn("/pose has no message with usable numbers", self.out)

    def test_clocks_that_cannot_be_are_refused(self):
        bag = self.recorded("known.bag")
        for value, words in (("/other=1", ["--clock-offset /other", "/tracker/youbot/pose"]), ("/odom", ["TOPIC=S"]),
                             ("/odom=nan", ["TOPIC=S"]), ("=1", ["TOPIC=S"])):
            self.analyse(bag, "--clock-offset", value, status=2)
            self.one_line(*words)

    def test_types_of_messages(self):
        expected = self.numbers(self.recorded("stamped.bag"))
        for kind in (PoseWithCovarianceStamped, TransformStamped):
            self.expect_same(self.numbers(self.recorded("other.bag", kind)), expected)

    def expect_same(self, numbers, expected):
        self.assertEqual(numbers.keys(), expected.keys())
        for name, value in expected.items():  # numpy's sums depend on where arrays lie in memory
            self.assertAlmostEqual(numbers[name], value, delta=1e-6 * (1 + abs(value)), msg=name)

    def test_transforms(self):
        bag = self.recorded("transforms.bag", TransformStamped, as_transforms=True)
        numbers = self.numbers(bag, "--frames", "mocap,body", "--truth", "marker")
        self.expect_alignment(numbers)
        numbers = self.numbers(bag, "--frames", "mocap,robot", "--truth", "marker")
        self.expect_alignment(numbers, marker=(0, 0, 0))
        numbers = self.numbers(self.recorded("clock.bag", TransformStamped, as_transforms=True, clock=0),
                               "--frames", "mocap,robot")
        self.assertRegex(self.out, "mocap -> robot +taken as the base's own pose, at the bag's clock")
        for name in ("final_error", "final_heading_error", "path_length", "yaw_of_rolled"):
            self.assertAlmostEqual(numbers[name], self.known[name], delta=0.02)
        other = self.recorded("parents.bag", TransformStamped, as_transforms=True)
        with rosbag.Bag(other, "a") as more:  # a frame that another tree has too, and a camera that is seen by the base
            for t in range(20):
                links = [seen(TransformStamped, t, (9, 9, 0)), seen(TransformStamped, t, placed((0, 0, -1), (-2, -3, 0)))]
                links[0].header.frame_id, links[1].header.frame_id, links[1].child_frame_id = "other", "mocap", "camera"
                more.write("/tf", TFMessage(links), stamp_of(t))
        numbers = self.numbers(other, "--frames", "camera,body", "--truth", "marker")
        self.assertLess(abs(numbers["marker_x"] - MARKER[0]), 3 * numbers["marker_x_sigma"])
        self.analyse(bag, "--frames", "world,robot", "--only", "odometry")
        self.assertIn("no transforms from world to robot: it has body -> plate, mocap -> body, plate -> "
                      "robot", self.out)

    def test_transforms_that_are_none_are_left_out(self):
        """As by tf2: without a frame's name, with the rotation of a message that was never filled in."""
        def links(*frames):
            for parent, child in frames:
                link = seen(TransformStamped, 0, (9, 9, 0))
                link.header.frame_id, link.child_frame_id = parent, child
                yield link
        bag = self.recorded("named.bag", TransformStamped, as_transforms=True)
        known = self.numbers(bag, "--frames", "mocap,robot", "--truth", "marker")
        unturned, huge = links(("mocap", "body"), ("mocap", "body"))
        unturned.transform.rotation.w = unturned.transform.rotation.z = 0
        huge.transform.rotation.z = 1e200  # its square is no number
        with rosbag.Bag(bag, "a") as more:
            more.write("/tf", TFMessage([unturned, huge, *links(("", "body"), ("mocap", "/"))]), stamp_of(3))
        self.expect_same(self.numbers(bag, "--frames", "mocap,robot", "--truth", "marker"), known)
        self.analyse(bag, "--frames", "mocap,nothing", "--only", "odometry")
        self.assertIn("; 4 are left out, which lack a frame's name, a finite position or a rotation", self.out)

    def test_ground_truth_of_odometry_may_be_a_marker_s(self):
        with rosbag.Bag(self.path("drive.bag")) as bag, rosbag.Bag(self.path("odometry.bag"), "w") as live:
            for topic, message, t in bag.read_messages(start_time=genpy.Time(1)):  # stamps cannot be negative
                if topic == "/ground_truth":
                    pose = message.pose.pose
                    yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
                    x, y, yaw = placed(FRAME, placed((pose.position.x, pose.position.y, yaw), MARKER))
                    put(pose.position, pose.orientation, (x, y, yaw))
                    message.header.stamp -= genpy.Duration.from_sec(CLOCK)
                live.write(topic, message, t)
        self.expect_alignment(self.numbers(self.path("odometry.bag"), "--truth", "marker"), sigmas=3)

    def expect_unused(self, bag, *words):
        self.analyse(bag)
        for word in words:
            self.assertIn(word, self.out)
        self.assertRegex(self.out, "  odometry +/tracker/youbot/pose: ")
        self.assertNotIn("true pose", self.out)

    def test_what_cannot_be_determined_is_not_used(self):
        steady = np.zeros((3, len(self.times)))
        self.expect_unused(self.recorded("still.bag", motion=steady), "does not fit the wheels' with any clock")
        self.analyse(self.recorded("far.bag", clock=0.9, motion=3 * self.motion))
        self.assertRegex(self.out, r"pose: the base moves forward 3[.\d]*, .*must be 0.8 to 1.25 times.*--scene")
        self.expect_unused(self.recorded("seldom.bag", rate=2.5), "pieces of 1.2 s are too few", "more poses a second")
        self.expect_unused(self.recorded("tilted.bag", tilt=math.pi / 2), "its z axis is 90 deg off the vertical")
        waves = [(0.02 * k, *4 * [3 * math.sin(2 * math.pi * 0.02 * k / 0.8)]) for k in range(500)]
        times, motion = self.simulate("waves", waves)
        known = [np.interp(self.times, times, column) for column in motion]
        self.expect_unused(self.recorded("waves_seen.bag", drive="waves", motion=known),
                           "its clock cannot be determined", "fit alike")


if __name__ == "__main__":
    SIMULATE = sys.argv[1]
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
