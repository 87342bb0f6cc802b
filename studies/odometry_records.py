"""Runs of a Mecanum base with optical ground truth: the omni4 of github.com/sousarbarb/optiodom, or of its layout."""
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from youbot_base_sim.base import Base
from youbot_base_sim.command_line import Refused, shown

BASE = Base(0.03, 0.0215, 0.1015, 0.1075, 8)  # its roller_axis_radius is assumed
TICK = 2 * np.pi / 2800      # of an encoder, rad: by the ripple of 8 rollers a turn
MESSAGE, ROW = 0.04, 0.01    # s: between the base's messages, by its clock; between rows of a file
TICKS_PER_ROW = 4 * 2880     # a file has parts of 2880 ticks per row, a message's spread over four
FORWARD = [1, -1, 1, -1]     # signs of the wheels' ticks in forward motion
MESSAGES_PER_SAMPLE = 3
FIGURES = ("circular", "square")
LAYOUT = f"a clone of github.com/sousarbarb/optiodom, with data/omni4/{{{','.join(FIGURES)}}}/SET/SET_metadata.csv"


@dataclass
class Run:
    figure: str
    day: str              # ddmm
    group: str            # its folder, of runs made one after another
    rolled: np.ndarray    # (n, 4): how far wheels turn in each sample, rad, forward positive
    pose: np.ndarray      # (n, 3): ground truth at the samples' ends, m, m, rad, of the first's beginning


def messages_of(ticks):
    """The messages behind rows (n, 4) that hold each one's ticks until the next is logged. Equal messages in a row look
    like one long one, and are counted by its length; one that two rows share is no message of its own."""
    begins = np.r_[0, np.flatnonzero(np.any(np.diff(ticks, axis=0), axis=1)) + 1]
    pieces = []
    for begin, length in zip(begins, np.diff(np.r_[begins, len(ticks)])):
        if length == 1 and pieces and begin != begins[-1]:
            pieces[-1][1] += 1
        else:
            pieces.append([begin, length])
    first, length = np.array(pieces).T
    usual = length[(length == 3) | (length == 4)].mean()
    return np.repeat(ticks[first], np.maximum(1, np.rint(length / usual).astype(int)), axis=0)


def read_run(path, stretch):
    """`rolled` and `pose` of one file, whose `stretch` is true over logged time; throws ValueError, OSError."""
    rows = np.loadtxt(path, delimiter=",", encoding="utf-8-sig")
    if rows.ndim != 2 or rows.shape[1] != 8 or not np.isfinite(rows).all():
        raise ValueError("rows must have 8 finite numbers")
    messages = messages_of(np.rint(rows[:, 4:] * TICKS_PER_ROW).astype(int)) * FORWARD * TICK
    count = -(-len(messages) // MESSAGES_PER_SAMPLE)
    padded = np.vstack([messages, np.zeros((count * MESSAGES_PER_SAMPLE - len(messages), 4))])
    row = np.arange(1, count + 1) * MESSAGES_PER_SAMPLE * MESSAGE / stretch / ROW
    pose = np.array([np.interp(row, np.arange(len(rows)), column) for column in rows[:, 1:4].T]).T
    at_rest = np.ptp(rows[-20:, 3]) < 0.02
    pose[-1] = rows[-20:, 1:4].mean(axis=0) if at_rest else rows[-1, 1:4]
    return padded.reshape(count, MESSAGES_PER_SAMPLE, 4).sum(axis=1), pose


def read_runs(folder):
    """All runs. Throws Refused where the folder is another or a file is damaged."""
    files = [path for figure in FIGURES for path in sorted(Path(folder, "data/omni4", figure).glob("*/*_metadata.csv"))]
    if not files:
        raise Refused(f"FOLDER = {shown(folder)}: must be {LAYOUT}")
    runs = []
    for file in files:
        group = file.parent.name
        try:
            lines = [line.split(",") for line in file.read_text(encoding="utf-8-sig").split()]
            meta = {key: [float(cell) for cell in cells if cell] for key, *cells in lines if key != "type"}
            spans = [np.subtract(meta[clock + "_tf"], meta[clock + "_ti"]) for clock in ("gt", "odo")]
            for k in range(int(meta["N"][0])):
                path = file.parent / f"{group}_run-{k + 1:02d}.csv"
                runs.append(Run(file.parent.parent.name, group[:4], group, *read_run(path, spans[0][k] / spans[1][k])))
        except (OSError, ValueError, KeyError, IndexError) as error:
            raise Refused(f"{shown(file.parent)}: {error}; must be a folder of {LAYOUT}")
    return runs


class Records:
    """Runs end to end, in arrays over all samples, and segments of 2 m of wheel travel, by which models are fitted."""
    SEGMENT = 2  # m of |X| + |Y| + (h + l) |psi|

    def __init__(self, runs):
        self.runs, counts = runs, [len(run.rolled) for run in runs]
        self.rolled, self.pose = (np.vstack([getattr(run, name) for run in runs]) for name in ("rolled", "pose"))
        self.end = np.cumsum(counts) - 1
        self.first = np.r_[0, self.end[:-1] + 1]
        self.run_of = np.repeat(np.arange(len(runs)), counts)
        X, Y, psi = self.nominal().T
        self.path = np.add.reduceat(np.hypot(X, Y), self.first)
        self.turns = np.add.reduceat(np.abs(psi), self.first) / (2 * np.pi)
        steps = np.abs(X) + np.abs(Y) + BASE.half_lengths * np.abs(psi)
        begins, ends = [], []
        for first, end in zip(self.first, self.end):
            along = np.cumsum(steps[first:end + 1])
            count = max(1, int(along[-1] / self.SEGMENT))
            cuts = first + np.searchsorted(along, np.arange(1, count) * along[-1] / count)
            begins += [first - 1, *cuts]
            ends += [*cuts, end]
        self.begins, self.ends = np.array(begins), np.array(ends)
        self.at_start = np.isin(self.begins + 1, self.first)
        self.true_segments = self.segments(self.pose)

    def nominal(self, front_left=0):
        """What each sample moves the base by ideal kinematics, (n, 3), m, m, rad; its front left wheel larger by a
        share."""
        return np.array(BASE.velocities(self.rolled * [1 + front_left, 1, 1, 1])).T

    def integrate(self, motion):
        """Poses from what each sample moves the base in its own frame."""
        def of_run(increments):
            total = np.cumsum(increments)
            return total - np.r_[0, total][self.first][self.run_of]
        psi = of_run(motion[:, 2])
        step = (motion[:, 0] + 1j * motion[:, 1]) * np.exp(1j * (psi - motion[:, 2] / 2))
        return np.c_[of_run(step.real), of_run(step.imag), psi]

    def segments(self, pose):
        """How each segment ends, seen from where it begins; yaw by (h + l), so that all are m."""
        begin = np.where(self.at_start[:, None], 0, pose[self.begins])
        moved = pose[self.ends] - begin
        place = (moved[:, 0] + 1j * moved[:, 1]) * np.exp(-1j * begin[:, 2])
        return np.c_[place.real, place.imag, BASE.half_lengths * moved[:, 2]]

    def end_errors(self, motion):
        """x, y, psi at the ends of the runs, less the ground truth."""
        return (self.integrate(motion) - self.pose)[self.end]
