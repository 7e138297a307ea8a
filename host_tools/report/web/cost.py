"""What the page's WebAssembly weighs, and what the simulated fingertip costs at its highest rate, in node."""

import gzip
import json
import pathlib
import tempfile

from reporting import run

ROOT = pathlib.Path(__file__).resolve().parents[3]
COST = ROOT / "host_tools/web/wasm/cost.mjs"
FILES = ("core.wasm", "simulated.wasm", "objects.bin", "judges.wasm")
SECONDS = 60
GOALS = (("simulated_frames_per_s", ">=", 1300),)


def measure(build, steps):
    web = build / "host_tools/web/wasm"
    found = {f"{name.replace('.', '_')}_kB": len(gzip.compress((web / name).read_bytes(), 9)) / 1000 for name in FILES}
    with tempfile.TemporaryDirectory() as folder:
        commands = pathlib.Path(folder) / "commands"
        words = (("osr", "256"), ("rate", "max"), ("stream", "contact"))
        commands.write_bytes(b"".join(bytes.fromhex(run(build / "tests/support/command_frame", *command)) for command in words))
        told = json.loads(run("node", COST, web / "simulated.wasm", web / "objects.bin", commands, SECONDS))
    steps.say(f"simulated fingertip: {told['cpu_percent']:.1f} % of a core at {told['frames_per_s']:.0f} frames/s")
    return {**found, **{f"simulated_{name}": value for name, value in told.items()}}


def text(found):
    return [
        "## What it costs",
        "",
        f"Compressed: the library, without which the page does not start, {found['core_wasm_kB']:.0f} kB; the simulated fingertip {found['simulated_wasm_kB']:.0f} kB and its objects {found['objects_bin_kB']:.0f} kB, "
        f"the judges of calibration and doctor {found['judges_wasm_kB']:.0f} kB, each fetched when it is used. In node the simulated fingertip "
        f"takes {found['simulated_cpu_percent']:.1f} % of a core at {found['simulated_frames_per_s']:.0f} frames a second while an object is dragged "
        f"over its pad, {found['simulated_memory_MB']:.1f} MB, and starts in {found['simulated_start_ms']:.0f} ms.",
        "",
    ]
