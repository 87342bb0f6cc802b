"""The error of odometry against the truth, over time, path length and rotation."""
import math

import numpy as np

from ..figures import RED, curve
from ..records import POSE, Missing
from .path import draw_track
from .section import Section, each, number, rms, summed

PIECE, PIECE_ANGLE = 1.0, math.pi / 2  # m and rad: pieces over which the error is measured afresh


def analyse(record):
    odom, truth = (record.need(name, *POSE[:3]) for name in ("odom", "ground_truth"))
    aligned = Aligned(odom, truth)
    section = Section("odometry", "Odometry against ground truth, aligned in position and heading at t = "
                                  f"{number(aligned.t[0], '.3f')} s")
    length, rotation = aligned.length[-1], aligned.rotation[-1]
    section.say("path length and rotation", f"{length:.3f} m, {math.degrees(rotation):.1f} deg",
                path_length=(length, "m"), rotation=(rotation, "rad"))
    section.say("at the end", f"{aligned.distance[-1]:.4f} m, {number(math.degrees(aligned.heading[-1]), '.3f')} "
                f"deg (t = {aligned.t[-1]:.3f} s)", final_error=(aligned.distance[-1], "m"),
                final_heading_error=(aligned.heading[-1], "rad"))
    farthest, heading = aligned.distance.max(), np.abs(aligned.heading)
    section.say("at most", f"{farthest:.4f} m (t = {aligned.t[np.argmax(aligned.distance)]:.3f} s), "
                f"{np.degrees(heading.max()):.3f} deg (t = {aligned.t[np.argmax(heading)]:.3f} s)",
                maximal_error=(farthest, "m"), maximal_heading_error=(heading.max(), "rad"))
    add_per_length(section, aligned)
    add_per_revolution(section, aligned)
    section.tables["odometry.csv"] = (
        ["t_s", "true_x_m", "true_y_m", "true_psi_rad", "odom_x_m", "odom_y_m", "odom_psi_rad", "path_length_m",
         "error_m", "heading_error_rad"],
        np.column_stack([aligned.t, *aligned.truth, *aligned.odom, aligned.length, aligned.distance, aligned.heading]))
    section.draw = lambda figure: draw(figure, aligned)
    return section


class Aligned:
    """Truth and odometry at the odometry's instants, in the frame of the truth."""

    def __init__(self, odom, truth):
        true = [truth.at(odom.t, name) for name in POSE[:3]]
        both = np.isfinite(true[0])
        if np.sum(both) < 2:
            raise Missing("odom and ground_truth do not overlap in time")
        self.t = odom.t[both]
        self.truth = [column[both] for column in true]
        x, y, psi = (odom[name][both] for name in POSE[:3])
        X, Y, Psi = self.truth
        turn = Psi[0] - psi[0]
        dx, dy = x - x[0], y - y[0]
        self.odom = [X[0] + math.cos(turn) * dx - math.sin(turn) * dy, Y[0] + math.sin(turn) * dx + math.cos(turn) * dy,
                     psi + turn]
        self.distance = np.hypot(self.odom[0] - X, self.odom[1] - Y)
        self.heading = self.odom[2] - Psi
        self.length = summed(np.hypot(np.diff(X), np.diff(Y)))
        self.rotation = summed(np.abs(np.diff(Psi)))

    def pieces(self, along, length):
        """First and last samples of pieces of this length of `along`; ten start on each length."""
        begins = each(along, length / 10)
        ends = np.searchsorted(along, along[begins] + length)
        inside = ends < len(along)
        return begins[inside], ends[inside]

    def piece_errors(self, begins, ends):
        """Distance and heading between the two motions over pieces, each aligned at its own start."""
        def steps(x, y, psi):
            dx, dy = x[ends] - x[begins], y[ends] - y[begins]
            c, s = np.cos(psi[begins]), np.sin(psi[begins])
            return c * dx + s * dy, -s * dx + c * dy, psi[ends] - psi[begins]
        (x0, y0, psi0), (x1, y1, psi1) = steps(*self.truth), steps(*self.odom)
        return np.hypot(x1 - x0, y1 - y0), psi1 - psi0


def add_per_length(section, aligned):
    length = aligned.length[-1]
    if length < 0.1 * PIECE:
        section.say("error per metre of path", f"the base moved less than {0.1 * PIECE:g} m")
        return
    final = aligned.distance[-1] / length
    section.say("error per metre of path", f"{1e3 * final:.1f} mm: that at the end over the whole path length",
                final_error_per_metre=(final, "m/m"))
    begins, ends = aligned.pieces(aligned.length, PIECE)
    if len(begins):
        errors, _ = aligned.piece_errors(begins, ends)
        errors = errors * PIECE / (aligned.length[ends] - aligned.length[begins])
        section.say("", f"{1e3 * rms(errors):.1f} mm rms, {1e3 * errors.max():.1f} mm at most: over pieces of "
                    f"{PIECE:g} m, each aligned at its own start", error_per_metre_rms=(rms(errors), "m/m"),
                    error_per_metre_maximal=(errors.max(), "m/m"))


def add_per_revolution(section, aligned):
    rotation, full = aligned.rotation[-1], 2 * math.pi
    begins, ends = aligned.pieces(aligned.rotation, PIECE_ANGLE)
    if not len(begins):
        section.say("error per revolution", f"the base rotated by less than {math.degrees(PIECE_ANGLE):g} deg")
        return
    final = aligned.heading[-1] / rotation * full
    section.say("error per revolution", f"{math.degrees(final):.2f} deg: that at the end over all rotation, to and fro",
                heading_error_per_turn=(final, "rad/turn"))
    _, errors = aligned.piece_errors(begins, ends)
    errors = errors * full / (aligned.rotation[ends] - aligned.rotation[begins])
    largest = np.abs(errors).max()
    section.say("", f"{math.degrees(rms(errors)):.2f} deg rms, {math.degrees(largest):.2f} deg at most: over pieces of "
                f"{math.degrees(PIECE_ANGLE):g} deg", heading_error_per_turn_rms=(rms(errors), "rad/turn"),
                heading_error_per_turn_maximal=(largest, "rad/turn"))


def draw(figure, aligned):
    grid = figure.add_gridspec(2, 2)
    path, error = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1])
    heading = figure.add_subplot(grid[1, 1], sharex=error)
    draw_track(path, ("ground truth", *aligned.truth[:2]), ("odometry", *aligned.odom[:2]))
    for axes, values, title, unit in ((error, aligned.distance, "distance of the odometry from the truth", "m"),
                                      (heading, np.degrees(aligned.heading),
                                       "heading of the odometry minus the true one", "deg")):
        curve(axes, aligned.t, values, color=RED)
        axes.set_title(title, fontsize="medium")
        axes.set_ylabel(unit)
    heading.set_xlabel("t, s")
