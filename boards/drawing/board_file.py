"""A circuit board for KiCad: parts by layout.py, tracks by route.py. For draw.py."""

import layout
import mould
import pcb_check
import route
from sheet import number

MIDDLE_mm = 100  # of the pad, on KiCad's sheet
HOLE_FREE_mm = 0.1  # around a hole, beside the clearance of tracks
FONT = "(effects (font (size 1 1) (thickness 0.15))"
LAYERS = (
    '(0 "F.Cu" signal) (31 "B.Cu" signal) (34 "B.Paste" user) (35 "F.Paste" user) (36 "B.SilkS" user) (37 "F.SilkS" user) (38 "B.Mask" user) '
    '(39 "F.Mask" user) (44 "Edge.Cuts" user) (46 "B.CrtYd" user) (47 "F.CrtYd" user) (48 "B.Fab" user) (49 "F.Fab" user)'
)


def at(x, y):
    return f"{number(MIDDLE_mm + x)} {number(MIDDLE_mm + y)}"


def zone(net, layers, fill, rectangle):
    left, top, right, bottom = rectangle
    corners = "".join(f" (xy {at(x, y)})" for x, y in ((left, top), (right, top), (right, bottom), (left, bottom)))
    on = " ".join(f'"{side}.Cu"' for side in layers)
    kind = f"{net} (layers {on}) (hatch edge 0.5) (connect_pads (clearance 0.2)) (min_thickness 0.25) {fill}"
    return f"  (zone {kind} (polygon (pts{corners})))"


def footprint(part, numbers):
    land, side = part.land, "B" if part.back else "F"
    turn, mirror = f" {part.turn}" if part.turn else "", " (justify mirror)" if part.back else ""
    flip = -1 if part.back else 1  # as KiCad flips a part
    kind = "smd" if part.value else "exclude_from_pos_files exclude_from_bom"
    yield f'  (footprint "{land.kicad}" (layer "{side}.Cu") (at {at(part.x, part.y)}{turn}) (attr {kind})'
    text = lambda kind, words, y, on: f'    (fp_text {kind} "{words}" (at 0 {number(y)}) (layer "{side}.{on}") {FONT}{mirror}))'
    yield text("reference", part.name, flip * (-land.bottom - 0.6), "Fab" if turn or not land.pads else "SilkS")
    yield text("value", part.value, 0, "Fab")
    corners = f"(start {number(-land.right)} {number(-land.bottom)}) (end {number(land.right)} {number(land.bottom)})"
    yield from (f'    (fp_rect {corners} (layer "{each}.CrtYd") (width 0.05) (fill none))' for each in (side if land.pads else "FB"))
    if len(land.pads) > 2:
        _, x, y, w, _ = land.pads[0]
        dot = f"(center {number(x - w / 2 - 0.45)} {number(flip * y)}) (end {number(x - w / 2 - 0.3)} {number(flip * y)})"
        yield f'    (fp_circle {dot} (layer "{side}.SilkS") (width 0.3) (fill none))'
    for name, x, y, w, h in land.pads:
        net = f' (net {numbers[part.nets[name]]} "{part.nets[name]}")' if name in part.nets else ""
        place = f"(at {number(x)} {number(flip * y)}{turn}) (size {number(w)} {number(h)})"
        yield f'    (pad "{name}" smd rect {place} (layers "{side}.Cu" "{side}.Paste" "{side}.Mask"){net})'
    for x, y, hole in land.holes:
        yield f'    (pad "" np_thru_hole circle (at {number(x)} {number(flip * y)}) (size {hole} {hole}) (drill {hole}) (layers "*.Cu" "*.Mask"))'
    yield "  )"


def copper(numbers, laid):
    sizes = f"(size {route.VIA_um / 1000}) (drill {route.DRILL_um / 1000})"
    for net, (tracks, vias) in laid.items():
        for x0, y0, x1, y1, layer in tracks:
            ends = f"(start {at(x0, y0)}) (end {at(x1, y1)}) (width {route.TRACK_um / 1000})"
            yield f'  (segment {ends} (layer "{"FB"[layer]}.Cu") (net {numbers[net]}))'
        for x, y in vias:
            yield f'  (via (at {at(x, y)}) {sizes} (layers "F.Cu" "B.Cu") (net {numbers[net]}))'


def board_text(board):
    """The .kicad_pcb."""
    outside, parts = mould.measures(board.pad).outside, layout.parts(board)
    x, y = (mm / 2 for mm in outside)
    numbers = {net: n + 1 for n, net in enumerate(sorted({net for part in parts for net in part.nets.values()}))}
    lines = [
        "(kicad_pcb (version 20211014) (generator fingertip)",
        f'  (general (thickness {mould.BOARD_mm})) (paper "A4") (layers {LAYERS})',
        f'  (setup (pad_to_mask_clearance 0.05) (aux_axis_origin {at(0, 0)})) (net 0 "")',
        *(f'  (net {n} "{net}")' for net, n in numbers.items()),
        f'  (gr_rect (start {at(-x, -y)}) (end {at(x, y)}) (layer "Edge.Cuts") (width 0.1) (fill none))',
        *(line for part in parts for line in footprint(part, numbers)),
    ]
    placed = pcb_check.Board("\n".join([*lines, ")"]))
    pads = [(net, int(placed.parts[part][3]), *place) for (part, _), (*place, net) in placed.pads.items()]
    free = [(sides, (part.x - x, part.y + top, part.x + x, part.y + bottom)) for part in parts for sides, x, top, bottom in part.land.free]
    around = [("FB", (x - reach, y - reach, x + reach, y + reach)) for x, y, hole in placed.holes for reach in [hole / 2 + HOLE_FREE_mm]]
    lines += copper(numbers, route.route(outside, pads, [(["FB".index(side) for side in sides], box) for sides, box in free + around]))
    x, y = (mm / 2 - route.EDGE_um / 1000 for mm in outside)
    fill = "(fill yes (thermal_gap 0.3) (thermal_bridge_width 0.4) (island_removal_mode 0))"
    lines.append(zone(f'(net {numbers["GND"]}) (net_name "GND")', "FB", fill, (-x, -y, x, y)))
    none = "(keepout (tracks not_allowed) (vias not_allowed) (pads allowed) (copperpour not_allowed) (footprints allowed)) (fill)"
    lines += [zone('(net 0) (net_name "")', sides, none, box) for sides, box in free if sides]
    return "\n".join([*lines, ")"]) + "\n"
