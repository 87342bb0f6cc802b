"""The uses of the energy from the drive trains."""
import numpy as np

from ..figures import BLACK, GREEN, ORANGE, RED, SKY, thinned
from ..records import Missing, middles
from .section import Section, number, summed

GAINS = ("drive", "external")
LOSSES = ("bearing", "roller", "floor")
CLOSED = 1e-3  # share of the energy put in that may be left over


def analyse(record):
    powers, effort = ("contacts", "kinetic_energy", *GAINS, *LOSSES), ("joint_states", "effort", "velocity")
    contacts, joints = record.get(*powers), record.get(*effort)
    if contacts and contacts.stretches():
        return balance(contacts)
    why = "the samples of contacts are too far apart" if contacts else record.lack(*powers)
    if joints and joints.stretches():
        section = Section("energy", "Energy")
        put_in = sum(integral(joints.t[s], np.sum(joints["effort"] * joints["velocity"], axis=1)[s])[-1]
                     for s in joints.stretches())
        section.say("put in by the wheels", f"{put_in:.4g} J: effort times velocity of joint_states",
                    drive_energy=(put_in, "J"))
        section.say("lost and kept", f"not computed: {why} (see simulate --contacts, ~publish_contacts)")
        return section
    raise Missing(f"{why}; {'the samples of joint_states are too far apart' if joints else record.lack(*effort)}")


def integral(t, values):
    """From the beginning, by trapezoids."""
    return summed(np.diff(t) * middles(values))


def energies(contacts, stride=1):
    """Since the beginning, J, by name, from each sample or every second one; in gaps nothing is put in or lost."""
    parts = {name: [] for name in ("t", *GAINS, *LOSSES, "gained")}
    for stretch in contacts.stretches():
        chosen = np.unique([*range(stretch.start, stretch.stop, stride), stretch.stop - 1])
        t, kinetic = contacts.t[chosen], contacts["kinetic_energy"][chosen]
        parts["t"].append(t)
        for name in (*GAINS, *LOSSES, "gained"):
            column = kinetic - kinetic[0] if name == "gained" else integral(t, contacts[name][chosen])
            parts[name].append(column + (parts[name][-1][-1] if parts[name] else 0))
    sums = {name: np.concatenate(columns) for name, columns in parts.items()}
    sums["left"] = sum(sums[name] for name in GAINS) - sum(sums[name] for name in LOSSES) - sums["gained"]
    return sums


def balance(contacts):
    sums = energies(contacts)
    left, left_coarse = sums["left"], energies(contacts, 2)["left"]
    section = Section("energy", "Energy: the powers of contacts, integrated by trapezoids")
    turned_over = max(*(np.abs(sums[name]).max() for name in (*GAINS, "gained")), 1e-12)
    for what, name in (("put in by the motors", "drive"), ("put in by slope and wrenches", "external"),
                       ("lost in the drive trains", "bearing"), ("lost in the rollers", "roller"),
                       ("lost by slip on the floor", "floor"), ("kept as kinetic energy", "gained")):
        if name == "external" and not sums[name].any():
            continue
        share = "" if name == "drive" else f"  {number(100 * sums[name][-1] / turned_over, '5.1f')} %"
        section.say(what, f"{number(sums[name][-1], '10.4f')} J{share}", **{name + "_energy": (sums[name][-1], "J")})
    worst, worst_coarse = np.abs(left).max(), np.abs(left_coarse).max()
    share = np.abs(left[-1]) / turned_over
    verdict = "the balance closes" if share <= CLOSED else (
        "the samples are too far apart to close the balance" if abs(left_coarse[-1]) > 1.5 * abs(left[-1])
        else "THE BALANCE DOES NOT CLOSE: the powers lack something, such as rollers stopped by switches")
    section.say("residual", f"{number(left[-1], '10.4f')} J at the end, {worst:.4f} J at most: {100 * share:.2g} % of what was "
                "put in", residual=(left[-1], "J"), residual_maximal=(worst, "J"))
    section.say("", f"from samples every {1e3 * contacts.period:.3g} ms; {number(left_coarse[-1], '.4f')} J at the end from "
                f"every second one: {verdict}", residual_from_half_the_samples=(left_coarse[-1], "J"),
                residual_maximal_from_half_the_samples=(worst_coarse, "J"))
    gaps = len(contacts.stretches()) - 1
    if gaps:
        section.say("gaps", f"{gaps} in contacts: left out")
    section.tables["energy.csv"] = (
        ["t_s", "put_in_J", "from_outside_J", "bearings_J", "rollers_J", "floor_J", "kept_J", "residual_J"],
        np.column_stack([sums["t"], *[sums[name] for name in (*GAINS, *LOSSES)], sums["gained"], left]))
    section.draw = lambda figure: draw(figure, sums)
    return section


def draw(figure, sums):
    balance_axes, residual_axes = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [3, 1]})
    i = thinned(sums["gained"], sums["left"])
    t, below = sums["t"][i], 0
    for name, label, color, hatch in (
            ("gained", "kept as kinetic energy", SKY, "xx"), ("bearing", "lost in the drive trains", ORANGE, ".."),
            ("roller", "lost in rollers", GREEN, "//"), ("floor", "lost by slip on the floor", RED, "")):
        above = below + sums[name][i]
        balance_axes.fill_between(t, below, above, color=color, hatch=hatch, edgecolor="white", linewidth=0, label=label)
        below = above
    put_in = sum(sums[name][i] for name in GAINS)
    balance_axes.plot(t, put_in, color=BLACK, label="put in by the motors" + (
        ", slope and wrenches" if sums["external"].any() else ""))
    balance_axes.set_ylabel("energy, J")
    balance_axes.legend(loc="upper left")
    residual_axes.plot(t, sums["left"][i], color=BLACK)
    residual_axes.set(xlabel="t, s", ylabel="residual, J")
