"""How well the fit's numbers state how far they are from the truth.

Touches of the twin's objects on pads go through the firmware's fit with the settings that the firmware starts with. Those under a tangential force
also go through its search for a tangential force that is not estimated (fit_bias.h). The constants of fit_limits.h and defaults.h were chosen with
--seed 1.
"""

import dataclasses
import math

import numpy as np
import sessions
from emulated import CONVERSION_us
from fingertip.files import InputError
from fingertip.line import Flag
from contacts import Contacts, with_tangential
from measure import q10, stream_of
from sessions import SENSORS
from presentation import percent, quantile

TOUCHES = 50  # of each pad
LEARNT_FROM = 20  # touches of a pad that was never calibrated, before those
BAD_mm = 1.0
# Rounded feet, a flat cylinder and a cube, and everyday objects; all of them round or nearly so.
OBJECTS = ("sphere6", "sphere15", "cylinder6", "cube6", "ping_pong", "rubber_duck", "lime")
FORCE_N = (1.0, 15.0)
SEARCH_FRAMES = 6  # FIT_BIAS_PARTS of fit_bias.h
WARNINGS = Flag.UNCERTAIN | Flag.MODEL | Flag.FLAT | Flag.AT_BOUND | Flag.LOW_SIGNAL
OSRS = tuple(CONVERSION_us)


def gaussians(ratio):
    """Contacts that are Gaussians: (sd along, sd across). The shorter is one that 12 mm of rubber makes: 5.4 mm of a point, more of larger objects."""
    return [(shorter_mm * ratio, shorter_mm) for shorter_mm in np.arange(5.25, 7.01, 0.25)]


# Pads of a case: drawn from contacts and random numbers, one for each generator.


def equal(contacts, random):
    return contacts.perfect_pads(len(random.states))


def raw(sd, known_sd=None):
    """Not calibrated: the firmware assumes known_sd, or its default."""
    return lambda contacts, random: contacts.raw_pads(sd, contacts.gain_sd if known_sd is None else known_sd, random)


def aslant(rms):
    """Gains that rise over the pad in one direction: rubber that was cast aslant."""

    def draw(contacts, random):
        pads = contacts.raw_pads(0.0, contacts.gain_sd, random)
        angle = random.uniform(0.0, 2.0 * np.pi)[:, None]
        along = np.cos(angle) * contacts.x_mm + np.sin(angle) * contacts.y_mm
        pads["gain"] = 1.0 + rms * along / np.sqrt(np.mean(along**2, axis=1, keepdims=True))
        return pads

    return draw


def calibrated(pads):
    """What calibrations left of these pads, in turn."""
    return lambda contacts, random: pads[np.arange(len(random.states)) % len(pads)]


@dataclasses.dataclass
class Case:
    """contacts: names of objects, or Gaussians. Cases of one stream draw the same touches."""

    name: str
    contacts: list
    pads: object
    layer_mm: float = 12.0
    angle: float = math.nan  # of the contact; any
    sensors: int = SENSORS  # in use, chosen for each touch
    tangential: tuple = None  # share of the force from the first to the second, in any direction, under a force that stays
    learns: bool = False  # how far the gains are apart, from touches before

    @property
    def stream(self):
        return stream_of(self.name.split(",")[0])


