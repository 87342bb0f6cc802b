"""The simulator of the base (docs/python.md). SI units, angles in rad, wheels in the order fl, fr, bl, br."""
import json
import os
import warnings

import numpy as np

from . import _core

_STATE = np.dtype([*((name, "f8") for name in ("x", "y", "psi", "work", "V_X", "V_Y", "Omega", "unused")),
                   *((name, "f8", 4) for name in ("phi", "dphi", "dgamma", "gamma"))])
_ROW = np.dtype([(name, "f8") for name in ("t", "x", "y", "psi", "V_X", "V_Y", "Omega", *(
    f"{name}_{wheel}" for name in ("phi", "dphi", "dgamma") for wheel in ("fl", "fr", "bl", "br")))])
_CONTACTS = np.dtype([(name, "f8", 4) for name in ("V_PX", "V_PY", "F_X", "F_Y", "N", "f", "Delta_Y", "M_S")])
# JSON, which is YAML; numbers read back to the same double.
_yaml = json.JSONEncoder(ensure_ascii=False, default=lambda x: x.tolist() if hasattr(x, "tolist") else str(x)).encode


def _require(allowed, name, value, what):
    if not allowed:
        raise ValueError(f"{name} = {_core.shown(value)}: must be {what}")


def _count(name, value, most):
    _require(isinstance(value, (int, np.integer)) and 0 < value <= most, name, value, f"a whole number, 1 to {most}")
    return int(value)


def _source(scene, settings, *more):
    """File and settings of a scene as `Simulation` takes it. Tables of a text or a dict are in the current folder."""
    if isinstance(scene, dict) or isinstance(scene, str) and ("\n" in scene or ": " in scene):
        scene = _core.File("scene", (scene if isinstance(scene, str) else _yaml(scene)).encode())
    elif not isinstance(scene, _core.File):
        _require(isinstance(scene, (str, os.PathLike)), "scene", scene, "a file's path, YAML text or a dict")
        scene = _core.File(os.fsencode(scene))
    _require(isinstance(settings, (dict, type(None))), "settings", settings, "a dict")
    settings = [*(settings or {}).items(), *more]
    return scene, [_core.Setting(str(key).encode(), _yaml(value).encode()) for key, value in settings]


class _Runs(_core.Runs):
    state = property(lambda self: self._states(_STATE), doc=(
        "The state now, a read-only view that follows the motion; copy() keeps the present one. x, y (m) and heading psi\n"
        "(rad, unwrapped) in the fixed frame; V_X, V_Y (m/s) and Omega (rad/s) in the platform's; work (J) of all torques\n"
        "and friction; of the wheels phi (4,) rad, dphi (4,) rad/s; of the rollers in contact gamma, dgamma likewise."))
    state_vector = property(lambda self: self._states(np.dtype((float, 24))), doc="(24,) numbers of the state; a view, too.")

    def contacts(self):
        """A record of the wheels' contacts now, each field of (4,): slip V_PX, V_PY, m/s, and friction on the base F_X,
        F_Y, N, in the platform's frame (in model coulomb F = -f N V_P / sqrt(nu^2 + V_P^2)); normal reaction N, N;
        coefficient f; offset along the axle Delta_Y, m; spin friction M_S, N m."""
        return self._contacts.view(_CONTACTS)[..., 0]

    def set_loads(self, loads, keep_momentum=False):
        """Loads in place of the last, besides the scene's: a list of dicts with mass (kg), position ((3,) m), inertia (kg
        m^2). The base keeps its velocity, or its momentum."""
        drive = {"torque": [{"start": 0}]}  # the scene's may be a long table
        none = isinstance(loads, (list, tuple)) and not loads
        self._set_loads(None if none else _source(*self._given, ("drive", drive), ("loads", loads)), keep_momentum)


class Simulation(_Runs):
    """One running simulation: commands in; state, contacts and switches out.

    scene: a file's path, YAML text, or a dict with a scene's keys (docs/scenes.md). settings: values in place of the
    scene's, such as {"floor.friction": 0.3}. ValueError with the line of simulate for what it would refuse.

    The equations of motion (docs/model.md) with wheel torques M and friction forces F at the contacts:

        m_s (dV_X - Omega V_Y) - m (a_Y dOmega + a_X Omega^2) = sum F_X
        m_s (dV_Y + Omega V_X) + m (a_X dOmega - a_Y Omega^2) = sum F_Y
        I_s dOmega + m a_X (dV_Y + Omega V_X) - m a_Y (dV_X - Omega V_Y) = sum [F_Y rho_X - F_X (rho_Y + Delta_Y)]
        J_1 ddphi   = M - mu_1 dphi - R F_X
        J_2 ddgamma = -mu_2 dgamma - r sin(delta) F_X + r cos(phi~) cos(delta) F_Y

    The scene's drive acts until a torque or set points are commanded. A simulation is used in one thread at a time;
    calls that advance it release the GIL, and Ctrl-C leaves it at the time it has reached."""

    def __init__(self, scene, settings=None):
        source = _source(scene, settings)
        self._given = source[0], settings
        super().__init__([source], (), 1)

    def run(self):
        """Advances from t = 0 to the scene's duration by its drive. Returns the rows of simulate --csv, a structured
        array: t (s), the state without work and gamma, and of each wheel phi_fl and so on."""
        return self._run()[0].view(_ROW)


class Batch(_Runs):
    """n runs of a scene, on C++ threads without the GIL, with the bits of single ones. Commands and results are those
    of Simulation with a first dimension of n; a command without it serves all. Runs whose motion has ended stand still.
    threads: one on each core unless given."""

    def __init__(self, scene, n, threads=None, settings=None):
        n, source = _count("n", n, 10**6), _source(scene, settings)
        self._given, self._expanded = (source[0], settings), [()] * n
        super().__init__([source], (n,), _count("threads", threads or os.cpu_count(), 1024))

    def expand(self, key, values):
        """Gives each run a value of its own at a key of the scene, such as "floor.friction". All begin anew."""
        _require(isinstance(key, str) and not key.startswith("drive"), "key", key, "a key besides the drive's")
        n = len(self._expanded)
        _require(isinstance(values, (list, tuple, np.ndarray)) and len(values) == n, key, values, f"a list of {n} values")
        expanded = [(*items, (key, value)) for items, value in zip(self._expanded, values)]
        self._make([_source(*self._given, *items) for items in expanded])
        self._expanded = expanded


def run(scene, settings=None):
    """Simulation(scene, settings).run(): all rows of a scene."""
    return Simulation(scene, settings).run()


def simulate_many(scenes, settings=None, threads=None):
    """A list of what `run` returns of each scene, from threads as those of Batch. settings: those of all, or a list of
    dicts. Warns of a motion that ends early, with the rows until then."""
    _require(isinstance(scenes, (list, tuple)) and scenes, "scenes", scenes, "a list of at least one scene")
    settings = settings if isinstance(settings, (list, tuple)) else [settings] * len(scenes)
    _require(len(settings) == len(scenes), "settings", settings, f"a dict, or a list of {len(scenes)}")
    sources = [_source(*each) for each in zip(scenes, settings)]
    runs = _core.Runs(sources, (len(sources),), _count("threads", threads or os.cpu_count(), 1024))
    rows = [numbers.view(_ROW) for numbers in runs._run()]
    for k in np.flatnonzero(runs.ended):
        warnings.warn(f"scenes[{k}]: {runs.doubt[k]}", stacklevel=2)
    return rows
