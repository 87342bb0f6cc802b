"""The programs of scripts/, whose names have no ending, as modules that a test may look into."""
import importlib.util
import os
import sys
from importlib.machinery import SourceFileLoader

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def load_script(name):
    """Path and module of scripts/NAME."""
    path = os.path.join(ROOT, "scripts", name)
    sys.dont_write_bytecode = True
    loader = SourceFileLoader(name + "_script", path)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return path, module
