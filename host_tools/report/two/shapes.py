"""What the firmware makes of one contact, a long one, one under a tangential force, and two.

The twin's objects press on calibrated pads of 12 mm with a dip, and hold still while the firmware's fit_shapes answers, as scene shapes runs
it. Judged are the first answer and that HELD_FRAMES later. Two contacts are the sum of their pressures. The constants of fit_shapes were
chosen with the seeds 20000 and 30000, the rules of shapes_locate were tried with 50000 and 60000.
"""

import dataclasses

import numpy as np
from contacts import with_tangential
from measure import stream_of
from sessions import SENSORS, USUAL
from presentation import percent, quantile

LAYER_mm, SHARE = 12.0, 0.3
TOUCHES = 20  # of each pad, in each case
HELD_FRAMES = 40
NEAR_mm, FORCE_SHARE = 1.5, 0.1  # a pair is right within these
BAD_mm = 1.0
LIES_rad = 0.5 * np.pi  # a roller lies along y
UNDECIDED, ONE, PULLED, ELONGATED, TWO, NONE = range(6)  # enum fit_shape
CALLED = {"one": ONE, "pulled": PULLED, "long": ELONGATED, "two": TWO, "none": NONE, "undecided": UNDECIDED}


@dataclasses.dataclass
class Case:
    name: str
    objects: tuple  # one of them, or the same twice
    apart_mm: float = 0.0  # of a pair
    ratio: float = 1.0  # forces, stronger to weaker
    share: float = 0.0  # Q / F
    exact: bool = False  # no gain has an error, nor is one expected
    towards: str = ""  # the pad's longer side ("along"), its shorter one ("across")
    judged: bool = True  # else only shown


ROUND, EVERYDAY = ("sphere6", "sphere15", "cylinder6", "cube6", "ping_pong"), ("rubber_duck", "lime")
PAIRS = [(apart_mm, ratio) for ratio in (1, 3) for apart_mm in (6, 8, 10, 12, 15, 20)]
CASES = (
    Case("round", ROUND),
    Case("everyday", EVERYDAY),
    Case("round, Q/F 0.3", ROUND, share=SHARE),
    Case("everyday, Q/F 0.3", EVERYDAY, share=SHARE),
    *(Case(name, (name,)) for name in ("cylinder6x12", "edge10", "edge14", "edge20", "cube15")),
    *(Case(name, (name,), judged=False) for name in ("edge24", "edge30", "edge36")),  # longer than the array is wide
    *(Case(f"two, {apart_mm} mm, {ratio}:1", ("sphere6",), apart_mm, ratio) for apart_mm, ratio in PAIRS),
    # Of all, it reaches furthest for its spread.
    *(Case(f"two, 8 mm, {ratio}:1, cubes", ("cube6",), 8, ratio, judged=False) for ratio in (1, 3)),
    *(
        Case(f"two, {apart_mm} mm, 1:1, {text}", ("sphere6",), apart_mm, **kind)
        for apart_mm in (8, 10, 12)
        for text, kind in (
            ("exact gains", {"exact": True}),
            ("along the pad", {"towards": "along"}),
            ("across the pad", {"towards": "across"}),
        )
    ),
)


def dipped_pads(contacts, count, seed):
    """Calibrated pads with a dip; half of them remember, and have sensors off their places."""
    seeds = contacts.random(seed, stream_of("dipped sessions"), np.arange(count)).bits()
    return contacts.calibrated_pads([kind | {"dip_percent": 1.25} for kind in USUAL], seeds)


def draw_touch(touch, random, which):
    """Anywhere on the array, at any angle."""
    drawn = (9.0 * random.uniform(-1.0, 1.0, of=which), 9.0 * random.uniform(-2.0, 2.0, of=which))
    drawn += (random.uniform(1.0, 15.0, of=which), random.uniform(0.0, 2.0 * np.pi, of=which))
    for name, values in zip(("x_mm", "y_mm", "force_N", "angle_rad"), drawn):
        touch[name][which] = values[which]


