"""What the firmware calls an edge after twenty presses, on calibrated pads like real ones: balls, held or pulled, anywhere and on rubber that ends,
limes and fingers; and how many edges it finds. The firmware's own code answers. Its constants were chosen with the seeds 1, 21 to 24, 31 to 34."""

import numpy as np
from contacts import with_tangential
from measure import q10, stream_of
from presentation import percent
from sessions import LAYER_mm, LIKE_REAL, SENSORS
from shapes import ELONGATED, LIES_rad, angle_off_rad, draw_touch

KEPT = {"usual": "memory,aftereffect", "as strips": "memory=2.6,aftereffect=4", "ends of 9 mm": "memory,aftereffect"}
PRESSES, REST_s, DOWN_s, BEFORE_per_s, HELD_per_s = 20, 4.0, 0.2, 20.0, 100.0
ROUNDS = 5  # touches of each pad, each after its own presses
BALLS, SOFT = ("sphere12", "sphere15", "sphere24", "rubber_duck"), ("lime", "finger")
EDGES = ("edge12", "cylinder12", "edge14", "edge20", "edge27")


def course(random):
    """t_s, how far each press is down [press, frame], and when the last is: all last as long, and rest as long."""
    rest_s, hold_s, last_s = np.exp(random.uniform(np.log([1.2, 0.2, 0.25]), np.log(10.0)))
    begin_s = REST_s + np.arange(PRESSES + 1) * (rest_s + hold_s + 2 * DOWN_s)
    down_s = begin_s[-1] + DOWN_s
    t_s = np.append(np.arange(0.0, down_s, 1 / BEFORE_per_s), np.arange(down_s, down_s + last_s, 1 / HELD_per_s))
    after_s = t_s - begin_s[:, None]
    held_s = np.append(np.full(PRESSES, hold_s), last_s)[:, None]
    return t_s, np.clip(np.minimum(after_s, held_s + 2 * DOWN_s - after_s) / DOWN_s, 0.0, 1.0), t_s >= down_s


def answers(contacts, pads, seeds, objects, share, rubber, overhang_mm, seed):
    """(touches, answers at the end of the hold), each [pad], of each round."""
    random, times = contacts.random(seed, stream_of(f"{objects} {share} {rubber}"), np.arange(len(pads))), np.random.default_rng(seed)
    noise_Pa, none, every = contacts.noise_Pa(1024), contacts.made("published", len(pads)), np.ones(len(pads), bool)
    for _ in range(ROUNDS):
        t_s, down, held = course(times)
        base_Pa = np.zeros((len(pads), len(t_s), SENSORS))
        for press in down:
            which, touch = random.below(len(objects)), contacts.made("twin_touch", len(pads))
            draw_touch(touch, random, every)
            with_tangential(touch, share * touch["force_N"], random.uniform(0.0, 2.0 * np.pi))
            base_Pa += press[:, None] * contacts.base_Pa(LAYER_mm, objects, which, touch, pads, overhang_mm)[:, None]
        readings_Pa = pads["gain"][:, None] * contacts.rubber(rubber, LAYER_mm, seeds, t_s, base_Pa)
        readings = q10(readings_Pa + noise_Pa * times.standard_normal(base_Pa.shape))
        t_us, past = (1e6 * (1.0 + t_s)).astype(np.uint64), np.zeros((len(pads), SENSORS), np.int32)
        flags, usable, above = np.zeros(len(t_s), np.uint8), np.zeros(len(t_s), np.uint64), np.zeros_like(readings)
        for i in range(len(pads)):
            contacts.call("gate_series", noise_Pa, t_us, readings[i], flags, usable, above[i], past[i])
        yield touch, contacts.held_shapes(above[:, held] / 1024, pads, noise_Pa, none, contacts.pad_profile(LAYER_mm), past / 1024)[0][:, 1]


def figures(contacts, seed=5000, pads=40):
    seeds, rows = contacts.random(seed, stream_of("edges"), np.arange(pads)).bits(), []
    for rubber, kept in KEPT.items():
        overhang_mm = 9.0 if "ends" in rubber else 0.0
        some = contacts.calibrated_pads([LIKE_REAL | {"memory_percent": 1.0, "overhang_mm": overhang_mm}], seeds)
        for objects in (BALLS, SOFT) if overhang_mm else (BALLS, SOFT, EDGES):  # the twin's ends know no long contact
            for share in (0.0, 0.3):
                case = (objects, share, "drift,hysteresis,creep," + kept, overhang_mm or None, seed)
                touches, called = map(np.concatenate, zip(*answers(contacts, some, seeds, *case)))
                edge, off_rad = called["shape"] == ELONGATED, angle_off_rad(called, touches["angle_rad"] + LIES_rad)
                row = {"rubber": rubber, "objects": " ".join(objects), "pulled": share, "touches": len(edge), "edge": percent(edge)}
                rows.append(row | {"angle_within_1sd": percent((off_rad < called["angle_sd_rad"])[edge])})
    of = lambda name, objects: [row[name] for row in rows if row["objects"] == " ".join(objects)]
    return {
        "edges": rows,
        "edge_on_round_percent": max(of("edge", BALLS)),
        "edge_on_lime_and_finger_percent": max(of("edge", SOFT)),
        "edges_found_percent": float(np.mean(of("edge", EDGES))),
        "angle_cover_1sd_percent_min": min(of("angle_within_1sd", EDGES)),
        "angle_cover_1sd_percent_max": max(of("angle_within_1sd", EDGES)),
    }
