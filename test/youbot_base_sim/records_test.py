"""Records whose wheels, odometry or ground truth are in other units or sizes, or begin anew: mended, or named."""
import math
import unittest

import numpy as np
import rosbag
from geometry_msgs.msg import Pose, PoseStamped, Quaternion, TwistStamped, Vector3
from harness import JOINTS, RunsPrograms, joint_state, odometry, path_of, rolling_rates, stamp_of, twist
from std_msgs.msg import Header

RATE = 50
LATERAL = 0.95  # of what the wheels roll
COMMANDS = np.repeat([(0.2, 0, 0), (0, 0.2, 0), (0, 0, 0.5), (-0.2, 0.1, -0.3), (0, 0, 0)], 4 * RATE, axis=0)


def seen(stamp, pose, tracker, marker):
    """A marker's pose; `tracker` and `marker`: half angles by which both are turned about x."""
    def product(a, b):
        u, v = np.array(a[:3]), np.array(b[:3])
        return [*(a[3] * v + b[3] * u + np.cross(u, v)), a[3] * b[3] - u @ v]
    x, y, turn = pose
    turned = product(product((math.sin(tracker), 0, 0, math.cos(tracker)),
                             (0, 0, math.sin(turn / 2), math.cos(turn / 2))), (math.sin(marker), 0, 0, math.cos(marker)))
    place = Vector3(x, y * math.cos(2 * tracker), y * math.sin(2 * tracker))
    return PoseStamped(Header(stamp=stamp), Pose(place, Quaternion(*turned)))


