#!/usr/bin/python3
"""A controller in the loop: LQR on the error from a circle, over the wheels' torques, with numpy alone. Prints how far
the base strays from the path, without feedback and with it."""
import numpy as np
from youbot_base_sim import Simulation

PERIOD, RADIUS, SPEED = 0.01, 0.6, 0.3  # s, m, m/s
MASS, INERTIA, WHEEL_RADIUS, LEVER = 35.0, 1.5, 0.05, 0.38  # kg, kg m^2, m, m: rough ones will do
# Wheel torques to force and moment on the base: each rim pushes along its roller's axis.
TO_FORCE = np.array([[1, 1, 1, 1], [-1, 1, 1, -1], [-LEVER, LEVER, -LEVER, LEVER]]) / WHEEL_RADIUS


def gain():
    """Feedback of a double integrator in x, y and heading: the Riccati equation, iterated to its fixed point."""
    a = np.block([[np.eye(3), PERIOD * np.eye(3)], [np.zeros((3, 3)), np.eye(3)]])
    b = np.vstack([np.zeros((3, 3)), PERIOD * np.diag([1 / MASS, 1 / MASS, 1 / INERTIA])])
    q, r = np.diag([1e7, 1e7, 1e6, 1e4, 1e4, 1e3]), np.eye(3)
    p = q
    for _ in range(5000):
        k = np.linalg.solve(r + b.T @ p @ b, b.T @ p @ a)
        p = q + a.T @ p @ (a - b @ k)
    return k


def strayed(k):
    """Largest distance from the circle's point of the time, m, over one turn with feedback k."""
    scene = {"duration": 20, "solver": {"control_period": PERIOD}, "initial": {"twist": [SPEED, 0, 0]}}
    simulation = Simulation(scene)
    rate, largest = SPEED / RADIUS, 0.0
    simulation.set_state([0, 0, 0], [SPEED, 0, rate])
    while simulation.t < 2 * np.pi / rate:
        state, angle = simulation.state, rate * simulation.t
        wanted = RADIUS * np.array([np.sin(angle), 1 - np.cos(angle)])
        c, s = np.cos(state["psi"]), np.sin(state["psi"])
        to_platform = np.array([[c, s], [-s, c]])
        error = to_platform @ (wanted - [state["x"], state["y"]])
        velocity = np.array([SPEED - state["V_X"], -state["V_Y"], rate - state["Omega"]])
        force = k @ np.concatenate([error, [angle - state["psi"]], velocity])
        force[1] += MASS * SPEED * rate  # towards the centre
        simulation.step(np.linalg.pinv(TO_FORCE) @ force)
        largest = max(largest, np.hypot(*error))
    return largest


if __name__ == "__main__":
    print(f"without feedback {strayed(np.zeros((3, 6))):.3f} m, with LQR {strayed(gain()):.3f} m")
