"""MCAP recordings of the tool and of the Python package, by readers of others: usage test_mcap.py FINGERTIP FAKE_DEVICE [unittest arguments]."""

# real time: a recorder on a pseudo-terminal
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest
import weakref
from unittest import mock

FINGERTIP, FAKE_DEVICE = (os.path.abspath(path) for path in sys.argv[1:3])
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/support"))
import bags  # noqa: E402  finds the package too
from fingertip import InputError, JointRecordingWriter, RecordingWriter, read_recording  # noqa: E402
from mcap.reader import make_reader  # noqa: E402
from mcap.writer import Writer  # noqa: E402
from real_time import RealTime, plugged_in  # noqa: E402
from small_disk import disk_of  # noqa: E402

TWO = ROOT / "tests/fuzz/corpus/recording/two"


class TestMcap(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="fingertip-")))
        cls.enterClassContext(mock.patch.dict(os.environ, {"XDG_RUNTIME_DIR": str(cls.folder), "NO_COLOR": "1"}))
        cls.bag, _ = bags.record(FINGERTIP, FAKE_DEVICE, cls.folder, 0.4, calibrated=1, pad=1, drop=50, health=60, flags=0x17FF)
        cls.csv = cls.convert(cls.bag, "bag.csv")
        cls.several_csv = cls.folder / "several.csv"
        cls.several_csv.write_bytes(TWO.read_bytes()[1:])

    @classmethod
    def convert(cls, start, name, *options):
        path = cls.folder / name
        bags.call(FINGERTIP, "convert", start, path, "--overwrite", *options)
        return path

    def refused(self, *words, **keys):
        """The one line that the tool says."""
        done = subprocess.run([FINGERTIP, *map(str, words)], capture_output=True, text=True, timeout=bags.PATIENCE_s, **keys)
        self.assertEqual(done.returncode, 1, done.stderr)
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1, done.stderr)
        return lines[0]

    def test_three_readers_find_every_message_as_the_csv_file_has_it(self):
        """What the tool and the package write."""
        figures = bags.main(FINGERTIP, FAKE_DEVICE, 0.4, random_frames=300)
        self.assertGreater(figures["mcap_messages"], 1000)
        for name in ("messages_differ", "bags_differ", "round_trips_differ"):
            self.assertEqual(figures[f"mcap_{name}"], 0, name)

    def test_no_row_is_lost_in_silence(self):
        lines = self.csv.read_bytes().split(b"\n")
        row = next(at for at, line in enumerate(lines) if line[:1].isdigit() and b",," not in line[:40])
        path, bag = self.folder / "edited.csv", self.folder / "edited.mcap"
        path.write_bytes(b"\n".join([*lines[:row], b"x" + lines[row], *lines[row + 1 :]]))
        self.assertIn(f"edited.csv:{row + 1}: t_us is", self.refused("convert", path, bag, "--overwrite"))
        for kept in ("x.mcap", "x.csv"):  # as a note, so that what is converted is read
            self.assertIn(b"\n# unread: x" + lines[row], self.convert(self.convert(path, kept, "--salvage"), "y.csv").read_bytes())
        path.write_bytes(b"\n".join([lines[0], b"# rate_mHz: abc", *lines[1:]]))
        self.assertIn('edited.csv:2: rate_mHz is "abc"; use --salvage', self.refused("convert", path, bag, "--overwrite"))
        self.assertIn(b"\n# unread: # rate_mHz: abc\n", self.convert(path, "x.csv", "--salvage").read_bytes())
        data = bytearray(self.bag.read_bytes())
        with open(self.bag, "rb") as file:
            chunk = make_reader(file).get_summary().chunk_indexes[1]
        data[chunk.chunk_start_offset + chunk.chunk_length - 9] ^= 1
        bag.write_bytes(data)
        said = bags.call(FINGERTIP, "convert", bag, path, "--salvage", "--overwrite").stderr
        self.assertRegex(said, r"edited.mcap: byte \d+: a chunk\b.*\n(.*\n)*.*edited.mcap: \d+ damaged lines skipped\n")

    def test_columns_make_room_for_each_other(self):
        first = dict(read_recording(self.csv).columns)
        with mock.patch("fingertip.columns._KEPT_bytes", 0):
            again = read_recording(self.csv)
            for name in (*first, *first):
                self.assertEqual(again[name].tobytes(), first[name].tobytes(), name)
            held, gone = again["x_mm"], weakref.ref(again["y_mm"])
            self.assertIs(again["x_mm"], held)
            self.assertIsNone(gone(), "the memory of a column that no one holds")

    def test_a_quoted_note_keeps_its_end(self):
        path = self.folder / "quoted.csv"
        for note, cell in (
            ('# event: "a"', '"# event: ""a"""'),
            ("# event: b,", '"# event: b,",,,'),
            ("# event: c;", '"# event: c;","",""'),
        ):
            path.write_bytes(self.several_csv.read_bytes().replace(b"\n# end", f"\n{cell}\n# end".encode()))
            self.assertIn(f"\n{note}\n", self.convert(path, "plain.csv").read_text(encoding="utf-8"))
            self.assertEqual(read_recording(path, serial="AAAA").events, [note.removeprefix("# event: ")])

    def test_tool_and_package_write_the_same_of_several(self):
        bags.of_python(self.several_csv, self.folder / "same.mcap")
        there = self.convert(self.several_csv, "tool.mcap")
        self.assertEqual(bags.contents(there), bags.contents(self.folder / "same.mcap"))
        self.assertEqual(self.convert(there, "back.csv").read_bytes(), self.several_csv.read_bytes())

    def test_whatever_an_editor_made_of_a_csv_file_is_converted(self):
        prng = random.Random(5)
        text = self.several_csv.read_bytes()
        for number in range(25):
            data = bytearray(text)
            for _ in range(2):
                at = prng.randrange(24, len(data))
                data[at : at + prng.randrange(3)] = prng.choice((b"", b"\r\n", b",,", b"-0", b"1e3", b"#", b"\n\n", b" ", "µ".encode()))
            data = data[: prng.randrange(len(data) // 2, len(data) + 1)]
            path = self.folder / "edited.csv"
            path.write_bytes(data)
            try:
                there = read_recording(path, salvage=True, serial="AAAA")
                data.decode("utf-8")
            except (InputError, UnicodeDecodeError):  # its head is damaged
                continue
            bag = self.convert(path, "edited.mcap", "--salvage")
            here = read_recording(self.convert(bag, "edited_back.csv"), serial="AAAA")
            self.assertEqual(repr((dict(there.columns), there.sensors_Pa)), repr((dict(here.columns), here.sensors_Pa)), number)
        path.write_bytes(text + b"# note: \xff\n")
        self.assertIn("is no UTF-8 text, which an MCAP file cannot hold", self.refused("convert", path, self.folder / "no.mcap"))

    def test_several_fingertips_have_topics_of_their_own(self):
        infos = [next(bags.some_packets(seed, 0)).body for seed in (1, 2)]
        path = self.folder / "joint.mcap"
        JointRecordingWriter(path, infos).close()
        with open(path, "rb") as file:
            reader = make_reader(file)
            topics = {channel.topic for channel in reader.get_summary().channels.values()}
        self.assertIn("/fingertip/s0001ABCD/contact", topics, "no topic begins with a digit")
        self.assertIn("/fingertip/s0002ABCD/wrench", topics)
        bag = self.convert(self.several_csv, "two.mcap")
        rows = [line.split(",")[0] for line in self.several_csv.read_text(encoding="utf-8").splitlines() if line[0].isdigit()]
        found = [topic for topic, *_ in bags.by_rosbags(bag)]
        self.assertEqual([found.count(f"/fingertip/{name}/contact") for name in ("AAAA", "BBBB")], [rows.count("0"), rows.count("1")])
        for of in ((), ("--device", "E660583883265A2C")):
            every = [topic for topic, *_ in bags.by_rosbags(self.convert(self.csv, "every.mcap", "--every-row", *of))]
            contacts, wrenches, places = (sum(topic.endswith(kind) for topic in every) for kind in ("/contact", "/wrench", "/place"))
            self.assertTrue(wrenches == places > 0.8 * contacts, (contacts, wrenches, places))

    def test_the_points_of_a_camera_are_no_sensors(self):
        bag = self.folder / "camera.mcap"
        with open(self.bag, "rb") as file, open(bag, "wb") as out:
            found = [each for each in make_reader(file).iter_messages() if each[1].topic.endswith(("/contact", "/pressures"))]
            schema, _, cloud = next(each for each in found if each[1].topic.endswith("/pressures"))
            writer = Writer(out)
            writer.start("ros2", "other")
            for schema, topic, data in [
                (schema, "/camera/pressures", cloud.data[:-241] + bytes(241)),
                *((s, c.topic, m.data) for s, c, m in found),
            ]:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                writer.add_message(writer.register_channel(topic, "cdr", number), cloud.log_time, data, cloud.log_time)
            writer.finish()
        right = read_recording(self.bag).metadata["x_mm"]
        self.assertEqual([read_recording(path).metadata["x_mm"] for path in (bag, self.convert(bag, "camera.csv"))], [right, right])

    def test_a_torn_recording_is_converted_with_salvage_only(self):
        torn = self.folder / "torn.csv"
        lines = self.csv.read_bytes().splitlines(keepends=True)[:-1]
        torn.write_bytes(b"".join(lines)[:-5])
        refusal = self.refused("convert", torn, self.folder / "none.csv")
        self.assertIn(f"torn.csv:{len(lines)}: the last line is torn; use --salvage", refusal)
        self.assertFalse((self.folder / "none.csv").exists())
        for out in ("out.csv", "out.mcap"):
            said = bags.call(FINGERTIP, "convert", torn, self.folder / out, "--salvage", "--overwrite").stderr
            self.assertRegex(said, f"{torn}: 1 damaged lines skipped\n{torn}: no end line: .*\n$")

    def test_of_a_killed_recorder_every_written_chunk_is_read(self):
        port, bag = self.folder / "killed_port", self.folder / "killed.mcap"
        contacts = lambda: sum(topic.endswith("/contact") for topic, _, _ in bags.by_mcap_stream(bag))
        with plugged_in(FAKE_DEVICE, port, f"rate={bags.RATE_Hz}"):
            with subprocess.Popen([FINGERTIP, "record", bag, "--port", port], stderr=subprocess.DEVNULL) as recorder:
                RealTime().until(lambda: recorder.poll() is not None or bag.exists() and contacts())
                recorder.kill()
        whole = self.convert(bag, "killed.csv").read_bytes()
        self.assertNotIn(b"\n# end:", whole)
        self.assertGreater(contacts(), 0)
        self.assertEqual(contacts(), sum(line[:1].isdigit() for line in whole.splitlines()))

    def test_what_is_no_recording_is_said(self):
        other = self.folder / "other.mcap"
        writer = Writer(str(other))
        writer.start()
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/chatter", "cdr", schema)
        writer.add_message(channel, 1, b"\0\1\0\0\1\0\0\0\0", 1)
        writer.finish()
        (self.folder / "out.csv").unlink(missing_ok=True)
        said = "an MCAP file, but no recording of a fingertip; give a file that `fingertip record` wrote"
        self.assertIn(said, self.refused("convert", other, self.folder / "out.csv"))
        head = self.folder / "head.mcap"
        head.write_bytes(self.bag.read_bytes()[:50])
        self.assertIn("breaks off before a recording begins", self.refused("replay", head))
        self.assertFalse((self.folder / "out.csv").exists())

    def test_a_full_disk_is_said_and_leaves_what_was_there(self):
        full = self.folder / "full.mcap"
        self.assertIn("nothing was changed", self.refused("convert", self.csv, full, preexec_fn=disk_of(15000)))
        self.assertFalse(full.exists())
        write = "info, *packets = some_packets(3, 4000); writer = RecordingWriter(sys.argv[1], info.body); [writer.packet(each) for each in packets]"
        words, path = [sys.executable, "-c", f"from bags import *; {write}", full], {"PYTHONPATH": ROOT / "tests/support"}
        done = subprocess.run(words, stderr=subprocess.PIPE, text=True, env=os.environ | path, preexec_fn=disk_of(1 << 18))
        self.assertIn("File too large; the file ends early", done.stderr)
        self.assertGreater(len(read_recording(full, salvage=True)["t_us"]), 20)

    def test_without_mcap_it_says_what_to_install_and_csv_files_are_read(self):
        said = r"MCAP files need the package mcap; pip install mcap"
        with mock.patch.dict(sys.modules, {"mcap": None, "mcap.writer": None}):
            with self.assertRaisesRegex(InputError, said):
                RecordingWriter(self.folder / "without.mcap", next(bags.some_packets(1, 0)).body)
            with self.assertRaisesRegex(InputError, said):
                read_recording(self.bag)
        self.assertFalse((self.folder / "without.mcap").exists())
        system = "/usr/bin/python3", "-c", "import fingertip.files as f, sys; print(len(f.read_recording(sys.argv[1])['t_us']))"
        done = subprocess.run(
            [*system, self.csv], capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT / "host_tools/python")}
        )
        self.assertGreater(int(done.stdout), 100, done.stderr)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
