"""The emulated device judged by a stock Debian kernel, and the host tool, out of its Debian package, run on that kernel.

usage: test_linux.py --image F.bin --parallel F.bin --cpack CPACK --build FOLDER --node NODE --cache FOLDER --report usb.json

The tests are one story and run in order: a first boot of the device streams over the serial port and ends with the boot loader request, a
second one over libusb and ends with a 1200-baud touch, the third is of the other board, and another fingertip is plugged in beside it. What
the tool receives must be what the device sent, byte by byte. Exit: 77 if this machine cannot run it.

real time: a kernel in a virtual machine. Its busybox has nothing that waits for a file to change, so the machine's shell looks
for one every tenth of a second. Limits are for what hangs; the one time that is judged is judged beside the machine's own delays.
"""

import argparse
import csv
import json
import math
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))
sys.path[:0] = [str(ROOT / folder) for folder in ("host_tools/python", "tests/support", "tests/emulated")]
from emulation import MAIN, options, write_scenario  # noqa: E402
from fingertip import files, wire  # noqa: E402
import figures  # noqa: E402
import guest as virtual  # noqa: E402

TOOLS = argparse.Namespace()
REPORT = {}
REPORTED = """packets_serial packets_libusb packets_pico_parallel lost stalled_shown_s kernel_warnings controller_warnings
    machine_warnings detach_cycles linux_test_s""".split()
SERIAL = "E660583883265A2C"
OTHER_SERIAL = "E660583883265A2D"
VENDOR_PRODUCT = "1209:0001"
SKIPPED = 77
PACKETS = 4000
STREAM_s = 12  # 2 packets for each of 207 frames a second, and more
PARALLEL_STREAM_s = 2
PAIR_s, PAIR_RATE_Hz = 2, 50
STALL_LIMIT_s = 1.0
# Kernel and device hold 70 KiB for a reader, less than 2 s of the stream.
UNREAD_s, READ_AFTERWARDS_bytes = 5, 100_000
ECHOED_s = 4
BEAT_s = 0.02
SERIAL_CYCLES = 3
LIBUSB_CYCLES = 2
# Seconds on the wall until something hangs.
PATIENCE_s = 300
STREAM_LIMIT_s = 600
# What the emulator says of its time each second.
PROGRESS = re.compile(r"^([\d.]+) / \d+ s, [\d.]+ x real time$")
KERNEL_WARNING = 4
# What the driver says when QEMU's controller, having taken transfers back amid data, reports one that is not next on its ring. The first
# and the last were seen, each once in some twenty runs; the last sums up the transfers in between, of 64 bytes each, which is all that a
# device could send in one. The order of a ring is between those two, so it is counted apart.
CONTROLLER_WARNING = re.compile(
    r"xhci_hcd [\w:.]+: (ERROR Transfer event TRB DMA ptr not part of current TD|Looking for event-dma |"
    r"WARN Event TRB for slot \d+ ep \d+ with no TDs queued|URB req \d+ and actual \d+ transfer length mismatch)"
)
# What the kernel says of its own clock and processor when the computer gave the virtual machine no time.
MACHINE_WARNING = re.compile(r"(clocksource: |hrtimer: interrupt took |rcu: |sched: RT throttling )")
PRESSED_s = 1.2


def packets_of(stream):
    """Its packets, and how many frames were damaged. The first frame may be cut."""
    decoder = wire.Decoder()
    packets = list(decoder.feed(stream))
    return packets, decoder.statistics.crc_errors + decoder.statistics.format_errors


def gaps(packets):
    """How many packets are missing between the first and the last."""
    return sum((b.sequence - a.sequence - 1) % 65536 for a, b in zip(packets, packets[1:]))


