"""Tables as CSV and Markdown, and tables of what runs were found to do, which programs write into pages of docs/."""
import csv
import io
from dataclasses import dataclass

from .command_line import Refused, shown
from .files import read_whole, write_whole

LARGEST_TABLE = 250000000  # bytes, as simulate reads


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|", *("| " + " | ".join(row) + " |" for row in rows)]
    return "\n".join(lines) + "\n"


def csv_text(columns, rows, form=lambda value: "" if value != value else repr(value)):
    """A table in CSV with one line of names; rows are lists of cells or, where a cell may be missing, dictionaries.
    `form` writes floats: by default so that they read back to the same value, and empty where they are not a number."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        cells = [row.get(column, "") for column in columns] if isinstance(row, dict) else row
        writer.writerow([form(cell) if isinstance(cell, float) else cell for cell in cells])
    return text.getvalue()


def read_csv(option, path, allowed):
    """Yields the rows of a table in CSV, lists of texts of one length: the first has the columns' names, one at least
    follows. Blank lines and a byte order mark are passed over. Throws Refused, as read_whole does."""
    count, rows = 0, csv.reader(io.TextIOWrapper(io.BytesIO(read_whole(option, path, LARGEST_TABLE, allowed)),
                                                 encoding="utf-8-sig", newline=""))
    try:
        for row in filter(None, rows):
            columns = len(row) if count == 0 else columns
            if len(row) != columns:
                raise csv.Error(f"line {rows.line_num} has {len(row)} cells instead of {columns}")
            count += 1
            yield row
        if count < 2:
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
