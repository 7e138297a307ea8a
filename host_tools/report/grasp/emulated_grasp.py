"""One grasp whose fingertips are two emulated boards with the release image: what happened when, in emulated time."""

import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
from boards import PARALLEL as BOARD, image_of  # noqa: E402
from reporting import built, run  # noqa: E402

CLOCKS_ppm = "25,-25"
# Of the slip: what is called how.
COURSE = {
    "measured_ms": "the first frame that reported SLIDING was measured",
    "sent_ms": "its packet had left the chip",
    "reaction_ms": "the grip was 5 % stronger",
}


def program(build):
    return built(build, "host_tools/simulation/cell/fingertip_cell_emulated")


def grasp(node, image, world, tables, *options):
    """What host_tools/simulation/cell/emulated_grasp.cpp reports, and of the boards."""
    chip = ("--image", image, "--board", BOARD, "--clock-ppm", CLOCKS_ppm, "--seconds", "5")
    lockstep = ROOT / "host_tools/simulation/emulator/lockstep.mjs"
    return json.loads(run(node, lockstep, *chip, "--", world, "--cache", tables, *options))


def measure(build, boards, tables):
    found = grasp("node", image_of(boards, BOARD), program(build), tables)
    slip = found["slip"] or {}
    return {
        "emulated_reaction_ms": slip.get("reaction_ms"),
        "emulated_sent_ms": slip.get("sent_ms"),
        "emulated_slid_mm": found["slid_mm"],
        "emulated_dropped": found["dropped"],
        "emulated_grasp": found,
        "emulated_course": [{"since all of both contacts slid": what, "ms": slip.get(name)} for name, what in COURSE.items()],
    }
