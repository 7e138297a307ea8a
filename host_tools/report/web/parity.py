"""Whether the page's simulated fingertip is the firmware: the bytes of its line, from WebAssembly in node, against those of the
native player in the same scenes."""

import itertools
import json
import pathlib
import tempfile

from reporting import run

ROOT = pathlib.Path(__file__).resolve().parents[3]
PLAY = ROOT / "host_tools/web/wasm/play.mjs"
KINDS = ("grid", "taps", "high", "pokes", "cycle", "slip", "twist", "rolloff", "placements", "lift", "drag", "slide", "screw", "two")
# Of the player, of the scenario; whether the pad tells tangential load.
WAYS = {"": ((), (), True), " with all errors": (("--osr", "256", "--raw"), ("--effects", "all"), False)}
GOALS = (("wasm_packets", ">=", 100000), ("wasm_scenes", ">=", len(KINDS)), ("wasm_different", "<=", 0))


def compared(line, other):
    """(packets of the first, those that differ or that one lacks) of two captures of a line."""
    frames, others = ([frame for frame in capture.split(b"\0") if frame] for capture in (line, other))
    return len(frames), sum(frame != other for frame, other in itertools.zip_longest(frames, others))


def play(build, scenario, folder, *options, pad=False):
    """Both: packets, differences, and {"seconds", "cpu_s", "bytes"} of WebAssembly."""
    native, wasm, commands = folder / "native.ftr", folder / "wasm.ftr", folder / "commands"
    web = build / "host_tools/web/wasm"
    run(
        build / "host_tools/simulation/player/fingertip_player",
        "play",
        scenario,
        "-o",
        folder / "native.csv",
        "--raw-bytes",
        native,
        "--commands",
        commands,
        "--overwrite",
        "--quiet",
        *options,
        *(("--pad", "12") if pad else ()),
    )
    told = run("node", PLAY, web / "simulated.wasm", scenario, commands, wasm, *((web / "objects.bin",) if pad else ()))
    return (*compared(native.read_bytes(), wasm.read_bytes()), json.loads(told))


def measure(build, steps):
    packets = different = scenes = 0
    seconds = cpu_s = 0.0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for kind in KINDS:
            for way, (options, effects, pad) in WAYS.items():
                scenario = folder / "scene.csv"
                run(
                    build / "host_tools/simulation/twin/twin",
                    "scenario",
                    kind,
                    "--cache",
                    build / "contact_tables",
                    "-o",
                    scenario,
                    "--overwrite",
                    *effects,
                )
                made, wrong, told = play(build, scenario, folder, *options, pad=pad)
                steps.say(f"{kind}{way}: {made} packets, {wrong} differ")
                packets, different, scenes = packets + made, different + wrong, scenes + 1
                seconds, cpu_s = seconds + told["seconds"], cpu_s + told["cpu_s"]
    return {
        "wasm_packets": packets,
        "wasm_different": different,
        "wasm_scenes": scenes,
        "wasm_seconds": seconds,
        "wasm_cpu_percent": 100.0 * cpu_s / seconds,
    }


def text(found):
    return [
        "## The simulated fingertip",
        "",
        f"{found['wasm_packets']} packets of the firmware as WebAssembly and of the native player, in "
        f"{found['wasm_scenes']} simulated scenes of all kinds ({found['wasm_seconds']:.0f} s): {found['wasm_different']} differ.",
        "",
    ]
