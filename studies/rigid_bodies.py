"""Error against run time of Case 2's first 10 s from rest, by this package and by the Open Dynamics Engine with a body for
each roller, then V_Y and Omega of three other bases by both: prints Markdown tables in a minute. Builds what it needs in build/bench/ and installs ODE if it is missing."""
import subprocess

from youbot_base_sim.command_line import Parser
from .builds import ROOT, build


def main():
    Parser("rigid_bodies", __doc__, "").parse_args()
    program, = build("rigid_bodies", packages=("libode-dev",))
    robots = [ROOT / "config" / "robots" / f"{name}.yaml" for name in ("kuka_youbot", "nexus_4wd", "fuji_fm202")]
    subprocess.run([program, ROOT / "config" / "scenes" / "case2.yaml", *robots], check=True)