class Bench:
    def __init__(self, contacts, seed, count):
        self.contacts, self.seed, self.count = contacts, seed, count
        self.array, self.x_mm, self.y_mm = contacts.own_array, contacts.x_mm, contacts.y_mm
        self.noises_Pa = np.array([contacts.noise_Pa(osr) for osr in OSRS])

    def draw(self, case, random):
        """One touch of each pad: (touch, contact by its number, noise)."""
        touch = self.contacts.made("twin_touch", self.count)
        touch["x_mm"] = random.uniform(self.x_mm.min(), self.x_mm.max())
        touch["y_mm"] = random.uniform(self.y_mm.min(), self.y_mm.max())
        touch["force_N"] = random.uniform(*FORCE_N)
        angle = random.uniform(0.0, 2.0 * np.pi)
        touch["angle_rad"] = angle if math.isnan(case.angle) else case.angle
        which = random.below(len(case.contacts))
        if case.tangential:
            tangential_N = random.uniform(*case.tangential) * touch["force_N"]
            direction = angle + random.uniform(0.0, 2.0 * np.pi)
            with_tangential(touch, tangential_N, direction)
        return touch, which, self.noises_Pa[random.below(len(OSRS))]

    def base_Pa(self, case, touch, which):
        """[touch][sensor]"""
        if isinstance(case.contacts[0], str):
            return self.contacts.base_Pa(case.layer_mm, case.contacts, which, touch)
        sd_mm = np.array(case.contacts)[which]
        dx, dy = self.x_mm - touch["x_mm"][:, None], self.y_mm - touch["y_mm"][:, None]
        c, s = np.cos(touch["angle_rad"])[:, None], np.sin(touch["angle_rad"])[:, None]
        u, v = (c * dx + s * dy) / sd_mm[:, :1], (c * dy - s * dx) / sd_mm[:, 1:]
        peak_Pa = 1e6 * touch["force_N"] / (2.0 * np.pi * sd_mm.prod(axis=1))
        return peak_Pa[:, None] * np.exp(-0.5 * (u * u + v * v))

    def learn(self, case, of, random):
        """The pads' sds as the firmware has them after these touches."""
        gains, sd = self.contacts.made("fit_gains", self.count), of["gain_sd"][:, 0].copy()
        self.contacts.call("gains_begin", sd, gains)
        for _ in range(LEARNT_FROM):
            touch, which, noise_Pa = self.draw(case, random)
            base_Pa = of["gain"] * self.base_Pa(case, touch, which)
            for is_first in (1, 0):
                readings = q10(base_Pa + noise_Pa[:, None] * random.normal(SENSORS))
                settings = self.contacts.settings(self.count, noise_Pa=noise_Pa, gain_sd=np.repeat(sd[:, None], SENSORS, axis=1))
                found = self.contacts.fit(self.array, settings, readings, kernel="fit_grid")
                self.contacts.call("gains_learn", self.array, settings, readings, found, is_first, gains, sd)
        of["gain_sd"][:] = sd[:, None]

    def run(self, case, iterations=(4,)):
        """What the fit finds, for each number of iterations."""
        pad = np.arange(self.count)
        random = self.contacts.random(self.seed, case.stream, pad)
        of = case.pads(self.contacts, random)
        if case.learns:
            self.learn(case, of, self.contacts.random(self.seed, case.stream + 1, pad))
        frames = 1 + SEARCH_FRAMES * bool(case.tangential)  # held until the firmware has searched for a tangential force
        drawn = []
        for _ in range(TOUCHES):
            touch, which, noise_Pa = self.draw(case, random)
            first = random.normal(SENSORS)
            usable = random.some_of(SENSORS, case.sensors)
            normals = [first] + [random.normal(SENSORS) for _ in range(frames - 1)]
            base_Pa = of["gain"] * self.base_Pa(case, touch, which)
            readings = q10(base_Pa[:, None] + noise_Pa[:, None, None] * np.stack(normals, axis=1))
            drawn.append((touch, noise_Pa, usable, readings))
        touch, noise_Pa, usable, readings = (np.concatenate(each) for each in zip(*drawn))
        settings = self.contacts.settings(len(touch), noise_Pa=noise_Pa, gain_sd=np.tile(of["gain_sd"], (TOUCHES, 1)))
        if case.name == "noise only":  # the model has no error of its own
            settings["model_sd_q16"] = 0
        print(f"truth_fit: {case.name}", flush=True)
        for settings["iterations"] in iterations:
            yield Results(touch, self.contacts.fit_held(self.array, settings, readings, usable))

    def row(self, case):
        (results,) = self.run(case)
        return results, {"case": case.name} | results.row()


