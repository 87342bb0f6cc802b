"""The pages show what is there, say the same number wherever they repeat it, and nothing generated is too long to read."""
import csv
import re
import unittest

from harness import ROOT

LARGEST_TEXT = 100_000  # bytes, of what a program has written into docs/
MOST_WORDS = 25_000  # of README.md, CONTRIBUTING.md, SECURITY.md and docs/*.md, without listings
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").rglob("*.md")]


def anchors(page):
    """Those of its headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


class PagesTest(unittest.TestCase):
    def test_links_lead_to_files_and_headings(self):
        for page in PAGES:
            for link, anchor in re.findall(r"\]\((?!http)([^)#\s]*)(?:#([^)\s]+))?\)", page.read_text()):
                target = page.parent / link if link else page
                self.assertTrue(target.exists(), (page, link))
                if anchor and target.suffix == ".md":
                    self.assertIn(anchor, anchors(target), (page, link))

    def test_tests_that_pages_name_exist(self):
        known = {path.stem for folder in ("test", "tools", "studies", "examples") for path in (ROOT / folder).rglob("*_*test*")}
        for page in (*PAGES, *(ROOT / "docs").rglob("*.csv")):
            self.assertLessEqual(set(re.findall(r"\b[a-z]\w*_(?:ros)?test\b", page.read_text())), known, page)

    def test_texts_are_short(self):
        for path in (ROOT / "docs").rglob("*.*"):
            if path.suffix not in (".png", ".gif"):
                self.assertLessEqual(path.stat().st_size, LARGEST_TEXT, path)

    def test_pages_have_few_words(self):
        pages = (page.read_text() for page in PAGES if page.parent in (ROOT, ROOT / "docs"))
        lines = "\n".join(re.sub(r"(?ms)^```.*?^```$", "", page) for page in pages).split("\n")
        self.assertLessEqual(sum(len(line.split()) for line in lines if not line.startswith("    ")), MOST_WORDS)


class NumbersTest(unittest.TestCase):
    """A number is measured on one page; the others repeat it."""

    def setUp(self):
        self.tables = {str(path.relative_to(ROOT)): path.read_text() for path in PAGES}
        self.pages = {page: " ".join(text.split()) for page, text in self.tables.items()}

    def expect(self, text, page):
        self.assertIn(text, self.pages[page])

    def rows(self, table):
        with open(ROOT / "docs" / table, newline="") as file:
            return list(csv.DictReader(file))

    def test_friction_of_real_bases(self):
        rows = self.rows("validation/torques.csv")
        ratios = {way: [float(row["paper_N_m"]) / float(row["real_N_m"]) for row in rows if row["motion"].startswith(way)]
                  for way in ("forward", "lateral")}
        self.assertEqual([len(ratios[way]) for way in ("forward", "lateral")], [3, 2])
        forward, lateral = ([f"{end(ratios[way]):.1f}" for end in (min, max)] for way in ("forward", "lateral"))
        self.expect(f"the paper's friction needs {forward[0]} to {forward[1]} times the real torque forward, "
                    f"{lateral[0]} to {lateral[1]} times laterally", "docs/drop_in.md")
        self.expect(f"[{forward[0]} to {forward[1]} times](validation.md#friction-of-drive-trains-and-rollers) their torque "
                    f"forward and {lateral[0]} to {lateral[1]} times laterally", "docs/scenes.md")
        off = [100 * float(row["measured_N_m"]) / float(row["real_N_m"]) - 100 for row in rows]
        self.expect(f"`measured` is off by {min(off):.0f} to {max(off):+.0f} %", "docs/validation.md")
        a, b = map(float, re.search(r"A has ([\d.]+) times its friction, B ([\d.]+) times", self.pages["docs/validation.md"]).groups())
        self.expect(f"scaled by {a} and {b}", "README.md")
        self.expect(f"{100 - 100 / a:.0f} % below A's and {100 / b - 100:.0f} % above B's", "docs/scenes.md")
        self.expect(f"{100 - 100 / a:.0f} % below A, {100 / b - 100:.0f} % above B", "docs/validation.md")
        self.expect(f"({b} fits base B, {a} base A, ", "docs/node.md")

    def test_steps(self):
        real = re.search(r"^\| base A \| \| ([\d.]+) s.*?\| ([\d.]+) to [\d.]+ s.*?\| ([\d.]+) s", self.tables["docs/validation.md"],
                         re.MULTILINE).groups()
        self.expect("[base A](validation.md#steps) took {}, {:g} and {} s".format(real[0], float(real[1]), real[2]), "docs/drop_in.md")

    def test_work_and_precision(self):
        text = self.tables["docs/work_precision/work_precision.md"]
        cells = {name: [float(x) for x in re.findall(r"\(([\d.]+) x\)", line)]
                 for name, line in re.findall(r"^\| (SUNDIALS CVODE|odeint rosenbrock4)(.*)$", text, re.MULTILINE)}
        cvode, rosenbrock = cells["SUNDIALS CVODE"], cells["odeint rosenbrock4"]
        self.expect("CVODE took {:.0f} to {:.0f} times as long, rosenbrock4 {:.0f} to {:.0f} times".format(
            min(cvode[:4]), max(cvode[:4]), min(rosenbrock[:4]), max(rosenbrock[:4])), "docs/numerics_results.md")
        factors = [float(x) for x in re.findall(r"\(([\d.]+) x\)", text)]
        self.expect(f"{min(factors):.0f} to {max(factors):.0f} times faster than general implicit solvers", "docs/numerics_results.md")
        self.expect(f"CVODE takes {cvode[-1]:.0f} times as long and rosenbrock4 {rosenbrock[-1]:.0f} times", "docs/numerics_results.md")

    def test_claims_of_the_paper(self):
        same = re.findall(r"^\| \d+ \|.*\| (yes|in part|no) \| [^|]* \|$", self.tables["docs/paper/claims.md"], re.MULTILINE)
        counts = [len(same), *(same.count(verdict) for verdict in ("yes", "in part", "no"))]
        self.expect("Of the {} claims, {} hold, {} hold in part, and {} does not".format(*counts), "docs/paper.md")

    def test_run_time(self):
        fast, slow = re.search(r"Case 1 runs at \d+ to (\d+) times .*? gave (\d+) to", self.pages["docs/numerics_results.md"]).groups()
        for page, text in (("README.md", "{} to {} times faster than real time"), ("docs/which_simulator.md", "[{} to {} times]")):
            self.expect(text.format(slow, round(int(fast), -2)), page)

    def test_cost_of_features(self):
        cost = {row["feature"]: sorted(float(row[case]) for case in ("Case 1", "Case 2"))
                for row in self.rows("work_precision/feature_cost.csv")}
        reactions = cost["dynamic normal reactions"][0], cost["the same, rocking front axle"][1]
        self.expect("a wet patch {:.1f} to {:.1f}, dynamic normal reactions {:.1f} to {:.1f}, all features {:.1f} to {:.1f}:".format(
            *cost["wet patch"], *reactions, *cost["all, with the rocking axle"]), "docs/numerics_results.md")

    def test_lockstep(self):
        wall = {row["nodes, by loops of 50 Hz unless noted"]: row["wall time per step (ms)"]
                for row in self.rows("testing/lockstep.csv")}
        self.expect("took {} ms with one controller, {} ms with four filters before it".format(
            wall["a controller, C++"], wall["four filters and a controller, C++"]), "docs/testing.md")

    def test_slip_odometry(self):
        off = {row["rollers"]: row["slip_unknown_angles_mm"] for row in self.rows("validation/rollers.csv")}
        self.expect("angles is {} mm off with 4 rollers, {} with 6, {} with 12 and {} with 16".format(
            *(off[n] for n in ("4", "6", "12", "16"))), "docs/validation.md")

    def test_stress(self):
        hold, runs, sensitive = map(int, re.search(
            r"(\d+) of (\d+) runs hold all requirements, (\d+) more are explained", self.pages["docs/stress/stress.md"]).groups())
        self.expect(f"{hold} of the {runs} runs hold all limits of cost and error; {sensitive} more are sensitive motions, and "
                    f"[stress.md](stress/stress.md) names the {runs - hold - sensitive} others", "docs/numerics_results.md")


if __name__ == "__main__":
    unittest.main()
