"""Runs of `simulate` for the stress suite, each in its own process, so that a crash or a hang ends one run only."""
import json
import math
import subprocess
from dataclasses import dataclass, field

from youbot_base_sim.base import Base
from youbot_base_sim.command_line import Failed
from .stress_report import MAX_MS, MAX_TIMES_BASE, MIN_PERMITTED, SMALL_ANGLE, WHEELS_CENTRE, Row

CUT_AFTER = 1.3  # times the permitted time: timing noise must not cut a run that is just within it
MAX_RUN = 60  # s of processor time, whatever is permitted
CUT_RUN = 3  # s, for the milliseconds of a run that was cut
RESPITE = 20  # s of wall time beyond five times the limit, before a run counts as hung
TIGHT_TOLERANCE = 1e-9  # for the amplification, a property of the motion rather than of the integration


@dataclass
class Run:
    ending: str  # finished, not finite, cut, refused, failed, crashed or hung
    message: str = ""
    summary: dict = field(default_factory=dict)  # of a run that finished or was cut

    def distance(self, other):
        """Between the ends of two runs, m, with rotation at the wheels' centres; NaN unless both finished."""
        if not self.ending == other.ending == "finished":
            return math.nan
        x, y, psi = (self.summary["final"][key] - other.summary["final"][key] for key in ("x", "y", "psi"))
        return math.hypot(x, y, WHEELS_CENTRE * psi)


def run_cell(program, folder, cell, tolerance, cpu_limit=MAX_RUN, **variant):
    """Runs the cell's scene, which lies in the folder, or a variant of it, for at most `cpu_limit` s of processor
    time."""
    scene = folder / f"{cell.group}_{cell.name}.yaml"
    if cell.table:
        scene.with_suffix(".csv").write_text(cell.table)
    scene.write_text(cell.yaml(**variant))
    command = [program, scene, "--quiet", "--relative-tolerance", repr(tolerance), "--summary", "/dev/stdout",
               "--cpu-limit", repr(cpu_limit)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=RESPITE + 5 * cpu_limit)
    except subprocess.TimeoutExpired:
        return Run("hung")
    finally:
        scene.write_text(cell.yaml())
    message = done.stderr.strip().removeprefix("simulate: ")
    if done.returncode < 0:
        return Run("crashed", f"signal {-done.returncode}")
    if done.stdout:
        numbers = json.loads(done.stdout)
        return Run("finished" if numbers["completed"] else "cut", "", numbers)
    if "no longer finite" in message:
        return Run("not finite", message)
    return Run("refused" if done.returncode == 2 else "failed", message)


def base_cost(simulate, cell, tolerance):
    """Of the base scene at one tolerance: processor seconds per simulated second."""
    times = []
    for run in (simulate(cell, tolerance) for _ in range(3)):
        if run.ending != "finished":
            raise Failed(f"the base scene does not finish at {tolerance:g}: {run.ending} {run.message}")
        times.append(run.summary["cpu_time"])
    return min(times) / cell.duration


def measure(simulate, cell, tolerance, base):
    """A row of stress.csv."""
    row = Row(group=cell.group, cell=cell.name, tolerance=tolerance, duration=cell.duration,
              base_cpu_time=base * cell.duration)
    run = plain_run(simulate, cell, tolerance, row)
    milliseconds(simulate, cell, tolerance, row)
    if run.ending == "finished":
        halving(simulate, cell, tolerance, run, row)
    return row


def plain_run(simulate, cell, tolerance, row):
    """Ending, cost, energy and counters, and where the motion ends."""
    for permitted in max(MIN_PERMITTED, MAX_TIMES_BASE * row["base_cpu_time"]), cell.duration:
        run = simulate(cell, tolerance, min(MAX_RUN, CUT_AFTER * permitted))
        read(run, cell, row)
        if run.ending != "cut" or not row.is_fast:  # real time is enough for a fast one
            break
    if run.ending == "finished" and row["cpu_time"] > permitted:
        again = simulate(cell, tolerance, CUT_AFTER * permitted)
        row["cpu_time"] = min(row["cpu_time"], again.summary.get("cpu_time", math.inf))
    return run


def read(run, cell, row):
    row.update(ending=run.ending, message=run.message)
    if numbers := run.summary:
        energy, length = numbers["energy"], numbers["path_length"]
        row.update({name: numbers[name] for name in ("switches", "shared_contacts", "cpu_time")},
                   reached=numbers["simulated_time"],
                   energy_error=energy["max_balance_error"],
                   energy=max(energy["max_kinetic"], energy["drive_work"], cell.outside_force * length["base"]),
                   path=max(length["base"], *length["wheels"]),
                   **{key: numbers["final"][key] for key in ("x", "y", "psi")})


def milliseconds(simulate, cell, tolerance, row):
    """Run time of the simulated milliseconds: the run with the quickest slowest of three, where one is late."""
    cut = row["ending"] != "finished"
    for _ in range(1 if cut else 3):
        numbers = simulate(cell, tolerance, CUT_RUN if cut else MAX_RUN, output_rate=1000).summary
        if not numbers:
            return
        slowest = numbers["slowest_period"]
        if not slowest["cpu_time"] >= row["slowest_ms"]:
            row["slowest_ms"] = slowest["cpu_time"]
        if slowest["cpu_time"] <= MAX_MS:
            return


def halving(simulate, cell, tolerance, run, row):
    """How far half the tolerance moves the end; where that is too far, how far two neighbours move it."""
    row["halving"] = run.distance(simulate(cell, tolerance / 2))
    if row["halving"] <= row.permitted_distance:
        return
    tight = min(tolerance, TIGHT_TOLERANCE)
    middle = simulate(cell, tight)
    for side, angle in (("minus", -SMALL_ANGLE), ("plus", SMALL_ANGLE)):
        neighbour = simulate(cell, tight, turned_by=angle)
        # Fallback steps have errors of their own, which say nothing about the motion.
        if all(run.summary.get("fallback_steps") == 0 for run in (middle, neighbour)):
            row[f"amplification_{side}"] = middle.distance(neighbour) / (Base.wheel_radius * SMALL_ANGLE)
