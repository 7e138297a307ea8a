"""Whether all that a fingertip says on topics of ROS 2 is heard by a DDS of others, and byte by byte what rosbags would write."""

import json
import pathlib
import subprocess

from fingertip.files import InputError

ROOT = pathlib.Path(__file__).resolve().parents[3]
PYTHON = ROOT / "build/venv/bin/python"
SECONDS, RATE_Hz = 10, 1320
PATIENCE_s = 300
GOALS = (("ros2_unheard", "<=", 0), ("ros2_differ", "<=", 0), ("ros2_fps", ">=", 1308))
FIGURES = ("frames", "fps", "core_percent", "lost", "refused", "sent", "heard", "differ")


def measure(build, steps):
    fake, listener = build / "tests/support/fake_device", build / "tests/integration/ros2/fast_dds_listener"
    if not listener.exists() or not PYTHON.exists():
        steps.say("no ROS 2 topics: Fast DDS (libfastrtps-dev) or build/venv is not there")
        return {f"ros2_{name}": None for name in (*FIGURES, "unheard")}
    done = subprocess.run(
        [PYTHON, pathlib.Path(__file__).with_name("ros2_talker.py"), fake, listener, str(SECONDS), str(RATE_Hz)],
        capture_output=True,
        text=True,
        timeout=PATIENCE_s,
        check=False,
    )
    if done.returncode != 0:
        raise InputError(f"topics of ROS 2: {done.stderr.strip()[-500:]}")
    found = json.loads(done.stdout)
    steps.say(f"{found['sent']} messages on topics of ROS 2, {found['heard']} heard")
    return {f"ros2_{name}": round(found[name], 1) for name in FIGURES} | {"ros2_unheard": found["sent"] - found["heard"]}


def text(found):
    return [
        "## Topics of ROS 2",
        "",
        f"`fingertip-ros2` for {SECONDS} s: a simulated fingertip says contact and raw packets of fifteen sensors on a pseudo-terminal at {RATE_Hz} frames a "
        "second, each becomes messages on four topics by cyclonedds, and Fast DDS, which ROS 2 has as its default, hears them on the loopback interface. "
        "ros2_unheard: messages sent that it did not hear. ros2_differ: messages that rosbags, having read them, writes otherwise. ros2_core_percent: the "
        "processor time of reading, encoding and sending, in percent of one core of this computer. Not run against ROS 2.",
        "",
        f"{found['ros2_sent']} messages of {found['ros2_frames']} frames were sent, {found['ros2_core_percent']} % of a core.",
        "",
    ]
