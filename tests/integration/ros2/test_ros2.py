"""Topics of ROS 2 without ROS: what Fast DDS hears, what rosbags reads in it, and what the recording says.

usage: test_ros2.py FAKE_DEVICE FAST_DDS_LISTENER [unittest arguments]. DDS stays on the loopback interface.
"""

# real time: discovery and delivery by DDS on a network
import os
import pathlib
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from unittest import mock

FAKE_DEVICE, LISTENER = (os.path.abspath(path) for path in sys.argv[1:3])
ROOT = pathlib.Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "host_tools/python"
sys.path[:0] = [str(PACKAGE), str(ROOT / "tests/support")]
from fingertip import Fingertip, Flag, ros2  # noqa: E402
from fingertip.mcap_recording import TYPES, contact_of  # noqa: E402
from fingertip.ros_messages import decode  # noqa: E402
from real_time import plugged_in  # noqa: E402
from ros2_judges import DOMAIN, Ears, KINDS, LOCAL, PATIENCE_s, Rosbags, SERIAL, wait_for  # noqa: E402

TOPIC = f"/fingertip/{SERIAL}/"
FRAMES = 300


class Topics(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """Some hundred frames are recorded, published and heard."""
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))
        cls.enterClassContext(mock.patch.dict(os.environ, {**LOCAL, "XDG_RUNTIME_DIR": str(cls.folder)}))
        cls.sent = []
        flags = int(Flag.CONTACT | Flag.FIT_VALID | Flag.TARED | Flag.TANGENTIAL_VALID | Flag.VELOCITY_VALID)
        options = ("rate=200", "health=50", f"flags={flags}", "absent=3")
        with plugged_in(FAKE_DEVICE, cls.folder / "tty", *options) as port, Fingertip(port) as fingertip:
            with ros2.Publisher() as publisher:
                ears = Ears(LISTENER, cls.folder)
                cls.addClassCleanup(ears.process.kill)
                publisher.add(fingertip)
                ears.wait_until_they_hear(publisher)
                while fingertip.take_one():  # what came meanwhile
                    pass
                with fingertip.record(cls.folder / "press.csv"):
                    for frame in fingertip:
                        publisher.frame(frame)
                        publisher.state()
                        cls.sent.append(frame)
                        if len(cls.sent) == FRAMES:
                            break
                ears.wait_for_all(publisher)
                cls.counts = publisher.sent
                cls.refused = publisher.refused
            ears.wait_for("gone")
        cls.heard = ears.close()

    def test_all_that_was_sent_is_heard(self):
        self.assertEqual({topic: len(messages) for topic, messages in self.heard.items()}, self.counts)
        self.assertEqual([self.counts[topic] for topic in KINDS if topic != "/diagnostics"], [FRAMES] * 4)
        self.assertGreater(self.counts["/diagnostics"], 2)
        self.assertEqual(self.refused, 0)

    def test_rosbags_writes_the_same_bytes(self):
        rosbags = Rosbags()
        for topic, messages in self.heard.items():
            self.assertTrue(all(rosbags.writes_the_same(KINDS[topic], data) for data in messages), topic)
        self.assertEqual({KINDS[topic] for topic, messages in self.heard.items() if messages}, set(TYPES) - {"fingertip_msgs/Line"})

    def test_contacts_are_the_rows_of_the_recording(self):
        rows = {}
        for line in (self.folder / "press.csv").read_text().splitlines():
            if line[0].isdigit():
                row = contact_of(line.split(","))
                if row["has_contact"] and row["has_raw"]:  # a health packet parts them
                    rows[row["frame"]] = row
        compared = 0
        for data, frame in zip(self.heard[TOPIC + "contact"], self.sent):
            found = decode("fingertip_msgs/Contact", data)
            self.assertEqual(found["frame"], frame.frame)
            if found["frame"] in rows:
                row = rows[found["frame"]]
                for name, wanted in row.items():
                    got = list(found[name]) if isinstance(wanted, list) else found[name]
                    if isinstance(wanted, float):
                        wanted, got = (struct.pack("<f", value) for value in (wanted, got))
                    self.assertEqual(got, wanted, name)
                compared += 1
        self.assertGreater(compared, 0.9 * FRAMES)

    def test_stamps_are_system_time(self):
        stamps = [decode("geometry_msgs/WrenchStamped", data)["header"]["stamp"] for data in self.heard[TOPIC + "wrench"]]
        ahead_s = [each["sec"] + each["nanosec"] / 1e9 - frame.host_us / 1e6 for each, frame in zip(stamps, self.sent)]
        self.assertLess(max(ahead_s) - min(ahead_s), 0.1)
        self.assertLess(abs(ahead_s[-1] - (time.time() - time.perf_counter())), 0.1)

    def test_diagnostics(self):
        said = [decode("diagnostic_msgs/DiagnosticArray", data)["status"][0] for data in self.heard["/diagnostics"]]
        health = [each for each in said if each["name"] == f"fingertip {SERIAL}"]
        self.assertEqual({each["level"] for each in health}, {1})
        self.assertIn("sensors missing: 3", health[0]["message"])
        self.assertIn("frames", [pair["key"] for pair in health[0]["values"]])
        self.assertEqual([each["message"] for each in said if each["name"].endswith("contact")], ["no warning"])


