"""Pads of the twin on which a person calibrates and taps (placements.cpp), one row for each."""

import dataclasses

import numpy as np

TEN_PERCENT = {"gain_percent": 10.0}
GAINS_20 = {"gain_percent": 20.0}
DIP = TEN_PERCENT | {"dip_percent": 5.0}
# As real arrays are (host_tools/report/real).
LIKE_REAL = {"gain_percent": 20.0, "misplaced_mm": 0.1, "dip_percent": 5.0, "widths_percent": 3.5}
# As the twin's own, and as many whose sensors remember a hold by 1 % and sit 0.1 mm (sd) off.
USUAL = (TEN_PERCENT, TEN_PERCENT | {"memory_percent": 1.0, "misplaced_mm": 0.1})
LAYER_mm, WEIGHT_N = 12.0, 3.0


SENSORS = 15
# Contact shapes that the twin has no name for: kind, size_x_mm, size_y_mm, and the edge of the twin's cylinders.
FLAT_SQUARE, ROLLER, EDGE_mm = 2, 4, 0.4
SHAPES = (
    {"cylinder6x12": (ROLLER, 6, 12)}
    | {f"edge{mm}": (ROLLER, 2, mm) for mm in (10, 12, 14, 20, 24, 27, 30, 36)}
    | {"cube15": (FLAT_SQUARE, 15, 15)}
)


def shape(firmware, name):
    """The contact shape of a name that the twin does not know, or None."""
    if name not in SHAPES:
        return None
    made = firmware.made("contact_shape", 1)
    kind, x_mm, y_mm = SHAPES[name]
    for field, value in (("kind", kind), ("size_x_mm", x_mm), ("size_y_mm", y_mm), ("edge_mm", EDGE_mm)):
        made[field] = value
    return made


def kinds(firmware, *each):
    made = firmware.made("pad_kind", len(each))
    for row, kind in zip(made, each):
        for name, value in kind.items():
            row[name] = value
    return made


@dataclasses.dataclass
class Session:
    """What calibrations found: calibration [pad], calibrated_sensor and fit_deviation [pad, sensor]."""

    found: np.ndarray
    sensors: np.ndarray
    deviations: np.ndarray

    @classmethod
    def of(cls, firmware, count):
        return cls(
            firmware.made("calibration", count),
            firmware.made("calibrated_sensor", count, SENSORS),
            firmware.made("fit_deviation", count, SENSORS),
        )

    def where(self, chosen):
        return Session(self.found[chosen], self.sensors[chosen], self.deviations[chosen])


@dataclasses.dataclass
class Placements:
    """[pad, placement, sensor], their times, and the share of the readings that fades in half a second."""

    firmware: object
    t_s: np.ndarray
    reading_Pa: np.ndarray
    fading: np.ndarray

    def first(self, count):
        return Placements(self.firmware, *(np.ascontiguousarray(each[:, :count]) for each in (self.t_s, self.reading_Pa, self.fading)))

    def calibrated(self):
        noise_Pa = self.firmware.osr(1024)[1] / 1024.0 / 10.0  # of a mean over a hundred frames
        return Session(
            *self.firmware.calibrate(*self.firmware.layout(), self.t_s, self.reading_Pa, noise_Pa, fading=self.fading, force_N=WEIGHT_N)
        )


def placements(firmware, session, of, seeds, layer_mm, count):
    shape = (len(seeds), count)
    made = Placements(firmware, np.zeros(shape), np.zeros((*shape, SENSORS)), np.zeros(shape))
    firmware.call("pad_placements", session, of, layer_mm, firmware.contact_tables, seeds, made.t_s, made.reading_Pa, made.fading)
    return made


def led(firmware, session, of, seeds, layer_mm, planned):
    """Sessions as the tool leads them, and how many placements each needed."""
    made, needed = Session.of(firmware, len(seeds)), np.zeros(len(seeds), np.int64)
    firmware.call(
        "pad_lead", session, of, layer_mm, firmware.contact_tables, seeds, planned, made.found, made.sensors, made.deviations, needed
    )
    return made, needed


def taps(firmware, of, seeds, layer_mm, count):
    """x_mm, y_mm, force_N [pad, tap], reading_Pa [pad, tap, sensor]."""
    made = *(np.zeros((len(seeds), count)) for _ in range(3)), np.zeros((len(seeds), count, SENSORS))
    firmware.call("pad_taps", of, layer_mm, firmware.contact_tables, seeds, *made)
    return made


def settled_gains(firmware, of, seeds, layer_mm):
    gain = np.zeros((len(seeds), SENSORS))
    firmware.call("pad_gains", of, layer_mm, firmware.contact_tables, seeds, gain)
    return gain
