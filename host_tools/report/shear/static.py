"""The tables of contacts that hold still: location, force and tangential force beside the truth, by pad, object, location and rubber.

figures() returns the figures that are judged, and the tables and samples behind them.
"""

import collections
import sys

import moving
import numpy as np
from contacts import FORCE_N, FRICTION, SENSORS, with_tangential
from measure import stream_of
from sessions import DIP, LIKE_REAL, USUAL, WEIGHT_N
from presentation import percent, quantile
from touches import LAYER_mm, SEVEN, SHARE, Case, frame_normals, judged, of_all, run

# name, Q / F, how it came
LOADS = (
    ("0", 0.0, "held"),
    ("0.1", 0.1, "held"),
    ("0.3", SHARE, "held"),
    ("0.3, risen with the force", SHARE, "together"),
    ("0.45", 0.45, "held"),
    ("0.5, sliding", FRICTION, "slides"),
)
BOTH = ((0.0, ", Q/F 0"), (SHARE, ", Q/F 0.3"))
OBJECTS = (
    *("sphere6", "sphere15", "cylinder6", "cube6", "ball_bearing", "bottle_cap", "lime", "ping_pong", "rubber_duck"),
    *(f"{shape}{mm}" for mm in (12, 18, 24) for shape in ("sphere", "cylinder", "cube")),
    *("cube15", "cylinder6x12", "edge20"),
)
SMALL = ("sphere6", "sphere15", "cylinder6")
# Every lying cylinder of the twin, a shorter one, and an edge.
LONG = ("cylinder6x12", "edge20", "ball_bearing", "cylinder12", "cylinder18", "cylinder24")
ERRORS = ("ratio_error_p50", "ratio_error_p95", "vector_error_p50", "vector_error_p95", "direction_p90_deg")
COVERS = ("q_cover_1sd", "q_cover_2sd")


class Bench:
    """The pads that the tables have in common."""

    def __init__(self, contacts, seed, pads, few=False):
        self.contacts, self.seed, self.pads, self.few = contacts, seed, pads, few
        self.calibrated = self.calibrated_as(USUAL)
        self.equal = contacts.perfect_pads(1)
        self.raw5 = contacts.raw_pads(0.05, 0.05, self.random("raw pads", np.arange(pads)))
        self.raw10 = contacts.raw_pads(0.10, contacts.gain_sd, self.random("raw pads", np.arange(pads)))

    def random(self, table, index=(0,)):
        return self.contacts.random(self.seed, stream_of(table), index)

    def sessions(self, kinds):
        return self.contacts.calibrated_for(self.pads, kinds, self.seed)

    def calibrated_as(self, kinds):
        """Pads of these kinds in turn, each calibrated as it is and with the force scale that a known weight shows."""
        return weighed(self.contacts, self.sessions(kinds), LAYER_mm)

    def calibrated_on(self, layer_mm):
        """The gains that are left by calibrations, and nothing else of them, under rubber of this thickness."""
        return weighed(self.contacts, self.contacts.gains_only(self.sessions(USUAL)), layer_mm)

    def usual(self, **changes):
        return Case(**{"pads": self.calibrated, **changes})

    def run(self, table, **changes):
        return run(self, table, self.usual(**changes))


