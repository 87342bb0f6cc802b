"""scripts/analyse: bags with known answers, bags of simulate, and bags that are damaged in every way.

Usage: analyse_test.py SIMULATE ENV.SH      the program, and what sets up the devel space
"""
import base64
import copy
import csv
import errno
import html.parser
import math
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

import genpy
import genpy.dynamic
import numpy as np
import rosbag
from geometry_msgs.msg import Point, Twist, Vector3
from harness import ROOT, WHEELS, RunsPrograms, joint_state, odometry, rolling_rates, stamp_of
from std_msgs.msg import Header, String

from youbot_base_sim import files
from youbot_base_sim.analysis import spectrum
from youbot_base_sim.base import Base
from youbot_base_sim.records import Record
from youbot_base_sim.series import Series

SCRIPT = str(ROOT / "scripts" / "analyse")
SIMULATE = ENVIRONMENT = None
R, ARM = 0.05, 0.385
EFFORTS = np.array((0.1, 0.2, 0.3, 0.4))  # N m
SEPARATOR = "\n" + 80 * "=" + "\nMSG: "


def definition(name):
    return (ROOT / "msg" / f"{name}.msg").read_text()


def own_messages():
    """Classes of the package's messages, from their definitions: the test needs no path to what is generated."""
    parts = [definition("ContactsStamped"), "std_msgs/Header\n" + Header._full_text,
             "youbot_base_sim/Contact\n" + definition("Contact"), "geometry_msgs/Point\n" + Point._full_text,
             "geometry_msgs/Vector3\n" + Vector3._full_text]
    classes = genpy.dynamic.generate_dynamic("youbot_base_sim/ContactsStamped", SEPARATOR.join(parts))
    switch = SEPARATOR.join([definition("RollerSwitchStamped"), parts[1]])
    return {**classes, **genpy.dynamic.generate_dynamic("youbot_base_sim/RollerSwitchStamped", switch)}


class Motion:
    """A base at constant velocity in its own frame, from the origin: exact."""

    def __init__(self, V_X, V_Y, Omega):
        self.twist = (V_X, V_Y, Omega)

    def pose(self, t, scale=1.0, turn_scale=1.0):
        V_X, V_Y, Omega = self.twist
        angle = turn_scale * Omega * t
        s, c = (math.sin(angle) / angle, (1 - math.cos(angle)) / angle) if angle else (1, 0)
        return scale * t * (s * V_X - c * V_Y), scale * t * (c * V_X + s * V_Y), angle


def elsewhere(pose, x=7.0, y=-3.0, turn=2.0):
    """The same motion, seen from another frame."""
    return (x + math.cos(turn) * pose[0] - math.sin(turn) * pose[1],
            y + math.sin(turn) * pose[0] + math.cos(turn) * pose[1], pose[2] + turn)


