#!/usr/bin/python3
"""Odometry of four Mecanum wheels from their positions in joint_states, on `wheel_odometry` and /tf. A start for one of
your own: `roslaunch youbot_base_sim check_odometry.launch` finds errors in it.

    examples/wheel_odometry.py joint_states:=base/joint_states
"""

import math

import rospy
from geometry_msgs.msg import Quaternion, TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from tf2_ros import TransformBroadcaster

JOINTS = [f"wheel_joint_{wheel}" for wheel in ("fl", "fr", "bl", "br")]
RADIUS = 0.05         # m
HALF_LENGTHS = 0.385  # m, half the wheelbase and half the track


class WheelOdometry:
    """Pose and twist of the middle of the wheels, from where they stood at the first message."""

    def __init__(self):
        self.t, self.phi = None, None
        self.x = self.y = self.psi = 0.0

    def motion(self, turned):
        """What the wheels (rad) roll: forward, to the left (m), counter-clockwise (rad)."""
        fl, fr, bl, br = (RADIUS / 4 * angle for angle in turned)
        return fl + fr + bl + br, -fl + fr + bl - br, (-fl + fr - bl + br) / HALF_LENGTHS

    def update(self, message):
        """The odometry after this message of joint states; None for the first, and for those without wheels."""
        if not set(JOINTS) <= set(message.name):
            return None
        phi = [message.position[message.name.index(joint)] for joint in JOINTS]
        t = message.header.stamp
        before, self.t, last, self.phi = self.t, t, self.phi, phi
        if before is None or t <= before:  # time was set back
            return None
        forward, left, yaw = self.motion([b - a for a, b in zip(last, phi)])
        middle = self.psi + yaw / 2
        self.x += math.cos(middle) * forward - math.sin(middle) * left
        self.y += math.sin(middle) * forward + math.cos(middle) * left
        self.psi += yaw
        dt = (t - before).to_sec()
        return self.message(t, (forward / dt, left / dt, yaw / dt))

    def message(self, t, twist):
        odometry = Odometry(child_frame_id="base_footprint")
        odometry.header.stamp, odometry.header.frame_id = t, "wheel_odom"
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = self.x, self.y
        odometry.pose.pose.orientation = Quaternion(z=math.sin(self.psi / 2), w=math.cos(self.psi / 2))
        velocity = odometry.twist.twist  # in the child frame
        velocity.linear.x, velocity.linear.y, velocity.angular.z = twist
        return odometry


def main():
    rospy.init_node("wheel_odometry")
    odometry, broadcaster = WheelOdometry(), TransformBroadcaster()
    publisher = rospy.Publisher("wheel_odometry", Odometry, queue_size=10)
    publish_tf = rospy.get_param("~publish_tf", False)  # the driver publishes odom -> base_footprint

    def take(joints):
        message = odometry.update(joints)
        if message is None:
            return
        publisher.publish(message)
        if publish_tf:
            transform = TransformStamped(header=message.header, child_frame_id=message.child_frame_id)
            transform.transform.translation = message.pose.pose.position
            transform.transform.rotation = message.pose.pose.orientation
            broadcaster.sendTransform(transform)

    rospy.Subscriber("joint_states", JointState, take, queue_size=100)
    rospy.spin()


if __name__ == "__main__":
    main()
