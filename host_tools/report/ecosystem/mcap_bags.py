"""Whether MCAP recordings say in others' tools what the CSV file says, and what is left of one that was cut."""

import json
import pathlib
import subprocess

from fingertip.files import InputError

ROOT = pathlib.Path(__file__).resolve().parents[3]
SECONDS = 5
TRUNCATIONS = 1000
PATIENCE_s = 1800
GOALS = (
    ("mcap_messages_differ", "<=", 0),
    ("mcap_bags_differ", "<=", 0),
    ("mcap_round_trips_differ", "<=", 0),
    ("mcap_chunks_lost", "<=", 1),
    ("mcap_truncations_unread", "<=", 0),
)


def measure(build, steps):
    tool, fake_device, python = (
        build / "host_tools/tool/cli/fingertip",
        build / "tests/support/fake_device",
        ROOT / "build/venv/bin/python",
    )
    for path, how in ((fake_device, "cmake --build --preset host"), (python, "sh cmake/bootstrap.sh test")):
        if not path.exists():
            raise InputError(f"{path} is not there; {how}")
    done = subprocess.run(
        [python, ROOT / "tests/support/bags.py", tool, fake_device, str(SECONDS), str(TRUNCATIONS)],
        capture_output=True,
        text=True,
        timeout=PATIENCE_s,
        check=False,
    )
    if done.returncode != 0:
        raise InputError(f"the judges of MCAP files failed: {done.stderr.strip()[-500:]}")
    found = json.loads(done.stdout)
    steps.say(f"{found['mcap_messages']} messages of MCAP files, {found['mcap_messages_differ']} differ")
    return {"mcap_seconds": SECONDS, **found}


def text(found):
    return [
        "## MCAP",
        "",
        f"A recording of a simulated fingertip by the tool ({found['mcap_seconds']} s, 400 frames a second, packets lost on purpose), and one of random "
        "packets by the Python package with all flags, restarts and missing packets. Each as the tool writes it and as the package does, which must "
        f"be equal; {found['mcap_messages']} messages in all, read by PyPI's mcap with mcap-ros2-support, by mcap without the index, and by rosbags, "
        "and compared with one another and with the cells of the CSV file ([bags.py](../../../tests/support/bags.py)). Round trips, byte by byte: CSV, MCAP, CSV; MCAP, CSV, "
        "MCAP; bytes of the line, MCAP, bytes of the line. None was opened in ROS 2 or Foxglove themselves.",
        "",
        f"Cut at {found['mcap_truncations']} random bytes: at most {found['mcap_chunks_lost']} chunk is lost, the one that was cut, and the tool, the "
        f"package and mcap read all of the others; not so {found['mcap_truncations_unread']} times. A frame takes "
        f"{found['mcap_bytes_per_frame']} bytes, in the CSV file {found['mcap_csv_bytes_per_frame']}, where pressures hardly change, as they do here; the package needs "
        f"{found['mcap_python_us_per_line']} us of a processor for one.",
        "",
    ]
