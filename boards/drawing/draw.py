#!/usr/bin/python3
"""Draws all pictures and tables of the boards that follow from the boards' descriptors and the sensors' geometry.

draw.py            writes them
draw.py --lay      lays circuit boards: some minutes for each boards/<board>/pcb*, into the .kicad_pcb there; then run draw.py
--check with either lists those that differ from what would be written

boards/<board>/wiring.svg                  from board.json
boards/<board>/README.md, wiring and parts from board.json and parts.json
boards/<board>/pcb*/, picture, BOM, plate  from the .kicad_pcb there and parts.json
boards/pads/<pad>.svg, <pad>.scad          template at 1:1 and solids of the printed parts, from <pad>.json there
boards/BUILD.md, measures                  the same of the boards' own pad as a table
"""

import json
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import board_file
import geometry
import mould
import pcb
import wiring

COMMAND = "boards/drawing/draw.py"
OWN_PAD = "3x5.json"


def filled(page, name, text, command=COMMAND):
    """The page with this text between its marks."""
    begin, end = f"<!-- {name}: python3 {command} -->", f"<!-- /{name} -->"
    if page.count(begin) != 1 or page.count(end) != 1:
        raise wiring.Unwired(f'a page has no place for "{name}": it needs one line {begin} and one line {end}')
    return re.sub(f"{re.escape(begin)}.*?{re.escape(end)}", lambda _: f"{begin}\n\n{text}\n{end}", page, flags=re.DOTALL)


def yageo(words):
    """A resistance as a maker writes it: 2.2 kOhm is 2K2."""
    value, unit = words.split()
    whole, _, rest = value.partition(".")
    return whole + {"Ohm": "R", "kOhm": "K"}[unit] + rest


def part_of(parts, name):
    """Its row of parts.json, or that of resistors."""
    if name in parts:
        return parts[name]
    part = parts["resistor"]
    return part | {"part": part["part"].format(name), "order": part["order"].format(yageo(name))}


def parts_table(board, parts):
    rows = ["| count | part | maker, order number | number seen in |", "|---|---|---|---|"]
    for count, key, what in wiring.parts(board):
        part = part_of(parts, key)
        rows.append(f"| {count} | {part['part']}{': ' + what if what else ''} | {part['maker']} {part['order']} | {part['checked']} |")
    return "\n".join(rows) + "\n"


def laid(root):
    """{path: .kicad_pcb}"""
    found = {}
    for path in sorted(root.glob("boards/*/pcb*/*.kicad_pro")):
        board = wiring.board_of(path.stem.removeprefix("fingertip-"), geometry.descriptor(path.parent), root)
        found[path.with_suffix(".kicad_pcb")] = board_file.board_text(board)
    return found


def drawings(root):
    """{path: its content}."""
    boards = root / "boards"
    parts = json.loads((boards / "parts.json").read_text(encoding="utf-8"))
    found = {}
    for path in sorted(boards.glob("*/board.json")):
        board = wiring.board_of(path.parent.name, json.loads(path.read_text(encoding="utf-8")), root)
        found[path.parent / "wiring.svg"] = wiring.drawn(board)
        page = path.parent / "README.md"
        text = filled(page.read_text(encoding="utf-8"), "wiring", wiring.table(board))
        found[page] = filled(text, "parts", parts_table(board, parts))
    for path in sorted(boards.glob("*/pcb*/*.kicad_pcb")):
        found |= pcb.files(path, parts, part_of)
    pads = {path: geometry.pad(path) for path in sorted(boards.glob("pads/*.json"))}
    for path, pad in pads.items():
        found |= {path.with_suffix(".scad"): mould.scad(pad), path.with_suffix(".svg"): mould.drawn(pad)}
    page = boards / "BUILD.md"
    found[page] = filled(page.read_text(encoding="utf-8"), "measures", mould.table(pads[boards / "pads" / OWN_PAD]))
    return found


def main(argv, root=HERE.parents[1]):
    if argv not in ([], ["--check"], ["--lay"], ["--lay", "--check"]):
        print(__doc__, file=sys.stderr)
        return 2
    try:
        found = laid(root) if "--lay" in argv else drawings(root)
    except wiring.Unwired as error:
        print(f"draw.py: {error}", file=sys.stderr)
        return 1
    if "--check" not in argv:
        for path, text in found.items():
            path.write_text(text, encoding="utf-8")
        return 0
    differ = [path for path, text in found.items() if not path.exists() or path.read_text(encoding="utf-8") != text]
    for path in differ:
        print(f"{path.relative_to(root)} is not what {COMMAND} draws from the descriptors and the geometry; run it", file=sys.stderr)
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
