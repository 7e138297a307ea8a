"""What fingertip-bridge and fingertip-recorder exchange on Zenoh (zenoh.io), and how they open a session.

README.md of the package lists the keys. A packet's frame is published as it was on the line, without its closing zero: wire.decode reads it.
fingertip/SERIAL/again?line=L;first=A;last=B gives these packets once more, as far as they are kept, and then JSON: oldest, the first
number that is kept. status has each line with the number of the last packet that was published or, when asked, read.

A live subscriber may miss packets: they are sent with congestion control "drop", and what the network does not take in time is left out.
All packets of a fingertip, of whatever key, are numbered in one row, so that a recorder sees what it misses; it asks for that again, which
is reliable and blocks. Zenoh's own AdvancedSubscriber asks only once, and the sequence numbers of the line wrap after 25 s at the highest
rate.

Needs the package eclipse-zenoh.
"""

import argparse
import json
import math
import re
import shutil
import signal
import struct
import subprocess
import threading
import types
from collections.abc import Callable
from typing import Any, NamedTuple

from . import host_time
from .errors import BadValueError, InputError
from .line import SETTINGS

ROOT = "fingertip"
LOOPBACK = "tcp/127.0.0.1:7447"  # where a bridge listens and a recorder connects to if no option has it otherwise
AGAIN_MOST = 4000  # packets that one question asks for
CHRONYC_TIMEOUT_s = 5
_STAMP = struct.Struct("<QQqqffI")


class Stamp(NamedTuple):
    """The attachment of a packet: 44 bytes, little-endian, in this order.

    line: u64, begins again when the bridge or the fingertip does, and only grows. number: u64, counts from 1 the packets that the fingertip sent
    on this line, with those that the line lost. taken_ns: i64, the host's clock, ns since 1970, when it was read. measured_ns: i64, the same
    when the fingertip's clock was at the packet's t_us, good to uncertainty_us, f32; drift_ppm: f32, of the fingertip's clock against the
    host's. shared: u32, 1 where it came through `fingertip serve`, whose sequence numbers are not the fingertip's.
    """

    line: int
    number: int
    taken_ns: int
    measured_ns: int
    uncertainty_us: float
    drift_ppm: float
    shared: int

    def packed(self) -> bytes:
        return _STAMP.pack(*self)

    @staticmethod
    def of(data: bytes) -> "Stamp":
        """Raises InputError."""
        if len(data) != _STAMP.size:
            raise InputError(f"an attachment of {len(data)} bytes instead of {_STAMP.size}; the bridge is of another version")
        return Stamp(*_STAMP.unpack(data))


class HostClock(NamedTuple):
    """How a host's clock is kept. bound_us: no error is larger, by chrony's own estimate; infinite without."""

    disciplined: bool
    bound_us: float
    text: str


def judge_tracking(text: str) -> HostClock:
    """By the text of `chronyc -c tracking`: chrony bounds the error by the correction under way, root dispersion and half the root delay
    (chrony.conf(5), maxclockerror; chronyc(1), tracking)."""
    cells = text.strip().split(",")
    try:
        offset_s, delay_s, dispersion_s, leap = float(cells[4]), float(cells[10]), float(cells[11]), cells[13]
    except (IndexError, ValueError):
        return HostClock(False, math.inf, "clock not disciplined: chronyc printed something else than expected")
    if leap == "Not synchronised" or int(cells[2]) == 0:
        return HostClock(False, math.inf, "clock not disciplined: chrony is not synchronised")
    bound_us = 1e6 * (abs(offset_s) + dispersion_s + delay_s / 2)
    return HostClock(True, bound_us, f"chrony, stratum {cells[2]}, source {cells[1] or cells[0]}")


