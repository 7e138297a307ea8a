"""What silicon at its corners and hosts that are seldom met do to the release images, in the emulator: tests/emulated/harness/storms.mjs."""

import json
import pathlib

from reporting import run

ROOT = pathlib.Path(__file__).resolve().parents[3]
SENSOR = "ms5837_30ba"
GOALS = (
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


def measure(build, steps):
    """A failure does not end it: it is a figure, and reported."""
    run("ctest", "--test-dir", build, "-R", f"^checks.sensor_{SENSOR}_(configures|builds)$")
    steps.say(f"image for sensor {SENSOR}")
    found = json.loads(
        run(
            "node",
            ROOT / "tests/emulated/harness/figures.mjs",
            build.parent,
            build / "host_tools/tool/cli/fingertip",
            build / "tests/support/command_frame",
            build / "sensors" / SENSOR,
        )
    )
    steps.say("silicon and odd hosts")
    return found


def text(found):
    return [
        "## Silicon and odd hosts",
        "",
        "Both boards, on chips of revisions B1 and B2 where that matters:",
        "",
        f"- A host whose EHCI controller resets the device before its companion does, at the first connection, after its own restart and plugged in again: the "
        f"device detached itself {found['ehci_detaches']} times.",
        f"- Resets of the bus that last 0.92 and 3 s: {found['se0_bites']} resets by the watchdog, or detached.",
        f"- {found['code_writes_tried']} writes to vectors, code and constants: {'all' if found['code_writes_trapped'] else 'not all'} ended in a crash record and changed nothing.",
        f"- {found['resumes']} suspends between two packets of a frame: {found['torn_after_resume']} first answers after the resume were lost.",
        f"- {found['erase_resets']} resets by the firmware and its watchdog amid an erase of 400 ms, with the ring oscillator at 6.5 and 12 MHz: "
        f"{'all' if found['erase_reset_recovered'] else 'not all'} started again. A reset by the RUN pin may not, see host_tools/README.md.",
        f"- Requests that the host gave up, and ports closed amid the stream: {found['withdrawals_wrong']} wrong answers.",
        f"- A flash interface that hangs for 0.4 ms amid a command: {found['stored_lost_after_stall']} later settings were not stored.",
        f"- {found['prom_collisions_planted']} PROMs that are wrong with the right CRC-4, three at a time, of which {found['prom_collisions_wrong']} make a pressure at rest that is "
        f"off by more than 1.2 kPa or a temperature by more than 0.7 degC: {found['prom_collisions_undoubted']} were used without a doubt, and "
        f"{found['prom_collisions_innocent']} other sensors were doubted.",
        f"- The worked example of the MS5837-30BA's data sheet on an image for that sensor: {found['ms5837_wrong']} of {found['ms5837_figures']} figures were wrong.",
        "",
    ]
