"""The pages of docs/ and the README show what is there, and nothing generated is too long to read."""
import re
import unittest

from harness import ROOT

LARGEST_TEXT = 100_000  # bytes, of what a program has written into docs/


class PagesTest(unittest.TestCase):
    def test_links_lead_to_files(self):
        for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]:
            links = re.findall(r"\]\((?!http)([\w./-]+\.\w+)", page.read_text())
            self.assertEqual([link for link in links if not (page.parent / link).exists()], [], page)

    def test_texts_are_short(self):
        for path in (ROOT / "docs").rglob("*.*"):
            if path.suffix not in (".png", ".gif"):
                self.assertLessEqual(path.stat().st_size, LARGEST_TEXT, path)


if __name__ == "__main__":
    unittest.main()
