"""Models of wheel odometry, their fits to runs with ground truth, and what they are worth on other runs."""
import numpy as np

from youbot_base_sim.analysis.section import rms
from youbot_base_sim.figures import BLUE, GREEN, ORANGE, RED, new_figure, save
from .odometry_records import BASE, Records
from .pages import table

STEP = 1e-4           # by which parameters are changed for derivatives, all of them of order 0.01 to 1
ITERATIONS, DRAWS = 12, 1000
# Where fits begin. `radius` and `track` are factors of R and h + l, `front_left` is that wheel's larger radius,
# `yaw_of_X` and `yaw_of_Y` are yaw per distance, rad/m, `yaw_lost` is the share of yaw lost in purely lateral motion;
# `friction` of the rollers over f N is in cm.
START = {"radius": 1, "track": 1, "lateral": 0.96, "front_left": 0, "yaw_of_X": 0, "yaw_of_Y": 0,
         "yaw_lost": 0.01}
EXTRAS = {"3": (), "4": ("front_left",), "5": ("yaw_of_X", "yaw_of_Y")}


def least_squares(off, values):
    """The values, by Gauss and Newton's method from these on, for which off(values), one row of numbers, is least."""
    for _ in range(ITERATIONS if len(values) else 0):
        here = off(values)
        slopes = np.array([(off(values + step) - here) / STEP for step in STEP * np.eye(len(values))])
        change = np.linalg.lstsq(slopes.T, here, rcond=None)[0]
        while np.abs(change).max() >= 1e-6 and rms(off(values - change)) > rms(here):
            change = change / 2
        values = values - change
        if np.abs(change).max() < 1e-6:
            break
    return values


class Model:
    """Motion by ideal kinematics with a lateral factor or, with `gains`, by those of a simulation with dry rollers."""

    def __init__(self, name, extras=(), gains=None, free=True):
        self.name, self.gains = name, gains
        self.names = ("radius", "track", "friction" if gains else "lateral", *extras) if free else ()

    def motion(self, records, values):
        """What each sample moves the base, (n, 3), m, m, rad."""
        p = {**dict.fromkeys(START, 0), "radius": 1, "track": 1, "lateral": 1, **dict(zip(self.names, values))}
        nominal = records.nominal(p["front_left"])
        moved = self.gains.motion(nominal, p["friction"] / 100) if self.gains else nominal
        moved = moved * [p["radius"], p["radius"] * p["lateral"], p["radius"] / p["track"]]
        share = np.abs(nominal * [1, 1, BASE.half_lengths])
        moved[:, 2] *= 1 - p["yaw_lost"] * share[:, 1] / (share.sum(axis=1) + 1e-12)
        moved[:, 2] += moved[:, :2] @ [p["yaw_of_X"], p["yaw_of_Y"]]
        return moved

    def fit(self, records):
        """Values by least squares, to the segments of these records."""
        start = {**START, "friction": 100 * np.median(self.gains.frictions)} if self.gains else START
        def off(values):
            return (records.segments(records.integrate(self.motion(records, values))) - records.true_segments).ravel()
        return least_squares(off, np.array([start[name] for name in self.names], float))


def splits_of(runs):
    """What is trained on and what is tested on, by name."""
    for k, day in enumerate(sorted({run.day for run in runs}), 1):
        groups = sorted({(run.figure, run.group) for run in runs if run.day == day})
        halves = [[run for run in runs if (run.figure, run.group) in groups[half::2]] for half in (0, 1)]
        yield f"within day {k}", *map(Records, halves)
    for key in ("day", "figure"):
        kinds = sorted({getattr(run, key) for run in runs})
        for k, kind in enumerate(kinds):
            halves = [[run for run in runs if (getattr(run, key) == kind) == mine] for mine in (True, False)]
            yield f"day {k + 1} to {2 - k}" if key == "day" else f"{kind} to {kinds[1 - k]}", *map(Records, halves)


position, heading = (lambda errors: np.hypot(errors[:, 0], errors[:, 1])), (lambda errors: np.abs(errors[:, 2]))


