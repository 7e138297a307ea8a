"""A recording of many computers over Zenoh. With the packages of tests/requirements.txt."""

# real time: Zenoh on a network
import os
import shutil
import subprocess

import hosts
from nightly import job

CUTS_s = 50


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
