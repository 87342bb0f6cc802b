"""Tables in CSV."""
import array
import csv
import io

import numpy as np

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
    if content.getvalue().startswith(b"#ROSBAG"):
        raise Refused(f"{option} {shown(path)}: is a bag, which analyse reads; must be {allowed}".lstrip())
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


def read_columns(option, path, names, allowed):
    """{name: numbers} of these columns. Throws Refused where one is missing, or has a cell that is no number."""
    rows, numbers = read_csv(option, path, allowed), array.array("d")  # takes a tenth of what lists do
    columns = next(rows)
    try:
        for name in set(names) - set(columns):
            raise ValueError(f"no column {name!r}")
        places = [columns.index(name) for name in names]
        for row in rows:
            numbers.extend(float(row[place]) for place in places)
    except ValueError as error:
        raise Refused(f"{option} {shown(path)}: {shown(error)}; must be {allowed}: numbers in columns "
                      f"{', '.join(names)}".lstrip())
    return dict(zip(names, np.array(numbers).reshape(-1, len(names)).T))
