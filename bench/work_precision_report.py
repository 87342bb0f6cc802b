"""The report of scripts/work_precision: its CSV, and tables in Markdown."""

import math
import time

from report import table
from work_precision_runs import CONTESTANTS, LONG_ENOUGH, LONG_RUN, USEFUL_ERROR

COLUMNS = ("scene,scene_title,contestant,contestant_title,setting_kind,setting,span_s,run_time_s,repeats,"
           "run_time_per_simulated_s,real_time_factor,position_error_m,heading_error_rad,velocity_error_m_s,"
           "yaw_rate_error_rad_s,wheel_rate_error_rad_s,roller_rate_error_rad_s,steps,rejected_steps,location_steps,"
           "evaluations,jacobians,factorizations,switches,failure").split(",")
COUNTS = COLUMNS[-8:-1]
BY_KEY = {contestant.key: contestant for contestant in CONTESTANTS}

INTRODUCTION = """# Work-precision diagrams

Written by `scripts/work_precision`. {machine}

![error against run time](work_precision.svg)

All contestants integrate the same equations with the same analytic Jacobian, those of `SlipSystem`, in one program, one
after the other, on one core. Run time is processor time of the integration alone, the least of 3 to 10 runs; runs
beyond 1 s are made once. Everything but SUNDIALS itself, which is the system's, is compiled with the flags above.
Errors are the largest over rows at 20 Hz. A contestant's sweep ends after its first run beyond {long_run:g} s, or
{long_enough:g} s if that is within {useful:g} m.

{contestants}
This package's method and odeint's run through Simulation, by the names of `solver: {{method: ...}}`. They share the
location of switches, integrate the work and the rollers' angles too (odeint's implicit methods solve systems of order
24 for that) and end steps on rows. SUNDIALS has its own root finding and dense output, and systems of order 18.

## The references and how far they can be trusted

"""
AT_USEFUL_ERROR = """
## At a largest position error of {useful:g} m

Run time, ratio to this package, simulated time over run time; interpolated on each contestant's curve. `<=`: its
coarsest setting is more accurate already. "never": not at any setting that it was run with.

"""
GROWTH = """
## How cost grows with the control rate and with the number of switches

Run time per simulated second, position error and number of switches, Case 1 counter-clockwise, each contestant at the
loosest tolerance at which it stays within 1e-5 m on that scene above. Torque: over 1 s; number of rollers: over 5 s,
with `roller_axis_radius` 0.034, which four rollers need.
"""
EXPLICIT = """
## Explicit methods

Rollers relax within 1e-7 s, so their steps cannot be longer however loose the tolerance. They run over a short span,
which their errors are of; compare the run time per simulated second.

"""


def seconds(t):
    return f"{1e3 * t:.2g} ms" if t < 0.0995 else f"{1e3 * t:.0f} ms" if t < 0.9995 else f"{t:.3g} s"


def figures(x):
    """Three figures, without an exponent while that is short."""
    return f"{x:.0f}" if x >= 1000 else f"{x:.3g}"


def time_within(rows, scene, contestant, error):
    """Least run time (s) in which a contestant came within `error` (m): on the lower envelope of its points, straight
    in the logarithms; then "<= " if its coarsest setting is more accurate already. None if it never did."""
    points = sorted((row["run_time_s"], row["position_error_m"]) for row in rows
                    if (row["scene"], row["contestant"], row["failure"]) == (scene.key, contestant.key, ""))
    coarse = None
    for fine in points:
        if coarse and fine[1] >= coarse[1]:
            continue
        if fine[1] <= error:
            if not coarse:
                return fine[0], "<= "
            share = math.log(error / coarse[1]) / math.log(fine[1] / coarse[1])
            return coarse[0] * (fine[0] / coarse[0]) ** share, ""
        coarse = fine
    return None


def references_table(results):
    rows = []
    for scene in results.scenes:
        reference = results.references[scene.key]
        for title, check in reference["checks"]:
            keys = {"position_error_m": "m", "heading_error_rad": "rad", "velocity_error_m_s": "m/s",
                    "wheel_rate_error_rad_s": "rad/s"}
            found = ([check["failure"], "", "", ""] if "failure" in check else
                     [f"{check[key]:.1e} {unit}" for key, unit in keys.items()])
            rows.append([scene.title, f"{reference['span']:g} s", str(reference["switches"]), reference["title"], title,
                         *found])
    return table(["scene", "simulated", "switches", "reference", "checked by", "position", "heading", "velocity",
                  "wheel rates"], rows)


def useful_table(results):
    """Run time, ratio to this package and real-time factor of each contestant on each scene."""
    def entry(scene, contestant):
        reached = time_within(results.rows, scene, contestant, USEFUL_ERROR)
        if not reached:
            return "never"
        own = time_within(results.rows, scene, BY_KEY["youbot_base_sim"], USEFUL_ERROR)
        ratio = f"{reached[0] / own[0]:.3g}x, " if own else ""
        factor = figures(results.references[scene.key]["span"] / reached[0])
        return f"{reached[1]}{seconds(reached[0])}, {ratio}{factor} x real time"

    return table(["contestant", *(scene.title for scene in results.scenes)],
                 [[one.title, *(entry(scene, one) for scene in results.scenes)]
                  for one in results.contestants if not one.explicit])


