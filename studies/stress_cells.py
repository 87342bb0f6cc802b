"""The motions of the stress suite, as scene files for `simulate`."""
import json
import math
from dataclasses import dataclass
from pathlib import Path

from youbot_base_sim.base import Base

RANDOM_GROUP = "random"
TORQUES = Path(__file__).with_name("random_torques.csv")  # N m
CIRCLE_SPEED = 2 * math.pi * 2.5 / 30  # m/s: Case 1, a circle of radius 2.5 m in 30 s
ROBOT_MASS = 35.6  # kg, wheels included
GRAVITY = 9.81  # m/s^2
MAX_ROWS = 4000  # of a long run
ANGLES = {"wheel_angles": [0.1] * 4}


@dataclass(frozen=True)
class Cell:
    """One motion."""
    group: str
    name: str  # unique within the group, fit for a file name
    scene: dict  # what its file says
    table: str = ""  # CSV that the scene names, beside it under the scene's name

    @property
    def duration(self):
        return self.scene["duration"]

    @property
    def full_name(self):
        return f"{self.group}/{self.name}"

    @property
    def outside_force(self):
        """Of slope and wrenches together, at most, N."""
        slope = self.scene.get("floor", {}).get("slope", {"angle": 0})["angle"]
        mass = ROBOT_MASS + sum(load["mass"] for load in self.scene.get("loads", []))
        return GRAVITY * mass * math.sin(slope) + sum(math.hypot(*wrench["force"])
                                                   for wrench in self.scene.get("wrenches", []))

    def yaml(self, output_rate=None, turned_by=0.0):
        """Its file's text, with all wheels turned by an angle (rad) at the start."""
        scene = dict(self.scene)
        if output_rate or self.duration > 0.01 * MAX_ROWS:
            scene["output_rate"] = output_rate or MAX_ROWS / self.duration
        if turned_by:
            initial = scene.get("initial", {})
            scene["initial"] = initial | {"wheel_angles": [x + turned_by for x in initial.get("wheel_angles", [0] * 4)]}
        return "".join(f"{key}: {json.dumps(value)}\n" for key, value in scene.items())


def cell(group, name, base, table="", **sections):
    """A motion like `base`, but for what these sections of the scene say."""
    changed = {key: {**base.get(key, {}), **section} if isinstance(section, dict) else section
               for key, section in sections.items()}
    return Cell(group, name, {"model": "coulomb", "duration": 10, **base, **changed}, table)


def held_torque(torque):
    return {"torque": [{"start": 0, "constant": torque}]}


def twist(v_x, v_y, omega):
    return {"twist": [v_x, v_y, omega]}


# The first third of Case 1: the rest brings nothing new.
CASE1 = {"drive": {"reference_motion": {"period": 30, "V_X": {"cos": CIRCLE_SPEED}, "V_Y": {"sin": CIRCLE_SPEED}}},
         "initial": {"pose": [2.5, 0, 1.5707963267948966], **ANGLES}}

# Torques far beyond what friction can transmit (2.2 N m a wheel), in jumps and fast waves.
VIOLENT = {"duration": 2, "drive": {"torque": [
    {"start": 0, "constant": [10, -8, 6, -9]}, {"start": 0.5, "constant": [-10, 9, -7, 8]},
    {"start": 1, "constant": [3, 3, -3, -3], "cos": [20, -15, 10, 5], "sin": [-5, 10, 15, -20], "period": 0.05},
    {"start": 1.5, "constant": [40, 40, 40, -40]}]}}

COASTING = {"drive": held_torque([0] * 4)}

# Torque of Case 1, N m: one harmonic a wheel, since the motion is a translation. The constants are rounding errors.
CASE1_TORQUE = {
    "constant": [-9.9920072216264089e-16, 8.8817841970012523e-16, 6.6613381477509392e-16, -9.9920072216264089e-16],
    "cos": [1.088534222629447, 1.2153003900030679, 1.2118823451888381, 1.091952267443677],
    "sin": [-2.6502438960574772, 2.5268957734980848, 2.5324500963212087, -2.6557982188805997],
}

# From rest under the torque of Case 2, which needs all four wheels.
CASE2_TORQUE = [-2.89804529810137, 2.7999194979003175, 2.2855040599920784, -2.383629860193131]


def floors():
    for motion, base in (("case1", CASE1), ("violent", VIOLENT)):
        for nu in (f"1e{decade}" for decade in range(-2, -10, -1)):
            yield cell("nu", f"{motion}_{nu}", base, floor={"slip_regularization": float(nu)})
    for f in ("0", "0.1", "0.5", "1", "5"):
        yield cell("friction", f, CASE1, floor={"friction": float(f)})


