"""One part of the analysis: what it prints, writes and draws."""
from dataclasses import dataclass, field

import numpy as np

from ..base import WHEELS


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

    def say(self, what, text, **numbers):
        """A line; `numbers`: name=(value, unit)."""
        self.lines.append((what, text))
        self.numbers += [(name, float(value), unit) for name, (value, unit) in numbers.items()]

    def wheels(self, what, values, form, name, unit):
        """A line with a value for each wheel."""
        values = list(values)
        self.say(what, "".join(number(value, f">10{form}") for value in values),
                 **{f"{name}_{wheel}": (value, unit) for wheel, value in zip(WHEELS, values)})

    def wheel_header(self):
        self.say("", "".join(f"{wheel:>10}" for wheel in WHEELS))


def number(value, form):
    """The value as text; what rounds to zero has no sign."""
    text = f"{value:{form}}"
    return text if float(text) else f"{abs(value):{form}}"


def rms(values, axis=0):
    return np.sqrt(np.mean(np.square(values), axis=axis))


def summed(steps):
    """The sum of the steps at each sample, from 0."""
    return np.concatenate([np.zeros_like(steps[:1]), np.cumsum(steps, axis=0)])


def each(along, length):
    """Index of the first sample on each such length of a rising quantity."""
    return np.flatnonzero(np.diff(np.floor((along - along[0]) / length), prepend=-1) > 0)