def accuracy_table(results, scene):
    """How run time grows with accuracy."""
    limits = [10.0**-n for n in range(2, 9)]

    def entry(contestant, error):
        reached = time_within(results.rows, scene, contestant, error)
        return f"{reached[1]}{seconds(reached[0])}" if reached else "-"

    return table(["contestant", *(f"1e-{n} m" for n in range(2, 9))],
                 [[one.title, *(entry(one, error) for error in limits)]
                  for one in results.contestants if not one.explicit])


def growth_tables(results):
    text = ""
    for quantity, values, curves in results.growth:
        rows = []
        for contestant, setting, points in curves:
            cells = [m["failure"] or f"{seconds(m['run_time_per_simulated_s'])} ({m['position_error_m']:.0e} m, "
                     f"{m['switches']} switches)" for m in points]
            rows.append([contestant.title, contestant.shown(setting), *cells])
        text += "\n" + table([quantity, "tolerance", *values], rows)
    return text


def explicit_table(results):
    rows = []
    for scene in results.scenes:
        for m in results.rows:
            contestant = BY_KEY[m["contestant"]]
            if m["scene"] == scene.key and contestant.explicit:
                found = ([f"failed: {m['failure']}", "", ""] if m["failure"] else
                         [f"{m['position_error_m']:.1e} m", seconds(m["run_time_per_simulated_s"]),
                          f"{figures(m['real_time_factor'])} x"])
                setting = contestant.shown(m["setting"])
                rows.append([scene.title, contestant.title, setting, f"{m['span_s']:g} s", *found])
    return table(["scene", "contestant", "tolerance or step", "span", "position", "run time per simulated s",
                  "real time"], rows)


def runs_table(results, scene):
    rows = []
    for m in results.rows:
        if m["scene"] == scene.key:
            contestant = BY_KEY[m["contestant"]]
            found = [f"failed: {m['failure']}", *[""] * 12] if m["failure"] else [
                seconds(m["run_time_s"]), seconds(m["run_time_per_simulated_s"]),
                *(f"{m[key]:.1e}" for key in ("position_error_m", "heading_error_rad", "velocity_error_m_s",
                                              "wheel_rate_error_rad_s")),
                *(str(m.get(key, "-")) for key in COUNTS)]
            rows.append([contestant.title, contestant.shown(m["setting"]), f"{m['span_s']:g} s", *found])
    return table(["contestant", "tolerance or step", "span", "run time", "per simulated s", "position, m",
                  "heading, rad", "velocity, m/s", "wheel rates, rad/s", "steps", "rejected", "locating", "evaluations",
                  "Jacobians", "LU", "switches"], rows)


def held_wheel_table(rows):
    return table(["solver", "tolerance", "end off, m", "largest distance, m", "switches", "run time, s"],
                 [[row["contestant"], f"{row['setting']:g}",
                   *([row["failure"], "", ""] if row["failure"] else
                     [f"{row['end_off_m']:.1e}", f"{row['position_error_m']:.1e}", str(row["switches"])]),
                   f"{row['run_time_s']:.3f}"] for row in rows])


def csv_text(rows):
    def text(key, value):
        if key in ("scene_title", "contestant_title") or (key == "failure" and value):
            return f'"{value}"'
        return f"{value:.6g}" if isinstance(value, float) else str(value)

    lines = [",".join(COLUMNS), *(",".join(text(key, row.get(key, "")) for key in COLUMNS) for row in rows)]
    return "\n".join(lines) + "\n"


def processor():
    with open("/proc/cpuinfo") as file:
        names = (line.partition(":")[2].strip() for line in file if line.startswith("model name"))
        return next(names, "unknown processor")


def comparison(results):
    """The part of the report that answers who takes how long at USEFUL_ERROR, for the terminal."""
    return (f"Run time at a largest position error of {USEFUL_ERROR:g} m, ratio to this package, simulated over run "
            f"time:\n\n{useful_table(results)}")


def markdown(results):
    about = results.about
    machine = (f"{time.strftime('%Y-%m-%d', time.gmtime())}; {processor()}; {about['compiler']}, `{about['flags']}`: "
               f"{about['instruction_set']}; {about['libraries']}.")
    if results.quick:
        machine += " A quick look, not for the record."
    numbers = {"useful": USEFUL_ERROR, "long_run": LONG_RUN, "long_enough": LONG_ENOUGH}
    contestants = "".join(f"- **{one.title}**: {one.notes}\n" for one in results.contestants)
    text = INTRODUCTION.format(machine=machine, contestants=contestants, **numbers) + references_table(results)
    text += AT_USEFUL_ERROR.format(**numbers) + useful_table(results)
    text += "\n## How cost grows with accuracy\n\nRun time at which the largest position error comes down to:\n"
    text += "".join(f"\n{scene.title}:\n\n{accuracy_table(results, scene)}" for scene in results.scenes)
    if results.growth:
        text += GROWTH + growth_tables(results)
    text += EXPLICIT + explicit_table(results) + "\n## All runs\n"
    return text + "".join(f"\n{scene.title}:\n\n{runs_table(results, scene)}" for scene in results.scenes)
