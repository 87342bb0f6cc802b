"""The fence of docs/architecture.md: which room may include which, and how many lines each part has room for. Usage:
fence_test.py [ROOT]"""
import re
import sys
import unittest
from pathlib import Path

ROOT = Path(sys.argv.pop() if len(sys.argv) > 1 and Path(sys.argv[-1]).is_dir() else __file__).resolve()
ROOT = ROOT if ROOT.is_dir() else ROOT.parents[1]
CODE = {".h", ".cpp", ".py"}


def table(heading):
    """Rows of the table whose first column has this heading, as lists of cells."""
    lines = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8").splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith(f"| {heading} |")) + 2
    for line in lines[start:]:
        if not line.startswith("|"):
            return
        yield [cell.strip() for cell in line.strip("|").split("|")]


def quoted(cell):
    return re.findall(r"`([^`]+)`", cell)


def files():
    folders = ("include", "src", "tools", "studies", "test")
    return sorted(path.relative_to(ROOT) for top in folders for path in (ROOT / top).rglob("*")
                  if path.suffix in CODE and path.is_file())


def part_of(path):
    """The part whose place is the longest beginning of the path; tests stand in a folder of that name anywhere."""
    if "test" in path.parts[:-1]:
        return "tests"
    places = [(place, name) for name, place_cell, *_ in table("part") for place in quoted(place_cell)
              if str(path).startswith(place)]
    return max(places, key=lambda place: len(place[0]))[1] if places else None


def room_of(path):
    """The first folder or the file below include/youbot_base_sim, src or tools."""
    parts = path.with_suffix("").parts
    if parts[0] == "tools":
        return parts[1]
    return parts[2] if parts[0] == "include" else parts[1]


class Fence(unittest.TestCase):
    def test_lines_of_each_part(self):
        lines = {}
        for path in files():
            part = part_of(path)
            if part:
                lines[part] = lines.get(part, 0) + (ROOT / path).read_bytes().count(b"\n")
        allowed = {name: int(most.replace(",", "")) for name, _, _, most in table("part")}
        self.assertEqual(set(lines), set(allowed))
        for part, most in allowed.items():
            with self.subTest(part=part):
                self.assertLessEqual(lines[part], most, f"{part} has {lines[part]} lines; must have at most {most}")

    def test_includes_of_each_room(self):
        sources = [path for path in files() if path.parts[0] in ("include", "src", "tools")
                   and "test" not in path.parts and path.suffix != ".py"]
        core = {room_of(path) for path in sources if part_of(path) == "core"}
        allowed = {}
        for names, _, may in table("room"):
            rooms = {*quoted(names), "export", *quoted(may)}
            allowed.update(dict.fromkeys(quoted(names), rooms | core if "core" in rooms else rooms))
        for path in sources:
            room = room_of(path)
            self.assertIn(room, allowed, f"{path}: docs/architecture.md does not name the room")
            for included in re.findall(r'#include "youbot_base_sim/([^"]+)\.h"', (ROOT / path).read_text("utf-8")):
                with self.subTest(path=str(path), included=included):
                    self.assertIn(included.partition("/")[0], allowed[room])

    def test_python_of_users_does_not_need_studies(self):
        for path in files():
            if path.parts[:2] == ("src", "youbot_base_sim"):
                self.assertNotRegex((ROOT / path).read_text("utf-8"), r"(?m)^\s*(from|import) studies", str(path))

    def test_cmake_of_core_and_node_names_no_tool(self):
        tools = [path.name for path in (ROOT / "tools").iterdir() if path.is_dir()]
        for path in (ROOT / "src").rglob("CMakeLists.txt"):
            for tool in tools:
                self.assertNotRegex(path.read_text("utf-8"), rf"\b{tool}\b", str(path))
        self.assertNotRegex((ROOT / "src" / "CMakeLists.txt").read_text("utf-8"), "catkin_LIBRARIES|youbot_base_sim_ros")
        self.assertLessEqual(len((ROOT / "CMakeLists.txt").read_text("utf-8").splitlines()), 120)


if __name__ == "__main__":
    unittest.main()
