#!/usr/bin/python3
"""Publishes the transform map -> odom from ground truth, as a localization with a laser would, but exactly.

    roslaunch youbot_base_sim youbot_driver.launch
    rosrun youbot_base_sim map_from_ground_truth.py
"""

from math import atan2, cos, sin

import rospy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

latest = {}


def publish(message, topic):
    if rospy.is_shutdown():
        return
    latest[topic] = message
    if len(latest) < 2 or latest["odom"].header.stamp != latest["ground_truth"].header.stamp:
        return
    (x, y, yaw), (odom_x, odom_y, odom_yaw) = (pose(latest[name]) for name in ("ground_truth", "odom"))
    turn = yaw - odom_yaw
    transform = TransformStamped(child_frame_id="odom")
    transform.header.stamp, transform.header.frame_id = message.header.stamp, "map"
    transform.transform.translation.x = x - odom_x * cos(turn) + odom_y * sin(turn)
    transform.transform.translation.y = y - odom_x * sin(turn) - odom_y * cos(turn)
    transform.transform.rotation.z, transform.transform.rotation.w = sin(turn / 2), cos(turn / 2)
    publisher.publish([transform])


def pose(message):
    position, orientation = message.pose.pose.position, message.pose.pose.orientation
    return position.x, position.y, 2 * atan2(orientation.z, orientation.w)


rospy.init_node("map_from_ground_truth")
publisher = rospy.Publisher("/tf", TFMessage, queue_size=100)
for name in ("odom", "ground_truth"):
    rospy.Subscriber(name, Odometry, publish, name)
rospy.spin()
