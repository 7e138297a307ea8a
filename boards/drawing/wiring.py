"""A board's wires, from its descriptor (boards/README.md): as rows of a table, as parts to order, and as wiring.svg."""

import dataclasses
import math

import geometry
import pico
import sheet
from sheet import path, text

SYNC = "the [sync pin](../../host_tools/README.md#a-clock-that-cameras-share), 3.3 V; leave it open if there is no camera"
MUX_ADDRESS = 0x70  # of a TCA9548A with A2, A1, A0 low
LEAST_ohm = (3.3 - 0.4) / 3e-3  # of all pull-ups of a line: UM10204 has 0.4 V at 3 mA
SENSOR_PADS = {"GND": 1, "VDD": 2, "SCL": 3, "SDA": 4}  # of an MS5840-02BA, as public boards have them: MTL_BaroTactile_MS5840 (BUILD.md)


class Unwired(Exception):
    """The descriptor is of no board that can be drawn. cmake/boards.cmake judges its pins and addresses."""


@dataclasses.dataclass
class Board:
    name: str
    bus: str
    wiring: dict
    pull_ups_ohm: dict
    pad: geometry.Pad

    @property
    def sensors(self):
        return self.wiring["sensor_count"]

    @property
    def strips(self):
        return math.ceil(self.sensors / self.wiring["sensors_of_strip"])

    def sensors_of(self, strip):
        first = strip * self.wiring["sensors_of_strip"]
        return range(first, min(first + self.wiring["sensors_of_strip"], self.sensors))

    def mux_address(self, strip):
        return int(self.wiring["mux_address_0"], 0) + strip

    def reset_gpio(self, strip):
        return self.wiring["pin_mux_reset_0"] + strip


def board_of(name, descriptor, root=geometry.ROOT):
    pad, _ = geometry.pads_of(descriptor, root)
    board = Board(name, descriptor["bus"], descriptor["wiring"], descriptor.get("pull_ups_ohm", {}), pad)
    if board.bus not in ("parallel", "multiplexed"):
        raise Unwired(f"boards/{name}/board.json: no drawing knows the bus {board.bus}; add one to boards/drawing/wiring.py")
    needed = ("sda", "scl") if board.bus == "parallel" else ("bus", "channel", "reset")
    missing = [key for key in needed if key not in board.pull_ups_ohm]
    if missing:
        raise Unwired(f"boards/{name}/board.json: pull_ups_ohm has no {missing[0]}; add its resistance in ohms")
    ohm = board.pull_ups_ohm
    least_ohm = min(ohm.values()) if board.bus == "parallel" else 1 / (1 / ohm["bus"] + board.sensors / ohm["channel"])
    if least_ohm < LEAST_ohm:
        raise Unwired(f"boards/{name}/board.json: {least_ohm:.0f} Ohm pull a line up, all channels open; I2C allows {LEAST_ohm:.0f}")
    return board


def gpios(board):
    w = board.wiring
    if board.bus == "parallel":
        return [*range(board.sensors), w["pin_scl"], w["pin_sync"]]
    return [w["pin_sda"], w["pin_scl"], *(board.reset_gpio(s) for s in range(board.strips)), w["pin_sync"]]


def listed(words):
    words = [str(word) for word in words]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def ohms(value):
    return f"{value / 1000:g} kOhm" if value >= 1000 else f"{value:g} Ohm"


def gpio_cell(numbers):
    pins = [pico.pin(f"GP{n}") for n in numbers]
    return f"{listed(f'GP{n}' for n in numbers)} (pin{'s' if len(pins) > 1 else ''} {listed(pins)})"


def levels(board, strip):
    """Of A2, A1, A0."""
    bits = board.mux_address(strip) - MUX_ADDRESS
    return ["3V3" if bits >> bit & 1 else "GND" for bit in (2, 1, 0)]


def cable(board):
    """Of a strip, or of a multiplexed circuit board, by pin: 1 to 8. No net where the firmware of a larger pad drives a RESET."""
    if board.bus == "parallel":
        return ["GND", "3V3", "SCL", *(f"SDA{k}" for k in range(board.sensors))]
    return ["GND", "3V3", "SDA", "SCL", *(f"RESET{strip}" for strip in range(board.strips)), *[None] * (3 - board.strips), "GND"]


