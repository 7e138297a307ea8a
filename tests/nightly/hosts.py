#!/usr/bin/python3
"""Several computers on one network, each with fingertips, as network namespaces of this one; and what reached a recorder. As a program, with an
endpoint, it is a router until it is killed.

The truth of cuts is a second terminal of each fingertip (fake_device's mirror), which gets the same bytes a moment before the first.
"""

# real time: processes on a network
import contextlib
import json
import os
import pathlib
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty

PACKAGE = pathlib.Path(__file__).resolve().parents[2] / "host_tools/python"
sys.path.insert(0, str(PACKAGE))
from fingertip import wire  # noqa: E402
from fingertip.files import read_recording, recorded_devices  # noqa: E402
from fingertip.mcap_recording import McapLineReader  # noqa: E402
from fingertip.network import Stamp, parts_of  # noqa: E402

from nightly import busy_s, run, wait_for  # noqa: E402

HOSTS, TIPS, RATE_Hz, FULL_RATE_Hz = 4, 4, 50, 1310
UNPLUGGED = "F100"  # and back, after half of its frames
PATIENCE_s = 3600  # of a guard against hanging
PORT = 7447


def command(*words):
    return [sys.executable, str(PACKAGE), *map(str, words)]


class Mirrors:
    """Everything that the fingertips sent: serial number -> (sequence, t_us) in order. ends: how many of them there were with the first answer to
    "info" after the last frame, which its bridge has read if it passed that on."""

    def __init__(self, ports, frames):
        self.sent = {serial: [] for serial in ports}
        self.ends, self._frames, self._silent = {}, frames, set()
        self._decoders = {}
        for serial, port in ports.items():
            fd = os.open(port, os.O_RDWR | os.O_NOCTTY)
            tty.setraw(fd)
            self._decoders[fd] = (serial, wire.Decoder())
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        while self._decoders:
            for fd in select.select(list(self._decoders), [], [], 1)[0]:
                serial, decoder = self._decoders[fd]
                try:
                    data = os.read(fd, 65536)
                except OSError:
                    data = b""
                if data:
                    for packet in decoder.feed(data):
                        self.sent[serial].append(packet[:2])
                        if isinstance(packet.body, wire.Raw) and packet.body.frame == self._frames:
                            self._silent.add(serial)
                        elif isinstance(packet.body, wire.Info) and serial in self._silent:
                            self.ends.setdefault(serial, len(self.sent[serial]))
                else:
                    del self._decoders[fd]
                    os.close(fd)


def recorded_packets(path):
    """Serial number -> (sequence, t_us) of each packet in a recording of several, in the order of the file."""
    lines, found = [each for each in McapLineReader(path).items() if type(each) is tuple], {}
    for number, serial in enumerate(recorded_devices(path)):
        read, packets = read_recording(path, serial=serial), []
        for kind, name in enumerate(("sequence", "raw_sequence")):
            rows = zip(read.line_numbers, read[name], read["t_us"])
            packets += [(line, kind, (int(sequence), int(t_us))) for line, sequence, t_us in rows if sequence == sequence]
        for line, text, _ in lines:
            if text.startswith(f"# {number}/packet: "):
                fields = dict(pair.split("=") for pair in text.split()[3:])
                packets.append((line, 0, (int(fields["sequence"]), int(fields["t_us"]))))
        found[serial] = [packet for _, _, packet in sorted(packets)]
    return found


class Network:
    """A switch with a router and a recorder in one namespace, the hosts in one each."""

    def __init__(self):
        self.name = f"ft{os.getpid()}"
        self.spaces = [f"{self.name}h{k}" for k in range(HOSTS)]

    def __enter__(self):
        try:
            self._make()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _make(self):
        def ip(*words, of=self.name):
            run("ip", "-n", of, *words)

        for space in (self.name, *self.spaces):
            run("ip", "netns", "add", space)
            ip("link", "set", "lo", "up", of=space)
        ip("link", "add", "name", "switch0", "type", "bridge")
        ip("addr", "add", "10.77.0.1/24", "dev", "switch0")
        ip("link", "set", "switch0", "up")
        for k, space in enumerate(self.spaces):
            ip("link", "add", f"v{k}", "type", "veth", "peer", "name", "eth", "netns", space)
            ip("addr", "add", f"10.77.0.{10 + k}/24", "dev", "eth", of=space)
            ip("link", "set", "eth", "up", of=space)
            ip("link", "set", f"v{k}", "master", "switch0", "up")

    def __exit__(self, *_):
        for space in (*self.spaces, self.name):
            subprocess.run(["ip", "netns", "del", space], check=False, capture_output=True)

    def link(self, host, state):
        run("ip", "-n", self.name, "link", "set", f"v{host}", state)


