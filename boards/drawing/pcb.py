"""What follows from a circuit board's KiCad file: its picture, the list of parts to order, and its base plate. For draw.py."""

import json

import pcb_check
import sheet

# In the base plate: screws and solder leave more play than a template; pockets have theirs around the pads of a part.
HOLE_mm, PLAY_mm, POCKET_mm = 3.7, 0.3, 1.1


def bom(board, listed, part_of):
    found = {}
    for name, (*_, value) in board.parts.items():
        if value:
            part = part_of(listed, value)
            row = json.dumps([value, part["maker"], part["order"]], separators=(",", ":"))[1:-1]
            found.setdefault(row, []).append(name)
    return "\n".join(["Comment,Maker,Order number,Designator", *(f'{row},"{",".join(names)}"' for row, names in found.items())]) + "\n"


def placements(board):
    """As many houses take it: places as in the Gerbers, parts turned counter-clockwise, seen from their side."""
    rows = ["Designator,Mid X,Mid Y,Layer,Rotation"]
    for name, (x, y, turn, back, value) in board.parts.items():
        if value:
            rows.append(
                f"{name},{sheet.number(x)}mm,{sheet.number(-y)}mm,{'Bottom' if back else 'Top'},{(180 - turn if back else turn) % 360}"
            )
    return "\n".join(rows) + "\n"


def plate(board, pad):
    """The base plate that the board needs, for OpenSCAD: a hole for each sensor, and from below a pocket for what else is on the front."""
    holes, pockets = [], []
    for part, (x, y, _, back, _) in board.parts.items():
        if part[0] == "U":
            holes.append([x, -y, HOLE_mm, HOLE_mm])
        elif part[0] in "CR" and not back:
            ends = [board.pads[part, pad] for pad in "12"]
            pockets.append([x, -y, *(abs(ends[0][axis] - ends[1][axis]) + ends[0][axis + 2] + 2 * PLAY_mm for axis in (0, 1))])
    both = ", ".join(str([[round(mm, 4) + 0.0 for mm in place] for place in places]) for places in (holes, pockets))
    return f'// Written by boards/drawing/draw.py.\ninclude <../../pads/{pad}.scad>\npart = "";\nplate({both}, {POCKET_mm});\n'


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
        shown = {part: place for part, place in board.parts.items() if place[3] == back}
        lines += [sheet.rectangle(middle + side * x, y, w, h, "cut") for (part, _), (x, y, w, h, _) in board.pads.items() if part in shown]
        lines += [sheet.text(middle + side * x, y + 0.8, part, anchor="middle") for part, (x, y, *_) in shown.items()]
    lines += sheet.ruler(left, bottom + 8)
    return sheet.sheet(f"Circuit board of {name}, both sides, 1:1", left - 4, top - 8, 2 * (right - left) + 20, bottom - top + 22, lines)


def files(path, listed, part_of):
    """{path: text}. path: the .kicad_pcb."""
    board = pcb_check.Board(path.read_text(encoding="utf-8"))
    pad = json.loads((path.parents[1] / "board.json").read_text(encoding="utf-8"))["pad"]
    texts = {
        "-bom.csv": bom(board, listed, part_of),
        "-placement.csv": placements(board),
        "-plate.scad": plate(board, pad),
        ".svg": drawn(board, path.parents[1].name),
    }
    return {path.with_name(path.stem + ending): text for ending, text in texts.items()}