class Command(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))
        self.environment = {**os.environ, **LOCAL, "PYTHONPATH": str(PACKAGE), "XDG_RUNTIME_DIR": str(self.folder)}

    def ros2(self, *options, **more):
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        words = [sys.executable, str(PACKAGE), "ros2", *map(str, options)]
        command = subprocess.Popen(words, env={**self.environment, **more}, cwd=self.folder, **pipes)
        self.addCleanup(command.communicate)
        self.addCleanup(command.kill)
        return command

    def test_a_fingertip_that_goes_and_comes_back(self):
        ears = Ears(LISTENER, self.folder)
        self.addCleanup(ears.process.kill)
        with plugged_in(FAKE_DEVICE, self.folder / "tty") as port:
            command = self.ros2("--port", port)
            self.assertEqual(command.stdout.readline(), f"domain {DOMAIN}: /fingertip/{SERIAL}\n")
            ears.wait_for("matched")
            wait_for("frames", lambda: all(ears.messages(topic) for topic in KINDS if topic != "/diagnostics"))
        port.unlink(missing_ok=True)
        wait_for("gone", lambda: b"gone" in ears.file_of("/diagnostics").read_bytes())
        with plugged_in(FAKE_DEVICE, self.folder / "tty"):
            wait_for("there again", lambda: b"there again" in ears.file_of("/diagnostics").read_bytes())
            command.send_signal(signal.SIGINT)
            out, error = command.communicate(timeout=PATIENCE_s)
        self.assertEqual((command.returncode, error), (0, ""))
        self.assertRegex(out, rf"(?ms)^{SERIAL}: \d+ frames, lost \d+$.*^/fingertip/{SERIAL}/wrench: \d+ messages$")
        said = [decode("diagnostic_msgs/DiagnosticArray", data)["status"][0] for data in ears.close()["/diagnostics"]]
        self.assertEqual(
            [(each["level"], each["message"]) for each in said if each["name"].endswith("line")],
            [(2, "gone; it is waited for"), (0, "there again")],
        )

    def test_what_is_wrong_is_said(self):
        with plugged_in(FAKE_DEVICE, self.folder / "tty") as port:
            for options, environment, said in (
                (("--port", self.folder / "nothing"), {}, r"fingertip-ros2: .*nothing.*\n"),
                (("--port", port), {"ROS_DOMAIN_ID": "-1"}, r"fingertip-ros2: ROS_DOMAIN_ID -1 is out of range; give 0 to 232\n"),
                (("--port", port, "--domain", "233"), {}, r"fingertip-ros2: domain 233 is out of range; give 0 to 232\n"),
                (("--port", port), {"CYCLONEDDS_URI": "<no"}, r"fingertip-ros2: DDS domain .* is CYCLONEDDS_URI right\?\n"),
            ):
                command = self.ros2(*options, **environment)
                out, error = command.communicate(timeout=PATIENCE_s)
                self.assertEqual((command.returncode, out), (1, ""), error)
                self.assertRegex(error.splitlines(keepends=True)[-1], f"^{said}$")

    def test_without_cyclonedds(self):
        (self.folder / "cyclonedds.py").write_text("raise ImportError\n")
        command = self.ros2(PYTHONPATH=str(self.folder))
        self.assertEqual(
            command.communicate(timeout=PATIENCE_s)[1], "fingertip-ros2: ROS 2 topics need the package cyclonedds; pip install cyclonedds\n"
        )
        self.assertEqual(command.returncode, 1)

    def test_a_reader_that_stalls_delays_nobody(self):
        ears = Ears(LISTENER, self.folder)
        self.addCleanup(ears.process.kill)
        with (
            mock.patch.dict(os.environ, {**LOCAL, "XDG_RUNTIME_DIR": str(self.folder)}),
            plugged_in(FAKE_DEVICE, self.folder / "tty") as port,
            Fingertip(port) as fingertip,
            ros2.Publisher() as publisher,
        ):
            publisher.add(fingertip)
            ears.wait_until_they_hear(publisher)
            ears.process.send_signal(signal.SIGSTOP)
            for frame, _ in zip(fingertip, range(20)):
                publisher.frame(frame)
        self.assertEqual(publisher.sent[TOPIC + "contact"], 20)
        ears.process.send_signal(signal.SIGCONT)
        ears.close()


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
