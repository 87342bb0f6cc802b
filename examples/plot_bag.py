#!/usr/bin/python3
"""Plots the angular velocities of the four wheels from a bag: examples/plot_bag.py case2.bag case2.png"""
import sys

import matplotlib
import rosbag

matplotlib.use("Agg")
from matplotlib import pyplot

if len(sys.argv) != 3:
    sys.exit(__doc__)
bag, picture = sys.argv[1:]
try:
    messages = [message for _, message, _ in rosbag.Bag(bag).read_messages(["/base/joint_states", "/joint_states"])
                if len(message.velocity) >= 4]
except (OSError, ValueError, rosbag.ROSBagException) as error:
    sys.exit(f"{bag}: {error}; must be a complete bag")
if not messages:
    sys.exit(f"{bag}: has no velocities of four wheels in /base/joint_states or /joint_states")
for i, name in enumerate(messages[0].name[:4]):
    pyplot.plot([m.header.stamp.to_sec() for m in messages], [m.velocity[i] for m in messages], label=name)
pyplot.xlabel("t, s")
pyplot.ylabel("angular velocity, rad/s")
pyplot.legend()
try:
    pyplot.savefig(picture)
except (OSError, ValueError) as error:
    sys.exit(f"{picture}: {error}")
