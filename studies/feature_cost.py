"""Counts the instructions of each model, output and feature per simulated second of the paper's Case 2, and prints them
as Markdown tables: those of a long run less those of a short one. Builds what it needs in build/bench_ros/ and installs
valgrind and PyYAML if they are missing. Needs no ROS master.
"""
import json
import re
import subprocess
import tempfile
from pathlib import Path

from youbot_base_sim.command_line import Failed, Parser
from .builds import ROOT, build
from .pages import table

SHORT, LONG = 1.0, 4.0  # s of simulated time
RUNS = 10  # of which the quickest counts
MODELS = {"no_slip": "1", "viscous": "2a", "coulomb": "2b"}
REACTIONS = {"normal_reactions": "dynamic", "com_height": 0.034}
BEYOND = {  # sections of a scene, each with the keys that a feature takes
    "friction of each wheel": {"floor": {"friction": [0.5, 0.45, 0.5, 0.55]}},
    "slope of 1 degree": {"floor": {"slope": {"angle": 0.0175, "uphill": 0.5}}},
    "wet patch": {"floor": {"patches": [{"rectangle": [2.2, 0.5, 2.8, 1.0], "friction": 0.2}]}},
    "dynamic normal reactions": {"robot": REACTIONS},
    "the same, diagonal preload of 10 N": {"robot": {**REACTIONS, "diagonal_preload": 10}},
    "the same, rocking front axle": {"robot": {**REACTIONS, "load_sharing": "rocking_front"}},
    "load of 10 kg": {"loads": [{"mass": 10, "position": [0.1, 0, 0.15]}]},
    "push of 5 N": {"wrenches": [{"force": [5, 0, 0], "point": [0, 0, 0.1]}]},
    "spin friction, 1 mm": {"floor": {"spin_radius": 0.001}},
    "dry friction of drive trains and rollers": {"robot": {"dry_friction": 0.18, "roller_dry_friction": 0.073}},
}


def all_but(word):
    """All features together but those whose name has the word: a preload and a rocking axle exclude each other."""
    sections = {}
    for section, keys in (item for name, feature in BEYOND.items() if word not in name for item in feature.items()):
        sections[section] = {**sections.get(section, {}), **keys} if isinstance(keys, dict) else keys
    return sections


class Counter:
    """Instructions of a program per simulated second of a case of the paper."""

    def __init__(self, folder, case="case2"):
        import yaml  # with what has been installed
        self.folder, self.case = folder, ROOT / "config" / "scenes" / f"{case}.yaml"
        self.keys = yaml.safe_load(self.case.read_text())
        self.sections = {}  # added to it

    def scene(self, duration, output_rate=100.0):
        path = self.folder / f"scene_{duration:g}_{output_rate:g}.yaml"
        path.write_text(json.dumps({**self.keys, **self.sections, "duration": duration, "output_rate": output_rate}))
        return path

    def instructions(self, command):
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *map(str, command)]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        collected = re.search(r"Collected : (\d+)", done.stderr)
        if done.returncode or not collected:
            raise Failed(f"{' '.join(command)} failed:\n{done.stderr}")
        return int(collected[1])

    def per_second(self, command, output_rate=100.0):
        """`command` has SCENE where the scene's file name goes."""
        short, long = (self.instructions([self.scene(duration, output_rate) if word == "SCENE" else word
                                          for word in command]) for duration in (SHORT, LONG))
        return (long - short) / (LONG - SHORT)

    def summary(self, simulate, scene, *options):
        return json.loads(subprocess.check_output([simulate, scene, *options, "--quiet", "--summary", "/dev/stdout"]))

    def real_time(self, simulate):
        """How many times as fast as real time the whole of the paper's case runs, at its best of several runs."""
        summaries = [self.summary(simulate, self.case) for _ in range(RUNS)]
        return max(one["simulated_time"] / one["cpu_time"] for one in summaries)

    def steps(self, simulate, model):
        """Per simulated second: accepted steps, tried steps, and Newton iterations."""
        sums = []
        for duration in (SHORT, LONG):
            numbers = self.summary(simulate, self.scene(duration), "--model", model)
            sums.append((numbers["steps"], sum(v for k, v in numbers.items() if k.endswith("steps")),
                         numbers["newton_iterations"]))
        return [(long - short) / (LONG - SHORT) for short, long in zip(*sums)]


