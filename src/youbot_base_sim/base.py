"""The base: wheels, size and the kinematics of ideal Mecanum wheels. Arrays over wheels have the order of WHEELS."""
from dataclasses import dataclass
from math import pi, radians, tan

WHEELS = ("fl", "fr", "bl", "br")
JOINTS = tuple("wheel_joint_" + wheel for wheel in WHEELS)
DRIVER_RADIUS = 0.0475  # of the wheels, as the youBot's driver has it, m


@dataclass
class Base:
    """The size of a base; the defaults are the youBot's, those of a scene without section `robot`."""
    wheel_radius: float = 0.05          # R, m
    roller_axis_radius: float = 0.0355  # R_d, m
    half_wheelbase: float = 0.235       # h, m
    half_track: float = 0.15            # l, m
    rollers_per_wheel: int = 6          # n
    roller_angle: float = 45.0          # degrees; negative: the O-configuration
    joints: tuple = JOINTS              # names in joint_states
    turns: tuple = (1, 1, 1, 1)         # rad forward for one unit of their positions

    @property
    def tau(self):
        """The tangent of the rollers' angle: by it lateral motion turns the wheels."""
        return 1 if self.roller_angle == 45 else tan(radians(self.roller_angle))

    @property
    def half_lengths(self):
        """h + l, or tau h + l: by it the yaw rate turns the wheels, m."""
        return self.tau * self.half_wheelbase + self.half_track

    def rolling_rates(self, V_X, V_Y, Omega):
        """Rates (rad/s) of the four wheels that roll at these velocities (m/s, rad/s), numbers or arrays."""
        turn, V_Y = self.half_lengths * Omega, self.tau * V_Y
        return [speed / self.wheel_radius
                for speed in (V_X - V_Y - turn, V_X + V_Y + turn, V_X + V_Y - turn, V_X - V_Y + turn)]

    def velocities(self, rates):
        """V_X, V_Y and Omega that wheels of these rates, (n, 4), roll; where they contradict, by least squares."""
        fl, fr, bl, br = self.wheel_radius / 4 * rates.T
        return fl + fr + bl + br, (-fl + fr + bl - br) / self.tau, (-fl + fr - bl + br) / self.half_lengths

    def contradiction(self, rates):
        """Speed (m/s) of the rims at which wheels of these rates, (n, 4), work against each other: they slip."""
        return self.wheel_radius / 4 * (rates @ (1, 1, -1, -1))

    def jump_of_offset(self):
        """How far a contact point jumps along the axle when the next roller takes over, m."""
        return 2 * self.roller_axis_radius * tan(pi / self.rollers_per_wheel) * abs(self.tau)
