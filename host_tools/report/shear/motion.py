"""What separates a slide from a lift, and how soon: objects that are lifted, carried and slip.

Lifts and slides of the twin go frame by frame through the firmware's fit and estimate of the tangential force into eq. (7) ("eq7"), the
least-squares velocity ("moving") and contact/motion.h ("sliding"). The constants of motion.c were chosen with seeds 201 to 224 of the twin
on pads of 12 mm.
"""

import dataclasses
import math

import numpy as np
from contacts import Scenario
from fingertip.files import MOVING, SLIDING, SLIP
from measure import round_half_away
from sessions import SENSORS, TEN_PERCENT
from presentation import quantile

DETECTORS = {"eq7": SLIP, "moving": MOVING, "sliding": SLIDING}
DURATIONS_s = {"100ms": 0.1, "300ms": 0.3, "1s": 1.0}
CALIBRATIONS = 40
# A slip that is one to the user, and one that the velocity's threshold leaves out.
WAY_MIN_mm, FAST_mm_s = 0.5, 8.0
JOINED_s = 0.03  # what goes on after less rest is one slip
SHOWN_mm = 0.1
# A detector that reports this long after a slip still means it, and this long before one, its beginning: by then more than nine tenths of
# the contact slide.
LATE_s, EARLY_s = 0.08, 0.02
GAINS_STREAM, NOISE_STREAM = 701, 702
GATE_NOISES = 8.0  # a sensor is pressed from here on: the gate of a quiet pad without any drift
START_QUIET_s, LONGEST_s = 1.5, {"lift": 6.5, "slide": 14.0}  # of the twin's scenarios


@dataclasses.dataclass
class Case:
    name: str
    pad: str = "cal"  # gains: equal; cal: 10 % spread after a calibration; raw5, raw10: that spread, never calibrated
    osr: int = 1024
    rate_Hz: float = 410.0
    layer_mm: float = 12.0
    dead_travel_mm: float = 1.0
    kinetic_share: float = 0.8
    lift_tangential: str = "0.1..0.4"
    lift_friction: str = "0.5"


CASES = (
    Case("usual: cal, 12 mm, OSR 1024 at 410 Hz"),
    Case("equal", pad="equal"),
    Case("raw5", pad="raw5"),
    Case("raw10", pad="raw10"),
    Case("OSR 256 at 1308 Hz", osr=256, rate_Hz=1308.0),
    Case("raw10, OSR 256 at 1308 Hz", pad="raw10", osr=256, rate_Hz=1308.0),
    Case("200 Hz", rate_Hz=200.0),
    Case("100 Hz", rate_Hz=100.0),
    Case("20 Hz", rate_Hz=20.0),
    Case("9 mm", layer_mm=9.0),
    Case("15 mm", layer_mm=15.0),
    Case("dead travel 2 mm", dead_travel_mm=2.0),
    Case("dead travel 0.2 mm", dead_travel_mm=0.2),
    Case("friction that does not fall", kinetic_share=1.0),
    Case("lifts of 0.45 at a friction of 0.5", lift_tangential="0.45"),
    Case("lifts of 0.1 to 0.25 at a friction of 0.3", lift_tangential="0.1..0.25", lift_friction="0.3"),
)
OBJECTS = ("sphere6", "sphere15", "cylinder6", "cube6")


class Pads:
    def __init__(self, contacts, seed):
        self.contacts, self.seed = contacts, seed
        self.calibrated = contacts.gains_only(contacts.calibrated_pads((TEN_PERCENT,), seed + np.arange(CALIBRATIONS)))

    def of(self, kind, numbers):
        if kind == "cal":
            return self.calibrated[numbers % CALIBRATIONS]
        if kind == "equal":
            return self.contacts.perfect_pads(len(numbers))
        random = self.contacts.random(self.seed, GAINS_STREAM, numbers)
        return self.contacts.raw_pads({"raw5": 0.05, "raw10": 0.10}[kind], self.contacts.gain_sd, random)


def scenario_of(contacts, case, kind, name, seed, act_count):
    seconds = START_QUIET_s + act_count * LONGEST_s[kind]
    options = (
        {"tangential": case.lift_tangential, "friction": case.lift_friction} if kind == "lift" else {"kinetic_share": case.kinetic_share}
    )
    return Scenario(contacts, kind, name, case.layer_mm, seed, seconds, forces="1..10", dead_travel_mm=case.dead_travel_mm, **options)