def draw(contacts, case, random):
    """[touch][1 or 2 contacts], anywhere on the array, one touch of each generator."""
    one, outside = contacts.made("twin_touch", len(random.states)), np.ones(len(random.states), bool)
    draw_touch(one, random, outside)
    if not case.apart_mm:
        return one[:, None]
    other = one.copy()
    while outside.any():
        draw_touch(one, random, outside)
        direction = random.uniform(-0.25 * np.pi, 0.25 * np.pi, of=outside)
        direction = {"": 4.0 * direction, "across": direction, "along": direction + 0.5 * np.pi}[case.towards]
        other[outside] = one[outside]
        other["x_mm"][outside] += case.apart_mm * np.cos(direction[outside])
        other["y_mm"][outside] += case.apart_mm * np.sin(direction[outside])
        outside &= (np.abs(other["x_mm"]) > 9.0) | (np.abs(other["y_mm"]) > 18.0)
    other["force_N"] = random.uniform(2.0, 5.0)  # the weaker one
    one["force_N"] = case.ratio * other["force_N"]
    return np.stack([one, other], axis=1)


def answers(contacts, case, pads, seed):
    """For one touch of each pad at a time: contacts [pad][1 or 2], and shape and location in the answers [pad][first or held]."""
    if case.exact:
        exact = contacts.perfect_pads(len(pads))
        for name in ("dip_share", "dip_sd_mm", "cast_dip_share"):
            exact[name] = pads[name]
        pads = exact
    random, of_estimate = (contacts.random(seed, stream_of(text + case.name), np.arange(len(pads))) for text in ("", "load, "))
    oversampled_Pa = np.array([contacts.noise_Pa(256 << k) for k in range(6)])
    profile = contacts.pad_profile(LAYER_mm)
    for _ in range(TOUCHES):
        which, touches = random.below(len(case.objects)), draw(contacts, case, random)
        direction = random.uniform(0.0, 2.0 * np.pi)[:, None]
        with_tangential(touches, case.share * touches["force_N"], direction)
        noise_Pa = oversampled_Pa[random.below(6)]
        base_Pa = sum(contacts.base_Pa(LAYER_mm, case.objects, which, one, pads) for one in touches.T)
        estimate, _ = contacts.estimated(base_Pa, pads, noise_Pa, of_estimate.normal(contacts.tangential_frames * SENSORS), profile)
        normals = random.normal((contacts.shapes_frames + HELD_FRAMES) * SENSORS)
        readings_Pa = contacts.readings_Pa(base_Pa, pads, noise_Pa, normals)
        yield touches, *contacts.held_shapes(readings_Pa, pads, noise_Pa, estimate, profile)


def angle_off_rad(answer, true_rad):
    off_rad = np.arctan2(answer["along_y"].astype(float), answer["along_x"]) - true_rad
    return np.abs(off_rad - np.pi * np.round(off_rad / np.pi))