class Results:
    """Of the touches that have a fit: some positive reading among the sensors in use."""

    def __init__(self, touch, found):
        valid = found["flags"] & Flag.FIT_VALID > 0
        touch, self.found = touch[valid], found[valid]
        self.error_mm = np.hypot(self.found["x_mm"] - touch["x_mm"], self.found["y_mm"] - touch["y_mm"])
        self.force_N = touch["force_N"]
        self.bad = self.error_mm > BAD_mm

    def flagged(self, flags):
        return self.found["flags"] & flags > 0

    def silent_percent(self, flags=WARNINGS, bad_mm=BAD_mm):
        return percent((self.error_mm > bad_mm) & ~self.flagged(flags))

    def covered(self, sds):
        """Share of the errors within this number of predicted standard deviations."""
        return percent(self.error_mm <= sds * self.found["location_sd_mm"].astype(float))

    def row(self):
        force_N, sd_N = self.found["force_N"].astype(float), self.found["force_sd_N"].astype(float)
        scale = quantile(self.force_N / force_N, 0.5)
        force_off_N = np.abs(scale * force_N - self.force_N)  # once the scale that all touches have in common is taken out
        return {
            "touches": len(self.error_mm),
            "error_p50_mm": quantile(self.error_mm, 0.5),
            "error_p95_mm": quantile(self.error_mm, 0.95),
            "cover_1sd": self.covered(1.0),
            "cover_2sd": self.covered(2.0),
            "warned": percent(self.flagged(WARNINGS)),
            "elongated": percent(self.flagged(Flag.ELONGATED)),
            "bad": percent(self.bad),
            "bad_unflagged": self.silent_percent(),
            "force_scale": scale,
            "force_cover_1sd": percent(force_off_N <= scale * sd_N),
            "force_cover_2sd": percent(force_off_N <= 2.0 * scale * sd_N),
        }


def coverage(bench, of, out):
    first = ", first touch"
    thick, thin = {"contacts": OBJECTS}, {"contacts": OBJECTS, "layer_mm": 6.0}
    # Name, what differs, and whether the standard deviations are to hold here.
    cases = (
        ("noise only", {"contacts": gaussians(1.0), "pads": equal}, True),
        ("12 mm, equal gains", thick | {"pads": equal}, True),
        ("12 mm, gains 5 %", thick | {"pads": raw(0.05, 0.05)}, True),
        ("12 mm, gains 10 %" + first, thick | {"pads": raw(0.10)}, True),
        ("12 mm, gains 10 %", thick | {"pads": raw(0.10), "learns": True}, True),
        ("12 mm, gains 20 %" + first, thick | {"pads": raw(0.20)}, False),
        ("12 mm, gains 20 %", thick | {"pads": raw(0.20), "learns": True}, True),
        ("12 mm, gains aslant by 10 %" + first, thick | {"pads": aslant(0.10)}, False),
        ("12 mm, gains aslant by 10 %", thick | {"pads": aslant(0.10), "learns": True}, True),
        ("12 mm, calibrated", thick | {"pads": of}, True),
        ("6 mm, equal gains", thin | {"pads": equal}, True),
        ("6 mm, gains 10 %", thin | {"pads": raw(0.10), "learns": True}, False),
    )
    prefixes = {"12 mm, calibrated": "cal", "12 mm, gains 10 %": "raw", "12 mm, gains 20 %": "raw_20"}
    covers = []
    out["cases"] = []
    for name, what, covers_here in cases:
        results, row = bench.row(Case(name, **what))
        out["cases"].append(row)
        covers += [row] * covers_here
        if name in prefixes:
            out[f"{prefixes[name]}_warned_percent"] = row["warned"]
            out[f"{prefixes[name]}_bad_unflagged_percent"] = row["bad_unflagged"]
        if name == "12 mm, calibrated":
            out["round_elongated_percent"] = percent(~results.bad & results.flagged(Flag.ELONGATED))
    out["cover_1sd_min"] = min(row["cover_1sd"] for row in covers)
    out["cover_1sd_max"] = max(row["cover_1sd"] for row in covers)
    out["cover_2sd_min"] = min(row["cover_2sd"] for row in covers)


