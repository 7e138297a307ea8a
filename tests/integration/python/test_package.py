"""The Python package against the C codec, and against fake devices on simulated time.

usage: test_package.py FINGERTIP SIMULATED_FINGERTIP SIMULATED_DEVICE TIME_KEEPER [unittest arguments]
"""

import importlib
import math
import os
import pathlib
import random
import re
import resource
import signal
import subprocess
import sys
import threading
import unittest
from unittest import mock

import numpy as np

FINGERTIP, SIMULATED_FINGERTIP, SIMULATED_DEVICE, TIME_KEEPER = (os.path.abspath(path) for path in sys.argv[1:5])
ROOT = pathlib.Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "host_tools/python"
sys.path[:0] = [str(PACKAGE), str(ROOT / "tests/support")]
import bags  # noqa: E402
import fingertip  # noqa: E402
from fingertip import Fingertip, Fingertips, Flag, Streams, clock, device, errors, host_time, transport, wire  # noqa: E402
from simulated_host_time import SimulatedHostTime  # noqa: E402
from world_case import WorldCase  # noqa: E402

PATIENCE_s = 60
SERIAL = "E660583883265A2C"  # of the fake device where none is said


def vectors():
    """name -> what a file of tests/vectors/wire calls packet and frame, and its text."""
    found = {}
    for path in sorted((ROOT / "tests/vectors/wire").glob("*.txt")):
        text = path.read_text(encoding="utf-8")
        packet, frame = (bytes.fromhex(part) for part in re.sub("#.*", "", text).split("packet")[1].split("frame"))
        found[path.stem] = {"packet": packet, "frame": frame, "text": text}
    return found


class DeviceTest(WorldCase):
    TIME_KEEPER, DEVICE = TIME_KEEPER, SIMULATED_DEVICE

    def setUp(self):
        super().setUp()
        self.enterContext(mock.patch.dict(os.environ, self.environment, clear=True))
        self.host = SimulatedHostTime(self.world)
        host_time.use(self.host)
        self.addCleanup(host_time.use, host_time.HostTime())

    def call(self, *words):
        done = subprocess.run([FINGERTIP, *words], capture_output=True, text=True, timeout=PATIENCE_s)
        self.assertEqual(done.returncode, 0, done.stderr)

    def until_gone(self, fingertip_):
        frames = []
        with self.assertRaises(fingertip.GoneError):
            for frame in fingertip_:
                frames.append(frame)
        return frames


class Codec(DeviceTest):
    def test_each_field_is_what_its_vector_states(self):
        protocol = (ROOT / "firmware/wire/PROTOCOL.md").read_text(encoding="utf-8")
        specified = {int(number, 16) for number in re.findall(r"(?m)^(?:### |\| )0x([0-9A-F]{2}) [\w|]", protocol)}
        self.assertEqual({each["packet"][1] for each in vectors().values()}, specified)
        self.assertGreaterEqual(len(specified), 20)
        stated = 0
        for name, vector in vectors().items():
            packet = wire.decode(vector["frame"][:-1])
            self.assertEqual(wire.encode(packet), vector["frame"], name)
            body = packet.body
            for field, text in re.findall(r"(?m)# (\w+) (0x[0-9a-f]+|-?[0-9.]+)\b", vector["text"]):
                if isinstance(getattr(body, field, None), (int, float)):
                    stated += 1
                    value = float(text) if "." in text else int(text, 0)
                    self.assertEqual(getattr(body, field), value, (name, field))
        self.assertGreater(stated, 200)
        found = {name: wire.decode(vector["frame"][:-1]).body for name, vector in vectors().items()}
        self.assertTrue(math.isnan(found["contact_none"].x_mm) and math.isnan(found["contact"].qx_N))
        self.assertEqual((found["info_raw"].slip_window_ms, found["health_raw"].fit_failures, found["info"].sync), (None, None, None))

    def test_values_that_the_protocol_forbids(self):
        contact = wire.decode(vectors()["contact"]["frame"][:-1])
        for bad in (
            contact._replace(body=contact.body._replace(x_mm=math.inf)),
            contact._replace(sequence=65536),
            contact._replace(body=contact.body._replace(frame=-1)),
            wire.Packet(0, 0, wire.Raw(0, 0, 0, 0, 0, 0, 37, (0,) * 74)),
            wire.Packet(0, 0, wire.Raw(0, 0, 0, 0, 0, 0, 2, (0,) * 3)),
        ):
            with self.assertRaises(errors.FormatError):
                wire.encode(bad)

    def test_what_it_writes_is_what_c_writes_of_the_same_line(self):
        packets = [packet._replace(sequence=number & 0xFFFF) for number, packet in enumerate(bags.some_packets(1, 400), 65500)]
        pathlib.Path(self.path("line.ftr")).write_bytes(b"\0" + b"".join(map(wire.encode, packets)))
        self.call("convert", self.path("line.ftr"), self.path("c.csv"))
        with fingertip.RecordingWriter(self.path("python.csv"), packets[0].body) as writer:
            for packet in packets:
                writer.packet(packet)
        by_c, by_python = (pathlib.Path(self.path(name)).read_text(encoding="utf-8") for name in ("c.csv", "python.csv"))
        rows = r"(?m)^\d.*$"
        self.assertGreater(len(re.findall(rows, by_c)), 300)
        self.assertEqual(re.findall(rows, by_python), re.findall(rows, by_c))


