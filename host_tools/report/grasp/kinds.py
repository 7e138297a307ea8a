#!/usr/bin/python3
"""Grasps of all kinds (host_tools/simulation/cell/kinds.hpp): runs fingertip_grasp_kinds and sums up what it found.

kinds.py --build build/host --kind usual,rough --set margin=1.4       # one set of them, to tune the controller by
"""

import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
from fingertip.command import Parser, run_tool  # noqa: E402
from presentation import BLUE, GOAL, ORANGE  # noqa: E402
from reporting import built, figures_printed  # noqa: E402

# model: what the figures call it, its colour
GRIPPERS = {"2f85": ("2f85", ORANGE), "sts3215": ("servo", BLUE), "ideal": ("ideal", GOAL)}
CALLED = {model: called for model, (called, _) in GRIPPERS.items()}
# Of the median margin, whatever the gripper: its limit, by what touches the pads.
BY_SHAPE = {"ball": (("ball",), 2.2), "cylinder": (("upright", "lying"), 4), "box": (("box",), 4), "plate": (("plate",), 6)}
CONTROLLERS = ("ours", "textbook", "fixed", "paper")
MIXED = ("--kind", "usual,rough")
# row: its options, whether it is judged; the others' controllers are beside it
ROWS = {
    "usual and rough": (MIXED, True),
    "slick": (("--kind", "slick"), True),
    "fragile": (("--kind", "fragile"), True),
    "usual and rough, 40 ms later": ((*MIXED, "--later", "40"), False),
    "usual and rough, no load estimated": ((*MIXED, "--loadless"), False),
    "usual and rough, 20 frames a second": ((*MIXED, "--rate", "20"), False),
    "usual and rough, 100 frames a second": ((*MIXED, "--rate", "100"), False),
    "usual and rough, 1308 frames a second": ((*MIXED, "--rate", "1308"), False),
    **{kind: (("--kind", kind), False) for kind in ("usual", "rough", "gentle")},
}
STILL = ("--kind", "gentle", "--still")
# row of a set force: its options, its controller
SETS = {"12 s": ((*STILL, "12"), "ours"), "60 s": ((*STILL, "60"), "ours"), "12 s, eq. (5) and (6)": ((*STILL, "12"), "paper")}
# What one fingertip reports wrongly in a steady hold: for one frame, for ten; the others for good.
WRONG_SHORT, WRONG = ("frame", "frames", "spike"), ("nothing", "tared", "reboot", "moved_zero", "weak")
SQUEEZED, SQUEEZED_N = 1.3, 1.0  # the grip rises by both
REQUESTS, AGAINST = ("place", "hand_over"), 1.5  # the grip rises by this factor against a pull
CYCLES = 4  # turns of the commanded width in the last half of a hold
GRASPS, GRASPS_MORE = 1000, 200
USUAL, USUAL_MORE = 100, 30
FIRM_N = 8.0
NEED_LEAST_N = 1.5  # of a catch that counts
FIRST_MUCH = 2.0
TURNED_deg, LEARNT = 30, 0.6


def found_by(build, *more):
    return figures_printed("fingertip_grasp_kinds", [built(build, "host_tools/report/grasp/fingertip_grasp_kinds"), *more])


def quantile(values, share):
    """Of values and of what never came, which is None; None where it is that."""
    values = sorted(float("inf") if value is None else value for value in values)
    value = values[int(share * (len(values) - 1))] if values else float("inf")
    return None if value == float("inf") else round(value, 3)


def words(rows, key):
    return sorted({word for row in rows for word in row[key].split()})


def percent(part, whole):
    return round(100 * part / whole, 3) if whole else None


def summary(each):
    held = [one for one in each if not one["dropped"] and not one["never_held"]]
    slid = [one for one in held if one["slides"] and one["shape"] in BY_SHAPE["ball"][0]]
    needed = [slide for one in each if not one["dropped"] for slide in one["catches"] if slide["least_N"] >= NEED_LEAST_N]
    need = [slide["peak_N"] / slide["least_N"] for slide in needed]
    return {
        "grasps": len(each),
        "drops_percent": percent(sum(one["dropped"] or one["never_held"] for one in each), len(each)),
        "margin_p50": quantile([one["margin"] for one in held], 0.5),
        "margin_p95": quantile([one["margin"] for one in held], 0.95),
        "catches": len(need),
        "peak_over_need_p50": quantile(need, 0.5),
        "peak_over_need_p95": quantile(need, 0.95),
        "slid_p50_mm": quantile([one["slid_mm"] for one in held], 0.5),
        "slid_p95_mm": quantile([one["slid_mm"] for one in held], 0.95),
        "reaction_p50_ms": quantile(reactions(each), 0.5),
        "hunting_percent": percent(sum(one["hunts"] for one in each), len(held)),
        "crushed_percent": percent(sum(one["crushed"] for one in each), len(each)),
        "over_cap": sum(one["peak_N"] > one["cap_N"] for one in each),
        "first_grip_over_2x_percent": percent(sum(one["first_N"] > FIRST_MUCH * one["start_N"] for one in each), len(each)),
        "first_grip_below_wanted_half_percent": percent(sum(one["first_N"] < 0.5 * one["start_N"] for one in each), len(each)),
        "turned_unreported_percent": percent(sum(one["turned_deg"] > TURNED_deg and one["slides"] == 0 for one in held), len(held)),
        "friction_below_0.6_of_true_percent": percent(sum(one["learnt"] < LEARNT for one in slid), len(slid)),
    }


