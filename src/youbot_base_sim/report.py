"""Tables in CSV."""
import csv
import io

from .command_line import Refused, shown
from .files import read_whole

LARGEST_TABLE = 250000000  # bytes, as simulate reads


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
    """Yields the rows of a CSV table, lists of texts of one length, names first; skips blank lines. Throws Refused."""
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
