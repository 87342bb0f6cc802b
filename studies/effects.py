"""What the physics beyond the paper does to motions: of each feature a finding, with numbers for the table of
docs/beyond/effects.md, and a figure. Each compares runs of a scene of config/scenes with and without the feature."""
from dataclasses import dataclass
from typing import Callable

import numpy as np

from .builds import ROOT
from .pages import Finding, WrittenPart
from .runs import DEGREES, Motion, Scene, mean

PAGE = WrittenPart(ROOT / "docs" / "beyond" / "effects.md", "scripts/study beyond_figures")
COLUMNS = "what", "scene", "what it does"
ROWS = 3000  # of a run
CREEP = 5e-3  # m/s: a contact that slips faster slides rather than creeps

@dataclass
class Effect:
    name: str          # of its figure
    what: str          # in words
    scene: str         # of config/scenes
    runs: Callable     # Scene to a dictionary of label and scene
    measure: Callable  # runs by label to Finding
    to_the_limit: bool = False

    def motions(self):
        scene = Scene(ROOT / "config" / "scenes" / f"{self.scene}.yaml")
        scenes = self.runs(scene.sampled(scene.duration, ROWS))
        return {label: Motion(scene, to_the_limit=self.to_the_limit) for label, scene in scenes.items()}

    def row(self, finding):
        return [self.what, f"`{self.scene}.yaml`", finding.measured()]

EFFECTS = []

def effect(name, what, scene, runs, to_the_limit=False):
    """Adds an effect that the function measures: it returns a finding's text and values."""
    def add(measure):
        EFFECTS.append(Effect(name, what, scene, runs, lambda runs: Finding("yes", *measure(runs)), to_the_limit))
        return measure
    return add

def at(run, t):
    """x, y, psi and the like at time t, s."""
    return {key: np.interp(t, run.truth["t"], values) for key, values in run.truth.items() if values.ndim == 1}

def end(run):
    return at(run, run.truth["t"][-1])

def reactions(run, start, stop):
    """Of the four wheels, in the mean from `start` to `stop` (s), N."""
    t = run.contacts["t"]
    shown = (start <= t) & (t <= stop)
    return np.array([mean(t[shown], N[shown]) for N in run.contacts["normal"].T])

@effect("slope", "slope", "ramp",
        lambda scene: {"5° uphill": scene, "level": scene.changed(floor=dict(slope=None))})
def slope(runs):
    up, level = runs.values()
    top = np.argmax(up.truth["x"])
    return ("With 1.1 N m on each wheel for 1.5 s the base climbs {:.2f} m (on level floor it covers {:.2f} m), coasts "
            "to {:.2f} m until {:.2f} s and rolls back",
            [at(up, 1.5)["x"], at(level, 1.5)["x"], up.truth["x"][top], up.truth["t"][top]])

@effect("patch", "a wet spot under two wheels", "wet_patch",
        lambda scene: {"wet": scene, "dry": scene.changed(floor=dict(patches=None))})
def patch(runs):
    wet, dry = runs.values()
    return ("Over {:.2f} m of lateral motion the base turns by {:.0f}°; on a dry floor by {:.1f}°",
            [np.hypot(end(wet)["x"], end(wet)["y"]), end(wet)["psi"] * DEGREES, end(dry)["psi"] * DEGREES])

@effect("load", "12 kg at the front left", "payload",
        lambda scene: {"with the load": scene, "without": scene.changed(loads=None)})
def load(runs):
    loaded, free = runs.values()
    return ("Placed at rest on the moving base, it takes {:.1f} % of the speed at once. In the end {:.0f} mm of "
            "{:.2f} m and {:.1f}° of heading are missing",
            [100 * (1 - at(loaded, 0.502)["V_Y"] / at(loaded, 0.498)["V_Y"]),
             1e3 * (end(free)["y"] - end(loaded)["y"]), end(free)["y"],
             (end(free)["psi"] - end(loaded)["psi"]) * DEGREES])

@effect("push", "a push of 60 N for 0.4 s", "push",
        lambda scene: {"pushed": scene, "pushed, drive trains without dry friction":
                       scene.changed(robot=dict(profile="measured", dry_friction=0))})
