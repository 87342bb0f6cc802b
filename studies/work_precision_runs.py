"""Runs of bench/solve for the work-precision diagram: contestants, scenes, references and errors."""
import csv
import json
import math
import subprocess
from dataclasses import dataclass
from pathlib import Path

from youbot_base_sim.command_line import Failed
from youbot_base_sim.figures import BLACK, BLUE, GREEN, GREY, RED, SKY
from .builds import ROOT

TOLERANCES = [float(f"1e-{n}") for n in range(3, 11)]
USEFUL_ERROR = 1e-5  # m, at which contestants are compared
# A contestant's sweep ends after a run that takes longer, s; sooner once it is within USEFUL_ERROR.
LONG_RUN, LONG_ENOUGH = 6.0, 2.5
EXPLICIT_SPAN = 0.2  # s of the scene that explicit methods run over
ROW_RATE = 20  # Hz
REFERENCE_EVALUATIONS = 2e8  # of the right-hand side, that a reference may take
YARDSTICKS = ("cvode", 3e-14), ("arkode_5", 1e-10)  # solver and tolerance to measure by, then to check that with


@dataclass(frozen=True)
class Contestant:
    """A way to integrate a scene, and the tolerances it is run with, from coarse to fine."""
    key: str  # in the CSV
    title: str  # in the tables
    solver: str  # of bench/solve
    style: dict  # of its curve
    tolerances: tuple = tuple(TOLERANCES)
    explicit: bool = False  # needs steps of some 1e-7 s, and so runs over a short span


CONTESTANTS = [  # docs/work_precision/work_precision.md says how each is run
    Contestant("youbot_base_sim", "youbot_base_sim", "radau",
               dict(color=BLACK, marker="o", linewidth=2.4, markersize=5, zorder=5)),
    Contestant("cvode", "SUNDIALS CVODE (BDF)", "cvode", dict(color=BLUE, marker="s")),
    Contestant("arkode_4", "SUNDIALS ARKODE (DIRK 4)", "arkode_4", dict(color=SKY, marker="^")),
    Contestant("arkode_5", "SUNDIALS ARKODE (DIRK 5)", "arkode_5", dict(color=GREEN, marker="v")),
    Contestant("odeint_rosenbrock4_corrected", "odeint rosenbrock4, d4 corrected", "rosenbrock4",
               dict(color=RED, marker="D")),
    Contestant("odeint_dopri5", "odeint runge_kutta_dopri5", "dopri5", dict(color=GREY, linestyle="-."), (1e-3, 1e-6),
               explicit=True),
]


@dataclass(frozen=True)
class Scene:
    key: str  # in the CSV and on the command line
    title: str
    path: Path
    model: str = "coulomb"
    rows: str = ""  # file of test/data/reference with rows of an independent solver


CASES, BENCH = ROOT / "config" / "scenes", ROOT / "studies" / "bench" / "scenes"
SCENES = [
    Scene("case1_ccw_coulomb", "Case 1 counter-clockwise, 2b", CASES / "case1_counter_clockwise.yaml",
          rows="case1_counter_clockwise_coulomb.csv"),
    Scene("case1_ccw_viscous", "Case 1 counter-clockwise, 2a", CASES / "case1_counter_clockwise.yaml", "viscous",
          "case1_counter_clockwise_viscous.csv"),
    Scene("case1_printed_coulomb", "Case 1 as printed, 2b", CASES / "case1_as_printed.yaml",
          rows="case1_as_printed_coulomb.csv"),
    Scene("case2_coulomb", "Case 2, 2b", CASES / "case2.yaml", rows="case2_coulomb.csv"),
    Scene("violent", "violent", BENCH / "violent.yaml"),
    Scene("held", "torque held over 1 ms", BENCH / "held.yaml"),
    Scene("rocking", "Case 2, rocking front axle, 10 s", BENCH / "rocking.yaml"),
    Scene("beyond", "Case 2, all beyond the paper, 10 s", BENCH / "beyond.yaml"),
]
HELD_WHEEL = Scene("held_wheel", "held wheel", BENCH / "held_wheel.yaml")


