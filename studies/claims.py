"""The paper's claims about its numerical results, each with what is measured: the table of docs/paper/claims.md."""
import itertools
from collections import namedtuple

import numpy as np

from youbot_base_sim.base import Base
from .builds import ROOT
from .pages import Finding, WrittenPart
from .runs import DEGREES, MODELS, Motion, Scene, Study, mean

RADIUS, PERIOD = 2.5, 30.0  # of the circle of both cases: m, s
SPEED, YAW_RATE = RADIUS * 2 * np.pi / PERIOD, 2 * np.pi / PERIOD
MU_1, MU_2, NU = 0.11, 5.78e-3, 1e-3  # (5.1), SI
H, L, R, R_D = Base.half_wheelbase, Base.half_track, Base.wheel_radius, Base.roller_axis_radius
PAGE = WrittenPart(ROOT / "docs" / "paper" / "claims.md", "scripts/study paper_figures")
COLUMNS = "no.", "section", "the paper says", "measured", "same", "why"


class Cases:
    """The paper's cases, each with the motions that claims need."""

    def __init__(self):
        self.case1, self.as_printed, self.case2 = (
            Study(Scene(ROOT / "config" / "scenes" / f"{name}.yaml"))
            for name in ("case1_counter_clockwise", "case1_as_printed", "case2"))


Claim = namedtuple("Claim", "section says why measure")  # measure: a function of Cases, returns a Finding
CLAIMS = []


def claim(section, says, why, *arguments):
    """Adds a claim that the function measures; `arguments` are the function's own after the cases."""
    def add(measure):
        CLAIMS.append(Claim(section, says, why, lambda cases: measure(cases, *arguments)))
        return measure
    return add


def yes(*conditions):
    return "yes" if all(conditions) else "no"


def row(number, finding):
    """A row of the table, for the claim of this number, from 1."""
    one = CLAIMS[number - 1]
    return [str(number), one.section, one.says, finding.measured(), finding.same, one.why]


def part(run, start=0, end=np.inf):
    """Rows from t = start to end, s."""
    t = run.truth["t"]
    shown = (t >= start) & (t <= end * (1 + 1e-9))
    return {key: values[shown] for key, values in run.truth.items()}


def parts(study, start=0, end=np.inf):
    """Of models 1, 2a and 2b."""
    return [part(study.whole[model], start, end) for model in MODELS]


def average(rows, key):
    return mean(rows["t"], rows[key])


def compared(text, values):
    """Text and values of a finding on models 1, 2a and 2b; `text` prints one value. Changes are in per cent."""
    change = f"{text} ({{:+.1f}} %)"
    return f"model 1 {text}, 2a {change}, 2b {change}", [
        values[0], *itertools.chain(*((one, 100 * (one / values[0] - 1)) for one in values[1:]))]