def tangential(bench, of, out):
    """Without a pad's profile, so the tangential force is not estimated. Without one: what the search for it costs."""
    kinds = (
        ("12 mm, calibrated", 12.0, of, False),
        ("12 mm, gains 10 %", 12.0, raw(0.10), True),
        ("6 mm, equal gains", 6.0, equal, False),
        ("6 mm, gains 10 %", 6.0, raw(0.10), True),
    )
    out["loaded"] = []
    for k, (kind, layer_mm, drawn, learns) in enumerate(kinds):
        for least, most in ((0.0, 0.0), (0.1, 0.1), (0.2, 0.2), (0.3, 0.3), (0.5, 0.5), (0.0, 0.5)):
            (results,) = bench.run(Case(f"loaded, {kind}", OBJECTS, drawn, layer_mm, tangential=(least, most), learns=learns))
            row = {"case": f"{kind}, Q/F {least:g}" + (f" to {most:g}" if least < most else "")} | results.row()
            out["loaded"].append(row)
            if k < 2:
                prefix = ("", "raw_")[k]
                if least < most:
                    out[prefix + "loaded_silent_percent"] = row["bad_unflagged"]
                elif most == 0.0:
                    out[prefix + "unloaded_warned_percent"] = row["warned"]


def elongated(bench, of, out):
    shapes = (
        ("sigma ratio 1.2", gaussians(1.2)),
        ("sigma ratio 1.3", gaussians(1.3)),
        ("sigma ratio 2", gaussians(2.0)),
        ("cylinder 6 x 12 mm", ["cylinder6x12"]),
        ("edge of 20 mm", ["edge20"]),
    )
    out["elongated"] = []
    for shape, contacts in shapes:
        for angle in (None, 0, 34, 45, 90):
            name = "any angle" if angle is None else f"{angle} degrees"
            (results,) = bench.run(Case(f"{shape} at {name}", contacts, of, angle=math.nan if angle is None else math.radians(angle)))
            silent = results.silent_percent(WARNINGS | Flag.ELONGATED)
            out["elongated"].append({"case": f"{shape}, {name}"} | results.row() | {"bad_and_neither_warned_nor_elongated": silent})
    out["elongated_bad_unflagged_percent"] = max(row["bad_and_neither_warned_nor_elongated"] for row in out["elongated"])


def iterations(bench, of, out):
    out["iterations"] = []
    for layer_mm in (12, 6):
        for gain_percent in (0.0, 10.0):
            name = f"{layer_mm} mm iterated" + (" with gains 10 %" if gain_percent else "")
            sd = gain_percent / 100.0
            counts = range(3, 9)
            for count, results in zip(counts, bench.run(Case(name, OBJECTS, raw(sd, sd), layer_mm), counts)):
                about = {"iterations": count, "layer_mm": layer_mm, "gain_percent": gain_percent}
                out["iterations"].append({"case": f"{name}, {count}"} | results.row() | about)


def few_sensors(bench, of, out):
    out["few_sensors"] = []
    for layer_mm in (12, 6):
        for sensors in (4, 5, 6, 8, 14):
            results, row = bench.row(Case(f"{layer_mm} mm with sensors missing, {sensors}", OBJECTS, of, layer_mm, sensors=sensors))
            out["few_sensors"].append(row | {"sensors": sensors, "off_by_2_mm_unflagged": results.silent_percent(bad_mm=2.0)})


PARTS = (coverage, tangential, elongated, iterations, few_sensors)


def figures(firmware, options, parts=PARTS):
    count = 1500 if options.pads is None else options.pads
    if count < 1:
        raise InputError("--pads needs at least one pad")
    bench = Bench(Contacts(firmware.build), 20221015 if options.seed is None else options.seed, count)
    out = {}
    of = calibrated(bench.contacts.calibrated_for(count, sessions.USUAL, bench.seed))
    for part in parts:
        part(bench, of, out)
    return out
