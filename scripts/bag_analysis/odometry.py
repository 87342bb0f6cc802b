"""How far the odometry is off the truth, over time, way and turning."""
import math

import numpy as np

from .record import Missing
from .section import Section, each, rms, thinned

POSE = ("x", "y", "psi")
PIECE, PIECE_TURN = 1.0, math.pi / 2  # m and rad: pieces over which the error is measured afresh
JUMP = 10.0  # m/s, faster than any base: the odometry was set anew


def analyse(record):
    odom, truth = record.need("odom", *POSE), record.need("ground_truth", *POSE)
    aligned = Aligned(odom, truth)
    section = Section("odometry", "Odometry against ground truth, laid over it in position and heading at t = %.3f s" %
                      aligned.t[0])
    way, turned = aligned.way[-1], aligned.turned[-1]
    section.say("way and turning", "%.3f m, %.1f deg" % (way, math.degrees(turned)))
    section.number("way", way, "m")
    section.number("turning", turned, "rad")
    add_error(section, "at the end", "final", aligned, -1)
    worst = int(np.argmax(aligned.distance))
    section.say("at most", "%.4f m (t = %.3f s), %.3f deg (t = %.3f s)" % (
        aligned.distance[worst], aligned.t[worst], np.degrees(np.abs(aligned.heading).max()),
        aligned.t[np.argmax(np.abs(aligned.heading))]))
    section.number("maximal_error", aligned.distance[worst], "m")
    section.number("maximal_heading_error", np.abs(aligned.heading).max(), "rad")
    add_per_way(section, aligned)
    add_per_turn(section, aligned)
    jumps = np.flatnonzero(np.hypot(np.diff(odom["x"]), np.diff(odom["y"])) > JUMP * np.diff(odom.t) + 0.01)
    if len(jumps):
        section.say("odometry jumps", "%d times, first at t = %.3f s (was it set to zero?): that counts as error" % (
            len(jumps), odom.t[jumps[0] + 1]))
    section.tables["odometry.csv"] = (
        ["t_s", "true_x_m", "true_y_m", "true_psi_rad", "odom_x_m", "odom_y_m", "odom_psi_rad", "way_m", "error_m",
         "heading_error_rad"],
        np.column_stack([aligned.t, *aligned.truth, *aligned.odom, aligned.way, aligned.distance, aligned.heading]))
    section.draw = lambda figure: draw(figure, aligned)
    return section


class Aligned:
    """Truth and odometry at the odometry's instants, in the frame of the truth."""

    def __init__(self, odom, truth):
        true = [truth.at(odom.t, name) for name in ("x", "y", "psi")]
        both = np.isfinite(true[0])
        if np.sum(both) < 2:
            raise Missing("odom and ground_truth are never there at the same time")
        self.t = odom.t[both]
        self.truth = [column[both] for column in true]
        x, y, psi = [odom[name][both] for name in ("x", "y", "psi")]
        X, Y, Psi = self.truth
        turn = Psi[0] - psi[0]
        dx, dy = x - x[0], y - y[0]
        self.odom = [X[0] + math.cos(turn) * dx - math.sin(turn) * dy, Y[0] + math.sin(turn) * dx + math.cos(turn) * dy,
                     psi + turn]
        self.distance = np.hypot(self.odom[0] - X, self.odom[1] - Y)
        self.heading = self.odom[2] - Psi
        self.way = np.concatenate([[0], np.cumsum(np.hypot(np.diff(X), np.diff(Y)))])
        self.turned = np.concatenate([[0], np.cumsum(np.abs(np.diff(Psi)))])

    def pieces(self, along, length):
        """First and last samples of pieces of this length of `along`, ten beginning on each length."""
        begins = each(along, length / 10)
        ends = np.searchsorted(along, along[begins] + length)
        inside = ends < len(along)
        return begins[inside], ends[inside]

    def piece_errors(self, begins, ends):
        """Distance and heading between the two motions over pieces, each seen from its own beginning."""
        steps = []
        for x, y, psi in (self.truth, self.odom):
            dx, dy = x[ends] - x[begins], y[ends] - y[begins]
            c, s = np.cos(psi[begins]), np.sin(psi[begins])
            steps.append((c * dx + s * dy, -s * dx + c * dy, psi[ends] - psi[begins]))
        (x0, y0, psi0), (x1, y1, psi1) = steps
        return np.hypot(x1 - x0, y1 - y0), psi1 - psi0


