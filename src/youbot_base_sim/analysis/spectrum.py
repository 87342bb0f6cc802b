"""Order spectrum of the wheels' angular velocities: their ripple, in cycles per revolution of the wheel. n rollers pass
per revolution at any speed, so a changing speed does not smear the line, as it would in a spectrum over time. Rollers
turn in lateral motion and yaw, hardly straight ahead; motors, gears and encoders cannot tell these apart."""
import math

import numpy as np

from ..base import WHEELS
from ..figures import WHEEL_COLOURS, WHEEL_NAMES
from ..records import Missing, middles
from .section import Section, each, summed

TURNS = 2             # of a piece: lines are 1 order wide
ORDER_STEP = 0.125
SEGMENTS = 64         # of a wheel, at most, spread evenly
SAMPLES = 4096        # of a segment, at most
SLOW = 0.05           # of the largest rate; slower, a wheel stands or turns back
BELOW_NYQUIST = 0.8   # share of the Nyquist frequency to which the rollers' frequency may rise
MOST_ROLLERS = 20
ALIKE = 0.1           # relative difference of the wheels' rates; in other motions, lines of other wheels are anywhere
FINEST = 1e-4         # ripple over rate, that records can show
STRONGER = 1.3        # times as strong, over the rate, as straight ahead lines of rollers are at least
MOST_PIECES = 12      # that count: noise is not as even as statistics have it
NONE = 3.0            # log of the prior odds that no line is the rollers' against any number of them
SURE = 20             # odds from which another number in the scene is said to be wrong


def analyse(record):
    joints, n = record.need("joint_states", "velocity"), record.base.rollers_per_wheel
    phi = joints["position"] if np.isfinite(joints["position"]).all() else summed(
        np.diff(joints.t)[:, None] * middles(joints["velocity"]))
    fastest = BELOW_NYQUIST * math.pi / joints.period / n if len(joints) > 1 else 0  # rad/s
    spectrum = Spectrum(joints, phi, n, fastest)
    if not any(spectrum.pieces):
        raise Missing(f"no wheel makes {TURNS} revolutions in one direction below {fastest:.1f} rad/s; above, "
                      "joint_states are too slow to show rollers pass")
    section = Section("spectrum", "Ripple of the wheels' angular velocities over their angle: amplitude in rad/s")
    section.wheel_header()
    single, double = (spectrum.peaks(spectrum.amplitude, order) for order in (n, 2 * n))
    for what, values, form, name, unit in (
            (f"pieces of {TURNS} revolutions", spectrum.pieces, ".0f", "pieces", "1"),
            (f"rollers pass: order {n}", single, ".4f", "ripple_of_rollers", "rad/s"),
            ("  ratio to orders around", single / np.maximum(spectrum.around(spectrum.amplitude, n), 1e-12), ".1f",
             "ripple_over_background", "1"),
            (f"twice that: order {2 * n}", double, ".4f", "double_ripple_of_rollers", "rad/s")):
        section.wheels(what, values, form, name, unit)
    say_rollers(section, n, *number_of_rollers(spectrum))
    if spectrum.too_fast:
        section.say("", f"left out above {fastest:.1f} rad/s, where rollers pass faster than joint_states of "
                        f"{1 / joints.period:.3g} Hz can show")
    section.tables["spectrum.csv"] = (["order_per_turn"] + [f"ripple_{wheel}_rad_per_s" for wheel in WHEELS],
                                      np.column_stack([spectrum.orders, *spectrum.amplitude]))
    section.draw = lambda figure: draw(figure, spectrum, n)
    return section


def say_rollers(section, n, rollers, odds):
    """`n`: as the scene has them."""
    by = "by lines that are stronger in lateral motion and yaw than ahead"
    if odds < 1:
        section.say("rollers of a wheel", f"not shown {by}")
        return
    section.say("rollers of a wheel", f"{rollers}, odds {odds:.3g} to 1, {by}", rollers=(rollers, "1"),
                odds_of_rollers=(odds, "1"))
    if rollers != n and odds > SURE:
        section.say("", f"NOT {n}, as --scene or its default has it: give robot.rollers_per_wheel")


