"""The base: wheels, size and the kinematics of ideal Mecanum wheels. Arrays over wheels have the order of WHEELS."""
from dataclasses import dataclass

import numpy as np

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
    roller_angle: float = 45.0          # degrees, of all wheels or of each; negative: the O-configuration
    joints: tuple = JOINTS              # names in joint_states
    turns: tuple = (1, 1, 1, 1)         # rad forward for one unit of their positions

    def rates_by_velocity(self):
        """The matrix (4, 3) that makes wheel rates (rad/s) of V_X, V_Y, Omega (m/s, rad/s) of a base that rolls."""
        angles, h, l = np.broadcast_to(self.roller_angle, 4), self.half_wheelbase, self.half_track
        tan_delta = (-1, 1, 1, -1) * np.where(angles == 45, 1, np.tan(np.radians(angles)))
        return np.transpose([np.ones(4), tan_delta, tan_delta * (h, h, -h, -h) - (l, -l, l, -l)]) / self.wheel_radius

    @property
    def half_lengths(self):
        """l + h, or l + h tan(roller_angle): by it the yaw rate turns the wheels, m; of different angles the mean."""
        return float(self.rates_by_velocity()[:, 2] @ (-1, 1, -1, 1)) * self.wheel_radius / 4

    def rolling_rates(self, V_X, V_Y, Omega):
        """Rates (rad/s) of the four wheels that roll at these velocities (m/s, rad/s), numbers or arrays."""
        return [X * V_X + Y * V_Y + turn * Omega for X, Y, turn in self.rates_by_velocity().tolist()]

    def velocities(self, rates):
        """V_X, V_Y and Omega that wheels of these rates, (n, 4), roll; where they contradict, by least squares."""
        return tuple((rates @ np.linalg.pinv(self.rates_by_velocity()).T).T)

    def contradiction(self, rates):
        """Speed (m/s) of the rims at which wheels of these rates, (n, 4), work against each other: they slip."""
        return self.wheel_radius / 2 * (rates @ np.linalg.svd(self.rates_by_velocity())[0][:, 3])  # 0.5 (1, 1, -1, -1)

    def jump_of_offset(self):
        """How far a contact point jumps along the axle when the next roller takes over, m; the largest of all wheels."""
        tangent = self.wheel_radius * float(np.abs(self.rates_by_velocity()[:, 1]).max())
        return 2 * self.roller_axis_radius * np.tan(np.pi / self.rollers_per_wheel) * tangent
