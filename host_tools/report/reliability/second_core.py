"""The RP2040's second core, killed at many instants of a frame, in the emulator: tests/emulated/harness/kill_figures.mjs."""

import json
import os
import pathlib

from boards import PARALLEL, image_of
from reporting import run

ROOT = pathlib.Path(__file__).resolve().parents[3]
KILLS, SOAK_h, SOAK_CHIPS = 1000, 1, 12
GOALS = (
    ("core1_killed", ">=", KILLS),
    ("core1_hangs", "<=", 0),
    ("core1_frames_lost", "<=", 0),
    ("core1_unflagged", "<=", 0),
    ("core1_soak_hours", ">=", SOAK_h),
    ("core1_soak_lost", "<=", 0),
    ("core1_soak_hangs", "<=", 0),
)


def measure(build, steps):
    """A failure does not end it: it is a figure, and reported."""

    def one(*what):
        return json.loads(
            run(
                "node",
                ROOT / "tests/emulated/harness/kill_figures.mjs",
                image_of(build.parent, PARALLEL).parent,
                build / "host_tools/tool/cli/fingertip",
                build / "tests/support/command_frame",
                *what,
            )
        )

    jobs = {"kills": (f"second core killed at {KILLS} instants", lambda: one("kills", KILLS))}
    for seed in range(1, SOAK_CHIPS + 1):
        jobs[seed] = (
            f"second core killed now and then for {60 * SOAK_h / SOAK_CHIPS:g} min, chip {seed} of {SOAK_CHIPS}",
            lambda seed=seed: one("soak", SOAK_h / SOAK_CHIPS, seed),
        )
    found = steps.run_all(jobs, os.cpu_count() or 1)
    killed = found.pop("kills")
    total = {
        name: sum(chip[name] for chip in found.values()) for name in ("hours", "kills", "frames", "lost", "reboots", "long_without_load")
    }
    return killed | {
        "core1_soak_chips": SOAK_CHIPS,
        "core1_soak_hours": round(total["hours"], 6),
        "core1_soak_kills": total["kills"],
        "core1_soak_frames": total["frames"],
        "core1_soak_lost": total["lost"],
        "core1_soak_hangs": total["reboots"] + total["long_without_load"],
    }


def text(found):
    return [
        "## The second core",
        "",
        f"Scene grasp on {PARALLEL} at OSR 256, pressed and with a profile. Its second core was killed at {found['core1_killed']} instants that are spread over a frame:",
        "",
        f"- {found['core1_hangs']} hangs: kills after which the load was not estimated again within 20 ms, or the chip was reset.",
        f"- {found['core1_frames_lost']} frames lost.",
        f"- {found['core1_unflagged']} kills that no frame told (TANGENTIAL_LATE), or that a frame told while it had a load. At most {found['core1_late_frames_max']} "
        f"frames in a row said so, and {found['core1_frames_without_load_max']} had no load.",
        f"- In {found['core1_soak_hours']} h of {found['core1_soak_chips']} chips in which it was killed {found['core1_soak_kills']} times, now and then, {found['core1_soak_lost']} of {found['core1_soak_frames']} frames were "
        f"lost, and {found['core1_soak_hangs']} times the load stayed away or the chip was reset.",
        "",
    ]
