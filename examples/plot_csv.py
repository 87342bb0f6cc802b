#!/usr/bin/env python3
"""Draws path and wheels of `simulate --csv`, without ROS: examples/plot_csv.py motion.csv motion.png"""
import sys

import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot

motion = numpy.genfromtxt(sys.argv[1], delimiter=",", names=True)
figure, (path, wheels) = pyplot.subplots(1, 2, figsize=(10, 4))
path.plot(motion["x"], motion["y"])
path.set(xlabel="x, m", ylabel="y, m", aspect="equal")
for wheel in ("fl", "fr", "bl", "br"):
    wheels.plot(motion["t"], motion["dphi_" + wheel], label=wheel)
wheels.set(xlabel="t, s", ylabel="angular velocity, rad/s")
wheels.legend()
figure.savefig(sys.argv[2])