def robots():
    for inertia in [f"1e{decade}" for decade in range(-4, -13, -1)] + ["0"]:
        yield cell("roller_inertia", inertia, CASE1, robot={"roller_inertia": float(inertia)})
    yield cell("wheel_inertia", "times_1e-3", CASE1, robot={"wheel_inertia": 1e-3 * 5.87e-3})
    for n in (3, 4, 5, 6, 8, 12, 24):
        rollers = {"rollers_per_wheel": n}
        yield cell("rollers", f"{n}", CASE1, robot=rollers)
        # With few rollers, the default axis radius tapers them to a point before they meet.
        meet = Base.wheel_radius * math.cos(math.pi / n)
        if Base.roller_axis_radius > meet:
            yield cell("rollers", f"{n}_that_meet", CASE1, robot={**rollers, "roller_axis_radius": 0.95 * meet})
    locked = {"wheel_damping": [1e6, 0.11, 0.11, 0.11]}
    yield cell("locked_wheel", "fl_from_rest", {"drive": held_torque([0, 2, 2, 2])}, robot=locked)
    yield cell("locked_wheel", "fl_case1", CASE1, robot=locked)


def torques():
    for factor in ("0", "10", "1e3", "1e6"):
        torque = {key: [float(factor) * x for x in values] for key, values in CASE1_TORQUE.items()}
        yield cell("torque", f"case1_times_{factor}", {**CASE1, "drive": {}}, initial=twist(CIRCLE_SPEED, 0, 0),
                   drive={"torque": [{"start": 0, **torque, "period": 30}]})
    for period in ("1e-4", "1e-3", "1e-2", "1e-1"):
        yield cell("control_period", period, CASE1, solver={"control_period": float(period)})
    for preload in (1, 2, 3, 10, 100):
        yield cell("preload", f"{preload}_N_m", {"drive": held_torque([preload, preload, -preload, -preload])})


def reversals():
    """Torques of 2 N m that reverse every millisecond."""
    for name, signs in (("together", (1, 1, 1, 1)), ("turning", (-1, 1, -1, 1)), ("preload", (1, 1, -1, -1))):
        rows = [[1e-3 * k, *(2 * sign * (-1) ** k for sign in signs)] for k in range(5000)]
        table = "t,fl,fr,bl,br\n" + "".join(",".join(f"{x:.17g}" for x in row) + "\n" for row in rows)
        yield cell("reversal", name, {"duration": 5, "drive": {"torque_table": f"reversal_{name}.csv"}},
                   table, solver={"control_period": 1e-3})


def starts():
    for omega in (1, 3, 10, 30, -30):
        yield cell("spin", f"{omega}_rad_s", COASTING, initial=twist(0, 0, omega))
    yield cell("spin", "30_rad_s_and_1_m_s", COASTING, initial=twist(0.8, 0.6, 30))

    moving = {**ANGLES, **twist(0.8, 0.6, 0)}
    yield cell("rest", "coast", {**COASTING, "duration": 12}, initial=moving)
    yield cell("rest", "coast_and_stand_an_hour", {**COASTING, "duration": 3612}, initial=moving)
    yield cell("rest", "stand_an_hour", {**COASTING, "duration": 3600})

    edge = {"duration": 5, "initial": {"wheel_angles": [math.pi / 6] * 4}}
    on_edge = {**COASTING, **edge}
    yield cell("edge", "rest", on_edge)
    yield cell("edge", "rest_pushed", {"drive": held_torque(CASE2_TORQUE), **edge})
    for name, velocity in (("forward", (0.3, 0, 0)), ("backward", (-0.3, 0, 0)), ("sideways", (0, 0.3, 0))):
        yield cell("edge", name, on_edge, initial=twist(*velocity))
    # Wheels at rest on a turning base: some edges are attractive, others repel.
    for omega in (1, -1):
        yield cell("edge", f"wheels_at_rest_turning_{omega}", on_edge,
                   initial={"wheel_rates": [0] * 4, **twist(0, 0, omega)})


DYNAMIC = {"normal_reactions": "dynamic", "com_height": 0.034}
TALL = {"normal_reactions": "dynamic", "com_height": 0.1}
WET_PATCH = {"rectangle": [2.2, 0.2, 2.8, 0.6], "friction": 0}  # on the way of Case 1
LOAD = {"mass": 100, "position": [0.1, 0.05, 0.1]}
PUSH = {"start": 0.5, "end": 1.5, "force": [-120, 160, 0], "point": [0.2, 0.1, 0], "frame": "fixed"}


