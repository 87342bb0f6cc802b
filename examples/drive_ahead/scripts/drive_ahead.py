#!/usr/bin/python3
"""Drives one metre forward by odometry and ends. It works alike with the real and the simulated base."""

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

GOAL = 1.0         # m
TOLERANCE = 0.005  # m
GAIN = 2.0         # 1/s
MAX_SPEED = 0.5    # m/s


class DriveAhead:
    def __init__(self):
        self.x = None
        self.commands = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self.odometry = rospy.Subscriber("odom", Odometry, self.take)

    def take(self, odometry):
        self.x = odometry.pose.pose.position.x

    def run(self):
        rate = rospy.Rate(50)
        while self.x is None:
            rate.sleep()
        while abs(GOAL - self.x) > TOLERANCE:
            command = Twist()
            command.linear.x = max(-MAX_SPEED, min(MAX_SPEED, GAIN * (GOAL - self.x)))
            self.commands.publish(command)
            rate.sleep()
        self.commands.publish(Twist())
        rate.sleep()


if __name__ == "__main__":
    rospy.init_node("drive_ahead")
    try:
        DriveAhead().run()
    except rospy.ROSInterruptException:
        pass
