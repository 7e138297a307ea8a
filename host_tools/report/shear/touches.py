"""Contacts under a tangential force that hold still, and the rows of tables that compare what the firmware estimates with the truth.

Arrays have a row for each touch (measure/contacts.py).
"""

import dataclasses
import math

import numpy as np
from contacts import FORCE_N, FRICTION, SENSORS, with_tangential
from measure import stream_of
from presentation import percent, quantile

LAYER_mm, SHARE = 12.0, 0.3
# Round or nearly so, the lime with 45 by 55 mm the least.
SEVEN = ("sphere6", "sphere15", "cylinder6", "cube6", "ping_pong", "rubber_duck", "lime")
TOUCHES, UNITS_PER_PAD = 10, 5  # 50 touches of each pad; each unit of ten has its own random numbers


@dataclasses.dataclass
class Case:
    """The defaults are the usual case: |x| <= 9 mm, |y| <= 18 mm, any angle, any direction of the tangential force."""

    pads: np.ndarray
    objects: tuple = SEVEN
    share: float = SHARE  # Q / F
    # How the tangential force came: "held", under a constant normal force; "together" with it; or until the contact "slides".
    history: str = "held"
    forces_N: tuple = (1.0, 10.0)
    osr: int = 1024
    sensors: int = SENSORS  # in use, chosen for each touch
    beyond_mm: float = 0.0  # locations up to this far outside of the array, and only there
    layer_mm: float = LAYER_mm
    overhang_mm: float = None  # of rubber that ends
    profile: np.ndarray = None  # of the fingertip; that of 12 mm without end if there is none
    fewer: float = 1.0  # pads, as a share


def draw(contacts, case, random):
    """One touch of each generator."""
    touch = contacts.made("twin_touch", len(random.states))
    redrawn = np.ones(len(touch), bool)
    while redrawn.any():
        x_mm, y_mm = 9.0 * random.uniform(-1.0, 1.0, of=redrawn), 9.0 * random.uniform(-2.0, 2.0, of=redrawn)
        random.uniform(of=redrawn)  # a force
        angle_rad = random.uniform(0.0, 2.0 * np.pi, of=redrawn)
        for name, values in (
            ("x_mm", x_mm * (1.0 + case.beyond_mm / 9.0)),
            ("y_mm", y_mm * (1.0 + case.beyond_mm / 18.0)),
            ("angle_rad", angle_rad),
        ):
            touch[name][redrawn] = values[redrawn]
        redrawn &= (np.abs(touch["x_mm"]) <= 9.0) & (np.abs(touch["y_mm"]) <= 18.0) & (case.beyond_mm > 0.0)
    touch["force_N"] = random.uniform(*case.forces_N)
    tangential_N = (FRICTION if case.history == "slides" else case.share) * touch["force_N"]
    return with_tangential(touch, tangential_N, random.uniform(0.0, 2.0 * np.pi), case.history == "held")


def frame_normals(contacts, random):
    """The noise of one touch of each generator, in standard deviations."""
    return random.normal(contacts.tangential_frames * SENSORS)


def judged(contacts, case, touches, which, pads, normals, noise_Pa=None, usable=None):
    """What the firmware estimates of these touches by objects `which` on pads [touch]."""
    base_Pa = contacts.base_Pa(case.layer_mm, case.objects, which, touches, pads, case.overhang_mm)
    profile = contacts.pad_profile(LAYER_mm) if case.profile is None else case.profile
    noise_Pa = contacts.noise_Pa(case.osr) if noise_Pa is None else noise_Pa
    return Judged(touches, which, *contacts.estimated(base_Pa, pads, noise_Pa, normals, profile, usable))


