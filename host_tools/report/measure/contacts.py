"""Contacts on pads of the twin, and what the firmware estimates of them: what the reports shear and two have in common.

Touches are the records twin_touch, pads those of Contacts.pad. Arrays have a row for each touch: `pads` its pad, `which` its contact shape of a list,
`normals` its noise in standard deviations. Readings are relative to the true zero: what condition does to them is left out.
"""

import functools

import numpy as np
import sessions
from fingertip.files import FIT_VALID
from measure import Measure, q10, stream_of
from sessions import SENSORS

FORCE_N = ("pull_x_N", "pull_y_N")  # the tangential force of a twin_touch
AMBIENT_Pa, FRICTION = 101325.0, 0.5  # of the twin; of the contacts
WAITED = 1.05  # of the longest conversion: what the firmware waits


def with_tangential(touch, tangential_N, direction, held=True):
    for name, share in zip(FORCE_N, (np.cos(direction), np.sin(direction))):
        touch[name] = tangential_N * share
    touch["stuck_N"] = stuck_N(touch["force_N"], tangential_N) if held else 0.0
    return touch


def stuck_N(force_N, tangential_N):
    """The force whose contact sticks after the tangential force has risen to this under a constant normal one."""
    return np.maximum(0.0, force_N - tangential_N / FRICTION)