def vibrations(rows):
    """Root mean square of what is faster than half a second: of V_Y (mm/s), Omega (mrad/s), the first wheel (rad/s)."""
    width = int(round(0.5 / (rows["t"][1] - rows["t"][0])))
    signals = np.array([1e3 * rows["V_Y"], 1e3 * rows["Omega"], rows["dphi"][:, 0]])
    slow = np.array([np.convolve(signal, np.ones(width) / width, mode="valid") for signal in signals])
    return np.sqrt(np.mean((signals[:, width // 2:][:, :slow.shape[1]] - slow) ** 2, axis=1))


@claim("abstract", "Roller switches and displaced contact points offset the mean angular velocities of the wheels",
       "The base is slower under the same torques (row 21).")
def offset_of_wheels(cases):
    means = np.array([mean(rows["t"], rows["dphi"].T) for rows in parts(cases.case2, 1)])
    four = "{:.2f}, {:.2f}, {:.2f} and {:.2f} rad/s"
    return Finding(yes(np.all(np.abs(means[1:]) < np.abs(means[0]))),
                   f"Case 2 from 1 s, wheels 1 to 4: model 1 {four}; 2a {four}; 2b {four}", list(means.ravel()))


def damping(is_real=True, R_d=R_D, rollers=6):
    """M_X, M_Y and M_Omega for each unit of a constant velocity, by the bearings: in model 1 or, on average over a
    roller, where it turns faster beside its middle."""
    angle = np.linspace(-1, 1, 10001) * (np.pi / rollers if is_real else 0)
    wheels, axles = 4 * MU_1 / R ** 2, 8 * MU_2 * np.mean((R * np.cos(angle) - R_d) ** -2)
    return np.array([R * wheels, R * (wheels + axles), wheels * (L + H) ** 2 + axles * H ** 2])


def by_rollers(study, R_d, counts):
    """Case 2, 2b, with these numbers of rollers per wheel: by how much the mean V_Y is below model 1's, %; the same by
    the bearings alone; vibration of V_Y, mm/s."""
    scene = study.scene.sampled(10, 2000)
    runs = [Motion(scene.changed(robot=dict(rollers_per_wheel=count, roller_axis_radius=R_d))) for count in counts]
    return np.array([(100 * (1 - average(rows, "V_Y") / SPEED),
                      100 * (1 - damping(False, R_d)[1] / damping(True, R_d, count)[1]), vibrations(rows)[0])
                     for rows, count in zip((part(run, 1) for run in runs), counts)]).T


@claim("1", "The rollers' large size and small number affect the dynamics significantly",
       "The fewer the rollers, the thinner and faster their ends. Fig. 11 shows more.")
def number_of_rollers(cases):
    lost, _, vibration = by_rollers(cases.case2, R_D, (6, 12, 24))
    return Finding(yes(lost[0] > 2 * lost[1] > 4 * lost[2], vibration[0] > 2 * vibration[1]),
                   "Case 2, 2b, 6, 12 and 24 rollers per wheel: mean V_Y {:.1f}, {:.1f} and {:.1f} % below model 1's, "
                   "vibration {:.2f}, {:.2f} and {:.2f} mm/s", [*lost, *vibration])


@claim("4.2", "Displaced contact points (Delta_Y != 0) change the normal reactions (4.17)",
       "Single reactions change much, the motion little.")
def reactions(cases):
    moving = cases.case2.scene.sampled(PERIOD, 1000).changed(robot=dict(normal_reactions="dynamic"))
    resting = moving.changed(duration=0.1, drive=dict(reference_motion=None, torque=[dict(start=0, constant=[0] * 4)]),
                             initial=dict(twist=[0] * 3, wheel_angles=[-0.52, 0.52, 0.52, -0.52]))
    moved, rested = Motion(moving), Motion(resting)
    static, displaced = cases.case2.contact["coulomb"].contacts["normal"][0], rested.contacts["normal"][0]
    rows, plain = part(moved), part(cases.case2.whole["coulomb"])
    four = "{:.1f}, {:.1f}, {:.1f} and {:.1f} N"
    return Finding(yes(np.abs(displaced - static).min() > 1),
                   f"At rest, all contacts 20 mm to the left: {four}; by (4.17) {four}. Case 2, 2b: dynamic reactions "
                   "swing about (4.17) by {:.1f} N rms; the mean V_Y changes by {:+.2f} %, the end by {:.0f} mm",
                   [*displaced, *static, np.sqrt(np.mean((moved.contacts["normal"] - static) ** 2)),
                    100 * (average(rows, "V_Y") / average(plain, "V_Y") - 1),
                    1e3 * np.hypot(*(rows[key][-1] - plain[key][-1] for key in ("x", "y")))])


@claim("5.1", "Model 2a approximates a model without slip: if mu_0 increases, slip decreases",
       "Slip is inverse to mu_0. Its limit, real rollers without slip, is not model 1.")
def slip_of_viscous_friction(cases):
    scene = cases.case2.scene.sampled(10, 1000)
    runs = [Motion(scene.changed(floor=dict(viscous_friction=mu_0)), "viscous") for mu_0 in (4.4e3, 4.4e4, 4.4e5)]
    slips = [1e3 * np.mean(run.contacts["slip"][run.contacts["t"] >= 1]) for run in runs]
    return Finding(yes(slips[0] > 5 * slips[1] > 25 * slips[2]),
                   "Case 2, mu_0 = 4.4e3, 4.4e4, 4.4e5 N s/m: mean slip {:.2f}, {:.3f}, {:.4f} mm/s; mean V_Y {:.4f}, "
                   "{:.4f}, {:.4f} m/s (model 1: 0.5236)", [*slips, *(average(part(run, 1), "V_Y") for run in runs)])


@claim("5.2", "mu_0 = f m_s g / (4 nu) = 4.4e4 N s/m: near zero slip, 2a then has 2b's force at mean load",
       "Scenes without mu_0 use this formula.")
def viscous_coefficient(cases):
    viscous, coulomb = (cases.case2.contact[model].contacts for model in ("viscous", "coulomb"))
    ratio, slopes = 1e-3 * viscous["force"] / viscous["slip"], 1e-3 * 0.5 * coulomb["normal"][0] / NU
    return Finding(yes(np.ptp(ratio) < 1e-6, abs(ratio.mean() - 44) < 0.5, abs(slopes.mean() - ratio.mean()) < 1e-6),
                   "Force over slip speed: 2a {:.2f} kN s/m; 2b, near zero slip, {:.1f}, {:.1f}, {:.1f} and {:.1f} "
                   "kN s/m at wheels 1 to 4, on average {:.2f}", [ratio.mean(), *slopes, slopes.mean()])


def turned(truth):
    """Angle by which O went around the middle of its path, degrees, counter-clockwise positive."""
    x, y = (truth[key] - (truth[key].max() + truth[key].min()) / 2 for key in ("x", "y"))
    angle = np.unwrap(np.arctan2(y, x))
    return (angle[-1] - angle[0]) * DEGREES


@claim("5.3", "Case 1 goes counter-clockwise (Fig. 5): V_X = -rho w cos(w t - psi_0), V_Y = rho w sin(w t - psi_0)",
       "Formula and caption agree with sine and cosine exchanged; figures are drawn so.")
def direction(cases):
    printed, exchanged, other = (turned(study.whole["no_slip"].truth)
                                 for study in (cases.as_printed, cases.case1, cases.case2))
    return Finding(yes(printed > 0), "Model 1 goes around by {:.0f}°, clockwise; with sine and cosine exchanged by "
                   "{:+.0f}°; in Case 2 by {:+.0f}°, as its caption says", [printed, exchanged, other])


@claim("5.3", "In Case 1 the control torques change by sines of frequency w (Fig. 4)",
       "Model 1 is linear where Omega is 0.")
def sines(cases):
    wheels = cases.case1.whole["coulomb"].truth
    basis = np.array([np.sin(YAW_RATE * wheels["t"]), np.cos(YAW_RATE * wheels["t"])]).T
    factors = np.linalg.lstsq(basis, wheels["torque"], rcond=None)[0]
    rest = np.abs(wheels["torque"] - basis @ factors).max()
    return Finding(yes(rest < 1e-6), "Amplitudes {:.3f}, {:.3f}, {:.3f} and {:.3f} N m; the rest is {:.3f} N m",
                   [*np.hypot(*factors), rest])


@claim("5.3", "The rollers' design deforms Case 1's trajectory along the transverse axis Y (Fig. 5a)",
       "Y points along -x.")
def deformation(cases):
    sizes = [[np.ptp(rows["x"]), np.ptp(rows["y"])] for rows in parts(cases.case1)]
    (across_1, along_1), *others = sizes
    return Finding(yes(*(across < 0.9 * across_1 and abs(along - along_1) < 0.1 * along_1 for across, along in others)),
                   "Extent along Y and X, m: model 1 {:.2f}, {:.2f}; 2a {:.2f}, {:.2f}; 2b {:.2f}, {:.2f}",
                   list(np.ravel(sizes)))


@claim("5.3", "Angular movements occur in Case 1, unlike in model 1 (Fig. 5b)", "The paper gives no amplitude.")
def angular_movements(cases):
    largest = [np.abs(rows["psi"] * DEGREES - 90).max() for rows in parts(cases.case1)]
    return Finding(yes(largest[0] < 1e-6, min(largest[1:]) > 1),
                   "psi leaves 90° by at most {:.1f}° in model 1, {:.1f}° in 2a, {:.1f}° in 2b", largest)


@claim("5.3", "Roller switches make the platform and the wheels vibrate in Case 1 (Fig. 6)",
       "Row 20 shows that the frequency is that of the rollers.")
def vibration_case1(cases):
    ideal, *others = (vibrations(half) for half in parts(cases.case1, 0, PERIOD / 2))
    switches = sum(len(times) for times, _ in cases.case1.whole["coulomb"].switches)
    three = "{:.1f} mm/s, {:.1f} mrad/s and {:.2f} rad/s"
    return Finding(yes(ideal[0] < 1, np.all(np.array(others) > (1, 1, 0.1))),
                   f"Faster than 0.5 s, 0 to T/2, root mean square of V_Y, Omega and dphi_1: 2a {three}, 2b {three}; "
                   "V_Y of model 1 {:.1f} mm/s. {} switches in the 30 s of 2b", [*np.ravel(others), ideal[0], switches])


@claim("5.3", "The same, by the formula as printed", "Its V_Y changes sign at T/4, hence the magnitude.", "as_printed")
@claim("5.3", "In models 2a and 2b the mean V_Y is less than in model 1 (Fig. 6b, 0 to T/2)",
       "Off its middle a roller is thinner and turns faster, so its bearing takes more of the torque.", "case1")
def mean_V_Y(cases, case):
    means = [mean(half["t"], np.abs(half["V_Y"])) for half in parts(getattr(cases, case), 0, PERIOD / 2)]
    text, values = compared("{:.4f} m/s", means)
    return Finding(yes(max(means[1:]) < means[0]), "Mean of abs(V_Y): " + text, values)


HALF_PITCH = "16 combinations: each wheel at 0.1 rad or 30° further", Study.half_pitch_angles


@claim("5.3", "The same, by the formula as printed", "As row 13.", "as_printed", *HALF_PITCH)
@claim("5.3", "The same, other angles", "As row 13.", "case1",
       "64 combinations: the first wheel at 0.1 rad, each other one 0, 15, 30 or 45° further",
       lambda study: np.array([(0, *rest) for rest in itertools.product((0, 15, 30, 45), repeat=3)]) / DEGREES + 0.1)
@claim("5.3", "The same, other angles", "Motions with equal wheel angles differ less than those with different ones.",
       "case1", "12 combinations: all wheels alike, from 0° to 55° by 5°",
       lambda study: np.tile(np.arange(0, 60, 5) / DEGREES, (4, 1)).T)
@claim("5.3", "At t = T, O's coordinates spread by about 0.6 m and psi by about 15° over \"various combinations\" "
       "of initial wheel angles (Fig. 7, 2b)",
       "The paper names no set; more combinations spread wider. This one comes nearest.", "case1", *HALF_PITCH)
def spread(cases, case, angles, angles_of):
    study = getattr(cases, case)
    ends = np.array([[rows[key][-1] for key in ("x", "y", "psi")] for rows in study.spread(angles_of(study))])
    x, y, psi = np.ptp(ends, axis=0) * (1, 1, DEGREES)
    agrees = 0.5 < max(x, y) < 0.7 and 12 < psi < 18
    return Finding("yes" if agrees else "in part", angles + ": x by {:.2f} m, y by {:.2f} m, psi by {:.1f}°",
                   [x, y, psi])


@claim("5.4", "In Case 2 the control torques of model 1 are constant", "So are the velocities.")
def constant_torques(cases):
    torque = cases.case2.whole["coulomb"].truth["torque"]
    return Finding(yes(np.ptp(torque, axis=0).max() < 1e-9),
                   "{:.3f}, {:.3f}, {:.3f} and {:.3f} N m on wheels 1 to 4 from beginning to end", list(torque[0]))


def radius(rows):
    """Of the circle nearest to the path of O, m."""
    x, y = rows["x"], rows["y"]
    a, b, c = np.linalg.lstsq(np.array([x, y, np.ones_like(x)]).T, x ** 2 + y ** 2, rcond=None)[0]
    return np.sqrt(c + (a ** 2 + b ** 2) / 4)


@claim("5.4", "The rollers' design makes the radius of Case 2's trajectory smaller (Fig. 8a)",
       "V_Y loses a larger share than Omega, and the radius is their ratio.")
def smaller_radius(cases):
    radii = [radius(rows) for rows in parts(cases.case2, 1)]
    text, values = compared("{:.3f} m", radii)
    return Finding(yes(max(radii[1:]) < radii[0]), "Circle fitted from 1 s on: " + text, values)


@claim("5.4", "... and the speed at which it is traversed (Fig. 8)", "As row 21.")
def lower_speed(cases):
    motions = parts(cases.case2)
    speeds = [mean(rows["t"], np.hypot(rows["V_X"], rows["V_Y"])) for rows in motions]
    text, values = compared("{:.4f} m/s", speeds)
    return Finding(yes(max(speeds[1:]) < speeds[0]),
                   f"Mean speed of O: {text}; after 30 s psi is {{:.1f}}°, {{:.1f}}°, {{:.1f}}°",
                   [*values, *(rows["psi"][-1] * DEGREES for rows in motions)])


def peak(t, values):
    """Frequency of the highest peak of the spectrum above 2 Hz, Hz."""
    values = (values - values.mean()) * np.hanning(len(values))
    frequency = np.fft.rfftfreq(4 * len(values), t[1] - t[0])
    spectrum = np.abs(np.fft.rfft(values, 4 * len(values))) * (frequency > 2)
    return frequency[spectrum.argmax()]


@claim("5.4", "Roller switches make the platform and the wheels vibrate in Case 2 (Fig. 9)",
       "Each frequency is that at which one wheel's rollers pass the floor.")
def vibration_case2(cases):
    run = cases.case2.whole["coulomb"]
    rows, ideal = part(run, 1), vibrations(part(cases.case2.whole["no_slip"]))
    passing = [(np.sum(times >= 1) - 1) / np.ptp(times[times >= 1]) for times, _ in run.switches]
    peaks = [peak(rows["t"], values) for values in (rows["V_Y"], rows["Omega"], rows["dphi"][:, 0])]
    off = [min(abs(one - other) for other in passing) for one in peaks]
    return Finding(yes(max(ideal) < 1e-6, max(off) < 0.1),
                   "2b (rms): V_Y {:.1f} Hz, {:.1f} mm/s; Omega {:.1f} Hz, {:.1f} mrad/s; dphi_1 {:.1f} Hz, "
                   "{:.2f} rad/s. Wheels 1 to 4 pass {:.1f}, {:.1f}, {:.1f} and {:.1f} rollers/s. Model 1: {:.1f} mm/s",
                   [*itertools.chain(*zip(peaks, vibrations(rows))), *passing, ideal[0]])


@claim("5.4", "In models 2a and 2b the mean V_Y and Omega are less than in model 1 (Fig. 9)",
       "As row 11: across the axle, a roller's radius is R cos(phi~) - R_d. This is nearly all of the loss.")
def mean_velocities_case2(cases):
    means = [[average(rows, key) for rows in parts(cases.case2, 1)] for key in ("V_Y", "Omega")]
    (V_Y, V_Y_values), (Omega, Omega_values) = map(compared, ("{:.4f} m/s", "{:.4f} rad/s"), means)
    return Finding(yes(*(max(others) < ideal for ideal, *others in means)),
                   f"From 1 s on V_Y: {V_Y}. Omega: {Omega}. By the bearings alone: {{:+.1f}} % and {{:+.1f}} %",
                   [*V_Y_values, *Omega_values, *(100 * (damping(False) / damping() - 1))[1:]])


@claim("5.4", "The first wheel's rollers switch at phi_1 = -pi/6, -pi/2, -5 pi/6, ...", "Six rollers.")
def switch_angles(cases):
    angles = cases.case2.contact["coulomb"].switches[0][1][:4] / np.pi * 6
    return Finding(yes(np.allclose(angles, [-1, -3, -5, -7], atol=1e-9)),
                   "{:.6f}, {:.6f}, {:.6f}, {:.6f} times pi/6", list(angles))


def first_switch(cases, model):
    """The contacts about the first wheel's first switch, a row each 10 us, and the index of the row that follows it."""
    time = cases.case2.contact[model].switches[0][0][0]
    end = time + 0.01
    contacts = Motion(cases.case2.scene.sampled(end, end * 1e5), model).contacts
    return contacts, np.searchsorted(contacts["t"], time)


@claim("5.4", "When a roller takes over, the viscous friction force (2a) increases sharply (Fig. 10a)",
       "The contact point jumps along the axle, so that Omega makes it slip; the wheel follows within 0.2 ms.")
def viscous_jump(cases):
    contacts, after = first_switch(cases, "viscous")
    before, jumped, late = (contacts["force"][after + rows, 0] for rows in (-1, 0, 100))
    return Finding(yes(jumped > 1.5 * before),
                   "First switch: {:.0f} N before, {:.0f} N within 10 us, {:.0f} N 1 ms later", [before, jumped, late])


@claim("5.4", "... and the Coulomb friction force (2b) saturates (Fig. 10a)",
       "It saturates some ms before: the bearing of a roller's thin, fast end takes more than friction can give.")
def coulomb_saturation(cases):
    run = cases.case2.contact["coulomb"]
    contacts, times = run.contacts, run.switches[0][0]
    near_switch = np.any([np.abs(contacts["t"] - time) <= 0.005 for time in times], axis=0)
    shares = contacts["force"][:, 0] / contacts["limit"][:, 0]
    share, free = shares[near_switch], contacts["t"][shares <= 0.99] - times[0]
    return Finding(yes(share.min() > 0.99),
                   "At least {:.1f} % of f N = {:.1f} N within 5 ms of each switch; above 99 % from {:.0f} ms before "
                   "the first to {:.0f} ms after it",
                   [100 * share.min(), 0.5 * contacts["normal"][0, 0], -1e3 * free[free < 0].max(),
                    1e3 * free[free > 0].min()])


@claim("5.4", "... and the slip speed increases sharply (Fig. 10b, c)",
       "In 2a it jumps at the switch; in 2b it rises before, with the saturation.")
def slip_jump(cases):
    values = []
    for model in ("viscous", "coulomb"):
        contacts, after = first_switch(cases, model)
        values += [1e3 * contacts["slip"][after + rows, 0] for rows in (-2000, -1, 0)]
    return Finding(yes(*(after > max(before, 2 * rest) for rest, before, after in (values[:3], values[3:]))),
                   "First switch, 20 ms before, just before, just after, mm/s: 2a {:.2f}, {:.2f}, {:.2f}; 2b {:.1f}, "
                   "{:.1f}, {:.1f}", values)


@claim("5.4", "After the change the slip speed decreases to a value comparable to nu = 1 mm/s (Fig. 10b, c)",
       "At slip of about nu, friction is near its limit, more than rolling needs.")
def slip_decay(cases):
    values = []
    for model in ("viscous", "coulomb"):
        run = cases.case2.contact[model]
        t, slip, times = run.contacts["t"], run.contacts["slip"][:, 0], run.switches[0][0]
        values.append(1e3 * np.mean([slip[(t > a) & (t < b)].min() for a, b in zip(times, times[1:])]))
    values.append(1e3 * (t[(t > times[0]) & (slip < 2 * NU)][0] - times[0]))
    return Finding(yes(*(0.3 < value < 3 for value in values[:2])),
                   "Between switches it falls to {:.2f} mm/s in 2a and {:.2f} mm/s in 2b, on average; in 2b below 2 nu "
                   "{:.0f} ms after the first switch", values)


@claim("6", "The wandering contact point makes the control of yaw rate and lateral velocity less efficient",
       "What counts is that the contact point wanders to where the roller is thinner (row 21).")
def efficiency(cases):
    ideal, _, rows = parts(cases.case2, 1)
    shares = [100 * average(rows, key) / average(ideal, key) for key in ("V_Y", "Omega")]
    return Finding(yes(max(shares) < 100), "Case 2, same torques: 2b reaches {:.1f} % of model 1's V_Y and {:.1f} % of "
                   "its Omega", shares)


def drive_power_of_reference(cases, model):
    """Mean drive power (W) if constant torques keep Case 2's mean velocities, and the largest difference to these
    (m/s, rad/s). Torques are corrected by the bearings' damping."""
    target = np.array([0, SPEED, YAW_RATE])
    signs = np.array([[1, 1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]])
    weights = np.array([1, 1, R / (L + H)])[:, None] * signs / 4  # (5.2): the wheels' shares in the modes' torques
    modes = cases.case2.whole["coulomb"].truth["torque"][0] @ np.linalg.pinv(weights)
    for _ in range(12):
        scene = cases.case2.scene.sampled(10, 1000).changed(initial=dict(twist=target), drive=dict(
            reference_motion=None, torque=[dict(start=0, constant=modes @ weights)]))
        run = Motion(scene, model)
        rows = part(run, 1)
        lacking = target - [average(rows, key) for key in ("V_X", "V_Y", "Omega")]
        if np.abs(lacking).max() < 1e-5:
            break
        modes = modes + damping(model != "no_slip") * lacking
    power = run.contacts["drive_power"][run.contacts["t"] >= 1]
    return np.mean(power), np.abs(lacking).max()


@claim("6", "... and so the exact implementation of the reference motion consumes more energy",
       "By the constant torques that give Case 2's mean velocities.")
def energy(cases):
    powers, differences = zip(*(drive_power_of_reference(cases, model) for model in MODELS))
    text, values = compared("{:.1f} W", powers)
    return Finding(yes(max(differences) < 1e-4, min(powers[1:]) > powers[0]), "Mean drive power, 1 to 10 s: " + text,
                   values)


@claim("6", "The models can describe an experiment's deformed trajectories, and motions that depend on the initial "
       "wheel angles",
       "The effects are there, but the paper has no numbers of the experiment. [Validation](../validation.md) "
       "compares with real youBots.")
def described(cases):
    width = [np.ptp(rows["x"]) for rows in parts(cases.case1)]
    ends = [rows["psi"][-1] * DEGREES for rows in cases.case1.spread(cases.case1.half_pitch_angles())]
    return Finding("in part" if width[0] - width[2] > 0.1 and np.ptp(ends) > 1 else "no",
                   "2b: Case 1 is {:.2f} m narrower than model 1's; its final heading is {:.1f}° to {:.1f}°, by the "
                   "initial angles", [width[0] - width[2], min(ends), max(ends)])