def table(board):
    """Markdown: every wire of the Pico, and what chooses an address."""
    w, pads = board.wiring, SENSOR_PADS
    if board.bus == "parallel":
        rows = [(gpio_cell([k]), f"SDA (pad {pads['SDA']}) of sensor {k}") for k in range(board.sensors)]
        rows.append((gpio_cell([w["pin_scl"]]), f"SCL (pad {pads['SCL']}) of all sensors"))
        all_parts = "all sensors"
    else:
        rows = [
            (gpio_cell([w["pin_sda"]]), f"SDA of the {board.strips} TCA9548A"),
            (gpio_cell([w["pin_scl"]]), f"SCL of the {board.strips} TCA9548A"),
        ]
        rows += [(gpio_cell([board.reset_gpio(s)]), f"RESET of the TCA9548A of strip {s}") for s in range(board.strips)]
        all_parts = "all parts"
    rows += [
        (gpio_cell([w["pin_sync"]]), SYNC),
        (f"3V3 OUT (pin {pico.pin('3V3')})", f"VDD of {all_parts} (sensors: pad {pads['VDD']}), pull-ups"),
        (f"GND (pins {listed(pico.grounds())})", f"GND of {all_parts} (sensors: pad {pads['GND']})"),
    ]
    page = "| from | to |\n|---|---|\n" + "".join(f"| {a} | {b} |\n" for a, b in rows)
    if board.bus == "parallel":
        return page
    page += "\n| strip | address of its TCA9548A | A2, A1, A0 | channels |\n|---|---|---|---|\n"
    for strip in range(board.strips):
        sensors = board.sensors_of(strip)
        page += f"| {strip} | 0x{board.mux_address(strip):02x} | {', '.join(levels(board, strip))} | 0 to {len(sensors) - 1}: SDA and SCL of sensors {sensors[0]} to {sensors[-1]} |\n"
    page += "\n| pin of the connector on a circuit board | wire | pin of the Pico |\n|---|---|---|\n"
    first, last, *_ = pico.grounds()
    ends = [first, pico.pin("3V3"), *(pico.pin(f"GP{gpio}") for gpio in gpios(board)[:-1]), *["none"] * (3 - board.strips), last]
    return page + "".join(f"| {i + 1} | {wire or 'open'} | {end} |\n" for i, (wire, end) in enumerate(zip(cable(board), ends)))


def parts(board):
    """[(count, part of parts.json, what for)]."""
    ohm = board.pull_ups_ohm
    found = [(1, "Raspberry Pi Pico", ""), (board.sensors, board.pad.part, "")]
    if board.bus == "parallel":
        found += [(board.sensors, ohms(ohm["sda"]), "pull-up of each SDA"), (1, ohms(ohm["scl"]), "pull-up of SCL")]
        capacitors = board.sensors
    else:
        found += [
            (board.strips, "TCA9548A", ""),
            (2, ohms(ohm["bus"]), "pull-ups of SDA and SCL"),
            (2 * board.sensors, ohms(ohm["channel"]), "pull-ups of each channel"),
            (board.strips, ohms(ohm["reset"]), "pull-up of each RESET, which holds it while the Pico starts"),
        ]
        found += [(1, "JST SH 8", "only on a circuit board, as the next three"), (1, "housing", ""), (8, "contact", ""), (8, "wire", "")]
        capacitors = board.sensors + board.strips
    return found + [(capacitors, "100 nF", "at each part's VDD")]


# The picture: its own units, not millimetres.
STYLE = """
    text { font: 12px sans-serif; fill: #222 }
    .small { font-size: 10px; fill: #555 }
    .title { font-weight: bold }
    .wire { stroke: #1f5fa8; stroke-width: 1.4; fill: none }
    .scl { stroke: #b35c00; stroke-width: 1.8; fill: none }
    .rail { stroke: #b02020; stroke-width: 1.8; fill: none }
    .reset { stroke: #3a7d44; stroke-width: 1.3; fill: none }
    .part { fill: #fff; stroke: #333; stroke-width: 1.2 }
    .chip { fill: #eef3ee; stroke: #333; stroke-width: 1.4 }
    .dot { fill: #b35c00 }
    .node { fill: #1f5fa8 }
  """
