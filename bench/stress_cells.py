"""The motions of the stress suite, as scene files for `simulate`."""

import math
from dataclasses import dataclass, replace

RANDOM_GROUP = "random"
SEED = 20200216  # of the random torques
RANDOM_RUNS = 200
MAX_RANDOM_TORQUE = 2.0  # N m
CIRCLE_SPEED = 2 * math.pi * 2.5 / 30  # m/s: Case 1, a circle of radius 2.5 m in 30 s
WHEEL_RADIUS, ROLLER_AXIS_RADIUS, WHEEL_INERTIA = 0.05, 0.0355, 5.87e-3  # the defaults, SI
MAX_ROWS = 4000  # of a long run
ANGLES = "wheel_angles: [0.1, 0.1, 0.1, 0.1]"


@dataclass(frozen=True)
class Cell:
    """One motion: the lines of its scene, each the inside of a YAML flow mapping or empty."""

    drive: str
    duration: float = 10  # s
    initial: str = ""
    robot: str = ""
    floor: str = ""
    solver: str = ""
    group: str = ""
    name: str = ""  # unique within the group, fit for a file name
    table: str = ""  # CSV that the scene names, beside it under the scene's name
    torque: tuple = ()  # N m, of a random run
    quick: bool = False  # also part of the smoke test

    @property
    def full_name(self):
        return f"{self.group}/{self.name}"

    @property
    def file_name(self):
        return f"{self.group}_{self.name}"

    def scene(self, output_rate=None, turned_by=0.0):
        """Its YAML, with all wheels turned by an angle (rad) at the start."""
        lines = ["model: coulomb", f"duration: {self.duration:g}"]
        if output_rate is None and self.duration > 0.01 * MAX_ROWS:
            output_rate = MAX_ROWS / self.duration
        if output_rate is not None:
            lines.append(f"output_rate: {output_rate:.17g}")
        initial = turned(self.initial, turned_by) if turned_by else self.initial
        for key, value in (("robot", self.robot), ("floor", self.floor), ("initial", initial),
                           ("solver", self.solver), ("drive", self.drive)):
            if value:
                lines.append(f"{key}: {{{value}}}")
        return "\n".join(lines) + "\n"


def turned(initial, angle):
    """`initial` with `angle` added to each wheel's angle; they are 0 unless given."""
    head, found, rest = initial.partition("wheel_angles: [")
    if not found:
        return ", ".join(filter(None, [initial, f"wheel_angles: {row([angle] * 4)}"]))
    numbers, _, tail = rest.partition("]")
    return f"{head}wheel_angles: {row([float(x) + angle for x in numbers.split(',')])}{tail}"


def row(numbers):
    return "[" + ", ".join(f"{x:.17g}" for x in numbers) + "]"


def held_torque(torque):
    return f"torque: [{{start: 0, constant: {row(torque)}}}]"


def twist(v_x, v_y, omega):
    return f"twist: {row([v_x, v_y, omega])}"


# The first third of Case 1: the rest brings nothing new.
CASE1 = Cell(drive=f"reference_motion: {{period: 30, V_X: {{cos: {CIRCLE_SPEED:.17g}}}, "
                   f"V_Y: {{sin: {CIRCLE_SPEED:.17g}}}}}",
             initial=f"pose: [2.5, 0, 1.5707963267948966], {ANGLES}")

# Torques far beyond what friction can transmit (2.2 N m a wheel), in jumps and fast waves.
VIOLENT = Cell(duration=2, drive=(
    "torque: [{start: 0, constant: [10, -8, 6, -9]}, {start: 0.5, constant: [-10, 9, -7, 8]}, "
    "{start: 1, constant: [3, 3, -3, -3], cos: [20, -15, 10, 5], sin: [-5, 10, 15, -20], period: 0.05}, "
    "{start: 1.5, constant: [40, 40, 40, -40]}]"))

# Torque of Case 1, N m: one harmonic a wheel, since the motion is a translation. The constants are rounding errors.
CASE1_TORQUE = {
    "constant": [-9.9920072216264089e-16, 8.8817841970012523e-16, 6.6613381477509392e-16, -9.9920072216264089e-16],
    "cos": [1.088534222629447, 1.2153003900030679, 1.2118823451888381, 1.091952267443677],
    "sin": [-2.6502438960574772, 2.5268957734980848, 2.5324500963212087, -2.6557982188805997],
}

# From rest under the torque of Case 2, which needs all four wheels.
CASE2_TORQUE = [-2.89804529810137, 2.7999194979003175, 2.2855040599920784, -2.383629860193131]


def case1_torque(factor):
    parts = ", ".join(f"{key}: {row([factor * x for x in torque])}" for key, torque in CASE1_TORQUE.items())
    return f"torque: [{{start: 0, {parts}, period: 30}}]"


def floors():
    for motion, cell in (("case1", CASE1), ("violent", VIOLENT)):
        for decade in range(-2, -10, -1):
            yield replace(cell, group="nu", name=f"{motion}_1e{decade}", quick=decade == -6,
                          floor=f"slip_regularization: 1e{decade}")
    for f in ("0", "0.1", "0.5", "1", "5"):
        yield replace(CASE1, group="friction", name=f, floor=f"friction: {f}", quick=f == "0")


