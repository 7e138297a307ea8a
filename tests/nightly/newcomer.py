"""What a user without a fingertip meets: `fingertip simulate`, the README's example, a release built twice, and
README's commands on an empty Debian."""

# real time: how long things take
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

from nightly import ROOT, Programs, job, run
from readme_example import environment_of, run_example, runs, simulated

from fingertip.files import InputError

TOOL, SECONDS = "host_tools/tool/cli/fingertip", 10
REPEATS = 5  # the best counts: this computer may have other work


def help_s(tool):
    begin_s = time.monotonic()
    run(tool, "--help")
    return time.monotonic() - begin_s


def ready_s(tool, environment):
    with simulated(tool, environment) as after_s:
        return after_s


@job(
    "newcomer",
    ("readme_words", "<=", 600),
    ("help_ms", "<=", 30),
    ("simulate_ready_s", "<=", 2),
    ("simulate_fps", ">=", 1300),
    ("simulate_lost", "<=", 0),
    ("python_example_runs", ">=", 1),
    ("first_figure_s", "<=", 19),
)
def simulate(build):
    tool = build / TOOL
    with Programs(build) as programs:
        environment = environment_of(programs.folder)
        soonest_s = min(ready_s(tool, environment) for _ in range(REPEATS))
        begun_s = time.monotonic()
        with simulated(tool, environment):
            lines, _ = run_example(environment)
            first_figure_s = time.monotonic() - begun_s
            run(tool, "set", "osr=256", "rate=max", env=environment)
            found = json.loads(run(sys.executable, pathlib.Path(__file__).with_name("package.py"), "sim:", SECONDS))
    return {
        "readme_words": len((ROOT / "README.md").read_text(encoding="utf-8").split()),
        "help_ms": round(1000 * min(help_s(tool) for _ in range(REPEATS)), 1),
        "simulate_ready_s": round(soonest_s, 3),
        "simulate_fps": round(found["fps"], 1),
        "simulate_lost": found["lost"],
        "python_example_runs": int(runs(lines)),
        "first_figure_s": round(first_figure_s, 1),
    }


@job("newcomer", ("release_differs", "<=", 0))
def release(_):
    """cmake/release.py twice, into folders of different names, without the compiler cache: files whose SHA-256 differs."""
    with Programs(None) as programs:
        found, commits = [], set()
        for name in ("first", "a_second_one"):
            run(sys.executable, ROOT / "cmake/release.py", programs.folder / name, env={**os.environ, "CCACHE_DISABLE": "1"})
            lines = (programs.folder / name / "SHA256SUMS").read_text(encoding="ascii").splitlines()
            found.append({path: digest for digest, path in (line.split("  ", 1) for line in lines)})
            commits.add(subprocess.run(["git", "-C", ROOT, "rev-parse", "HEAD"], capture_output=True, check=True).stdout)
    if len(commits) > 1:
        raise InputError("a commit was made between the two releases; run again")
    differ = sorted(name for name in found[0].keys() | found[1].keys() if found[0].get(name) != found[1].get(name))
    return {"release_differs": len(differ), "release_files": len(found[0]), "release_that_differ": differ}


def seconds_in(system, command):
    """How long a command takes in the project's folder of another system."""
    mounts = "".join(f"mount --rbind /{folder} {system}/{folder} && " for folder in ("proc", "sys", "dev"))
    begun_s = time.monotonic()
    run("unshare", "--mount", "sh", "-c", f"{mounts} exec chroot {system} sh -c 'cd /fingertip && {command}'")
    return time.monotonic() - begun_s


@job("newcomer", ("minutes_from_nothing", "<=", 20), ("demo_minutes_from_nothing", "<=", 4), ("quick_after_change_s", "<=", 60))
def from_nothing(_):
    """README's two commands on an empty Debian 12, installation and downloads included, and the quick tests after a change of one line of the fit."""
    if os.geteuid() != 0 or not shutil.which("debootstrap"):
        raise InputError("an empty Debian needs root and debootstrap")
    mirror = re.search(r"https?://\S+", run("apt-get", "indextargets", "--format", "$(REPO_URI)"))[0]
    with tempfile.TemporaryDirectory(prefix="nightly-", dir=ROOT / "build") as folder:
        systems = [os.path.join(folder, name) for name in ("test", "demo")]
        run("debootstrap", "--variant=minbase", "--include=ca-certificates", "bookworm", systems[0], mirror)
        run("git", "clone", "--quiet", ROOT, f"{systems[0]}/fingertip")
        for path in ("/etc/resolv.conf", "/etc/pip.conf", os.path.expanduser("~/.npmrc")):
            if os.path.exists(path):
                shutil.copy(path, systems[0] + path)
        shutil.copytree("/etc/apt", f"{systems[0]}/etc/apt", dirs_exist_ok=True)
        run("cp", "-a", *systems)
        demo_s = seconds_in(systems[1], "sh cmake/bootstrap.sh demo")
        test_s = seconds_in(systems[0], "sh cmake/bootstrap.sh test")
        quick_s = seconds_in(systems[0], "echo >> firmware/fit/fit_grid.c && sh cmake/bootstrap.sh test quick")
    return {"minutes_from_nothing": test_s / 60, "demo_minutes_from_nothing": demo_s / 60, "quick_after_change_s": quick_s}