PULL_UP = '<g id="pullup"><path d="M0 0v-5" stroke="#333"/><rect class="part" x="-4" y="-19" width="8" height="14"/><path class="rail" d="M0 -19v-4h18"/></g>'
ROW, SENSOR_WIDTH = 30, 86


def node(x, y, kind="node"):
    return sheet.circle(x, y, 4.6, kind)


def sensor(x, y, k, part):
    return [
        f'  <rect class="part" x="{x}" y="{y - 11}" width="{SENSOR_WIDTH}" height="22" rx="3"/>',
        text(x + 6, y + 4, f"{part.partition('-')[0]} {k}"),
    ]


def gpio(y, number, right, label=""):
    name = f"GP{number}"
    return [text(right - 134, y + 4, f"{name}  {label}".strip()), text(right - 6, y + 4, f"pin {pico.pin(name)}", "small", "end")]


def picture(board, width, height, lines):
    head = [f"  <defs>{PULL_UP}</defs>", f"  <style>{STYLE}</style>", f'  <rect width="{width}" height="{height}" fill="#fff"/>']
    size = f'viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
    return sheet.svg(f"Wiring of board {board.name}", size, head + lines)


def supply(x, y):
    return [
        text(x, y, f"VDD of all parts: 3V3 (pin {pico.pin('3V3')})", "small"),
        text(x, y + 16, f"GND of all parts: pins {listed(pico.grounds())}", "small"),
        text(x, y + 32, "100 nF at each VDD", "small"),
    ]


