"""PAD.svg, PAD.scad and the table of measures: the base plate around the sensors, the skin's mould, and the frame that clamps the skin.

All follows from the pad and the choices below. None of it was made yet.
"""

import dataclasses
import json

from geometry import PACKAGE_mm
from sheet import across, circle, cross, down, path, rectangle, ruler, sheet, text

FLANGE_mm = 5.0  # of the skin, all around, under the frame
FLANGE_HIGH_mm = 3.0
SQUEEZED = 0.1  # share of its height that the frame takes from the flange
HOLE_PLAY_mm = 0.2  # around a sensor
FRAME_PLAY_mm = 0.3  # around the skin, each side
RIM_mm = 6.0  # of frame and base plate around the flange, for the screws
SCREW_mm = 3.2  # hole of an M3
BOARD_mm = 1.6  # thickness of a circuit board
LID_mm = 3.0  # of the frame above the flange
WALL_mm = 5.0  # of the mould
DRAWN_APART_mm = 12.0


@dataclasses.dataclass
class Measures:
    skin: tuple  # width, length of the rubber that is touched
    flange: tuple  # with the flange
    outside: tuple  # of base plate and frame
    opening: tuple  # of the frame
    screws: list  # places of the holes
    hole_mm: float
    ring_mm: float  # height of the frame's ring around the flange
    volume_ml: float


def measures(pad):
    reach = [max(abs(place[axis]) for place in pad.places) for axis in (0, 1)]
    skin = tuple(2 * (mm + pad.overhang_mm) for mm in reach)
    flange = tuple(mm + 2 * FLANGE_mm for mm in skin)
    outside = tuple(mm + 2 * RIM_mm for mm in flange)
    x, y = ((mm + RIM_mm) / 2 for mm in flange)
    volume_mm3 = skin[0] * skin[1] * (pad.thickness_mm - FLANGE_HIGH_mm) + flange[0] * flange[1] * FLANGE_HIGH_mm
    return Measures(
        skin,
        flange,
        pad.strip_mm or outside,
        tuple(mm + 2 * FRAME_PLAY_mm for mm in skin),
        [] if pad.strip_mm else [(sx * x, sy * y) for sx in (-1, 1) for sy in (-1, 0, 1)],
        PACKAGE_mm + HOLE_PLAY_mm,
        FLANGE_HIGH_mm * (1 - SQUEEZED),
        volume_mm3 / 1000,
    )


