"""Order spectrum of the wheels' angular velocities: their ripple, in cycles per revolution of the wheel. n rollers pass
per revolution at any speed, so a changing speed does not smear the line, as it would in a spectrum over time."""
import math

import numpy as np

from ..base import WHEELS
from ..figures import WHEEL_COLOURS, WHEEL_NAMES
from ..records import Missing, middles
from .section import Section, each, summed

TURNS = (4, 2)        # of a piece, the fewer where no wheel turns that often one way: lines are 0.5 or 1 order wide
ORDER_STEP = 0.125
SEGMENTS = 64         # of a wheel, at most, spread evenly
SAMPLES = 4096        # of a segment, at most
SLOW = 0.05           # of the largest rate; slower, a wheel stands or turns back
BELOW_NYQUIST = 0.8   # share of the Nyquist frequency to which the rollers' frequency may rise


def analyse(record):
    joints, n = record.need("joint_states", "velocity"), record.base.rollers_per_wheel
    orders = np.arange(0.5, 3.5 * n + ORDER_STEP / 2, ORDER_STEP)
    phi = joints["position"] if np.isfinite(joints["position"]).all() else summed(
        np.diff(joints.t)[:, None] * middles(joints["velocity"]))
    fastest = BELOW_NYQUIST * math.pi / joints.period / n if len(joints) > 1 else 0  # rad/s
    for turns in TURNS:
        wheels = [Wheel(joints, phi[:, k], joints["velocity"][:, k], orders, fastest, turns) for k in range(4)]
        if any(wheel.segments for wheel in wheels):
            break
    else:
        raise Missing(f"no wheel makes {TURNS[-1]} revolutions in one direction below {fastest:.1f} rad/s; above, "
                      "joint_states are too slow to show rollers pass")
    section = Section("spectrum", "Ripple of the wheels' angular velocities over their angle: amplitude in rad/s")
    section.wheel_header()
    for what, value, form, name, unit in (
            (f"pieces of {turns} revolutions", lambda wheel: wheel.segments, ".0f", "pieces", "1"),
            (f"rollers pass: order {n}", lambda wheel: wheel.peak(n)[1], ".4f", "ripple_of_rollers", "rad/s"),
            ("  ratio to orders around", lambda wheel: wheel.stands_out(n), ".1f", "ripple_over_background", "1"),
            (f"twice that: order {2 * n}", lambda wheel: wheel.peak(2 * n)[1], ".4f", "double_ripple_of_rollers",
             "rad/s"),
            ("strongest order", lambda wheel: wheel.strongest(n)[0], ".2f", "strongest_order", "1"),
            ("  its amplitude", lambda wheel: wheel.strongest(n)[1], ".4f", "strongest_ripple", "rad/s"),
            ("rollers pass, Hz", lambda wheel: n * wheel.mean_rate / 2 / math.pi, ".2f", "passing_frequency", "Hz")):
        section.wheels(what, map(value, wheels), form, name, unit)
    if any(wheel.too_fast for wheel in wheels):
        section.say("", f"left out above {fastest:.1f} rad/s, where rollers pass faster than joint_states of "
                        f"{1 / joints.period:.3g} Hz can show")
    section.tables["spectrum.csv"] = (["order_per_turn"] + [f"ripple_{wheel}_rad_per_s" for wheel in WHEELS],
                                      np.column_stack([orders] + [wheel.amplitude for wheel in wheels]))
    section.draw = lambda figure: draw(figure, orders, wheels, n)
    return section


