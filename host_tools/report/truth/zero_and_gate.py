"""Whether the zero follows drifts and nothing else, and whether the gate reports every contact and no other.

Simulated pads at the rates and with the noise of each board and oversampling, and recordings of real strips (strips.py), through the firmware's
condition and fit. A contact is a Gaussian of 5.7 mm, the width of most objects under 12 mm of rubber: the zero is judged here, not the shape.
"""

from concurrent.futures import ThreadPoolExecutor

import boards
import numpy as np
import strips
from emulated import CONVERSION_us
from sessions import SENSORS

SIGMA_mm, FORCE_N = 5.7, 5.0
AMBIENT_Pa, OFFSET_SD_Pa = 101325.0, 500.0
DRIFT_Pa, DRIFT_s = (130.0, 210.0), 960.0
# The worked example of the datasheet; parts differ by 3 % as the player's do.
COEFFICIENTS, PROM_SPREAD = (46372, 43981, 29059, 27842, 31553, 28165), 0.03
CALM_s, HOUR_s, TEN_MINUTES_s = 60.0, 3600.0, 600.0
RAMPS_N_s = (0.005, 0.02, 0.1)
RECOVERED_Pa, RECOVERY_WATCHED_s = 30.0, 10.0
# Begin, rate, rise and time constant. A hand warms 12 mm of silicone rubber by 6 K, as in the twin.
TEMPERATURES = {
    "an hour of drift, warming by 6 K": (HOUR_s, (25.0, 0.0, 6.0, 486.0)),
    "from 5 to 25 degC": (200.0, (5.0, 0.1, 0.0, 1.0)),
    "from 25 to 5 degC": (200.0, (25.0, -0.1, 0.0, 1.0)),
}
RETURN_TIMES_s, REMAINS_AFTER_s = (0.5, 1.0, 2.0, 5.0, 10.0), (1.0, 10.0)
REMAINS = (-0.15, -0.09, -0.03, 0.004, 0.03, 0.08)  # of the press, after it
LEFT_SHARES = (0.02, 0.05, 0.1, 0.2)  # of the force
# Above a sensor, between two and between four; further ones are drawn.
LOCATIONS_mm = ((4.5, 4.5), (0.0, 0.0), (4.5, 0.0), (-4.5, -13.5))
OFFSET, DRIFT, PROM, LOCATION, REMAINING = 301, 302, 303, 311, 313  # streams of random numbers
CONTACT, DOUBTFUL = 1, 2  # flags of gate.cpp


def modes(firmware):
    """(board, OSR, frames per second, noise) of every board at every oversampling."""
    for board in sorted(boards.DESCRIPTORS):
        for osr in CONVERSION_us:
            conversion_us, noise_Pa_q10 = firmware.osr(osr)
            yield board, osr, 1e6 / (boards.DESCRIPTORS[board]["overhead_us"] + conversion_us), noise_Pa_q10


def location_of(firmware, seed, pad):
    if pad < len(LOCATIONS_mm):
        return LOCATIONS_mm[pad]
    random = firmware.random(seed, LOCATION, [pad])
    return random.uniform(-6.75, 6.75), random.uniform(-13.5, 13.5)


def pressed(firmware, x_mm, y_mm):
    """Pressure of the contact on each sensor."""
    x, y, _ = firmware.layout()
    peak_Pa = 1e6 * FORCE_N / (2.0 * np.pi * SIGMA_mm**2)
    return peak_Pa * np.exp(-0.5 * ((x - x_mm) ** 2 + (y - y_mm) ** 2) / SIGMA_mm**2)


