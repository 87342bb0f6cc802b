#!/usr/bin/python3
"""Estimation beside the truth: an extended Kalman filter of pose and velocity on coarse encoders of the wheels, and odometry
from the same encoders. Prints how far both are from the simulated truth."""
import numpy as np
from youbot_base_sim import Simulation

PERIOD, DURATION = 0.01, 10.0  # s
TICKS = 250  # of an encoder, a turn of the wheel
WHEEL_RADIUS, LEVER = 0.05, 0.38  # m
RATES = np.array([[1, -1, -LEVER], [1, 1, LEVER], [1, 1, -LEVER], [1, -1, LEVER]]) / WHEEL_RADIUS  # of (V_X, V_Y, Omega)


def moved(pose, velocity):
    """The pose after a period with this velocity in the platform's frame, and its derivative by the heading."""
    dx, dy, dpsi = PERIOD * velocity
    c, s = np.cos(pose[2] + dpsi / 2), np.sin(pose[2] + dpsi / 2)
    return pose + [c * dx - s * dy, s * dx + c * dy, dpsi], np.array([-s * dx - c * dy, c * dx - s * dy])


class Filter:
    """State: x, y, psi; V_X, V_Y, Omega, the means over a period."""

    CHANGES = np.diag([0.01, 0.01, 0.03]) ** 2  # of velocity from period to period, m/s and rad/s
    ENCODERS = np.eye(4) * (2 * np.pi / TICKS / PERIOD) ** 2 / 6  # of the rounding of two readings, (rad/s)^2

    def __init__(self):
        self.x, self.P = np.zeros(6), np.zeros((6, 6))

    def update(self, rates):
        """After a period in which the encoders turned at these mean rates, rad/s."""
        F = np.eye(6)
        self.x[:3], F[:2, 2] = moved(self.x[:3], self.x[3:])
        c, s = np.cos(self.x[2]), np.sin(self.x[2])
        F[:3, 3:] = PERIOD * np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        G = np.vstack([F[:3, 3:], np.eye(3)])
        self.P = F @ self.P @ F.T + G @ self.CHANGES @ G.T
        H = np.hstack([np.zeros((4, 3)), RATES])
        K = np.linalg.solve(H @ self.P @ H.T + self.ENCODERS, H @ self.P).T
        self.x += K @ (rates - H @ self.x)
        self.P -= K @ H @ self.P


simulation = Simulation({"duration": DURATION, "solver": {"control_period": PERIOD}, "robot": {"profile": "measured"}})
truth, estimate, odometry = simulation.state, Filter(), np.zeros(3)
ticks = np.round(truth["phi"] * TICKS / (2 * np.pi))
errors = []
while simulation.t < DURATION:
    simulation.step(1.2 * np.sin(2 * np.pi * simulation.t / 5 + np.array([0, 0.5, 1, 1.5])))
    before, ticks = ticks, np.round(truth["phi"] * TICKS / (2 * np.pi))
    rates = (ticks - before) * 2 * np.pi / TICKS / PERIOD
    estimate.update(rates)
    odometry, _ = moved(odometry, np.linalg.pinv(RATES) @ rates)
    place = np.array([truth["x"], truth["y"]])
    velocity = np.array([truth["V_X"], truth["V_Y"], truth["Omega"]])
    errors.append([np.hypot(*(each[:2] - place)) for each in (estimate.x, odometry)]
                  + [np.abs(each - velocity).max() for each in (estimate.x[3:], np.linalg.pinv(RATES) @ rates)])
position, by_odometry, velocity, by_rates = np.sqrt(np.mean(np.square(errors), axis=0))
print(f"root mean square errors: velocity {velocity:.4f} with the filter, {by_rates:.4f} from encoders alone (m/s, rad/s); "
      f"position {position:.4f} m, {by_odometry:.4f} m by odometry")
