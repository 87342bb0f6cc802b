#!/usr/bin/python3
"""Time waits for nodes in Python: loops of any rate, one command and a long sleep, actions, transforms of the present."""

import sys
import unittest

import rospy
import rostest
import tf2_ros
from actionlib import SimpleActionClient, SimpleActionServer
from actionlib.msg import TestAction, TestGoal, TestResult
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty

LOOPS = 40


def towards(x):
    """Forward, the faster the further from 0.3 m."""
    command = Twist()
    command.linear.x = min(0.5, 2 * (0.3 - x))
    return command


class LockstepTest(unittest.TestCase):
    def setUp(self):
        self.x = 0.0
        self.odometry = rospy.Subscriber("odom", Odometry, self.take)
        self.commands = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        while self.commands.get_num_connections() == 0:
            rospy.sleep(0.01)

    def tearDown(self):
        self.odometry.unregister()

    def take(self, odometry):
        self.x = odometry.pose.pose.position.x

    def fresh(self):
        """The base is at its start, and nothing is simulated until a command comes."""
        rospy.ServiceProxy("base_node/reset", Empty)()
        rospy.wait_for_message("odom", Odometry)
        rospy.sleep(0.05)
        self.assertEqual(self.x, 0)

    def drive_by_rate(self, hertz):
        self.fresh()
        seen = []
        rate = rospy.Rate(hertz)
        start = rospy.get_time()
        for _ in range(LOOPS):
            self.commands.publish(towards(self.x))
            rate.sleep()
            seen.append(self.x)
        self.assertAlmostEqual(rospy.get_time() - start, LOOPS / hertz, delta=0.0101)
        return seen

    def command_and_sleep(self):
        self.fresh()
        command = Twist()
        command.linear.x = 0.2
        self.commands.publish(command)
        rospy.sleep(2.0)
        return [self.x]

    def drive_by_action(self, client):
        self.fresh()
        client.send_goal(TestGoal(50))
        self.assertTrue(client.wait_for_result(rospy.Duration(20)))
        return [1e-9 * client.get_result().result]

    def drive_by_transforms(self):
        self.fresh()
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)
        while not buffer.can_transform("odom", "base_footprint", rospy.Time(0)):
            rospy.sleep(0.01)
        seen = [0]
        rate = rospy.Rate(100)
        for _ in range(LOOPS):
            self.commands.publish(towards(seen[-1]))
            rate.sleep()
            transform = buffer.lookup_transform("odom", "base_footprint", rospy.Time.now())  # or raises
            seen.append(transform.transform.translation.x)
            self.assertEqual(seen[-1], self.x)
        listener.unregister()
        return seen

    def expect_same(self, drive, least):
        expected = drive()
        self.assertGreater(expected[-1], least)
        self.assertEqual(drive(), expected)

    def test_loops_and_one_command(self):
        for drive, least in ((lambda: self.drive_by_rate(30), 0.05), (lambda: self.drive_by_rate(100), 0.05),
                             (self.command_and_sleep, 0.3), (self.drive_by_transforms, 0.05)):
            self.expect_same(drive, least)

    def test_action(self):
        def execute(goal):
            rate = rospy.Rate(goal.goal)
            for _ in range(goal.goal):
                self.commands.publish(towards(self.x))
                rate.sleep()
            server.set_succeeded(TestResult(round(1e9 * self.x)))

        server = SimpleActionServer("drive", TestAction, execute, auto_start=False)
        server.start()
        client = SimpleActionClient("drive", TestAction)
        self.assertTrue(client.wait_for_server(rospy.Duration(20)))
        self.expect_same(lambda: self.drive_by_action(client), 0.1)


if __name__ == "__main__":
    rospy.init_node("lockstep_test")
    rostest.rosrun("youbot_base_sim", "lockstep_python", LockstepTest, sys.argv)