class Pad:
    """A simulated pad of the firmware, from rest on."""

    def __init__(self, firmware, mode, seed, drifts=False, temperature=()):
        self.firmware = firmware
        _, _, self.frames_per_s, self.noise_Pa_q10 = mode
        sensors = np.arange(SENSORS)
        offset_Pa = AMBIENT_Pa + OFFSET_SD_Pa * firmware.random(seed, OFFSET, sensors).normal()
        drift = firmware.random(seed, DRIFT, sensors)
        drift_Pa_s = np.where(drift.uniform() < 0.5, -1.0, 1.0) * drift.uniform(*DRIFT_Pa) / DRIFT_s
        prom = firmware.random(seed, PROM, sensors)
        spread = np.stack([prom.uniform(-PROM_SPREAD, PROM_SPREAD) for _ in COEFFICIENTS], axis=1)
        coefficients = (np.array(COEFFICIENTS) * (1.0 + spread)).astype(np.uint16)
        self.pad = firmware.made("gate_pad", 1)
        firmware.call(
            "gate_begin",
            seed,
            self.frames_per_s,
            self.noise_Pa_q10,
            offset_Pa,
            drift_Pa_s * drifts,
            np.array(temperature, float),
            coefficients,
            self.pad,
        )

    def run(self, seconds, contact_Pa=None, share=(1.0, 1.0, 1.0), remains_Pa=None, decay_s=1.0, watch=""):
        """Under a contact whose share goes from the first to the second within the third, in s. watch: "flags", "zero" or "readings", which it
        returns with the time of each frame."""
        none = np.zeros(SENSORS)
        frames = round(seconds * self.frames_per_s)
        watched = {
            "flags": np.zeros(frames * (watch == "flags"), np.uint8),
            "zero": np.zeros(frames * (watch == "zero"), np.float32),
            "readings": np.zeros((frames * (watch == "readings"), len(none)), np.int32),
        }
        self.firmware.call(
            "gate_run",
            self.pad,
            frames,
            none if contact_Pa is None else contact_Pa,
            np.array(share),
            none if remains_Pa is None else remains_Pa,
            decay_s,
            *watched.values(),
        )
        return np.arange(1, frames + 1) / self.frames_per_s, watched.get(watch)

    def force_error_percent(self, contact_Pa):
        """Of the mean force over 0.2 s; without a contact or a fit it is 0."""
        _, readings = self.run(0.2, contact_Pa, watch="readings")
        settings = self.firmware.settings(gain_sd=0.0, model_sd=0.0, noise_Pa_q10=self.noise_Pa_q10)
        force_N = self.firmware.fit(self.firmware.array(), settings, readings)["force_N"]
        return 100.0 * abs(force_N.astype(float).mean() / FORCE_N - 1.0)


