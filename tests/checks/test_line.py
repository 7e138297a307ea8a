"""The generator of what the languages know of the line: a field is added by its one line, and what differs is reported."""

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
sys.path[:0] = [str(ROOT / "firmware/wire"), str(ROOT / "host_tools/python")]
import line  # noqa: E402

PAGE = "firmware/wire/PROTOCOL.md"
FIRST_SETTING = '[[settings]]\nname = "rate"\n'
NEW_SETTING = """[[settings]]
name = "hold"
command = "hold"
typed = "MS"
help = "{0}"
give = "{0} ms"
label = "Hold, ms"
hint = "{0}"
values = [{ field = "hold_ms", info = "hold_ms", title = "Hold", give = "{0} ms", text = "{0}" }]

"""
FIRST_COMMAND = "[command.stream]\n"
NEW_COMMAND = """[command.hold]
type = 0x9F
python = "SetHold"
word = "hold"
text = "Hold a value."
fields = [{ name = "hold_ms", type = "u16", range = "HOLD", text = "time" }]

"""
LAST_FIELD = '  { name = "vy_mm_s", '
NEW_FIELD = '  { name = "torque_N_mm", type = "f32", when = "flags.TANGENTIAL_VALID", text = "about the normal of the pad" },\n'


class Generator(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        for name in (*line.FILES, PAGE, "firmware/wire/line.toml"):
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.root / name)

    def run_it(self, *words):
        with redirect_stdout(io.StringIO()) as output, mock.patch.object(sys, "argv", ["line.py", "--root", str(self.root), *words]):
            return line.main(), output.getvalue()

    def change(self, name, before, after):
        path = self.root / name
        text = path.read_text(encoding="utf-8")
        self.assertIn(before, text)
        path.write_text(text.replace(before, after, 1), encoding="utf-8")

    def test_a_change_by_hand_is_told_and_undone(self):
        for name, before, after in (
            (PAGE, "| 8 | LOW_SIGNAL |", "| 9 | LOW_SIGNAL |"),
            ("firmware/common/contact_flags.h", "1 << 8", "1 << 9"),
            ("host_tools/web/src/line/line_facts.ts", "  bus_nacks: number;", "  bus_timeouts: number;"),
        ):
            self.change(name, before, after)
            status, output = self.run_it("--check")
            self.assertEqual((status, output.split(":")[0]), (1, name))
            self.assertEqual(self.run_it(), (0, f"{name}: written\n"))
            self.assertEqual(self.run_it("--check"), (0, ""))

    def test_a_field_is_one_line(self):
        self.change("firmware/wire/line.toml", LAST_FIELD, NEW_FIELD + LAST_FIELD)
        status, output = self.run_it()
        self.assertEqual(status, 0)
        changed = {each.split(":")[0] for each in output.splitlines()}
        names = "bodies.h layouts.inc line_fields.hpp line_values.hpp line.py Contact.msg line_facts.ts PROTOCOL.md"
        self.assertEqual({pathlib.Path(name).name for name in changed}, set(names.split()))
        texts = {name: (self.root / name).read_text(encoding="utf-8") for name in changed}
        self.assertIn("float torque_N_mm; /* about the normal of the pad */", texts["firmware/wire/bodies.h"])
        runs = re.findall(r"RUN\((.*)\)", texts["firmware/wire/layouts.inc"].split("wire_raw_runs")[0])
        at = runs.index("F32, 1, contact.torque_N_mm")
        self.assertEqual(runs[at - 1], "WHEN, 20, contact.flags")
        message = texts["host_tools/python/fingertip/msg/fingertip_msgs/msg/Contact.msg"]
        self.assertIn("float32 torque_n_mm         # about the normal of the pad\n", message)
        self.assertIn("  torque_N_mm: Flag.TANGENTIAL_VALID,", texts["host_tools/web/src/line/line_facts.ts"])
        self.assertIn("| f32 | torque_N_mm | about the normal of the pad | TANGENTIAL_VALID |", texts[PAGE])

    def test_a_setting_is_its_lines(self):
        toml = "firmware/wire/line.toml"
        self.change(toml, FIRST_SETTING, NEW_SETTING + FIRST_SETTING)
        self.change(toml, FIRST_COMMAND, NEW_COMMAND + FIRST_COMMAND)
        self.change(toml, "SLIP_WINDOW = {", 'HOLD = { unit = "ms", min = 7, max = 70, text = "hold" }\nSLIP_WINDOW = {')
        self.change(toml, '"osr", "temperature_interval_ms"', '"osr", "hold_ms", "temperature_interval_ms"')
        osr = '  { name = "osr", type = "u16", text'
        self.change(toml, osr, '  { name = "hold_ms", type = "u16", text = "hold" },\n' + osr)
        self.assertEqual(self.run_it()[0], 0)
        texts = {name: (self.root / name).read_text(encoding="utf-8") for name in line.FILES}
        tool = texts["host_tools/library/libfingertip/line_settings.hpp"]
        self.assertIn('{"hold", "MS", "hold=MS (7 to 70)", "7 to 70 ms", nullptr, WIRE_CMD_HOLD, 0, 1,', tool)
        self.assertIn("WIRE_HOLD_MIN_ms, WIRE_HOLD_MAX_ms", tool)
        self.assertIn("command.body.cmd_hold.hold_ms = static_cast<std::uint16_t>(value);", tool)
        output = {"__name__": "fingertip.line", "__package__": "fingertip"}
        exec(texts["host_tools/python/fingertip/line.py"], output)
        setting = output["SETTINGS"][0]
        self.assertEqual((setting.argument, setting.command), ("hold_ms", output["SetHold"]))
        self.assertEqual((setting.least, setting.most, setting.whole), (7, 70, True))
        self.assertIn("hold_ms: int | None", texts["host_tools/python/fingertip/line.py"])
        self.assertIn("hold_ms", output["INFO_KEYS"])
        self.assertIn("        hold_ms: 7 to 70.\n", output["Settable"].set.__doc__)
        page = "field: 'hold_ms', info: 'hold_ms', title: 'Hold', per: 1, whole: true, span: [7, 70]"
        self.assertIn(page, texts["host_tools/web/src/line/line_facts.ts"])

    def test_the_longest_frame_is_that_of_the_longest_body(self):
        described = line.Line(ROOT / "firmware/wire/line.toml")
        # Info of 36 sensors, calibrated, with a pad; as PROTOCOL.md says.
        self.assertEqual(described.longest_frame(), 12 + (136 + 22 * 36 + 177) + 4 + 4 + 2)
        self.assertIn(f"longer than {described.longest_frame()} bytes is damage", (ROOT / PAGE).read_text(encoding="utf-8"))

    def test_what_is_there_twice_is_refused(self):
        self.change("firmware/wire/line.toml", "{ bit = 24,", "{ bit = 23,")
        with self.assertRaisesRegex(SystemExit, "flags \\[23\\] is there twice"):
            self.run_it()

    def test_each_number_of_the_page_is_checked(self):
        for before, after in (
            ("protocol, version 9", "protocol, version 8"),
            ("| version, 9 |", "| version, 8 |"),
            ("longer than 1127 bytes", "longer than 1126 bytes"),
        ):
            self.run_it()
            self.change(PAGE, before, after)
            self.assertEqual(self.run_it("--check")[0], 1, before)
        self.change(PAGE, "| version, 9 |", "| version |")
        with self.assertRaisesRegex(SystemExit, "0 times"):
            self.run_it()

    def test_a_page_without_its_mark_is_refused(self):
        self.change(PAGE, "<!-- line.toml: raw -->", "")
        with self.assertRaisesRegex(SystemExit, "0 marks of raw"):
            self.run_it()


if __name__ == "__main__":
    unittest.main()
