"""Runs of `simulate`: a scene changed in some keys, recorded in a bag, and the bag as arrays; the runs that a study
needs. Bags are kept under the hash of what they depend on, so that no run is done twice."""
import copy
import fcntl
import hashlib
import itertools
import math
import os
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from pathlib import Path

import numpy as np
import yaml

from youbot_base_sim.bags import Bag
from youbot_base_sim.base import Base
from youbot_base_sim.command_line import REFUSED, Failed, Refused, one_line
from youbot_base_sim.records import read_record
from .builds import digest

MODELS = ("no_slip", "viscous", "coulomb")  # the paper's 1, 2a and 2b
DEGREES = 180 / math.pi


def mean(t, values):
    """Over time."""
    return np.trapz(values, t) / (t[-1] - t[0])


class PlainDumper(yaml.SafeDumper):
    """Writes every scalar as it was read, without quotes."""
    yaml_implicit_resolvers = {}


class Scene:
    """A scene file. All its scalars stay the text that they are: only `simulate` knows what they mean."""

    def __init__(self, path):
        self.path = Path(path)
        try:
            self.values = yaml.load(self.path.read_text(), Loader=yaml.BaseLoader)
        except (OSError, UnicodeDecodeError) as error:
            raise Refused(f"{path}: {getattr(error, 'strerror', None) or 'must be text'}")
        except yaml.YAMLError as error:
            raise Refused(f"{path}: must be YAML: {one_line(error)}")
        self.tables, self.name = [], self.path.stem
        drive = self.values.get("drive") if isinstance(self.values, dict) else None  # simulate refuses all others
        for key in ("torque_table", "velocity_table"):
            if isinstance(drive, dict) and isinstance(drive.get(key), str):
                self.tables.append(self.path.parent.absolute() / drive[key])
                drive[key] = str(self.tables[-1])

    def key(self):
        """All that its motion depends on, but for the program."""
        return "\0".join([self.text(), *(hashlib.sha256(table.read_bytes()).hexdigest() for table in self.tables)])

    @property
    def duration(self):
        return float(self.values["duration"])

    @property
    def wheel_angles(self):
        return [float(angle) for angle in self.values.get("initial", {}).get("wheel_angles", [0] * 4)]

    @property
    def roller_pitch(self):
        """Angle of the wheel from one roller to the next, rad."""
        return 2 * math.pi / int(self.values.get("robot", {}).get("rollers_per_wheel", 6))

    def changed(self, **sections):
        """The scene with other values: changed(duration=3, initial=dict(wheel_angles=[...])); None leaves a key out."""
        scene = copy.copy(self)
        changes = {key: {**self.values.get(key, {}), **value} if isinstance(value, dict) else value
                   for key, value in sections.items()}
        scene.values = plain({**self.values, **changes})
        return scene

    def sampled(self, duration, rows):
        """The first `duration` s in about that many rows."""
        return self.changed(duration=duration, output_rate=float(f"{min(rows / duration, 1e6):.2g}"))

    def text(self):
        return yaml.dump(self.values, Dumper=PlainDumper)