def table(pad):
    """Markdown."""
    m = measures(pad)
    size = lambda each, more=0: f"{each[0] + more:g} x {each[1] + more:g} mm"
    x, y = m.screws[-1]
    hollow = f"face down, in a block of {size(m.flange, 2 * WALL_mm)}, {pad.thickness_mm + WALL_mm:g} mm high, open above"
    rows = [
        ("base plate", f"{size(m.outside)}, {pad.high_mm:g} mm thick; a square hole of {m.hole_mm:g} mm for each sensor"),
        ("rubber that is touched", f"{size(m.skin)}, {pad.thickness_mm:g} mm thick: {pad.overhang_mm:g} mm beyond the outer sensors"),
        ("its flange", f"{size(m.flange)}, {FLANGE_HIGH_mm:g} mm thick, at the sensors"),
        ("mould of the skin", f"the same hollow, {hollow}"),
        ("rubber in it", f"{m.volume_ml:.0f} ml"),
        (
            "frame",
            f"{size(m.outside)}; a ring {m.ring_mm:g} mm high around the flange, a lid of {LID_mm:g} mm that leaves {size(m.opening)} open",
        ),
        ("screws", f"{len(m.screws)} M3, {2 * x:g} mm apart across and {y:g} mm along; holes of {SCREW_mm:g} mm"),
        ("walls to cast on", f"{size(m.outside)}, {pad.thickness_mm:g} mm high, inside {size(m.skin)}; on the base plate"),
    ]
    return "\n".join(["| part | measures |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows)]) + "\n"


def scad(pad):
    values = dataclasses.asdict(measures(pad)) | {"sensors": pad.places, "screw_mm": SCREW_mm, "plate_mm": pad.high_mm, "lid_mm": LID_mm}
    values |= {"play_mm": FRAME_PLAY_mm, "wall_mm": WALL_mm, "rubber_mm": pad.thickness_mm, "flange_mm": FLANGE_HIGH_mm}
    lines = (f"{name} = {json.dumps(value)};\n" for name, value in values.items())
    return "".join(["// Written by boards/drawing/draw.py.\n", *lines, "include <../mould.scad>\n"])


def part(x, y, words, outside, *inner, screws=()):
    """Seen from above or below: its outline, and others about the same middle."""
    lines = [rectangle(x, y, *size) for size in (outside, *inner)]
    lines.append(text(x - outside[0] / 2, y - outside[1] / 2 - 5, words))
    return lines + [circle(x + sx, y + sy, SCREW_mm) for sx, sy in screws]


def inside(x, y, size):
    """The measures of an opening."""
    left, top = x - size[0] / 2 + 4, y - size[1] / 2 + 4
    return across(left - 4, top, size[0], f"{size[0]:g}") + down(left, top - 4, size[1], f"{size[1]:g}")


def plate(x, y, m, sensors):
    lines = part(x, y, "base plate", m.outside, screws=m.screws)
    for k, (sx, sy) in enumerate(sensors):
        lines += [rectangle(x + sx, y - sy, m.hole_mm, m.hole_mm), cross(x + sx, y - sy, 0.6), text(x + sx + 2.2, y - sy - 2, k)]
    return lines + across(x - m.outside[0] / 2, y - m.outside[1] / 2 - 1.5, m.outside[0], f"{m.outside[0]:g}")


def frame(x, y, m):
    flange = tuple(mm + 2 * FRAME_PLAY_mm for mm in m.flange)
    return part(x, y, "frame, from below", m.outside, m.opening, flange, screws=m.screws) + inside(x, y, m.opening)


def hollow(x, y, m):
    outside = tuple(mm + 2 * WALL_mm for mm in m.flange)
    lines = part(x, y, "mould of the skin, from above", outside, m.flange, m.skin) + inside(x, y, m.skin)
    return lines + across(x - m.flange[0] / 2, y - outside[1] / 2 - 1.5, m.flange[0], f"{m.flange[0]:g}")


def section(x, base_y, m, pad):
    """Across the pad, assembled; base_y: the upper side of the base plate."""
    high, low = pad.thickness_mm, m.ring_mm
    half, flange, outside = m.skin[0] / 2, m.flange[0] / 2, m.outside[0] / 2
    lines = [text(x - outside, base_y - high - 5, "section, assembled: skin, frame, base plate, circuit board")]
    lines.append(rectangle(x, base_y + pad.high_mm / 2, 2 * outside, pad.high_mm))
    lines.append(rectangle(x, base_y + pad.high_mm + BOARD_mm / 2, 2 * outside, BOARD_mm))
    for sx in sorted({sx for sx, _ in pad.places}):
        lines.append(rectangle(x + sx, base_y + pad.high_mm / 2, PACKAGE_mm, pad.high_mm, "cut"))
    step = f"h{flange - half:g}"
    lines.append(path("cut", f"M{x - flange:g} {base_y:g}v{-low:g}{step}v{low - high:g}h{2 * half:g}v{high - low:g}{step}v{low:g}z"))
    for side in (-1, 1):
        far, near, ring = (x + side * mm for mm in (outside, m.opening[0] / 2, flange + FRAME_PLAY_mm))
        lines.append(path("", f"M{far:g} {base_y:g}v{-(low + LID_mm):g}H{near:g}v{LID_mm:g}H{ring:g}v{low:g}z"))
    lines += down(x + half - 6, base_y - high, high, f"{high:g}") + across(x - half, base_y - high + 3, 2 * half, f"{m.skin[0]:g}")
    return lines + down(x + outside + 2, base_y - low, low, f"{low:g}")


def drawn(pad):
    m = measures(pad)
    step_x, step_y = m.outside[0] + DRAWN_APART_mm, m.outside[1] + DRAWN_APART_mm + 4
    lines = plate(0, 0, m, pad.places) + frame(step_x, 0, m) + hollow(0, step_y, m) + section(step_x, step_y - 10, m, pad)
    lines += ruler(step_x - m.outside[0] / 2, step_y + 14)
    left, top = -m.outside[0] / 2 - 8, -m.outside[1] / 2 - 10
    return sheet("Base plate, mould and frame, 1:1", left, top, step_x + m.outside[0] + 16, step_y + m.outside[1] + 16, lines)