def shape_rows(gripper, each):
    """The same by what touches the pads."""
    of = {called: [one for one in each if one["shape"] in shapes] for called, (shapes, _) in BY_SHAPE.items()}
    keys = "grasps drops_percent margin_p50 margin_p95 peak_over_need_p95 first_grip_over_2x_percent turned_unreported_percent".split()
    found = {called: summary(those) for called, those in of.items()}
    return [{"shape": called, "gripper": gripper, **{key: found[called][key] for key in keys}} for called in BY_SHAPE]


def reactions(each):
    return [slide["reaction_ms"] for one in each for slide in one["catches"] if slide["reaction_ms"] is not None]


def summary_of_sets(each):
    def settled(of):
        return [one["rms_percent"] for one in of if one["settle_s"] is not None]

    firm = [one for one in each if one["set_N"] >= FIRM_N]
    return {
        "grasps": len(each),
        "settle_p50_s": quantile([one["settle_s"] for one in each], 0.5),
        "settle_p95_s": quantile([one["settle_s"] for one in each], 0.95),
        "never_settled_percent": percent(sum(one["settle_s"] is None for one in each), len(each)),
        "rms_p50_percent": quantile(settled(each), 0.5),
        "firm_settle_p50_s": quantile([one["settle_s"] for one in firm], 0.5),
        "firm_rms_p50_percent": quantile(settled(firm), 0.5),
        "limit_cycles": sum(one["reversals"] >= CYCLES for one in each),
    }


def summary_of_held(each):
    """Of steady holds in which something happens: wrong readings, or a request."""
    held = [one for one in each if one["before_N"] > 0]
    squeezed = [one for one in held if one["after_N"] > max(SQUEEZED * one["before_N"], one["before_N"] + SQUEEZED_N)]
    released = [one for one in held if one["released"]]  # by a request only
    return {
        "grasps": len(held),
        "squeezed": len(squeezed),
        "squeezed_percent": percent(len(squeezed), len(held)),
        "against": sum(one["after_N"] > AGAINST * one["before_N"] for one in held),
        "opened_percent": percent(sum(not one["early"] for one in released), len(held)),
        "opened_early": sum(one["early"] for one in released),
        "dropped": sum(one["dropped"] and not one["released"] for one in held),
        "reported": words(held, "reported"),
    }


def worst(key, name=None):
    """Of rows of ours with this name, or of all."""
    return lambda ours, sets, wrong: max((row[key] for row in ours if name in (None, row["row"]) and row[key] is not None), default=None)


# figure: its limits, by gripper, and its name in the rows BASE
BY_GRIPPER = {
    "drops_percent": ((2, 2, 1), "drops_percent"),
    "peak_over_need_p50": ((2.2, 2.0, 1.8), "peak_over_need_p50"),
    "reaction_ms": ((41, None, None), "reaction_p50_ms"),
    "settle_s": ((1.2, 1.2, 1.2), "firm_settle_p50_s"),
    "hold_rms_percent": ((5, 5, 5), "firm_rms_p50_percent"),
}
BASE = ("usual and rough", "12 s")
# figure: its limit, how it is found in the rows of ours, of set forces and of wrong readings
JUDGED = {
    "slick_drops_percent_worst": (3, worst("drops_percent", "slick")),
    "peak_over_need_p95_worst": (4, worst("peak_over_need_p95", "usual and rough")),
    "hunting_percent_worst": (2, worst("hunting_percent", "usual and rough")),
    "crushed_percent": (0, worst("crushed_percent", "fragile")),
    "dropped_fragile_percent": (1, worst("drops_percent", "fragile")),
    "over_cap": (0, lambda ours, sets, wrong: sum(row["over_cap"] for row in ours)),
    "first_grip_over_2x_percent": (0.5, worst("first_grip_over_2x_percent", "usual and rough")),
    "first_grip_below_wanted_half_percent": (0, worst("first_grip_below_wanted_half_percent", "usual and rough")),
    "late_40ms_drops_percent": (3, worst("drops_percent", "usual and rough, 40 ms later")),
    "turned_unreported_percent": (None, worst("turned_unreported_percent", "usual and rough")),
    "friction_below_0.6_of_true_percent": (5, worst("friction_below_0.6_of_true_percent", "usual and rough")),
    "limit_cycles": (0, lambda ours, sets, wrong: sum(row["limit_cycles"] for row in sets if row["row"] != "12 s")),
    "one_bad_frame_squeezed": (0, lambda ours, sets, wrong: sum(row["squeezed"] for row in wrong if row["then"] in WRONG_SHORT)),
    "lasting_bad_squeezed_percent": (2, lambda _, __, wrong: max(row["squeezed_percent"] or 0 for row in wrong if row["then"] in WRONG)),
}
LIMITS = {f"{name}_{called}": limit for name, (limits, _) in BY_GRIPPER.items() for called, limit in zip(CALLED.values(), limits)}
LIMITS |= {f"margin_median_{shape}": limit for shape, (_, limit) in BY_SHAPE.items()} | {name: limit for name, (limit, _) in JUDGED.items()}
GOALS = tuple((name, "<=", limit) for name, limit in LIMITS.items() if limit is not None) + (
    ("place_rises", "<=", 0),
    ("placed_opened_percent", ">=", 98),
    ("handed_over_percent", ">=", 98),
    ("pulled_against_over_1.5x", "<=", 0),
)