class Contacts(Measure):
    def __init__(self, build):
        super().__init__(build)
        self.own_array = self.array()
        self.x_mm, self.y_mm, _ = self.layout()
        constants = self.constants
        self.tangential_frames, self.shapes_frames = (int(constants[name]) for name in ("tangential_frames", "shapes_frames"))
        self.gain_sd, self.location_sd_limit_mm = float(constants["default_gain_sd"]), float(constants["location_sd_limit_mm"])
        self.max_pressure_Pa = float(constants["sensor_max_pressure_Pa"])
        self.pad = np.dtype(
            [
                # Factors of readings: what is left after the calibration of a calibrated pad; the standard deviation is the firmware's.
                ("gain", float, SENSORS),
                ("gain_sd", float, SENSORS),
                ("force_scale", float),  # force over 2 pi p0 sigma^2; 0: not calibrated
                # What the calibration found.
                ("dip_share", float),
                ("dip_sd_mm", float),
                ("deviations", self.records["fit_deviation"], SENSORS),
                # How the pad is cast.
                ("cast_dip_share", float),
                ("seat", self.records["twin_seat"], SENSORS),
            ]
        )

    def noise_Pa(self, ratio):
        return self.osr(ratio)[1] / 1024.0

    def conversion_s(self, ratio):
        """The longest."""
        return 1e-6 * round(self.osr(ratio)[0] / WAITED)

    @functools.cache
    def pad_profile(self, thickness_mm, overhang_mm=0.0):
        """With an overhang, with the effect of the pad's ends as well."""
        profile = self.profile(thickness_mm)
        if overhang_mm:
            self.call("add_ends", overhang_mm, self.contact_tables, profile)
        return profile

    # Pads.

    def perfect_pads(self, count):
        pads = np.zeros(count, self.pad)
        pads["gain"] = pads["seat"]["width"] = 1.0
        return pads

    def raw_pads(self, spread, known_sd, random):
        """Gains as cast, normal about 1 within three standard deviations, and no calibration; a pad of each generator."""
        pads = self.perfect_pads(len(random.states))
        for k in range(SENSORS):
            outside = np.ones(len(pads), bool)
            while outside.any():
                sigmas = random.normal(of=outside)
                pads["gain"][outside, k] = 1.0 + spread * sigmas[outside]
                outside &= np.abs(sigmas) > 3.0
        pads["gain_sd"] = known_sd
        return pads

    def calibrated_pads(self, kinds, seeds):
        """Each as a good session of placements calibrates it, without a force scale; the kinds (sessions.py) take turns."""
        kinds = sessions.kinds(self, *kinds)[np.arange(len(seeds)) % len(kinds)]
        pads, session = self.perfect_pads(len(seeds)), sessions.Session.of(self, len(seeds))
        truth = np.empty((len(seeds), SENSORS)), np.empty(len(seeds)), self.made("twin_seat", len(seeds), SENSORS)
        found = (session.found, session.sensors, session.deviations)
        self.call("pad_calibrated", kinds, sessions.LAYER_mm, self.contact_tables, seeds, *found, *truth)
        pads["gain"], pads["gain_sd"] = truth[0] / session.sensors["gain"], session.sensors["reading_sd"]
        pads["deviations"], pads["cast_dip_share"], pads["seat"] = session.deviations, *truth[1:]
        for name in ("dip_share", "dip_sd_mm"):
            pads[name] = session.found[name]
        return pads

    def calibrated_for(self, judged, kinds, seed):
        """One for every ten pads that are judged, a hundred at most."""
        count = min(max(judged // 10, 1), 100)
        return self.calibrated_pads(kinds, self.random(seed, stream_of("calibrated sessions"), np.arange(count)).bits())

    def learned_thickness(self, kinds, seeds):
        """mm, standard deviation, and rounded as the tool shows it: what the width of the response shows in sessions of 24 placements."""
        kinds = sessions.kinds(self, *kinds)[np.arange(len(seeds)) % len(kinds)]
        found = sessions.placements(self, "good", kinds, seeds, sessions.LAYER_mm, 24).calibrated().found
        figures = np.zeros((len(seeds), 3))
        self.call("thickness", *(np.ascontiguousarray(found[name]) for name in ("width_mm", "sigma_sd_mm")), figures)
        return figures.T

    def gains_only(self, pads):
        """What calibrations have left of the gains, on any layer."""
        found = self.perfect_pads(len(pads))
        for name in ("gain", "gain_sd"):
            found[name] = pads[name]
        return found

    # Contacts.

    def base_Pa(self, layer_mm, shapes, which, touches, pads=None, overhang_mm=None):
        """Pressures on the base [touch, sensor]. pads: [touch], or perfect ones; overhang_mm: of rubber that ends."""
        base_Pa = np.empty((len(touches), SENSORS))
        for k, name in enumerate(shapes):
            some = which == k
            cast, own_touches = {}, touches[some]
            if pads is not None:
                cast = {"dip_share": pads["cast_dip_share"][some], "seats": pads["seat"][some]}
            base = self.base_pressure(name, layer_mm, own_touches, shape=sessions.shape(self, name), **cast)
            if overhang_mm is not None:
                self.call("add_block", name, layer_mm, overhang_mm, self.contact_tables, own_touches, base)
            base_Pa[some] = base
        return base_Pa

    def settings_of(self, pads, noise_Pa):
        """As the firmware has them where a profile is set, for each pad."""
        of_pads = {name: pads[name] for name in ("gain_sd", "dip_share", "dip_sd_mm")}
        return self.settings(len(pads), noise_Pa=noise_Pa, clip_below_sds=0, **of_pads)

    def deviations_of(self, pads):
        """None where no calibration has found any."""
        deviations = np.ascontiguousarray(pads["deviations"])
        return deviations if np.any(deviations.view(np.int32)) else None

    def readings_Pa(self, base_Pa, pads, noise_Pa, normals):
        """[touch, frame, sensor] of pads [touch]."""
        frames = normals.reshape(len(base_Pa), -1, SENSORS)
        return (pads["gain"] * base_Pa)[:, None] + np.reshape(noise_Pa, (-1, 1, 1)) * frames

    def estimated(self, base_Pa, pads, noise_Pa, normals, profile, usable=None):
        """(published, found) of touches that hold still, on pads [touch]. A reading above the sensor's range is left out of the fit. found: every
        frame has a fit."""
        readings_Pa = self.readings_Pa(base_Pa, pads, noise_Pa, normals)
        saturated = ((readings_Pa > self.max_pressure_Pa - AMBIENT_Pa) << np.arange(SENSORS)).sum(axis=2).astype(np.uint64)
        settings, deviations = self.settings_of(pads, noise_Pa), self.deviations_of(pads)
        fits, estimates = self.tangential(self.own_array, profile, settings, q10(readings_Pa), usable, saturated, deviations=deviations)
        exact = profile.view(f"V{profile.itemsize}").copy().view(profile.dtype)  # with the pad's ends, which are no fields of the record
        exact["tangential_scale_sd"] = 0.0
        published, last = self.made("published", len(base_Pa)), (np.ascontiguousarray(each[:, -1]) for each in (fits, estimates))
        self.call("publish", exact, np.ascontiguousarray(pads["force_scale"]), 0.0, *last, published)
        found = (fits["flags"] & FIT_VALID > 0).all(axis=1)
        published[~found] = 0
        return published, found

    def held_shapes(self, readings_Pa, pads, noise_Pa, published, profile, hysteresis_sd_Pa=0.0):
        """(fit_shapes_result, shapes_location), each [touch, first or last], of contacts [touch, frame, sensor]."""
        pad = self.made("fit_shapes_pad", 1)
        self.call("shapes_pad", self.own_array, profile, pad)
        deviations = self.deviations_of(pads)
        found = self.made("fit_shapes_result", len(readings_Pa), 2), self.made("shapes_location", len(readings_Pa), 2)
        settings = self.settings_of(pads, noise_Pa)
        settings["hysteresis_sd_Pa_q10"][:, :SENSORS] = q10(hysteresis_sd_Pa)
        readings = q10(readings_Pa), self.usable(readings_Pa), published
        self.call("held_shapes", self.own_array, pad, settings, deviations, *readings, *found)
        return found

    def motion_flags(self, ends, t_us, readings_Pa, pads, noise_Pa, pressed, profile):
        """Flags of the frames of runs, each of which ends before one of `ends`, on pads [run]."""
        pad, flags = self.made("fit_pad", 1), np.zeros(len(t_us), np.uint32)
        self.call("tangential_pad", self.own_array, profile, pad)
        self.call("motion_flags", self.own_array, pad, self.settings_of(pads, noise_Pa), ends, t_us, q10(readings_Pa), pressed, flags)
        return flags

    def rubber(self, effects, layer_mm, seeds, t_s, base_Pa):
        """What pads with these effects of the twin report [pad, time, sensor] of pressures on their bases."""
        reported_Pa = np.empty(base_Pa.shape)
        self.call("rubber", effects, layer_mm, seeds, t_s, base_Pa, reported_Pa)
        return reported_Pa


class Scenario:
    """A scenario of the twin. phases: scenario_phase, times from the beginning of the act; last_s: how long each act takes."""

    def __init__(
        self, contacts, kind, contact_shape, layer_mm, seed, seconds, kinetic_share=0.8, dead_travel_mm=1.0, margin_mm=-1.0, **texts
    ):
        self.contacts, self.contact_shape = contacts, contact_shape
        options = contacts.made("scenario_options", 1)
        given = {"kind": kind, "contact_shape": contact_shape, "layer_mm": layer_mm, "seed": seed, "seconds": seconds, **texts}
        given |= {"kinetic_share": kinetic_share, "dead_travel_mm": dead_travel_mm, "margin_mm": margin_mm}
        for name, value in given.items():
            options[name] = value
        facts = np.zeros(3, np.int64)
        contacts.call("scenario_begin", options, contacts.contact_tables, facts)
        self.number, act_count, phase_count = map(int, facts)
        self.last_s, self.phases = np.zeros(act_count), contacts.made("scenario_phase", phase_count)
        contacts.call("scenario_phases", self.number, self.last_s, self.phases)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.contacts.call("scenario_end", self.number)

    def touches(self, act, t_s):
        """The first contact of each act at the time from its beginning."""
        touches = self.contacts.made("twin_touch", len(t_s))
        self.contacts.call("scenario_touches", self.number, np.ascontiguousarray(act, np.int64), np.ascontiguousarray(t_s, float), touches)
        return touches