def cuts(fake_device, seconds):
    endpoint = f"tcp/10.77.0.1:{PORT}"
    with contextlib.ExitStack() as stack:
        folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="fingertip-")))
        network = stack.enter_context(Network())
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
        processes = []

        def start(words, space=None, **options):
            words = (["ip", "netns", "exec", space] if space else []) + list(map(str, words))
            process = subprocess.Popen(words, env=environment, **options)
            processes.append(process)
            return process

        def end_all():
            for process in processes:
                process.kill()
                process.wait()

        stack.callback(end_all)
        ports = {f"F1{host}{tip}": folder / f"F1{host}{tip}" for host in range(HOSTS) for tip in range(TIPS)}
        mirrors = {serial: folder / f"mirror{serial}" for serial in ports}
        for serial, port in ports.items():
            unplugged = [f"vanish={RATE_Hz * seconds // 2},1500"] if serial == UNPLUGGED else []
            truth_of = (f"serial={serial}", f"mirror={mirrors[serial]}")
            start([fake_device, port, *truth_of, f"rate={RATE_Hz}", f"stall={RATE_Hz * seconds}", "life=86400", *unplugged])
        wait_for(lambda: all(path.is_symlink() for path in (*ports.values(), *mirrors.values())), "the fingertips")
        truth = Mirrors(mirrors, RATE_Hz * seconds)

        def router():
            return start([sys.executable, __file__, endpoint], network.name)

        def bridge(host):
            own = [word for serial, port in ports.items() if serial.startswith(f"F1{host}") for word in ("--port", port)]
            return start(command("bridge", "--connect", endpoint, *own), network.spaces[host], stderr=subprocess.DEVNULL)

        the_router, bridges = router(), [bridge(host) for host in range(HOSTS)]
        recording = folder / "all.mcap"
        all_of_them = ("--connect", endpoint, "--expect", HOSTS * TIPS, "--wait", PATIENCE_s, "--undisciplined")
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        recorder = start(command("recorder", recording, *all_of_them, "--patience", PATIENCE_s, "--json"), network.name, **pipes)
        wait_for(lambda: recording.exists() or recorder.poll() is not None, "the recorder")
        time.sleep(3)
        the_router.kill()
        time.sleep(3)
        router()
        time.sleep(4)
        network.link(1, "down")
        time.sleep(5)
        network.link(1, "up")
        time.sleep(2)
        network.link(3, "down")  # longer than Zenoh's lease of 10 s
        bridges[2].kill()
        time.sleep(2)
        bridge(2)
        time.sleep(13)
        network.link(3, "up")
        while len(truth.ends) < len(ports):
            asking = command("recorder", folder / "asked.csv", *all_of_them, "--seconds", 0, "--overwrite")
            start(asking, network.name, stderr=subprocess.DEVNULL).wait()
        recorder.send_signal(signal.SIGINT)
        stdout, stderr = recorder.communicate()
        if not stdout:
            raise SystemExit(f"hosts.py: the recorder failed: {stderr.strip()[-500:]}")
        accounts = json.loads(stdout)["fingertips"]
        in_file = recorded_packets(recording)
        uncounted = strangers = sent = 0
        by_host = [0] * HOSTS
        for serial, of_file in in_file.items():
            of_device = truth.sent[serial]
            wait_for(lambda: of_file[-1] in of_device, "the truth")
            first = of_device.index(of_file[0])
            asked = of_device[first : truth.ends[serial]]
            sent += len(asked)
            strangers += len(set(of_file) - set(of_device)) + len(of_file) - len(set(of_file))
            strangers += abs(len(of_file) - accounts[serial]["recorded"])
            uncounted += abs(len(asked) - len(set(asked) & set(of_file)) - accounts[serial]["lost"])
            by_host[int(serial[2])] += accounts[serial]["lost"]
        return {
            "zenoh_sent": sent,
            "zenoh_recorded": sum(map(len, in_file.values())),
            "zenoh_lost_counted": sum(by_host),
            "zenoh_lost_uncounted": uncounted,
            "zenoh_not_sent_but_recorded": strangers,
            "zenoh_lost_by_network": sum(by_host) - by_host[2],
            "zenoh_lost_by_killed_bridge": by_host[2],
            "zenoh_restarts_missed": sum(abs(each["restarts"] - (serial == UNPLUGGED)) for serial, each in accounts.items()),
        }


def latency(fake_device, seconds):
    import zenoh

    endpoint = f"tcp/127.0.0.1:{PORT + os.getpid() % 1000}"
    with tempfile.TemporaryDirectory(prefix="fingertip-") as name:
        port = pathlib.Path(name) / "port"
        environment = {**os.environ, "XDG_RUNTIME_DIR": name}
        device = subprocess.Popen([fake_device, port, f"rate={FULL_RATE_Hz}", "life=600"])
        bridge = None
        try:
            wait_for(port.is_symlink, "the fingertip")
            words = command("bridge", "--listen", endpoint, "--router", "--port", port)
            bridge = subprocess.Popen(words, env=environment, stderr=subprocess.DEVNULL)
            config = zenoh.Config()
            config.insert_json5("mode", '"client"')
            config.insert_json5("connect/endpoints", json.dumps([endpoint]))
            config.insert_json5("connect/timeout_ms", "-1")
            late_ns, taken = [], {"raw": 0}

            def hear(sample):
                kind = parts_of(str(sample.key_expr))[1]
                if kind != "status":
                    stamp = Stamp.of(sample.attachment.to_bytes())
                    late_ns.append(time.time_ns() - stamp.taken_ns)
                    taken[kind] = taken.get(kind, 0) + 1

            with zenoh.open(config) as session:
                subscriber = session.declare_subscriber("fingertip/*/*", hear)
                wait_for(lambda: len(late_ns) > 2 * FULL_RATE_Hz, "packets")
                begun_s, busy_before_s, frames = time.perf_counter(), busy_s(bridge.pid), taken["raw"]
                late_ns.clear()
                time.sleep(seconds)
                wall_s, cpu_s = time.perf_counter() - begun_s, busy_s(bridge.pid) - busy_before_s
                frames = taken["raw"] - frames
                found = sorted(late_ns)
                subscriber.undeclare()
        finally:
            for process in (bridge, device):
                if process:
                    process.kill()
                    process.wait()
    return {
        "zenoh_latency_median_ms": round(found[len(found) // 2] / 1e6, 3),
        "zenoh_latency_99_ms": round(found[len(found) * 99 // 100] / 1e6, 3),
        "zenoh_fps": round(frames / wall_s, 1),
        "zenoh_bridge_core_percent": round(100 * cpu_s / wall_s, 1),
    }


if __name__ == "__main__":
    import zenoh

    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", json.dumps(sys.argv[1:]))
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config):
        signal.pause()
