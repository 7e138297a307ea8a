"""The firmware, its protocol and the tools under damaged input, faults, power cuts and analysis."""

import functools
import importlib
import json
import os
import re
import subprocess
import sys

from boards import BOARDS, PARALLEL, image_of
from nightly import ROOT, figures_of, job, run
from reporting import Steps

from fingertip.files import InputError

TESTS = ROOT / "tests"
EMULATED = TESTS / "emulated"
FUZZ_s, SEED = 300, 1
KILLS, KILLING_h, CHIPS = 1000, 0.2, 4
SENSOR = "ms5837_30ba"
UNDEFINED_SEEDS, UNDEFINED_INPUTS = 20, 400000
CUTS, STEP_us = ("write", "erase", "mend", "start", "reset"), 100


def tools_of(build):
    return build / "host_tools/tool/cli/fingertip", build / "tests/support/command_frame"


def in_parallel(jobs):
    return Steps().run_all({key: (str(key), work) for key, work in jobs.items()}, os.cpu_count() or 1)


@job("reliability", ("same_bits_presses", ">=", 10000), ("same_bits_different", "<=", 0), ("same_bits_failed", "<=", 0))
def same_bits(build):
    """Fits and grasps on a Cortex-M0+ (the RP2040's, emulated; QEMU's), a Cortex-M4F (QEMU) and this host, with every press."""
    host, board = build / "tests/emulated/fit_bits/fit_bits", build.parent / BOARDS[0] / "fit_bits"
    images = ("--host", host, "--m4f", f"{host}_m4f.elf", "--m0", f"{board}_m0.elf", "--rp2040", f"{board}_rp2040.bin")
    test = EMULATED / "fit_bits/test_fit_bits.py"
    words = ["/usr/bin/python3", test, *images, "--qemu", "qemu-system-arm", "--node", "node", "SameBits"]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=False)
    compared = [int(count) for count in re.findall(r"same bits: (\d+) presses", done.stdout)]
    if not compared:
        raise InputError(f"{test.name} compared nothing: {done.stderr.strip()[-500:]}")
    return {
        "same_bits_presses": max(compared),
        "same_bits_compared": sum(compared),
        "same_bits_different": sum(int(count) for count in re.findall(r"(\d+) of \d+ differ", done.stderr)),
        "same_bits_failed": done.returncode,
    }


@job(
    "reliability",
    ("core1_killed", ">=", KILLS),
    ("core1_hangs", "<=", 0),
    ("core1_frames_lost", "<=", 0),
    ("core1_unflagged", "<=", 0),
    ("core1_absent_reported", ">=", 1),
    ("core1_soak_hours", ">=", KILLING_h),
    ("core1_soak_lost", "<=", 0),
    ("core1_soak_hangs", "<=", 0),
)
def second_core(build):
    """Scene grasp on the emulated chip: core 1 killed at instants spread over a frame, and now and then for KILLING_h."""

    def one(*what):
        folder = image_of(build.parent, PARALLEL).parent
        return json.loads(run("node", EMULATED / "harness/kill_figures.mjs", folder, *tools_of(build), *what))

    jobs = {"kills": functools.partial(one, "kills", KILLS), "absent": functools.partial(one, "absent")}
    jobs |= {seed: functools.partial(one, "soak", KILLING_h / CHIPS, seed) for seed in range(1, CHIPS + 1)}
    found = in_parallel(jobs)
    killed = found.pop("kills") | found.pop("absent")
    total = {name: sum(chip[name] for chip in found.values()) for name in found[1]}
    return killed | {
        "core1_soak_chips": CHIPS,
        "core1_soak_hours": round(total["hours"], 6),
        "core1_soak_kills": total["kills"],
        "core1_soak_frames": total["frames"],
        "core1_soak_lost": total["lost"],
        "core1_soak_hangs": total["reboots"] + total["long_without_load"],
    }


@job(
    "reliability",
    ("ehci_detaches", "<=", 0),
    ("se0_bites", "<=", 0),
    ("code_writes_trapped", ">=", 1),
    ("torn_after_resume", "<=", 0),
    ("erase_reset_recovered", ">=", 1),
    ("withdrawals_wrong", "<=", 0),
    ("stored_lost_after_stall", "<=", 0),
    ("prom_collisions_undoubted", "<=", 0),
    ("prom_collisions_innocent", "<=", 0),
    ("ms5837_wrong", "<=", 0),
)
def silicon(build):
    """What silicon at its corners and rare hosts do to the images of both boards."""
    run("ctest", "--test-dir", build, "-R", f"^checks.sensor_{SENSOR}_(configures|builds)$")
    return json.loads(run("node", EMULATED / "harness/figures.mjs", build.parent, *tools_of(build), build / "sensors" / SENSOR))


