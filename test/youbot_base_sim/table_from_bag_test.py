"""scripts/table_from_bag: tables of what a bag tells, which simulate replays.

Usage: table_from_bag_test.py SIMULATE
"""
import math
import os
import subprocess
import sys
import unittest

import numpy as np
import rosbag
from brics_actuator.msg import JointTorques, JointValue
from harness import JOINTS, ROOT, WHEELS, RunsPrograms, joint_state, odometry, rolling_rates, stamp_of, twist

SIMULATE = None
PERIOD, DURATION = 1e-3, 2  # s
RPM = 2 * math.pi / 60 * 364 / 9405  # rad/s: one of the motor, in which it is read
FULL = "cannot be written: no space left for it (No space left on device)\n"
DRIVER = ("wheel_joint_fl", "wheel_joint_bl")  # which turn the other way round in the driver's messages
TORQUES = "/base/base_controller/torques_command"


class TableFromBagTest(RunsPrograms):
    def setUp(self):
        self.bag, self.csv = self.path("x.bag"), self.path("table.csv")
        for path in filter(os.path.exists, (self.bag, self.csv)):
            os.remove(path)

    def record(self, topic, messages, more=()):
        """A bag like a recorder's, of messages that arrive at these times, s; `more` have topics too."""
        with rosbag.Bag(self.bag, "w") as bag:
            for other, t, message in [("/something", 0, twist(0, 0, 0)), *((topic, *one) for one in messages), *more]:
                bag.write(other, message, stamp_of(t))

    def table(self, *arguments):
        """Times and values of the table that it makes."""
        self.runs("table_from_bag", self.bag, *arguments, self.csv)
        rows = np.loadtxt(self.csv, delimiter=",", skiprows=1, ndmin=2)
        return rows[:, 0], rows[:, 1:]

    def refused(self, words, *arguments):
        self.runs("table_from_bag", self.bag, *arguments, status=2)
        self.one_line(words)
        self.assertFalse(os.path.exists(self.csv))

    def simulate(self, drive, *outputs, rate=1 / PERIOD):
        """Rows of a simulation of the drive by name of the column."""
        with open(self.path("scene.yaml"), "w") as file:
            file.write(f"duration: {DURATION}\noutput_rate: {rate}\nsolver: {{relative_tolerance: 1e-6, "
                       f"absolute_tolerance: 1e-9{', control_period: 1e-3' * ('angle' not in drive)}}}\n"
                       f"{'motors: {quantized: true}' * ('velocity' in drive)}\ndrive: {{{drive}}}\n")
        subprocess.run([SIMULATE, self.path("scene.yaml"), "--quiet", "--csv", self.path("rows.csv"), *outputs],
                       check=True, timeout=60)
        return np.genfromtxt(self.path("rows.csv"), delimiter=",", names=True)

    def drive(self, turned=()):
        """Records a base that drives for two seconds, with velocities and efforts of these joints negated; its rows."""
        np.savetxt(self.path("commands.csv"), [[0, *rolling_rates(0.2, 0.1, 0.3, 0.0475)]], delimiter=",",
                   header="t,fl,fr,bl,br", comments="")
        rows = self.simulate("velocity_table: commands.csv", "--bag", self.path("simulated.bag"))
        with rosbag.Bag(self.path("simulated.bag")) as simulated, rosbag.Bag(self.bag, "w") as bag:
            for topic, message, t in simulated.read_messages():
                if topic.endswith("joint_states"):
                    signs = [-1 if name in turned else 1 for name in message.name]
                    message.velocity, message.effort = np.multiply([message.velocity, message.effort], signs)
                bag.write(topic, message, t)
        return rows

    def test_twists(self):
        velocities = ((0.2, 0, 0), (0.2, 0, 0), (-0.1, 0.15, 0.4), (math.nan, 0, 0))
        self.record("cmd_vel", [(0.1 + 0.5 * k, twist(*one)) for k, one in enumerate(velocities)])
        t, rates = self.table("--velocity")
        self.assertIn("cmd_vel: twist of 1 messages is not finite", self.err)
        np.testing.assert_allclose(t, (0.1, 1.1), atol=1e-9)  # the same again is no row
        np.testing.assert_allclose(rates, [rolling_rates(*velocities[k], 0.0475) for k in (0, 2)], atol=1e-12)
        _, rates = self.table("--wheel-radius", "0.1", "--half-lengths", "0.5", "--velocity")
        np.testing.assert_allclose(rates[1], rolling_rates(*velocities[2], 0.1, 0.5), atol=1e-12)

    def test_torques_of_wheels_that_a_command_does_not_name_or_whose_unit_is_another_stay(self):
        messages = [(0.5 * k, JointTorques(torques=[
            JointValue(joint_uri=joint, unit="m^2 kg s^-2 rad^-1", value=value) for joint, value in zip(
                JOINTS, (torque, 0.9, 0.7, 1.1))])) for k, torque in enumerate((0.8, 5, -0.5))]
        messages[1][1].torques.pop()
        messages[2][1].torques[0].unit = "Nm"
        self.record(TORQUES, messages)
        _, torques = self.table("--torque")
        self.assertIn('wheel_joint_fl of 1 messages has the unit "Nm"', self.err)
        np.testing.assert_array_equal(torques, [(0.8, 0.9, 0.7, 1.1), (5, 0.9, 0.7, 1.1)])

    def test_measured_velocities_and_torques_are_positive_forward_and_make_the_motion_again(self):
        for turned in ((), DRIVER):
            rows = self.drive(turned)
            t, rates = self.table("--measured", "--velocity")
            self.assertEqual("have the driver's opposite sign" in self.err, bool(turned))
            np.testing.assert_allclose(t, rows["t"], atol=1e-9)
            for wheel, measured in zip(WHEELS, rates.T):
                np.testing.assert_allclose(measured, rows["dphi_" + wheel], atol=0.5001 * RPM)
        self.table("--measured", "--torque")
        again, way = self.simulate("torque_table: table.csv"), math.hypot(rows["x"][-1], rows["y"][-1])
        self.assertGreater(way, 0.3)
        for axis in "xy":  # what is lost is half a mA of each torque
            self.assertAlmostEqual(again[axis][-1], rows[axis][-1], delta=0.014 * way)

    def test_wheel_angles_in_either_convention_of_the_velocities(self):
        rows = self.drive(DRIVER)
        self.refused("has the joints", "--joints=a,b,c,d", "--angles", self.csv)
        self.refused("--angles FILE alone", "--angles", self.csv, "--velocity", self.path("v.csv"))
        self.table("--angles")
        again = self.simulate("wheel_angle_table: table.csv")
        for name, delta in (("phi_fl", 0.01), ("phi_br", 0.01), ("x", 2e-3), ("y", 2e-3), ("psi", 5e-3)):
            self.assertAlmostEqual(again[name][-1], rows[name][-1], delta=delta, msg=name)

    def test_what_cannot_be_read_or_told_is_refused(self):
        velocity, other = ("--velocity", self.csv), self.path("other.csv")
        self.refused("x.bag: No such file", *velocity)
        self.record("/cmd_vel", [(0, twist(0, 0, 0))])
        for words, *arguments in (
                ("or --angles FILE alone",),
                ("no torques_command (brics_actuator/JointTorques); it has /cmd_vel (geometry_msgs/Twist), /something",
                 "--torque", self.csv),
                ("--topic /cmd: must be a topic of a base; it has /cmd_vel", *velocity, "--topic", "/cmd"),
                ("no joint_states (sensor_msgs/JointState); it has", *velocity, "--measured"),
                ('--torque = "": must not be empty', *velocity, "--torque", ""),
                ("--wheel-radius: '': must be a number > 0", *velocity, "--wheel-radius", ""),
                ("--velocity", "--velocity", self.path("./x.bag")),
                ("must not be a file that is read", "--torque", other, "--velocity", self.bag),
                ("other.csv: must not be the file of --velocity", "--velocity", other, "--torque", other),
                ("none/t.csv: cannot be written: No such file or directory", *velocity, "--torque",
                 self.path("none/t.csv")),
                ("Is a directory", *velocity, "--torque", self.folder)):
            self.refused(words, *arguments)
        os.symlink("x.bag", self.path("link.csv"))
        self.refused("link.csv: must not be a file that is read", *velocity, "--torque", self.path("link.csv"))
        self.record("/cmd_vel", [(1, twist(0, 0, 0))], [(TORQUES, 2, JointTorques())])
        self.refused("torques_command too: choose the topics of one table with --topic", *velocity)
        self.table("--topic", "/cmd_vel", "--velocity")

    def test_where_an_output_takes_no_more_the_exit_status_is_1(self):
        rows = self.drive()
        self.runs("table_from_bag", self.bag, "--measured", "--velocity", "/dev/full", status=1)
        self.assertEqual(self.err, "table_from_bag: /dev/full: " + FULL)
        ran = subprocess.run(["bash", "-c", '"$@" > /dev/full', "", sys.executable, ROOT / "scripts" / "table_from_bag",
                              self.bag, "--measured", "--velocity", self.csv], text=True, capture_output=True, timeout=60)
        self.assertEqual((ran.returncode, ran.stderr), (1, "table_from_bag: standard output: " + FULL))
        with open(self.csv) as file:
            self.assertEqual(len(file.readlines()), 1 + len(rows))  # whole all the same

    def test_a_base_that_was_put_elsewhere_is_refused(self):
        for topic, words in (("state_set", "x.bag: the base was put elsewhere at t = 1.500 s, by state_set: must be one "
                              "run"), ("/b/state_set", "")):
            self.record("/a/cmd_vel", [(t, twist(0, 0, 0)) for t in (0, 1)],
                        [(topic, 1.5, odometry(1.5, (0, 0, 0))), ("/a/cmd_vel", 2, twist(0, 0, 0))])
            arguments = "--topic", "/a/cmd_vel", "--velocity"
            self.refused(words, *arguments, self.csv) if words else self.table(*arguments)

    def test_joint_states_that_do_not_tell(self):
        def states(position, velocity):
            self.record("/joint_states", [(k, joint_state(k, k * np.array(position), velocity)) for k in range(3)])
        ones = (1, 1, 1, 1)
        states(ones, ones)
        self.refused("/joint_states has no effort", "--measured", "--torque", self.csv)
        states((0, 0, 0, 0), ones)
        self.refused("give --joint-velocity-sign", "--measured", "--velocity", self.csv)
        states(ones, (-1, 1, 1, 1))
        np.testing.assert_allclose(self.table("--measured", "--velocity")[1], 1)
        self.assertIn(f"warning: {self.bag}: /joint_states: velocities of fl have the opposite sign", self.err)


if __name__ == "__main__":
    SIMULATE = sys.argv.pop(1)
    unittest.main()
