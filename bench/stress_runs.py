"""Runs of `simulate` for the stress suite, each in its own process, so that a crash or a hang ends one run only."""

import hashlib
import json
import math
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import stress_cells
from stress_report import (MAX_MS, MAX_TIMES_BASE, MIN_PERMITTED, SMALL_ANGLE, WHEELS_CENTRE, is_fast,
                           permitted_distance)

CUT_AFTER = 1.3  # times the permitted time: timing noise must not cut a run that is just within it
MAX_RUN = 60  # s of processor time, whatever is permitted
CUT_RUN = 3  # s, for the milliseconds of a run that was cut
RESPITE = 20  # s of wall time beyond five times the limit, before a run counts as hung
TINY_ANGLE = 1e-12  # rad, of all wheels at the start: shows what a rounding error may grow to
TIGHT_TOLERANCE = 1e-9  # for the amplification, a property of the motion rather than of the integration


@dataclass
class Run:
    ending: str  # finished, not finite, cut, refused, failed, crashed or hung
    message: str = ""
    summary: dict | None = None  # of a run that finished or was cut

    @property
    def pose(self):
        """x, y, psi at the end; not numbers unless the run finished."""
        if self.ending != "finished":
            return math.nan, math.nan, math.nan
        return tuple(self.summary["final"][key] for key in ("x", "y", "psi"))


def distance(a, b):
    """Between two poses, m: of O, and of the wheels' centres for the turn."""
    return math.hypot(a[0] - b[0], a[1] - b[1], WHEELS_CENTRE * (a[2] - b[2]))


class Simulate:
    """The program, and the folder in which its scenes lie."""

    def __init__(self, program, folder):
        self.program = program
        self.folder = folder
        self.folder.mkdir(parents=True, exist_ok=True)

    def build(self):
        """Digest of the program and its library, to tell builds apart."""
        needed = subprocess.run(["ldd", self.program], capture_output=True, text=True).stdout
        libraries = re.findall(r"=> (\S*youbot_base_sim\S*)", needed)
        digest = hashlib.sha256()
        for path in [self.program, *libraries]:
            digest.update(Path(path).read_bytes())
        return digest.hexdigest()[:12]

    def write_scene(self, cell):
        if cell.table:
            (self.folder / f"{cell.file_name}.csv").write_text(cell.table)
        (self.folder / f"{cell.file_name}.yaml").write_text(cell.scene())

    def run(self, cell, tolerance, cpu_limit, **variant):
        """Runs the cell's scene, or a variant of it, for at most `cpu_limit` s of processor time."""
        scene = self.folder / f"{cell.file_name}.yaml"
        summary = self.folder / "summary.json"
        summary.unlink(missing_ok=True)
        if variant:
            scene = self.folder / "variant.yaml"
            scene.write_text(cell.scene(**variant))
        command = [self.program, scene, "--quiet", "--relative-tolerance", repr(tolerance), "--summary", summary,
                   "--cpu-limit", repr(cpu_limit)]
        try:
            done = subprocess.run(command, stderr=subprocess.PIPE, text=True, timeout=RESPITE + 5 * cpu_limit)
        except subprocess.TimeoutExpired:
            return Run("hung")
        finally:
            (self.folder / "variant.yaml").unlink(missing_ok=True)
        message = done.stderr.strip().removeprefix("simulate: ")
        if done.returncode < 0:
            return Run("crashed", f"signal {-done.returncode}")
        if summary.exists():
            told = json.loads(summary.read_text())
            summary.unlink()
            return Run("finished" if told["completed"] else "cut", "", told)
        if "no longer finite" in message:
            return Run("not finite", message)
        return Run("refused" if done.returncode == 2 else "failed", message)


@dataclass
class BaseCost:
    """Cost of the base scene at one tolerance, with which all others at it are compared: processor seconds a simulated
    second."""

    plain: float
    by_ms: float  # with a row each millisecond


def measure_base(simulate, cell, tolerance, repeats):
    def cost(run):
        if run.ending != "finished":
            raise RuntimeError(f"the base scene does not finish at {tolerance:g}: {run.ending} {run.message}")
        return run.summary["cpu_time"] / cell.duration

    plain = min(cost(simulate.run(cell, tolerance, MAX_RUN)) for _ in range(repeats))
    return BaseCost(plain, cost(simulate.run(cell, tolerance, MAX_RUN, output_rate=1000)))