def host_clock() -> HostClock:
    """This host's, now. Takes some ms."""
    chronyc = shutil.which("chronyc")
    why = "no chrony here"
    if chronyc:
        try:
            done = subprocess.run([chronyc, "-c", "tracking"], capture_output=True, text=True, timeout=CHRONYC_TIMEOUT_s, check=False)
            if done.returncode == 0:
                return judge_tracking(done.stdout)
            why = "chrony does not run"
        except (OSError, subprocess.TimeoutExpired):
            why = "chronyc does not answer"
    return HostClock(False, math.inf, f"clock not disciplined: {why}")


def zenoh_module() -> types.ModuleType:
    try:
        import zenoh
    except ImportError:
        raise InputError("this needs the package eclipse-zenoh; pip install eclipse-zenoh mcap") from None
    return zenoh


def add_session_options(parser: argparse.ArgumentParser) -> None:
    connect = "a router, as tcp/192.168.1.2:7447; it is waited for"
    listen = f"where others reach this, as tcp/0.0.0.0:7447. Without these three options it is this computer alone: {LOOPBACK}"
    parser.add_argument("--connect", action="append", default=[], metavar="ENDPOINT", help=connect)
    parser.add_argument("--listen", action="append", default=[], metavar="ENDPOINT", help=listen)
    config = "Zenoh's own configuration, with TLS and access control; the options above add to it"
    parser.add_argument("--config", metavar="FILE.json5", help=config)


def until_ended() -> threading.Event:
    """Is set by SIGINT and SIGTERM."""
    ended = host_time.event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    return ended


def open_session(options: argparse.Namespace, router: bool = False, serves: bool = False, report: Callable[[str], None] = print) -> Any:
    """A zenoh.Session; serves: others come to it where no option has it otherwise. Nothing is found by multicast, unless --config has that.
    Until it is open, which may take forever, SIGINT and SIGTERM end the program: until_ended comes after. Raises InputError."""
    zenoh = zenoh_module()
    zenoh.init_log_from_env_or("error")
    try:
        config = zenoh.Config.from_file(options.config) if options.config else zenoh.Config()
        alone = [] if options.config or options.connect or options.listen else [LOOPBACK]
        connect, listen = options.connect or alone * (not serves), options.listen or alone * serves
        if router or connect:
            config.insert_json5("mode", json.dumps("router" if router else "client"))
        if router or connect or not options.config:
            config.insert_json5("scouting/multicast/enabled", "false")
        if connect:
            config.insert_json5("connect/endpoints", json.dumps(connect))
        if listen:
            config.insert_json5("listen/endpoints", json.dumps(listen))
        if not options.config:  # started before the router, it waits
            config.insert_json5("connect/timeout_ms", "-1")
            config.insert_json5("connect/exit_on_failure", "false")
            # the wait for a full queue in us, by a thread that may, before a live packet is dropped
            config.insert_json5("transport/link/tx/queue/congestion_control/drop/wait_before_drop", "50000")
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        if connect:
            report(f"connecting to {', '.join(connect)}")
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise InputError(f"no Zenoh session: {error}; see --connect, --listen and --config") from None


def parts_of(key: str) -> tuple[str, str]:
    """Serial number and what it is about; nothing where it is not one of these keys."""
    match = re.fullmatch(rf"{ROOT}/([^/]+)/([^/]+)", key)
    return (match[1], match[2]) if match else ("", "")


def settings_of(parameters: dict[str, str]) -> dict[str, Any]:
    """The arguments of Fingertip.set. Raises BadValueError."""
    kinds: dict[str, Any] = {
        setting.argument: str if setting.words else int if setting.whole and setting.per == 1 else float for setting in SETTINGS
    }
    kinds["keep"] = lambda text: bool(int(text))
    settings: dict[str, Any] = {}
    for name, text in parameters.items():
        if name not in kinds:
            raise BadValueError(f"{name} is no setting; there are: {', '.join(kinds)}")
        try:
            settings[name] = kinds[name](text)
        except ValueError:
            raise BadValueError(f"{name}={text} is no number") from None
    return settings
