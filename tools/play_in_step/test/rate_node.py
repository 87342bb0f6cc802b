#!/usr/bin/python3
"""Smooths odometry in a loop of its own: what it publishes depends on when it looks."""
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

rospy.init_node("rate_node")
latest, smooth = Odometry(), Twist()


def take(message):
    global latest
    latest = message


rospy.Subscriber("wheel_odometry", Odometry, take)
publisher = rospy.Publisher("smooth", Twist, queue_size=10)
rate = rospy.Rate(30)
while not rospy.is_shutdown():
    smooth.linear.x += 0.2 * (latest.twist.twist.linear.x - smooth.linear.x)
    publisher.publish(smooth)
    rate.sleep()