@job("reliability", ("sync_error_us_max", "<=", 1), ("sync_alignment_us", "<=", 2))
def shared_clock(build):
    """Edges at the sync pins of both boards, and two fingertips on one wire."""
    stamps = figures_of("node", EMULATED / "test_sync.mjs", build.parent, *tools_of(build))
    wire = ("--image", image_of(build.parent, "pico_mux"), "--support", build / "tests/support", "--node", "node", "--report")
    return stamps | figures_of("/usr/bin/python3", EMULATED / "test_sync_wire.py", *wire)


@job("reliability", ("ubsan_calls", ">=", 1e8), ("ubsan_findings", "<=", 0))
def undefined(build):
    """Inputs of any bits for all public functions of fit, contact and condition, under the sanitizers."""

    def one(seed):
        call = ["env", f"RANDOM_BITS={UNDEFINED_INPUTS} {seed}", build / "tests/unit/fit/test_fit_random_bits"]
        done = subprocess.run(call, capture_output=True, text=True, check=False)
        return sum(map(int, re.findall(r"(\d+) calls", done.stdout))), [(done.stdout + done.stderr)[-800:]] * (done.returncode != 0)

    calls, what = zip(*in_parallel({seed: functools.partial(one, seed) for seed in range(UNDEFINED_SEEDS)}).values(), strict=True)
    return {"ubsan_calls": sum(calls), "ubsan_findings": len(sum(what, [])), "ubsan_what": sum(what, [])}


@job(
    "reliability",
    ("dip_cases", ">=", 2880),
    ("wrong_unflagged_frames", "<=", 0),
    ("false_slips", "<=", 0),
    ("other_dips_wrong_frames", "<=", 0),
    ("raw_valid_wrong", "<=", 0),
    ("never_trusted", "<=", 0),
    ("reset_ms_max", "<=", 30),
    ("wrong_range_trusted", "<=", 0),
)
def dips(build):
    """Supplies of 1 to 15 sensors that dip amid a press: 16 phases of a frame, six shares of the true codes, both boards."""
    *all_rows, other_range = map(json.loads, re.findall(r"(?m)^{.*}$", run("env", "DIPS=1 1", build / "tests/unit/app/test_app_dips")))
    rows, others = ([row for row in all_rows if (row["kind"] == "step") == is_step] for is_step in (True, False))
    total = {name: sum(row[name] for row in rows) for name in ("wrong_unflagged_frames", "false_slips", "raw_valid_wrong", "never_trusted")}
    cases, reset_ms = (how(row[name] for row in rows) for how, name in ((sum, "cases"), (max, "reset_ms_max")))
    wrong = sum(row["wrong_unflagged_frames"] + row["false_slips"] for row in others)
    return {"dip_cases": cases, **total, "other_dips_wrong_frames": wrong, "reset_ms_max": reset_ms, **other_range, "dips": all_rows}


@job("reliability", ("fuzz_bytes", ">=", 1e9), ("crashes", "<=", 0), ("sanitizer_findings", "<=", 0))
def fuzzing(build):
    program = ("/usr/bin/python3", TESTS / "fuzz/fuzz.py", "--build", build.parent / "fuzz", "--seconds", FUZZ_s, "--seed", SEED)
    return {"fuzz_seconds": FUZZ_s, "fuzz_seed": SEED, **figures_of(*program, "--json")}


@job(
    "reliability",
    ("power_cuts", ">=", 1000),
    ("power_cuts_not_started", "<=", 0),
    ("power_cuts_wrong_values", "<=", 0),
    ("flash_lost", "<=", 0),
)
def power_cuts(build):
    """The release images, their power cut every STEP_us of each kind of flash write and of each kind of start."""

    def one(board, kind):
        return json.loads(run("node", EMULATED / "test_power_cuts.mjs", build.parent, *tools_of(build), board, kind, STEP_us))

    found = in_parallel({(board, kind): functools.partial(one, board, kind) for board in BOARDS for kind in CUTS})
    rows = [{"board": board, "cut": kind, **row} for (board, kind), row in found.items()]
    findings = [line for row in rows for line in row.pop("what")]
    cuts, not_started, wrong = (sum(row[name] for row in rows) for name in ("cuts", "not_started", "wrong_values"))
    return {
        **{"flash_lost": wrong, "power_cuts": cuts, "power_cuts_not_started": not_started, "power_cuts_wrong_values": wrong},
        **{"power_cut_step_us": STEP_us, "power_cut_kinds": rows, "power_cut_findings": findings},
    }


@job("reliability", ("flash_frames_skipped", "<=", 0))
def storing(build):
    """Frames while the emulated chip stores."""
    sys.path.insert(0, str(EMULATED))
    return importlib.import_module("storing").storing(build, build.parent)


@job("reliability", ("analyzer_findings", "<=", 0))
def analysis(build):
    """clang-tidy, clang's analyser of paths, cppcheck, gcc's -fanalyzer and the mandatory rules of MISRA C:2012 over firmware/ and boards/."""
    return figures_of("/usr/bin/python3", TESTS / "checks/analyse.py", "--build", build.parent, "--all", "--json")
