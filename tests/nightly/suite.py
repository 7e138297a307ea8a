"""The test suite: whether it is green on a busy machine as on a quiet one, what it takes, and what the README's commands take from nothing."""

# real time: how long the suite takes
import contextlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

from check_sources import waits
from nightly import ROOT, job, run

from fingertip.files import InputError

WHOLE, QUICK = 2, 6  # runs; half of them on a busy machine
# Both end with this process, which is their first argument.
BURN = "import os, sys\nwhile os.getppid() == int(sys.argv[1]):\n    sum(range(1000000))\n"
WRITE = """
import os, sys
block = os.urandom(1 << 20)
with open(sys.argv[2], "wb", buffering=0) as file:
    while os.getppid() == int(sys.argv[1]):
        file.seek(0)
        for _ in range(256):
            file.write(block)
        os.fsync(file)
"""


@contextlib.contextmanager
def machine(folder, busy):
    """A busy one: as many processes compute as there are processors, and one writes to the disk."""
    own = str(os.getpid())
    calls = [(BURN, own)] * os.cpu_count() + [(WRITE, own, os.path.join(folder, "busy"))]
    processes = [subprocess.Popen([sys.executable, "-c", *call]) for call in calls if busy]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def status_of(case):
    """A test that was not run is skipped if the test itself reported so, and a failure if its program or its fixture is missing."""
    if case.get("status") == "notrun":
        skipped = case.find("skipped")
        return "skipped" if skipped is not None and skipped.get("message", "").startswith("SKIP_") else "fail"
    return {"run": "run", "disabled": "skipped"}.get(case.get("status"), "fail")


def run_suite(build, label, busy):
    """Seconds, and name -> (seconds, status, output)."""
    with tempfile.TemporaryDirectory(prefix="suite-", dir=build) as folder, machine(folder, busy):
        result, begun_s = os.path.join(folder, "result.xml"), time.monotonic()
        words = ["--output-junit", result, "--test-output-truncation", "head", "-LE", "^(nightly|browser|linux)$"]
        words += ["-L", f"^{label}$"] if label else []
        subprocess.run(["ctest", "--test-dir", build, "-j", str(os.cpu_count() + 1), *words], stdout=subprocess.DEVNULL, check=False)
        seconds = time.monotonic() - begun_s
        cases = list(xml.etree.ElementTree.parse(result).iter("testcase"))
    if not cases:
        raise InputError(f"{build}: no test was run")
    return seconds, {case.get("name"): (float(case.get("time", 0)), status_of(case), case.findtext("system-out") or "") for case in cases}


def with_status(runs, status):
    return sorted({name for _, _, tests in runs for name, (_, found, _) in tests.items() if found == status})


def summary(label, runs):
    """runs: [(busy, seconds, tests)]."""
    failed = [busy for busy, _, tests in runs if any(status == "fail" for _, status, _ in tests.values())]
    return {f"{label}_runs": len(runs), f"{label}_failures": len(failed), f"{label}_failed": with_status(runs, "fail")}


@job(
    "suite",
    ("whole_runs", ">=", WHOLE),
    ("whole_failures", "<=", 0),
    ("quick_runs", ">=", QUICK),
    ("quick_failures", "<=", 0),
    ("quick_seconds", "<=", 60),
    ("whole_test_seconds", "<=", 1400),
    ("whole_minutes", "<=", 12),
    ("sleeps", "<=", 0),
    ("retries", "<=", 0),
)
def runs(build):
    whole = [(busy, *run_suite(build, None, busy)) for busy in (False, True) for _ in range(WHOLE // 2)]
    quick = [(busy, *run_suite(build, "quick", busy)) for busy in (False, True) for _ in range(QUICK // 2)]
    times = {name: seconds for busy, _, tests in whole if not busy for name, (seconds, _, _) in tests.items()}
    for _, _, tests in whole:
        for name, (_, status, output) in tests.items():
            if status == "fail":
                print(f"{name}:\n{output[-3000:]}")
    waiting = waits(ROOT)
    return {
        **summary("whole", whole),
        **summary("quick", quick),
        "whole_tests": len(times),
        "whole_test_seconds": sum(times.values()),
        "whole_minutes": max(seconds / 60 for busy, seconds, _ in whole if not busy),
        "quick_seconds": max(seconds for busy, seconds, _ in quick if not busy),
        "skipped": with_status(whole, "skipped"),
        "sleeps": sum(what == "sleep" for _, _, what in waiting),
        "retries": sum(what == "retry" for _, _, what in waiting),
    }


def seconds_in(system, command):
    """How long a command takes in the project's folder of another system."""
    mounts = "".join(f"mount --rbind /{folder} {system}/{folder} && " for folder in ("proc", "sys", "dev"))
    begun_s = time.monotonic()
    run("unshare", "--mount", "sh", "-c", f"{mounts} exec chroot {system} sh -c 'cd /fingertip && {command}'")
    return time.monotonic() - begun_s


@job("suite", ("minutes_from_nothing", "<=", 20), ("demo_minutes_from_nothing", "<=", 4), ("quick_after_change_s", "<=", 60))
def from_nothing(_):
    """README's two commands on an empty Debian 12, installation and downloads included, and the quick tests after a change of one line of the fit."""
    if os.geteuid() != 0 or not shutil.which("debootstrap"):
        raise InputError("an empty Debian needs root and debootstrap")
    mirror = re.search(r"https?://\S+", run("apt-get", "indextargets", "--format", "$(REPO_URI)"))[0]
    with tempfile.TemporaryDirectory(prefix="nightly-", dir=ROOT / "build") as folder:
        systems = [os.path.join(folder, name) for name in ("test", "demo")]
        run("debootstrap", "--variant=minbase", "--include=ca-certificates", "bookworm", systems[0], mirror)
        run("git", "clone", "--quiet", ROOT, f"{systems[0]}/fingertip")
        for path in ("/etc/resolv.conf", "/etc/pip.conf", "/root/.npmrc"):
            if os.path.exists(path):
                shutil.copy(path, systems[0] + path)
        shutil.copytree("/etc/apt", f"{systems[0]}/etc/apt", dirs_exist_ok=True)
        run("cp", "-a", *systems)
        demo_s = seconds_in(systems[1], "sh cmake/bootstrap.sh demo")
        test_s = seconds_in(systems[0], "sh cmake/bootstrap.sh test")
        quick_s = seconds_in(systems[0], "echo >> firmware/fit/fit_grid.c && sh cmake/bootstrap.sh test quick")
    return {"minutes_from_nothing": test_s / 60, "demo_minutes_from_nothing": demo_s / 60, "quick_after_change_s": quick_s}
