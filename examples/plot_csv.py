#!/usr/bin/python3
"""Draws paths and wheels of one or more CSV files of `simulate`, without ROS: examples/plot_csv.py motion.csv motion.png"""
import itertools
import sys

import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot

if len(sys.argv) < 3:
    sys.exit(__doc__)
*files, picture = sys.argv[1:]
figure, (path, wheels) = pyplot.subplots(1, 2, figsize=(10, 4))
for file, style in zip(files, itertools.cycle(("-", "--", ":", "-."))):
    with open(file, "rb") as lines:
        first = next(lines, b"")
    if first.startswith(b"#ROSBAG"):
        sys.exit(f"{file} is a bag: see plot_bag.py")
    comments = first.startswith(b"#")  # of --csv-comment
    motion = numpy.genfromtxt(file, delimiter=",", names=True, skip_header=int(comments))
    path.plot(motion["x"], motion["y"], style, marker="o", markevery=[0], label=file)
    for color, wheel in enumerate(("fl", "fr", "bl", "br")):
        wheels.plot(motion["t"], motion["dphi_" + wheel], style, color=f"C{color}",
                    label=wheel if file == files[0] else None)
path.set(title="path, from the dot on", xlabel="x, m", ylabel="y, m", aspect="equal")
wheels.set(title="wheels", xlabel="t, s", ylabel="angular velocity, rad/s")
for axis in (path, wheels):
    axis.legend()
figure.savefig(picture)
