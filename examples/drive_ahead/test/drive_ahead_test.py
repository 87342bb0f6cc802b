#!/usr/bin/python3
"""The base ends one metre forward by odometry, which is 5 % short of the truth, as the driver's is."""

import sys
import time
import unittest

import rospy
import rostest
from nav_msgs.msg import Odometry


class DriveAheadTest(unittest.TestCase):
    def setUp(self):
        self.odometry = self.truth = Odometry()
        rospy.Subscriber("odom", Odometry, lambda message: setattr(self, "odometry", message))
        rospy.Subscriber("ground_truth", Odometry, lambda message: setattr(self, "truth", message))

    def stands_ahead(self):
        return self.odometry.pose.pose.position.x > 0.9 and abs(self.odometry.twist.twist.linear.x) < 1e-3

    def test_goes_one_metre(self):
        end = time.monotonic() + 280
        while not self.stands_ahead():
            self.assertLess(time.monotonic(), end, f"no time left at {rospy.get_time():.2f} s of simulated time")
            time.sleep(0.01)
        self.assertAlmostEqual(self.odometry.pose.pose.position.x, 1.0, delta=0.01)
        self.assertAlmostEqual(self.truth.pose.pose.position.x, 1.05, delta=0.02)
        self.assertAlmostEqual(self.truth.pose.pose.position.y, 0.0, delta=0.01)


if __name__ == "__main__":
    rospy.init_node("drive_ahead_test")
    rostest.rosrun("drive_ahead", "drive_ahead", DriveAheadTest, sys.argv)
