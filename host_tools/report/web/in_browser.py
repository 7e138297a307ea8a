"""What the page costs and keeps up with, in a headless Chromium that renders in software, served by `fingertip web`, with a program that
says what a fingertip of fifteen sensors says at its highest rate on a pseudo-terminal."""

import gzip
import os
import pathlib
import statistics
import sys
import tempfile
import types

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/web"))
import driven  # noqa: E402
from boards import PARALLEL, image_of  # noqa: E402
from browser import Browser, CannotRun  # noqa: E402
from fingertip.files import InputError  # noqa: E402
from fingertips import Bench  # noqa: E402
from tables import table_md  # noqa: E402

GOALS = (
    ("page_ready_s", "<=", 1),
    ("bundle_kB", "<=", 600),
    ("draws_per_s", ">=", 30),
    ("web_fps", ">=", 1308),
    ("web_lost", "<=", 0),
    ("web_memory_kB_per_minute", "<=", 100),
    ("web_foreign_requests", "<=", 0),
    ("web_steps_failed", "<=", 0),
)
STEP_OUTCOMES = {"ok": "as it should", "FAIL": "WRONG", "ERROR": "WRONG", "skipped": "not run"}
LOADS = 5
RATE_Hz = 1310  # as in the tools' report
WATCHED_s = 60
REMEMBERED_s = 600  # of memory
SETTLES_s = 180  # until what the page keeps has been filled once
LOOK_s = 20
SIMULATED = ("wasm/simulated.wasm", "wasm/objects.bin")


def compressed_kB(page):
    """(all but the simulated fingertip, the simulated fingertip), as a server would send them."""
    sizes = {str(path.relative_to(page)): len(gzip.compress(path.read_bytes(), 9)) for path in sorted(page.rglob("*")) if path.is_file()}
    apart = sum(sizes[name] for name in SIMULATED)
    return (sum(sizes.values()) - apart) / 1000, apart / 1000


def cpu_s(pid):
    """Of a process and all that came of it and has not ended."""
    ticks, children = {}, {}
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text(encoding="utf-8").rsplit(")", 1)[1].split()
        except OSError:  # it has just ended
            continue
        ticks[int(path.parent.name)] = int(fields[11]) + int(fields[12])
        children.setdefault(int(fields[1]), []).append(int(path.parent.name))
    tree = [pid]
    for parent in tree:
        tree += children.get(parent, [])
    return sum(ticks.get(each, 0) for each in tree) / os.sysconf("SC_CLK_TCK")


def held_kB(page):
    """Objects and buffers that live on after a collection."""
    page.call("HeapProfiler.collectGarbage")
    used = page.call("Runtime.getHeapUsage")
    return (used["usedSize"] + used.get("backingStorageSize", 0)) / 1000


def watched(page, seconds):
    """Pictures, frames and losses of so many seconds."""
    before = page.run(driven.COUNTS)
    busy_s = cpu_s(page.browser.process_id)
    page.browser.pump(seconds)
    after = page.run(driven.COUNTS)
    took_s = (after["at_ms"] - before["at_ms"]) / 1000
    frames = after["frames"] - before["frames"]
    return {
        "draws_per_s": (after["pictures"] - before["pictures"]) / took_s,
        "web_fps": frames / took_s,
        "web_frames": frames,
        "web_lost": after["lost"],
        "web_cpu_percent": 100 * (cpu_s(page.browser.process_id) - busy_s) / took_s,
    }


def slope_kB_per_minute(looked):
    """Of (seconds, kB) after the page has settled."""
    late = np.array([each for each in looked if each[0] >= SETTLES_s])
    return float(np.polyfit(late[:, 0] / 60, late[:, 1], 1)[0])


def measure(build, steps):
    page_folder = build / "host_tools/web/page"
    if not (page_folder / "index.html").exists():
        raise InputError(f"{page_folder}: the page is not built; sh cmake/bootstrap.sh report builds it")
    tools = types.SimpleNamespace(build=build, node="node", image=None)
    bundle_kB, simulated_kB = compressed_kB(page_folder)
    ready_s = []
    try:
        for _ in range(LOADS):
            with tempfile.TemporaryDirectory(prefix="fingertip-") as folder, Bench(tools) as bench:
                url = bench.served(folder)
                with Browser(folder) as browser:
                    ready_s.append(driven.ready_s(browser.page(url + "/")))
        steps.say(f"{LOADS} pages opened")
        with tempfile.TemporaryDirectory(prefix="fingertip-") as folder, Bench(tools) as bench:
            url = bench.served(folder)
            with Browser(folder, build / "tests/web/libweb_test_ports.so", {"SerialAllowAllPortsForUrls": [url]}) as browser:
                bench.fake(browser, "AAAA", f"rate={RATE_Hz}", f"life={WATCHED_s + REMEMBERED_s + 120}")
                page = browser.page(url + "/")
                driven.connected(page, 1)
                found = watched(page, WATCHED_s)
                steps.say(f"{WATCHED_s} s watched at {found['web_fps']:.0f} frames a second")
                looked = []
                for _ in range(0, REMEMBERED_s + 1, LOOK_s):
                    looked.append((len(looked) * LOOK_s, held_kB(page)))
                    browser.pump(LOOK_s)
                steps.say(f"memory watched for {REMEMBERED_s} s")
                foreign = page.foreign()
    except CannotRun as why:
        raise InputError(f"no browser here: {why}") from None
    outcome = driven.run_all(build, image_of(build.parent, PARALLEL))
    steps.say(f"{outcome['web_steps_driven']} steps driven")
    return {
        "page_ready_s": statistics.median(ready_s),
        "page_ready_worst_s": max(ready_s),
        "bundle_kB": bundle_kB,
        "bundle_simulated_kB": simulated_kB,
        **found,
        "web_seconds": WATCHED_s,
        "web_memory_seconds": REMEMBERED_s,
        "web_memory_kB": looked[-1][1],
        "web_memory_kB_per_minute": slope_kB_per_minute(looked),
        "web_foreign_requests": len(foreign),
        **outcome,
    }


def text(found):
    return [
        "## In a browser",
        "",
        f"Chromium, headless, without a graphics processor. A page was ready {found['page_ready_s']:.2f} s after its address was given "
        f"({found['page_ready_worst_s']:.2f} s at worst, {LOADS} times, each in a new browser). It weighs {found['bundle_kB']:.0f} kB compressed, its simulated "
        f"fingertip {found['bundle_simulated_kB']:.0f} kB more, fetched when it is asked for. While a program that says what a fingertip says sent "
        f"{found['web_fps']:.0f} frames a second for {found['web_seconds']} s, it drew {found['draws_per_s']:.0f} pictures a second, lost "
        f"{found['web_lost']} packets and took {found['web_cpu_percent']:.0f} % of a core, the browser's processes together. Then memory was looked at for "
        f"{found['web_memory_seconds']} s after collections: {found['web_memory_kB'] / 1000:.0f} MB at the end, {found['web_memory_kB_per_minute']:.0f} kB a minute "
        f"once it had settled. Requests to elsewhere: {found['web_foreign_requests']}.",
        "",
        "Driven against emulated release images, and, where the device must misbehave or come and go, against a program that answers "
        "as one (tests/web/test_page.py says which):",
        "",
        *table_md(("step", "outcome"), [(each["step"], STEP_OUTCOMES[each["outcome"]]) for each in found["web_steps"]]),
        "",
    ]
