"""Counts the instructions of each model, output and feature per simulated second of the paper's cases, and prints them
as Markdown tables: those of a long run less those of a short one. Builds what it needs in build/bench_ros/ and installs
valgrind and PyYAML if they are missing. Needs no ROS master.
"""
import json
import re
import subprocess
import tempfile
from functools import partial
from pathlib import Path

from youbot_base_sim.command_line import Failed, Parser
from .builds import ROOT, build
from .pages import table

SHORT, LONG = 1.0, 4.0  # s of simulated time
MODELS = {"no_slip": "1", "viscous": "2a", "coulomb": "2b"}
REACTIONS = {"normal_reactions": "dynamic", "com_height": 0.034}
BEYOND = {  # sections of a scene, each with the keys that a feature takes
    "friction of each wheel": {"floor": {"friction": [0.5, 0.45, 0.5, 0.55]}},
    "slope of 1 degree": {"floor": {"slope": {"angle": 0.0175, "uphill": 0.5}}},
    "wet patch": {"floor": {"patches": [{"rectangle": [2.2, 0.5, 2.8, 1.0], "friction": 0.2}]}},
    "dynamic normal reactions": {"robot": REACTIONS},
    "the same, rocking front axle": {"robot": {**REACTIONS, "load_sharing": "rocking_front"}},
    "load of 10 kg": {"loads": [{"mass": 10, "position": [0.1, 0, 0.15]}]},
    "push of 5 N": {"wrenches": [{"force": [5, 0, 0], "point": [0, 0, 0.1]}]},
    "spin friction, 1 mm": {"floor": {"spin_radius": 0.001}},
    "dry friction of drive trains and rollers": {"robot": {"dry_friction": 0.18, "roller_dry_friction": 0.073}},
}


def together():
    """All features at once."""
    sections = {}
    for section, keys in (item for feature in BEYOND.values() for item in feature.items()):
        sections[section] = {**sections.get(section, {}), **keys} if isinstance(keys, dict) else keys
    return sections


def instructions(command):
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *map(str, command)]
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    collected = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not collected:
        raise Failed(f"{' '.join(command)} failed:\n{done.stderr}")
    return int(collected[1])


def per_second(folder, case, program, *options, sections=(), output_rate=100.0):
    """Instructions of `program SCENE OPTION...` per simulated second of a case with these sections added."""
    import yaml  # with what has been installed
    keys = yaml.safe_load((ROOT / "config" / "scenes" / f"{case}.yaml").read_text())
    counts = []
    for duration in (SHORT, LONG):
        scene = folder / "scene.yaml"
        scene.write_text(json.dumps({**keys, **dict(sections), "duration": duration, "output_rate": output_rate}))
        counts.append(instructions([program, scene, *options]))
    return (counts[1] - counts[0]) / (LONG - SHORT)


def main():
    Parser("feature_cost", __doc__, "", "> feature_cost.md").parse_args()
    simulate, bare_loop = build("simulate", "bare_loop", packages=["valgrind", "python3-yaml"], ros=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        case1, case2 = (partial(per_second, folder, case) for case in ("case1_counter_clockwise", "case2"))
        print(f"Instructions (callgrind) per simulated second: a run of {LONG:g} s less one of {SHORT:g} s.\n")
        print(table(["model, Case 2", "instructions"], [
            [f"{model} ({name})", f"{case2(simulate, '--quiet', '--model', model) / 1e6:.4g} M"]
            for model, name in MODELS.items()]))
        paper = [count(simulate, "--quiet") for count in (case1, case2)]
        print(table(["over the paper's", "Case 1", "Case 2"], [
            [feature, *(f"{count(simulate, '--quiet', sections=sections) / own:.2f}"
                        for count, own in zip((case1, case2), paper))]
            for feature, sections in {**BEYOND, "all, with the rocking axle": together()}.items()]))
        for rate in (100.0, 1000.0):
            bare = case2(bare_loop, output_rate=rate)
            outputs = {"none": [], **{f"--{option}": [f"--{option}", folder / f"out.{option}"]
                                      for option in ("csv", "switches", "summary", "bag")}}
            print(table([f"simulate, Case 2, {rate:g} rows a second", "more than a bare loop"], [
                [output, f"{100 * (case2(simulate, '--quiet', *options, output_rate=rate) / bare - 1):+.2f} %"]
                for output, options in outputs.items()]))