@dataclasses.dataclass
class Slip:
    """All of the contact slides. Times are from the beginning of the act."""

    begin_s: float
    end_s: float
    way_mm: float = 0.0
    speed_mm_s: float = 0.0
    shown_s: float = 0.0  # when it has gone SHOWN_mm; the end if it has not
    latency_s: dict = dataclasses.field(default_factory=dict)  # by detector, until the frame is known
    gaps: dict = dataclasses.field(default_factory=dict)  # how often the detector fell silent and reported again meanwhile
    lasts_s: dict = dataclasses.field(default_factory=dict)  # how long after the slip's end it still reported


def slips_of(scenario, number):
    phases = scenario.phases[scenario.phases["act"] == number]
    slips = []
    for begin_s, end_s in phases[phases["slip"]][["begin_s", "end_s"]].tolist():
        if slips and begin_s - slips[-1].end_s < JOINED_s:
            slips[-1].end_s = end_s
        else:
            slips.append(Slip(begin_s, end_s))
    for slip in slips:
        t_s = np.arange(slip.begin_s, slip.end_s + 0.0005, 0.001)
        touch = scenario.touches(np.full(len(t_s), number), t_s)
        x_mm, y_mm = touch["x_mm"], touch["y_mm"]
        way_mm = np.hypot(x_mm - x_mm[0], y_mm - y_mm[0])
        slip.way_mm = way_mm.max()
        slip.speed_mm_s = np.hypot(np.diff(x_mm), np.diff(y_mm)).max(initial=0.0) / 0.001
        slip.shown_s = min(slip.end_s, t_s[way_mm >= SHOWN_mm].min(initial=np.inf))
    return slips


def played(contacts, scenario, numbers, pads, case, seed):
    """[(t_s, known_s, flags)] of the frames of each act on its pad; known_s: when a frame can have been interpreted."""
    random = contacts.random(seed, NOISE_STREAM, numbers)
    first_s, last_s = random.uniform(0.0, 1.0) / case.rate_Hz, scenario.last_s[numbers]
    counts = np.floor((last_s - first_s) * case.rate_Hz).astype(int) + 1
    times = [first + np.arange(count) / case.rate_Hz for first, count in zip(first_s, counts)]
    touches = scenario.touches(np.repeat(numbers, counts), np.concatenate(times))
    base_Pa = contacts.base_Pa(case.layer_mm, (scenario.contact_shape,), np.zeros(len(touches), int), touches)
    noise_Pa, conversion_s = contacts.noise_Pa(case.osr), contacts.conversion_s(case.osr)
    # Only as much noise of an act as it has frames.
    normals = np.concatenate(
        [random.normal(count * SENSORS, of=np.arange(len(numbers)) == k)[k].reshape(-1, SENSORS) for k, count in enumerate(counts)]
    )
    readings_Pa = np.repeat(pads["gain"], counts, axis=0) * base_Pa + noise_Pa * normals
    pressed = readings_Pa.max(axis=1) > GATE_NOISES * noise_Pa
    ends, t_us = np.cumsum(counts), round_half_away(1e6 * np.concatenate(times)).astype(np.int64)
    flags = contacts.motion_flags(ends, t_us, readings_Pa, pads, noise_Pa, pressed, contacts.pad_profile(case.layer_mm))
    # The other half of the conversion; reading and fit take about as long as that at most.
    return [
        (1e-6 * t, of_act + conversion_s, each) for t, of_act, each in zip(np.split(t_us, ends[:-1]), times, np.split(flags, ends[:-1]))
    ]


@dataclasses.dataclass
class Judged:
    slips: list
    falsely: dict  # detector: it reported where nothing slipped, nor had just now
    lift_s: float  # how long the lift takes, if it is one


