"""The page of all reports: every figure, table and picture is in, and what is missing is said."""

import base64
import html.parser
import json
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
REPORT = ROOT / "host_tools/report"
for folder in ("grasp", "shear", "truth", "validation", "rate", "fit", "shared"):
    sys.path.insert(0, str(REPORT / folder))
import parts  # noqa: E402
import fit  # noqa: E402
import rate  # noqa: E402
import shear  # noqa: E402
import grasp  # noqa: E402
import page  # noqa: E402
import truth  # noqa: E402
import validation  # noqa: E402
from presentation import goal_table_md, judge  # noqa: E402

GOALS = {report.__name__: report.GOALS for report in (fit, rate, validation, truth, shear, grasp)}
LIMITS = {"<=": 1000, ">=": -1000, "within": (-1000, 1000)}
VOID = {"meta", "img", "br", "hr"}
PARTS = {part.name: part for part in parts.PARTS if part.page}


class TestParts(unittest.TestCase):
    def test_every_program_is_there_and_a_report_is_a_part_of_all(self):
        for part in parts.PARTS:
            if part.run:
                self.assertTrue((REPORT / part.name / part.run.program).is_file(), part.name)
        short, whole = ([command[1] for _, command in parts.steps(what)] for what in ("report", "all"))
        self.assertEqual([program for program in whole if program in short], short)

    def test_one_part_runs_whole(self):
        [(_, alone)] = parts.steps("shear")
        self.assertIn(alone, [command for _, command in parts.steps("all")])
        [(_, judged)] = parts.steps("real", "/recordings")
        self.assertEqual(judged[-1], "/recordings")

    def test_what_cannot_run_is_said(self):
        for arguments, said in (
            (("nothing",), "there is no part nothing"),
            (("suite",), "there is no part suite"),
            (("real",), "needs the folder"),
            (("fit", "/recordings"), "takes no folder"),
            (("all", "/recordings"), "takes no folder"),
        ):
            with self.assertRaisesRegex(parts.InputError, said):
                parts.steps(*arguments)

    def test_a_damaged_part_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "part.json"
            for text in ("{", "[]", '{"order": 1, "colour": 2}', '{"order": 1, "page": {"title": "no more"}}', '{"run": {}}'):
                path.write_text(text)
                with self.assertRaisesRegex(parts.InputError, "part.json"):
                    parts.read(path)


class Reader(html.parser.HTMLParser):
    """What a browser would show, and what it would load."""

    def __init__(self, text):
        super().__init__()
        self.open, self.rows, self.images, self.loads, self.words, self.headings = [], [], {}, [], [], []
        self.feed(text)
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
        elif tag == "img":
            self.images[attributes["alt"]] = base64.b64decode(attributes["src"].removeprefix("data:image/png;base64,"))
        elif tag in ("script", "link", "iframe", "object"):
            self.loads.append(tag)
        if attributes.get("href", "#")[0] != "#":
            self.loads.append(attributes["href"])

    def handle_endtag(self, tag):
        last = self.open.pop()
        assert last == tag, (last, tag)

    def handle_data(self, text):
        if "style" in self.open:
            return
        self.words.append(text)
        if self.open and self.open[-1] in ("h1", "h2", "h3", "h4"):
            self.headings.append((self.open[-1], text))
        if ("td" in self.open or "th" in self.open) and self.rows:
            self.rows[-1][-1] += text

    def row(self, *begin):
        """The first row that begins so."""
        return next((row for row in self.rows if tuple(row[: len(begin)]) == begin), None)


def names_in(value):
    if isinstance(value, dict):
        for name, item in value.items():
            yield name
            yield from names_in(item)
    if isinstance(value, list):
        for item in value:
            yield from names_in(item)