def models(counter, simulate):
    rows = []
    for model, name in MODELS.items():
        count = counter.per_second([simulate, "SCENE", "--quiet", "--model", model])
        accepted, tried, _ = counter.steps(simulate, model)
        rows.append([f"{model} ({name})", f"{count / 1e6:.4g} M", f"{accepted:.0f}", f"{tried:.0f}",
                     f"{count / tried:.0f}"])
    head = ["model", "instructions per second", "steps", "steps tried", "instructions per step tried"]
    return ("\n## Models\n\n`simulate --quiet` without outputs, 100 rows a second; per simulated second.\n\n"
            f"{table(head, rows)}")


def beyond(counter, simulate, title):
    real_time = counter.real_time(simulate)
    rows, paper = [], None
    for name, sections in {"the paper": {}, **BEYOND, "all, with the preload": all_but("rocking"),
                           "all, with the rocking axle": all_but("preload")}.items():
        counter.sections = sections
        count = counter.per_second([simulate, "SCENE", "--quiet"])
        paper = paper or count
        _, tried, iterations = counter.steps(simulate, "coulomb")
        rows.append([name, f"{count / 1e6:.3g} M", f"{count / paper:.2f}", f"{tried:.0f}", f"{iterations / tried:.2f}",
                     f"{real_time * paper / count:.0f}"])
    counter.sections = {}
    head = [f"in {title}", "instructions per second", "ratio to the paper's", "steps tried per second",
            "Newton iterations per step", "times real time"]
    return f"\n## Beyond the paper, {title}, model 2b\n\n{table(head, rows)}"


def features(title, what, commands, counter, output_rate=100.0):
    """A table of features, by their names: each beside the first, which has none of them."""
    counts = [counter.per_second(command, output_rate) for command in commands.values()]
    rows = [[name, f"{count / 1e6:.4g} M", f"{100 * (count / counts[0] - 1):+.2f} %"]
            for name, count in zip(commands, counts)]
    return f"\n## {title}\n\n{table([what, 'instructions per second', 'more than bare'], rows)}"


def outputs(counter, simulate, bench, rate):
    command = [simulate, "SCENE", "--quiet"]
    return features(f"Outputs of simulate, model 2b, {rate:g} rows a second", "outputs", {
        "a bare loop around Simulation::advance_to": [bench, "rows", "SCENE"],
        "simulate --quiet: none": command,
        **{f"--{option}": [*command, f"--{option}", counter.folder / f"out.{option}"]
           for option in ("csv", "switches", "summary", "bag")}}, counter, rate)


def node(counter, bench):
    def run(rate, rollers="", bag="", listened=""):
        return [bench, "node", "SCENE", rate, bag, rollers, listened]

    bag = counter.folder / "node.bag"
    return features("The node, model 2b, control period 1 ms", "topics with a subscriber", {
        "Simulation::step alone, driven alike": [bench, "periods", "SCENE"],
        "none, 50 Hz": run(50), "none, 50 Hz, publish_rollers": run(50, "rollers"), "none, 1000 Hz": run(1000),
        **{f"all, {rate} Hz{f', publish_{rollers}' if rollers else ''}": run(rate, rollers, listened="all")
           for rate in (50, 1000) for rollers in ("", "rollers")},
        "none, 50 Hz, bag": run(50, bag=bag), "none, 50 Hz, bag, publish_rollers": run(50, "rollers", bag),
        "none, 1000 Hz, bag": run(1000, bag=bag)}, counter)


def sections(simulate, bench):
    yield ("# What each feature costs\n\nInstructions (callgrind) per simulated second of Case 2: a run of "
           f"{LONG:g} s less one of {SHORT:g} s. Times real time: the ratio of instructions, applied to what the\n"
           "paper's case takes here.\n")
    with tempfile.TemporaryDirectory() as folder:
        counter = Counter(Path(folder))
        yield models(counter, simulate)
        yield beyond(Counter(Path(folder), "case1_counter_clockwise"), simulate, "Case 1")
        yield beyond(counter, simulate, "Case 2")
        for rate in (100.0, 1000.0):
            yield outputs(counter, simulate, bench, rate)
        yield node(counter, bench)


def main():
    Parser("feature_cost", __doc__, "", "> feature_cost.md").parse_args()
    for section in sections(*build("simulate", "feature_cost", packages=["valgrind", "python3-yaml"], ros=True)):
        print(section, end="")