def measure(simulate, cell, tolerance, base, compare_held):
    """A row of stress.csv; what could not be measured is left out. `compare_held`: whether random runs are compared
    with a hundredth of the tolerance."""
    row = {"group": cell.group, "cell": cell.name, "tolerance": tolerance, "duration": cell.duration,
           "base_cpu_time": base.plain * cell.duration}
    end = plain_run(simulate, cell, tolerance, row)
    milliseconds(simulate, cell, tolerance, base, row)
    if row["ending"] == "finished":
        halving(simulate, cell, tolerance, end, row)
        if compare_held and cell.group == stress_cells.RANDOM_GROUP:
            hundredth(simulate, cell, tolerance, end, row)
    return row


def plain_run(simulate, cell, tolerance, row):
    """Ending, cost, energy and counters, and where the motion ends."""
    permitted = max(MIN_PERMITTED, MAX_TIMES_BASE * row["base_cpu_time"])
    run = simulate.run(cell, tolerance, min(MAX_RUN, CUT_AFTER * permitted))
    read(run, row)
    if run.ending == "cut" and is_fast(row):  # real time is enough for it
        permitted = cell.duration
        run = simulate.run(cell, tolerance, min(MAX_RUN, CUT_AFTER * permitted))
        read(run, row)
    if run.ending == "finished" and row["cpu_time"] > permitted:
        again = simulate.run(cell, tolerance, CUT_AFTER * permitted)
        if again.ending == "finished":
            row["cpu_time"] = min(row["cpu_time"], again.summary["cpu_time"])
    return run.pose


def read(run, row):
    row.update(ending=run.ending, message=run.message)
    if not run.summary:
        return
    told = run.summary
    row.update(reached=told["simulated_time"], cpu_time=told["cpu_time"],
               energy_error=told["energy"]["max_balance_error"],
               energy=max(told["energy"]["max_kinetic"], told["energy"]["drive_work"]),
               path=max(told["path_length"]["base"], *told["path_length"]["wheels"]),
               x=told["final"]["x"], y=told["final"]["y"], psi=told["final"]["psi"])
    # The counters of the integration, whatever they are: all whole numbers.
    row.update({name: value for name, value in told.items() if type(value) is int})


def milliseconds(simulate, cell, tolerance, base, row):
    """Run time of the simulated milliseconds: the run with the quickest slowest of three, where one is late."""
    cut = row["ending"] != "finished"
    permitted = cell.duration if is_fast(row) else MAX_TIMES_BASE * base.by_ms * cell.duration
    limit = min(CUT_RUN if cut else MAX_RUN, CUT_AFTER * max(MIN_PERMITTED, permitted))
    slowest = math.inf
    for _ in range(1 if cut else 3):
        run = simulate.run(cell, tolerance, limit, output_rate=1000)
        if not run.summary:
            return
        taken = run.summary["slowest_period"]["cpu_time"]
        if taken < slowest:
            slowest = taken
            row.update(slowest_ms=taken, slowest_ms_at=run.summary["slowest_period"]["start"],
                       ms_99_9=run.summary["periods"]["cpu_time_99_9"], late_ms=run.summary["periods"]["late"])
        if slowest <= MAX_MS:
            return


def halving(simulate, cell, tolerance, end, row):
    """How far half the tolerance moves the end; where that is too far, how far two neighbours move it."""
    row["halving"] = distance(end, simulate.run(cell, tolerance / 2, MAX_RUN).pose)
    if row["halving"] <= permitted_distance(row):
        return
    row["echo"] = distance(end, simulate.run(cell, tolerance, MAX_RUN, turned_by=TINY_ANGLE).pose)
    tight = min(tolerance, TIGHT_TOLERANCE)
    middle = simulate.run(cell, tight, MAX_RUN)
    for side, angle in (("minus", -SMALL_ANGLE), ("plus", SMALL_ANGLE)):
        neighbour = simulate.run(cell, tight, MAX_RUN, turned_by=angle)
        # Fallback steps have errors of their own, which say nothing about the motion.
        if all(run.summary and run.summary["fallback_steps"] == 0 for run in (middle, neighbour)):
            moved = distance(middle.pose, neighbour.pose)
            row[f"amplification_{side}"] = moved / (stress_cells.WHEEL_RADIUS * SMALL_ANGLE)


def hundredth(simulate, cell, tolerance, end, row):
    exact = simulate.run(cell, tolerance / 100, MAX_RUN).pose
    moved = math.hypot(exact[0] - end[0], exact[1] - end[1])
    # Infinite where the tighter run did not finish: a failure rather than a gap.
    row["hundredth_distance"] = math.inf if math.isnan(moved) else moved
    row["hundredth_heading"] = abs(exact[2] - end[2])