class Emulator:
    """A powered device on the cable."""

    def __init__(self, folder, name, image, board, scenario, socket, serial=SERIAL):
        self.base = folder / name
        device = options(image=image, board=board, scenario=scenario, seconds=3600, serial=serial, usbredir=socket)
        logs = options(fast_enumeration=True, progress=True, usb_log=self.path("usb"), capture=self.path("ftr"), report=self.path("json"))
        self.process = subprocess.Popen([TOOLS.node, MAIN, *device, *logs], stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.lines, self.more = [], threading.Condition()
        self.listener = threading.Thread(target=self._listen)
        self.listener.start()

    def _listen(self):
        for line in self.process.stderr:
            with self.more:
                self.lines.append(line.rstrip("\n"))
                self.more.notify_all()

    def path(self, suffix):
        return self.base.with_suffix("." + suffix)

    def cable(self, action):
        self.process.stdin.write(f"{action}\n")
        self.process.stdin.flush()

    def finish(self, limit_s):
        """Its report, once the device has left by itself."""
        self.process.wait(limit_s)
        return json.loads(self.path("json").read_text())

    def pass_time(self, seconds):
        """Of the device's time, to the second, of which it tells each on the wall."""

        def now_s():
            told = [PROGRESS.match(line) for line in self.lines]
            return max((float(each[1]) for each in told if each), default=0.0)

        with self.more:
            end_s = now_s() + seconds
            if not self.more.wait_for(lambda: now_s() >= end_s, STREAM_LIMIT_s):
                raise AssertionError("the device stands still")

    def complaints(self):
        return [line for line in self.lines if not PROGRESS.match(line) and "entered the USB boot loader" not in line]

    def requests(self):
        """Control requests: (setup in hexadecimal, the data stage's packets of either direction)."""
        found = []
        with open(self.path("usb"), newline="") as file:
            for row in csv.DictReader(file):
                if row["dir"] == "setup":
                    found.append((row["bytes"], []))
                elif row["endpoint"] == "0" and row["length"] != "0":
                    found[-1][1].append(row["bytes"])
        return found

    def stop(self):
        self.process.terminate()
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.listener.join()
        self.process.stdin.close()
        self.process.stderr.close()


def until(condition, limit_s=PATIENCE_s):
    """For the machine's shell."""
    return f"n=0; until {condition}; do n=$((n+1)); [ $n -lt {limit_s * 10} ] || exit 1; usleep 100000; done"


def write_press(path):
    """The same press from PRESSED_s on."""
    away_mm = [math.hypot(x_mm - 2, y_mm - 3) for x_mm, y_mm in zip(files.SENSOR_X_mm, files.SENSOR_Y_mm)]
    press = [20000 * math.exp(-(each**2) / (2 * 5.7**2)) for each in away_mm]
    course = ((0, 0), (PRESSED_s - 0.2, 0), (PRESSED_s, 1))
    write_scenario(path, *((t_s, *(round(scale * p_Pa, 3) for p_Pa in press)) for t_s, scale in course))


def packaged_tool(folder):
    """fingertip as the Debian package holds it."""
    packed, unpacked = folder / "packages", folder / "unpacked"
    config = pathlib.Path(TOOLS.build) / "CPackConfig.cmake"
    subprocess.run([TOOLS.cpack, "--config", config, "-B", packed], check=True, stdout=subprocess.DEVNULL)
    [package] = packed.glob("fingertip_*.deb")
    subprocess.run(["dpkg-deb", "--extract", package, unpacked], check=True)
    return unpacked / "usr/bin/fingertip"


class Linux(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.scenario = cls.folder / "scenario.csv"
        write_press(cls.scenario)
        cls.sockets = [cls.folder / f"usb{number}.sock" for number in range(2)]
        cls.fingertip = packaged_tool(cls.folder)
        programs = [cls.fingertip, "/usr/bin/lsusb", "/usr/bin/usbreset"]
        cls.guest = virtual.Guest(cls.folder, TOOLS.kernel, programs, cls.sockets)
        cls.addClassCleanup(cls.guest.stop)
        cls.heard = len(cls.kernel_log())
        cls.complaints = []
        cls.streams = {}
        cls.power_up("first")

    def setUp(self):
        """What the kernel complained of until now, and before which test."""
        log = self.kernel_log()
        self.complaints += [(self._testMethodName, text) for level, text in log[self.heard :] if level <= KERNEL_WARNING]
        type(self).heard = len(log)

    @classmethod
    def power_up(cls, name, image=None, board="pico_mux"):
        cls.device = Emulator(cls.folder, name, image or TOOLS.image, board, cls.scenario, cls.sockets[0])
        cls.addClassCleanup(cls.device.stop)

    @classmethod
    def kernel_log(cls):
        """(level, text) of each line."""
        lines = re.findall(r"^<(\d+)>\[ *[\d.]+\] (.*)$", cls.guest.run("dmesg -r")[1], re.M)
        return [(int(level) & 7, text) for level, text in lines]

    def sh(self, script, limit_s=PATIENCE_s):
        status, output = self.guest.run(script, limit_s)
        self.assertEqual(status, 0, f"{script}\n{output}")
        return output

    def wait_for(self, condition, limit_s=PATIENCE_s):
        self.sh(until(condition, limit_s), 2 * limit_s)

    def wait_for_port(self):
        self.wait_for("[ -c /dev/ttyACM0 ]")

    def tool(self, arguments, limit_s=PATIENCE_s):
        return self.sh(f"fingertip {arguments}", limit_s)

    def pairs(self, text):
        return dict(re.findall(r"^(\w+) +(.*)$", text, re.M))

    def stream(self, transport, seconds=STREAM_s, wanted=PACKETS):
        """Records so many packets; check_bytes then sees that the tool got every byte that the device sent meanwhile."""
        how = f"--overwrite --raw-bytes /tmp/{transport}.ftr --transport {transport} --seconds {seconds}"
        self.tool(f"record /tmp/{transport}.csv {how}", STREAM_LIMIT_s)
        end = self.sh(f"tail -n 1 /tmp/{transport}.csv")
        self.assertIn("dropped_packets=0 out_of_order=0 crc_errors=0 format_errors=0", end)
        received = self.guest.read_file(f"/tmp/{transport}.ftr")
        self.sh(f"rm /tmp/{transport}.csv /tmp/{transport}.ftr")
        packets, damaged = packets_of(received)
        self.assertEqual(damaged, 0)
        self.assertEqual(gaps(packets), 0)
        self.assertGreaterEqual(len(packets), wanted)
        self.streams[transport] = received
        return packets

    def leave(self, reason):
        """The device goes to its boot loader; what it and the emulator had to say is checked."""
        result = self.device.finish(PATIENCE_s)
        self.assertEqual(result["end_reason"], reason)
        self.assertEqual(result["warnings"], [])
        self.assertEqual(self.device.complaints(), [])
        self.wait_for("[ ! -e /dev/ttyACM0 ]")

    def check_bytes(self, transport):
        sent = self.device.path("ftr").read_bytes()
        self.assertIn(self.streams[transport], sent, "the tool received other bytes than the device sent")

    # The first boot

    def test_01_enumeration(self):
        self.wait_for_port()
        texts = [text for _, text in self.kernel_log()]
        for wanted in (
            "new full-speed USB device",
            "Product: Fingertip tactile sensor",
            "Manufacturer: Fingertip",
            f"SerialNumber: {SERIAL}",
            "ttyACM0: USB ACM device",
        ):
            self.assertTrue(any(wanted in text for text in texts), f"{wanted}: not in\n" + "\n".join(texts))

    def test_02_ten_thousand_packets_over_the_serial_port(self):
        self.stream("serial")

    def test_03_descriptors(self):
        text = self.sh(f"lsusb -v -d {VENDOR_PRODUCT} 2>&1")
        for wanted in (
            r"bcdUSB +2\.00",
            r"bMaxPacketSize0 +64",
            r"iManufacturer +1 Fingertip",
            r"bNumConfigurations +1",
            r"iProduct +2 Fingertip tactile sensor",
            rf"iSerial +3 {SERIAL}",
            r"bNumInterfaces +2",
            r"bFunctionClass +2",
            r"bInterfaceClass +2",
            r"bInterfaceSubClass +2",
            r"bInterfaceClass +10",
            r"CDC Header:",
            r"CDC Call Management:",
            r"CDC ACM:\s+bmCapabilities +0x06",
            r"bMasterInterface +0\s+bSlaveInterface +1",
            r"EP 1 IN\s+bmAttributes +3",
            r"EP 2 OUT\s+bmAttributes +2",
            r"EP 2 IN\s+bmAttributes +2",
            r"Device Status: +0x0000",
        ):
            self.assertRegex(text, wanted)
        for complaint in ("Warning", "INVALID", "UNRECOGNIZED", "Bad", "cannot read"):
            self.assertNotIn(complaint, text)

    def test_04_tool_over_both_transports(self):
        self.assertRegex(self.tool("list"), rf"^{SERIAL}\tpico_mux\t\d+\.\d+\.\d+\tserial /dev/ttyACM0, usb \d+/\d+\n$")
        answers = [self.pairs(self.tool(f"info --transport {transport}")) for transport in ("serial", "usb")]
        for name in ("serial", "board", "firmware", "git", "sensors", "osr", "x_mm", "y_mm", "sensors_present"):
            self.assertEqual(answers[0][name], answers[1][name], name)
        self.assertEqual(answers[0]["serial"], SERIAL)
        self.assertEqual(answers[0]["commands_rejected"], "0")
        for transport in ("serial", "usb"):
            self.assertIn("frames", self.tool(f"monitor --colour plain --seconds 0.5 --device {SERIAL} --transport {transport}"))
            self.wait_for_port()

    def test_05_line_coding(self):
        self.sh("stty -F /dev/ttyACM0 raw -echo 230400 cs7 parenb -parodd cstopb")
        self.assertIn("speed 230400 baud", self.sh("stty -F /dev/ttyACM0"))

    def test_06_boot_loader_request(self):
        self.tool("loader")
        self.leave("entered the USB boot loader")
        self.check_bytes("serial")

    def test_07_requests_of_the_kernel(self):
        requests = self.device.requests()
        setups = [setup for setup, _ in requests]
        self.assertIn("8006000600000a00", setups, "DEVICE_QUALIFIER was not asked for")
        qualifier = next(data for setup, data in requests if setup.startswith("80060006"))
        self.assertEqual(qualifier, [], "a full-speed device has no DEVICE_QUALIFIER")
        for string in (0, 1, 2, 3):
            asked = [data for setup, data in requests if re.match(f"8006{string:02}03(0000|0904)", setup)]
            self.assertTrue(asked and all(asked), f"string {string}")
        self.assertIn(("2120000000000700", ["80250000000008"]), requests)
        self.assertIn(("2120000000000700", ["00840300020207"]), requests)
        self.assertIn("2122030000000000", setups, "DTR was not raised")
        self.assertIn("2122000000000000", setups, "DTR was not dropped")

    # The second boot

    def test_10_ten_thousand_packets_over_libusb(self):
        self.power_up("second")
        self.wait_for_port()
        self.stream("usb")
        self.wait_for_port()

    def test_11_equal_sequences_and_none_lost(self):
        received = {transport: packets_of(stream)[0] for transport, stream in self.streams.items()}
        REPORT.update(packets_serial=len(received["serial"]), packets_libusb=len(received["usb"]))
        REPORT["lost"] = sum(map(gaps, received.values()))
        for packets in received.values():
            kinds = (wire.Contact, wire.Raw)
            frames = [(type(packet.body), packet.body.frame) for packet in packets if isinstance(packet.body, kinds)]
            first = frames[0][1]
            wanted = [(kind, first + i) for i in range(PACKETS // 2) for kind in kinds]
            self.assertEqual(frames[:PACKETS] == wanted, True, "not a contact and a raw packet for each frame in turn")

    def stall(self, transport):
        """Seconds in the machine from a silent device to the monitor's word, at least and at most, and the longest that the machine
        kept another program waiting meanwhile; the device is silent while it is stopped."""

        def uptime_s():
            return float(self.sh("cut -d' ' -f1 /proc/uptime"))

        self.sh(
            f"(fingertip monitor --colour plain --transport {transport} | while read -r line; do "
            "echo \"$(cut -d' ' -f1 /proc/uptime) $line\"; done) > /tmp/monitor.log 2>&1 & "
            f"{until('pidof fingertip > /tmp/monitor.pid')}"
        )
        self.wait_for("grep -q 'CONTACT FIT_VALID' /tmp/monitor.log")
        # Another program, which wants to run every BEAT_s.
        self.sh(
            f"(while [ ! -e /tmp/over ]; do read -r now rest < /proc/uptime; echo $now; usleep {BEAT_s * 1e6:.0f}; done) "
            "> /tmp/beats 2>&1 & true"
        )
        sounding_s = uptime_s()
        self.device.process.send_signal(signal.SIGSTOP)
        try:
            silent_s = uptime_s()
            self.wait_for("grep -q STALLED /tmp/monitor.log")
        finally:
            self.device.process.send_signal(signal.SIGCONT)
        beats_s = [float(line) for line in self.sh("touch /tmp/over; cat /tmp/beats").split()]
        self.wait_for("sed '1,/STALLED/d' /tmp/monitor.log | grep -q 'CONTACT FIT_VALID'")
        self.sh(f"kill -INT $(cat /tmp/monitor.pid); {until('! pidof fingertip')}")
        lines = self.sh("cat /tmp/monitor.log; rm /tmp/monitor.* /tmp/over /tmp/beats").splitlines()
        stalled_s = next(float(line.split()[0]) for line in lines if "STALLED" in line)
        late_s = max((b - a - BEAT_s for a, b in zip(beats_s, beats_s[1:])), default=math.inf)
        return stalled_s - silent_s, stalled_s - sounding_s, late_s

    def test_11_standing_still_shows_within_a_second(self):
        shown_s = []
        for transport in ("serial", "usb"):
            least_s, most_s, late_s = self.stall(transport)
            print(f"{transport}: {least_s:.2f} to {most_s:.2f} s, another program waited {late_s:.2f} s")
            self.assertGreater(most_s, 0)
            self.assertLess(least_s - late_s, STALL_LIMIT_s)
            shown_s.append(max(0, least_s - late_s))
        self.wait_for_port()
        REPORT["stalled_shown_s"] = round(max(shown_s), 2)

    def start_recording(self, name, transport):
        self.sh(
            f"fingertip record /tmp/{name}.csv --raw-bytes /tmp/{name}.ftr --transport {transport} "
            f"> /tmp/{name}.log 2>&1 & echo $! > /tmp/{name}.pid"
        )
        self.wait_for_growth(name)

    def wait_for_growth(self, name):
        """Two kilobytes more than there are."""
        size = int(self.sh(f"stat -c %s /tmp/{name}.ftr 2>/dev/null || echo 0"))
        self.wait_for(f"[ $(stat -c %s /tmp/{name}.ftr 2>/dev/null || echo 0) -gt {size + 2000} ]")

    def end_recording(self, name):
        """Its events, and the packets of its bytes."""
        self.sh(f"kill -0 $(cat /tmp/{name}.pid)")
        self.sh(f"kill -INT $(cat /tmp/{name}.pid)")
        self.wait_for(f"! kill -0 $(cat /tmp/{name}.pid) 2>/dev/null")
        recording = self.guest.read_file(f"/tmp/{name}.csv").decode()
        stream = self.guest.read_file(f"/tmp/{name}.ftr")
        self.sh(f"rm /tmp/{name}.*")
        self.assertIn("crc_errors=", recording.splitlines()[-1])
        return re.findall(r"^# event: (\w+)", recording, re.M), packets_of(stream)[0]

    def test_12_bus_reset_in_mid_stream(self):
        self.start_recording("reset", "serial")
        self.sh(f"usbreset {VENDOR_PRODUCT}")
        self.wait_for_growth("reset")
        events, packets = self.end_recording("reset")
        self.assertEqual(events.count("gone"), events.count("back"))
        self.assertGreater(len(packets), 20)
        self.assertTrue(any("reset full-speed USB device" in text for _, text in self.kernel_log()))

    def cycles(self, transport, count):
        name = f"cycles_{transport}"
        self.start_recording(name, transport)
        for _ in range(count):
            self.device.cable("unplug")
            self.wait_for("[ ! -e /dev/ttyACM0 ] && ! grep -qs Fingertip /sys/bus/usb/devices/*/manufacturer")
            self.device.cable("plug")
            self.wait_for_growth(name)
        events, _ = self.end_recording(name)
        self.assertEqual((events.count("gone"), events.count("back")), (count, count), events)
        REPORT["detach_cycles"] = REPORT.get("detach_cycles", 0) + count

    def test_13_detached_in_mid_stream_serial(self):
        self.cycles("serial", SERIAL_CYCLES)

    def test_14_detached_in_mid_stream_libusb(self):
        self.cycles("usb", LIBUSB_CYCLES)
        self.wait_for_port()

    def encoded(self, *command):
        done = subprocess.run([f"{TOOLS.build}/tests/support/command_frame", *command], capture_output=True, text=True, check=True)
        return re.sub("(..)", r"\\x\1", done.stdout.strip())

    def test_15_echo_of_a_terminal_not_yet_raw(self):
        before = self.pairs(self.tool("info"))
        command = self.encoded("stream", "contact,raw")
        self.sh(
            "mkfifo /tmp/echoed; (exec 3<>/dev/ttyACM0; stty -F /dev/ttyACM0 sane echo; "
            f"printf '{command}' >&3; read -r enough < /tmp/echoed) > /dev/null 2>&1 &"
        )
        self.device.pass_time(ECHOED_s)
        self.sh("echo enough > /tmp/echoed; wait; rm /tmp/echoed")
        after = self.pairs(self.tool("info"))
        self.assertGreater(int(after["frames"]), int(before["frames"]))
        self.assertEqual(after["watchdog_resets"], "0")

    def test_16_host_that_opens_and_does_not_read(self):
        before = self.pairs(self.tool("info"))
        command = self.encoded("stream", "contact,raw")
        self.sh(
            "mkfifo /tmp/late.go; (exec 3<>/dev/ttyACM0; stty -F /dev/ttyACM0 raw -echo; "
            f"printf '{command}' >&3; read -r go < /tmp/late.go; exec cat <&3) "
            "> /tmp/late.ftr 2>&1 & echo $! > /tmp/late.pid"
        )
        self.device.pass_time(UNREAD_s)
        self.sh("echo go > /tmp/late.go")
        self.wait_for(f"[ $(stat -c %s /tmp/late.ftr) -gt {READ_AFTERWARDS_bytes} ]", STREAM_LIMIT_s)
        self.sh("kill $(cat /tmp/late.pid); rm /tmp/late.go")
        packets, damaged = packets_of(self.guest.read_file("/tmp/late.ftr"))
        self.assertEqual(damaged, 0, "whole packets are dropped, never parts of them")
        after = self.pairs(self.tool("info"))
        dropped = int(after["packets_dropped"]) - int(before["packets_dropped"])
        self.assertGreater(dropped, 0)
        self.assertLessEqual(gaps(packets), dropped)
        self.assertGreater(len(packets), 100)

    def test_17_touch_at_1200_baud(self):
        self.sh("stty -F /dev/ttyACM0 1200")
        self.leave("entered the USB boot loader")
        self.check_bytes("usb")
        with open(self.device.path("usb"), newline="") as file:
            echoed = sum(row["endpoint"] == "2" and row["dir"] == "out" and row["length"] == "1" for row in csv.DictReader(file))
        self.assertGreater(echoed, 100, "the terminal that was not yet raw echoed nothing")

    # The third boot

    def test_18_the_parallel_board(self):
        self.power_up("third", TOOLS.parallel, "pico_parallel")
        self.wait_for_port()
        self.assertRegex(self.tool("list"), rf"^{SERIAL}\tpico_parallel\t\d+\.\d+\.\d+\tserial /dev/ttyACM0, usb \d+/\d+\n$")
        count = 0
        for transport in ("serial", "usb"):
            count += len(self.stream(transport, PARALLEL_STREAM_s, 2 * 400 * PARALLEL_STREAM_s))
            self.wait_for_port()
        REPORT["packets_pico_parallel"] = count

    def test_19_two_told_apart(self):
        other = Emulator(self.folder, "other", TOOLS.image, "pico_mux", self.scenario, self.sockets[1], OTHER_SERIAL)
        self.addCleanup(other.stop)
        self.wait_for("[ -c /dev/ttyACM1 ]")
        boards = {SERIAL: "pico_parallel", OTHER_SERIAL: "pico_mux"}
        for serial in boards:
            self.tool(f"set rate={PAIR_RATE_Hz} --device {serial}")
        listed = [line.split("\t") for line in self.tool("list").splitlines()]
        self.assertEqual({serial: board for serial, board, *_ in listed}, boards)
        self.assertEqual({re.search("ttyACM[01]", reached)[0] for *_, reached in listed}, {"ttyACM0", "ttyACM1"})
        for words, said in (
            ("", f"several fingertips found: {SERIAL}, {OTHER_SERIAL}; choose one with --device SERIAL"),
            ("--device 1234", f"no fingertip 1234 here, there are: {SERIAL} {OTHER_SERIAL}; plug it in, then see `fingertip list`"),
        ):
            self.assertEqual(self.guest.run(f"fingertip info {words}"), (1, f"fingertip: {said}\n"))
        for serial, board in boards.items():
            for transport in ("serial", "usb"):
                told = self.pairs(self.tool(f"info --device {serial} --transport {transport}"))
                self.assertEqual((told["serial"], told["board"]), (serial, board))
                self.wait_for("[ -c /dev/ttyACM0 ] && [ -c /dev/ttyACM1 ]")
        for transport in ("serial", "usb"):
            self.tool(f"record /tmp/both.csv --overwrite --all --seconds {PAIR_s} --transport {transport}", STREAM_LIMIT_s)
            ends = self.sh("grep '/end:' /tmp/both.csv").splitlines()
            self.assertEqual(len(ends), 2)
            for end in ends:
                # Seconds of the guest's clock; two emulators on a busy computer run slower.
                self.assertGreater(int(re.search(r"frames=(\d+)", end)[1]), PAIR_s * PAIR_RATE_Hz / 10)
                self.assertIn("dropped_packets=0 out_of_order=0 crc_errors=0 format_errors=0", end)
            self.wait_for("[ -c /dev/ttyACM0 ] && [ -c /dev/ttyACM1 ]")
        self.tool(f"loader --device {OTHER_SERIAL}")
        self.assertEqual(other.finish(PATIENCE_s)["warnings"], [])
        self.tool("loader")
        self.leave("entered the USB boot loader")
        for transport in ("serial", "usb"):
            self.check_bytes(transport)

    def test_20_no_complaint(self):
        controller, machine = (
            [each for each in self.complaints if pattern.match(each[1])] for pattern in (CONTROLLER_WARNING, MACHINE_WARNING)
        )
        complaints = [each for each in self.complaints if each not in controller + machine]
        REPORT.update(kernel_warnings=len(complaints), controller_warnings=len(controller), machine_warnings=len(machine))
        for before, text in controller + machine:
            print(f"before {before}: {text}")
        self.assertEqual(complaints, [])
        reconnecting = "Unable to connect character device usb"
        self.assertEqual([line for line in self.guest.stop() if reconnecting not in line], [])


class Report(unittest.TextTestRunner):
    def run(self, test):
        began_s = time.monotonic()
        result = super().run(test)
        REPORT["linux_test_s"] = round(time.monotonic() - began_s, 1)
        return result


def main():
    parser = argparse.ArgumentParser()
    for name in ("image", "parallel", "cpack", "build", "node", "cache", "report"):
        parser.add_argument(f"--{name}", required=True)
    parser.parse_known_args(namespace=TOOLS)
    try:
        virtual.check_programs()
        for program in ("/usr/bin/lsusb", "/usr/bin/usbreset"):
            if not pathlib.Path(program).exists():
                raise virtual.Unavailable(f"{program} is not here: install usbutils")
        TOOLS.kernel = virtual.fetch_kernel(TOOLS.cache)
    except virtual.Unavailable as error:
        print(f"skipped: {error}")
        return SKIPPED
    options = parser.parse_known_args()[1]
    program = unittest.main(argv=[sys.argv[0], *options], testRunner=Report(verbosity=2), exit=False)
    figures.add(TOOLS.report, REPORT, stale=REPORTED)
    return 0 if program.result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
