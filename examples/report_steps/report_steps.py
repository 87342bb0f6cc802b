#!/usr/bin/python3
"""A controller for which time waits by ~wait_for: it answers each odometry message by a command."""

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry


def answer(odometry):
    command = Twist()
    command.linear.x = 4 * (0.1 - odometry.pose.pose.position.x)
    commands.publish(command)


rospy.init_node("report_steps")
commands = rospy.Publisher("cmd_vel", Twist, queue_size=10)
rospy.Subscriber("filtered", Odometry, answer, tcp_nodelay=True)
rospy.spin()
