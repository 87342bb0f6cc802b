"""Columns of values over time."""
import math
from dataclasses import dataclass

import numpy as np

POSE = ("x", "y", "psi", "V_X", "V_Y", "Omega")  # columns


class Missing(Exception):
    """One line on what an analysis needs and the bag lacks."""


class Unusable(list):
    """Numbers of a field that cannot be used, and why."""

    def __init__(self, reason, count):
        super().__init__([math.nan] * count)
        self.reason = reason


@dataclass
class Series:
    """Times, s, and columns of values, (n,) or, of the wheels, (n, 4). NaN is what is not known."""
    t: np.ndarray
    columns: dict

    def __getitem__(self, name):
        return self.columns[name]

    def __len__(self):
        return len(self.t)

    def known(self, *names):
        """The rows in which these columns are known; none if a column is not there."""
        rows = np.full(len(self), set(names) <= set(self.columns))
        for name in names if rows.any() else ():
            rows &= np.isfinite(self.columns[name]).reshape(len(self), -1).all(axis=1)
        return Series(self.t[rows], {name: values[rows] for name, values in self.columns.items()})

    @property
    def period(self):
        """The usual time from one sample to the next, s."""
        return float(np.median(np.diff(self.t))) if len(self) > 1 else math.inf

    def at(self, t, name):
        """Values at times t, linear in between; NaN before, after and within gaps."""
        values = self.columns[name]
        wide = values.reshape(len(self), -1)
        result = np.stack([np.interp(t, self.t, column, left=np.nan, right=np.nan) for column in wide.T], axis=-1)
        if len(self) > 1:
            after = np.clip(np.searchsorted(self.t, t), 1, len(self) - 1)
            in_gap = (self.t[after] - self.t[after - 1] > self.max_step) & ~np.isin(t, self.t)
            result[in_gap] = np.nan
        return result.reshape(np.shape(t) + values.shape[1:])

    def means(self, t, name):
        """Means of a column between neighbouring times of t; NaN where `at` has one."""
        steps = np.diff(self.t).reshape(-1, *[1] * (self[name].ndim - 1))
        area = np.cumsum(np.concatenate([0 * self[name][:1], middles(self[name]) * steps]), axis=0)
        return (np.diff(Series(self.t, {name: area}).at(t, name), axis=0).T / np.diff(t)).T

    @property
    def max_step(self):
        """A longer step than this is a gap in the record, s."""
        return 5 * self.period + 1e-9

    def stretches(self):
        """Slices without gaps, of two samples at least."""
        breaks = np.flatnonzero(np.diff(self.t) > self.max_step) + 1
        return [slice(a, b) for a, b in zip([0, *breaks], [*breaks, len(self)]) if b - a > 1]


def middles(column):
    """Between neighbouring samples."""
    return (column[1:] + column[:-1]) / 2


def differentiated(series):
    """V_X, V_Y and Omega, means over the steps, which are arcs."""
    step, psi, turn = np.diff(series.t), middles(series["psi"]), np.diff(series["psi"])
    chord = step * np.sinc(turn / math.tau)
    dx, dy = np.diff(series["x"]) / chord, np.diff(series["y"]) / chord
    return {"V_X": np.cos(psi) * dx + np.sin(psi) * dy, "V_Y": -np.sin(psi) * dx + np.cos(psi) * dy,
            "Omega": turn / step}
