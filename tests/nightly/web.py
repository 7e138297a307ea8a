"""The page: its size and speed in a headless Chromium that renders in software, and its simulated fingertip beside the native firmware."""

# real time: a browser
import contextlib
import gzip
import pathlib
import statistics
import types

import driven
import numpy as np
import wasm_parity
from browser import Browser, CannotRun
from fingertips import Bench
from nightly import Programs, busy_s, job, run

from fingertip.files import InputError

LOADS, RATE_Hz, WATCHED_s = 5, 1310, 60
REMEMBERED_s, SETTLES_s, SAMPLE_s = 600, 180, 20  # of memory; what the page keeps is full after SETTLES_s
KINDS = "grid taps hold high pokes cycle slip twist rolloff placements lift drag slide screw two".split()
# Options of the player and of the scenario, and whether the pad's profile is set.
WAYS = (((), (), True), (("--osr", "256", "--raw"), ("--effects", "all"), False))


def cpu_s(pid):
    """Of a process and its descendants."""
    children = {}
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has just ended
            children.setdefault(int(path.read_text(encoding="utf-8").rsplit(")", 1)[1].split()[1]), []).append(int(path.parent.name))
    tree, total_s = [pid], 0.0
    for parent in tree:
        tree += children.get(parent, [])
        with contextlib.suppress(OSError):
            total_s += busy_s(parent)
    return total_s


def watched(page, seconds):
    """Pictures, frames and losses in this time."""
    before, busy = page.run(driven.COUNTS), cpu_s(page.browser.process_id)
    page.browser.pump(seconds)
    after = page.run(driven.COUNTS)
    took_s = (after["at_ms"] - before["at_ms"]) / 1000
    return {
        "draws_per_s": (after["pictures"] - before["pictures"]) / took_s,
        "web_fps": (after["frames"] - before["frames"]) / took_s,
        "web_frames": after["frames"] - before["frames"],
        "web_lost": after["lost"],
        "web_cpu_percent": 100 * (cpu_s(page.browser.process_id) - busy) / took_s,
    }


def held_kB(page):
    """Objects and buffers that survive a collection."""
    page.call("HeapProfiler.collectGarbage")
    used = page.call("Runtime.getHeapUsage")
    return (used["usedSize"] + used.get("backingStorageSize", 0)) / 1000


@job(
    "web",
    ("page_ready_s", "<=", 1),
    ("bundle_kB", "<=", 600),
    ("draws_per_s", ">=", 30),
    ("web_fps", ">=", 1308),
    ("web_lost", "<=", 0),
    ("web_memory_kB_per_minute", "<=", 100),
    ("web_foreign_requests", "<=", 0),
)
def browser(build):
    tools, ready_s, memory_kB = types.SimpleNamespace(build=build, node="node", image=None), [], []
    try:
        for _ in range(LOADS):
            with Programs(build) as programs, Bench(tools) as bench:
                url = bench.served(str(programs.folder))
                with Browser(str(programs.folder)) as chromium:
                    ready_s.append(driven.ready_s(chromium.page(url)))
        with Programs(build) as programs, Bench(tools) as bench:
            url = bench.served(str(programs.folder))
            ports, policy = build / "tests/web/libweb_test_ports.so", {"SerialAllowAllPortsForUrls": [url.partition("/?")[0]]}
            with Browser(str(programs.folder), ports, policy) as chromium:
                bench.fake(chromium, "AAAA", f"rate={RATE_Hz}", f"life={WATCHED_s + REMEMBERED_s + 120}")
                page = chromium.page(url)
                driven.connected(page, 1)
                found = watched(page, WATCHED_s)
                for at_s in range(0, REMEMBERED_s + 1, SAMPLE_s):
                    memory_kB.append((at_s, held_kB(page)))
                    chromium.pump(SAMPLE_s)
                foreign = page.foreign()
    except CannotRun as why:
        raise InputError(f"no browser here: {why}") from None
    late = np.array([sample for sample in memory_kB if sample[0] >= SETTLES_s])
    folder = build / "host_tools/web/page"
    sizes = {str(path.relative_to(folder)): len(gzip.compress(path.read_bytes(), 9)) / 1000 for path in folder.rglob("*") if path.is_file()}
    simulated_kB = sizes["wasm/simulated.wasm"] + sizes["wasm/objects.bin"]
    return found | {
        "page_ready_s": statistics.median(ready_s),
        "page_ready_worst_s": max(ready_s),
        "bundle_kB": sum(sizes.values()) - simulated_kB,
        "bundle_simulated_kB": simulated_kB,
        "web_seconds": WATCHED_s,
        "web_memory_seconds": REMEMBERED_s,
        "web_memory_kB": memory_kB[-1][1],
        "web_memory_kB_per_minute": float(np.polyfit(late[:, 0] / 60, late[:, 1], 1)[0]),
        "web_foreign_requests": len(foreign),
    }


@job("web", ("wasm_packets", ">=", 100000), ("wasm_scenes", ">=", len(KINDS)), ("wasm_different", "<=", 0))
def parity(build):
    packets = different = scenes = 0
    seconds = busy = 0.0
    with Programs(build) as programs:
        scenario = programs.folder / "scene.csv"
        for kind in KINDS:
            for options, effects, pad in WAYS:
                twin = build / "host_tools/simulation/twin/twin"
                run(twin, "scenario", kind, "--cache", build / "contact_tables", "-o", scenario, "--overwrite", *effects)
                made, wrong, times = wasm_parity.play(build, scenario, programs.folder, *options, pad=pad)
                packets, different, scenes = packets + made, different + wrong, scenes + 1
                seconds, busy = seconds + times["seconds"], busy + times["cpu_s"]
    return {
        "wasm_packets": packets,
        "wasm_different": different,
        "wasm_scenes": scenes,
        "wasm_seconds": seconds,
        "wasm_cpu_percent": 100 * busy / seconds,
    }
