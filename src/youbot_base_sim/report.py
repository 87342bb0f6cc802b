"""Tables as CSV and Markdown, and tables of what runs were found to do: programs write them into pages of docs/, tests
measure them anew."""
import csv
import io
import re
import string
from dataclasses import dataclass

from .files import write_whole

NUMBER = r"[-+]?\d+(?:\.\d+)?"
# Units of the last digit that a printed number may be off: half for rounding, and what machines differ by.
ROUNDED = 0.6


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|", *("| " + " | ".join(row) + " |" for row in rows)]
    return "\n".join(lines) + "\n"


def csv_text(columns, rows, form=lambda value: "" if value != value else repr(value)):
    """A table in CSV with one line of names. `form` writes floats: by default so that they read back to the same value,
    and empty where they are not a number."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([form(cell) if isinstance(cell, float) else cell for cell in row] for row in rows)
    return text.getvalue()


@dataclass
class Finding:
    """`text` has a field of str.format for each of `values`; `same`: whether it is the claim, yes, no or in part."""

    same: str
    text: str
    values: list

    def measured(self):
        return self.text.format(*self.values)

    def fields(self):
        """(literal, name, spec) of each part of the text."""
        return [(literal, name, spec) for literal, name, spec, _ in string.Formatter().parse(self.text)]

    def specs(self):
        return [spec for _, name, spec in self.fields() if name is not None]

    def printed(self):
        """How each value is printed."""
        return [format(value, spec) for value, spec in zip(self.values, self.specs())]

    def agrees(self, printed):
        """Whether that text has all numbers of this one, with as many decimals and of the same value."""
        match = re.fullmatch("".join(re.escape(literal) + (f"({NUMBER})" if name is not None else "")
                                     for literal, name, _ in self.fields()), printed)
        if not match:
            return False
        for text, value, own in zip(match.groups(), self.values, self.printed()):
            decimals = len(own.partition(".")[2])
            if len(text.partition(".")[2]) != decimals or abs(float(text) - value) > ROUNDED * 10 ** -decimals:
                return False
        return True


class FindingsTable:
    """A table that `script` writes into a page, between two comments. Its rows are lists of cells, one of them what was
    measured."""

    END = "<!-- End of the table -->"

    def __init__(self, page, script, columns):
        self.page, self.columns = page, columns
        self.begin = f"<!-- The table that {script} writes -->"

    def text(self, rows):
        """In Markdown."""
        return table(self.columns, rows)

    def write(self, rows):
        before, _, after = self.parts(self.page.read_text())
        write_whole(self.page, f"{before}{self.begin}\n{self.text(rows)}{self.END}{after}")

    def parts(self, page):
        """The text of a page before the table, of it, and after it."""
        before, _, rest = page.partition(self.begin)
        table, _, after = rest.partition(self.END)
        return before, table, after

    def wrong_rows(self, page, rows, findings):
        """Numbers, from 1, of the rows in the text of a page that are missing or not what was found; 0 for what is not
        the table's."""
        shown = [line.strip("| ").split(" | ") for line in self.parts(page)[1].strip().split("\n")[2:]]
        wrong = [0] if len(shown) != len(rows) else []
        for number, (expected, finding) in enumerate(zip(rows, findings), 1):
            found = shown[number - 1] if number <= len(shown) else []
            measured = expected.index(finding.measured())
            if not (len(found) == len(expected) and finding.agrees(found[measured]) and
                    found[:measured] + found[measured + 1:] == expected[:measured] + expected[measured + 1:]):
                wrong.append(number)
        return wrong