class AnalyseTest(RunsPrograms):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.messages = own_messages()
        cls.slipping_messages = list(cls.simulate_slipping())
        cls.slipping = cls.make_slipping(os.path.join(cls.folder, "slipping.bag"))
        first = cls()
        cls.known = first.numbers(cls.slipping, folder="known")
        cls.known_out = first.out

    # Bags with known answers

    @classmethod
    def simulate_slipping(cls):
        """4 s at a rising rate, which ripples by 0.15 rad/s six times a turn; odometry falls short by 5 %; the slip of
        the wheels is 0.2, 0.8, 0.6 and 0.4 rad/s; slip velocity jumps by 5 mm/s at each switch of fl."""
        phi, pose, odom = 0.0, np.zeros(3), np.zeros(3)
        rate = lambda phi: 10 + 0.15 * phi + 0.15 * math.sin(6 * phi)
        velocity = lambda phi: np.array([R * (rate(phi) + 0.5), R * 0.2, R * 0.1 / ARM])
        for k in range(4001):
            t = 0.001 * k
            cls.end_of_slipping = pose.copy()
            if k % 10 == 0:
                yield "/ground_truth", odometry(t, pose, velocity(phi)), t
                yield "/odom", odometry(t, elsewhere(odom)), t
                yield "/base/joint_states", joint_state(t, [phi] * 4, [rate(phi)] * 4), t
            if k % 2 == 0:
                yield "/contacts", cls.contacts_at(t), t
            middle = phi + 0.0005 * rate(phi)
            V = 0.001 * velocity(middle)
            for state, scale in ((pose, 1), (odom, 0.95)):
                c, s = scale * math.cos(state[2] + V[2] / 2), scale * math.sin(state[2] + V[2] / 2)
                state += (c * V[0] - s * V[1], s * V[0] + c * V[1], V[2])
            phi += 0.001 * rate(middle)
        for wheel, every, direction in (("fl", 0.25, 1), ("fr", 0.5, -1)):
            for k in range(1, int(4 / every)):
                yield "/base/roller_switches", cls.switch(k * every - 0.001, wheel, direction), k * every - 0.001
        for t, count in ((2.0, 50), (2.1, 1), (2.3, 1)):
            yield "/base/roller_switches", cls.switch(t, "bl", 1, count), t

    @classmethod
    def make_slipping(cls, path, change=lambda topic, message, t: message, compression="none"):
        """A bag of it, with messages as `change` returns them."""
        with rosbag.Bag(path, "w", compression=compression, chunk_threshold=50000) as bag:
            for topic, message, t in cls.slipping_messages:
                bag.write(topic, change(topic, message, t), stamp_of(t))
        return path

    @classmethod
    def switch(cls, t, wheel, direction, count=1):
        message = cls.messages["youbot_base_sim/RollerSwitchStamped"](wheel="wheel_joint_" + wheel, direction=direction,
                                                                      count=count, t=t)
        message.header.stamp = stamp_of(t)
        return message

    @classmethod
    def contacts_at(cls, t):
        message = cls.messages["youbot_base_sim/ContactsStamped"](
            t=t, kinetic_energy=3 * t * t, drive_power=6.1 * t + 3, external_power=0.5, bearing_power=2,
            roller_power=1 + 0.1 * t, floor_power=0.5)
        message.header.stamp = stamp_of(t)
        for wheel in WHEELS:
            contact = cls.messages["youbot_base_sim/Contact"](wheel="wheel_joint_" + wheel)
            if wheel == "fl" and round(t / 0.002) // 125 % 2:
                contact.slip_velocity.x, contact.slip_velocity.y = 0.003, 0.004
                contact.friction_share = 1
            message.contacts.append(contact)
        return message

    def test_odometry_is_off_by_what_it_drifts(self):
        numbers = self.known
        moved = math.hypot(*self.end_of_slipping[:2])
        self.assertAlmostEqual(numbers["final_error"], 0.05 * moved, delta=1e-5)
        self.assertAlmostEqual(numbers["maximal_error"], 0.05 * moved, delta=1e-5)
        self.assertAlmostEqual(numbers["final_heading_error"], 0, delta=1e-9)
        self.assertAlmostEqual(numbers["error_per_metre_rms"], 0.05, delta=5e-4)
        self.assertAlmostEqual(numbers["error_per_metre_maximal"], 0.05, delta=5e-4)
        self.assertAlmostEqual(numbers["final_error_per_metre"], 0.05 * moved / numbers["path_length"], delta=1e-6)
        self.assertGreater(numbers["path_length"], moved)
        self.assertIn("rotated by less than 90 deg", self.known_out)
        rows = self.table("odometry.csv", "known")
        self.assertEqual(len(rows), 401)
        self.assertAlmostEqual(float(rows[-1]["true_x_m"]), self.end_of_slipping[0], delta=1e-9)
        self.assertAlmostEqual(float(rows[-1]["odom_x_m"]), 0.95 * self.end_of_slipping[0], delta=1e-5)

    def test_slip_is_what_was_made(self):
        numbers = self.known
        for wheel, slip in zip(WHEELS, (0.2, 0.8, 0.6, 0.4)):
            for quantity in ("slip_rms_", "slip_maximal_", "slip_mean_"):
                self.assertAlmostEqual(numbers[quantity + wheel], slip, delta=1e-9)
            self.assertAlmostEqual(numbers["rim_slip_rms_" + wheel], 1e3 * R * slip, delta=1e-6)
        self.assertAlmostEqual(numbers["contact_slip_maximal_fl"], 5, delta=1e-9)
        self.assertAlmostEqual(numbers["contact_slip_rms_fl"], 5 / math.sqrt(2), delta=0.01)
        self.assertAlmostEqual(numbers["saturated_fl"], 50, delta=0.1)
        self.assertEqual(numbers["contact_slip_maximal_br"], 0)

    def test_ripple_is_told_with_its_order_though_the_rate_rises(self):
        numbers = self.known
        for wheel in WHEELS:
            self.assertAlmostEqual(numbers["ripple_of_rollers_" + wheel], 0.15, delta=0.003)
            self.assertLess(numbers["double_ripple_of_rollers_" + wheel], 0.003)
            self.assertGreater(numbers["ripple_over_background_" + wheel], 20)

    def test_the_number_of_rollers(self):
        """Wheels ripple n and 2 n times a turn in lateral motion and yaw, their motors 5 and 26 times in any."""
        draw, times = np.random.default_rng(1), np.arange(0, 80, 0.02)
        motions = np.array([(1, 1, 1, 1), (-1, 1, 1, -1), (-1, -1, -1, -1), (-1, 1, -1, 1)])
        sense = motions[(times // 10).astype(int) % 4]
        phi, aside = 0.08 * np.cumsum(sense, axis=0), np.ptp(sense, axis=1)[:, None] / 2
        for n in (0, 4, 6, 9, 15):
            ripple = 0.04 * (np.cos(5 * phi) + np.cos(26 * phi)) + 0.05 * draw.normal(size=phi.shape) + (n > 0) * aside * (
                0.06 * np.cos(n * phi + 1) + 0.03 * np.cos(2 * n * phi))
            joints = Series(times, {"position": phi, "velocity": 4 * sense + ripple})
            section = spectrum.analyse(Record(Base(), series={"joint_states": joints}))
            numbers = {name: value for name, value, _ in section.numbers}
            self.assertEqual(numbers.get("rollers", 0), n)
            self.assertEqual("NOT 6" in str(section.lines), n not in (0, 6))

    def test_switches_are_counted(self):
        numbers = self.known
        self.assertEqual(numbers["switches"], 15 + 7 + 52)
        self.assertEqual(numbers["switches_forward_fl"], 15)
        self.assertEqual(numbers["switches_backward_fr"], 7)
        self.assertEqual(numbers["switches_forward_bl"], 52)
        self.assertAlmostEqual(numbers["switch_rate_fl"], 15 / 4, delta=1e-6)
        self.assertAlmostEqual(numbers["interval_median_fl"], 250, delta=1e-4)
        self.assertAlmostEqual(numbers["interval_longest_fr"], 500, delta=1e-4)
        self.assertAlmostEqual(numbers["interval_shortest_bl"], 200, delta=1e-4,
                               msg="the instants of many are not known")
        self.assertNotIn("interval_median_br", numbers)
        self.assertIn("50 of them in 1 messages with a count above 1", self.known_out)

    def test_slip_jumps_at_switches(self):
        numbers = self.known
        self.assertAlmostEqual(numbers["jump_maximal"], 5, delta=1e-6)
        jumps = [float(row["slip_jump_m_per_s"] or "nan") for row in self.table("switches.csv", "known")
                 if row["wheel"] == "fl"]
        self.assertEqual(len(jumps), 15)
        np.testing.assert_allclose(jumps, 0.005, atol=1e-9)

    def test_energies_are_added_up(self):
        numbers = self.known
        for quantity, joules in (("drive", 6.1 * 8 + 12), ("external", 2), ("bearing", 8), ("roller", 4 + 0.8),
                                 ("floor", 2), ("gained", 48)):
            self.assertAlmostEqual(numbers[quantity + "_energy"], joules, delta=1e-6)
        self.assertLess(numbers["residual_maximal"], 1e-6)
        self.assertIn("the balance closes", self.known_out)

    def test_a_balance_that_lacks_something_is_told(self):
        def without_floor(topic, message, t):
            if topic == "/contacts":
                message = copy.copy(message)
                message.floor_power = 0
            return message
        bag = self.make_slipping(self.path("lacking.bag"), without_floor)
        self.assertAlmostEqual(self.numbers(bag)["residual"], 2, delta=1e-6)
        self.assertIn("DOES NOT CLOSE", self.out)

    def make_turning(self, name, sign=(1, 1, 1, 1), truth_twist=True, in_gap=lambda k: False, velocities=True,
                     positions=True, prefix="/", truth=True, contradiction=0.0):
        """30 s at constant velocity, told 0.4, 0.1 m/s and 0.5 rad/s; odometry turns by 1 % too much."""
        motion = Motion(0.42, 0.09, 0.5)
        rates = rolling_rates(0.42, 0.12, 0.5) + contradiction * np.array((1, 1, -1, -1))
        told = Twist()
        told.linear.x, told.linear.y, told.angular.z = 0.4, 0.1, 0.5
        bag = rosbag.Bag(self.path(name), "w")
        bag.write(prefix + "cmd_vel", told, stamp_of(0.0))
        for k in range(601):
            t = 0.05 * k
            twist = motion.twist if truth_twist else (0, 0, 0)
            if truth and not in_gap(k):
                bag.write(prefix + "ground_truth", odometry(t, motion.pose(t), twist), stamp_of(t))
            bag.write(prefix + "odom", odometry(t, elsewhere(motion.pose(t, turn_scale=1.01))), stamp_of(t))
            joints = joint_state(t, rates * t if positions else (), rates * sign if velocities else (), EFFORTS * sign)
            bag.write(prefix + "joint_states", joints, stamp_of(t))
        bag.close()
        return self.path(name)

    def expect_turning(self, numbers):
        self.assertAlmostEqual(numbers["final_heading_error"], 0.15, delta=1e-9)
        self.assertAlmostEqual(numbers["heading_error_per_turn"], 0.01 * 2 * math.pi, delta=1e-9)
        self.assertAlmostEqual(numbers["heading_error_per_turn_rms"], 0.01 * 2 * math.pi, delta=1e-6)
        self.assertAlmostEqual(numbers["rotation"], 15, delta=1e-9)
        for quantity, factor in (("forward_of_commanded", 1.05), ("lateral_of_commanded", 0.9),
                                 ("yaw_of_commanded", 1), ("forward_of_rolled", 1), ("lateral_of_rolled", 0.75),
                                 ("yaw_of_rolled", 1), ("lateral_over_forward", 0.75), ("lateral_over_forward_sigma", 0)):
            self.assertAlmostEqual(numbers[quantity], factor, delta=2e-4, msg=quantity)
        self.assertAlmostEqual(numbers["slip_mean_fl"], 0.03 / R, delta=5e-3)
        self.assertAlmostEqual(numbers["slip_mean_fr"], -0.03 / R, delta=5e-3)

    def test_turning_and_efficiency(self):
        numbers = self.numbers(self.make_turning("turning.bag"))
        self.expect_turning(numbers)
        self.assertAlmostEqual(numbers["drive_energy"], 30 * rolling_rates(0.42, 0.12, 0.5) @ EFFORTS, delta=1e-6)
        self.assertIn("no roller_switches", self.out)

    def test_velocities_of_the_driver_are_turned_round(self):
        numbers = self.numbers(self.make_turning("driver.bag", sign=(-1, 1, -1, 1)))
        self.expect_turning(numbers)
        self.assertIn("driver's opposite sign", self.out)
        self.assertAlmostEqual(numbers["drive_energy"], 30 * rolling_rates(0.42, 0.12, 0.5) @ EFFORTS, delta=1e-6)

    def test_without_velocities_positions_tell_and_without_twists_poses(self):
        self.expect_turning(self.numbers(self.make_turning("positions.bag", velocities=False, truth_twist=False)))
        self.assertIn("velocities are differences of the positions", self.out)
        self.assertIn("velocities are differences of the poses", self.out)
        self.expect_turning(self.numbers(self.make_turning("velocities.bag", positions=False)))
        for sign, words in (((1, 1, 1, -1), "velocities of br have the opposite sign of the positions: negated"),
                            ((1, 1, 3, 1), "its velocities do not fit its positions"), ((0, 0, 0, 0), "always zero"),
                            ((30 / math.pi,) * 4, "are 9.549 times the changes of the positions, rpm of the wheel"),
                            ((-7,) * 4, "are 7 times the changes of the positions, in no known unit")):
            numbers = self.numbers(self.make_turning("wrong.bag", sign=sign))
            self.expect_turning(numbers)
            self.assertIn(words, self.out)
            self.assertAlmostEqual(numbers["rim_slip_rms_fl"], 30, delta=0.5)

    def test_stamps_of_another_clock_than_arrivals(self):
        """Simulated time at three times the wall clock's rate, from the same instant on or far from it."""
        bag = self.make_turning("one_clock.bag")
        for offset in (0, 1.69e9):
            with rosbag.Bag(bag) as one, rosbag.Bag(self.path("two_clocks.bag"), "w") as two:
                for topic, message, t in one.read_messages():
                    if hasattr(message, "header"):
                        message.header.stamp -= genpy.Duration(offset)
                    two.write(topic, message, stamp_of((t - stamp_of(0)).to_sec() / 3))
            numbers = self.numbers(self.path("two_clocks.bag"))
            self.expect_turning(numbers)
            self.assertIn("note: stamps are of another clock than times of arrival: 3 s for each second", self.out)

    def test_one_of_two_publishers_counts(self):
        bag = self.make_turning("one.bag")

        def write(two, topic, message, t, publisher):
            two._topic_connections.pop(topic, None)
            if (topic, publisher) in known:
                two._topic_connections[topic] = known[topic, publisher]
            header = {"topic": topic, "type": message._type, "md5sum": message._md5sum, "callerid": publisher,
                      "message_definition": message._full_text}
            two.write(topic, message, t, connection_header=header)
            known[topic, publisher] = two._topic_connections[topic]
        known = {}
        with rosbag.Bag(bag) as one, rosbag.Bag(self.path("publishers.bag"), "w") as two:
            for k, (topic, message, t) in enumerate(one.read_messages()):
                write(two, topic, message, t, "/driver")
                if topic == "/odom" and k % 2:
                    write(two, topic, odometry(0.05 * k / 3 + 500, (5, 5, 1)), t, "/filter")  # of another clock
        self.expect_turning(self.numbers(self.path("publishers.bag")))
        self.assertRegex(self.out, r"note: /odom has 2 publishers: uses /driver \(601 messages\), not /filter \(\d+\)")
        self.analyse(self.path("publishers.bag"), "--publisher", "/odom=/filter")
        self.assertRegex(self.out, r"odom +/odom: \d+, .*, by /filter")
        self.assertNotIn("2 publishers", self.out)
        self.analyse(self.path("publishers.bag"), "--publisher", "/odom=/other", status=2)
        self.one_line("--publisher /odom=/other", "/driver or /filter")
        self.analyse(self.path("publishers.bag"), "--publisher", "/odom", status=2)
        self.one_line("TOPIC=NODE")

    def test_names_in_a_namespace_and_chosen_ones(self):
        for prefix in ("", "/youbot_1/"):  # relative names, as rosbag record was given them
            bag = self.make_turning("names.bag", prefix=prefix)
            self.expect_turning(self.numbers(bag))
            numbers = self.numbers(bag, "--topic", f"odom={prefix or '/'}ground_truth")
            self.assertAlmostEqual(numbers["final_error"], 0, delta=1e-9)
        self.analyse(bag, "--topic", "odom=/other", status=2)
        self.one_line("odom=/other: must be a topic of type nav_msgs/Odometry", "/youbot_1/odom")

    def test_one_of_two_robots(self):
        bag = self.make_turning("two.bag", prefix="/youbot_2/")
        with rosbag.Bag(bag, "a") as other:
            for k in range(10):
                other.write("/youbot_1/odom", odometry(0.1 * k, (k, 0, 0)), stamp_of(0.1 * k))
        for namespace in ("youbot_2", "/youbot_2", "/youbot_2/"):
            self.expect_turning(self.numbers(bag, "--namespace", namespace))
        self.analyse(bag)
        self.assertNotRegex(self.out, "0.15")
        self.analyse(bag, "--namespace", "youbot", status=2)
        self.one_line("no topic of a base with --namespace youbot: ")

    def test_of_a_base_that_was_put_elsewhere_the_longest_part_is_judged(self):
        turning = self.make_turning("turning.bag", prefix="/a/")

        def put(name, *times, prefix="/a/"):
            with rosbag.Bag(turning) as bag, rosbag.Bag(self.path(name), "w") as changed:
                for topic, message, t in bag.read_messages():
                    if topic == "/a/ground_truth":
                        message.pose.pose.position.x += 5 * sum(t > stamp_of(time) for time in times)
                    changed.write(topic, message, t)
                for time in times:
                    changed.write(prefix + "state_set", odometry(time, (5, 0, 0)), stamp_of(time))
            return self.path(name)
        numbers = self.numbers(put("twice.bag", 10, 25))
        self.assertIn("note: the base was put elsewhere at t = 10.000, 25.000 s, by /a/state_set: judged is the longest "
                      "part, from t = 10.000 s to 25.000 s", self.out)
        self.assertAlmostEqual(numbers["final_heading_error"], 0.005 * 14.95, delta=1e-9)
        self.assertAlmostEqual(numbers["rotation"], 0.5 * 14.95, delta=1e-9)
        self.assertAlmostEqual(numbers["forward_of_commanded"], 1.05, delta=2e-4)
        self.expect_turning(self.numbers(put("before.bag", -1)))
        self.assertNotIn("elsewhere", self.out)
        self.numbers(put("other.bag", 10, prefix="/b/"))
        self.assertNotIn("elsewhere", self.out)

    def test_two_runs_in_one_bag_are_refused(self):
        def twice(name, stamps_later, later, odom_by=None):
            with rosbag.Bag(self.slipping) as bag, rosbag.Bag(self.path(name), "w") as two:
                for run in range(2):
                    for topic, message, t in bag.read_messages(["/odom", "/ground_truth"]):
                        message.header.stamp += genpy.Duration(topic == "/odom" and odom_by or run * stamps_later)
                        two.write(topic, message, t + genpy.Duration(run * later))
            return self.path(name)
        for bag, first in ((twice("clock_set_back.bag", 0.003, 0.003), "0.003"), (twice("loop.bag", 0, 10), "0.000"),
                           (twice("loop_beside_live_truth.bag", 30, 30, odom_by=60), "60.000")):
            self.analyse(bag, status=2)
            self.assertRegex(self.err, rf"go back from t = \d+\.\d+ s to {first} s: must be one run")

    def test_gaps_are_not_bridged(self):
        self.expect_turning(self.numbers(self.make_turning("gap.bag", in_gap=lambda k: 200 < k < 300)))
        self.assertEqual(len(self.table("odometry.csv")), 601 - 99)
        self.assertEqual(len(self.table("slip.csv")), 601 - 99)

    def test_a_real_base_without_truth(self):
        bag = self.make_turning("real.bag", truth=False, sign=(-1, 1, -1, 1), contradiction=0.07)
        numbers = self.numbers(bag)
        self.assertAlmostEqual(numbers["contradiction_rms"], 0.07, delta=1e-9)
        self.assertAlmostEqual(numbers["lateral_of_commanded"], 1.2, delta=1e-9)
        self.assertAlmostEqual(numbers["forward_of_commanded"], 1.05, delta=1e-9)
        self.assertIn("path length by odometry", self.out)
        self.assertRegex(self.out, "  odometry +no ground_truth")

    def test_what_is_missing_is_told(self):
        with rosbag.Bag(self.path("odom_only.bag"), "w") as bag:
            for k in range(10):
                bag.write("/odom", odometry(0.1 * k, (k, 0, 0)), stamp_of(0.1 * k))
        self.analyse(self.path("odom_only.bag"))
        self.assertEqual(self.err, "")
        for section, reason in (("odometry", "no ground_truth"), ("slip", "no joint_states"),
                                ("switches", "no roller_switches"), ("energy", "no contacts"),
                                ("spectrum", "no joint_states"), ("efficiency", "no ground_truth")):
            self.assertRegex(self.out, "  %s +%s" % (section, reason))

    def test_numbers_that_are_not_finite_are_left_out(self):
        def with_nan(topic, message, t):
            return odometry(t, (math.nan, 0, 0)) if topic == "/odom" and t == round(t) else message
        numbers = self.numbers(self.make_slipping(self.path("nan.bag"), with_nan))
        self.assertIn("/odom: pose of 5 messages is not finite, or beyond 1e+09: left out", self.out)
        self.assertEqual(len(self.table("odometry.csv")), 401 - 5)
        self.assertAlmostEqual(numbers["error_per_metre_rms"], 0.05, delta=5e-4)

    def test_a_field_that_is_not_finite_costs_what_is_told_from_it(self):
        def with_states(**fields):
            def change(topic, message, t):
                if topic != "/base/joint_states":
                    return message
                message = copy.deepcopy(message)
                for name, value in fields.items():
                    setattr(message, name, value(t, getattr(message, name)))
                return message
            return self.numbers(self.make_slipping(self.path("fields.bag"), change))
        infinite = lambda t, values: [math.inf] * 4
        self.assertEqual(with_states(effort=infinite), self.known)
        self.assertIn("/base/joint_states: effort of 401 messages is not finite, or beyond 1e+09: left out", self.out)
        numbers = with_states(velocity=infinite)
        self.assertIn("/base/joint_states: velocity of 401 messages is not finite", self.out)
        self.assertIn("it has no velocities: velocities are differences of the positions", self.out)
        self.assertAlmostEqual(numbers["slip_rms_fl"], 0.2, delta=0.01)
        numbers = with_states(position=infinite)
        self.assertIn("/base/joint_states: position of 401 messages is not finite", self.out)
        self.assertAlmostEqual(numbers["ripple_of_rollers_fl"], 0.15, delta=0.003)
        self.assertAlmostEqual(numbers["slip_rms_fl"], 0.2, delta=1e-9)
        numbers = with_states(position=lambda t, values: values[:3] if t > 2 else values)
        self.assertIn("/base/joint_states: position of 200 messages has fewer or more numbers than there are names: "
                      "left out", self.out)
        self.assertAlmostEqual(numbers["ripple_of_rollers_fl"], 0.15, delta=0.003)
        self.assertEqual(len(self.table("slip.csv")), 401)
        with_states(position=lambda t, values: values[:3])
        self.assertIn("/base/joint_states: position of 401 messages has fewer or more numbers", self.out)
        self.assertIn("/base/joint_states has no positions", self.out)
        with_states(position=lambda t, values: [] if t > 2 else values)
        self.assertIn("/base/joint_states: position of 200 messages is not there: left out", self.out)
        numbers = with_states(position=infinite, velocity=infinite, effort=infinite)
        self.assertRegex(self.out, "  slip +/base/joint_states has no message with usable numbers")
        self.assertRegex(self.out, "  spectrum +/base/joint_states has no message with usable numbers")
        self.assertAlmostEqual(numbers["final_error"], self.known["final_error"])

    def test_what_contacts_and_truth_do_not_tell_is_said(self):
        def change(topic, message, t):
            message = copy.deepcopy(message)
            if topic == "/contacts":
                message.floor_power = math.nan
            if topic == "/ground_truth":
                message.pose.pose.position.x = math.nan
            return message
        numbers = self.numbers(self.make_slipping(self.path("untold.bag"), change))
        for note in ("/contacts: floor_power of 2001 messages", "/ground_truth: pose of 401 messages"):
            self.assertIn(note, self.out)
        self.assertRegex(self.out, "  energy +/contacts has no floor; /base/joint_states has no effort")
        self.assertRegex(self.out, "  odometry +/ground_truth has no x, y, psi")
        for quantity in ("slip_rms_fl", "contact_slip_maximal_fl", "jump_maximal", "forward_of_rolled"):
            self.assertAlmostEqual(numbers[quantity], self.known[quantity], delta=2e-6 * quantity.startswith("forward"))

    # Bags that are damaged

    def test_what_is_no_bag_is_refused(self):
        for name, content in (("empty.bag", b""), ("text.bag", b"something else\n"),
                              ("noise.bag", bytes(range(256)) * 40)):
            Path(self.path(name)).write_bytes(content)
            self.analyse(self.path(name), status=2)
            self.one_line(name, "must b")
        os.mkfifo(self.path("fifo"))
        Path(self.path("drive.mcap")).write_bytes(b"\x89MCAP0\r\n")
        for path, words in ((self.path("none.bag"), "No such file"), (self.folder, "is a folder"),
                            (self.path("fifo"), "not a regular file"), ("a\nb", r"'a\nb'"),
                            (self.path("drive.mcap"), "drive.mcap is of ROS 2")):
            self.analyse(path, status=2)
            self.one_line(words, "must be a bag")
        content, field = Path(self.slipping).read_bytes(), b"encryptor=rosbag/AesCbcEncryptor"
        header = content[17:17 + struct.unpack_from("<I", content, 13)[0]] + struct.pack("<I", len(field)) + field
        Path(self.path("secret.bag")).write_bytes(content[:13] + struct.pack("<I", len(header)) + header + content[86:])
        self.analyse(self.path("secret.bag"), status=2)
        self.one_line("secret.bag is encrypted: run rosbag decrypt on a copy")
        with rosbag.Bag(self.path("nothing.bag"), "w"):
            pass
        self.analyse(self.path("nothing.bag"), status=2)
        self.one_line("nothing.bag has no messages")
        with rosbag.Bag(self.path("foreign.bag"), "w") as bag:
            bag.write("/chatter", String("hello"), stamp_of(0))
        self.analyse(self.path("foreign.bag"), status=2)
        self.one_line("no topic of a base", "/chatter (std_msgs/String)")
        with rosbag.Bag(self.path("nan_only.bag"), "w") as bag:
            bag.write("/odom", odometry(0, (math.nan, 0, 0), (math.nan, 0, 0)), stamp_of(0))
        self.analyse(self.path("nan_only.bag"), status=2)
        self.one_line("no topic of a base", "/odom: pose of 1 messages is not finite")

    def test_a_bag_that_is_cut_is_analysed_as_far_as_it_goes(self):
        whole = Path(self.slipping).read_bytes()
        cut = self.path("cut.bag")
        ends = []
        for size in (14, 100, 4100, 4117, 30000, 60000, len(whole) // 3, len(whole) // 2, len(whole) - 20):
            Path(cut).write_bytes(whole[:size])
            read_at = os.stat(cut).st_mtime_ns
            if size < 5000:
                self.analyse(cut, status=2)
                self.one_line("cut.bag has no messages that can be read")
            else:
                numbers = self.numbers(cut, "--only", "path,odometry,slip")
                self.one_line("warning: ", "cut.bag has no complete index", "read up to t = ")
                ends.append(float(self.table("odometry.csv")[-1]["t_s"]))
                self.assertAlmostEqual(numbers["slip_rms_fl"], 0.2, delta=1e-9)
            self.assertEqual(Path(cut).read_bytes(), whole[:size])
            self.assertEqual(os.stat(cut).st_mtime_ns, read_at)
        self.assertEqual(ends, sorted(ends))
        self.assertEqual(ends[-1], 4, "only the index is lost")
        self.assertAlmostEqual(ends[-2], 4 * 0.5, delta=0.2)
        self.assertLess(0, ends[0])

    def test_a_damaged_chunk_ends_what_is_read(self):
        whole = bytearray(Path(self.slipping).read_bytes())
        middle = len(whole) // 2
        whole[middle:middle + 3000] = b"\xff" * 3000
        Path(self.path("damaged.bag")).write_bytes(whole)
        self.analyse(self.path("damaged.bag"))
        self.one_line("warning: ", "damaged.bag is damaged", "read up to t = ")

    def test_compression_changes_nothing(self):
        for compression in ("bz2", "lz4"):
            bag = self.make_slipping(self.path(compression + ".bag"), compression=compression)
            self.assertEqual(self.numbers(bag), self.known)
            whole = Path(bag).read_bytes()
            Path(bag).write_bytes(whole[:len(whole) // 2])
            numbers = self.numbers(bag)
            self.one_line("warning: ", "read up to t = ")
            self.assertLess(numbers["path_length"], self.known["path_length"])
            self.assertAlmostEqual(numbers["slip_rms_fl"], 0.2, delta=1e-9)

    # Outputs and arguments

    def test_nothing_half_written_is_left(self):
        folder = self.path("blocked")
        os.makedirs(os.path.join(folder, "slip.csv"))
        self.analyse(self.slipping, "--csv", folder, status=2)
        self.one_line("slip.csv: cannot be written: Is a directory")
        self.assertEqual((self.out, os.listdir(folder)), ("", ["slip.csv"]))
        full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        with unittest.mock.patch("os.replace", side_effect=full):
            self.analyse(self.slipping, "--csv", self.path("full"), status=1)
        self.one_line("odometry.csv: cannot be written: no space left for it (No space left on device)")
        self.assertEqual(os.listdir(self.path("full")), [])
        with unittest.mock.patch("tempfile.mkstemp", side_effect=full):
            self.analyse(self.slipping, "--csv", self.path("full"), status=1)
        self.one_line("odometry.csv: cannot be written: no space left for it (No space left on device)")
        self.assertEqual(self.out, "")
        self.analyse(self.slipping, "--csv", self.slipping, status=2)
        self.one_line("must be a folder to write to")
        self.assertEqual(self.out, "")

    def test_what_is_read_is_never_written(self):
        folder, desired = self.path("reads"), self.path("desired_rows.csv")
        bag = shutil.copy(self.slipping, self.path("read.bag"))
        Path(desired).write_text("t,x,y,V_X,V_Y,Omega\n0,0,0,0,0,0\n4,1,0,0,0,0\n")
        Path(self.path("read.yaml")).write_text("robot: {}\n")
        arguments = [bag, "--scene", self.path("read.yaml"), "--desired", desired]
        os.mkdir(folder)
        for read in (bag, self.path("read.yaml"), desired):
            content = Path(read).read_bytes()
            for option, name in (("--csv", "summary.csv"), ("--csv", "slip.csv"), ("--plots", "slip.png")):
                for link in (os.symlink, os.link):
                    place = os.path.join(folder, name)
                    link(read, place)
                    self.analyse(*arguments, option, folder, status=2)
                    self.one_line("%s = %s: must not be a file that is read" % (option, place))
                    self.assertEqual((self.out, os.listdir(folder)), ("", [name]))
                    os.remove(place)
            self.assertEqual(Path(read).read_bytes(), content)
        os.symlink("slip.csv", os.path.join(folder, "summary.csv"))
        self.analyse(bag, "--csv", folder, status=2)
        self.one_line("summary.csv: must not be the file of --csv")
        # The path has no table: a motion of that name stays.
        os.mkdir(self.path("beside"))
        desired = shutil.copy(desired, os.path.join(self.path("beside"), "path.csv"))
        self.analyse(bag, "--desired", desired, "--only", "path,path", "--csv", self.path("beside"))
        self.assertEqual(self.out.count("off the desired path"), 1)

    def test_standard_output_that_takes_no_more(self):
        with open("/dev/full", "w") as full:
            ran = subprocess.run([sys.executable, SCRIPT, self.slipping, "--only", "path", "--csv", self.path("told")],
                                 stdout=full, stderr=subprocess.PIPE, text=True)
        self.assertEqual(ran.stderr, "analyse: standard output: cannot be written: no space left for it "
                         "(No space left on device)\n")
        self.assertEqual((ran.returncode, os.listdir(self.path("told"))), (1, ["summary.csv"]))
        read, write = os.pipe()
        os.close(read)
        ran = subprocess.run([sys.executable, SCRIPT, "--help"], stdout=write, stderr=subprocess.PIPE, text=True)
        os.close(write)
        self.assertEqual((ran.returncode, ran.stderr), (1, ""))

    def test_devices_stay_devices_and_files_keep_their_mode(self):
        with tempfile.TemporaryDirectory() as folder:
            pipe, table = os.path.join(folder, "pipe"), os.path.join(folder, "table")
            os.mkfifo(pipe)
            reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
            self.addCleanup(os.close, reader)
            with open(table, "w"):
                os.chmod(table, 0o640)
            for path in (pipe, table):
                files.write_whole(path, "rows\n")
            self.assertEqual(os.read(reader, 100), b"rows\n")
            self.assertEqual(os.stat(table).st_mode & 0o777, 0o640)
            self.assertEqual(sorted(os.listdir(folder)), ["pipe", "table"])

    def test_files_of_an_earlier_run_are_named(self):
        folder = self.path("earlier")
        self.analyse(self.slipping, "--csv", folder)
        self.assertEqual(self.err, "")
        self.analyse(self.slipping, "--csv", folder, "--only", "odometry")
        self.one_line("warning: ", "energy.csv", "from an earlier run")

    def test_columns_have_units(self):
        for name in os.listdir(self.path("known")):
            if name == "summary.csv":
                continue
            for column in self.table(name, "known")[0]:
                self.assertRegex(
                    column, "_(s|m|rad|J|rad_per_s|m_per_s|per_turn)$|^(wheel|direction|count|friction_share_.*)$")

    def test_several_bags_go_to_a_folder_each(self):
        other = self.make_turning("second.bag")
        folder = self.path("several")
        self.analyse(self.slipping, other, "--csv", folder)
        self.assertTrue(os.path.exists(os.path.join(folder, "slipping", "energy.csv")))
        self.assertTrue(os.path.exists(os.path.join(folder, "second", "odometry.csv")))
        self.analyse(self.path("none.bag"), other, status=2)
        self.one_line("none.bag")
        self.assertIn("second.bag: ", self.out)

    def test_bad_arguments_are_refused(self):
        for arguments, words in ((["--only", "odo"], "'odo': must be of alignment, path"),
                                 (["--topic", "speed=/odom"], "'speed=/odom': must be NAME=TOPIC"),
                                 (["--topic", "/cmd"], "--topic /cmd: must be a topic of a base; it has"),
                                 (["--frames", "a,a"], "must be FIXED,BODY, two different frames"),
                                 (["--clock-offset", "/odom=1e10"], "seconds up to 1e+09"),
                                 (["--scene", "/none"], "/none: No such file"),
                                 (["--desired", "/none"], "/none: No such file"),
                                 (["--desired", SCRIPT], "must be rows of simulate --csv")):
            self.analyse(self.slipping, *arguments, status=2)
            self.one_line(words)
        for text, words in (("robot: {wheel_radius: -1}", "robot.wheel_radius is '-1': must be a number from 0.001 to 1000"),
                            ("robot: {rollers_per_wheel: 5.5}", "robot.rollers_per_wheel is '5.5'"),
                            ("robot: {wheel_radius: 1%s}" % (400 * "0"), "robot.wheel_radius is '1000"),
                            ("robot: {wheel_radius: 2024-13-45}", "is '2024-13-45': must be a number from"),
                            ("robot: {wheel_radius: 0x%s}" % (5000 * "f"), "ff': must be a number from"),
                            ("robot: {wheel_radius: [1, 2, 3]}", "is a list or map: must be a number from"),
                            ("robot: {roller_angle: [45, 45, 0, 45]}", "0, or four of these"),
                            ("robot: {rollers_per_wheel: 256}", "must be a whole number from 3 to 255"),
                            ("robot: {roller_angle: -45, half_track: 0.235}", "must be such that the wheels' rates decide"),
                            ("robot: {<<: {wheel_radius: 1}}", "has the merge key <<: must be left out"),
                            ("robot: 3", "must be a scene"), ("[", "is not YAML")):
            Path(self.path("bad.yaml")).write_text(text)
            self.analyse(self.slipping, "--scene", self.path("bad.yaml"), status=2)
            self.one_line(words)

    def test_what_is_read_is_a_file_or_a_pipe_and_not_too_long(self):
        os.mkfifo(self.path("nobody"))
        with open(self.path("long"), "wb") as file:
            file.truncate(250000001)
        for option, most in (("--scene", "1000000"), ("--desired", "250000000")):
            for path, words in ((self.path("nobody"), "is a pipe without a writer; must be"),
                                ("/dev/zero", "is neither a file nor a pipe; must be"),
                                (self.folder, "Is a directory; must be"),
                                (self.path("long"), "is longer than %s bytes" % most)):
                self.analyse(self.slipping, option, path, status=2)
                self.one_line("%s %s: %s" % (option, path, words))
        os.mkfifo(self.path("somebody"))
        with subprocess.Popen(["sh", "-c", "exec >$0; sleep 1.2; echo 'robot: {wheel_radius: -7}'",
                               self.path("somebody")]):
            self.analyse(self.slipping, "--scene", self.path("somebody"), status=2)
        self.one_line("robot.wheel_radius is '-7'")

    def test_empty_names_are_refused(self):
        for option in ("--csv", "--plots", "--html", "--scene", "--desired"):
            self.analyse(self.slipping, option, "", status=2)
            self.one_line('%s = "": must not be empty' % option)
        for option in ("--only", "--topic"):
            self.analyse(self.slipping, option, "", status=2)
            self.one_line("%s: '': must be" % option)
        self.analyse("", status=2)
        self.one_line('bag = "": must not be empty')

    def test_plots(self):
        folder = self.path("plots")
        self.analyse(self.slipping, "--plots", folder)
        names = sorted(os.listdir(folder))
        self.assertEqual(names, [name + ".png" for name in (
            "efficiency", "energy", "odometry", "slip", "spectrum", "switches")])
        for name in names:
            with open(os.path.join(folder, name), "rb") as file:
                self.assertEqual(file.read(4), b"\x89PNG")
        with tempfile.TemporaryDirectory() as path:
            Path(os.path.join(path, "matplotlib.py")).write_text("raise ImportError")
            ran = subprocess.run([sys.executable, SCRIPT, self.slipping, "--plots", self.path("no_plots")], text=True,
                                 capture_output=True, env={**os.environ, "PYTHONPATH": path + os.pathsep +
                                                           os.environ.get("PYTHONPATH", "")})
        self.assertEqual((ran.returncode, ran.stdout), (2, ""))
        self.assertEqual(ran.stderr, "analyse: --plots needs the package python3-matplotlib\n")

    def test_html(self):
        """One file has what is printed and the figures of --plots, and makes a browser load nothing."""
        bag, file, folder = self.path("<b>&.bag"), self.path("report.html"), Path(self.path("html_plots"))
        shutil.copy(self.slipping, bag)
        with rosbag.Bag(self.path("no_truth.bag"), "w") as no_truth:
            for topic, message, t in self.slipping_messages:
                if topic in ("/odom", "/base/joint_states"):
                    no_truth.write(topic, message, stamp_of(t))
        self.analyse(bag, no_truth.filename, "--html", file, "--plots", str(folder))
        tags, texts = [], []
        reader = html.parser.HTMLParser()
        reader.handle_starttag = lambda tag, attributes: tags.append((tag, dict(attributes)))
        reader.handle_data = texts.append
        reader.feed(Path(file).read_text())
        text = " ".join(" ".join(texts).split())
        for line in self.out.splitlines():
            if self.folder not in line:
                self.assertIn(" ".join(line.split()), text)
        self.assertIn("<b>&.bag", text)
        self.assertNotRegex(Path(file).read_text(), "(?i)https?:|url\\(|@import")
        self.assertLessEqual({tag for tag, _ in tags}, set("html meta title style h1 h2 table tr th td div img".split()))
        self.assertIn(("meta", "default-src 'none'; img-src data:; style-src 'unsafe-inline'"),
                      [(tag, attributes.get("content")) for tag, attributes in tags])
        self.assertIn(("td", {"colspan": "2"}), tags, "notes do not widen the column of names")
        begin, pictures = "data:image/png;base64,", [attributes["src"] for tag, attributes in tags if tag == "img"]
        self.assertTrue(all(picture.startswith(begin) for picture in pictures))
        self.assertEqual(sorted(base64.b64decode(picture[len(begin):]) for picture in pictures),
                         sorted(path.read_bytes() for path in folder.rglob("*.png")))
        self.assertTrue((folder / "no_truth" / "path.png").exists(), "the track by odometry")
        self.analyse(bag, "--html", bag, status=2)
        self.one_line("--html = ", "must not be a file that is read")

    # The real ones

    def test_a_bag_of_simulate(self):
        scene = self.path("scene.yaml")
        with open(scene, "w") as file:
            file.write("duration: 3\noutput_rate: 500\ninitial: {wheel_angles: [0.1, 0.1, 0.1, 0.1]}\n"
                       "output: {contacts: true}\n"
                       "drive: {reference_motion: {period: 4, V_X: {constant: 0.3}, V_Y: {constant: 0.4}, "
                       "Omega: {constant: 0.2}}}\n")
        files = {name: self.path("run." + name) for name in ("bag", "csv", "switches")}
        for model, desired in (("no_slip", "desired.csv"), ("coulomb", None)):
            arguments = [SIMULATE, scene, "--quiet", "--model", model, "--csv"]
            arguments.append(self.path(desired) if desired else files["csv"])
            if not desired:
                arguments += ["--bag", files["bag"], "--switches", files["switches"]]
            subprocess.run(arguments, check=True, timeout=60)
        numbers = self.numbers(files["bag"], "--desired", self.path("desired.csv"), "--scene", scene)
        self.assertEqual(self.err, "")
        with open(files["csv"], newline="") as file:
            rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
        with open(self.path("desired.csv"), newline="") as file:
            wanted = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
        with open(files["switches"], newline="") as file:
            self.assertEqual(numbers["switches"], sum(int(row["count"]) for row in csv.DictReader(file)))
        self.assertAlmostEqual(numbers["final_x"], rows[-1]["x"], delta=1e-12)
        self.assertAlmostEqual(numbers["final_deviation"],
                               math.hypot(rows[-1]["x"] - wanted[-1]["x"], rows[-1]["y"] - wanted[-1]["y"]), delta=1e-9)
        slip = [rolling_rates(row["V_X"], row["V_Y"], row["Omega"])[0] - row["dphi_fl"] for row in rows]
        self.assertAlmostEqual(numbers["slip_rms_fl"], math.sqrt(np.mean(np.square(slip))), delta=1e-9)
        self.assertLess(abs(numbers["residual"]), 1e-3 * numbers["drive_energy"])
        self.assertIn("the balance closes", self.out)
        self.assertTrue(0.8 < numbers["lateral_of_desired"] < 1)

    def test_rosrun_finds_it(self):
        if (ROOT / "devel").is_dir() and not os.path.realpath(SIMULATE).startswith(f"{ROOT}/"):
            self.skipTest("rosrun would find what was built within the source tree as well")
        ran = subprocess.run([ENVIRONMENT, "rosrun", "youbot_base_sim", "analyse", self.slipping, "--only", "path"],
                             text=True, capture_output=True, stdin=subprocess.DEVNULL, timeout=60)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""), ran.stdout)
        self.assertIn("true pose", ran.stdout)


if __name__ == "__main__":
    SIMULATE, ENVIRONMENT = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
