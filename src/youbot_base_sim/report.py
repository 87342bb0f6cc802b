"""Tables as CSV and Markdown, what runs were found to do, and the parts of pages in docs/ that programs write."""
import csv
import io
import textwrap
from dataclasses import dataclass

from .command_line import Refused, shown
from .files import read_whole, write_whole

LARGEST_TABLE = 250000000  # bytes, as simulate reads


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|", *("| " + " | ".join(row) + " |" for row in rows)]
    return "\n".join(lines) + "\n"


def figures(x):
    """Three figures, without an exponent while that is short; "-" for what is not a number."""
    return "-" if x != x else f"{x:.0f}" if x >= 1000 else f"{x:.3g}"


def csv_text(columns, rows, form=lambda value: "" if value != value else repr(value)):
    """A table in CSV of lists or, where a cell may be missing, dictionaries. `form` writes floats: empty for NaN."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        cells = [row.get(column, "") for column in columns] if isinstance(row, dict) else row
        writer.writerow([form(cell) if isinstance(cell, float) else cell for cell in cells])
    return text.getvalue()


def read_csv(option, path, allowed):
    """Yields the rows of a table in CSV, lists of texts: the columns' names, then one or more of the same length. Skips
    blank lines and a byte order mark. Throws Refused, as read_whole does."""
    content = io.BytesIO(read_whole(option, path, LARGEST_TABLE, allowed))
    rows, columns, row = csv.reader(io.TextIOWrapper(content, encoding="utf-8-sig", newline="")), None, None
    try:
        for row in filter(None, rows):
            if len(row) != (len(columns) if columns else len(row)):
                raise csv.Error(f"line {rows.line_num} has {len(row)} cells instead of {len(columns)}")
            columns = columns or row
            yield row
        if row is columns:
            raise csv.Error("no rows")
    except (UnicodeDecodeError, csv.Error) as error:
        raise Refused(f"{option} {shown(path)}: {error}; must be {allowed}".lstrip())


@dataclass
class Finding:
    """`text` has a field of str.format for each of `values`; `same`: whether it is the claim, yes, no or in part."""
    same: str
    text: str
    values: list

    def measured(self):
        return self.text.format(*self.values)


class WrittenPart:
    """The part of a page that `script` writes, between two comments."""
    END = "<!-- End of what it writes -->"

    def __init__(self, page, script):
        self.page, self.begin = page, f"<!-- Written by {script} -->"

    def parts(self, page):
        """The text of a page before this part, of it, and after it."""
        before, _, rest = page.partition(self.begin)
        part, _, after = rest.partition(self.END)
        return before, part, after

    def write(self, text, copy=None):
        """Into the page or, with the rest of the page, to a copy of it."""
        before, _, after = self.parts(self.page.read_text())
        write_whole(copy or self.page, f"{before}{self.begin}\n{text}{self.END}{after}")


def paragraph(text):
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False) + "\n"
