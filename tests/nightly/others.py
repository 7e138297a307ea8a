"""Recordings and topics in programs of others: PyPI's mcap, rosbags, Fast DDS, Zenoh. With the packages of tests/requirements.txt."""

# real time: DDS and Zenoh on a network
import os
import shutil
import subprocess
import time

import bags
import hosts
import ros2_judges
from nightly import Programs, job

from fingertip import Fingertip
from fingertip.ros2 import Publisher

MCAP_s, ROS2_s, RATE_Hz = 5, 10, 1320
CUTS_s, LATENCY_s = 50, 20


@job("ecosystem", ("mcap_messages_differ", "<=", 0), ("mcap_bags_differ", "<=", 0), ("mcap_round_trips_differ", "<=", 0))
def mcap(build):
    tool, device = build / "host_tools/tool/cli/fingertip", build / "tests/support/fake_device"
    return {"mcap_seconds": MCAP_s, **bags.main(tool, device, MCAP_s)}


@job("ecosystem", ("ros2_unheard", "<=", 0), ("ros2_differ", "<=", 0), ("ros2_fps", ">=", 1308))
def ros2(build):
    """Contact and raw packets as messages on four topics by cyclonedds; Fast DDS receives them on the loopback interface."""
    os.environ.update(ros2_judges.LOCAL)
    with Programs(build) as programs:
        port = programs.fake_device(ros2_judges.SERIAL, f"rate={RATE_Hz}")
        listener = ros2_judges.Ears(build / "tests/integration/ros2/fast_dds_listener", programs.folder)
        programs.callback(listener.process.kill)
        with Publisher() as publisher, Fingertip(port) as fingertip:
            publisher.add(fingertip)
            listener.wait_until_they_hear(publisher)
            while fingertip.take_one():
                pass
            frames = iter(fingertip)
            first = last = next(frames)
            begun_s, cpu_s = time.perf_counter(), time.process_time()
            for last in frames:
                publisher.frame(last)
                publisher.state()
                if last.t_us - first.t_us >= ROS2_s * 1e6:
                    break
            wall_s, cpu_s = time.perf_counter() - begun_s, time.process_time() - cpu_s
            lost = fingertip.statistics.dropped_packets + fingertip.overrun_frames
            listener.wait_for_all(publisher)
        listener.wait_for("gone")
        received = listener.close()
    rosbags = ros2_judges.Rosbags()
    differ = sum(not rosbags.writes_the_same(ros2_judges.KINDS[topic], data) for topic, messages in received.items() for data in messages)
    sent, arrived = sum(publisher.sent.values()), sum(map(len, received.values()))
    return {
        "ros2_frames": last.frame - first.frame,
        "ros2_fps": round((last.frame - first.frame) / wall_s, 1),
        "ros2_core_percent": round(100 * cpu_s / wall_s, 1),
        "ros2_lost": lost,
        "ros2_refused": publisher.refused,
        "ros2_sent": sent,
        "ros2_heard": arrived,
        "ros2_unheard": sent - arrived,
        "ros2_differ": differ,
    }


def why_not():
    """Why there can be no network of several hosts here."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if not shutil.which("ip"):
        return "there is no ip (Debian: iproute2)"
    if subprocess.run(["unshare", "--net", "true"], capture_output=True, check=False).returncode != 0:
        return "this system gives no network namespaces"
    return ""


@job(
    "ecosystem",
    ("zenoh_lost_uncounted", "<=", 0),
    ("zenoh_not_sent_but_recorded", "<=", 0),
    ("zenoh_lost_by_network", "<=", 0),
    ("zenoh_restarts_missed", "<=", 0),
)
def zenoh_cuts(build):
    reason = why_not()
    return {"zenoh_skipped": reason} | ({} if reason else hosts.cuts(build / "tests/support/fake_device", CUTS_s))


@job("ecosystem", ("zenoh_latency_median_ms", "<=", 1))
def zenoh_latency(build):
    return hosts.latency(build / "tests/support/fake_device", LATENCY_s)