class Wheel:
    """Mean spectrum of one wheel over all segments: half overlapping, without their trend, under Hann's window."""

    def __init__(self, joints, phi, rate, orders, fastest, turns):
        self.orders = orders
        size = np.abs(rate)
        self.too_fast = bool((size > fastest).any())
        usable = (size > SLOW * size.max()) & (size <= fastest) if size.max() > 0 else np.zeros(len(size), bool)
        segments = list(self.find_segments(joints, phi, rate, usable, turns))
        chosen = np.unique(np.linspace(0, len(segments) - 1, min(len(segments), SEGMENTS)).astype(int))
        self.segments = len(chosen)
        power, shares = np.zeros((2, len(orders)))  # shares: number of segments whose samples resolve an order
        for segment in (segments[i] for i in chosen):
            seen = orders < math.pi / joints.period / size[segment].max()
            power[seen] += amplitudes(phi[segment], rate[segment], orders[seen]) ** 2
            shares += seen
        self.amplitude = np.where(shares > 0, np.sqrt(power / np.maximum(shares, 1)), np.nan)
        self.mean_rate = np.mean([size[segments[i]].mean() for i in chosen]) if self.segments else np.nan

    @staticmethod
    def find_segments(joints, phi, rate, usable, turns):
        sense = np.where(usable, np.sign(rate), 0)
        gap = np.diff(joints.t) > joints.max_step
        bounds = [0, *(np.flatnonzero((np.diff(sense) != 0) | gap) + 1), len(sense)]
        for a, b in zip(bounds, bounds[1:]):
            if sense[a] == 0:
                continue
            angle = np.maximum.accumulate(np.abs(phi[a:b] - phi[a]))
            for first in each(angle, turns * math.pi):
                last = np.searchsorted(angle, angle[first] + turns * 2 * math.pi)
                if last == len(angle):
                    break
                if last - first > 16:
                    stride = 1 + (last - first) // SAMPLES
                    yield slice(a + first, a + last + 1, stride)

    def peak(self, order, width=0.5):
        """Order and amplitude of the largest value around an order."""
        near = np.flatnonzero((np.abs(self.orders - order) <= width) & np.isfinite(self.amplitude))
        if not len(near):
            return math.nan, math.nan
        best = near[np.argmax(self.amplitude[near])]
        return self.orders[best], self.amplitude[best]

    def stands_out(self, order):
        around = (np.abs(self.orders - order) <= 2.5) & (np.abs(self.orders - order) > 1)
        return self.peak(order)[1] / max(np.nanmedian(self.amplitude[around]), 1e-12) if self.segments else math.nan

    def strongest(self, n):
        """From half the rollers' order on: below lie changes of the speed."""
        return self.peak(self.orders[-1], self.orders[-1] - n / 2)


def amplitudes(phi, rate, orders):
    """Amplitudes of cycles in a rate over an angle, by Fourier sums: samples lie evenly in time, not over the angle."""
    phi = np.abs(phi - phi[0])
    share = phi / phi[-1]
    window = np.sin(math.pi * share) ** 2 * np.maximum(np.gradient(phi), 0)  # noise turns an angle back
    basis = np.stack([np.ones_like(share), share - 0.5, (share - 0.5) ** 2], axis=1)
    root = np.sqrt(window)[:, None]
    trend = basis @ np.linalg.lstsq(basis * root, rate * root[:, 0], rcond=None)[0]
    ripple = (rate - trend) * window
    phase, step = np.exp(-1j * orders[0] * phi), np.exp(-1j * (orders[1] - orders[0]) * phi)
    sums = []
    for _ in orders:
        sums.append(abs(ripple @ phase))
        phase = phase * step
    return 2 * np.array(sums) / window.sum()


def draw(figure, orders, wheels, n):
    axes = figure.subplots()
    for times in range(1, 4):
        axes.axvline(times * n, color="grey", linestyle=":", linewidth=1, zorder=0)
        axes.annotate(f"rollers pass: {n}" if times == 1 else f"{times} x {n}", (times * n, 1),
                      xycoords=("data", "axes fraction"), xytext=(3, -12), textcoords="offset points", color="grey")
    for name, colour, style, wheel in zip(WHEEL_NAMES, WHEEL_COLOURS.values(), ("-", "--", "-.", ":"), wheels):
        axes.semilogy(orders, wheel.amplitude, color=colour, linestyle=style, label=name)
    axes.set(xlabel="order, cycles per revolution of the wheel", ylabel="amplitude of the ripple, rad/s")
    axes.legend(loc="lower left", ncol=4)