def robots():
    for inertia in [f"1e{decade}" for decade in range(-4, -13, -1)] + ["0"]:
        yield replace(CASE1, group="roller_inertia", name=inertia, robot=f"roller_inertia: {inertia}",
                      quick=inertia in ("1e-12", "0"))
    yield replace(CASE1, group="wheel_inertia", name="times_1e-3", robot=f"wheel_inertia: {1e-3 * WHEEL_INERTIA:.17g}")
    for n in (3, 4, 5, 6, 8, 12, 24):
        cell = replace(CASE1, group="rollers", name=f"{n}", robot=f"rollers_per_wheel: {n}", quick=n == 3)
        yield cell
        # With few rollers, the default axis radius tapers them to a point before they meet.
        meet = WHEEL_RADIUS * math.cos(math.pi / n)
        if ROLLER_AXIS_RADIUS > meet:
            yield replace(cell, name=f"{n}_that_meet", quick=False,
                          robot=f"{cell.robot}, roller_axis_radius: {0.95 * meet:.17g}")
    locked = "wheel_damping: [1e6, 0.11, 0.11, 0.11]"
    yield Cell(group="locked_wheel", name="fl_from_rest", drive=held_torque([0, 2, 2, 2]), robot=locked, quick=True)
    yield replace(CASE1, group="locked_wheel", name="fl_case1", robot=locked)


def torques():
    for factor in ("0", "10", "1e3", "1e6"):
        yield replace(CASE1, group="torque", name=f"case1_times_{factor}", drive=case1_torque(float(factor)),
                      initial=f"{CASE1.initial}, {twist(CIRCLE_SPEED, 0, 0)}", quick=factor == "0")
    for period in ("1e-4", "1e-3", "1e-2", "1e-1"):
        yield replace(CASE1, group="control_period", name=period, solver=f"control_period: {period}",
                      quick=period == "1e-3")
    for preload in (1, 2, 3, 10, 100):
        yield Cell(group="preload", name=f"{preload}_N_m", quick=preload == 1,
                   drive=held_torque([preload * sign for sign in (1, 1, -1, -1)]))


def reversals():
    """Torques of 2 N m that reverse every millisecond."""
    for name, signs in (("together", (1, 1, 1, 1)), ("turning", (-1, 1, -1, 1)), ("preload", (1, 1, -1, -1))):
        rows = ["t,fl,fr,bl,br"]
        for k in range(5000):
            torque = [2 * sign * (-1) ** k for sign in signs]
            rows.append(",".join(map(str, [1e-3 * k if k else 0, *torque])).replace(".0,", ","))
        yield Cell(group="reversal", name=name, duration=5, drive=f"torque_table: reversal_{name}.csv",
                   solver="control_period: 1e-3", table="\n".join(rows) + "\n", quick=name == "turning")


def starts():
    coasting = Cell(drive=held_torque([0] * 4))
    for omega in (1, 3, 10, 30, -30):
        yield replace(coasting, group="spin", name=f"{omega}_rad_s", initial=twist(0, 0, omega), quick=omega == 30)
    yield replace(coasting, group="spin", name="30_rad_s_and_1_m_s", initial=twist(0.8, 0.6, 30))

    moving = f"{ANGLES}, {twist(0.8, 0.6, 0)}"
    yield replace(coasting, group="rest", name="coast", duration=12, initial=moving)
    yield replace(coasting, group="rest", name="coast_and_stand_an_hour", duration=3612, initial=moving, quick=True)
    yield replace(coasting, group="rest", name="stand_an_hour", duration=3600)

    edge = f"wheel_angles: {row([math.pi / 6] * 4)}"
    on_edge = replace(coasting, group="edge", duration=5)
    yield replace(on_edge, name="rest", initial=edge)
    yield replace(on_edge, name="rest_pushed", drive=held_torque(CASE2_TORQUE), initial=edge, quick=True)
    for name, velocity in (("forward", (0.3, 0, 0)), ("backward", (-0.3, 0, 0)), ("sideways", (0, 0.3, 0))):
        yield replace(on_edge, name=name, initial=f"{edge}, {twist(*velocity)}")
    # Wheels at rest on a turning base: some edges are attractive, others repel.
    for omega in (1, -1):
        yield replace(on_edge, name=f"wheels_at_rest_turning_{omega}", quick=omega == 1,
                      initial=f"{edge}, wheel_rates: [0, 0, 0, 0], {twist(0, 0, omega)}")


def mt19937_64(seed):
    """std::mt19937_64, which the C++ standard defines to the bit."""
    n, m, mask = 312, 156, (1 << 64) - 1
    state = [seed]
    for i in range(1, n):
        state.append((6364136223846793005 * (state[-1] ^ (state[-1] >> 62)) + i) & mask)
    while True:
        for i in range(n):
            x = (state[i] & ~0x7FFFFFFF & mask) | (state[(i + 1) % n] & 0x7FFFFFFF)
            state[i] = state[(i + m) % n] ^ (x >> 1) ^ (0xB5026F5AA96619E9 if x & 1 else 0)
        for x in state:
            x ^= (x >> 29) & 0x5555555555555555
            x ^= (x << 17) & 0x71D67FFFEDA60000 & mask
            x ^= (x << 37) & 0xFFF7EEE000000000 & mask
            yield x ^ (x >> 43)


def random_torques():
    numbers = mt19937_64(SEED)
    for k in range(RANDOM_RUNS):
        torque = [MAX_RANDOM_TORQUE * (2 * (next(numbers) >> 11) * 2.0**-53 - 1) for _ in range(4)]
        yield Cell(group=RANDOM_GROUP, name=f"{k:03}", drive=held_torque(torque), torque=tuple(torque), quick=k < 5)


def base_cell(max_duration=math.inf):
    """The yardstick of run times: Case 1, counter-clockwise, model 2b."""
    return replace(CASE1, group="base", name="case1", duration=min(CASE1.duration, max_duration))


def stress_cells(max_duration=math.inf):
    """All cells in the order in which they run, group by group, each at most `max_duration` (s) long."""
    for group in (floors, robots, torques, reversals, starts, random_torques):
        for cell in group():
            yield replace(cell, duration=min(cell.duration, max_duration))
