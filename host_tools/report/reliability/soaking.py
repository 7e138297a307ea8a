"""Storms of faults on the firmware, natively and as release images in the emulator, and power cuts: tests/soak."""

import json
import os
import pathlib
import subprocess
import tempfile

from boards import BOARDS, PARALLEL, image_of
from fingertip.files import InputError
from reporting import run
from tables import table_of_dicts_md, text_of

ROOT = pathlib.Path(__file__).resolve().parents[3]
SOAK = ROOT / "tests/soak"
EMULATED_h, NATIVE_h = 1, 24
STEADY_s = {"native": 3600, PARALLEL: 600}
STEP_us = 100
STEADY = (
    "seconds",
    "device_s_per_wall_s",
    "frames",
    "loads",
    "late",
    "missing",
    "skipped",
    "sequence_wraps",
    "hangs",
    "wrong_unflagged",
    "uncounted_losses",
    "disorder",
)
CUTS = ("write", "erase", "mend", "start", "reset")
GOALS = (
    ("soak_hours_emulated", ">=", EMULATED_h),
    ("soak_hours_native", ">=", NATIVE_h),
    ("hangs", "<=", 0),
    ("wrong_unflagged", "<=", 0),
    ("uncounted_losses", "<=", 0),
    ("disorder", "<=", 0),
    ("power_cuts", ">=", 1000),
    ("power_cuts_not_started", "<=", 0),
    ("power_cuts_wrong_values", "<=", 0),
    ("steady_native_s", ">=", STEADY_s["native"]),
    ("steady_findings", "<=", 0),
    ("steady_lost", "<=", 0),
    ("steady_late", "<=", 0),
)


def power_cuts(build, steps):
    program = build / "tests/soak/fingertip_soak"

    def one(board, kind):
        image = image_of(build.parent, board)
        return json.loads(
            run(
                "node",
                SOAK / "power_cuts.mjs",
                "--image",
                image,
                "--board",
                board,
                "--soak",
                program,
                "--command-frame",
                build / "tests/support/command_frame",
                "--step-us",
                STEP_us,
                "--kinds",
                kind,
            )
        )[kind]

    found = steps.run_all(
        {(board, kind): (f"power cuts of {board}: {kind}", lambda b=board, k=kind: one(b, k)) for board in BOARDS for kind in CUTS},
        os.cpu_count() or 1,
    )
    rows = [
        {"board": board, "cut": kind, **{name: value for name, value in one_of.items() if name != "what"}}
        for (board, kind), one_of in found.items()
    ]
    return {
        "power_cuts": sum(row["cuts"] for row in rows),
        "power_cuts_not_started": sum(row["not_started"] for row in rows),
        "power_cuts_wrong_values": sum(row["wrong_values"] for row in rows),
        "power_cut_step_us": STEP_us,
        "power_cut_kinds": rows,
        "power_cut_findings": [what for one_of in found.values() for what in one_of["what"]],
    }


def soaked(build, *options):
    """Findings do not end it: they are figures, and reported."""
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder:
        result = pathlib.Path(folder) / "soak.json"
        done = subprocess.run(
            ["/usr/bin/python3", SOAK / "soak.py", "--build", build, "--boards", build.parent, *options, "--json", result], check=False
        )
        if not result.exists():
            raise InputError(f"the soak did not run (status {done.returncode}), see above")
        return json.loads(result.read_text(encoding="utf-8"))


def steady(build):
    """Hours in which nothing goes wrong, over a wrap of the clock's 32 bits."""
    rows, findings = [], []
    for bench, seconds in STEADY_s.items():
        found = soaked(build, "--kinds", f"steady_{bench}", "--episodes", "1", "--seconds", str(seconds), "--seed", "1")
        row = next(row for row in found["soak"] if row["bench"] == f"steady_{bench}")
        rows.append({"bench": bench, **{name: row[name] for name in STEADY}})
        findings += found["findings"]
    return {
        "steady_native_s": rows[0]["seconds"],
        "steady_emulated_s": rows[1]["seconds"],
        "steady": rows,
        "steady_findings": len(findings),
        "steady_what": findings,
        "steady_lost": sum(row["missing"] + row["skipped"] for row in rows),
        "steady_late": sum(row["late"] for row in rows),
    }


def measure(build, steps):
    found = soaked(build, "--least", str(EMULATED_h), str(NATIVE_h)) | steady(build)
    steps.say(f"{found['soak_hours_emulated']:.2f} h emulated and {found['soak_hours_native']:.2f} h native")
    return {**{("soak_findings" if name == "findings" else name): value for name, value in found.items()}, **power_cuts(build, steps)}


def told(lines):
    return [*(f"- {line}" for line in lines), ""] if lines else []


def text(found):
    return [
        "## Faults",
        "",
        "A host uses a fingertip while one thing after another goes wrong, one at a time or several together: sensors, lines, multiplexers, USB, "
        "power, clocks, commands and rubbish (tests/soak/README.md). What the fingertip says is held against the truth of what it feels: a "
        "frame without a warning that is more than 1.2 mm or 0.1 N and 15 % off is wrong, a packet that is missing must be counted; times, numbers, "
        "packets and answers that are out of order are disorder. "
        f"Native: the firmware's code on simulated sensors, {rate(found, 'native')} times faster than real time. Emulated: the release images, "
        f"{' and '.join(rate(found, board) for board in BOARDS)} seconds in a second of one processor's time on the wall. Episodes of earlier runs of the same images, by the report "
        f"or by `sh cmake/bootstrap.sh soak`, count (build/soak/results.jsonl); {found['soak_episodes_now']} were run now. Excused are wrong frames "
        "and readings after inverted bits of a conversion, which have no check, and readings after a sensor's supply dipped beneath a moving "
        "press.",
        "",
        *table_of_dicts_md(found["soak"]),
        "",
        *told(found["soak_findings"]),
        "From the end of a fault to the first of five good frames in a row, the worst of so many; with the emulator's fast enumeration and a host "
        f"that asks for its streams at once. The worst: {text_of(found['worst_recovery_s'])} s.",
        "",
        *table_of_dicts_md(found["recovery"]),
        "",
        "## A long time in which nothing goes wrong",
        "",
        "The highest rate and a pad's profile. The 32 bits of the clock's microseconds wrap in the middle. Natively the second processor is a thread, "
        "which shares the memory with the main loop, and nothing takes time but bus and conversions.",
        "",
        *table_of_dicts_md(found["steady"]),
        "",
        *told(found["steady_what"]),
        "## Power cuts",
        "",
        f"Every {STEP_us} us, and every 2 ms while what was written is read back, of an update of what is kept into a free slot (write), of one that needs an erase, of a start that mends what a "
        "cut has left (mend), of one that finds all in order (start), and of one of the chip alone (reset). The emulated flash keeps of the bits that were to change some, and some read as they like. Each must start with "
        "all sensors and hold the old settings or the new (brought), also after one more cut.",
        "",
        *table_of_dicts_md(found["power_cut_kinds"]),
        "",
        *told(found["power_cut_findings"]),
    ]


def rate(found, bench):
    return text_of(next(row["device_s_per_wall_s"] for row in found["soak"] if row["bench"] == bench), 2)