class Judge:
    def __init__(self, firmware, seed, pads):
        self.firmware, self.seed, self.pads, self.out = firmware, seed, pads, {}
        self.modes = [mode for mode in modes(firmware) if pads > 1 or mode[1] == 8192]

    def pad(self, mode, pad, **options):
        return Pad(self.firmware, self.modes[mode], self.seed + 1000 * mode + pad, **options)

    def contact_Pa(self, pad):
        return pressed(self.firmware, *location_of(self.firmware, self.seed, pad))

    def judge(self, table, cases, work, rows):
        """Of every mode and case: work(mode, *case) -> numbers, whose worst by group go into the table's rows. rows: names of the numbers.
        cases: {group, the columns of its row as a dict: [the arguments of each case]}. Returns the worst of the first number."""
        print(f"truth_gate: {table}", flush=True)
        jobs = [(mode, *case) for mode in range(len(self.modes)) for _, group in cases for case in group]
        with ThreadPoolExecutor(2) as pool:
            found = iter(list(pool.map(lambda job: np.atleast_1d(work(*job)), jobs)))
        self.out[table] = []
        for board, osr, frames_per_s, _ in self.modes:
            for columns, group in cases:
                worst = np.max([next(found) for _ in group], axis=0)
                row = {"board": board, "osr": osr, "frames_per_s": frames_per_s} | columns
                self.out[table].append(row | dict(zip(rows, worst.tolist())))
        return max(row[rows[0]] for row in self.out[table])

    def slow_forces(self):
        def ramp(mode, number, N_s):
            pad, contact_Pa = self.pad(mode, number), self.contact_Pa(number)
            pad.run(CALM_s)
            pad.run(FORCE_N / N_s, contact_Pa, (0.0, 1.0, FORCE_N / N_s))
            return pad.force_error_percent(contact_Pa)

        def hold(mode, number):
            pad, contact_Pa = self.pad(mode, number, drifts=True), self.contact_Pa(number)
            pad.run(CALM_s)
            pad.run(HOUR_s, contact_Pa)
            return pad.force_error_percent(contact_Pa)

        numbers = range(self.pads)
        ramps = self.judge("ramps", [({"N_s": N_s}, [(n, N_s) for n in numbers]) for N_s in RAMPS_N_s], ramp, ["worst_percent"])
        holds = self.judge("hour_holds", [({"calm_s": CALM_s}, [(n,) for n in numbers])], hold, ["worst_percent"])
        self.out["slow_force_error_percent"] = max(ramps, holds)

    def rest(self):
        """Contacts that began although nothing touched, doubted or not."""

        def contacts(mode, number, name):
            seconds, temperature = TEMPERATURES[name]
            _, flags = self.pad(mode, number, drifts=number == 0, temperature=temperature).run(seconds, watch="flags")
            return np.count_nonzero(np.diff(flags & CONTACT, prepend=0) == 1)

        self.judge("rest", [({"case": name}, [(i, name)]) for i, name in enumerate(TEMPERATURES)], contacts, ["contacts"])
        self.out["false_contacts"] = sum(row["contacts"] for row in self.out["rest"])

    def recovery(self):
        """Time from the release until no zero is off by more than RECOVERED_Pa, for good."""

        def wrong_s(mode, number):
            kind = (mode * self.pads + number) % 4
            pad = self.pad(mode, number, drifts=True)
            pad.run(5.0 if kind % 2 == 0 else CALM_s)
            pad.run(TEN_MINUTES_s, self.contact_Pa(number) * (1.0 if kind < 2 else 0.1))
            t_s, error_Pa = pad.run(RECOVERY_WATCHED_s, watch="zero")
            return np.max(t_s[error_Pa > RECOVERED_Pa], initial=0.0)

        self.out["zero_recovery_s"] = self.judge("recovery", [({}, [(n,) for n in range(self.pads)])], wrong_s, ["worst_s"])

    def remains(self):
        """After a press every sensor is off by up to a share of what it measured, which decays."""

        def of_press(mode, share, decay_s, hold_s):
            pad, contact_Pa = self.pad(mode, 0), self.contact_Pa(0)
            uneven = self.firmware.random(self.seed, REMAINING, np.arange(SENSORS)).uniform(0.5, 1.0)
            pad.run(CALM_s)
            pad.run(hold_s, contact_Pa, (0.0, 1.0, 0.2))
            t_s, flags = pad.run(40.0, contact_Pa, (1.0, 0.0, 0.1), share * uneven * contact_Pa, decay_s, "flags")
            late = t_s > 0.3
            certain = late & (flags == CONTACT)
            longest_s = np.max(t_s - np.maximum.accumulate(np.where(certain, 0.0, t_s)))
            contact_s = np.count_nonzero(late & (flags & CONTACT > 0)) / pad.frames_per_s
            pad.run(0.5, contact_Pa, (0.0, 1.0, 0.2))
            return longest_s, contact_s, pad.force_error_percent(contact_Pa)

        cases = [
            ({"share": share}, [(share, decay_s, hold_s) for decay_s in RETURN_TIMES_s for hold_s in REMAINS_AFTER_s]) for share in REMAINS
        ]
        columns = ["phantom_longest_s", "contact_s", "next_force_error_percent"]
        self.out["phantom_force_longest_s"] = self.judge("after_press", cases, of_press, columns)

    def left_forces(self):
        """A share of the force that is left for a minute: certain, doubted, or neither."""

        def left(mode, share):
            pad, contact_Pa = self.pad(mode, 0), self.contact_Pa(0)
            pad.run(CALM_s)
            pad.run(5.0, contact_Pa)
            t_s, flags = pad.run(60.0, contact_Pa, (1.0, share, 0.3 * (1.0 - share)), watch="flags")
            flags = flags[t_s > 0.5]
            return 100.0 * np.mean(flags == CONTACT), 100.0 * np.mean(flags & DOUBTFUL > 0)

        cases = [({"share": share}, [(share,)]) for share in LEFT_SHARES]
        self.judge("left_forces", cases, left, ["certain_percent", "doubted_percent"])


def figures(firmware, options):
    pads = 8 if options.pads is None else options.pads
    judge = Judge(firmware, 20230706 if options.seed is None else options.seed, pads)
    if pads > 0:
        for part in (judge.slow_forces, judge.rest, judge.recovery, judge.remains, judge.left_forces):
            part()
    return judge.out | strips.judge(firmware, options.recordings)
