"""Draws how the front right wheel stands on the floor, from the youBot's sizes: docs/images/wheel.png and .svg, or the
files given. Four views: from its side, from above, at a roller switch, and over one turn."""
from math import cos, degrees, pi, sin, tan

from youbot_base_sim.base import Base
from youbot_base_sim.command_line import Parser
from youbot_base_sim.figures import BLACK, BLUE, GREY, ORANGE, RED, SKY, new_figure, save
from .builds import ROOT

BASE, DELTA, PHI = Base(), pi / 4, 0.3  # rad; PHI is phi~ in the first two views
PITCH = 2 * pi / BASE.rollers_per_wheel
R, R_D, JUMP = (1000 * x for x in (BASE.wheel_radius, BASE.roller_axis_radius, BASE.jump_of_offset()))  # mm
SIDE, ABOVE = (0, 2), (0, 1)  # what a view shows of X, Y, Z
ARROW = {"arrowstyle": "-|>", "color": BLACK, "lw": 2, "shrinkA": 0, "shrinkB": 0}


def fill_roller(axis, view, phi, color=BLUE, alpha=0.45):
    """Fills a roller phi from straight down. It touches the cylinder of radius R at angles a from its middle."""
    import numpy as np
    a, turn = np.meshgrid(np.linspace(-PITCH / 2, PITCH / 2, 61), np.linspace(0, 2 * pi, 91))
    r = R - R_D / np.cos(a)
    along = R_D * np.tan(a) / cos(DELTA) + r * np.sin(a) * cos(DELTA)
    radius = r * np.sqrt(1 - (np.sin(a) * cos(DELTA)) ** 2)
    x = along * cos(DELTA) - radius * np.cos(turn) * sin(DELTA)
    y = along * sin(DELTA) + radius * np.cos(turn) * cos(DELTA)
    z = radius * np.sin(turn) - R_D
    points = np.stack([x * cos(phi) + z * sin(phi), y, z * cos(phi) - x * sin(phi)], -1).reshape(-1, 3)[:, view]
    directions = np.linspace(0, 2 * pi, 121)
    farthest = (points @ [np.cos(directions), np.sin(directions)]).argmax(0)
    axis.fill(*points[farthest].T, fc=color, alpha=alpha, ec=BLACK)


def dot(axis, at, text, shift, color=RED):
    axis.plot(*at, "o", color=color, zorder=5)
    axis.annotate(text, at, shift, textcoords="offset points", color=color, fontsize=13, weight="bold")


def draw_contact(side, above):
    from matplotlib.patches import Arc
    for k in range(1, BASE.rollers_per_wheel):
        fill_roller(side, SIDE, PHI + k * PITCH, "0.85", 1)
    K, P = (-R_D * sin(PHI), 0, -R_D * cos(PHI)), (0, R_D * tan(PHI) * tan(DELTA), -R)
    for axis, view, shift in ((side, SIDE, (4, -16)), (above, ABOVE, (-3, 8))):
        fill_roller(axis, view, PHI)
        dot(axis, [K[i] for i in view], "K", (-16, -8), BLACK)
        dot(axis, [P[i] for i in view], "P", shift)
    side.plot([K[0], 0, 0], [K[2], 0, -R], color=BLACK, lw=1)
    dot(side, (0, 0), "C", (6, 2), BLACK)
    side.add_patch(Arc((0, 0), 54, 54, theta1=-90 - degrees(PHI), theta2=-90, color=ORANGE, lw=3))
    above.add_patch(Arc(K[:2], 48, 48, theta1=0, theta2=45, color=ORANGE, lw=3))
    above.axline(K[:2], P[:2], ls="-.", color=BLACK, lw=1)
    above.plot([-44, 0], [P[1]] * 2, ":", color=RED)
    above.annotate("", (-40, 0), (-40, P[1]), arrowprops={**ARROW, "color": RED, "arrowstyle": "<|-|>"})
    for axis, x, y, text, color in (
            (side, 2, -20, "$R$", BLACK), (side, -14, -16, "$R_d$", BLACK), (side, -64, -48, "floor", BLACK),
            (side, -15, -27, r"$\tilde\varphi$", BLACK), (above, 17, 4, r"$\delta$ = 45°", ORANGE),
            (above, -54, 4, r"$\Delta_Y$", RED), (above, 38, 36, "roller's axis", BLACK)):
        axis.text(x, y, text, color=color, fontsize=15)


def draw_jumps(switch, turn):
    for phi, color, x, text in ((PITCH / 2, BLUE, -64, "leaves the floor"), (-PITCH / 2, SKY, 30, "takes over")):
        fill_roller(switch, ABOVE, phi, color)
        dot(switch, (0, JUMP * phi / PITCH), "P", (-14, 2) if phi > 0 else (7, -12))
        switch.text(x, 24 if phi > 0 else -32, f"this roller\n{text}", fontsize=12)
    switch.annotate("", (0, -JUMP / 2), (0, JUMP / 2), arrowprops={**ARROW, "color": RED})
    switch.text(3, 2, f"jump of {JUMP:.0f} mm", color=RED, fontsize=12)
    for k in range(BASE.rollers_per_wheel + 1):
        phis = [PITCH * i / 40 for i in range(-20, 21)]
        turn.plot([degrees(k * PITCH + phi) for phi in phis], [R_D * tan(phi) for phi in phis], color=BLUE, lw=2)
        turn.plot([degrees((k + 0.5) * PITCH)] * 2, [-JUMP / 2, JUMP / 2], "--", color=RED)


def main(argv=None):
    parser = Parser("draw_wheel", __doc__, "", "wheel.pdf")
    parser.add_argument("files", nargs="*", default=[ROOT / f"docs/images/wheel.{ending}" for ending in ("png", "svg")])
    files = parser.parse_args(argv).files
    side, above, switch, turn = new_figure(figsize=(11, 8.4), constrained_layout=True).subplots(2, 2).flat
    draw_contact(side, above)
    draw_jumps(switch, turn)
    for axis, line, title in ((side, -R, "1. From the right: the blue roller stands on the floor at P"),
                              (above, 0, r"2. From above: P lies $\Delta_Y$ beside the wheel's middle"),
                              (switch, 0, "3. A roller switch from above: P jumps")):
        axis.set(aspect="equal", xlim=(-66, 66), ylim=(-60, 56), title=title, xticks=[], yticks=[], frame_on=False)
        axis.axhline(line, color=GREY, zorder=0)
        axis.annotate("forward ", (62, -58), (16, -58), va="center", arrowprops=ARROW)
    turn.set(xlim=(0, 360), xticks=range(0, 361, 60), xlabel="angle of the wheel, degrees", ylabel=r"$\Delta_Y$, mm",
             title="4. Over one turn: P wanders, and jumps at each switch")
    for file in files:
        save(side.figure, file, dpi=90)
