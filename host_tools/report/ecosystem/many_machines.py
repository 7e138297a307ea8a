"""Whether a recording of many computers over Zenoh loses anything without saying so, and what the way costs."""

import json
import os
import pathlib
import shutil
import subprocess

from fingertip.files import InputError

ROOT = pathlib.Path(__file__).resolve().parents[3]
SECONDS, LATENCY_SECONDS = 50, 20
PATIENCE_s = 600
GOALS = (
    ("zenoh_lost_uncounted", "<=", 0),
    ("zenoh_not_sent_but_recorded", "<=", 0),
    ("zenoh_lost_by_network", "<=", 0),
    ("zenoh_restarts_missed", "<=", 0),
    ("zenoh_latency_median_ms", "<=", 1),
)
OF_CUTS = (
    "hosts",
    "fingertips",
    "sent",
    "recorded",
    "before_the_recording",
    "lost_counted",
    "lost_uncounted",
    "not_sent_but_recorded",
    "lost_by_network",
    "lost_by_killed_bridge",
    "losses_in_file",
    "recorder_core_percent",
    "rate_Hz",
    "asked_again",
    "device_restarts",
    "restarts_missed",
)


def why_not():
    """Why there can be no network of several hosts here; nothing if there can."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        return "network namespaces need root"
    if not shutil.which("ip"):
        return "there is no ip (Debian: iproute2)"
    if subprocess.run(["unshare", "--net", "true"], capture_output=True, check=False).returncode != 0:
        return "this system gives no network namespaces"
    return ""


def measure(build, steps):
    fake_device, python = build / "tests/support/fake_device", ROOT / "build/venv/bin/python"
    for path, how in ((fake_device, "cmake --build --preset host"), (python, "sh cmake/bootstrap.sh test")):
        if not path.exists():
            raise InputError(f"{path} is not there; {how}")

    def run(what, seconds):
        done = subprocess.run(
            [python, ROOT / "tests/nightly/hosts.py", fake_device, what, str(seconds)],
            capture_output=True,
            text=True,
            timeout=PATIENCE_s,
            check=False,
        )
        if done.returncode != 0:
            raise InputError(f"fingertips over Zenoh failed: {done.stderr.strip()[-500:]}")
        return json.loads(done.stdout)

    reason = why_not()
    found = {"zenoh_skipped": reason, **({f"zenoh_{name}": None for name in OF_CUTS} if reason else run("cuts", SECONDS))}
    steps.say(
        f"hosts on Zenoh: {reason or str(found['zenoh_sent']) + ' packets sent, ' + str(found['zenoh_lost_uncounted']) + ' lost uncounted'}"
    )
    found |= run("latency", LATENCY_SECONDS)
    steps.say(f"latency over Zenoh {found['zenoh_latency_median_ms']} ms")
    return found


def text(found):
    lines = ["## Many machines", ""]
    if found["zenoh_skipped"]:
        lines += [f"Hosts that are cut off: not measured, {found['zenoh_skipped']}.", ""]
    else:
        lines += [
            f"{found['zenoh_fingertips']} simulated fingertips of {found['zenoh_rate_Hz']} frames a second at {found['zenoh_hosts']} hosts (network "
            "namespaces on one computer) are recorded by one `fingertip-recorder` over a Zenoh router, while the router is killed "
            "for 3 s, a host is cut off for 5 s and another one for 15 s, longer than Zenoh's lease, a bridge is killed for 2 s, and a fingertip unplugged for 1.5 s ([hosts.py](../../../tests/nightly/hosts.py)). The truth is what "
            f"each fingertip sent, read on a second terminal: {found['zenoh_sent']} packets since the recording began. "
            f"{found['zenoh_recorded']} are in the file, {found['zenoh_asked_again']} of them were asked for again. {found['zenoh_lost_counted']} are counted as lost, "
            f"{found['zenoh_lost_by_killed_bridge']} of them at the host whose bridge was killed with what it kept, the answers "
            f"while the next one opened its fingertips among them. The recorder needs {found['zenoh_recorder_core_percent']} % of a processor's core, "
            "writing all that; a second core does not help it. Hosts share one clock here: how far real hosts' clocks "
            "are apart was not measured.",
            "",
        ]
    return lines + [
        f"On this computer's loopback, at {found['zenoh_fps']} frames a second of contact and raw packets: from when the bridge has read a packet to "
        f"a Python subscriber's callback, through a router, {found['zenoh_latency_median_ms']} ms in the median, {found['zenoh_latency_99_ms']} ms "
        f"in 99 of 100; the bridge needs {found['zenoh_bridge_core_percent']} % of a processor's core, and "
        f"{found['zenoh_live_percent']} % of the packets reached the live subscriber.",
        "",
    ]
