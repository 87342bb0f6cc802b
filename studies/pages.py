"""Tables in Markdown, what runs were found to do, and the parts of pages in docs/ that studies write."""
import textwrap
from dataclasses import dataclass

from youbot_base_sim.files import write_whole


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|", *("| " + " | ".join(row) + " |" for row in rows)]
    return "\n".join(lines) + "\n"


def figures(x):
    """Three figures, without an exponent while that is short; "-" for what is not a number."""
    return "-" if x != x else f"{x:.0f}" if x >= 1000 else f"{x:.3g}"


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