class Spectrum:
    """Mean spectra over pieces of some turns: half overlapping, without their trend, under Hann's window. Of each
    wheel: `amplitude`, rad/s, (4, orders), and number of `pieces`. Of all, where they turn alike: `power` of ripple
    over rate, and `counts` of pieces, (2, orders): straight ahead, and in lateral motion and yaw."""

    def __init__(self, joints, phi, n, fastest):
        self.orders = np.arange(0.5, max(3.5 * n, 2 * MOST_ROLLERS + 3) + ORDER_STEP / 2, ORDER_STEP)
        self.amplitude, self.power, self.counts = (np.zeros((rows, len(self.orders))) for rows in (4, 2, 2))
        self.pieces = np.zeros(4)
        self.too_fast = bool((np.abs(joints["velocity"]) > fastest).any())
        for wheel in range(4):
            self.add(wheel, joints, phi[:, wheel], fastest)
        self.power /= np.maximum(self.counts, 1)

    def add(self, wheel, joints, phi, fastest):
        rate, power, counts = joints["velocity"][:, wheel], *np.zeros((2, len(self.orders)))
        size = np.abs(rate)
        usable = (size > SLOW * size.max()) & (size <= fastest)
        segments = list(find_segments(joints, phi, np.where(usable, np.sign(rate), 0)))
        chosen = np.unique(np.linspace(0, len(segments) - 1, min(len(segments), SEGMENTS)).astype(int))
        for segment in (segments[i] for i in chosen):
            all_rates, mean = joints["velocity"][segment].mean(axis=0), size[segment].mean()
            seen = self.orders < math.pi / joints.period / size[segment].max()
            squares = amplitudes(phi[segment], rate[segment], self.orders[seen]) ** 2
            power[seen] += squares
            counts += seen
            if np.ptp(np.abs(all_rates)) < ALIKE * mean:
                kind = int(np.ptp(np.sign(all_rates)) > 0)
                self.power[kind, seen] += squares / mean ** 2
                self.counts[kind] += seen
        self.pieces[wheel] = len(chosen)
        self.amplitude[wheel] = np.where(counts > 0, np.sqrt(power / np.maximum(counts, 1)), np.nan)

    def peaks(self, values, order, width=0.25):
        """The largest value of each row around an order."""
        return values[:, np.abs(self.orders - order) <= width].max(axis=1)

    def around(self, values, order):
        """The usual value of each row near an order, without its line."""
        distance = np.abs(self.orders - order)
        return np.median(values[:, (distance > 1) & (distance <= 3)], axis=1)


def find_segments(joints, phi, sense):
    """Slices in which a wheel turns one way, by `sense`, TURNS times, each with half of the one before."""
    gap = np.diff(joints.t) > joints.max_step
    bounds = [0, *(np.flatnonzero((np.diff(sense) != 0) | gap) + 1), len(sense)]
    for a, b in zip(bounds, bounds[1:]):
        if sense[a] == 0:
            continue
        angle = np.maximum.accumulate(np.abs(phi[a:b] - phi[a]))
        for first in each(angle, TURNS * math.pi):
            last = np.searchsorted(angle, angle[first] + TURNS * 2 * math.pi)
            if last == len(angle):
                break
            if last - first > 16:
                yield slice(a + first, a + last + 1, 1 + (last - first) // SAMPLES)


def number_of_rollers(spectrum):
    """The likeliest number of rollers, and its odds against all others and none, by lines at it and at its double."""
    ratios = {n: log_ratio(spectrum, n) for n in range(3, 2 * MOST_ROLLERS + 1)}
    ratios = {n: ratios[n] + ratios[2 * n] if ratios[n] > 1 else 0 for n in range(3, MOST_ROLLERS + 1)}
    best = max(ratios, key=ratios.get)
    others = [math.exp(ratio - ratios[best]) for n, ratio in ratios.items() if n != best and ratio > 0]
    return best, 1 / max(sum(others) + math.exp(NONE - ratios[best]), 1e-6)


def log_ratio(spectrum, order):
    """How much likelier the power at an order is in lateral motion and yaw if rollers may add to it than if it is what
    motors, gears and encoders make, up to STRONGER times the line ahead. Means of noise are gamma distributed."""
    counts = np.minimum(spectrum.counts[:, np.argmin(np.abs(spectrum.orders - order))] / 2, MOST_PIECES)
    if counts.min() < 1:
        return 0
    ahead, other = spectrum.peaks(spectrum.power, order, ORDER_STEP)
    noise, other_noise = spectrum.around(spectrum.power, order) + FINEST ** 2
    ratio = max(1, other / (other_noise + STRONGER ** 2 * max(ahead - noise, 0)))
    return counts.prod() / counts.sum() * (ratio - 1 - math.log(ratio))


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


def draw(figure, spectrum, n):
    axes = figure.subplots()
    for times in range(1, 4):
        axes.axvline(times * n, color="grey", linestyle=":", linewidth=1, zorder=0)
        axes.annotate(f"rollers pass: {n}" if times == 1 else f"{times} x {n}", (times * n, 1),
                      xycoords=("data", "axes fraction"), xytext=(3, -12), textcoords="offset points", color="grey")
    for name, colour, style, amplitude in zip(WHEEL_NAMES, WHEEL_COLOURS.values(), ("-", "--", "-.", ":"),
                                              spectrum.amplitude):
        axes.semilogy(spectrum.orders, amplitude, color=colour, linestyle=style, label=name)
    axes.set(xlabel="order, cycles per revolution of the wheel", ylabel="amplitude of the ripple, rms of pieces, rad/s")
    axes.legend(loc="lower left", ncol=4)
