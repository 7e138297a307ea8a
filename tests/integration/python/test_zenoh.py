"""The bridge and the recorder on Zenoh, with fake devices: usage test_zenoh.py FAKE_DEVICE [unittest arguments]."""

# real time: routers, bridges and recorders are processes on a network
import argparse
import contextlib
import json
import math
import os
import pathlib
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from unittest import mock

import zenoh

FAKE_DEVICE = os.path.abspath(sys.argv[1])
ROOT = pathlib.Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "host_tools/python"
sys.path.insert(0, str(PACKAGE))
from fingertip import errors, network, read_recording, recorder, wire  # noqa: E402
from fingertip.mcap_recording import Contacts, McapLineReader  # noqa: E402

PATIENCE_s = 300


def a_packet(number, t_us=0, frame=0):
    return wire.Packet(number & 0xFFFF, t_us, wire.Raw(frame, 0, 1, 0, 0, 2000, 1, (0, 0)))


def a_stamp(line, number, t_us=0, shared=0):
    return network.Stamp(line, number, t_us * 1000, t_us * 1000, 100.0, 0.0, shared)


class Accounts(unittest.TestCase):
    """Order and counts, without a network."""

    def offer(self, account, line, number, now_s=0.0, sequence=None, shared=0):
        t_us = line * 10**9 + number * 1000
        account.offer(a_stamp(line, number, t_us, shared), a_packet(number if sequence is None else sequence, t_us, number), now_s)

    def taken(self, account):
        found = []
        for stamp, _, lost, restarted in account.take(1.0):
            found.append((None if stamp is None else (stamp.line, stamp.number), lost, restarted))
        self.assertEqual(account.sent, account.recorded + account.lost)
        return found

    def test_any_order_and_twice(self):
        for seed in range(20):
            prng = random.Random(seed)
            account = recorder.Account()
            self.offer(account, 1, 1)
            numbers = [*range(2, 200), *range(50, 120)]
            prng.shuffle(numbers)
            found = [number for number in numbers for _ in [self.offer(account, 1, number)] for number in self.taken(account)]
            self.assertEqual(found, [((1, number), 0, False) for number in range(1, 200)])
            self.assertEqual((account.recorded, account.lost, account.duplicates), (199, 0, 70))

    def test_what_is_gone_is_counted_once(self):
        account = recorder.Account()
        for number in (5, 6, 9, 10):
            self.offer(account, 1, number, now_s=1.0)
        self.assertEqual(self.taken(account), [((1, 5), 0, False), ((1, 6), 0, False)])
        self.assertIsNone(account.ask(1.0))
        self.assertEqual(account.ask(1.0 + 2 * recorder.GAP_s), (1, 7, 10))
        account.answered(1, 10)
        self.assertEqual(self.taken(account), [((1, 9), 2, False), ((1, 10), 0, False)])
        self.offer(account, 1, 7)  # too late
        self.assertEqual((self.taken(account), account.recorded, account.lost), ([], 4, 2))

    def test_the_end_is_known_by_what_the_bridge_says(self):
        account = recorder.Account()
        self.offer(account, 1, 1)
        self.assertEqual(len(self.taken(account)), 1)
        account.heard([(1, 4)], 1.0)
        self.assertFalse(account.is_complete)
        self.assertEqual(account.ask(2.0), (1, 2, 4))
        account.give_up()
        self.assertEqual(self.taken(account), [(None, 3, False)])
        self.assertEqual((account.recorded, account.lost), (1, 3))

    def test_a_bridge_that_was_killed(self):
        account = recorder.Account()
        for number in (1, 2, 5):
            self.offer(account, 1, number, sequence=100 + number)
        self.assertEqual(len(self.taken(account)), 2)
        stamp = a_stamp(2, 1, 10**9 + 720_000)._replace(uncertainty_us=8e5)  # its clock is hardly known yet
        account.offer(stamp, a_packet(120, 10**9 + 20_000), 0.0)
        self.assertEqual(self.taken(account), [])  # the first line may still be whole
        account.heard([(2, 1)], 0.0)
        self.assertEqual(self.taken(account), [((1, 5), 2, False), ((2, 1), 14, False)])
        self.assertEqual((account.recorded, account.lost, account.lost_between_lines, account.restarts), (4, 16, 14, 0))

    def test_a_fingertip_that_was_unplugged(self):
        account = recorder.Account()
        self.offer(account, 1, 1)
        account.offer(a_stamp(2, 1, 60_000_000), a_packet(0, 5000), 0.0)
        self.assertEqual(self.taken(account), [((1, 1), 0, False)])
        account.heard([(1, 3), (2, 1)], 0.0)  # two more of the first line are kept there
        self.assertEqual(account.ask(1.0), (1, 2, 3))
        self.offer(account, 1, 3)
        self.offer(account, 1, 2)
        self.assertEqual(self.taken(account), [((1, 2), 0, False), ((1, 3), 0, False), ((2, 1), 0, True)])
        self.assertEqual((account.recorded, account.lost, account.restarts), (4, 0, 1))

    def test_a_shared_line_is_counted_by_its_frames(self):
        account = recorder.Account()
        self.offer(account, 1, 10, shared=1)
        account.offer(a_stamp(2, 1, 10**9 + 20_000, 1), a_packet(0, 10**9 + 20_000, 20), 0.0)
        account.heard([(2, 1)], 0.0)
        self.assertEqual(self.taken(account)[-1], ((2, 1), 9, False))

    def test_a_clock_that_was_set_back(self):
        account = recorder.Account()
        for number in (1, 2):
            self.offer(account, 9, number)
        self.assertEqual(len(self.taken(account)), 2)
        for number in (1, 2, 4):
            t_us = 9 * 10**9 + 10_000 + 1000 * number
            account.offer(a_stamp(3, number, t_us), a_packet(2 + number, t_us, 2 + number), 0.0)
        account.heard([(3, 4)], 0.0)
        self.assertEqual(self.taken(account), [((3, 1), 0, False), ((3, 2), 0, False)])
        self.assertEqual(account.ask(2.0), (3, 3, 4))
        self.offer(account, 9, 2)  # once more, of the line that is over
        self.assertEqual((account.recorded, account.duplicates), (4, 1))

    def test_a_line_that_began_and_ended_unheard(self):
        account = recorder.Account()
        self.offer(account, 1, 1)
        self.taken(account)
        self.offer(account, 3, 1)  # the first after a cut; the bridge keeps line 2
        account.heard([(1, 1), (2, 2), (3, 1)], 0.0)
        self.assertEqual(self.taken(account), [])
        self.assertEqual(account.ask(1.0), (2, 1, 2))
        self.offer(account, 2, 1)
        self.offer(account, 2, 2)
        self.assertEqual([place for place, _, _ in self.taken(account)], [(2, 1), (2, 2), (3, 1)])
        account.heard([(1, 1), (2, 2)], 0.0)  # said before the last line began
        self.offer(account, 3, 3)
        account.heard([(1, 1), (2, 2)], 0.0)
        self.assertEqual((self.taken(account), account.ask(1.0)), ([], (3, 2, 3)))

    def test_frames_that_no_bridge_read(self):
        for frames, told in ((0, 0), (1, 0), (70_001, 70_000)):
            account = recorder.Account()
            self.offer(account, 1, 1, sequence=5)
            t_us = 10**9 + 1000 + 400 * frames
            account.offer(a_stamp(2, 1, t_us), a_packet(6, t_us, 1 + frames), 0.0)
            account.heard([(2, 1)], 0.0)
            self.assertEqual(len(self.taken(account)), 2)
            self.assertEqual((account.lost, account.restarts, account.unread_frames), (0, 0, told))

    def test_the_last_answer_is_to_a_question_of_the_end(self):
        recording, source = recorder.Recording.__new__(recorder.Recording), recorder._Source("AAAA", 0, None)
        recording._ending, recording._ask, source.status_s = False, mock.Mock(), -math.inf
        recording._ended = mock.Mock(is_set=lambda: recording._ask.call_count == 2)
        recording._ask.side_effect = lambda *_: setattr(source, "must_answer", True)  # the end begins meanwhile
        recording._ask_on(source)
        self.assertEqual([call.args[2] for call in recording._ask.mock_calls], ["status", "answer"])

    def test_damaged_messages_are_counted(self):
        recording = recorder.Recording.__new__(recorder.Recording)
        recording.damaged = 0
        source = recorder._Source("AAAA", 0, None)
        damaged = (b"", b"5", b"[]", b"\xff", b"[" * 100_000, b'{"lines": [[1, Infinity]], "line": 1, "first": 1, "last": Infinity}')
        for data in damaged:
            recording._take_status(source, data, False)
            recording._take(source, "again", data, b"")
        self.assertEqual(recording.damaged, 2 * len(damaged))


