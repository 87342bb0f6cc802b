"""Runs `simulate` on all of config/scenes, or with --stress on the motions of scripts/study stress, and compares what it
writes with a table of hashes, which holds for every compiler, option and processor. With --write makes the table."""
import argparse
import hashlib
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "test" / "data" / "same_bits"


def scenes():
    """Names, which are the arguments of `simulate`, and what these are once more."""
    names = [f"config/scenes/{path.name}" for path in sorted((ROOT / "config" / "scenes").glob("*.yaml"))]
    names += [f"config/scenes/{name}" for name in
              ("case2.yaml --model viscous", "case2.yaml --model no_slip", "case2.yaml --relative-tolerance 1e-10",
               "demo.yaml --model viscous", "demo.yaml --model no_slip", "start_and_stop.yaml --model no_slip")]
    names += ["test/data/same_bits/waves.yaml", "test/fuzz/scene/every_key.yaml --method radau"]
    return [(name, name.split()) for name in names]


def stress_scenes(folder):
    """The same of the stress suite, whose scenes it writes to a folder."""
    sys.path[:0] = [str(ROOT), str(ROOT / "src")]
    from studies.stress_cells import stress_cells
    for cell in stress_cells():
        path = folder / f"{cell.group}_{cell.name}.yaml"
        path.write_text(cell.yaml(), encoding="utf-8")
        if cell.table:
            path.with_suffix(".csv").write_text(cell.table, encoding="utf-8")
        yield cell.full_name, [path]


def line(simulate, name, scene, folder):
    """Hashes of a scene's rows and switches, those of a motion that ends early too, and the base's last pose."""
    subprocess.run([simulate, *scene, "--quiet", "--csv", folder / "rows", "--switches", folder / "switches"],
                   cwd=ROOT, check=False, stderr=subprocess.DEVNULL)
    hashes, last = [], ""
    for kind in ("rows", "switches"):
        text = b""
        for written in folder.glob(kind + "*"):
            text = written.read_bytes()
            written.unlink()
        hashes.append(hashlib.sha256(text).hexdigest()[:16])
        last = last or ",".join(text.decode().splitlines()[-1:])
    return "  ".join((name, *hashes, ",".join(last.split(",")[:4])))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("simulate", type=Path)
    parser.add_argument("--stress", action="store_true")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    table = DATA / ("stress.txt" if arguments.stress else "scenes.txt")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (scratch := folder / "written").mkdir()
        all_scenes = stress_scenes(folder) if arguments.stress else scenes()
        lines = [line(arguments.simulate.resolve(), *scene, scratch) for scene in all_scenes]
    if arguments.write:
        table.write_text("\n".join(lines) + "\n", encoding="utf-8")
    expected = table.read_text(encoding="utf-8").splitlines()
    other = [pair for pair in zip(expected, lines) if pair[0] != pair[1]]
    for pair in other:
        print("expected {}\nbut got  {}".format(*pair))
    print(f"{len(lines) - len(other)} of {len(expected)} motions have the bits of {table.name}")
    return int(other != [] or len(lines) != len(expected))


if __name__ == "__main__":
    sys.exit(main())
