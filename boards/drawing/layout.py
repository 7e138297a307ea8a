"""Where the parts of a circuit board lie, and what is connected: from its descriptor, the sensors' places and the base plate's measures.

Millimetres from the pad's middle, x to the right and y down, seen from the front (the sensors' y is up). What is higher than a sensor lies on the back.
Lands with a name of KiCad 6.0.11's library have its figures. boards/BUILD.md ("What to check first") has where sensor and Pico have theirs from.
"""

import collections

import mould
import pico
import wiring

BESIDE_mm, APART_mm = 3.4, 1.6  # capacitor and resistors of a sensor from its middle: to its sides, and from each other
ROOMY_mm = 8.3  # pitch from which there is room on both sides
EDGE_mm, PULLS_mm, CONNECTOR_mm, WIRES_mm = 26, 5, 3.5, 6  # the middles of Pico, resistors of the bus, connector, wires from the edge
MULTIPLEXER_mm = 8.5  # its middle from the outer sensors
HEAD_mm = 3.2  # of an M3's nut across its corners, half
CHANNELS = [(4, 5), (6, 7), (8, 9), (10, 11), (13, 14), (15, 16), (17, 18), (19, 20)]  # SD and SC of a TCA9548A

# name; [(name, x, y, width, height)]; half the courtyard's width and height; unplated [(x, y, diameter)]; [(layers, half a width, top, bottom)] that
# stay without copper, layers: F, B, both, or none: only without vias
Land = collections.namedtuple("Land", "kicad pads right bottom holes free", defaults=((), ()))
# turn: degrees, counter-clockwise seen from the front; nets: {pad: net}
Part = collections.namedtuple("Part", "name land x y turn back nets value")


