"""Whether the page's simulated fingertip is the firmware: its bytes, from WebAssembly in node, beside those of the native player in the same scene."""

import itertools
import json
import pathlib

from called import run

PLAY = pathlib.Path(__file__).resolve().parents[2] / "host_tools/web/wasm/play.mjs"


def compared(line, other):
    """(packets of the first, those that differ or that one lacks) of two captures of a line."""
    frames, others = ([frame for frame in capture.split(b"\0") if frame] for capture in (line, other))
    return len(frames), sum(frame != other for frame, other in itertools.zip_longest(frames, others))


def play(build, scenario, folder, *options, pad=False):
    """Both: packets, differences, and {"seconds", "cpu_s"} of WebAssembly."""
    native, wasm, commands = folder / "native.ftr", folder / "wasm.ftr", folder / "commands"
    player, web = build / "host_tools/simulation/player/fingertip_player", build / "host_tools/web/wasm"
    output = ("-o", folder / "native.csv", "--raw-bytes", native, "--commands", commands, "--overwrite", "--quiet")
    run(player, "play", scenario, *output, *options, *(("--pad", "12") if pad else ()))
    times = run("node", PLAY, web / "simulated.wasm", scenario, commands, wasm, *((web / "objects.bin",) if pad else ()))
    return (*compared(native.read_bytes(), wasm.read_bytes()), json.loads(times))
