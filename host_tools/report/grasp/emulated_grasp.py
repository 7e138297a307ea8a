"""One grasp whose fingertips are two emulated boards with the release image: what happened when, in emulated time."""

import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
from boards import PARALLEL as BOARD, image_of  # noqa: E402
from fingertip.files import InputError  # noqa: E402
from reporting import run  # noqa: E402
from presentation import table_md, text_of  # noqa: E402

CLOCKS_ppm = "25,-25"
# Of the slip: what is called how.
COURSE = {
    "measured_ms": "the first frame that reported it was measured",
    "sent_ms": "its packet had left the chip",
    "answered_ms": "the controller's command changed",
    "asked_ms": "it went out on the gripper's line",
    "moved_ms": "the fingers moved",
    "reaction_ms": "the grip was 5 % stronger",
}


def program(build):
    path = pathlib.Path(build) / "host_tools/simulation/cell/fingertip_cell_emulated"
    if not path.is_file():
        raise InputError(f"{path} is not there; build it: cmake --build --preset host")
    return path


def grasp(node, image, world, tables, *options):
    """What host_tools/simulation/cell/emulated_grasp.cpp reports, and of the boards."""
    return json.loads(
        run(
            node,
            ROOT / "host_tools/simulation/emulator/lockstep.mjs",
            "--image",
            image,
            "--board",
            BOARD,
            "--clock-ppm",
            CLOCKS_ppm,
            "--seconds",
            "5",
            "--",
            world,
            "--cache",
            tables,
            *options,
        )
    )


def measure(build, boards, tables):
    found = grasp("node", image_of(boards, BOARD), program(build), tables)
    slip = found["slip"] or {}
    return {
        "emulated_reaction_ms": slip.get("reaction_ms"),
        "emulated_sent_ms": slip.get("sent_ms"),
        "emulated_slid_mm": found["slid_mm"],
        "emulated_dropped": found["dropped"],
        "emulated_grasp": found,
    }


def text(found):
    """Lines of Markdown."""
    slip = found["slip"]
    lines = [
        "Both fingertips are emulated boards with the release image, pad and calibration stored; cell, gripper and controller go on in lock step with them,",
        f"in slices of {found['slice_us'] / 1e3:g} ms of emulated time. Lifted: {found['mass_kg']:g} kg, {found['face']}, friction {found['friction']:g}, {found['gripper']}; "
        f"then friction falls by {100 * found['friction_falls']:.0f} % within 30 ms.",
        f"It slid {text_of(found['slid_mm'], 3)} mm and was {'dropped' if found['dropped'] else 'held'}.",
        "",
    ]
    if slip:
        lines += table_md(["since all of both contacts slid", "ms"], [[what, text_of(slip[name], 4)] for name, what in COURSE.items()]) + [
            ""
        ]
    return lines
