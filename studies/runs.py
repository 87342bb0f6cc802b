"""Motions of scenes, changed in some keys, as arrays; those that a study needs."""
import copy
import itertools
import math
from functools import cached_property
from pathlib import Path

import numpy as np
import yaml

from youbot_base_sim._simulator import Simulation, simulate_many
from youbot_base_sim.command_line import Failed, Refused

MODELS = ("no_slip", "viscous", "coulomb")  # the paper's 1, 2a and 2b
DEGREES = 180 / math.pi


def mean(t, values):
    """Over time."""
    return np.trapz(values, t) / (t[-1] - t[0])


class Scene:
    """A scene file. All its scalars stay the text that they are: only the simulator knows what they mean."""

    def __init__(self, path):
        self.path, self.name = Path(path), Path(path).stem
        try:
            Simulation(self.path).advance(0)
        except ValueError as error:
            raise Refused(error)
        self.values = yaml.load(self.path.read_text(), Loader=yaml.BaseLoader)
        drive = self.values.get("drive", {})
        for key in {"torque_table", "velocity_table", "wheel_angle_table"} & set(drive):
            drive[key] = str(self.path.parent.absolute() / drive[key])

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
        scene.values = {**self.values, **{
            key: {name: entry for name, entry in {**self.values.get(key, {}), **value}.items() if entry is not None}
            if isinstance(value, dict) else value for key, value in sections.items()}}
        scene.values = {key: value for key, value in scene.values.items() if value is not None}
        return scene

    def sampled(self, duration, rows):
        """The first `duration` s in about that many rows."""
        return self.changed(duration=duration, output_rate=float(f"{min(rows / duration, 1e6):.2g}"))


class Motion:
    """Of each row of a scene t (s) and columns of numbers by their names: `truth`, the state and torque of the wheels
    (N m), and `contacts`, where the four slip; `switches`, of each wheel the times (s) and angles (rad) at which its
    rollers switch."""

    def __init__(self, scene, model="coulomb", to_the_limit=False):
        """`to_the_limit`: if the base tips over, the motion until then counts."""
        if model == "no_slip":  # its wheels can but roll
            scene = scene.changed(initial=dict(wheel_rates=None, roller_rates=None))
        simulation = Simulation(scene.values, {"model": model})
        rate, rows = float(scene.values.get("output_rate", 100)), []
        try:
            for t in [*np.arange(0, scene.duration * rate * (1 - 1e-12)) / rate, scene.duration]:
                simulation.advance(t)
                rows.append((simulation.t, simulation.state.copy(), simulation.torque, simulation.contacts()))
        except RuntimeError as error:
            if not to_the_limit:
                raise Failed(f"{scene.path}: {error}")
        t, state, torque, contacts = map(np.array, zip(*rows))
        self.truth = dict({name: state[name] for name in state.dtype.names}, t=t, torque=torque)
        force, limit = np.hypot(contacts["F_X"], contacts["F_Y"]), contacts["f"] * contacts["N"]
        self.contacts = dict(t=t, slip=np.hypot(contacts["V_PX"], contacts["V_PY"]), force=force, limit=limit,
                             normal=contacts["N"], drive_power=np.sum(torque * state["dphi"], axis=1))
        switches = simulation.take_switches()
        self.switches = [(np.repeat(own["t"], own["count"]), np.repeat(own["phi"], own["count"]))
                         for own in (switches[switches["wheel"] == i] for i in range(4))]


class Study:
    """The motions of one scene that its figures show, each simulated when it is first asked for."""

    ROWS, CONTACT_ROWS, SPREAD_ROWS = 6000, 10000, 300  # of a motion
    BEGINNING, CONTACT = 20, 5  # roller switches of the first wheel that the figures of the beginning show

    def __init__(self, scene, models=MODELS):
        self.scene, self.models = scene, models

    @cached_property
    def whole(self):
        """By model, the whole motion."""
        scene = self.scene.sampled(self.scene.duration, self.ROWS)
        return {model: Motion(scene, model) for model in self.models}

    @cached_property
    def beginning(self):
        """By model, the motion's beginning."""
        scene = self.scene.sampled(self.until_switch(self.BEGINNING), self.ROWS)
        return {model: Motion(scene, model) for model in self.models}

    @cached_property
    def contact(self):
        """By model, 2a and 2b, the motion's beginning, for its contacts."""
        scene = self.scene.sampled(self.until_switch(self.CONTACT), self.CONTACT_ROWS)
        return {model: Motion(scene, model) for model in self.models if model != "no_slip"}

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
        """Rows of model 2b from these initial wheel angles, rows of four, rad."""
        scene = self.scene.sampled(self.scene.duration, self.SPREAD_ROWS)
        return simulate_many([scene.values] * len(angles), [{"initial.wheel_angles": row} for row in angles])
