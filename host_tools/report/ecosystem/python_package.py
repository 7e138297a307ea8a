"""What the Python package costs a program, what it loses, and whether it speaks as the firmware does."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from fingertip import wire
from fingertip.errors import PacketError
from fingertip.files import InputError

ROOT = pathlib.Path(__file__).resolve().parents[3]
SECONDS = 60
RATE_Hz = 1310  # 763 us a frame; 764 would be 1308.9, and the last one may come late
PATIENCE_s = 60
GOALS = (("python_core_percent", "<=", 6), ("python_lost", "<=", 0), ("python_fps", ">=", 1308), ("python_vectors_differ", "<=", 0))


def vectors_that_differ():
    """Of tests/vectors/wire, whose bytes the firmware's codec has to decode and encode too: how many there are, and which differ."""
    paths, differ = sorted((ROOT / "tests/vectors/wire").glob("*.txt")), []
    for path in paths:
        words = [word for line in path.read_text(encoding="utf-8").splitlines() for word in line.split("#")[0].split()]
        middle = words.index("frame")
        packet, frame = (bytes.fromhex("".join(part)) for part in (words[1:middle], words[middle + 1 :]))
        try:
            same = wire.cobs_decode(frame[:-1]) == packet and wire.encode(wire.decode(frame[:-1])) == frame
        except PacketError:
            same = False
        if not same:
            differ.append(path.stem)
    return len(paths), differ


def wait_for(port):
    end_s = time.monotonic() + PATIENCE_s
    while not port.is_symlink():
        if time.monotonic() > end_s:
            raise InputError(f"the simulated fingertip: waited {PATIENCE_s} s in vain")
        time.sleep(0.02)


def reading(build):
    fake = build / "tests/support/fake_device"
    if not fake.exists():
        raise InputError(f"{fake} is not there; build it: cmake --build --preset host")
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder:
        port = pathlib.Path(folder) / "port"
        device = subprocess.Popen([fake, port, f"rate={RATE_Hz}", f"life={SECONDS + 2 * PATIENCE_s}"])
        try:
            wait_for(port)
            done = subprocess.run(
                [sys.executable, ROOT / "host_tools/report/ecosystem/reader.py", port, str(SECONDS)],
                capture_output=True,
                text=True,
                timeout=SECONDS + PATIENCE_s,
                env={**os.environ, "XDG_RUNTIME_DIR": folder},
                check=False,
            )
        finally:
            device.kill()
            device.wait()
    if done.returncode != 0:
        raise InputError(f"the Python reader failed: {done.stderr.strip()[-500:]}")
    return json.loads(done.stdout)


def measure(build, steps):
    count, differ = vectors_that_differ()
    steps.say(f"{count} vectors, {len(differ)} differ")
    found = reading(build)
    steps.say(f"{found['frames']} frames by Python")
    return {
        "python_seconds": SECONDS,
        "python_frames": found["frames"],
        "python_fps": round(found["fps"], 1),
        "python_core_percent": round(found["core_percent"], 2),
        "python_us_per_packet": round(found["us_per_packet"], 1),
        "python_lost": found["lost"],
        "python_clock_us": round(found["uncertainty_us"], 1),
        "python_vectors": count,
        "python_vectors_differ": len(differ),
        "python_vectors_that_differ": differ,
    }


def text(found):
    return [
        "## Python",
        "",
        f"A program takes and judges every frame of a simulated fingertip, which says contact and raw packets of fifteen sensors on a pseudo-terminal at "
        f"{RATE_Hz} frames a second, for {found['python_seconds']} s ([reader.py](reader.py)): processor time of all its threads over wall-clock time on this "
        "computer, and everything that was lost on the way. Beside it the vectors of tests/vectors/wire, decoded and encoded by the package; the "
        "firmware's codec passes them in its unit test.",
        "",
    ]
