#!/usr/bin/python3
"""What the tools do to those who use them: many programs on one fingertip.

    tools.py --build build/host -o build/report

    tools.json    the figures by which the tools are judged, with their goals
    tools.md      the same to read

Measured on this computer with simulated fingertips: programs that say on pseudo-terminals what a fingertip of fifteen sensors says,
at its highest rate. `fingertip serve` shares two of them with eight clients, four each, that read both streams and send a command ten
times a second, all at the same moments. One client is stopped for the middle third. Of one fingertip every byte goes to a second
terminal too, at the same moment, and is read there directly: added is the time from the arrival of a frame there to its arrival at
a client.
"""

import contextlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
from fingertip.files import InputError, run_tool, write_text  # noqa: E402
from goals import goal_table_md, judge  # noqa: E402
from reporting import Steps, finish, option_parser, output_folder, write_json  # noqa: E402

GOALS = (
    ("serve_clients", ">=", 8),
    ("serve_fps", ">=", 1308),
    ("serve_lost", "<=", 0),
    ("serve_unanswered", "<=", 0),
    ("serve_added_median_us", "<=", 300),
)
SERIALS = ("AAAA", "BBBB")
CLIENTS_EACH = 4
RATE_Hz = 1310  # 763 us a frame; 764 would be 1308.9, and the last one may come late
PATIENCE_s = 60


class Processes(contextlib.ExitStack):
    """Whatever was started ends, in reverse order."""

    def start(self, *call, **options):
        process = subprocess.Popen([str(part) for part in call], **options)
        self.callback(self.end, process)
        return process

    @staticmethod
    def end(process):
        for number in (signal.SIGCONT, signal.SIGTERM):
            process.send_signal(number)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        for pipe in filter(None, (process.stdin, process.stdout)):
            pipe.close()


def wait_for(condition, what):
    end = time.monotonic() + PATIENCE_s
    while not condition():
        if time.monotonic() > end:
            raise InputError(f"{what}: waited {PATIENCE_s} s in vain")
        time.sleep(0.02)


def answer_of(process, what):
    out, _ = process.communicate(timeout=PATIENCE_s)
    if process.returncode != 0:
        raise InputError(f"{what} failed")
    return json.loads(out)


def cpu_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(build, seconds, steps):
    fingertip, client, fake = (
        build / name for name in ("host_tools/tool/cli/fingertip", "host_tools/report/tools/serve_client", "tests/support/fake_device")
    )
    for tool in (fingertip, client, fake):
        if not tool.exists():
            raise InputError(f"{tool} is not there; build it: cmake --build --preset host")
    last_frame = round(seconds * RATE_Hz)
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder, Processes() as processes:
        folder = pathlib.Path(folder)
        ports = [folder / f"port_{serial}" for serial in SERIALS]
        mirror = folder / "mirror"
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), "FINGERTIP_PORT": ":".join(map(str, ports))}
        for serial, port in zip(SERIALS, ports):
            more = [f"mirror={mirror}"] if serial == SERIALS[0] else []
            processes.start(fake, port, f"serial={serial}", f"rate={RATE_Hz}", f"life={seconds + 2 * PATIENCE_s:.0f}", *more)
        wait_for(lambda: mirror.is_symlink() and all(port.is_symlink() for port in ports), "simulated fingertips")
        direct_file = folder / "direct"
        direct = processes.start(client, mirror, last_frame, direct_file, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        log = folder / "serve.log"
        with open(log, "w", encoding="utf-8") as file:
            server = processes.start(fingertip, "serve", env=environment, stderr=file)
        wait_for(lambda: log.read_text(encoding="utf-8").count("shared as") == len(SERIALS), "fingertip serve")
        names = [(serial, number) for serial in SERIALS for number in range(CLIENTS_EACH)]
        begun_s, busy_s = time.monotonic(), cpu_s(server.pid)
        clients = {
            name: processes.start(
                client, name[0], last_frame, folder / f"{name[0]}{name[1]}", env=environment, stdout=subprocess.PIPE, text=True
            )
            for name in names
        }
        stopped = names[-1]
        time.sleep(seconds / 3)
        clients[stopped].send_signal(signal.SIGSTOP)
        time.sleep(seconds / 3)
        clients[stopped].send_signal(signal.SIGCONT)
        got = {name: answer_of(process, f"client {name}") for name, process in clients.items()}
        cpu_percent = 100 * (cpu_s(server.pid) - busy_s) / (time.monotonic() - begun_s)
        answer_of(direct, "direct reader")
        at_once = np.loadtxt(direct_file, ndmin=2)
        reading = [name for name in names if name != stopped]
        added_us = np.concatenate(
            [added(at_once, np.loadtxt(folder / f"{serial}{number}", ndmin=2)) for serial, number in reading if serial == SERIALS[0]]
        )
        said = log.read_text(encoding="utf-8")
    steps.say(f"{len(names)} clients on {len(SERIALS)} fingertips, {seconds:g} s")
    packets = {name: 2 * (last_frame - got[name]["first"] + 1) for name in reading}
    lost_by_stopped = re.search(rf"{stopped[0]}: pid {clients[stopped].pid}, .* lost (\d+) packets", said)
    return {
        "serve_clients": len(names),
        "serve_fingertips": len(SERIALS),
        "serve_seconds": seconds,
        "serve_fps": (len(at_once) - 1) / (at_once[-1, 1] - at_once[0, 1]) * 1e6,
        "serve_packets": sum(packets.values()),
        "serve_lost": sum(packets[name] - got[name]["contacts"] - got[name]["raws"] for name in reading),
        "serve_gaps": sum(got[name]["dropped"] + got[name]["damaged"] for name in reading),
        "serve_commands": sum(got[name]["sent"] for name in reading),
        "serve_unanswered": sum(got[name]["sent"] - got[name]["answered"] for name in reading),
        "serve_added_median_us": float(np.median(added_us)),
        "serve_added_p99_us": float(np.percentile(added_us, 99)),
        "serve_added_max_us": float(added_us.max()),
        "serve_cpu_percent": cpu_percent,
        "serve_lost_by_stopped": int(lost_by_stopped[1]) if lost_by_stopped else 0,
    }


def added(direct, through):
    """us from each frame's arrival at the direct reader to that at a client."""
    _, at_direct, at_client = np.intersect1d(direct[:, 0], through[:, 0], return_indices=True)
    return through[at_client, 1] - direct[at_direct, 1]


def text(found):
    return "\n".join(
        [
            "# The tools",
            "",
            "## Many programs on one fingertip",
            "",
            __doc__.split("\n\n")[-1].strip(),
            "",
            *goal_table_md(found),
            "",
            f"The server took {found['serve_cpu_percent']:.0f} % of a core for {found['serve_packets']} packets in {found['serve_seconds']:g} s. "
            f"One frame in a hundred came {found['serve_added_p99_us']:.0f} us or more later than directly, "
            "which depends on what else the computer does. "
            f"The stopped client lost {found['serve_lost_by_stopped']} packets of its own.",
            "",
        ]
    )


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("--seconds", type=float, default=60, help="of reading (default: %(default)s)")
    options = parser.parse_args(argv)
    if not 1 <= options.seconds <= 3600:
        raise InputError(f"--seconds {options.seconds:g} is out of range; give 1 to 3600")
    out = output_folder(options)
    found = judge(measure(pathlib.Path(options.build).resolve(), options.seconds, Steps()), GOALS)
    write_json(out / "tools.json", found)
    write_text(out / "tools.md", text(found))
    return finish(found, options, ("tools.json", "tools.md"))


if __name__ == "__main__":
    sys.exit(run_tool("tools.py", main))
