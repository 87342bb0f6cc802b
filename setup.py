from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["youbot_base_sim", "youbot_base_sim.analysis"], package_dir={"": "src"}))
