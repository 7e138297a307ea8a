"""A validation of a fingertip that is there: leads the user, and keeps the recording."""

import contextlib
import os
import select
import shutil
import signal
import sys

import numpy as np

from .. import host_time
from ..device import Fingertip
from ..errors import FingertipError, GoneError, InputError
from ..command import printable
from ..frames import Q10
from ..line import Capability, Flag
from ..recording import RecordingWriter, info_metadata
from ..version import __version__
from ..wire import Packet
from .assess import why_no_tangential
from .measure import Pad
from .placements import FRAME_RATE_MIN_Hz, Reading
from .protocol import RATE_Hz, event_of
from .walk import Walk

POLL_s, REDRAW_s = 0.02, 0.2
PATIENCE_s = 5.0  # without a frame
_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l\x1b[2J", "\x1b[0m\x1b[?25h\x1b[?1049l"


class Guide:
    """What to do, on the whole screen or as lines."""

    def __init__(self, colour):
        self._is_screen = colour != "plain" and sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb"
        self._has_colour = colour != "auto" or not os.environ.get("NO_COLOR")
        self._news, self._next_s, self._before = "", 0.0, None

    def __enter__(self):
        if self._is_screen:
            with contextlib.suppress(ImportError, OSError):
                import termios

                if sys.stdin.isatty():
                    self._before = termios.tcgetattr(sys.stdin)
                    now = termios.tcgetattr(sys.stdin)
                    now[3] &= ~(termios.ICANON | termios.ECHO)
                    termios.tcsetattr(sys.stdin, termios.TCSANOW, now)
            self._write(_ENTER)
        return self

    def __exit__(self, *error):
        if self._is_screen:
            self._write(_LEAVE)
        if self._before:
            import termios

            termios.tcsetattr(sys.stdin, termios.TCSANOW, self._before)

    @staticmethod
    def _write(text):
        sys.stdout.write(text)
        sys.stdout.flush()

    def update(self, walk):
        advice = walk.advice
        if not self._is_screen:
            news = advice.split(": ")[0]  # a countdown is no news
            if news != self._news:
                self._news = news
                print(advice, flush=True)
        elif host_time.now_s() >= self._next_s:
            self._next_s = host_time.now_s() + REDRAW_s
            columns, rows = shutil.get_terminal_size()
            bar = max(columns - 4, 10)
            done = int(walk.progress * bar)
            green = "\x1b[32m" if self._has_colour else ""
            lines = ((2, "fingertip validate"), (4, advice), (6, f"{green}{'=' * done}\x1b[0m{'-' * (bar - done)}"))
            lines += ((rows, "q quit   u take the last one back"),)
            self._write("\x1b[2J" + "".join(f"\x1b[{row};3H\x1b[{int(row < 6)}m{text}\x1b[0m" for row, text in lines))

    def keys(self):
        if not self._before or not select.select([sys.stdin], [], [], 0)[0]:
            return ""
        return os.read(sys.stdin.fileno(), 256).decode(errors="replace")


def check_firmware(info, name):
    """Raises InputError where it cannot be validated."""
    for capability, lacks in ((Capability.FIT, "computes no locations"), (Capability.RAW_STREAM, "sends no pressures")):
        if not info.capabilities & capability:
            why = f"its firmware (scene {info.scene}) {lacks}, so there is nothing to validate; flash one of scene grasp"
            raise InputError(f"{name}: {why}")
    if info.rate_mHz and info.rate_mHz < 1000 * FRAME_RATE_MIN_Hz:
        raise InputError(f"{name}: {info.rate_mHz / 1000:.1f} frames a second are too few to see a weight settle; fingertip set rate=max")


def reading_of(frame):
    """None: held, or without pressures."""
    raw = frame.raw
    if not frame.has_raw or raw.flags & Flag.HELD:
        return None
    answered, left_out = ((bits >> np.arange(raw.sensors) & 1).astype(bool) for bits in (raw.valid, raw.saturated | raw.doubtful))
    return Reading(
        frame.t_us * 1e-6, answered, answered & ~left_out, np.array(raw.readings[0::2]) / Q10, np.array(raw.readings[1::2]) / Q10
    )


def _follow(device, walk, writer, colour):
    """Until the walk is done, or a key ends it."""
    last_s = host_time.now_s()
    with Guide(colour) as guide:
        while not walk.is_done:
            while (frame := device.take_one()) and not walk.is_done:
                last_s = host_time.now_s()
                for sequence, body in ((frame.sequence, frame.contact), (frame.raw_sequence, frame.raw)):
                    if sequence >= 0:
                        writer.packet(Packet(sequence, frame.t_us, body))
                for step in walk.take(frame.t_us * 1e-6, frame.contact if frame.has_contact else None, reading_of(frame)):
                    writer.event(event_of(step))
            guide.update(walk)
            keys = guide.keys()
            if "q" in keys:
                raise KeyboardInterrupt
            for _ in range(keys.count("u")):
                for step in walk.take_back():
                    writer.event(event_of(step))
            if host_time.now_s() - last_s > PATIENCE_s:
                raise InputError(f"{device.description}: sends no frames; see that its sensors answer (fingertip info)")
            host_time.sleep(POLL_s)


def validate_live(options):
    """The measurement. The fingertip sends as many frames a second afterwards as before. Raises FingertipError; KeyboardInterrupt: what was
    recorded until then is kept."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        with contextlib.suppress(ValueError):  # not the main thread
            signal.signal(number, signal.default_int_handler)
    share = {"auto": None, "socket": True, "serial": False}[options.transport]
    with Fingertip(options.port, serial=options.device, share=share, buffer_frames=1 << 20) as device:
        name, before_Hz = printable(device.description), device.info.rate_mHz / 1000
        check_firmware(device.info, name)
        info = device.set(rate_Hz=RATE_Hz)
        try:
            why = why_no_tangential(Pad.of(info_metadata(info)))
            if options.pull and why:
                print(f"fingertip: {why}", file=sys.stderr)
            info = info if options.serial else info._replace(serial="")
            walk = Walk(Pad.of(info_metadata(info)), options.weight, options.skin, options.pull or 0.0, options.thread_height)
            # Only what was measured: no port, no date, no name.
            keys = {"recorded_by": f"fingertip {__version__}", "started_utc": None}
            first = device.statistics
            writer = RecordingWriter(options.record, info, replace=options.overwrite, extra=keys, count=lambda: device.statistics - first)
            try:
                _follow(device, walk, writer, options.colour)
            except KeyboardInterrupt:
                writer.close("interrupted")
                raise
            except GoneError:
                writer.close("gone")
                raise InputError(f"{name}: vanished; plug it in and validate again") from None
            except FingertipError:
                writer.close("silent")
                raise
            writer.close("done")
        finally:
            with contextlib.suppress(FingertipError):
                device.set(rate_Hz=before_Hz)
    return walk.measurement.finish()
