"""Okabe and Ito's colours, which the colour-blind can distinguish, and those of the wheels."""
from .base import WHEELS

BLACK, BLUE, RED, GREEN, PINK, SKY, ORANGE, GREY = (
    "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#777777")
WHEEL_COLOURS = dict(zip(WHEELS, (BLUE, RED, GREEN, PINK)))