def run(bench, table, case):
    """Cases of one table draw the same touches."""
    contacts = bench.contacts
    unit = np.arange(math.ceil(case.fewer * bench.pads) * UNITS_PER_PAD)
    random, noise = (contacts.random(bench.seed, stream_of(table) + k, unit) for k in (0, 1))
    drawn = []
    for _ in range(TOUCHES):
        touches, which = draw(contacts, case, random), random.below(len(case.objects))
        usable = noise.some_of(SENSORS, case.sensors)
        drawn.append((touches, which, frame_normals(contacts, noise), usable))
    touches, which, normals, usable = (np.concatenate(each) for each in zip(*drawn))
    pads = np.tile(case.pads[unit // UNITS_PER_PAD % len(case.pads)], TOUCHES)
    found = judged(contacts, case, touches, which, pads, normals, usable=usable)
    return found.where(found.found)  # without a positive reading there is nothing to judge


class Judged:
    """Touches, the object of each by its number in the case, the estimates, and whether every frame has a fit."""

    def __init__(self, truth, which, estimate, found):
        self.truth, self.which, self.estimate, self.found = truth, which, estimate, found
        self.valid = estimate["valid"]
        x, y = (truth[name] / truth["force_N"] for name in FORCE_N)
        qx, qy = estimate["qx"], estimate["qy"]
        self.true_ratio, self.ratio = np.hypot(x, y), np.hypot(qx, qy)
        self.vector_error = np.hypot(qx - x, qy - y)
        self.ratio_error = np.abs(self.ratio - self.true_ratio)
        self.direction_error_deg = np.degrees(np.abs(np.arctan2(x * qy - y * qx, x * qx + y * qy)))
        self.location_error_mm = np.hypot(estimate["x_mm"] - truth["x_mm"], estimate["y_mm"] - truth["y_mm"])
        self.gaussian_error_mm = np.hypot(estimate["gaussian_x_mm"] - truth["x_mm"], estimate["gaussian_y_mm"] - truth["y_mm"])

    def where(self, chosen):
        return Judged(self.truth[chosen], self.which[chosen], self.estimate[chosen], self.found[chosen])

    def place(self):
        """Inner: half a pitch inside the outer sensors, where the paper presses; border: within half a pitch of one row of them; corner: of two."""
        at_x, at_y = np.abs(self.truth["x_mm"]) > 4.5, np.abs(self.truth["y_mm"]) > 13.5
        return np.where(at_x & at_y, "corner", np.where(at_x | at_y, "border", "inner"))

    def claims(self, sds):
        """Where the estimate claims a tangential force: above 0.05 and this many standard deviations."""
        return self.valid & (self.ratio > 0.05) & (self.ratio > sds * self.estimate["q_sd"])

    def q_within_percent(self, sds):
        """Of the valid ones, those whose error is within this many standard deviations of a component."""
        return percent((self.vector_error <= sds * self.estimate["q_sd"])[self.valid])

    def location_within_percent(self, sds):
        return percent((self.location_error_mm <= sds * self.estimate["location_sd_mm"])[self.valid])

    def claimed(self):
        """63 and 98 % of a normal distribution in the plane are within 1 and 2 standard deviations times the square root of 2."""
        return {"claimed_percent": percent(self.claims(2.0)), "claimed_surely_percent": percent(self.claims(2.0 * np.sqrt(2.0)))}

    def row(self, name):
        row = {"case": name, "touches": len(self.truth)}
        if not len(self.truth):
            return row
        some = self.valid.any()  # without any there is no figure
        valid = lambda values, share: quantile(values[self.valid], share) if some else None
        force_N = self.truth["force_N"]
        force, gaussian = (np.abs(self.estimate[key] / force_N - 1.0) for key in ("force_N", "gaussian_force_N"))
        row |= {
            "valid_percent": percent(self.valid),
            "elongated_percent": percent(self.estimate["elongated"]),
            "ratio_error_p50": valid(self.ratio_error, 0.5),
            "ratio_error_p95": valid(self.ratio_error, 0.95),
            "vector_error_p50": valid(self.vector_error, 0.5),
            "vector_error_p95": valid(self.vector_error, 0.95),
        }
        row |= {"direction_p90_deg": valid(self.direction_error_deg, 0.9)} if self.true_ratio[0] > 0.0 else self.claimed()
        return row | {
            "location_p50_mm": quantile(self.location_error_mm, 0.5),
            "location_p95_mm": quantile(self.location_error_mm, 0.95),
            "location_without_p50_mm": quantile(self.gaussian_error_mm, 0.5),
            "location_without_p95_mm": quantile(self.gaussian_error_mm, 0.95),
            "force_p50_percent": 100.0 * quantile(force, 0.5),
            "force_p95_percent": 100.0 * quantile(force, 0.95),
            "force_without_p50_percent": 100.0 * quantile(gaussian, 0.5),
            "force_without_p95_percent": 100.0 * quantile(gaussian, 0.95),
            "q_cover_1sd": self.q_within_percent(np.sqrt(2.0)) if some else None,
            "q_cover_2sd": self.q_within_percent(2.0 * np.sqrt(2.0)) if some else None,
            "location_cover_1sd": self.location_within_percent(1.0) if some else None,
            "location_cover_2sd": self.location_within_percent(2.0) if some else None,
        }


def of_all(parts):
    return Judged(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("truth", "which", "estimate", "found")))
