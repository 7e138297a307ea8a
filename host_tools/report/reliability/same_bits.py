"""Whether the fit and the controller of a grasp compute the same bits on every processor: tests/emulated/fit_bits, with every press."""

import pathlib
import re
import subprocess

from boards import BOARDS
from fingertip.files import InputError

ROOT = pathlib.Path(__file__).resolve().parents[3]
TEST = ROOT / "tests/emulated/fit_bits/test_fit_bits.py"
GOALS = (("same_bits_presses", ">=", 10000), ("same_bits_different", "<=", 0), ("same_bits_failed", "<=", 0))


def measure(build, steps):
    """A difference does not end it: it is a figure, and reported."""
    steps.say("the same bits on Cortex-M0+, M4F and host")
    boards = build.parent / BOARDS[0]
    done = subprocess.run(
        [
            "/usr/bin/python3",
            TEST,
            "--host",
            build / "tests/emulated/fit_bits/fit_bits",
            "--m4f",
            build / "tests/emulated/fit_bits/fit_bits_m4f.elf",
            "--m0",
            boards / "fit_bits_m0.elf",
            "--rp2040",
            boards / "fit_bits_rp2040.bin",
            "--qemu",
            "qemu-system-arm",
            "--node",
            "node",
            "SameBits",
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    compared = [int(count) for count in re.findall(r"same bits: (\d+) presses", done.stdout)]
    if not compared:
        raise InputError(f"{TEST.name} compared nothing: {done.stderr.strip()[-500:]}")
    return {
        "same_bits_presses": max(compared),
        "same_bits_compared": sum(compared),
        "same_bits_different": sum(int(count) for count in re.findall(r"(\d+) of \d+ differ", done.stderr)),
        "same_bits_failed": done.returncode,
    }


def text(found):
    return [
        "## The same bits",
        "",
        f"{found['same_bits_compared']} results of fits and grasps on a Cortex-M0+ (the RP2040's, emulated; QEMU's), a Cortex-M4F "
        f"(QEMU) and this host, up to {found['same_bits_presses']} presses a kernel: {found['same_bits_different']} differ.",
        "",
    ]
