"""The base: names of its four wheels, its size, the kinematics of ideal Mecanum wheels, and the sense in which rates of
wheels were recorded. Arrays over wheels have the order of WHEELS."""
from dataclasses import dataclass
from math import pi, tan

WHEELS = ("fl", "fr", "bl", "br")
JOINTS = tuple("wheel_joint_" + wheel for wheel in WHEELS)
LEFT = (True, False, True, False)
DRIVER_RADIUS = 0.0475  # of the wheels, as the youBot's driver has it, m
GRAVITY = 9.81          # m/s^2


@dataclass
class Base:
    """The size of a base; the defaults are the youBot's, those of a scene without section `robot`."""
    wheel_radius: float = 0.05          # R, m
    roller_axis_radius: float = 0.0355  # R_d, m
    half_wheelbase: float = 0.235       # h, m
    half_track: float = 0.15            # l, m
    rollers_per_wheel: int = 6          # n

    @property
    def half_lengths(self):
        """h + l: by it the yaw rate turns the wheels, m."""
        return self.half_wheelbase + self.half_track

    def rolling_rates(self, V_X, V_Y, Omega):
        """Rates (rad/s) of the four wheels that roll at these velocities (m/s, rad/s), numbers or arrays."""
        turn = self.half_lengths * Omega
        return [speed / self.wheel_radius
                for speed in (V_X - V_Y - turn, V_X + V_Y + turn, V_X + V_Y - turn, V_X - V_Y + turn)]

    def velocities(self, rates):
        """V_X, V_Y and Omega that wheels of these rates, (n, 4), roll: the least squares' where the rates contradict
        each other."""
        fl, fr, bl, br = self.wheel_radius / 4 * rates.T
        return fl + fr + bl + br, -fl + fr + bl - br, (-fl + fr - bl + br) / self.half_lengths

    def jump_of_offset(self):
        """How far a contact point jumps along the axle when the next roller takes over, m."""
        return 2 * self.roller_axis_radius * tan(pi / self.rollers_per_wheel)


def velocity_sign(states):
    """"consistent" with the positions, or "driver_exact": fl and bl the other way round, as the youBot's driver has it.

    `states` are (positions, velocities) of the four wheels in order of time. None where they contradict each other,
    "still" where no wheel turns.
    """
    agree = [0.0] * 4
    for (before, _), (after, velocity) in zip(states, states[1:]):
        for i in range(4):
            agree[i] += (after[i] - before[i]) * velocity[i]
    if not any(agree):
        return "still"
    left, right = [[a for a, is_left in zip(agree, LEFT) if is_left == side] for side in (True, False)]
    if min(right) > 0 and min(left) > 0:
        return "consistent"
    return "driver_exact" if min(right) > 0 and max(left) < 0 else None


def sign_factors(sign):
    """What makes velocities and efforts positive forward on all four wheels."""
    return tuple(-1 if is_left and sign == "driver_exact" else 1 for is_left in LEFT)