class Clock(unittest.TestCase):
    def exchanges(self, prng, count, drift_ppm, offset_us=0):
        """Every 0.5 s, with what the way there and back takes; and the truth."""
        for i in range(count):
            host = 10_000_000 + i * 500_000
            there, back = (round(prng.expovariate(1 / 300)) + 60 for _ in range(2))
            yield clock.ClockExchange(host, host + there + back, round((host + there + offset_us) * (1 + drift_ppm * 1e-6))), host + there

    def test_the_bound_holds_and_the_drift_is_found(self):
        for seed, drift_ppm in enumerate((0, 40, -90)):
            fit = clock.ClockFit()
            for exchange, host in self.exchanges(random.Random(seed), 90, drift_ppm):
                fit.add(exchange)
                self.assertLessEqual(abs(fit.estimate.host_at(exchange.device_us) - host), fit.estimate.uncertainty_us + 1)
            self.assertAlmostEqual(fit.estimate.drift_ppm, drift_ppm, delta=12)
            self.assertLess(fit.estimate.uncertainty_us, 250)
            self.assertEqual(fit.jumps, 0)

    def test_a_jump_is_told_and_survived(self):
        fit, prng = clock.ClockFit(), random.Random(7)
        for exchange, _ in self.exchanges(prng, 20, 10):
            fit.add(exchange)
        for exchange, host in list(self.exchanges(prng, 60, 10, 50_000))[20:]:
            fit.add(exchange)
        self.assertGreaterEqual(fit.jumps, 1)
        self.assertLessEqual(abs(fit.estimate.host_at(exchange.device_us) - host), fit.estimate.uncertainty_us + 1)
        before = fit.estimate
        fit.add(clock.ClockExchange(10, 5, exchange.device_us + 1))  # ends before it began
        fit.add(clock.ClockExchange(5, 10, 3))  # the fingertip's clock does not run backwards
        self.assertEqual(fit.estimate, before)


