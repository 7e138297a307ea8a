#!/usr/bin/python3
"""Publishes a simulated fingertip on topics of ROS 2, has Fast DDS and rosbags judge what comes, and says as JSON what was found.

    ros2_talker.py FAKE_DEVICE FAST_DDS_LISTENER SECONDS RATE_Hz

sent, heard: messages on all topics. refused: not taken by DDS. differ: messages of which rosbags writes other bytes than came. core_percent:
processor time of reading, encoding and sending over wall-clock time. Needs cyclonedds and rosbags (tests/requirements.txt).
"""

import json
import os
import pathlib
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
from fingertip import Fingertip  # noqa: E402
from fingertip.ros2 import Publisher  # noqa: E402
from ros2_judges import KINDS, LOCAL, Ears, Rosbags, fake_device  # noqa: E402


def talk(port, folder, listener, seconds):
    ears = Ears(listener, folder)
    try:
        with Publisher() as publisher, Fingertip(port) as fingertip:
            publisher.add(fingertip)
            ears.wait_until_they_hear(publisher)
            while fingertip.take_one():
                pass
            frames = iter(fingertip)
            first = last = next(frames)
            begun_s, busy_s = time.perf_counter(), time.process_time()
            for last in frames:
                publisher.frame(last)
                publisher.state()
                if last.t_us - first.t_us >= seconds * 1e6:
                    break
            wall_s, cpu_s = time.perf_counter() - begun_s, time.process_time() - busy_s
            count, lost = last.frame - first.frame, fingertip.statistics.dropped_packets + fingertip.overrun_frames
            ears.wait_for_all(publisher)
        ears.wait_for("gone")
        heard = ears.close()
    finally:
        ears.process.kill()
    rosbags = Rosbags()
    differ = {topic: sum(not rosbags.writes_the_same(KINDS[topic], data) for data in messages) for topic, messages in heard.items()}
    return {
        "frames": count,
        "fps": count / wall_s,
        "core_percent": 100 * cpu_s / wall_s,
        "lost": lost,
        "refused": publisher.refused,
        "sent": sum(publisher.sent.values()),
        "heard": sum(map(len, heard.values())),
        "differ": sum(differ.values()),
        "topics": len(KINDS),
    }


def main(fake, listener, seconds, rate_Hz):
    with tempfile.TemporaryDirectory(prefix="fingertip-") as name:
        folder = pathlib.Path(name)
        os.environ.update(LOCAL, XDG_RUNTIME_DIR=name)
        with fake_device(fake, folder, f"rate={rate_Hz}", f"life={2 * int(seconds) + 60}") as port:
            print(json.dumps(talk(port, folder, listener, int(seconds))))


if __name__ == "__main__":
    main(*sys.argv[1:])