def plain(value):
    """Numbers as text, in lists and dictionaries too; without keys of None."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items() if entry is not None}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(entry) for entry in value]
    return value if isinstance(value, str) else repr(float(value))


class Recording:
    """The topics of a bag, each read when it is first asked for."""
    def __init__(self, path):
        self.path = path

    def series(self, name):
        return read_record(Bag(self.path), Base(), only=[name]).get(name)

    @cached_property
    def truth(self):
        """Of each row of ground_truth t, x, y, psi (s, m, rad, unwrapped), V_X, V_Y and Omega (m/s, rad/s)."""
        series = self.series("ground_truth")
        return dict(series.columns, t=series.t)

    @cached_property
    def wheels(self):
        """Of each row of joint_states t (s), and of the four wheels phi, dphi and torque (rad, rad/s, N m)."""
        series = self.series("joint_states")
        return dict(t=series.t, phi=series["position"], dphi=series["velocity"],
                    torque=series.columns.get("effort", 0 * series["velocity"]))

    @cached_property
    def switches(self):
        """Of each wheel the times (s) and wheel angles (rad) of its roller switches."""
        series = self.series("roller_switches")
        if not series:
            return [(np.array([]), np.array([]))] * 4
        counts = [np.where(series["wheel"] == i, series["count"], 0).astype(int) for i in range(4)]
        return [(np.repeat(series.t, count), np.repeat(series["phi"], count)) for count in counts]

    @cached_property
    def contacts(self):
        """Of each row t (s) and drive power (W); of the four contacts |v_P| (m/s), |F|, N (N), share of the limit."""
        series = self.series("contacts")
        return dict(t=series.t, slip=np.linalg.norm(series["slip"], axis=2),
                    force=np.linalg.norm(series["force"], axis=2), normal=series["normal"], share=series["share"],
                    drive_power=series["drive"])


class Kept:
    """Files that are made once and kept under the hash of what they depend on, for one program: deletes what another
    one made. Of several users of a folder, the later ones wait."""

    def __init__(self, folder, program):
        self.program = digest(program)
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.lock = open(folder / "lock", "w")
        fcntl.flock(self.lock, fcntl.LOCK_EX)
        self.folder = folder / self.program[:16]
        self.folder.mkdir(exist_ok=True)
        for other in [*folder.iterdir(), *self.folder.glob("part-*")]:
            if other.is_dir() and other != self.folder:
                shutil.rmtree(other)

    def key(self, *parts):
        return hashlib.sha256("\0".join([self.program, *map(str, parts)]).encode()).hexdigest()[:24]

    def file(self, name, make):
        """The file or folder of this name, which make(path) makes if it is missing; it appears when it is whole."""
        path = self.folder / name
        if not path.exists():
            with tempfile.TemporaryDirectory(prefix="part-", dir=self.folder) as part:
                make(Path(part) / name)
                os.replace(Path(part) / name, path)
        return path


class Recorder:
    """Runs `simulate`, one for each processor, and keeps the bags. Calls `report(done, all)` as runs end."""

    def __init__(self, simulate, kept, report=lambda done, count: None):
        self.simulate, self.kept, self.report, self.warnings = Path(simulate), kept, report, []
        self.running, self.stopping = set(), False

    def models_of(self, scene):
        """Those that take the scene: what goes beyond the paper is not for all; a warning names the others. Throws
        Refused, with what `simulate` says, where it does not take the scene as it is."""
        status, said = self.run(scene.path, "--cpu-limit", "1e-9")
        if status == REFUSED:
            raise Refused(said)
        models = []
        for model in MODELS:
            try:
                self.record(scene.changed(duration=min(scene.duration, 1e-3)), model)
                models.append(model)
            except Refused as error:
                self.warnings.append(f"without model {model}: {error}")
        return models

    def run(self, *arguments):
        """Exit status of `simulate`, and its first line of errors."""
        program = subprocess.Popen([self.simulate, *arguments, "--quiet"], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True)
        self.running.add(program)
        if self.stopping:  # since before it was added
            program.terminate()
        line = program.communicate()[1].strip().split("\n")[0]
        self.running.discard(program)
        return program.returncode, line.removeprefix("simulate: ")

    def record(self, scene, model="coulomb", contacts=False, to_the_limit=False):
        """`to_the_limit`: if the base tips over, the motion until then counts."""
        if model == "no_slip":  # its wheels can but roll
            scene = scene.changed(initial=dict(wheel_rates=None, roller_rates=None))
        key = self.kept.key(scene.key(), model, contacts)

        def run(bag):
            file = bag.with_suffix(".yaml")
            file.write_text(scene.text())
            status, said = self.run(file, "--model", model, "--bag", bag, *["--contacts"] * contacts)
            said = said.replace(str(file), str(scene.path))
            if to_the_limit and status == 1 and "tips over" in said:
                next(bag.parent.glob(bag.name + ".incomplete-*")).rename(bag)
                return
            if status != 0:
                raise (Refused if status == REFUSED else Failed)(said or f"{self.simulate}: exit status {status}")
            if said:
                self.warnings.append(f"{scene.path}, {model}: {said}")
        return Recording(self.kept.file(f"{scene.name}-{model}-{key}.bag", run))

    def record_all(self, runs):
        """Recordings of several runs, each the arguments of `record`."""
        recordings = []
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            try:
                for future in [pool.submit(self.record, *run) for run in runs]:
                    recordings.append(future.result())
                    self.report(len(recordings), len(runs))
            except BaseException:  # an interrupt too
                pool.shutdown(wait=False, cancel_futures=True)
                self.stopping = True
                for program in list(self.running):
                    program.terminate()
                raise
        return recordings


class Study:
    """The runs of one scene that its figures show, each recorded when it is first asked for."""

    ROWS, CONTACT_ROWS, SPREAD_ROWS = 6000, 10000, 300  # of a run
    BEGINNING, CONTACT = 20, 5  # roller switches of the first wheel that the figures of the beginning show

    def __init__(self, scene, recorder, models=MODELS):
        self.scene, self.recorder, self.models = scene, recorder, models

    def of_models(self, scene, without=(), contacts=False):
        models = [model for model in self.models if model not in without]
        return dict(zip(models, self.recorder.record_all([(scene, model, contacts) for model in models])))

    @cached_property
    def whole(self):
        """By model, the whole motion."""
        return self.of_models(self.scene.sampled(self.scene.duration, self.ROWS))

    @cached_property
    def beginning(self):
        """By model, the motion's beginning."""
        return self.of_models(self.scene.sampled(self.until_switch(self.BEGINNING), self.ROWS))

    @cached_property
    def contact(self):
        """By model, 2a and 2b, the contacts in the motion's beginning."""
        scene = self.scene.sampled(self.until_switch(self.CONTACT), self.CONTACT_ROWS)
        return self.of_models(scene, ("no_slip",), True)

    def until_switch(self, count):
        """Time (s) a little beyond this switch of the first wheel, if there is one within the duration."""
        times = self.whole["coulomb"].switches[0][0]
        end = float(f"{1.1 * times[count - 1]:.2g}") if len(times) >= count else 0
        return min(self.scene.duration, end if end > 0 else math.inf)

    def half_pitch_angles(self):
        """16 rows of initial wheel angles, rad: each wheel stands as the scene says or half a roller further."""
        further = np.array(list(itertools.product((0, 1), repeat=4)))
        return self.scene.wheel_angles + self.scene.roller_pitch / 2 * further

    def spread(self, angles):
        """Motions of model 2b from these initial wheel angles, rows of four, rad."""
        scene = self.scene.sampled(self.scene.duration, self.SPREAD_ROWS)
        return self.recorder.record_all([(scene.changed(initial=dict(wheel_angles=row)), "coulomb") for row in angles])