class Clocks(unittest.TestCase):
    TRACKING = "C0A80101,ntp.example,3,1700000000.1,-0.000020000,0.000001,0.00002,-8.1,0.0,0.02,0.002000000,0.000500000,64.0,{}\n"

    def test_what_chrony_says(self):
        clock = network.judge_tracking(self.TRACKING.format("Normal"))
        self.assertTrue(clock.disciplined)
        self.assertAlmostEqual(clock.bound_us, 20 + 500 + 1000)
        for text in (self.TRACKING.format("Not synchronised"), "", "506 Cannot talk to daemon\n", "a,b,c\n"):
            clock = network.judge_tracking(text)
            self.assertEqual((clock.disciplined, clock.bound_us), (False, math.inf))
            self.assertIn("clock not disciplined", clock.text)

    def judge(self, hosts, bound_us, may_be_undisciplined=False):
        """hosts: (boot, bound_us or None, ahead_us) each, answered after 200 us there and 200 us back."""

        def ask(_, key):
            serial = network.parts_of(key)[0]
            boot, bound, ahead_us = hosts[int(serial)]
            clock = {"disciplined": bound is not None, "bound_us": bound, "text": "clock not disciplined" if bound is None else "chrony"}
            now_ns = 10**18 + round(ahead_us * 1000)
            status = {"host": f"host{serial}", "boot": boot, "clock": clock, "now_ns": now_ns}
            return {serial: (json.dumps(status).encode(), 10**18 - 200_000, 10**18 + 200_000)}

        with mock.patch.object(recorder, "ask", ask):
            return recorder.judge_clocks(None, [str(number) for number in range(len(hosts))], bound_us, may_be_undisciplined)

    def test_clocks_that_disagree_are_refused(self):
        self.assertEqual(len(self.judge([("a", 900, 0), ("b", 1000, 100), ("a", 900, 0)], 2000)), 3)
        with self.assertRaisesRegex(errors.InputError, "0 and 1 may be 2100 us apart"):
            self.judge([("a", 1000, 0), ("b", 1100, 0)], 2000)
        self.judge([("a", 1500, 0), ("a", 1500, 0)], 2000)  # one clock
        with self.assertRaisesRegex(errors.InputError, "0 and 1 are at least 2600 us apart"):  # whatever chrony says
            self.judge([("a", 10, 0), ("b", 10, -3000)], 2000)
        with self.assertRaisesRegex(errors.InputError, "host1 .1.: clock not disciplined.*--undisciplined"):
            self.judge([("a", 10, 0), ("b", None, 0)], 2000)
        self.assertIn("bound unknown; measured 1000 us", self.judge([("a", 10, 0), ("b", None, 1000)], 2000, True)["1"])
        with self.assertRaisesRegex(errors.InputError, "at least 2600 us apart"):
            self.judge([("a", None, 0), ("b", None, 3000)], 2000, True)

    def test_stamps_and_settings(self):
        stamp = network.Stamp(1 << 60, 7, -5, 1_700_000_000_000_000_000, 12.5, -0.25, 1)
        self.assertEqual((network.Stamp.of(stamp.packed()), len(stamp.packed())), (stamp, 44))
        self.assertRaises(errors.InputError, network.Stamp.of, b"1234")
        self.assertEqual(network.settings_of({"osr": "256", "rate_Hz": "0.5", "keep": "1"}), {"osr": 256, "rate_Hz": 0.5, "keep": True})
        for wrong in ({"osr": "x"}, {"nothing": "1"}):
            self.assertRaises(errors.BadValueError, network.settings_of, wrong)


