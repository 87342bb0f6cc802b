"""One part of the analysis: what it prints, writes and draws."""
from dataclasses import dataclass, field

import numpy as np

from .wheels import WHEELS

# Okabe and Ito's, told apart by the colour-blind
COLORS = dict(zip(WHEELS, ("#0072B2", "#D55E00", "#009E73", "#CC79A7")))


@dataclass
class Section:
    """name: also of its files. lines: (what, text) pairs. numbers: (name, value, unit) for a program to read. tables:
    {file name: (columns with units, rows)}. draw: puts its axes into a matplotlib figure, or None."""
    name: str
    title: str
    lines: list = field(default_factory=list)
    numbers: list = field(default_factory=list)
    tables: dict = field(default_factory=dict)
    draw: object = None

    def say(self, what, text):
        self.lines.append((what, text))

    def number(self, name, value, unit):
        self.numbers.append((name, float(value), unit))

    def wheels(self, what, values, form, name, unit):
        """A line with a value for each wheel."""
        self.say(what, "".join("%10s" % (form % value) for value in values))
        for wheel, value in zip(WHEELS, values):
            self.number("%s_%s" % (name, wheel), value, unit)

    def wheel_header(self, what=""):
        self.say(what, "".join("%10s" % wheel for wheel in WHEELS))


def rms(values, axis=0):
    return np.sqrt(np.mean(np.square(values), axis=axis))


def thinned(count, most=40000):
    """Indices of samples enough for a picture."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))


def each(along, length):
    """Index of the first sample of each such length of a rising quantity."""
    return np.flatnonzero(np.diff(np.floor((along - along[0]) / length), prepend=-1) > 0)
