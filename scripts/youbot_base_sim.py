"""Lets the programs beside it import the package of src/ without catkin; in devel and install space they import
catkin's. Their interpreter is the system's, whatever comes first in PATH: ROS's modules lie there."""
from pathlib import Path

__path__ = [str(Path(__file__).resolve().parent.parent / "src" / "youbot_base_sim")]
