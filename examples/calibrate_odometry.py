#!/usr/bin/python3
"""Calibrates the driver's odometry from a bag: fits the wheel radius that it should use forward, lateral and in yaw by
least squares of the true motion over the wheels' rotation. On a real base a motion capture replaces ground_truth.

    rosrun youbot_base_sim simulate examples/calibration_drive.yaml --bag drive.bag
    examples/calibrate_odometry.py drive.bag
"""

import math
import sys

import numpy
import rosbag

RADIUS, HALF_LENGTHS = 0.0475, 0.385  # the driver's, m
STEP = 0.1                            # s, over which motions are compared

# Base motion forward, lateral and in yaw, for each rad of the wheels fl, fr, bl and br.
KINEMATICS = RADIUS / 4 * numpy.array([[1, 1, 1, 1], [-1, 1, 1, -1], numpy.array([-1, 1, -1, 1]) / HALF_LENGTHS])


def read(path):
    """Wheel angles and poses (x, y, yaw) at the instants that have both."""
    wheels, poses = {}, {}
    with rosbag.Bag(path) as bag:
        for topic, message, _ in bag.read_messages(["/base/joint_states", "/joint_states", "/ground_truth"]):
            stamp = message.header.stamp  # not the arrival, which differs in bags of rosbag record
            if topic == "/ground_truth":
                pose = message.pose.pose
                poses[stamp] = pose.position.x, pose.position.y, 2 * math.atan2(pose.orientation.z, pose.orientation.w)
            elif len(message.position) >= 4:
                wheels[stamp] = message.position[:4]
    stamps, last = [], None
    for stamp in sorted(wheels.keys() & poses.keys()):
        if last is None or (stamp - last).to_sec() > STEP - 1e-6:
            stamps.append(last := stamp)
    return numpy.array([wheels[s] for s in stamps]), numpy.array([poses[s] for s in stamps])


def main(path):
    try:
        wheels, poses = read(path)
    except (OSError, ValueError, rosbag.ROSBagException) as error:
        sys.exit(f"{path}: {error}; must be a complete bag")
    if len(wheels) < 2:
        sys.exit(f"{path}: needs joint_states of the wheels and ground_truth with the same stamps")
    rolled = numpy.diff(wheels, axis=0) @ KINEMATICS.T
    yaw = numpy.unwrap(poses[:, 2])
    middle = (yaw[1:] + yaw[:-1]) / 2
    dx, dy = numpy.diff(poses[:, 0]), numpy.diff(poses[:, 1])
    went = numpy.column_stack([numpy.cos(middle) * dx + numpy.sin(middle) * dy,
                               numpy.cos(middle) * dy - numpy.sin(middle) * dx, numpy.diff(yaw)])
    for name, a, b in zip(["forward", "lateral", "yaw"], rolled.T, went.T):
        if a @ a < 1e-6:
            print(f"{name:9s} not driven")
            continue
        factor = a @ b / (a @ a)
        left = math.sqrt(numpy.mean((b - factor * a) ** 2) / numpy.mean(b ** 2))
        print(f"{name:9s} radius {RADIUS * factor:.5f} m, {100 * (factor - 1):+.1f} % of the driver's; "
              f"{100 * left:.1f} % of the motion is left unexplained")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