def run_solver(program, scene, solver, tolerance, span, **limits):
    """Rows, counts, run time and repeats, or the failure. A solver may be one "of" another program."""
    solver, _, other = solver.partition(" of ")
    task = {"scene": str(scene.path), "model": scene.model, "solver": solver, "span": span, "rate": ROW_RATE,
            "tolerance": tolerance, **limits}
    done = subprocess.run([other or program, json.dumps(task)], capture_output=True, text=True)
    if done.returncode != 0:
        raise Failed(done.stderr.strip() or f"{solver} on {scene.key}: ended by signal {-done.returncode}")
    return json.loads(done.stdout)


def errors(rows, reference):
    """Largest differences over the rows; what is not a number counts as infinite."""
    def of(*columns):
        values = [math.hypot(*(a[k] - b[k] for k in columns)) for a, b in zip(rows, reference)]
        return math.inf if any(map(math.isnan, values)) else max(values, default=0.0)

    return {"failure": "", "position_error_m": of(0, 1), "heading_error_rad": of(2), "velocity_error_m_s": of(4, 5),
            "yaw_rate_error_rad_s": of(6), "wheel_rate_error_rad_s": max(of(k) for k in range(12, 16)),
            "roller_rate_error_rad_s": max(of(k) for k in range(16, 20))}


def file_rows(path):
    """Numbers of the rows of a file, by their times in rows of ROW_RATE; of other times none."""
    rows = {}
    with open(path, newline="") as file:
        for t, *x in ([float(cell) for cell in row] for row in list(csv.reader(file))[1:]):
            k = round(t * ROW_RATE)
            if abs(t * ROW_RATE - k) < 1e-7:
                rows[k] = [*x[:3], 0.0, *x[3:6], 0.0, *x[6:]]  # in the order of a State, without the work
    return rows


def make_reference(solve, scene, span):
    """Motion to measure against, and how far others, as independent of it as can be, are from it."""
    (title, found), (checked_by, other) = (
        (f"{solver.upper().replace('_', ' of order ')}, {tolerance:g}",
         solve(scene, solver, tolerance, span, max_evaluations=REFERENCE_EVALUATIONS)) for solver, tolerance in YARDSTICKS)
    if "failure" in found:
        raise Failed(f"the reference of {scene.title} fails: {found['failure']}")
    rows = found["rows"]
    checks = [(checked_by, {"failure": other["failure"]} if "failure" in other else errors(other["rows"], rows))]
    if scene.rows:
        at = file_rows(ROOT / "test" / "data" / "reference" / scene.rows)
        both = [(row, at[k]) for k, row in enumerate(rows) if k in at]
        checks.append(("rows of test/data/reference", errors(*zip(*both))))
    return {"title": title, "rows": rows, "switches": found["counts"]["switches"], "checks": checks,
            "span": (len(rows) - 1) / ROW_RATE}


def measure(solve, scene, reference, contestant, tolerance, span):
    """A row of work_precision.csv."""
    found = solve(scene, contestant.solver, tolerance, span)
    row = {"scene": scene.key, "scene_title": scene.title, "contestant": contestant.key,
           "contestant_title": contestant.title, "relative_tolerance": tolerance,
           "span_s": math.floor(span * ROW_RATE + 1e-9) / ROW_RATE, "run_time_s": found["run_time"],
           "failure": found.get("failure", "")}
    if row["failure"]:
        return row
    counts = found["counts"]
    counts["steps"] += counts["fallback_steps"]
    row.update(repeats=found["repeats"], run_time_per_simulated_s=found["run_time"] / row["span_s"],
               real_time_factor=row["span_s"] / found["run_time"], **errors(found["rows"], reference["rows"]),
               end_off_m=errors(found["rows"][-1:], reference["rows"][-1:])["position_error_m"],
               # A count of zero where there must be some was not taken.
               **{name: count for name, count in counts.items()
                  if count > 0 or name not in ("evaluations", "jacobians", "factorizations")})
    if not row["position_error_m"] <= 1:
        row["failure"] = "off by more than 1 m"
    return row
