"""What the tests of pages with measured tables have in common. Their first argument is the module's folder."""
import re
import string
import sys
import warnings
from pathlib import Path

import harness  # noqa: F401: finds studies
import youbot_base_sim

MODULE = Path(sys.argv.pop(1)).resolve()
youbot_base_sim.__path__.append(str(MODULE))
NUMBER = r"[-+]?\d+(?:\.\d+)?"
# Units of the last digit that a printed number may be off: half for rounding, and what machines differ by.
ROUNDED = 0.6


def printed(finding):
    """How each value of a Finding is printed."""
    specs = [spec for _, name, spec, _ in string.Formatter().parse(finding.text) if name is not None]
    return [format(value, spec) for value, spec in zip(finding.values, specs)]


def agrees(finding, text):
    """Whether a text has all numbers of this finding, with as many decimals and of the same value."""
    parts = string.Formatter().parse(finding.text)
    match = re.fullmatch("".join(re.escape(literal) + (f"({NUMBER})" if name is not None else "")
                                 for literal, name, _, _ in parts), text)
    if not match:
        return False
    for number, value, own in zip(match.groups(), finding.values, printed(finding)):
        decimals = len(own.partition(".")[2])
        if len(number.partition(".")[2]) != decimals or abs(float(number) - value) > ROUNDED * 10 ** -decimals:
            return False
    return True


class MeasuredPage:
    """Tests of a page with a table, its written `part`, and a picture for each `picture_names`: a mixin of
    unittest.TestCase, whose class measures `findings` with their `rows` of the table, without a warning."""

    @classmethod
    def setUpClass(cls):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            cls.findings, cls.rows = cls.measure()

    def test_has_every_figure(self):
        folder = self.part.page.parent
        for name in self.picture_names:
            self.assertIn(f"]({folder.name}/{name})", folder.with_suffix(".md").read_text())
            self.assertGreater((folder / name).stat().st_size, 5000)

    def page(self):
        return self.part.page.read_text()

    def wrong_rows(self, page):
        """Numbers, from 1, of the rows in the text of a page that are missing or not what was found; 0 for what is not
        the table's."""
        shown = [line.strip("| ").split(" | ") for line in self.part.parts(page)[1].strip().split("\n")[2:]]
        wrong = [0] if len(shown) != len(self.rows) else []
        for number, (expected, finding) in enumerate(zip(self.rows, self.findings), 1):
            found = shown[number - 1] if number <= len(shown) else []
            measured = expected.index(finding.measured())
            if not (len(found) == len(expected) and agrees(finding, found[measured]) and
                    found[:measured] + found[measured + 1:] == expected[:measured] + expected[measured + 1:]):
                wrong.append(number)
        return wrong

    def test_has_what_is_measured(self):
        expected = dict(enumerate(self.rows, 1))
        wrong = self.wrong_rows(self.page())
        self.assertEqual([expected.get(number, "the number of rows") for number in wrong], [])