class Streaming(DeviceTest):
    def test_every_frame_in_order_then_gone(self):
        with self.device("frames=300"), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            self.assertEqual((tip.serial, tip.info.board, tip.info.sensors), (SERIAL, "pico_mux", 15))
            frames = self.until_gone(tip)
            self.assertEqual([frame.frame for frame in frames], list(range(1, 301)))
            self.assertTrue(all(frame.has_contact and frame.has_raw and frame.run == 0 for frame in frames))
            self.assertEqual((tip.statistics.dropped_packets, tip.statistics.crc_errors, tip.overrun_frames), (0, 0, 0))
            frame = frames[-1]
            self.assertEqual(frame.force_N, 5)
            self.assertIn(Flag.FIT_VALID, frame.flags)
            self.assertTrue(math.isnan(frame.sensors_Pa[0]) and abs(frame.sensors_Pa[1] - 101325) < 100)  # sensor 0 is no measurement there
            self.assertLess(abs(fingertip.host_now_us() - frame.host_us), PATIENCE_s * 1e6)
            self.assertRaises(fingertip.GoneError, tip.latest)
            self.assertRaises(fingertip.GoneError, tip.tare)

    def test_losses_and_damage_are_counted(self):
        with self.device("frames=200", "drop=50", "flip=40"), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            frames = self.until_gone(tip)
            # 4 frames lose both packets, the last one unseen; 4 (the 200th is lost whole) their contact to a flipped bit
            self.assertEqual(len(frames), 196)
            without = [frame for frame in frames if not frame.has_contact]
            self.assertEqual([frame.frame for frame in without], [40, 80, 120, 160])
            self.assertTrue(all(math.isnan(frame.x_mm) and math.isnan(frame.force_N) and not frame.trusted for frame in without))
            statistics = tip.statistics
            self.assertEqual(statistics.crc_errors + statistics.format_errors, 4)
            self.assertEqual(statistics.dropped_packets, 6 + 4)

    def test_quantities_without_their_flag_are_nan(self):
        with self.device(f"flags={int(Flag.CONTACT | Flag.TARED)}"), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            block = tip.read_block(20)
            for name in ("x_mm", "force_N", "slip_mm", "sigma_x_mm", "qx_N", "vx_mm_s", "location_sd_mm"):
                self.assertTrue(np.isnan(block[name]).all(), name)
            self.assertTrue(block.flag(Flag.CONTACT).all() and not block.trusted.any())

    def test_blocks(self):
        with self.device(), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            block = tip.read_block(50)
            self.assertEqual((len(block), block.sensors_Pa.shape, block.tare_Pa.shape), (50, (50, 15), (50, 15)))
            self.assertRaisesRegex(KeyError, "no force; did you mean force_N", block.__getitem__, "force")
            self.assertRaisesRegex(KeyError, "no len; it has frame, run, ", block.__getitem__, "len")
            self.assertRaisesRegex(TypeError, "no frame 0, but arrays", block.__getitem__, 0)
            self.assertRaisesRegex(TypeError, "'Block' object is not iterable", iter, block)
            self.assertEqual(("x_mm" in block, "sensors_Pa" in block, "x" in block), (True, True, False))
            self.assertRegex(repr([block, tip]), r"<Block of 50 frames in 0\.\d\d s, 50 with .*, <Fingertip \w+ on \w+, .*>")
            np.testing.assert_array_equal(np.diff(block.frame), 1)
            self.assertTrue(np.isnan(block.sensors_Pa[:, 0]).all() and np.isfinite(block.sensors_Pa[:, 1:]).all())
            np.testing.assert_allclose(np.hypot(block.x_mm / 8, block.y_mm / 16), 1, rtol=1e-4)
            block = tip.read_block(seconds=0.1)
            self.assertGreaterEqual(block.t_us[-1] - block.t_us[0], 100_000)
            for block, _ in zip(tip.blocks(10), range(2)):
                self.assertEqual(len(block), 10)
            self.assertGreater(tip.latest().frame, block.frame[0])
            tip.close()
            self.assertRaisesRegex(fingertip.GoneError, "closed", tip.record, self.path("r.csv"))
            list(tip)  # what waited is still there
            self.assertEqual((len(list(tip)), len(tip.read_block(5))), (0, 0))

    def test_only_what_was_asked_for(self):
        with self.device(), Fingertip(self.port, streams=Streams.CONTACT, timeout_s=PATIENCE_s) as tip:
            self.assertEqual(tip.read_info().streams, Streams.CONTACT)
            self.assertTrue(next(iter(tip)).has_contact)
            tip.set_streams(Streams.RAW)
            self.assertEqual(tip.read_info().streams, Streams.RAW)
            self.assertRaises(fingertip.BadValueError, tip.set_streams, 8)

    def test_a_late_program_loses_the_oldest_and_is_told(self):
        with self.device("frames=200"), Fingertip(self.port, buffer_frames=20, timeout_s=PATIENCE_s) as tip:
            self.world.until(lambda: tip.statistics.packets > 400 and tip.is_closed is False and tip._line.error is not None)
            self.assertEqual(tip.read_block(1000).frame.tolist(), list(range(181, 201)))
            self.assertRaises(fingertip.GoneError, tip.read_block, 1000)
            self.assertEqual(tip.overrun_frames, 180)

    def test_a_full_disk_ends_the_recording_alone(self):
        with self.device(), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            self.assertRaisesRegex(fingertip.InputError, "No space left on device", tip.record, "/dev/full", replace=True)
            self.assertRaisesRegex(fingertip.InputError, "must end with .csv or .mcap", tip.record, self.path("r.bag"))
            most_bytes = resource.getrlimit(resource.RLIMIT_FSIZE)
            resource.setrlimit(resource.RLIMIT_FSIZE, (0, most_bytes[1]))
            self.assertRaisesRegex(fingertip.InputError, "File too large", tip.record, self.path("r.csv"))
            resource.setrlimit(resource.RLIMIT_FSIZE, most_bytes)
            writer = tip.record(self.path("r.csv"))  # there is none: nothing could be written
            self.assertRaises(fingertip.BadValueError, tip.record, self.path("other.csv"))
            self.assertRaisesRegex(fingertip.InputError, "is being rec", fingertip.RecordingWriter, writer.path, tip.info, replace=True)
            tip.read_block(20)
            full = open("/dev/full", "wb", buffering=0)
            self.addCleanup(full.close)
            real, writer._file._file = writer._file._file, full
            tip.read_block(60)
            real.close()
            self.assertRaisesRegex(fingertip.InputError, "No space left on device; the file ends early", writer.close)
            np.testing.assert_array_equal(np.diff(tip.read_block(20).frame), 1)
            with tip.record(self.path("other2.csv")):
                tip.read_block(20)
        for name in ("r.csv", "other2.csv"):
            self.assertGreater(len(fingertip.read_recording(self.path(name)).has_contact), 10)

    def test_silence_is_told(self):
        with self.device("stall=20"), Fingertip(self.port, timeout_s=0.3) as tip:
            self.world.until(lambda: tip.statistics.packets > 40)
            with self.assertRaises(fingertip.NoFrameError):
                while True:  # what is old is not the latest
                    tip.latest()
                    self.world.sleep(0.05)
            with self.assertRaisesRegex(fingertip.NoFrameError, "no frame in 0.3 s"):
                for _ in tip:
                    pass

    def test_closing_ends_iteration_in_another_thread(self):
        with self.device(), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            taken = []
            thread = self.host.thread(lambda: taken.extend(tip))
            thread.start()
            self.world.until(lambda: taken)
            tip.close()
            thread.join(PATIENCE_s)
            self.assertFalse(thread.is_alive())

    def test_unplugged_and_back(self):
        with self.device("vanish=60,400"), Fingertip(self.port, reconnect=True, timeout_s=PATIENCE_s) as tip:
            with tip.record(self.path("r.csv")):
                frames = []
                for frame in tip:
                    frames.append(frame)
                    if frame.run == 1 and frame.frame >= 40:
                        break
            self.assertEqual([frame.frame for frame in frames if frame.run == 0], list(range(frames[0].frame, 61)))
            returned = [frame for frame in frames if frame.run == 1]
            self.assertEqual([frame.frame for frame in returned], list(range(1, len(returned) + 1)))
            self.assertFalse(math.isnan(returned[0].host_us))
            self.assertEqual((tip.run, tip.statistics.dropped_packets), (1, 0))
            tip.tare()
        self.assertEqual(fingertip.read_recording(self.path("r.csv")).events, ["gone", "back"])

    def test_another_one_comes_back(self):
        with self.device("serial=AAAA", "frames=40"), Fingertip(self.port, reconnect=True, timeout_s=PATIENCE_s) as tip:
            iterator = iter(tip)
            next(iterator)
            self.world.until(lambda: tip.is_returning)
            with self.device("serial=BBBB"):
                with self.assertRaisesRegex(fingertip.OtherFingertipError, "is fingertip BBBB, not AAAA"):
                    for _ in iterator:
                        pass

    def test_recorded_as_the_tool_records(self):
        with self.device("frames=250", "calibrated=1", "pad=1"), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            self.assertEqual(len(tip.info.calibration.gains), 15)
            self.assertEqual(len(tip.info.pad.normal), 4)
            with tip.record(self.path("r.csv")) as writer:
                frames = self.until_gone(tip)
            self.assertRaises(fingertip.InputError, fingertip.RecordingWriter, writer.path, tip.info)
        self.call("replay", self.path("r.csv"), "--speed", "max")
        recording = fingertip.read_recording(self.path("r.csv"))
        self.assertEqual((recording.end["reason"], recording.end["dropped_packets"]), ("gone", "0"))
        self.assertEqual((len(recording), "x_mm" in recording, 0 in recording), (len(recording["x_mm"]), True, False))
        self.assertRaisesRegex(KeyError, "no 0, but columns by their names: t_us, ", recording.__getitem__, 0)
        recorded = {int(frame): i for i, frame in enumerate(recording["frame"])}
        rows = [recorded[frame.frame] for frame in frames if frame.frame in recorded]
        self.assertGreater(len(rows), 200)
        np.testing.assert_array_equal(
            np.float32(recording["x_mm"][rows]), np.float32([frame.x_mm for frame in frames if frame.frame in recorded])
        )
        self.assertEqual(recording.metadata["gains"].split()[0], f"{tip.info.calibration.gains[0]:g}")

    def test_edges_at_the_sync_pin(self):
        with self.device("frames=100", "edges=10", "capabilities=23"), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            self.assertEqual(tip.info.sync, 0)
            self.assertEqual(tip.set(sync="second").sync, 3)
            for wrong in ("out", "1", ""):
                with self.assertRaisesRegex(fingertip.BadValueError, "give one of in, frame, second, or off"):
                    tip.set(sync=wrong)
            self.assertEqual(tip.set(sync="off").sync, 0)
            with tip.record(self.path("r.csv")):
                frames = {frame.frame: frame for frame in self.until_gone(tip)}
            edges = tip.sync_edges
        self.assertEqual([edge.number for edge in edges], [1, 2, 4, 5, 6, 7, 8, 9, 10])
        for edge in edges:
            self.assertEqual((edge.t_us, edge.level), (frames[10 * edge.number].t_us, edge.number % 2))
            self.assertLess(abs(edge.time_us - frames[10 * edge.number].host_us), 1000)
        recording = fingertip.read_recording(self.path("r.csv"))
        recorded = recording.sync_edges
        self.assertEqual([edge[:3] for edge in recorded], [edge[:3] for edge in edges][-len(recorded) :])
        self.assertTrue(len(recorded) >= 8 and math.isnan(recorded[0].time_us))
        self.assertEqual((recording.end["edges"], recording.end["edges_missing"]), (str(len(recorded)), "1"))