def weighed(contacts, pads, layer_mm):
    """With the force scale of a known weight: the median over a sphere of 15 mm at nine locations around the middle."""
    quiet_Pa = 0.1  # the fit takes no noise of zero
    at, pad_of = np.arange(9 * len(pads)) % 9, np.arange(9 * len(pads)) // 9
    touch = contacts.made("twin_touch", len(at))
    touch["x_mm"], touch["y_mm"], touch["force_N"] = 4.5 * (at % 3 - 1), 4.5 * (at // 3 - 1), WEIGHT_N
    normals = contacts.random(0, 0, [0]).normal(9 * contacts.tangential_frames * SENSORS).reshape(9, -1)[at]
    case = Case(pads, ("sphere15",), layer_mm=layer_mm, profile=contacts.pad_profile(layer_mm))
    found = judged(contacts, case, touch, np.zeros(len(at), int), pads[pad_of], normals, quiet_Pa)
    pads["force_scale"] = np.median((WEIGHT_N / found.estimate["gaussian_force_N"]).reshape(-1, 9), axis=1)
    return pads


def by_place(usual, out):
    """Where the errors of the usual case lie."""
    place = usual.place()
    for name in ("inner", "border", "corner"):
        out["by_place"].append(usual.where(place == name).row(name))
        for k, thing in enumerate(SEVEN):
            some = usual.where((place == name) & (usual.which == k))
            valid = some.valid
            out["where_misses_lie"].append(
                some.row(f"{thing}, {name}")
                | {
                    "off_by_0_05_percent": percent(some.vector_error[valid] > 0.05),
                    "off_by_5_deg_percent": percent(some.direction_error_deg[valid] > 5.0),
                }
            )
    rounder = usual.where((usual.which != SEVEN.index("lime")) & (place != "corner")).row("")
    for key in ("ratio_error_p95", "vector_error_p95", "direction_p90_deg"):
        out["no_lime_no_corner_" + key] = rounder[key]
    for low, high in ((1, 2), (2, 4), (4, 8), (8, 10)):
        force_N = usual.truth["force_N"]
        out["by_force"].append(usual.where((force_N >= low) & (force_N < high)).row(f"{low} to {high} N"))
    cell_mm = 3.0
    column, line = (np.floor((usual.truth[key] + end) / cell_mm) for key, end in (("x_mm", 9.0), ("y_mm", 18.0)))
    for x in range(6):
        for y in range(12):
            errors = usual.vector_error[(column == x) & (line == y)]
            valid = usual.vector_error[(column == x) & (line == y) & usual.valid]
            out["map"].append(
                {
                    "x_mm": -9.0 + cell_mm * (x + 0.5),
                    "y_mm": -18.0 + cell_mm * (y + 0.5),
                    "touches": len(errors),
                    "vector_error_p50": quantile(valid, 0.5) if len(valid) else None,
                    "vector_error_p95": quantile(valid, 0.95) if len(valid) else None,
                }
            )


def location_curve(found, share):
    """The distribution of the location's error, with the estimate and without."""
    return [
        {
            "load": share,
            "percent": each,
            "with_mm": quantile(found.location_error_mm, 0.01 * each),
            "without_mm": quantile(found.gaussian_error_mm, 0.01 * each),
        }
        for each in range(0, 101, 2)
    ]


def pads(bench, out):
    """Pads by how much is known of their gains, tangential forces from none to sliding."""
    kinds = (
        ("equal gains", bench.equal),
        ("10 %, calibrated", bench.calibrated),
        ("5 %, not calibrated", bench.raw5),
        ("10 %, not calibrated", bench.raw10),
    )
    for kind, some in kinds:
        for load, share, history in LOADS:
            found = bench.run("pads", pads=some, share=share, history=history)
            row = found.row(f"{kind}, Q/F {load}") | {"pad": kind, "load": share}
            out["by_pad_and_load"].append(row)
            calibrated = some is bench.calibrated
            if (calibrated or some is bench.equal) and load == "0.3":
                prefix = "" if calibrated else "equal_"
                out.update({prefix + key: row[key] for key in ERRORS})
                out["location_loaded_median_mm" if calibrated else "equal_location_loaded_mm"] = row["location_p50_mm"]
                out[prefix + "location_loaded_without_mm"] = row["location_without_p50_mm"]
            if calibrated and load == "0.3":
                out["loaded_valid_percent"] = row["valid_percent"]
                for key in (*COVERS, "location_cover_1sd", "location_cover_2sd", "force_p50_percent", "force_without_p50_percent"):
                    out[key] = row[key]
                by_place(found, out)
            if calibrated and load == "0":
                out["location_unloaded_mm"] = row["location_p50_mm"]
                out["location_unloaded_without_mm"] = row["location_without_p50_mm"]
                out["location_price_mm"] = row["location_p50_mm"] - row["location_without_p50_mm"]
            if calibrated and load in ("0", "0.3"):
                out["location_quantiles"] += location_curve(found, share)
            if some is bench.raw10 and load == "0":
                out["raw_beyond_2sd_percent"] = 100.0 - found.q_within_percent(2.0)


def objects(bench, out):
    prices_mm = []
    for name in OBJECTS:
        for share, text in BOTH:
            row = bench.run("objects", objects=(name,), share=share, fewer=0.1).row(name + text) | {"object": name, "load": share}
            out["by_object"].append(row)
            if share == 0.0:
                prices_mm.append(row["location_p50_mm"] - row["location_without_p50_mm"])
    out["location_price_worst_mm"] = max(prices_mm)


def elongated(bench, out):
    found = bench.run("elongated", objects=LONG, share=0.0)
    out.update({key.replace("claimed", "elongated_false"): value for key, value in found.claimed().items()})
    out["elongated_valid_percent"] = percent(found.valid)
    out["elongated"] = [found.where(found.which == k).row(f"{name}, any angle") for k, name in enumerate(LONG)]
    half_turns = found.truth["angle_rad"] / np.pi % 1.0
    for k in range(6):
        some = found.where(np.floor(6 * half_turns) == k)
        out["elongated"].append(some.row(f"any of them, {30 * k} to {30 * k + 30} degrees"))


def limits(bench, out):
    """Light touches, oversampling, missing sensors, locations beyond the array."""
    for low, high in ((0.1, 0.2), (0.2, 0.5), (0.5, 1)):
        for share, text in BOTH:
            found = bench.run("light", share=share, forces_N=(low, high), fewer=0.2)
            out["light_touches"].append(found.row(f"{low} to {high} N{text}"))
    for osr in (256, 512, 1024, 2048, 4096, 8192):
        row = bench.run("osr", osr=osr, fewer=0.2).row(f"OSR {osr}")
        out["by_osr"].append(row | {"noise_Pa": bench.contacts.noise_Pa(osr)})
    for sensors in (15, 14, 13, 12, 10, 8):
        out["by_sensors"].append(bench.run("sensors", sensors=sensors, fewer=0.2).row(f"{sensors} sensors"))
    out["by_place"].append(bench.run("beyond", beyond_mm=4.5, fewer=0.2).row("up to 4.5 mm outside the array"))


def thickness(bench, out):
    for layer_mm in (LAYER_mm,) if bench.few else (5.0, 6.0, 9.0, LAYER_mm, 15.0, 20.0):
        some = bench.calibrated_on(layer_mm)
        for set_mm in (1.0 * layer_mm, 1.1 * layer_mm, 0.9 * layer_mm):
            if not 5.0 <= set_mm <= 20.0:
                continue
            case = {"objects": SMALL, "pads": some, "layer_mm": layer_mm, "profile": bench.contacts.pad_profile(set_mm), "fewer": 0.1}
            for share, text in BOTH:
                row = bench.run("thickness", share=share, **case).row(f"{layer_mm:g} mm, set {set_mm:g} mm{text}")
                out["by_thickness"].append(row | {"layer_mm": layer_mm, "set_mm": set_mm, "load": share})


def learned(bench, out):
    """The profile that follows from a calibration's width, and a thickness that is set 15 % wrong."""
    sessions, wrong = 20, 0.15
    seeds = bench.random("learned thickness", np.arange(sessions)).bits()
    mm, sd_mm, shown = bench.contacts.learned_thickness(USUAL, seeds)
    agrees = lambda set_mm: np.abs(mm - set_mm) <= 2.0 * sd_mm
    some = [
        bench.run(f"learned {k}", profile=bench.contacts.pad_profile(shown_mm), fewer=1.0 / sessions) for k, shown_mm in enumerate(shown)
    ]
    row = of_all(some).row("12 mm, learned, Q/F 0.3")
    out["learned"] = [row]
    for key in ("valid_percent", "ratio_error_p50", "ratio_error_p95"):
        out["learned_" + key] = row[key]
    out["learned_thickness_off_p95_percent"] = quantile(100.0 * np.abs(mm / LAYER_mm - 1.0), 0.95)
    both = np.concatenate([agrees((1.0 - wrong) * LAYER_mm), agrees((1.0 + wrong) * LAYER_mm)])
    out["wrong_thickness_warned_percent"], out["right_thickness_warned_percent"] = percent(~both), percent(~agrees(LAYER_mm))


def cast(bench, out):
    """Pads with a dip, and pads like real ones, each calibrated as it is, and those of the other tables. The touches are the same."""
    kinds = (
        ("10 %, calibrated", "", bench.calibrated),
        ("10 % and a dip, calibrated", "dip_", bench.calibrated_as((DIP,))),
        ("like real ones, calibrated", "cast_", bench.calibrated_as((LIKE_REAL,))),
    )
    for kind, prefix, some in kinds:
        for load, share, history in LOADS:
            found = bench.run("cast", pads=some, share=share, history=history, fewer=0.5)
            row = found.row(f"{kind}, Q/F {load}") | {"pad": kind, "load": share}
            out["by_cast"].append(row)
            if prefix and load == "0.3":
                out.update({prefix + key: row[key] for key in ("valid_percent", *ERRORS, *COVERS)})
                out[prefix + "location_loaded_median_mm"] = row["location_p50_mm"]
            if prefix and load == "0":
                out[prefix + "location_price_mm"] = row["location_p50_mm"] - row["location_without_p50_mm"]


def arrows(bench, out):
    """Fifteen touches to draw."""
    force_N, random, contacts = 5.0, bench.random("arrows"), bench.contacts
    for column, line in ((column, line) for column in (-1, 0, 1) for line in (-2, -1, 0, 1, 2)):
        direction = random.uniform(0.0, 2.0 * np.pi)
        touch = contacts.made("twin_touch", 1)
        touch["x_mm"] = 6.0 * column + random.uniform(-1.5, 1.5)
        touch["y_mm"] = 7.5 * line + random.uniform(-1.5, 1.5)
        touch["force_N"] = force_N
        with_tangential(touch, SHARE * force_N, direction)
        case, pads = bench.usual(objects=("sphere15",)), bench.calibrated[:1]
        found = judged(contacts, case, touch, np.zeros(1, int), pads, frame_normals(contacts, random)).estimate[0]
        true = {"x_mm": touch["x_mm"], "y_mm": touch["y_mm"], **{f"q{axis}": touch[FORCE_N[k]] / force_N for k, axis in enumerate("xy")}}
        out["arrows"].append(
            {key: float(value[0]) for key, value in true.items()}
            | {f"estimated_{key}": float(found[key]) for key in true}
            | {"without_x_mm": float(found["gaussian_x_mm"]), "without_y_mm": float(found["gaussian_y_mm"])}
        )


TABLES = {
    "pads": pads,
    "objects": objects,
    "elongated": elongated,
    "limits": limits,
    "thickness": thickness,
    "learned": learned,
    "cast": cast,
    "screws": moving.screws,
    "taps": moving.taps,
    "overhang": moving.overhang,
    "arrows": arrows,
}


def figures(contacts, seed=20221015, pads=1500, few=False, tables=TABLES):
    """pads: of each case, a fifth for some; few: no rubber of other thicknesses than 12 mm."""
    bench, out = Bench(contacts, seed, pads, few), collections.defaultdict(list)
    for name in tables:
        TABLES[name](bench, out)
        print(f"        {name}", file=sys.stderr, flush=True)
    return {"shear_seed": seed, "shear_pads": pads, **out}
