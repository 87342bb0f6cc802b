"""Each number of integration/ and physics/ has a row in docs/tuning/*.csv, and each row a number. Usage:
tuning_test.py [ROOT]"""
import csv
import re
import sys
import unittest
from pathlib import Path

ROOT = Path(sys.argv.pop() if len(sys.argv) > 1 and Path(sys.argv[-1]).is_dir() else __file__).resolve()
ROOT = ROOT if ROOT.is_dir() else ROOT.parents[1]
# Files of given numbers only: the robot's table, a method's coefficients, series of elementary functions.
GIVEN = {"parameters.h", "parameters.cpp", "radau_tableau.h", "elementary.h", "elementary.cpp"}
PLAIN = {0.0, 0.25, 0.5, 1.0, 2.0}  # parts of formulas
MOST = 52  # tuned numbers


def code(path):
    """The file's text without comments and strings."""
    return re.sub(r'//[^\n]*|"[^"\n]*"', "", path.read_text(encoding="utf-8"))


def numbers(text):
    """Names of constants and options with a number of their own, and floating-point literals elsewhere."""
    number = r"(?:[\w:]+ \? \d+ : )?-?[0-9][0-9.]*(?:e[+-]?[0-9]+)?(?: / [0-9.]+)?"
    declared = r"(?:constexpr |^  )(?:double|int|std::uint64_t|std::int64_t) ((?:\w+ = [^;,]+(?:, )?)+);"
    for declaration in re.findall(declared, text, re.M):
        for name, value in re.findall(r"(\w+) = ([^;,]+)", declaration):
            plain = not name.startswith("k") and value.strip() in ("0", "1")
            if re.fullmatch(number, value.strip()) and not plain:
                yield name
    rest = re.sub(declared, "", text, flags=re.M)
    for literal in re.findall(r"(?<![\w.])[0-9]+(?:\.[0-9]*(?:e[+-]?[0-9]+)?|e[+-]?[0-9]+)(?![\w.])", rest):
        if float(literal) not in PLAIN:
            yield literal


def found():
    folders = [ROOT / top / room for top in ("include/youbot_base_sim", "src") for room in ("integration", "physics")]
    return {(name, path.name) for folder in folders for path in sorted(folder.iterdir()) if path.name not in GIVEN
            for name in numbers(code(path))}


def rows(table):
    """Numbers and files of a table."""
    with open(ROOT / "docs" / "tuning" / f"{table}.csv", encoding="utf-8", newline="") as file:
        return {(row["number"], row["file"]) for row in csv.DictReader(file)}


TUNED, FIXED = rows("tuned"), rows("fixed")


class Tuning(unittest.TestCase):
    def test_each_number_has_a_row(self):
        self.assertEqual(sorted(found() - TUNED - FIXED), [], "numbers without a row in docs/tuning")

    def test_each_row_has_a_number(self):
        self.assertEqual(sorted((TUNED | FIXED) - found()), [], "rows of docs/tuning without a number")

    def test_numbers_are_few(self):
        self.assertLessEqual(len(TUNED), MOST)


if __name__ == "__main__":
    unittest.main()
