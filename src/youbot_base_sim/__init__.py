"""Simulation, Batch, run, simulate_many: the simulator (docs/python.md). The modules: `main` of each program of scripts/ in Python."""


def __getattr__(name):
    if name not in ("Simulation", "Batch", "run", "simulate_many"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return getattr(__import__(f"{__name__}._simulator", fromlist=[name]), name)
    except ImportError as error:
        raise ImportError(f"{name}: the extension was not built for this Python (docs/python.md): {error}") from error
