"""What the tests of pages with measured tables have in common."""

import re

from youbot_base_sim.report import NUMBER


class MeasuredPage:
    """Tests of a page: a mixin of unittest.TestCase, whose class has `table`, and `findings` with their `rows` of it."""

    def page(self):
        return self.table.page.read_text()

    def wrong_rows(self, page):
        return self.table.wrong_rows(page, self.rows, self.findings)

    def test_has_what_is_measured(self):
        expected = dict(enumerate(self.rows, 1))
        wrong = self.wrong_rows(self.page())
        self.assertEqual([expected.get(number, "the number of rows") for number in wrong], [])

    def test_would_fail_on_any_other_number(self):
        page = self.page()
        before, table, _ = self.table.parts(page)
        for number, finding in enumerate(self.findings, 1):
            measured, printed = finding.measured(), finding.printed()
            start = page.index(measured, len(before), len(before) + len(self.table.begin) + len(table))
            for match in re.finditer(NUMBER, measured):
                text = match.group()
                if text not in printed:
                    continue  # part of the words
                other = text[:-1] + str((int(text[-1]) + 2) % 10)  # one more might still be within the rounding
                place = start + match.start()
                changed = page[:place] + other + page[place + len(text):]
                self.assertEqual(self.wrong_rows(changed), [number], f"{text} as {other} in {measured}")