class Page(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, name, found):
        (self.folder / f"{name}.json").write_text(json.dumps(found))

    def write_all(self):
        """Each part with all its goals met, figures of every kind, its pictures and tables; {part: figures}."""
        every = {}
        for number, (name, part) in enumerate(PARTS.items()):
            goals = GOALS.get(name, ())
            found = {figure: 0.125 for figure, _, limit in goals}
            found |= {
                **{f"{name}_text": "a < b & c", f"{name}_list": [1, 2.5, None]},
                f"{name}_nested": {"inner_of_nested": {"deepest": 77000 + number}},
                f"{name}_rows": [
                    {"first_column": 1, "inside": {"of_a_row": 2}},
                    {"second_column": "only here", "deep_rows": [{"in_rows": 3}]},
                ],
            }
            found |= {limit: 0.125 for _, _, limit in goals if isinstance(limit, str)}
            judged = judge(found, [(figure, sign, LIMITS[sign]) for figure, sign, _ in goals]) if goals else found
            self.write(name, judged)
            every[name] = judged
            for picture, caption in part.page.pictures:
                (self.folder / picture).write_bytes(f"picture {picture}".encode())
            for table, _ in part.page.tables:
                (self.folder / table).write_text('{"cases": [{"case_of_json": "hard"}]}')
        return every

    def read(self):
        self.assertEqual(page.write(self.folder), self.folder / "index.html")
        return Reader((self.folder / "index.html").read_text(encoding="utf-8"))

    def test_every_key_is_in(self):
        every = self.write_all()
        shown = self.read()
        cells = {cell for row in shown.rows for cell in row}
        for part, found in every.items():
            for name in names_in({name: value for name, value in found.items() if name != "goals"}):
                self.assertIn(name, cells, part)
            self.assertIn(f"{part}_text", cells)
        for number in range(len(PARTS)):
            self.assertIn(str(77000 + number), cells)
        self.assertIn("a < b & c", cells)
        self.assertEqual(shown.row("fit_list")[2], "1, 2.5, ")

    def test_every_picture_and_table_is_in(self):
        self.write_all()
        shown = self.read()
        for part in PARTS.values():
            for picture, caption in part.page.pictures:
                self.assertEqual(shown.images[caption], f"picture {picture}".encode())
        self.assertEqual(len(shown.images), sum(len(part.page.pictures) for part in PARTS.values()))
        self.assertIsNotNone(shown.row("hard"))

    def test_each_goal_has_its_verdict_in_words_and_how_it_was_measured(self):
        found = judge({name: 5.0 for name, _, _ in rate.GOALS} | {"half_flash_bytes": 9, "dropped": None}, rate.GOALS)
        self.write("rate", found)
        shown = self.read()
        self.assertEqual(shown.row("latency_parallel_us"), ["latency_parallel_us", "5", "<= 700", "met", "emulated"])
        self.assertEqual(shown.row("mux_fps_osr256"), ["mux_fps_osr256", "5", ">= 260", "missed", "emulated"])
        self.assertEqual(shown.row("dropped"), ["dropped", "", "<= 0", "not measured", "emulated"])
        self.assertEqual(shown.row("flash_bytes")[4], "read from the image")
        words = "".join(shown.words)
        missed = r"11 missed \(parallel_fps_osr256, .*, unfitted, .*\), 1 not measured \(dropped\)"
        self.assertRegex(words, f"Rate, latency and cost: 9 met, {missed}")

    def test_how_and_from_which_command(self):
        every = self.write_all()
        shown = self.read()
        how = {row[0]: row[4] for row in shown.rows if len(row) == 5 and row[3] in ("met", "missed", "not measured")}
        self.assertEqual(set(how), {name for goals in GOALS.values() for name, _, _ in goals})
        recorded = {name for name, said in how.items() if said == "from recordings"}
        self.assertEqual(recorded, {name for name in how if name.startswith("real_")})
        said = {"simulated": "p99_9_um samples false_contacts vector_error_p95", "timed on this computer": "seconds"}
        said |= {"emulated": "cold_cycles emulated_frames_different flash_lost"}
        for wanted, names in said.items():
            self.assertEqual({how[name] for name in names.split()}, {wanted}, names)
        words = "".join(shown.words)
        for part in PARTS.values():
            self.assertIn(part.command, words)
        self.assertEqual(len(every), len(PARTS))

    def test_a_missing_part_is_said(self):
        self.write_all()
        (self.folder / "truth.json").unlink()
        (self.folder / "rate.png").unlink()
        (self.folder / "stiff.json").unlink()
        words = "".join(self.read().words)
        self.assertIn("From the optimum to the truth: not run", words)
        self.assertIn("not run: there is no truth.json", words)
        self.assertEqual(words.count("not run"), 2)
        self.assertIn("(rate.png): not drawn", words)
        self.assertIn("(stiff.json): not there", words)

    def test_of_nothing_all_is_missing(self):
        words = "".join(self.read().words)
        self.assertEqual(words.count("not run: there is no"), len(PARTS))

    def test_a_damaged_part_is_said_and_harms_no_other(self):
        self.write_all()
        (self.folder / "fit.json").write_text('{"p99_9_um": 0.')
        (self.folder / "rate.json").write_text("[]")
        self.write("validation", {"goals": {"samples": {"goal": ">= 1", "met": True}}})
        self.write("truth", {"goals": {"samples": 3}})
        self.write("grasp", {"goals": [1]})
        for name in ("fit", "rate", "validation", "truth", "grasp"):
            self.assertIn(f"{PARTS[name].page.title}: damaged", "".join(self.read().words))
        self.write_all()
        (self.folder / "fit.json").write_text("")
        shown = self.read()
        words = "".join(shown.words)
        self.assertEqual(words.count("damaged"), 2)
        self.assertIsNotNone(shown.row("cal_median_mm"))

    def test_the_text_of_a_report_is_in_without_what_the_page_has_itself(self):
        every = self.write_all()
        table = "\n".join(goal_table_md(every["rate"]))
        text = f"# Title of the text\n\nWritten.\n\n![Some picture](rate.png)\n\n{table}\n\n"
        (self.folder / "rate.md").write_text(text + "## By OSR\n\n| board | OSR |\n|---|---|\n| of the text | 256 |\n")
        shown = self.read()
        self.assertIsNotNone(shown.row("of the text", "256"))
        self.assertIn(("h3", "By OSR"), shown.headings)
        self.assertNotIn("Title of the text", "".join(shown.words))
        self.assertEqual(sum(row[0] == "latency_parallel_us" and "met" in row for row in shown.rows), 1)

    def test_nothing_is_loaded_and_both_lights_are_served(self):
        self.write_all()
        self.assertEqual(self.read().loads, [])
        text = (self.folder / "index.html").read_text(encoding="utf-8")
        for word in ("http:", "https:", "url(", "@import"):
            self.assertNotIn(word, text)
        self.assertIn("prefers-color-scheme: dark", text)
        self.assertIn('name="viewport" content="width=device-width', text)


if __name__ == "__main__":
    unittest.main(verbosity=2)
