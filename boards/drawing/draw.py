#!/usr/bin/python3
"""Draws all pictures and tables of the boards that follow from the boards' descriptors and the sensors' geometry.

draw.py            writes them
draw.py --lay      lays circuit boards: a minute for each boards/<board>/pcb, into the .kicad_pcb there; then run draw.py
--check with either lists those that differ from what would be written

boards/<board>/wiring.svg                  from board.json
boards/<board>/README.md, wiring and parts from board.json and parts.json
boards/<board>/pcb/, picture, BOM, plate   from the .kicad_pcb there and parts.json
boards/mould.svg, mould_measures.scad      at 1:1, from boards/pads/3x5.json
boards/BUILD.md, measures                  the same as a table
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


def filled(page, name, text, command=COMMAND):
    """The page with this text between its marks."""
    begin, end = f"<!-- {name}: python3 {command} -->", f"<!-- /{name} -->"
    if page.count(begin) != 1 or page.count(end) != 1:
        raise wiring.Unwired(f'a page has no place for "{name}": it needs one line {begin} and one line {end}')
    return re.sub(f"{re.escape(begin)}.*?{re.escape(end)}", lambda _: f"{begin}\n\n{text}\n{end}", page, flags=re.DOTALL)


def yageo(ohm):
    """As a maker writes it: 2200 is 2K2."""
    letter, unit = ("K", ohm / 1000) if ohm >= 1000 else ("R", ohm)
    whole, _, rest = f"{unit:g}".partition(".")
    return f"{whole}{letter}{rest}"


def part_of(parts, key):
    """Its row of parts.json; a number is a resistance in ohms."""
    if not isinstance(key, (int, float)):
        return parts[key]
    part = parts["resistor"]
    return part | {"part": part["part"].format(wiring.ohms(key)), "order": part["order"].format(yageo(key))}


def parts_table(board, parts):
    rows = ["| count | part | maker, order number | number seen in |", "|---|---|---|---|"]
    for count, key, what in wiring.parts(board):
        part = part_of(parts, key)
        rows.append(f"| {count} | {part['part']}{': ' + what if what else ''} | {part['maker']} {part['order']} | {part['checked']} |")
    return "\n".join(rows) + "\n"


def laid(root):
    """{path: .kicad_pcb}"""
    found, sensors = {}, geometry.places(root)
    for path in sorted(root.glob("boards/*/pcb")):
        name, descriptor = path.parent.name, json.loads(path.with_name("board.json").read_text(encoding="utf-8"))
        found[path / f"fingertip-{name}.kicad_pcb"] = board_file.board_text(wiring.board_of(name, descriptor), sensors)
    return found


def drawings(root):
    """{path: its content}."""
    boards = root / "boards"
    parts = json.loads((boards / "parts.json").read_text(encoding="utf-8"))
    found = {}
    for path in sorted(boards.glob("*/board.json")):
        board = wiring.board_of(path.parent.name, json.loads(path.read_text(encoding="utf-8")))
        found[path.parent / "wiring.svg"] = wiring.drawn(board)
        page = path.parent / "README.md"
        text = filled(page.read_text(encoding="utf-8"), "wiring", wiring.table(board))
        found[page] = filled(text, "parts", parts_table(board, parts))
    for path in sorted(boards.glob("*/pcb/*.kicad_pcb")):
        found |= pcb.files(path, parts, part_of)
    sensors = geometry.places(root)
    found[boards / "mould_measures.scad"] = mould.scad(sensors)
    found[boards / "mould.svg"] = mould.drawn(sensors)
    page = boards / "BUILD.md"
    found[page] = filled(page.read_text(encoding="utf-8"), "measures", mould.table(sensors))
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