def rows(count, x, pitch, width, height):
    """Down on the left, and up on the right."""
    of_row = [(i, pitch * (i - count / 4 + 0.5)) for i in range(count // 2)]
    return [(i + 1 if side < 0 else count - i, side * x, y, width, height) for side in (-1, 1) for i, y in of_row]


SENSOR = Land("Sensor_Pressure:TE_MS5837-xxBA", rows(4, 1, 2, 1.3, 1.3), 1.95, 1.95, (), [("", 1.95, -1.95, 1.95)])
RESISTOR = Land("Resistor_SMD:R_0603_1608Metric", rows(2, 0.825, 0, 0.8, 0.95), 1.48, 0.73)
CAPACITOR = Land("Capacitor_SMD:C_0603_1608Metric", rows(2, 0.775, 0, 0.9, 0.95), 1.48, 0.73)
MULTIPLEXER = Land("Package_SO:TSSOP-24_4.4x7.8mm_P0.65mm", rows(24, 2.8625, 0.65, 1.475, 0.4), 3.85, 4.15)
CONTACTS = [(n + 1, n - 3.5, -2, 0.6, 1.55) for n in range(8)] + [("MP", x, 1.875, 1.2, 1.8) for x in (-4.8, 4.8)]
CONNECTOR = Land("Connector_JST:JST_SH_SM08B-SRSS-TB_1x08-1MP_P1.00mm_Horizontal", CONTACTS, 5.9, 3.28)
WIRES = Land("fingertip:wires", rows(8, 2.6, 2.54, 1.8, 1.5), 3.7, 4.7)
# Holes for solder of the USB socket's legs; and no copper beside test points and SWD pads, of Pico and Pico W.
LEGS = [(side * x, y, diameter) for x, y, diameter in ((2.725, -24, 2.2), (2.425, -20.97, 1.85)) for side in (-1, 1)]
POINTS = [("B", 3.9, -25.3, -10), ("B", 2, -6, -4), ("B", 6.7, 4.7, 6.7), ("B", 3.6, 22.9, 26.6)]
PICO = Land("fingertip:pico", rows(40, 9.79, 2.54, 3.5, 1.7), 11.6, 26.9, LEGS, POINTS)
SCREW = Land("fingertip:screw", (), HEAD_mm, HEAD_mm, [(0, 0, mould.SCREW_mm)], [("FB", HEAD_mm, -HEAD_mm, HEAD_mm)])
POINT = Land("fingertip:point", [(1, 0, 0, 1.5, 1.5)], 1, 1)


class Parts(list):
    def part(self, letter, land, x, y, turn, back, nets, value):
        self.append(Part(f"{letter}{sum(part.name[0] == letter for part in self)}", land, x, y, turn, back, nets, value))

    def resistor(self, x, y, turn, ohm, net):
        self.part("R", RESISTOR, x, y, turn, False, {1: net, 2: "3V3"}, wiring.ohms(ohm))

    def capacitor(self, x, y, turn, back=False):
        self.part("C", CAPACITOR, x, y, turn, back, {1: "3V3", 2: "GND"}, "100 nF")

    def sensors(self, pad, clock, pulls):
        """pulls: {net: (side, ohms)}; {} in a net is the sensor's number."""
        for k, (x, y) in enumerate(pad.places):
            self.part("U", SENSOR, x, -y, 0, False, {1: "GND", 2: "3V3", 3: clock.format(k), 4: f"SDA{k}"}, pad.part)
            self.capacitor(x - BESIDE_mm, APART_mm - y, 270)
            for net, (side, ohm) in pulls.items():
                self.resistor(x + side * BESIDE_mm, -y - APART_mm, 270, ohm, net.format(k))


def parallel(board, edge):
    """The Pico is on the back: no cable. From a strip wires lead to it."""
    parts, ohm, side = Parts(), board.pull_ups_ohm, 1 if board.pad.pitch_mm > ROOMY_mm else -1
    parts.sensors(board.pad, "SCL", {"SDA{}": (side, ohm["sda"])})
    parts.resistor(0, -edge - PULLS_mm, 0, ohm["scl"], "SCL")  # at SCL's far end, to be probed there
    if board.pad.strip_mm:
        parts.part("X", WIRES, 0, edge + WIRES_mm, 0, True, dict(enumerate(wiring.cable(board), 1)), "")
        return parts
    nets = dict.fromkeys([*pico.grounds(), pico.pin("AGND")], "GND") | {pico.pin("3V3"): "3V3"}
    lines = [*(f"SDA{k}" for k in range(board.sensors)), "SCL", "SYNC"]
    nets |= {pico.pin(f"GP{gpio}"): net for gpio, net in zip(wiring.gpios(board), lines)}
    parts.part("J", POINT, -16, edge + PULLS_mm, 0, True, {1: "SYNC"}, "")
    parts.part("A", PICO, 0, edge + EDGE_mm, 180, True, nets, "Raspberry Pi Pico")
    return parts


def multiplexed(board, edge):
    """A cable leads to the Pico."""
    parts, ohm = Parts(), board.pull_ups_ohm
    if board.strips > 3:
        raise wiring.Unwired(f"boards/{board.name}: {board.strips} strips; a circuit board has a place and a wire for three")
    parts.sensors(board.pad, "SCL{}", {"SDA{}": (-1, ohm["channel"]), "SCL{}": (1, ohm["channel"])})
    right, down = (max(abs(place[axis]) for place in board.pad.places) + MULTIPLEXER_mm for axis in (0, 1))
    beside = {-1: (-right, 0, 180, -1.3, -6), 0: (0, down, 270, -6, 1.3), 1: (right, 0, 0, 1.3, 6)}  # the last two: to its capacitor
    for strip in range(board.strips):
        left, others = strip, board.strips - 1 - strip  # strips on both sides of this one
        x, y, turn, dx, dy = beside[(left > others) - (left < others)]
        nets = {12: "GND", 24: "3V3", 22: "SCL", 23: "SDA", 3: f"RESET{strip}"} | dict(zip((21, 2, 1), wiring.levels(board, strip)))
        for k, (data, clock) in zip(board.sensors_of(strip), CHANNELS):
            nets |= {data: f"SDA{k}", clock: f"SCL{k}"}
        parts.part("M", MULTIPLEXER, x, y, turn, True, nets, "TCA9548A")
        parts.capacitor(x + dx, y + dy, (turn + 180) % 360, True)
    pulls = [("SDA", ohm["bus"]), ("SCL", ohm["bus"])] + [(f"RESET{strip}", ohm["reset"]) for strip in range(board.strips)]
    for i, (net, value) in enumerate(pulls):
        parts.resistor(4 * (i - (len(pulls) - 1) / 2), edge + PULLS_mm, 90, value, net)
    nets = {pin + 1: net for pin, net in enumerate(wiring.cable(board)) if net} | {"MP": "GND"}
    parts.part("X", CONNECTOR, 0, edge + CONNECTOR_mm, 0, True, nets, "JST SH 8")
    return parts


def parts(board):
    measures = mould.measures(board.pad)
    found = (parallel if board.bus == "parallel" else multiplexed)(board, -measures.outside[1] / 2)
    for x, y in measures.screws:
        found.part("H", SCREW, x, -y, 0, False, {}, "")
    return found