def push(runs):
    pushed, free = runs.values()
    truth = pushed.truth
    moves = np.hypot(truth["V_X"], truth["V_Y"]) + 0.3 * np.abs(truth["Omega"]) > 1e-3
    return ("The standing base rolls {:.0f} mm to the left, turns by {:.1f}° and stops {:.2f} s after the push ends; "
            "without the drive trains' dry friction it rolls {:.0f} mm and turns by {:.1f}°",
            [1e3 * end(pushed)["y"], end(pushed)["psi"] * DEGREES, truth["t"][moves][-1] - 0.6, 1e3 * end(free)["y"],
             end(free)["psi"] * DEGREES])

@effect("braking", "dynamic reactions, to the tipping limit", "braking",
        lambda scene: {f"25 kg at {z} m": scene.changed(loads=[dict(scene.values["loads"][0], position=[0, 0, z])])
                       for z in (0.8, 0.3)}, to_the_limit=True)
def braking(runs):
    tall, low = runs.values()
    before, least = reactions(tall, 0.4, 0.5), low.contacts["normal"][low.contacts["t"] > 0.5].min(axis=0)
    return ("Over the last 0.1 s before it brakes the right wheels carry {:.0f} and {:.0f} N on average, the left ones "
            "{:.0f} and {:.0f} N; {:.0f} ms after its start the right ones are off the floor. With the load at 0.3 m the base stays: the right "
            "ones keep at least {:.0f} and {:.0f} N",
            [before[1], before[3], before[0], before[2], 1e3 * (tall.contacts["t"][-1] - 0.5), least[1], least[3]])

@effect("preload", "12 N of diagonal preload", "uneven_floor",
        lambda scene: {"uneven floor": scene, "even": scene.changed(robot=dict(diagonal_preload=None))})
def preload(runs):
    uneven, even = runs.values()
    return ("Over {:.2f} m of lateral motion the base leaves its line by {:.1f} mm and turns by {:.2f}°; on an "
            "even floor by {:.1f} mm and {:.2f}°",
            [end(uneven)["y"], abs(1e3 * end(uneven)["x"]), abs(end(uneven)["psi"] * DEGREES),
             abs(1e3 * end(even)["x"]), abs(end(even)["psi"] * DEGREES)])

def sliding(run):
    """Share of the time, of all contacts, that they slide rather than creep, %."""
    return 100 * mean(run.contacts["t"], np.mean(run.contacts["slip"] > CREEP, axis=1))

def lateral_velocity(run):
    """Its mean from 1 s on, m/s."""
    shown = run.truth["t"] >= 1
    return mean(run.truth["t"][shown], run.truth["V_Y"][shown])

@effect("spin", "spin friction", "case2",
        lambda scene: {f"$a_m$ = {a} mm": scene.changed(floor=dict(spin_radius=a * 1e-3) if a else {})
                       for a in (0, 1, 2)})
def spin(runs):
    none, one, two = runs.values()
    return ("With a_m of 1 and 2 mm, the mean V_Y is {:.1f} and {:.1f} % lower. Contacts slip faster than 5 mm/s "
            "for {:.0f} and {:.0f} % of the time instead of {:.0f} %",
            [*(100 * (1 - lateral_velocity(run) / lateral_velocity(none)) for run in (one, two)), sliding(one),
             sliding(two), sliding(none)])

@effect("dry", "dry friction of the drive trains", "case2",  # under the torques that move model 1 without it
        lambda scene: {f"$T_1$ = {T:g} N m": scene.changed(
            robot=dict(dry_friction=T), initial=dict(twist=[0, 0.5236, 0.2094]),
            drive=dict(reference_motion=None, torque=[dict(start=0, constant=[-2.898, 2.800, 2.286, -2.384])]))
            for T in (0, 0.15, 0.3)})
def dry(runs):
    none, half, whole = runs.values()
    return ("Under the same torques V_Y is {:.1f} % lower with 0.15 N m and {:.1f} % with 0.3 N m",
            [100 * (1 - lateral_velocity(run) / lateral_velocity(none)) for run in (half, whole)])