def add_error(section, what, name, aligned, at):
    section.say(what, "%.4f m, %.3f deg (t = %.3f s)" % (
        aligned.distance[at], math.degrees(aligned.heading[at]), aligned.t[at]))
    section.number(name + "_error", aligned.distance[at], "m")
    section.number(name + "_heading_error", aligned.heading[at], "rad")


def add_per_way(section, aligned):
    way = aligned.way[-1]
    if way < 0.1 * PIECE:
        section.say("per metre of way", "the base did not go %g m" % (0.1 * PIECE))
        return
    section.number("final_error_per_metre", aligned.distance[-1] / way, "m/m")
    text = "%.1f mm: that of the end over the whole way" % (1e3 * aligned.distance[-1] / way)
    begins, ends = aligned.pieces(aligned.way, PIECE)
    section.say("per metre of way", text)
    if len(begins):
        errors, _ = aligned.piece_errors(begins, ends)
        errors = errors * PIECE / (aligned.way[ends] - aligned.way[begins])
        section.say("", "%.1f mm rms, %.1f mm at most: over pieces of %g m, each laid over at its own beginning" % (
            1e3 * rms(errors), 1e3 * errors.max(), PIECE))
        section.number("error_per_metre_rms", rms(errors), "m/m")
        section.number("error_per_metre_maximal", errors.max(), "m/m")


def add_per_turn(section, aligned):
    turned, full = aligned.turned[-1], 2 * math.pi
    begins, ends = aligned.pieces(aligned.turned, PIECE_TURN)
    if not len(begins):
        section.say("per turn", "the base turned by less than %g deg" % math.degrees(PIECE_TURN))
        return
    section.number("heading_error_per_turn", aligned.heading[-1] / turned * full, "rad/turn")
    section.say("per turn", "%.2f deg: that of the end over all turning, to and fro" %
                math.degrees(aligned.heading[-1] / turned * full))
    _, errors = aligned.piece_errors(begins, ends)
    errors = errors * full / (aligned.turned[ends] - aligned.turned[begins])
    section.say("", "%.2f deg rms, %.2f deg at most: over pieces of %g deg" % (
        math.degrees(rms(errors)), math.degrees(np.abs(errors).max()), math.degrees(PIECE_TURN)))
    section.number("heading_error_per_turn_rms", rms(errors), "rad/turn")
    section.number("heading_error_per_turn_maximal", np.abs(errors).max(), "rad/turn")


def draw(figure, aligned):
    grid = figure.add_gridspec(2, 2)
    path, error = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1])
    heading = figure.add_subplot(grid[1, 1], sharex=error)
    i = thinned(len(aligned.t))
    path.plot(aligned.truth[0][i], aligned.truth[1][i], color="black", label="ground truth")
    path.plot(aligned.odom[0][i], aligned.odom[1][i], "--", color="#D55E00", label="odometry")
    path.plot(*[column[0] for column in aligned.truth[:2]], "o", color="black", label="start")
    path.set_aspect("equal", adjustable="datalim")
    path.set_xlabel("x, m")
    path.set_ylabel("y, m")
    path.legend()
    error.plot(aligned.t[i], aligned.distance[i], color="#D55E00")
    error.set_title("odometry's distance from the truth", fontsize="medium")
    error.set_ylabel("m")
    heading.plot(aligned.t[i], np.degrees(aligned.heading[i]), color="#D55E00")
    heading.set_title("odometry's heading minus the true one", fontsize="medium")
    heading.set_ylabel("deg")
    heading.set_xlabel("t, s")
