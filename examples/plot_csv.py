#!/usr/bin/python3
"""Draws paths and wheels of one or more CSV files of `simulate`, without ROS: examples/plot_csv.py motion.csv motion.png"""
import itertools
import sys

import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot

WHEELS = "fl", "fr", "bl", "br"


def read(file):
    """The columns of a CSV file of `simulate`."""
    try:
        with open(file, "rb") as lines:
            first = next(lines, b"")
            comments = first.startswith(b"#")  # of --csv-comment
            names = (next(lines, b"") if comments else first).decode(errors="replace").strip().split(",")
        if first.startswith(b"#ROSBAG"):
            sys.exit(f"{file} is a bag: see plot_bag.py")
        for name in ("t", "x", "y", *(f"dphi_{wheel}" for wheel in WHEELS)):
            if name not in names:
                sys.exit(f"{file}: has no column {name}; must be a CSV file of simulate")
        motion = numpy.atleast_1d(numpy.genfromtxt(file, delimiter=",", names=True, skip_header=int(comments)))
        if not motion.size or any(numpy.isnan(motion[name]).any() for name in motion.dtype.names):
            raise ValueError("must have rows of numbers")
        return motion
    except (OSError, ValueError) as error:
        sys.exit(f"{file}: {' '.join(str(error).split())}")


if len(sys.argv) < 3:
    sys.exit(__doc__)
*files, picture = sys.argv[1:]
figure, (path, wheels) = pyplot.subplots(1, 2, figsize=(10, 4))
for file, style in zip(files, itertools.cycle(("-", "--", ":", "-."))):
    motion = read(file)
    path.plot(motion["x"], motion["y"], style, marker="o", markevery=[0], label=file)
    for color, wheel in enumerate(WHEELS):
        wheels.plot(motion["t"], motion["dphi_" + wheel], style, color=f"C{color}",
                    label=wheel if file == files[0] else None)
path.set(title="path, from the dot on", xlabel="x, m", ylabel="y, m", aspect="equal", adjustable="datalim")
wheels.set(title="wheels", xlabel="t, s", ylabel="angular velocity, rad/s")
for axis in (path, wheels):
    axis.legend()
try:
    figure.savefig(picture)
except (OSError, ValueError) as error:
    sys.exit(f"{picture}: {error}")
