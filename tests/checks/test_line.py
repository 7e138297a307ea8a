"""The generator of what the languages know of the line: a field is added by its one line, and what differs is told."""
import io
import pathlib
import re
import shutil
import sys
import tempfile
import unittest
from contextlib import redirect_stdout
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "firmware/wire"))
import line  # noqa: E402

PAGE = "firmware/wire/PROTOCOL.md"
LAST_FIELD = '  { name = "vy_mm_s", '
NEW_FIELD = '  { name = "torque_N_mm", type = "f32", when = "flags.TANGENTIAL_VALID", text = "about the normal of the pad" },\n'


class Generator(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        for name in (*line.FILES, PAGE, "firmware/wire/line.toml"):
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.root / name)

    def run_it(self, *words):
        with redirect_stdout(io.StringIO()) as said, mock.patch.object(sys, "argv", ["line.py", "--root", str(self.root), *words]):
            return line.main(), said.getvalue()

    def change(self, name, before, after):
        path = self.root / name
        text = path.read_text(encoding="utf-8")
        self.assertIn(before, text)
        path.write_text(text.replace(before, after, 1), encoding="utf-8")

    def test_what_is_committed_is_what_the_description_says(self):
        self.assertEqual(self.run_it("--check"), (0, ""))

    def test_a_change_by_hand_is_told_and_undone(self):
        for name, before, after in ((PAGE, "| 8 | LOW_SIGNAL |", "| 9 | LOW_SIGNAL |"), ("firmware/common/contact_flags.h", "1 << 8", "1 << 9"),
                                    ("host_tools/web/src/line/line_facts.ts", "  bus_nacks: number;", "  bus_timeouts: number;")):
            self.change(name, before, after)
            status, said = self.run_it("--check")
            self.assertEqual((status, said.split(":")[0]), (1, name))
            self.assertEqual(self.run_it(), (0, f"{name}: written\n"))
            self.assertEqual(self.run_it("--check"), (0, ""))

    def test_a_field_is_one_line(self):
        self.change("firmware/wire/line.toml", LAST_FIELD, NEW_FIELD + LAST_FIELD)
        status, said = self.run_it()
        self.assertEqual(status, 0)
        changed = {each.split(":")[0] for each in said.splitlines()}
        self.assertEqual(changed, {"firmware/wire/bodies.h", "firmware/wire/layouts.inc", "host_tools/library/libfingertip/line_fields.hpp", "host_tools/library/libfingertip/line_values.hpp",
                                   "host_tools/python/fingertip/line.py", "host_tools/python/fingertip/msg/fingertip_msgs/msg/Contact.msg",
                                   "host_tools/web/src/line/line_facts.ts", PAGE})
        texts = {name: (self.root / name).read_text(encoding="utf-8") for name in changed}
        self.assertIn("float torque_N_mm; /* about the normal of the pad */", texts["firmware/wire/bodies.h"])
        runs = re.findall(r"RUN\((.*)\)", texts["firmware/wire/layouts.inc"].split("wire_raw_runs")[0])
        at = runs.index("F32, 1, contact.torque_N_mm")
        self.assertEqual(runs[at - 1], "WHEN, 20, contact.flags")
        self.assertIn("float32 torque_n_mm         # about the normal of the pad\n", texts["host_tools/python/fingertip/msg/fingertip_msgs/msg/Contact.msg"])
        self.assertIn("  torque_N_mm: Flag.TANGENTIAL_VALID,", texts["host_tools/web/src/line/line_facts.ts"])
        self.assertIn("| f32 | torque_N_mm | about the normal of the pad | TANGENTIAL_VALID |", texts[PAGE])

    def test_the_longest_frame_is_that_of_the_longest_body(self):
        described = line.Line(ROOT / "firmware/wire/line.toml")
        self.assertEqual(described.longest_frame(), 12 + (126 + 16 * 32 + 177) + 4 + 3 + 2)  # info of 32 sensors, calibrated, with a pad; as PROTOCOL.md says
        self.assertIn(f"longer than {described.longest_frame()} bytes is damage", (ROOT / PAGE).read_text(encoding="utf-8"))

    def test_what_is_there_twice_is_refused(self):
        self.change("firmware/wire/line.toml", "{ bit = 24,", "{ bit = 23,")
        with self.assertRaisesRegex(SystemExit, "flags \\[23\\] is there twice"):
            self.run_it()

    def test_a_page_without_its_mark_is_refused(self):
        self.change(PAGE, "<!-- line.toml: raw -->", "")
        with self.assertRaisesRegex(SystemExit, "0 marks of raw"):
            self.run_it()


if __name__ == "__main__":
    unittest.main()