class Commands(DeviceTest):
    def test_set_tare_and_health(self):
        with self.device(f"tared={self.path('tared')}"), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            tip.tare()
            self.world.until(lambda: os.path.exists(self.path("tared")))  # the device answers before it tares
            info = tip.set(rate_Hz=400, osr=256, slip_threshold_mm=0.25, prior_sigma_mm=3, location_limit_mm=0.5, keep=True)
            told = dict(rate_mHz=400000, osr=256, slip_threshold_mm=0.25, prior_sigma_mm=3.0, prior_width_mm=0.5, location_limit_mm=0.5)
            self.assertLessEqual((told | {"slip_window_ms": 100}).items(), info._asdict().items())  # it travels with the threshold
            self.assertTrue(info.stored & fingertip.Stored.SETTINGS)
            self.assertEqual(tip.set(prior_sigma_mm=0).prior_sigma_mm, 0)
            self.assertEqual(tip.read_health().stack_free_bytes, tip.health.stack_free_bytes)
            self.assertLess(tip.clock.uncertainty_us, 1e6)

    def test_wrong_values_are_named_and_nothing_is_sent(self):
        with self.device(), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            sent = tip.read_info()
            for wrong, said in (
                ({"osr": 300}, "256, 512"),
                ({"rate_Hz": "max"}, "rate_Hz 'max' is unknown; give"),
                ({"prior_width_mm": 1}, "needs"),
                ({}, "nothing to set"),
                ({"osr": 512, "rate_Hz": -1}, "rate_Hz -1"),
            ):
                with self.assertRaisesRegex(fingertip.BadValueError, said):
                    tip.set(**wrong)
            self.assertEqual(tip.read_info()._replace(measured_rate_mHz=0), sent._replace(measured_rate_mHz=0))
            self.assertRaises(fingertip.BadValueError, tip.read_block)
            self.assertRaises(fingertip.BadValueError, tip.read_block, 0)
            self.assertRaises(fingertip.BadValueError, tip.latest, math.nan)
        self.assertRaises(fingertip.BadValueError, Fingertips, serials=SERIAL)
        self.assertEqual((str(Flag.FLAT | Flag.MODEL), f"{Flag(0)}"), ("FLAT|MODEL", "0"))
        for wrong in ({"buffer_frames": 0}, {"latency_ms": -1}, {"timeout_s": 0}, {"serial": 5}):
            self.assertRaises(fingertip.BadValueError, Fingertip, self.port, **wrong)

    def test_refusals_have_their_type(self):
        with self.device("refuse=1"), Fingertip(self.port, timeout_s=PATIENCE_s) as tip:
            with self.assertRaisesRegex(fingertip.NotNowError, "refused Tare: not now"):
                tip.tare()
            self.assertTrue(next(iter(tip)).frame)

    def test_no_answer_and_another_version(self):
        with self.device("version=4"), self.assertRaisesRegex(fingertip.OtherVersionError, "speaks protocol version 4, not 9"):
            Fingertip(self.port)
        with mock.patch.object(device, "ANSWER_TIMEOUT_s", 0.2), self.device("mute=1"):
            self.assertRaisesRegex(fingertip.NoAnswerError, "no answer to AskInfo", Fingertip, self.port)