class Judged:
    """Answers [touch], and the locations that the packets have, beside the truth [touch][1 or 2 contacts]."""

    def __init__(self, answer, place, touches, location_sd_limit_mm):
        x, y, force_N = (touches[name] for name in ("x_mm", "y_mm", "force_N"))
        total_N = force_N.sum(axis=1)
        pair = touches.shape[1] == 2
        self.shape = shape = answer["shape"]
        self.chi_square = answer["chi_square"]
        self.force = answer["force_N"].sum(axis=1, dtype=np.float32) / total_N - 1.0
        self.has_place = (shape != NONE) & (shape != UNDECIDED)
        # [touch][contact][found]
        off_mm = np.hypot(answer["x_mm"][:, None] - x[:, :, None], answer["y_mm"][:, None] - y[:, :, None])
        middle_x, middle_y = ((values * force_N).sum(axis=1) / total_N for values in (x, y))
        self.off_mm = np.hypot(place["x_mm"] - middle_x, place["y_mm"] - middle_y)
        self.off_sd_mm = place["location_sd_mm"].astype(float)
        sd_mm, two = answer["location_sd_mm"], shape == TWO
        if pair:  # the worse location of two
            straight, crossed = off_mm[:, [0, 1], [0, 1]], off_mm[:, [1, 0], [0, 1]]
            is_straight = straight.max(axis=1) <= crossed.max(axis=1)
            both = np.where(is_straight[:, None], straight, crossed)
            self.off_mm = np.where(two, both.max(axis=1), self.off_mm)
            worse = np.where(both[:, 0] >= both[:, 1], sd_mm[:, 0], sd_mm[:, 1])
        else:  # of one contact that is called two, the nearer location
            middle = np.hypot(answer["x_mm"] - middle_x[:, None], answer["y_mm"] - middle_y[:, None])
            self.off_mm = np.where(two, middle.min(axis=1), self.off_mm)
            worse = sd_mm.max(axis=1)
        self.off_sd_mm = np.where(two, worse, self.off_sd_mm)
        true_rad = np.arctan2(y[:, 1] - y[:, 0], x[:, 1] - x[:, 0]) if pair else touches["angle_rad"][:, 0] + LIES_rad
        self.angle_deg = np.degrees(angle_off_rad(answer, true_rad))
        # One location for two contacts is wrong whatever its error, unless it is called long.
        mistaken = (shape == ONE) | (shape == PULLED) if pair else two
        certain = self.off_sd_mm <= location_sd_limit_mm
        self.silent = self.has_place & ((self.off_mm > BAD_mm) | mistaken) & certain
        self.warned = self.has_place & ~certain
        self.is_right = two & (self.off_mm <= NEAR_mm) & (np.abs(self.force) <= FORCE_SHARE)


def row_of(contacts, case, pads, seed):
    touches, shapes, places = (np.concatenate(each) for each in zip(*answers(contacts, case, pads, seed)))
    first, held = (Judged(shapes[:, k], places[:, k], touches, contacts.location_sd_limit_mm) for k in (0, 1))
    of = lambda values, chosen, share: quantile(values[chosen], share)
    elongated, off_mm = held.shape == ELONGATED, held.off_mm
    row = {"case": case.name, "touches": len(touches)}
    row |= {name: percent(held.shape == shape) for name, shape in CALLED.items()}
    row |= {
        "two_and_right": percent(held.is_right),
        "silent": percent(held.silent),
        "warned": percent(held.warned),
        "off_p50_mm": of(off_mm, held.has_place, 0.5),
        "off_p95_mm": of(off_mm, held.has_place, 0.95),
        "within_1sd": percent((off_mm <= held.off_sd_mm)[held.has_place]),
        "within_2sd": percent((off_mm <= 2.0 * held.off_sd_mm)[held.has_place]),
        "angle_p50_deg": of(held.angle_deg, elongated, 0.5),
        "angle_p90_deg": of(held.angle_deg, elongated, 0.9),
    }
    row |= {f"chi_square_{name}": of(held.chi_square[:, k], held.has_place, 0.5) for k, name in enumerate(("one", "long", "two"))}
    row |= {"two_first": percent(first.shape == TWO), "two_and_right_first": percent(first.is_right), "silent_first": percent(first.silent)}
    return row


def figures(contacts, seed=40000, pads=200, cases=CASES):
    some = dipped_pads(contacts, pads, seed)
    rows = {case.name: row_of(contacts, case, some, seed) for case in cases}
    worse = lambda name, of_row, which=max: which(rows[name][of_row], rows[name][f"{of_row}_first"])
    single = [case.name for case in cases if not case.apart_mm and case.judged and case.name != "cube15"]  # neither round nor long
    held = [case.name for case in cases if case.judged and not case.exact and not case.towards]
    out = {"seed": seed, "pads": pads, "touches": list(rows.values())}
    for end, name in (("8mm", "two, 8 mm, 1:1"), ("12mm", "two, 12 mm, 1:1"), ("10mm_3to1", "two, 10 mm, 3:1")):
        out[f"two_right_percent_{end}"] = worse(name, "two_and_right", min)
    return out | {
        "edge_angle_p50_deg_20mm": rows["edge20"]["angle_p50_deg"],
        "edge_angle_p50_deg_10mm": rows["edge10"]["angle_p50_deg"],
        "one_called_two_percent": max(worse(name, "two") for name in single),
        "silent_over_1mm_percent": sum(worse(name, "silent") for name in held) / len(held),
    }
