"""The tables of contacts over time: screws, the taps of the paper, and pads that end."""

import math

import numpy as np
from contacts import FORCE_N, SENSORS, Scenario
from presentation import percent, quantile
from touches import LAYER_mm, TOUCHES, UNITS_PER_PAD, Judged, draw, frame_normals, judged, of_all

TAP_OBJECTS, TAP_PADS = ("sphere6", "sphere15", "cylinder6", "cube6"), 8


def screws(bench, out):
    """A torque alone: what the estimate reports while the object spins, and by how much that differs from before."""
    for name in ("sphere15", "sphere6", "cylinder6", "ping_pong", "lime", "cube12"):
        with Scenario(bench.contacts, "screw", name, LAYER_mm, bench.seed, max(60.0, bench.pads)) as scenario:
            phases = scenario.phases[np.isin(scenario.phases["name"], (b"hold", b"spin"))]
            act, spins = phases["act"], phases["name"] == b"spin"
            touches = scenario.touches(act, 0.5 * (phases["begin_s"] + phases["end_s"]))
        normals = bench.random("screws").normal(len(act) * bench.contacts.tangential_frames * SENSORS)
        case = bench.usual(objects=(name,))
        found = judged(bench.contacts, case, touches, np.zeros(len(act), int), case.pads[act % len(case.pads)], normals)
        # Each spin follows the hold of its act, with nothing between them but spins.
        hold = np.maximum.accumulate(np.where(spins, 0, np.arange(len(act))))
        counts = spins & found.valid & found.valid[hold] & (act == act[hold])
        q = np.stack([found.estimate["qx"], found.estimate["qy"]])
        change, read = np.hypot(*(q - q[:, hold]))[counts], found.ratio[counts]
        out["screws"].append(
            {
                "object": name,
                "screws": len(scenario.last_s),
                "spins_with_an_estimate": int(counts.sum()),
                "read_p50": quantile(read, 0.5),
                "read_p95": quantile(read, 0.95),
                "change_p50": quantile(change, 0.5),
                "change_p95": quantile(change, 0.95),
            }
        )
    out["screw_ratio"], out["screw_change_p95"] = (out["screws"][0][key] for key in ("read_p50", "change_p95"))


def taps_of(bench, share):
    """The twin's taps on eight pads, from 1 N on, as 20 frames a second sample them: touches, the object and the pad of each, its noise."""
    seconds = max(40.0, np.clip(bench.pads, 40.0, 600.0) / TAP_PADS)
    found = []
    for k in range(len(TAP_OBJECTS) * TAP_PADS):
        which, pad = divmod(k, TAP_PADS)
        force = {"tangential": f"{share:f}"} if share else {}
        with Scenario(bench.contacts, "taps", TAP_OBJECTS[which], LAYER_mm, bench.seed + pad, seconds, margin_mm=0.0, **force) as scenario:
            times = [np.arange(0.0, last_s, 0.05) for last_s in scenario.last_s]
            touches = scenario.touches(np.repeat(np.arange(len(times)), [len(each) for each in times]), np.concatenate(times))
        touches = touches[touches["force_N"] >= 1.0]
        normals = bench.random("taps", [k]).normal(len(touches) * bench.contacts.tangential_frames * SENSORS)
        found.append((touches, np.full(len(touches), which), np.full(len(touches), pad), normals.reshape(len(touches), -1)))
    return tuple(np.concatenate(each) for each in zip(*found))


def scaled_error_percent(true_N, estimate_N, pad_of):
    """With the factor of each pad, which one known weight shows."""
    scale = np.array([quantile((true_N / estimate_N)[pad_of == pad], 0.5) for pad in range(TAP_PADS)])
    return quantile(100.0 * np.abs(scale[pad_of] * estimate_N / true_N - 1.0), 0.5)