def figures(rows, sets, shapes, wrong):
    """What is judged, of all rows of ours."""
    ours = [row for row in rows if row["controller"] == "ours"]
    found = {}
    for row in shapes:
        name, margin = f"margin_median_{row['shape']}", row["margin_p50"]
        found[name] = max((value for value in (margin, found.get(name)) if value is not None), default=None)
    for row in ours + sets:
        if row["row"] in BASE:
            found |= {f"{name}_{CALLED[row['gripper']]}": row[key] for name, (_, key) in BY_GRIPPER.items() if key in row}
    return found | {name: find(ours, sets, wrong) for name, (_, find) in JUDGED.items()}


def measure(options, steps):
    judged, more = (options.grasps, options.grasps) if options.grasps else (USUAL, USUAL_MORE) if options.usual else (GRASPS, GRASPS_MORE)
    grasps = lambda *call: found_by(options.build, *call, "--seed", options.seed)["each"]
    found = {"kinds": [], "shapes": [], "sets": [], "distributions": []}
    for name, (arguments, is_judged) in ROWS.items():
        for gripper in GRIPPERS:
            for controller in CONTROLLERS if is_judged else ("ours",):
                count = judged if controller == "ours" and is_judged else more
                each = grasps(*arguments, "--gripper", gripper, "--controller", controller, "--count", count)
                found["kinds"].append({"row": name, "gripper": gripper, "controller": controller, **summary(each)})
                if name == "usual and rough" and controller == "ours":
                    found["shapes"] += shape_rows(gripper, each)
                    held = [one for one in each if not one["dropped"]]
                    found["distributions"].append(
                        {
                            "gripper": gripper,
                            "margin": sorted(one["margin"] for one in held),
                            "slid_mm": sorted(one["slid_mm"] for one in held),
                            "reaction_ms": sorted(reactions(each)),
                        }
                    )
            steps.report(f"{gripper}, {name}: {found['kinds'][-1]['grasps']} grasps")
    for name, (arguments, controller) in SETS.items():
        for gripper in GRIPPERS:
            count = max(1, more // 5) if name == "60 s" else more
            each = grasps(*arguments, "--gripper", gripper, "--controller", controller, "--count", count)
            found["sets"].append({"row": name, "gripper": gripper, **summary_of_sets(each)})
            steps.report(f"{gripper}, a set force for {name}: {count} grasps")
    for key, names, count in (("wrong", WRONG_SHORT + WRONG, max(1, more // 3)), ("requests", REQUESTS, more)):
        found[key] = []
        for name in names:
            for gripper in GRIPPERS:
                each = grasps(*MIXED, "--then", name, "--gripper", gripper, "--count", count)
                found[key].append({"then": name, "gripper": gripper, **summary_of_held(each)})
        steps.report(f"{key} in a steady hold: {sum(row['grasps'] for row in found[key])} grasps")
    place, hand = ([row for row in found["requests"] if row["then"] == name] for name in REQUESTS)
    found |= {
        "place_rises": sum(row["squeezed"] for row in place),
        "placed_opened_percent": min(row["opened_percent"] for row in place),
        "handed_over_percent": min(row["opened_percent"] for row in hand),
        "pulled_against_over_1.5x": sum(row["against"] for row in hand),
    }
    return found | figures(found["kinds"], found["sets"], found["shapes"], found["wrong"])


def main(argv):
    parser = Parser(description=__doc__)
    parser.add_argument("--build", required=True, metavar="DIR")
    options, more = parser.parse_known_args(argv)
    each = found_by(options.build, *more)["each"]
    print(json.dumps((summary_of_sets if "settle_s" in each[0] else summary)(each), indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("kinds.py", main))
