"""The rate of roller switches, and the jumps of slip at them."""
import numpy as np

from ..base import WHEELS
from ..figures import WHEEL_COLOURS, WHEEL_NAMES
from .section import Section

SLOWEST = 2e-3  # s: friction ends a jump of slip within milliseconds


def analyse(record):
    switches = record.need("roller_switches")
    spans = [series.t for name, series in record.series.items() if name in ("ground_truth", "joint_states", "odom")]
    spans.append(switches.t)
    duration = max(t[-1] for t in spans) - min(t[0] for t in spans)
    section = Section("switches", "Roller switches")
    of_wheel = [switches["wheel"] == k for k in range(4)]
    count = np.array([switches["count"][mask].sum() for mask in of_wheel])
    section.say("all wheels", f"{count.sum():.0f} in {duration:.3f} s", switches=(count.sum(), "1"))
    section.wheel_header()
    for what, sense in (("forward", 1), ("backward", -1)):
        section.wheels(what, [switches["count"][mask & (sense * switches["direction"] > 0)].sum() for mask in of_wheel],
                       ".0f", f"switches_{what}", "1")
    if duration > 0:
        section.wheels("per second, mean", count / duration, ".2f", "switch_rate", "1/s")
    intervals = [intervals_of(switches, mask) for mask in of_wheel]
    for what, share in (("shortest", 0), ("median", 50), ("longest", 100)):
        values = [1e3 * np.percentile(gaps, share) if len(gaps) else np.nan for _, gaps in intervals]
        section.wheels(f"interval, {what}, ms", values, ".2f", f"interval_{what}", "ms")
    many = switches["count"] > 1
    if many.any():
        section.say("", f"{switches['count'][many].sum():.0f} of them in {many.sum()} messages with a count above 1: "
                    "left out of intervals and jumps")
    jumps = add_jumps(section, record, switches, intervals)
    section.tables["switches.csv"] = (
        ["t_s", "wheel", "direction", "count", "slip_jump_m_per_s"],
        [(float(t), WHEELS[wheel], int(direction), int(n), float(jump)) for t, wheel, direction, n, jump in zip(
            switches.t, switches["wheel"], switches["direction"], switches["count"], jumps)])
    section.draw = lambda figure: draw(figure, switches, of_wheel, intervals, jumps)
    return section


def intervals_of(switches, mask):
    """Times of a wheel's switches, s, and the intervals before them, s, where both messages are of one switch."""
    t, single = switches.t[mask], switches["count"][mask] == 1
    both = single[1:] & single[:-1]
    return t[1:][both], np.diff(t)[both]


def add_jumps(section, record, switches, intervals):
    """Change of the slip velocity of the wheel from the last sample before a switch to the first one after it."""
    jumps, what = np.full(len(switches), np.nan), "jump of slip, sampled"
    contacts = record.get("contacts", "slip")
    if not contacts:
        section.say(what, f"not computed: {record.lack('contacts', 'slip')} (see simulate --contacts, "
                    "~publish_contacts)")
        return jumps
    gaps = np.concatenate([gaps for _, gaps in intervals])
    longest = min(SLOWEST, np.median(gaps) / 5 if len(gaps) else np.inf)
    if contacts.period > 1.01 * longest:
        section.say(what, f"not computed: contacts every {1e3 * contacts.period:.3g} ms; must be every "
                    f"{1e3 * longest:.3g} ms or faster")
        return jumps
    after = np.searchsorted(contacts.t, switches.t)
    near = (after > 0) & (after < len(contacts)) & (switches["count"] == 1)
    after = np.clip(after, 1, len(contacts) - 1)
    near &= contacts.t[after] - contacts.t[after - 1] < contacts.max_step
    slip, wheel = contacts["slip"], switches["wheel"]
    jumps[near] = np.linalg.norm(slip[after, wheel] - slip[after - 1, wheel], axis=1)[near]
    known = 1e3 * jumps[np.isfinite(jumps)]
    if len(known):
        steps = np.linalg.norm(np.diff(slip, axis=0), axis=2)
        section.say(what, f"{np.median(known):.3f} mm/s median, {known.max():.3f} mm/s at most, between samples "
                    f"{1e3 * contacts.period:.3g} ms apart", jump_median=(np.median(known), "mm/s"),
                    jump_maximal=(known.max(), "mm/s"))
        section.say("", f"{1e3 * np.median(steps):.3f} mm/s median between any two samples")
    return jumps


def draw(figure, switches, of_wheel, intervals, jumps):
    from matplotlib.ticker import LogFormatter
    has_jumps = np.isfinite(jumps).any()
    rows = figure.subplots(2 if has_jumps else 1, 1, sharex=True, squeeze=False)[:, 0]
    for wheel, colour, marker, mask, (t, gaps) in zip(WHEEL_NAMES, WHEEL_COLOURS.values(), "os^x", of_wheel, intervals):
        style = dict(linestyle="", marker=marker, markersize=3, color=colour)
        rows[0].semilogy(t, 1e3 * gaps, label=wheel, **style)
        if has_jumps:
            rows[1].plot(switches.t[mask], 1e3 * jumps[mask], **style)
    rows[0].yaxis.set_major_formatter(LogFormatter())  # 140, not 1.4 x 10^2
    rows[0].yaxis.set_minor_formatter(LogFormatter())
    rows[0].set_ylabel("time since the wheel's last switch, ms")
    rows[0].legend(ncol=4)
    if has_jumps:
        rows[1].set_ylabel("jump of slip velocity, mm/s")
    rows[-1].set_xlabel("t, s")
