"""A circuit board for KiCad: parts by layout.py, tracks by route.py. For draw.py."""

import layout
import mould
import pcb_check
import route
from sheet import number

THICK_mm = 1.6
MIDDLE_mm = 100  # of the pad, on KiCad's sheet
HEAD_mm, SCREW_FREE_mm = 3.2, 3.4  # of an M3's nut across its corners, half; without tracks
UNDER_PICO_mm = (-3.9, -25.1, 3.9, -11.3)  # from its middle: test points, and the solder of the USB socket (its data sheet, SMT footprint)
UNDER_SENSOR_mm = (-1.95, -1.95, 1.95, 1.95)  # its courtyard
FONT = "(effects (font (size 0.7 0.7) (thickness 0.12))"
LAYERS = (
    '(0 "F.Cu" signal) (31 "B.Cu" signal) (34 "B.Paste" user) (35 "F.Paste" user) (36 "B.SilkS" user) (37 "F.SilkS" user) (38 "B.Mask" user) '
    '(39 "F.Mask" user) (44 "Edge.Cuts" user) (46 "B.CrtYd" user) (47 "F.CrtYd" user) (48 "B.Fab" user) (49 "F.Fab" user)'
)


def at(x, y):
    return f"{number(MIDDLE_mm + x)} {number(MIDDLE_mm + y)}"


def zone(net, layer, fill, rectangle):
    left, top, right, bottom = rectangle
    corners = "".join(f" (xy {at(x, y)})" for x, y in ((left, top), (right, top), (right, bottom), (left, bottom)))
    return f'  (zone {net} (layer "{layer}.Cu") (hatch edge 0.5) (connect_pads (clearance 0.2)) (min_thickness 0.25) {fill} (polygon (pts{corners})))'


def footprint(part, numbers):
    land, side = part.land, "B" if part.back else "F"
    turn, mirror = f" {part.turn}" if part.turn else "", " (justify mirror)" if part.back else ""
    yield f'  (footprint "{land.kicad}" (layer "{side}.Cu") (at {at(part.x, part.y)}{turn}) (attr smd)'
    for kind, layer, y, words in (
        ("reference", "Fab" if turn else "SilkS", -land.bottom - 0.6, part.name),
        ("value", "Fab", 0, part.value),
    ):
        yield f'    (fp_text {kind} "{words}" (at 0 {number(y)}) (layer "{side}.{layer}") {FONT}{mirror}))'
    corners = f"(start {number(-land.right)} {number(-land.bottom)}) (end {number(land.right)} {number(land.bottom)})"
    yield f'    (fp_rect {corners} (layer "{side}.CrtYd") (width 0.05) (fill none))'
    pads = [(name, x, -y if part.back else y, w, h) for name, x, y, w, h in land.pads]  # as KiCad flips a part
    if len(pads) > 2:
        _, x, y, w, _ = pads[0]
        dot = f"(center {number(x - w / 2 - 0.35)} {number(y)}) (end {number(x - w / 2 - 0.25)} {number(y)})"
        yield f'    (fp_circle {dot} (layer "{side}.SilkS") (width 0.15) (fill none))'
    for name, x, y, w, h in pads:
        net = f' (net {numbers[part.nets[name]]} "{part.nets[name]}")' if name in part.nets else ""
        place = f"(at {number(x)} {number(y)}{turn}) (size {number(w)} {number(h)})"
        yield f'    (pad "{name}" smd rect {place} (layers "{side}.Cu" "{side}.Paste" "{side}.Mask"){net})'
    yield "  )"


def screw(i, x, y):
    hole = f"(size {mould.SCREW_mm} {mould.SCREW_mm}) (drill {mould.SCREW_mm})"
    yield f'  (footprint "fingertip:screw" (layer "F.Cu") (at {at(x, y)}) (attr exclude_from_pos_files exclude_from_bom)'
    yield f'    (fp_text reference "H{i}" (at 0 0) (layer "F.Fab") hide {FONT}))'
    yield from (f'    (fp_circle (center 0 0) (end {HEAD_mm} 0) (layer "{side}.CrtYd") (width 0.05) (fill none))' for side in "FB")
    yield f'    (pad "" np_thru_hole circle (at 0 0) {hole} (layers "*.Cu" "*.Mask")))'


def copper(numbers, laid):
    um = lambda x, y: at(x / 1000, y / 1000)
    sizes = f"(size {route.VIA_um / 1000}) (drill {route.DRILL_um / 1000})"
    for net, (tracks, vias) in laid.items():
        for x0, y0, x1, y1, layer in tracks:
            ends = f"(start {um(x0, y0)}) (end {um(x1, y1)}) (width {route.TRACK_um / 1000})"
            yield f'  (segment {ends} (layer "{"FB"[layer]}.Cu") (net {numbers[net]}))'
        for x, y in vias:
            yield f'  (via (at {um(x, y)}) {sizes} (layers "F.Cu" "B.Cu") (net {numbers[net]}))'


def board_text(board, sensors):
    """The .kicad_pcb."""
    measures, parts = mould.measures(sensors), layout.parts(board, sensors)
    x, y = (mm / 2 for mm in measures.outside)
    numbers = {net: n + 1 for n, net in enumerate(sorted({net for part in parts for net in part.nets.values()}))}
    lines = [
        "(kicad_pcb (version 20211014) (generator fingertip)",
        f'  (general (thickness {THICK_mm})) (paper "A4") (layers {LAYERS})',
        f'  (setup (pad_to_mask_clearance 0.05) (aux_axis_origin {at(0, 0)})) (net 0 "")',
        *(f'  (net {n} "{net}")' for net, n in numbers.items()),
        f'  (gr_rect (start {at(-x, -y)}) (end {at(x, y)}) (layer "Edge.Cuts") (width 0.1) (fill none))',
        *(line for part in parts for line in footprint(part, numbers)),
        *(line for i, (x, y) in enumerate(measures.screws) for line in screw(i, x, -y)),
    ]
    placed = pcb_check.Board("\n".join([*lines, ")"]))
    around = lambda letter, box: [tuple(part[axis] + mm for axis, mm in zip((2, 3, 2, 3), box)) for part in parts if part.name[0] == letter]
    under = around("A", UNDER_PICO_mm)
    pads = [(net, int(placed.parts[part][3]), *place) for (part, _), (*place, net) in placed.pads.items()]
    screws = [(x, y, SCREW_FREE_mm) for x, y, _ in placed.holes]
    lines += copper(numbers, route.route(measures.outside, pads, screws, around("U", UNDER_SENSOR_mm) + under, under))
    x, y = (mm / 2 - route.EDGE_um / 1000 for mm in measures.outside)
    fill = "(fill yes (thermal_gap 0.3) (thermal_bridge_width 0.4) (island_removal_mode 0))"
    lines += [zone(f'(net {numbers["GND"]}) (net_name "GND")', layer, fill, (-x, -y, x, y)) for layer in "FB"]
    none = "(keepout (tracks not_allowed) (vias not_allowed) (pads allowed) (copperpour not_allowed) (footprints allowed)) (fill)"
    lines += [zone('(net 0) (net_name "")', "B", none, rectangle) for rectangle in under]
    return "\n".join([*lines, ")"]) + "\n"
