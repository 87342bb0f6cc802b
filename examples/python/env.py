#!/usr/bin/python3
"""The base as an environment for reinforcement learning, in the manner of gymnasium and without needing it: wheel
torques in, the state out. The reward is yours. Without arguments, drives by random torques for two seconds."""
import numpy as np
from youbot_base_sim import Simulation


class Env:
    """Each step holds the action, four numbers from -1 to 1, for 20 ms of simulated time."""

    MAX_TORQUE = 2.0  # N m
    PERIODS = 20  # of 1 ms
    DURATION = 10.0  # s, of an episode

    def __init__(self, reward, settings=None):
        """`reward(observation, action)` returns a number; `settings` replace values of the scene."""
        scene = {"duration": self.DURATION, "solver": {"control_period": 0.001}, "robot": {"profile": "measured"}}
        self._simulation = Simulation(scene, settings)
        self._reward = reward

    def reset(self, seed=None):
        """Starts from a random heading on random wheel angles. Returns an observation and a dict."""
        random = np.random.default_rng(seed)
        self._simulation.reset()
        self._simulation.set_state([0, 0, random.uniform(-np.pi, np.pi)], [0, 0, 0], random.uniform(0, 1, 4))
        return self._observation(), {}

    def step(self, action):
        """Returns observation, reward, whether the motion ended (the base tips over), whether time is up, and a dict."""
        torque = self.MAX_TORQUE * np.clip(action, -1, 1)
        ended = False
        try:
            self._simulation.step(torque, periods=self.PERIODS)
        except RuntimeError:
            ended = True
        observation = self._observation()
        return observation, self._reward(observation, action), ended, self._simulation.t >= self.DURATION, {}

    def _observation(self):
        """x, y (m), cos and sin of the heading, V_X, V_Y (m/s), Omega and the wheels' rates (rad/s)."""
        state = self._simulation.state
        return np.array([state["x"], state["y"], np.cos(state["psi"]), np.sin(state["psi"]), state["V_X"], state["V_Y"],
                         state["Omega"], *state["dphi"]])


if __name__ == "__main__":
    env = Env(lambda observation, action: observation[4] - 0.01 * np.square(action).sum())
    env.reset(seed=1)
    actions = np.random.default_rng(1)
    total = sum(env.step(actions.uniform(-1, 1, 4))[1] for _ in range(100))
    print(f"return {total:.2f}")