def beyond():
    """What goes beyond the paper: each by itself and all together, at the ends of their ranges."""
    short = {**CASE1, "duration": 3}
    locked = {**COASTING, "duration": 3}
    for angle in (0.33, 0.34, 0.35):  # across the limit at which locked wheels slide, 0.340
        yield cell("floor", f"locked_on_a_slope_of_{angle}", locked,
                   robot={"wheel_damping": [1e6] * 4, "roller_damping": 1e-6, "com": [0, 0]},
                   floor={"slope": {"angle": angle, "uphill": 0}})
    yield cell("floor", "rolls_down_a_slope_of_0.49", locked, floor={"slope": {"angle": 0.49, "uphill": 0.5}},
               initial=ANGLES)
    yield cell("floor", "patch_of_friction_0", short, floor={"patches": [WET_PATCH]})
    yield cell("floor", "patch_of_friction_0_sharp", short, floor={"patches": [{**WET_PATCH, "edge": 1e-3}]})
    yield cell("floor", "no_friction_under_one_wheel", short, floor={"friction": [0, 0.5, 0.5, 0.5]})
    yield cell("floor", "friction_from_0.1_to_2", short, floor={"friction": [0.1, 0.5, 1, 2]})
    for mm in (1, 10):
        yield cell("floor", f"spin_radius_of_{mm}_mm", short, floor={"spin_radius": mm * 1e-3})

    yield cell("load", "100_kg", short, loads=[LOAD])
    yield cell("load", "100_kg_put_on_at_rest", short, loads=[{**LOAD, "start": 1, "end": 2, "placed": "at_rest"}])
    yield cell("load", "100_kg_dynamic", short, robot=DYNAMIC, loads=[LOAD])
    yield cell("load", "push_of_200_N", short, wrenches=[PUSH])
    yield cell("load", "push_of_200_N_dynamic", short, robot=DYNAMIC, wrenches=[PUSH])

    yield cell("reactions", "dynamic", short, robot=DYNAMIC)
    yield cell("reactions", "tall", short, robot=TALL)
    for axle in ("rocking_front", "rocking_rear"):
        yield cell("reactions", axle, short, robot={**DYNAMIC, "load_sharing": axle})
    yield cell("reactions", "rocking_front_tall", short, robot={**TALL, "load_sharing": "rocking_front"})
    yield cell("reactions", "diagonal_preload_static", short, robot={"diagonal_preload": 50})
    yield cell("reactions", "diagonal_preload_dynamic", short, robot={**DYNAMIC, "diagonal_preload": 50})
    # Brakes askew with its centre of mass high up: a wheel leaves the floor and comes back.
    brakes = {"duration": 1, "initial": twist(0.8, 0.5, 0), "drive": {"torque": [
        {"start": 0, "constant": [-6, -3, -3, -6]}, {"start": 0.12, "constant": [0] * 4}]}}
    yield cell("reactions", "lift_off", brakes, floor={"friction": 0.7},
               robot={"normal_reactions": "dynamic", "com_height": 0.3, "com": [0, 0]})
    for nu in ("1e-5", "1e-7"):
        yield cell("reactions", f"rocking_front_nu_{nu}", short, robot={**DYNAMIC, "load_sharing": "rocking_front"},
                   floor={"slip_regularization": float(nu)})

    everything = {"floor": {"friction": [0.5, 0.45, 0.5, 0.55], "slope": {"angle": 0.1, "uphill": 0.5},
                            "patches": [{**WET_PATCH, "friction": 0.2}], "spin_radius": 1e-3},
                  "loads": [{**LOAD, "mass": 20}], "wrenches": [{**PUSH, "force": [-30, 40, 0]}]}
    dry = {"dry_friction": 0.18, "roller_dry_friction": 0.073}
    for name, robot in (("preload", {"diagonal_preload": 10}), ("rocking_front", {"load_sharing": "rocking_front"})):
        yield cell("together", name, short, robot={**DYNAMIC, **dry, **robot}, **everything)


def random_runs():
    """Under constant torques, drawn within 2 N m."""
    for k, line in enumerate(TORQUES.read_text().splitlines()[1:]):
        yield cell(RANDOM_GROUP, f"{k:03}", {"drive": held_torque([float(torque) for torque in line.split(",")])})


# The yardstick of run times: Case 1, counter-clockwise, model 2b.
BASE = cell("base", "case1", CASE1)


def stress_cells():
    """All cells in the order in which they run, group by group."""
    for group in (floors, robots, torques, reversals, starts, beyond, random_runs):
        yield from group()