class OnZenoh(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(self.folder), "PATH": f"{self.folder}:{os.environ['PATH']}"}
        self.environment.pop("FINGERTIP_PORT", None)
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.endpoint = f"tcp/127.0.0.1:{self.port}"

    def start(self, *words, **options):
        process = subprocess.Popen(list(map(str, words)), env=self.environment, **options)

        def end():
            process.kill()
            process.communicate()

        self.addCleanup(end)
        return process

    def device(self, serial, *options):
        port = self.folder / serial
        self.start(FAKE_DEVICE, port, f"serial={serial}", "life=600", *options)
        self.wait_for(port.is_symlink)
        return port

    def bridge(self, *options):
        return self.start(sys.executable, PACKAGE, "bridge", *options, stderr=subprocess.DEVNULL)

    def recorder(self, *options):
        return self.start(sys.executable, PACKAGE, "recorder", *options, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def chrony(self, tracking):
        """What `chronyc` is for bridges from now on."""
        script = self.folder / "chronyc"
        script.write_text(f"#!/bin/sh\nprintf '%s\\n' '{tracking.strip()}'\n", encoding="utf-8")
        script.chmod(0o755)

    def wait_for(self, condition):
        end_s = time.monotonic() + PATIENCE_s
        while not condition():
            self.assertLess(time.monotonic(), end_s, "waited too long")
            time.sleep(0.02)

    @staticmethod
    def lines(path):
        """In a recording that is being written."""
        with contextlib.suppress(errors.InputError):
            return sum(len(each.numbers) if isinstance(each, Contacts) else 1 for each in McapLineReader(path).items())
        return 0

    @contextlib.contextmanager
    def session(self, mode="client", config=None):
        config = config or zenoh.Config()
        config.insert_json5("mode", json.dumps(mode))
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("listen/endpoints" if mode == "router" else "connect/endpoints", json.dumps([self.endpoint]))
        with zenoh.open(config) as session:
            yield session

    def ask(self, session, key):
        """The first answer: an info packet, or what it was refused with."""
        for reply in session.get(key, timeout=PATIENCE_s):
            return wire.decode(reply.ok.payload.to_bytes()).body if reply.ok else reply.err.payload.to_string()
        return None

    def test_a_cut_loses_nothing_and_what_is_lost_is_counted(self):
        self.chrony(Clocks.TRACKING.format("Normal"))
        path = self.folder / "both.mcap"
        with contextlib.ExitStack() as stack:
            router = stack.enter_context(self.session("router"))
            for serial, options in (("AAAA", ()), ("BBBB", ("drop=50",))):
                self.bridge("--connect", self.endpoint, "--port", self.device(serial, "rate=100", *options))
            recording = self.recorder(
                path, "--connect", self.endpoint, "--expect", "2", "--wait", PATIENCE_s, "--patience", PATIENCE_s, "--json"
            )
            self.wait_for(lambda: self.lines(path) > 60 or recording.poll() is not None)
            router.close()
            time.sleep(1)
            stack.enter_context(self.session("router"))
            time.sleep(0.5)
            recording.send_signal(signal.SIGINT)
            stdout, stderr = recording.communicate(timeout=2 * PATIENCE_s)
        self.assertEqual(recording.returncode, 3, stderr)  # what drop=50 lost
        told = json.loads(stdout)["fingertips"]
        self.assertGreater(max(told[serial]["recovered"] for serial in told), 20)
        for serial, every in (("AAAA", 0), ("BBBB", 50)):
            frames = [int(frame) for frame in read_recording(path, serial=serial)["frame"]]
            sent = [frame for frame in range(frames[0], frames[-1] + 1) if not every or frame % every]
            self.assertEqual(frames, sent)
            self.assertEqual(told[serial]["lost"], 2 * (frames[-1] + 1 - frames[0] - len(sent)))
            self.assertEqual(told[serial]["sent"], told[serial]["recorded"] + told[serial]["lost"])
            self.assertFalse(told[serial]["unheard"] or told[serial]["restarts"])
        self.assertGreater(told["BBBB"]["lost"], 0)

    def test_the_manual_s_subscriber(self):
        (code,) = (
            block
            for block in re.findall(r"```python\n(.*?)```", (PACKAGE / "README.md").read_text(encoding="utf-8"), re.S)
            if "import zenoh" in block
        )
        shown = []

        def show(*values):
            shown.append(values)
            if len(shown) == 3:
                raise EOFError

        with self.session("router"), self.assertRaises(EOFError):
            self.bridge("--connect", self.endpoint, "--port", self.device("AAAA"))
            exec(compile(code.replace(network.LOOPBACK, self.endpoint), "README.md", "exec"), {"print": show})
        self.assertEqual([(str(key), force_N) for key, _, _, force_N in shown], 3 * [("fingertip/AAAA/contact", 5)])

    def test_unplugged_and_back(self):
        path = self.folder / "one.mcap"

        def is_alive():
            return bool(list(router.liveliness().get("fingertip/AAAA/alive")))

        with self.session("router") as router:
            device = self.start(FAKE_DEVICE, self.folder / "AAAA", "serial=AAAA", "rate=100", "life=600")
            self.wait_for((self.folder / "AAAA").is_symlink)
            self.bridge("--connect", self.endpoint, "--port", self.folder / "AAAA")
            recording = self.recorder(
                path, "--connect", self.endpoint, "--wait", PATIENCE_s, "--patience", PATIENCE_s, "--json", "--undisciplined"
            )
            self.wait_for(lambda: self.lines(path) > 30 or recording.poll() is not None)
            device.terminate()
            self.wait_for(lambda: not is_alive())
            before = self.lines(path)
            self.device("AAAA", "rate=100")
            self.wait_for(lambda: self.lines(path) > before + 100 and is_alive())
            recording.send_signal(signal.SIGINT)
            stdout, stderr = recording.communicate(timeout=2 * PATIENCE_s)
        told = json.loads(stdout)["fingertips"]["AAAA"]
        self.assertEqual((recording.returncode, told["restarts"], told["lost"], told["sent"]), (3, 1, 0, told["recorded"]), stderr)
        found = read_recording(path, serial="AAAA")
        frames = [int(frame) for frame in found["frame"]]
        again = next(at for at in range(1, len(frames)) if frames[at] < frames[at - 1])
        self.assertEqual(frames, [*range(frames[0], frames[again - 1] + 1), *range(1, frames[-1] + 1)])
        self.assertTrue(any("restarted" in event for event in found.events), found.events)

    def test_without_a_router_a_signal_ends_it(self):
        recorder = self.recorder(self.folder / "x.csv", "--connect", self.endpoint)
        self.assertEqual(recorder.stderr.readline(), f"fingertip-recorder: connecting to {self.endpoint}\n")
        recorder.send_signal(signal.SIGINT)
        self.assertEqual(recorder.wait(PATIENCE_s), -signal.SIGINT)

    def test_without_options_it_is_this_computer_alone(self):
        parser = argparse.ArgumentParser()
        network.add_session_options(parser)
        here, there = "tcp/127.0.0.1:7447", "tcp/0.0.0.0:7447"
        for words, serves, listens, connects in (([], True, here, None), ([], False, None, here), (["--listen", there], True, there, None)):
            with mock.patch.object(zenoh, "open") as opened:
                network.open_session(parser.parse_args(words), serves=serves)
            config = opened.call_args[0][0]
            for name, endpoint in (("listen", listens), ("connect", connects)):
                found = json.loads(config.get_json(f"{name}/endpoints"))
                self.assertEqual(found, [endpoint] if endpoint else json.loads(zenoh.Config().get_json(f"{name}/endpoints")), name)
            self.assertEqual(config.get_json("scouting/multicast/enabled"), "false")

    def test_commands_liveliness_and_clocks(self):
        tared, unasked = self.folder / "tared", self.folder / "unasked"
        with self.session("router") as session:
            self.chrony(Clocks.TRACKING.format("Not synchronised"))
            for serial, tared_at, options in (("AAAA", tared, ["--commands"]), ("BBBB", unasked, [])):
                self.bridge("--connect", self.endpoint, "--port", self.device(serial, f"tared={tared_at}"), *options)
            self.wait_for(lambda: len(list(session.liveliness().get("fingertip/*/alive"))) == 2)
            for command in ("tare?force=1", "set?osr=512"):
                self.assertIn("start it with --commands", self.ask(session, f"fingertip/BBBB/{command}"))
            self.assertEqual(self.ask(session, "fingertip/AAAA/info").serial, "AAAA")
            self.assertEqual(self.ask(session, "fingertip/AAAA/set?osr=512;rate_Hz=50").osr, 512)
            self.assertIn("256, 512", self.ask(session, "fingertip/AAAA/set?osr=500"))
            self.assertIn("no setting", self.ask(session, "fingertip/AAAA/set?nothing=1"))
            self.assertFalse(tared.exists())
            self.assertEqual(self.ask(session, "fingertip/AAAA/tare?force=1").serial, "AAAA")
            self.wait_for(tared.exists)
            self.assertFalse(unasked.exists())
            refused = self.recorder(self.folder / "x.mcap", "--connect", self.endpoint, "--wait", PATIENCE_s)
            self.assertIn("clock not disciplined", refused.communicate(timeout=PATIENCE_s)[1])
            self.assertEqual((refused.returncode, (self.folder / "x.mcap").exists()), (1, False))

    def certificate(self, name, authority=True):
        """name.pem and name.key, by the commands that the example has."""
        text = (PACKAGE / "zenoh_examples/router.json5").read_text(encoding="utf-8")
        own, by_authority = re.findall(r"//     (openssl .*)", text)
        command = by_authority.replace("NAME", name).replace("HOST", "localhost") if authority else re.sub(r"\bca\b", name, own)
        subprocess.run(command.split(), cwd=self.folder, check=True, capture_output=True)

    def example(self, name, own, **replaced):
        """A configuration out of host_tools/python/zenoh_examples, with our files and port."""
        text = (PACKAGE / "zenoh_examples" / name).read_text(encoding="utf-8")
        for old, new in {
            "/etc/fingertip/zenoh/own": f"{self.folder}/{own}",
            "/etc/fingertip/zenoh": str(self.folder),
            "0.0.0.0:7447": f"127.0.0.1:{self.port}",
            "router.example:7447": f"localhost:{self.port}",
            **replaced,
        }.items():
            text = text.replace(old, new)
        path = self.folder / f"{own}.json5"
        path.write_text(text, encoding="utf-8")
        return path

    def test_tls_and_access_control_as_in_the_examples(self):
        self.certificate("ca", authority=False)
        self.certificate("strange", authority=False)
        tared = self.folder / "tared"
        for name in ("router", "bridge", "recorder", "operator", "viewer", "unlisted"):
            self.certificate(name)
        with zenoh.open(zenoh.Config.from_file(self.example("router.json5", "router"))):
            self.bridge("--config", self.example("client.json5", "bridge"), "--commands", "--port", self.device("AAAA", f"tared={tared}"))
            with (
                zenoh.open(zenoh.Config.from_file(self.example("client.json5", "viewer"))) as viewer,
                zenoh.open(zenoh.Config.from_file(self.example("client.json5", "operator"))) as operator,
            ):
                self.wait_for(lambda: self.ask(viewer, "fingertip/AAAA/info"))
                heard = []
                subscriber = viewer.declare_subscriber("fingertip/*/contact", heard.append)
                self.wait_for(lambda: heard)
                self.assertEqual(wire.decode(heard[0].payload.to_bytes()).body.force_N, 5)
                subscriber.undeclare()
                recording = self.recorder(
                    self.folder / "one.mcap", "--config", self.example("client.json5", "recorder"), "--undisciplined", "--seconds", "1"
                )
                recording.communicate(timeout=PATIENCE_s)
                self.assertEqual(recording.returncode, 0)
                for name in ("viewer", "recorder", "bridge", "unlisted"):
                    with zenoh.open(zenoh.Config.from_file(self.example("client.json5", name))) as other:
                        for selector in ("AAAA/tare", "AAAA/tare?force=1", "*/tare?force=1", "*/*?force=1", "**", "AAAA/set?osr=512"):
                            self.assertIsNone(self.ask(other, f"fingertip/{selector}"), (name, selector))
                        if name in ("bridge", "unlisted"):
                            self.assertIsNone(self.ask(other, "fingertip/AAAA/info"), name)
                self.assertEqual(self.ask(operator, "fingertip/AAAA/set?osr=2048").osr, 2048)
                self.assertFalse(tared.exists())
                self.assertEqual(self.ask(operator, "fingertip/AAAA/tare?force=1").serial, "AAAA")
                self.wait_for(tared.exists)  # the device answers before it tares
            once = {"timeout_ms: -1": "timeout_ms: 1000", "exit_on_failure: false": "exit_on_failure: true"}
            for own, replaced in (("nobody", {"connect_certificate": "//", "connect_private_key": "//"}), ("strange", {})):
                config = zenoh.Config.from_file(self.example("client.json5", own, **replaced, **once))
                with self.assertRaises(zenoh.ZError, msg=own):
                    zenoh.open(config).close()
            once["timeout_ms: -1"] = f"timeout_ms: {PATIENCE_s * 1000}"
            zenoh.open(
                zenoh.Config.from_file(self.example("client.json5", "viewer", **once))
            ).close()  # the others were refused for their certificates


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