def taps(bench, out):
    """The taps of the paper's table II under a tangential force."""
    sampled = {share: taps_of(bench, share) for share in (0.0, 0.1, 0.3)}
    for kind, pads in (("equal gains", bench.equal), ("10 %, calibrated", bench.calibrated), ("10 %, not calibrated", bench.raw10)):
        for share, (touches, which, pad_of, normals) in sampled.items():
            found = judged(bench.contacts, bench.usual(objects=TAP_OBJECTS), touches, which, pads[pad_of % len(pads)], normals)
            found, pad = found.where(found.found), pad_of[found.found]
            row = found.row(f"{kind}, Q/F {share:g}") | {"pad": kind, "load": share}
            for key, force in (("", "force_N"), ("_without", "gaussian_force_N")):
                row[f"force_scaled{key}_p50_percent"] = scaled_error_percent(found.truth["force_N"], found.estimate[force], pad)
            out["taps"].append(row)


def touched_twice(bench, case):
    """What the estimate reports without a tangential force, with it, and the increment: less what the same touch had at its beginning."""
    unit = np.arange(math.ceil(case.fewer * bench.pads) * UNITS_PER_PAD)
    contacts, random, pads = bench.contacts, bench.random("overhang", unit), case.pads[unit // UNITS_PER_PAD % len(case.pads)]
    found = []
    for _ in range(TOUCHES):
        full, which = draw(contacts, case, random), random.below(len(case.objects))
        alone = full.copy()
        for name in FORCE_N:
            alone[name] = 0.0
        alone["stuck_N"] = full["force_N"]
        first = alone.copy()
        first["force_N"] = first["stuck_N"] = random.uniform(0.5, 2.0)
        estimated = lambda touch: judged(contacts, case, touch, which, pads, frame_normals(contacts, random))
        begun, zero, loaded = estimated(first), estimated(alone), estimated(full)
        less = loaded.estimate.copy()
        less["valid"] &= begun.estimate["valid"]
        for name in ("qx", "qy"):
            less[name] -= begun.estimate[name]
        found.append((zero, loaded, Judged(full, which, less, loaded.found)))
    return (of_all(each) for each in zip(*found))


def overhang(bench, out):
    """Pads that end, by the fingertip's profile: the thickness alone, or the effect of the ends on the estimate as well."""
    worst = []
    for overhang_mm in (13.0, 9.0, 6.0, 4.5):
        for knows_ends in (False, True):
            profile = bench.contacts.pad_profile(LAYER_mm, overhang_mm if knows_ends else 0.0)
            results = tuple(touched_twice(bench, bench.usual(overhang_mm=overhang_mm, profile=profile, fewer=0.2)))
            place = results[0].place()
            rows = {}
            for name in ("anywhere", "inner", "border", "corner"):
                zero, loaded, increment = (each.where((place == name) | (name == "anywhere")) for each in results)
                errors = {"zero": zero, "loaded": loaded, "increment": increment}
                rows[name] = (
                    {
                        "overhang_mm": overhang_mm,
                        "profile": "thickness and ends" if knows_ends else "thickness",
                        "place": name,
                        "touches": len(zero.truth),
                        "valid_percent": percent(increment.valid),
                    }
                    | {
                        f"{kind}_error_p{share}": quantile(each.vector_error[each.valid], share / 100)
                        for kind, each in errors.items()
                        for share in (50, 95)
                    }
                    | {
                        "location_p50_mm": quantile(zero.location_error_mm, 0.5),
                        "location_without_p50_mm": quantile(zero.gaussian_error_mm, 0.5),
                        "location_loaded_p50_mm": quantile(loaded.location_error_mm, 0.5),
                        "location_loaded_without_p50_mm": quantile(loaded.gaussian_error_mm, 0.5),
                    }
                )
            out["by_overhang"] += rows.values()
            for kind in ("zero", "increment"):
                key = f"{kind}_error_p50"
                out[f"{key}{'_own_tables' * knows_ends}_{overhang_mm:g}mm"] = rows["anywhere"][key]
            if knows_ends and overhang_mm >= 9.0:
                worst.append(rows["anywhere"]["zero_error_p50"])
    out["zero_error_p50_own_tables"] = max(worst)