class Choosing(DeviceTest):
    def test_nothing_there(self):
        with self.assertRaisesRegex(fingertip.NoSuchPortError, "no such port"):
            Fingertip(self.path("nothing"))
        with self.assertRaisesRegex(fingertip.NotAPortError, "no serial port"):
            Fingertip("/dev/null")
        with mock.patch("fingertip.discovery.find_usb", return_value=[]):
            self.assertRaisesRegex(fingertip.NoFingertipError, "no fingertip found", Fingertip)
            self.assertRaisesRegex(fingertip.NoFingertipError, "no fingertip AA here", Fingertip, serial="AA")
        self.assertRaises(fingertip.NotSharedError, Fingertip, self.path("x"), share=True)

    def test_reasons_of_the_system(self):
        for error, kind in (
            (PermissionError(13, "x"), errors.PermissionDeniedError),
            (OSError(16, "x"), errors.PortInUseError),
            (OSError(None, "could not open port 'COM9': FileNotFoundError(2, 'x')"), errors.NoSuchPortError),
        ):
            self.assertIs(type(transport._port_error("p", error)), kind)

    def test_by_serial_number(self):
        other = self.path("tty2")
        os.environ["FINGERTIP_PORT"] = f"{self.port}:{other}"
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=other):
            self.assertRaisesRegex(fingertip.SeveralFingertipsError, "choose one", Fingertip)
            with Fingertip(serial="bbbb", timeout_s=PATIENCE_s) as tip:
                self.assertEqual((tip.serial, tip.description), ("BBBB", other))
            self.assertRaisesRegex(fingertip.NoFingertipError, "there are: AAAA, BBBB", Fingertip, serial="CCCC")
            self.assertRaisesRegex(fingertip.OtherFingertipError, "is fingertip AAAA, not BBBB", Fingertip, self.port, serial="BBBB")

    def test_the_share_socket(self):
        os.environ["FINGERTIP_PORT"] = self.port
        with self.device(), open(self.path("log"), "w", encoding="utf-8") as log:
            server = self.world.start([SIMULATED_FINGERTIP, "serve"], stderr=log)
            self.world.until(lambda: os.path.exists(self.path(f"fingertip/{SERIAL}.sock")))
            with Fingertip(timeout_s=PATIENCE_s) as one, Fingertip(serial=SERIAL, share=True, timeout_s=PATIENCE_s) as two:
                for tip in (one, two):
                    self.assertTrue(tip.description.endswith(f"{SERIAL}.sock"), tip.description)
                    np.testing.assert_array_equal(np.diff(tip.read_block(50).frame), 1)
                one.set(osr=512)
                self.assertEqual(two.read_info().osr, 512)
                self.assertRaises(fingertip.PortInUseError, Fingertip, self.port, share=False)
                server.send_signal(signal.SIGINT)
                self.until_gone(two)
            server.wait()


