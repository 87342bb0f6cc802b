"""Lets the tests beside it import the package of src/, as the programs of scripts/ do."""
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
