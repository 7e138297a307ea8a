"""The clock that fingertips share by their sync pins, in the emulator: tests/emulated/test_sync.mjs and test_sync_wire.py."""

import json
import pathlib
import subprocess
import tempfile

from boards import image_of
from fingertip.files import InputError

EMULATED = pathlib.Path(__file__).resolve().parents[3] / "tests/emulated"
GOALS = (("sync_error_us_max", "<=", 1), ("sync_alignment_us", "<=", 2))


def measure(build, steps):
    """What a test finds amiss does not end it: it is a figure, and reported."""
    support, found = build / "tests/support", {}
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder:
        for name, call in (
            (
                "stamps",
                ("node", EMULATED / "test_sync.mjs", build.parent, build / "host_tools/tool/cli/fingertip", support / "command_frame"),
            ),
            (
                "wire",
                (
                    "/usr/bin/python3",
                    EMULATED / "test_sync_wire.py",
                    "--image",
                    image_of(build.parent, "pico_mux"),
                    "--support",
                    support,
                    "--node",
                    "node",
                    "--report",
                ),
            ),
        ):
            result = pathlib.Path(folder) / f"{name}.json"
            done = subprocess.run([*call, result], stdout=subprocess.DEVNULL, check=False)
            if not result.exists():
                raise InputError(f"{call[1]} measured nothing (status {done.returncode})")
            found |= json.loads(result.read_text(encoding="utf-8"))
            steps.say(f"sync pin: {name}")
    return found


def text(found):
    return [
        "## A clock that cameras share",
        "",
        "Edges at the sync pin of both boards, at any time, in storms of 1 MHz, after a recovery of the sensor bus and after a suspend:",
        "",
        f"- The worst stamp was off by {found['sync_error_us_max']:.2f} us.",
        f"- A storm of edges cost {100 * found['sync_storm_frames_lost_max']:.1f} % of the frames at most.",
        f"- In mode second the pin rose up to {found['sync_second_late_us_max']:.0f} us late. In mode frame the middle of a pulse was up to "
        f"{found['sync_frame_off_us_max']:.0f} us from the frame's time.",
        f"- Two fingertips on one wire, with clocks 50 ppm apart, recorded into one file: their rows were {found['sync_alignment_us']:.2f} us apart by the "
        f"edges (bound {found['sync_alignment_bound_us']:.1f} us), and {found['sync_alignment_usb_us']:.0f} us over USB before the edges acted.",
        "",
    ]