def judge(scenario, number, t_s, known_s, flags):
    slips = slips_of(scenario, number)
    lifts = scenario.phases[(scenario.phases["act"] == number) & (scenario.phases["name"] == b"lift")]
    lift_s = lifts["end_s"] - lifts["begin_s"]
    excused = np.zeros(len(t_s), bool)
    for slip in slips:
        excused |= (t_s > slip.begin_s - EARLY_s) & (t_s < slip.end_s + LATE_s)
    falsely = {}
    for name, flag in DETECTORS.items():
        reports = (flags & flag) > 0
        begins = reports & ~np.concatenate([[False], reports[:-1]])
        falsely[name] = bool((reports & ~excused).any())
        for slip in slips:
            found = np.flatnonzero(reports & (t_s >= slip.begin_s) & (t_s < slip.end_s + JOINED_s))
            slip.latency_s[name] = known_s[found[0]] - slip.begin_s if len(found) else None
            slip.gaps[name] = int((begins & (t_s <= slip.end_s))[found[1:]].sum())
            late = reports & (t_s > slip.end_s) & (t_s < slip.end_s + LATE_s)
            slip.lasts_s[name] = t_s[late].max(initial=slip.end_s) - slip.end_s
    return Judged(slips, falsely, lift_s[-1] if len(lift_s) else 0.0)


def judged_runs(contacts, case, kind, pads, seed, count):
    """Lifts or slides of a case, shared among its objects."""
    found = []
    for k, name in enumerate(OBJECTS):
        share = count // len(OBJECTS) + (k < count % len(OBJECTS))
        if share == 0:
            continue
        with scenario_of(contacts, case, kind, name, seed + 100 * k, share) as scenario:
            for numbers in np.array_split(np.arange(share), math.ceil(share / 20)):  # at once, for the sake of memory
                frames = played(contacts, scenario, numbers, pads.of(case.pad, share * k + numbers), case, seed + 100 * k)
                found += [judge(scenario, number, *each) for number, each in zip(numbers, frames)]
    return found


def rounded(value):
    return None if value is None else math.floor(10.0 * value + 0.5) / 10.0


def lifts(found):
    out = {}
    for name, lasts_s in DURATIONS_s.items():
        some = [each for each in found if abs(each.lift_s - lasts_s) < 1e-3]
        out[f"lifts_{name}"] = len(some)
        out |= {f"{detector}_false_{name}": sum(each.falsely[detector] for each in some) for detector in DETECTORS}
    return out


def slides(found):
    out = {}
    for which in ("", "slow_"):
        slips = [
            slip for each in found for slip in each.slips if slip.way_mm >= WAY_MIN_mm and (slip.speed_mm_s >= FAST_mm_s) == (which == "")
        ]
        out[which + "slips"] = len(slips)
        for detector in DETECTORS:
            seen = [slip for slip in slips if slip.latency_s[detector] is not None]
            of = lambda values, share: rounded(quantile(1e3 * np.array(values), share)) if values else None
            latency_s = [slip.latency_s[detector] for slip in seen]
            since_s = [latency - (slip.shown_s - slip.begin_s) for latency, slip in zip(latency_s, seen)]
            name = f"{detector}_{which}"
            out |= {
                name + "found_percent": rounded(100.0 * len(seen) / len(slips)) if slips else None,
                name + "latency_p50_ms": of(latency_s, 0.5),
                name + "latency_p95_ms": of(latency_s, 0.95),
                name + "since_shown_p95_ms": of(since_s, 0.95),
                name + "lasts_p95_ms": of([slip.lasts_s[detector] for slip in seen], 0.95),
                name + "gaps": sum(slip.gaps[detector] for slip in seen),
            }
    return out | {f"{detector}_false_in_slides": sum(each.falsely[detector] for each in found) for detector in DETECTORS}


def figures(contacts, seed=31000, pads=200, cases=CASES):
    """pads: slides of each case, and lifts of each duration."""
    some, rows = Pads(contacts, seed), []
    for case in cases:
        found = {kind: judged_runs(contacts, case, kind, some, seed, count) for kind, count in (("lift", 3 * pads), ("slide", pads))}
        rows.append({"case": case.name} | lifts(found["lift"]) | slides(found["slide"]))
    usual = rows[0]
    return {
        "motion_seed": seed,
        "motion_pads": pads,
        **{f"lift_false_slides_{name}": usual[f"sliding_false_{name}"] for name in DURATIONS_s},
        **{
            f"slide_{name}": usual[f"sliding_{name}"]
            for name in ("found_percent", "latency_p50_ms", "latency_p95_ms", "since_shown_p95_ms")
        },
        "motion_cases": rows,
    }