class RecordsTest(RunsPrograms):
    def expect(self, note, *arguments, forward=1, lateral=LATERAL, position=1.0, odom=1.0, truth=(1, 1, 1),
               counted=None, stamped=False, of="rolled", rates_by=(1, 1, 1, 1), late=0.0, tracked=(),
               names=JOINTS, is_fixed=False, moved=0.0, scale=1.0, every=1, stale=(), uneven=lambda k: 0):
        """What `analyse` makes of a bag with positions, ways of odometry or ground truth by these factors; with
        odometry `moved` after half of the drive, truth after a tenth, m, with quaternions of this size, and 500 s old
        stamps in `stale` messages; `every` n-th pose of truth; wheels `uneven` (s) late. `forward` None: anything."""
        rates = rolling_rates(*COMMANDS.T)
        positions = position * (np.cumsum(rates, axis=0) - rates) / RATE
        if counted:
            positions = counted(positions)
        way, true = COMMANDS * (odom, odom, 1), COMMANDS * (1, LATERAL, 1) * truth
        told, way_seen = path_of(COMMANDS, RATE) * (odom, odom, 1), path_of(true, RATE)
        told[len(told) // 2:, 0] += moved
        way_seen[len(told) // 10:, 0] += moved
        with rosbag.Bag(self.path("drive.bag"), "w") as bag:
            for k, command in enumerate(COMMANDS):
                joints = joint_state(k / RATE + uneven(k), positions[k], rates[k] * rates_by, names=names)
                spin = way_seen[k][2] * is_fixed
                fixed = (np.cos(spin) * true[k][0] - np.sin(spin) * true[k][1],
                         np.sin(spin) * true[k][0] + np.cos(spin) * true[k][1], true[k][2])
                truth_of = (("/pose", seen(stamp_of(k / RATE + late), way_seen[k], *tracked)) if tracked else
                            ("/ground_truth", odometry(k / RATE, way_seen[k], fixed)))
                told_of = odometry(k / RATE - 500 * (k in stale), told[k] + 9 * (k in stale), way[k])
                told_of.pose.pose.orientation.z *= scale
                told_of.pose.pose.orientation.w *= scale
                for topic, message in (("/joint_states", joints), ("/odom", told_of), truth_of,
                                       ("/cmd_vel", TwistStamped(told_of.header, twist(*command)) if stamped else twist(*command))):
                    if k % every == 0 or message is not truth_of[1]:
                        bag.write(topic, message, stamp_of(k / RATE))
        numbers = self.numbers(self.path("drive.bag"), *arguments)
        self.assertIn(note, self.out)
        if forward:
            self.assertAlmostEqual(numbers["forward_of_" + of], forward, delta=0.02)
            self.assertAlmostEqual(numbers["lateral_of_" + of], lateral, delta=0.02)
        return numbers

    def test_twists_in_the_fixed_frame_are_turned_into_the_bases(self):
        self.expect("note: /ground_truth: its twists are in the fixed frame", is_fixed=True)

    def test_sizes_by_a_scene_and_ticks_of_other_joints(self):
        scene, names = self.path("other.yaml"), ["front_left", "front_right", "rear_left", "rear_right"]
        with open(scene, "w", encoding="utf-8") as file:
            file.write("robot: {wheel_radius: 0.1, half_wheelbase: 0.47, half_track: 0.3}\n")
        signs, named = np.array((-1, 1, -1, 1)), "--joints=-front_left,front_right,-rear_left,rear_right"
        numbers = self.expect("", "--scene", scene, named, "--ticks", "1440", names=names, forward=0.5,
                              lateral=0.5 * LATERAL, position=signs * 1440 / 2 / math.pi)
        self.assertAlmostEqual(numbers["yaw_of_rolled"], 1, delta=0.02)
        self.analyse(self.path("drive.bag"))
        self.assertRegex(self.out, "  slip +/joint_states has the joints front_left, front_right, rear_left, rear_right, "
                         "not the wheels wheel_joint_fl, .* with --joints")
        self.analyse(self.path("drive.bag"), "--joints", "a,b,c,-c", status=2)
        self.one_line("must be four joints")

    def test_stamped_commands(self):
        numbers = self.expect("cmd_vel", stamped=True)
        self.assertNotIn("note", self.out)
        self.assertAlmostEqual(numbers["lateral_of_commanded"], LATERAL, delta=0.02)

    def test_lengths_in_mm_are_converted(self):
        numbers = self.expect("/odom: its lengths are in mm: converted to m", odom=1000)
        self.assertLess(numbers["final_error"], 0.1)
        self.expect("note: /ground_truth: its lengths are in cm", truth=(100, 100, 1))

    def test_other_sizes_and_signs_are_named(self):
        self.expect("/odom: the base moves forward 1.41 (sqrt(2)), lateral 1.41 (sqrt(2)) times as far as its wheels "
                    "roll", odom=math.sqrt(2))
        self.expect("/ground_truth: the base moves forward 0.5, lateral 0.475 times as far as by odometry", "--joints",
                    "a,b,c,d", odom=2, of="commanded")
        self.expect("/ground_truth: the base moves forward 2, lateral 1.9, in yaw 2 times", truth=(2, 2, 2), forward=2,
                    lateral=2 * LATERAL)
        self.expect("/ground_truth: the base moves lateral -0.95, in yaw -1 times", truth=(1, -1, -1), lateral=-LATERAL)
        self.expect("/odom: the base moves forward 0.0174 (degrees in place of rad)", position=180 / math.pi,
                    forward=math.pi / 180, lateral=LATERAL * math.pi / 180)

    def test_velocities_of_one_wheel_by_another_factor_are_not_used(self):
        self.expect("1.08, 0.997, 0.996 times their changes): velocities are differences", rates_by=(1, 1.08, 1, 1))

    def test_a_wheel_whose_positions_do_not_fit_the_others_is_named(self):
        for factor in (-1, 0, 2):
            self.expect(f"fr turns {factor} times as far as it must beside the other wheels", forward=None,
                        position=np.array((1, factor, 1, 1)))

    def test_coarse_positions_do_not_lower_factors(self):
        step = math.pi / 10
        self.expect("always zero", rates_by=(0, 0, 0, 0), counted=lambda turned: np.floor(turned / step) * step)

    def test_poses_that_jump_or_have_no_rotation_are_named(self):
        self.expect("/odom: poses jump 1 times, first at t = 10.000 s", moved=1)
        self.expect("/odom: pose of 1000 messages has a quaternion that is no rotation: left out", scale=2)
        numbers = self.expect("", scale=0.96)  # of floats of half the precision, say
        self.assertLess(numbers["final_heading_error"], 1e-3)

    def test_rare_poses_of_ground_truth_are_not_smoothed(self):
        for options in (dict(every=10, tracked=(0, 0)), dict(every=10), dict(every=25)):
            numbers = self.expect("Hz", **options)
            self.assertAlmostEqual(numbers["yaw_of_rolled"], 1, delta=0.02)

    def test_a_message_that_waited_long_is_left_out(self):
        numbers = self.expect("/odom: stamps of 2 messages are far from their arrival, unlike others: left out",
                              stale=(0, 300))
        self.assertLess(numbers["maximal_error"], 0.06)

    def test_trackers_and_markers_that_are_tilted_are_levelled(self):
        for tracker, marker in ((0, 0.2), (math.pi / 4, 0), (0.1, math.pi / 2)):
            self.expect(f"the axis of yaw is {math.degrees(2 * tracker):.0f} deg off the tracker's z axis, "
                        f"{math.degrees(2 * marker):.0f} deg off the marker's: levelled", tracked=(tracker, marker))

    def test_the_clock_of_a_topic_is_decided_once(self):
        for late, how in ((-1.01, "before their arrival: moved by so much"), (0.6, "--clock-offset /pose=-0.6)")):
            numbers = self.expect(how, tracked=(0, 0), late=late)
            self.assertAlmostEqual(numbers["clock"], -late if abs(late) < 1 else 0, delta=0.01)

    def test_uneven_stamps_do_not_count(self):
        self.expect("stamps of /joint_states go back", uneven=lambda k: 0.3 * (0.618 * k % 1))
        self.expect("The motion", uneven=lambda k: 0.998 / RATE * (k % 200 == 7))
        self.assertNotIn("jump", self.out)

    def test_positions_that_begin_anew(self):
        for ticks, period in ((20000, 2 ** 16), (4096000, 2 ** 32), (2 * math.pi, 2 * math.pi), (200000, 10 ** 6)):
            self.expect("positions begin anew", "--ticks", str(ticks), position=ticks / 2 / math.pi,
                        counted=lambda count: (count + period - 10) % period - period / 2)
        for arguments, position in ((), 1), (("--ticks", "20000"), 20000 / 2 / math.pi):
            half = len(COMMANDS) // 2
            numbers = self.expect("positions jump 1 times, first at t = 10.000 s", *arguments, position=position,
                                  counted=lambda turned: turned - np.repeat([turned[:1], turned[half:half + 1]], half,
                                                                            axis=1).reshape(turned.shape))
            self.assertAlmostEqual(numbers["yaw_of_rolled"], 1, delta=0.02)


if __name__ == "__main__":
    unittest.main()