class Comparison:
    """Every model fitted to each half and tested on the other: `errors` of a split's name and a model's."""

    def __init__(self, runs, gains):
        kinematics = {count: Model(f"kinematics, {count}", extras) for count, extras in EXTRAS.items()}
        located = {count: Model(f"slip, {count}", extras, gains["located"]) for count, extras in (
            *EXTRAS.items(), ("4 and angle", ("front_left", "lateral")))}  # 1 / tan(angle)
        lost = Model("kinematics, 5 and yaw lost", (*EXTRAS["5"], "yaw_lost"))
        averaged = Model("averaged contacts, 5", EXTRAS["5"], gains["averaged"])
        self.pairs = [*((located[count], kinematics[count]) for count in EXTRAS), (located["4"], kinematics["5"]),
                      (located["5"], lost), (located["4 and angle"], kinematics["5"]), (averaged, kinematics["5"])]
        self.models = [Model("nominal", free=False), *kinematics.values(), lost, *located.values(), averaged]
        self.errors, self.values, self.tests = {}, {}, {}
        for name, training, test in splits_of(runs):
            self.tests[name] = test
            for model in self.models:
                values = self.values[name, model.name] = model.fit(training)
                self.errors[name, model.name] = test.end_errors(model.motion(test, values))

    def ratio(self, split, better, worse, size):
        """Root mean square error of a model over that of another, and its 95 % interval over draws of the runs."""
        pair = np.array([size(self.errors[split, model.name]) for model in (better, worse)])
        draws = np.random.default_rng(0).integers(0, pair.shape[1], (DRAWS, pair.shape[1]))
        drawn = np.sqrt(np.mean(pair[:, draws]**2, axis=2))
        return rms(pair[0]) / rms(pair[1]), *np.quantile(drawn[0] / drawn[1], (0.025, 0.975))

    def ratio_table(self):
        cell = "{:.2f} ({:.2f} to {:.2f})".format
        rows = [[better.name, worse.name, what,
                 *(cell(*self.ratio(split, better, worse, size)) for split in self.tests)]
                for better, worse in self.pairs for what, size in (("position", position), ("heading", heading))]
        return table(["error of", "over that of", "at the end", *self.tests], rows)

    def error_table(self):
        rows = [[model.name, *(
            f"{1e3 * rms(position(errors) / test.path):.1f}, {1e3 * rms(heading(errors) / test.turns):.1f}"
            for errors, test in ((self.errors[split, model.name], test) for split, test in self.tests.items()))]
            for model in self.models]
        return table(["mm per metre, mrad per turn", *self.tests], rows)

    def parameter_table(self):
        rows = [[model.name, ", ".join(model.names),
                 *(", ".join(f"{value:.4f}" for value in self.values[split, model.name]) for split in self.tests)]
                for model in self.models[1:]]
        return table(["model", "parameters", *self.tests], rows)

    def draw(self, path):
        axes = new_figure(figsize=(9, 3.6)).subplots(1, 2, sharey=True)
        for axis, what, size, target in zip(axes, ("position", "heading"), (position, heading), (0.7, 0.5)):
            for k, ((better, worse), colour) in enumerate(zip(self.pairs, (BLUE, GREEN, RED, "black", ORANGE, "grey"))):
                ratio, low, high = np.array([self.ratio(split, better, worse, size) for split in self.tests]).T
                axis.errorbar(np.arange(len(ratio)) + 0.13 * (k - 2.5), ratio, (ratio - low, high - ratio), fmt="o",
                              color=colour, capsize=2, markersize=4, label=f"{better.name}, over {worse.name}")
            axis.axhline(1, color="black", linewidth=0.8)
            axis.axhline(target, color="black", linewidth=0.8, linestyle=":")
            axis.set(xticks=range(len(self.tests)), ylim=(0, 1.3), title=f"{what} at the end of held-out runs")
            axis.set_xticklabels([name.replace(" to ", "\nto ").replace("n d", "n\nd") for name in self.tests], fontsize=8)
            axis.grid(alpha=0.3, axis="y")
        axes[0].set_ylabel("ratio of errors")
        axes[0].figure.legend(*axes[0].get_legend_handles_labels(), loc="lower center", ncol=3, fontsize=7)
        axes[0].figure.tight_layout(rect=(0, 0.11, 1, 1))
        save(axes[0].figure, path, dpi=120)
