"""Error against run time of Case 2's first 10 s from rest, by this package and by the Open Dynamics Engine with a body for
each roller: prints a Markdown table in a minute. Builds what it needs in build/bench/ and installs ODE if it is missing."""
import subprocess

from youbot_base_sim.command_line import Parser
from .builds import ROOT, build


def main():
    Parser("rigid_bodies", __doc__, "").parse_args()
    program, = build("rigid_bodies", packages=("libode-dev",))
    subprocess.run([program, ROOT / "config" / "scenes" / "case2.yaml"], check=True)