class Order(unittest.TestCase):
    """Frames of several, where each comes at its own time."""

    class Told:
        patience_s = PATIENCE_s
        is_returning = False

        def __init__(self, *times_us):
            self.waiting = [mock.Mock(host_us=fingertip.host_now_us() + each) for each in times_us]

        is_closed = property(lambda self: not self.waiting)

        def take_one(self):
            return self.waiting.pop(0) if self.waiting else None

        def give_back(self, frames):
            self.waiting[:0] = frames

    def order(self, **told):
        both = object.__new__(Fingertips)
        both._opened, both._news = told, threading.Event()
        return [frame.host_us for frame in iter(lambda: next(iter(both), None), None)]  # each by an iteration of its own

    def test_by_time_and_nobody_waits_for_the_late(self):
        host_us = self.order(a=self.Told(-9e6, -5e6, -1e6), b=self.Told(-8e6, -7e6))
        self.assertEqual(len(host_us), 5)
        self.assertEqual(host_us, sorted(host_us))
        self.assertEqual(len(self.order(a=self.Told(-9e6, 1e5), b=self.Told())), 2)


class Together(DeviceTest):
    def test_two_fingertips_on_one_clock(self):
        other = self.path("tty2")
        os.environ["FINGERTIP_PORT"] = f"{self.port}:{other}"
        with self.device("serial=AAAA"), self.device("serial=BBBB", "started=1000", "rate=150", port=other):
            with Fingertips(timeout_s=PATIENCE_s) as both, both.record(self.path("j.csv")):
                self.assertEqual(set(both.by_serial), {"AAAA", "BBBB"})
                self.assertRaises(fingertip.BadValueError, both.by_serial["BBBB"].record, self.path("x.csv"))
                frames = [frame for frame, _ in zip(both, range(250))]
                self.assertEqual(set(both.latest()), {"AAAA", "BBBB"})
            self.assertRaisesRegex(fingertip.BadValueError, "named twice", Fingertips, serials=["AAAA", "AAAA"], share=None)
        self.assertGreater(min(frame.t_us for frame in frames if frame.serial == "BBBB"), 1e9)
        host_us = [frame.host_us for frame in frames]
        self.assertLess(max(host_us) - min(host_us), PATIENCE_s * 1e6)
        text = pathlib.Path(self.path("j.csv")).read_text(encoding="utf-8")
        self.assertRegex(text, r"(?m)^# 1/clock: t_us=\d{10} time_us=")
        with self.assertRaisesRegex(fingertip.InputError, 'holds several fingertips; choose one with serial="AAAA" or serial="BBBB"$'):
            fingertip.read_recording(self.path("j.csv"))
        with self.assertRaisesRegex(fingertip.InputError, "no fingertip CCCC in it; choose one of AAAA BBBB$"):
            fingertip.read_recording(self.path("j.csv"), serial="CCCC")
        for serial in ("AAAA", "BBBB"):
            recording = fingertip.read_recording(self.path("j.csv"), serial=serial)
            self.assertEqual((recording.end["dropped_packets"], recording.end["reason"]), ("0", "closed"))
            self.call("convert", self.path("j.csv"), "--device", serial, self.path(f"{serial}.csv"))
            alone = fingertip.read_recording(self.path(f"{serial}.csv"))
            np.testing.assert_array_equal(alone["x_mm"], recording["x_mm"])
            self.assertEqual(alone.packets, recording.packets)
            taken = {frame.frame: frame for frame in frames if frame.serial == serial}
            np.testing.assert_array_equal(np.diff(list(taken)), 1)
            rows = [i for i, number in enumerate(recording["frame"]) if number in taken]
            self.assertGreater(len(rows), 40)
            zero_us = int(re.search(r"# host_zero_us: (\d+)", text).group(1))
            np.testing.assert_allclose(recording.time_us[rows] + zero_us, [taken[recording["frame"][i]].host_us for i in rows], atol=2e6)


class WithoutPandas(unittest.TestCase):
    def test_said_what_to_install(self):
        with mock.patch.dict(sys.modules, {"pandas": None}), self.assertRaisesRegex(ImportError, r"pip install pandas$"):
            fingertip.Block([]).to_pandas()

    def test_import_needs_no_port(self):
        with mock.patch.dict(sys.modules, {"serial": None}):
            importlib.reload(fingertip)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[5:])
