"""Measurements of the release images in the emulator: rates, latencies, sleep. The same bit for bit each time."""

import csv
import json
import pathlib
import sys

import numpy as np
from boards import BOARDS, TO_BUILD, image_of

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "host_tools" / "python"))
from fingertip.files import CONTACT, FIT_VALID, TRUTH_COLUMNS, InputError, read_recording, write_scenario  # noqa: E402
from fingertip.wire import cobs_decode  # noqa: E402
from reporting import built, run  # noqa: E402

HELD = 1 << 6
# Of a packet, firmware/wire/PROTOCOL.md.
WIRE_CONTACT = 0x01
HEADER_BYTES = 12
CLOCK_Hz = 125e6
# Longest conversion by OSR, us: MS5840-02BA datasheet.
CONVERSION_us = {256: 560, 512: 1100, 1024: 2170, 2048: 4320, 4096: 8610, 8192: 17200}
# By then the contact is there, the tare is over, and the settings have been obeyed.
FROM_s = 1.0
# The firmware waits for a conversion by this much longer than the datasheet's maximum.
MARGIN = 1.05


class Tools:
    """The boards' own images. scene: theirs (cmake/options.cmake)."""

    scene = "grasp"

    def __init__(self, build, boards):
        self.fingertip = pathlib.Path(build) / "host_tools/tool/cli/fingertip"
        self.command_frame = pathlib.Path(build) / "tests/support/command_frame"
        self.boards = pathlib.Path(boards)
        for path in (self.fingertip, self.command_frame, *(self.image(board) for board in BOARDS)):
            built(path)

    def image(self, board, suffix="bin"):
        return image_of(self.boards, board, suffix)

    def encoded(self, *command):
        return run(self.command_frame, *command).strip()


def pressed(path, name, times_s, sensors_Pa):
    """A scenario of pressures [time, sensor], whose truth is not judged."""
    columns = dict.fromkeys(TRUTH_COLUMNS, np.zeros(len(times_s))) | {"t_s": times_s, "sensors_Pa": sensors_Pa}
    write_scenario(path, {"name": name, "sensors": sensors_Pa.shape[1]}, columns)
    return path


def scenario(folder, name, seconds, stem=None):
    """ "wander" touches from 0.65 s on; "rest" never."""
    path = pathlib.Path(folder) / f"{stem or name}.csv"
    if name != "rest":
        run(sys.executable, ROOT / "host_tools/python", "scenario", name, "-o", path, "--seconds", f"{seconds:g}", "--overwrite")
        return path
    return pressed(path, name, [0, seconds], np.zeros((2, 15)))


def contact_times_us(usb_log, zero_us):
    """For each contact packet: device time of its frame, when its first part was offered, when its last byte was delivered."""
    times, frame, offered_us = [], bytearray(), 0.0
    with open(usb_log, newline="") as file:
        for row in csv.DictReader(file):
            if row["dir"] != "in" or row["endpoint"] != "2":
                continue
            for byte in bytes.fromhex(row["bytes"]):
                if not frame:
                    offered_us = float(row["offered_ns"]) / 1e3 - zero_us
                if byte:
                    frame.append(byte)
                    continue
                packet = cobs_decode(bytes(frame))
                if len(packet) > HEADER_BYTES and packet[1] == WIRE_CONTACT:
                    times.append((int.from_bytes(packet[4:HEADER_BYTES], "little"), offered_us, float(row["t_ns"]) / 1e3 - zero_us))
                frame = bytearray()
    return np.array(times)


def distribution(values):
    return {
        "median": float(np.median(values)),
        "p99": float(np.percentile(values, 99)),
        "p99_9": float(np.percentile(values, 99.9)),
        "max": float(values.max()),
    }