def drawn_parallel(board):
    right, at_sensor, scl_x, pull_x = 180, 560, 680, 282
    top = 92
    rows = [top + ROW * k for k in range(board.sensors)]
    scl_y = rows[-1] + ROW
    sync_y = scl_y + ROW
    ohm = board.pull_ups_ohm
    lines = [f'  <rect class="chip" x="30" y="40" width="150" height="{sync_y - 40 + 24}" rx="8"/>']
    lines.append(text(46, 62, "Raspberry Pi Pico", "title"))
    for k, y in enumerate(rows):
        lines += gpio(y, k, right) + [path("wire", f"M{right} {y}H{at_sensor}"), node(pull_x, y)]
        lines.append(f'  <use href="#pullup" x="{pull_x}" y="{y}"/>')
        lines += sensor(at_sensor, y, k, board.pad.part) + [
            path("scl", f"M{at_sensor + SENSOR_WIDTH} {y}H{scl_x}"),
            node(scl_x, y, "dot"),
            text(420, y - 6, f"SDA {k}", "small"),
        ]
    lines += gpio(scl_y, board.wiring["pin_scl"], right)
    lines += [
        path("scl", f"M{right} {scl_y}H{scl_x}V{top}"),
        node(pull_x, scl_y, "dot"),
        f'  <use href="#pullup" x="{pull_x}" y="{scl_y}"/>',
        text(420, scl_y - 6, "SCL, to all sensors", "small"),
        path("rail", f"M{pull_x + 18} 40V{scl_y - 23}"),
        text(pull_x + 24, 50, f"3V3 (pin {pico.pin('3V3')}), also VDD of every sensor"),
        text(pull_x + 28, 78, f"{ohms(ohm['sda'])} each", "small"),
        text(pull_x + 28, scl_y - 10, ohms(ohm["scl"]), "small"),
    ]
    lines += gpio(sync_y, board.wiring["pin_sync"], right)
    lines += [path("reset", f"M{right} {sync_y}H240"), text(248, sync_y + 4, "sync, to a camera", "small")]
    for strip in range(board.strips):
        of = board.sensors_of(strip)
        lines += [
            f'  <path d="M700 {rows[of[0]] - 10}h6v{rows[of[-1]] - rows[of[0]] + 20}h-6" fill="none" stroke="#555"/>',
            text(710, (rows[of[0]] + rows[of[-1]]) // 2 + 4, f"strip {strip}", "small"),
        ]
    return picture(board, 760, sync_y + 70, lines + supply(420, sync_y + 20))


def drawn_multiplexed(board):
    right, sda_x, scl_x, mux_x, mux_width, at_sensor, pitch = 160, 250, 276, 340, 130, 600, 25
    w, ohm = board.wiring, board.pull_ups_ohm
    deep = pitch * w["sensors_of_strip"] + 5  # of a multiplexer
    tops = [50 + (deep + 34) * strip for strip in range(board.strips)]
    sda_y, scl_y, reset_y = 140, 170, [240 + 24 * strip for strip in range(board.strips)]
    sync_y = reset_y[-1] + 30
    lines = [f'  <rect class="chip" x="20" y="80" width="140" height="{sync_y - 80 + 20}" rx="8"/>']
    lines.append(text(34, 104, "Raspberry Pi Pico", "title"))
    lines += gpio(sda_y, w["pin_sda"], right, "SDA") + gpio(scl_y, w["pin_scl"], right, "SCL")
    lines += [path("wire", f"M{right} {sda_y}H{sda_x}"), path("scl", f"M{right} {scl_y}H{scl_x}")]
    lines += [node(sda_x, sda_y), node(scl_x, scl_y, "dot")]
    lines.append(path("wire", f"M{sda_x} {tops[0] + 40}V{max(tops[-1] + 40, sda_y)}"))
    lines.append(path("scl", f"M{scl_x} {tops[0] + 62}V{max(tops[-1] + 62, scl_y)}"))
    for x, y, kind in ((185, sda_y, "node"), (215, scl_y, "dot")):
        lines += [node(x, y, kind), f'  <use href="#pullup" x="{x}" y="{y}"/>', path("rail", f"M{x + 18} {y - 23}V70")]
    lines += [text(178, 62, f"3V3 (pin {pico.pin('3V3')})"), text(166, scl_y + 18, f"{ohms(ohm['bus'])} each", "small")]
    for strip, top in enumerate(tops):
        lines += gpio(reset_y[strip], board.reset_gpio(strip), right, f"RESET {strip}")
        elbow = 330 - 11 * strip
        lines += [
            path("reset", f"M{right} {reset_y[strip]}H{elbow}V{top + 92}H{mux_x}"),
            text(mux_x + 12, top - 6, "TCA9548A", "title"),
            text(mux_x + 84, top - 6, f"0x{board.mux_address(strip):02x}, A2 to A0: {' '.join(levels(board, strip))}", "small"),
            f'  <rect class="chip" x="{mux_x}" y="{top}" width="{mux_width}" height="{deep}" rx="6"/>',
        ]
        for label, y in (("SDA", 44), ("SCL", 66), ("RESET", 96)):
            lines.append(text(mux_x + 6, top + y, label, "small"))
        lines += [
            path("wire", f"M{sda_x} {top + 40}H{mux_x}"),
            node(sda_x, top + 40),
            path("scl", f"M{scl_x} {top + 62}H{mux_x}"),
            node(scl_x, top + 62, "dot"),
            text(at_sensor + 10, top - 6, f"2 x {ohms(ohm['channel'])} per channel", "small"),
            text(700, top + deep // 2, f"strip {strip}", "small"),
        ]
        for channel, k in enumerate(board.sensors_of(strip)):
            y = top + 14 + pitch * channel
            lines += [
                text(mux_x + mux_width - 6, y + 4, f"SD{channel} SC{channel}", "small", "end"),
                path("wire", f"M{mux_x + mux_width} {y - 3}H{at_sensor}"),
                path("scl", f"M{mux_x + mux_width} {y + 3}H{at_sensor}"),
                *sensor(at_sensor, y, k, board.pad.part),
            ]
    lines.append(text(34, sync_y + 40, f"each RESET also {ohms(ohm['reset'])} to 3V3", "small"))
    lines += gpio(sync_y, w["pin_sync"], right, "sync")
    lines += [path("reset", f"M{right} {sync_y}H200"), text(206, sync_y + 4, "camera", "small")]
    return picture(board, 760, max(tops[-1] + deep, sync_y + 100) + 20, lines + supply(34, sync_y + 60))


def drawn(board):
    return (drawn_parallel if board.bus == "parallel" else drawn_multiplexed)(board)
