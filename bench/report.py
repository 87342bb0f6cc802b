"""What the reports of the benchmarks share."""

import csv
import io


def table(head, rows):
    """A table in Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|", *("| " + " | ".join(row) + " |" for row in rows)]
    return "\n".join(lines) + "\n"


def csv_text(columns, rows, digits):
    """A table in CSV; a cell that a row does not have stays empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: f"{value:.{digits}g}" if isinstance(value, float) else value for key, value in row.items()}
                     for row in rows)
    return text.getvalue()


def write(path, text):
    """Writes the file whole or not at all."""
    part = path.with_name(path.name + ".part")
    part.write_text(text)
    part.replace(path)
