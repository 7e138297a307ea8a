"""What follows from a circuit board's KiCad file: its picture, the list of parts to order, and its base plate. For draw.py."""

import geometry
import pcb_check
import sheet

# In the base plate: screws and solder leave more play than a template; pockets have theirs around the pads of a part.
HOLE_mm, PLAY_mm, POCKET_mm = 3.7, 0.3, 1.1


def bom(board, listed, part_of):
    rows = ["Comment,Designator,Footprint,Manufacturer,MPN"]
    for value in dict.fromkeys(value for *_, value in board.parts.values() if value):
        part, names = part_of(listed, value), [name for name, (*_, other) in board.parts.items() if other == value]
        cells = value, ",".join(names), board.lands[names[0]].partition(":")[2], part["maker"], part["order"]
        rows.append(",".join(f'"{cell}"' for cell in cells))
    return "\n".join(rows) + "\n"


def placements(board):
    """As many houses take it: places as in the Gerbers, parts turned counter-clockwise, seen from their side."""
    rows = ["Designator,Mid X,Mid Y,Layer,Rotation"]
    for name, (x, y, turn, back, value) in board.parts.items():
        side, turn = ("Bottom", 180 - turn) if back else ("Top", turn)
        rows += [f"{name},{sheet.number(x)}mm,{sheet.number(-y)}mm,{side},{turn % 360}"] * bool(value)
    return "\n".join(rows) + "\n"


def plate(board, descriptor):
    """The base plate that such boards need, for OpenSCAD: a hole for each sensor, and from below a pocket for what else is on the front."""
    holes, pockets, (pad, middles) = [], [], geometry.pads_of(descriptor)
    for dx, dy in middles:
        for part, (x, y, _, back, _) in board.parts.items():
            if part[0] == "U":
                holes.append([x + dx, dy - y, HOLE_mm, HOLE_mm])
            elif part[0] in "CR" and not back:
                ends = [board.pads[part, end] for end in "12"]
                pockets.append([x + dx, dy - y, *(abs(ends[0][axis] - ends[1][axis]) + ends[0][axis + 2] + 2 * PLAY_mm for axis in (0, 1))])
    both = ", ".join(str([[round(mm, 4) + 0.0 for mm in place] for place in places]) for places in (holes, pockets))
    return f'// Written by boards/drawing/draw.py.\ninclude <../../pads/{pad.name}.scad>\npart = "";\nplate({both}, {POCKET_mm});\n'


def drawn(board, name):
    """Both sides at 1:1, the back as one sees it: the assembly drawing."""
    (left, top), (right, bottom) = board.outline
    lines = []
    for back, words in ((False, "front: sensors"), (True, "back")):
        middle, side, layer = (right - left + 12) * back, -1 if back else 1, "FB"[back] + ".Cu"
        lines += [sheet.rectangle(middle, 0, right - left, bottom - top), sheet.text(middle + left, top - 2, words)]
        lines += [sheet.circle(middle + side * x, y, diameter) for x, y, diameter in board.holes]
        for x0, y0, x1, y1, width, *_ in (track for track in board.tracks if track[-1] == layer):
            way = f"M{sheet.number(middle + side * x0)} {sheet.number(y0)}L{sheet.number(middle + side * x1)} {sheet.number(y1)}"
            lines.append(f'  <path class="measure" style="stroke-width: {width:g}; opacity: 0.5" d="{way}"/>')
        lines += [sheet.circle(middle + side * x, y, 0.6, "blue") for part, (x, y) in board.dots.items() if board.parts[part][3] == back]
        shown = {part: place for part, place in board.parts.items() if place[3] == back}
        lines += [sheet.rectangle(middle + side * x, y, w, h, "cut") for (part, _), (x, y, w, h, _) in board.pads.items() if part in shown]
        lines += [sheet.text(middle + side * x, y + 0.4, part, "small" * (part[0] in "RC"), "middle") for part, (x, y, *_) in shown.items()]
    size = 2 * max(right - left, 21) + 20, bottom - top + 22
    return sheet.sheet(f"Circuit board of {name}, both sides, 1:1", left - 4, top - 8, *size, lines + sheet.ruler(left, bottom + 8))


def files(path, listed, part_of):
    """{path: text}. path: the .kicad_pcb."""
    board, descriptor = pcb_check.Board(path.read_text(encoding="utf-8")), geometry.descriptor(path.parent)
    texts = {"-bom.csv": bom(board, listed, part_of), "-placement.csv": placements(board), "-plate.scad": plate(board, descriptor)}
    texts[".svg"] = drawn(board, path.stem.removeprefix("fingertip-"))
    return {path.with_name(path.stem + ending): text for ending, text in texts.items()}