class Measurement:
    """One board at one OSR for some seconds, contact and health packets streamed to a host that reads.

    Fitted frames hold a fit of this moment's pressures; held ones repeat the fit before while the sensors measure their temperature.
    """

    def __init__(self, tools, folder, board, osr, path, seconds, commands=()):
        """commands: encoded, sent as soon as it streams and the one before is stored."""
        base = pathlib.Path(folder) / f"{board}-{osr}-{path.stem}"
        script = base.with_suffix(".script")
        script.write_text(
            f"0.45 dtr 1\n0.452 {tools.encoded('info')}\n0.455 {tools.encoded('osr', osr)}\n"
            f"0.46 {tools.encoded('stream', 'contact,health')}\n"
            + "".join(f"{0.465 + 0.09 * n:.3f} {command}\n" for n, command in enumerate(commands))
        )

        # A health packet comes with each whole second.
        self.name = name = f"{base}.run"
        chip = ("--board", board, "--image", tools.image(board), "--scenario", path, "--seconds", FROM_s + seconds + 0.02)
        out = ("--capture", f"{name}.ftr", "--report", f"{name}.json", "--count-from", FROM_s, "--usb-log", f"{name}.usb")
        run("node", ROOT / "host_tools/simulation/emulator/main.mjs", *chip, "--host-script", script, *out)
        emulated = json.loads(pathlib.Path(f"{name}.json").read_text())
        counted = emulated["counted"]
        self.cycles = counted["cycles"]
        self.sleep_percent = 100 * (1 - self.cycles / (counted["emulated_s"] * CLOCK_Hz))
        run(tools.fingertip, "convert", f"{name}.ftr", f"{name}.csv")
        recording = read_recording(f"{name}.csv")
        if recording.metadata["scene"] != tools.scene:
            raise InputError(f"{tools.image(board)}: is of scene {recording.metadata['scene']}, not {tools.scene}; {TO_BUILD}")
        self.iterations = int(recording.metadata["fit_iterations"])
        zero_us = emulated["device_time_zero_s"] * 1e6
        self._rates(recording, recording.has_contact & (recording["t_us"] >= FROM_s * 1e6 - zero_us))
        self._losses(recording)
        times = contact_times_us(f"{name}.usb", zero_us)
        times = times[times[:, 0] >= FROM_s * 1e6 - zero_us]
        # The time of a frame is the middle of its conversion, waiting included.
        converted_us = times[:, 0] - CONVERSION_us[osr] * MARGIN / 2 + CONVERSION_us[osr]
        self.offered_us, self.delivered_us = times[:, 1] - converted_us, times[:, 2] - converted_us

    def _rates(self, recording, rows):
        t_us, flags = recording["t_us"][rows], recording["flags"][rows].astype(np.int64)
        held = (flags & HELD) != 0
        fresh = ((flags & (CONTACT | FIT_VALID)) == CONTACT | FIT_VALID) & ~held
        self.seconds = float(t_us[-1] - t_us[0]) * 1e-6
        self.frames_per_s = (len(t_us) - 1) / self.seconds
        self.fitted_per_s = float(fresh[1:].sum()) / self.seconds
        self.held_per_s = float(held[1:].sum()) / self.seconds
        self.unfitted = int((~fresh & ~held).sum())
        steps_us = np.diff(t_us)
        # A frame whose time goes to the temperature may take longer, so its step is another.
        self.clock_jitter_us = float(np.ptp(steps_us[~held[1:] & ~held[:-1]]))
        self.stages_us = {
            name: float(recording[name][rows][~held].mean())
            for name in ("convert_us", "read_us", "queue_us", "condition_us", "fit_us", "contact_us")
        }

    def _losses(self, recording):
        """From the first frame on: what did not come, as the host and as the device counts it."""
        rows = recording.has_contact
        health = recording.health()[-1]
        self.sequence_gaps = int(recording.end["dropped_packets"])
        self.packets_dropped = health["packets_dropped"]
        self.frames_skipped = health["frames_skipped"]
        self.frames_missing = int((np.diff(recording["frame"][rows]) - 1).sum())
        self.damaged = sum(int(recording.end[name]) for name in ("crc_errors", "format_errors", "out_of_order"))

    @property
    def dropped(self):
        return max(self.sequence_gaps, self.packets_dropped) + max(self.frames_skipped, self.frames_missing) + self.damaged
