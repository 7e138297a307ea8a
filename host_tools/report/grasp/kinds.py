"""Grasps of all kinds (host_tools/simulation/cell/kinds.hpp): what fingertip_grasp_kinds found, for grasp.json and grasp.md."""

import json
import pathlib

from presentation import BLUE, GOAL, ORANGE, table_md, text_of
from fingertip.files import InputError
from reporting import run

# model: what the figures call it, its colour
GRIPPERS = {"2f85": ("2f85", ORANGE), "sts3215": ("servo", BLUE), "ideal": ("ideal", GOAL)}
CALLED = {model: called for model, (called, _) in GRIPPERS.items()}
BY_GRIPPER = {
    "drops_percent": (1, 1.5, 0.5),
    "peak_over_need_p50": (2.2, 2.0, 1.8),
    "margin_median": (2.2, None, 1.7),
    "reaction_ms": (41, None, None),
}
GOALS = tuple(
    (f"{name}_{called}", "<=", limit)
    for name, limits in BY_GRIPPER.items()
    for called, limit in zip(CALLED.values(), limits)
    if limit is not None
) + (
    ("slick_drops_percent_worst", "<=", 3),
    ("peak_over_need_p95_worst", "<=", 3.5),
    ("hunting_percent_worst", "<=", 2),
    ("crushed_percent", "<=", 0),
    ("dropped_fragile_percent", "<=", 1),
    ("over_cap", "<=", 0),
    ("first_grip_over_2x_percent", "<=", 0.5),
    ("late_40ms_drops_percent", "<=", 3),
    ("step_us", "<=", 20),
)
CONTROLLERS = {
    "ours": "ours",
    "textbook": "a textbook's: 1.3 load / friction, 30 % more in a slide",
    "fixed": "15 N",
    "paper": "eq. (5) and (6) at 6 N",
    "oracle": "oracle",
}
# row: its options, whether it is judged; the others' controllers are beside it
ROWS = {
    "usual and rough": (("--kind", "usual,rough"), True),
    "slick": (("--kind", "slick"), True),
    "fragile": (("--kind", "fragile"), True),
    "usual and rough, 40 ms later": (("--kind", "usual,rough", "--later", "40"), False),
    "usual": (("--kind", "usual"), False),
    "rough": (("--kind", "rough"), False),
    "gentle": (("--kind", "gentle"), False),
}
GRASPS, GRASPS_MORE = 1500, 300
USUAL, USUAL_MORE = 300, 100
ABOUT = """Another world than the one above, written so that it disagrees with the controller: pads F ~ d^1.3 to d^1.9 whose stiffness differs by up to 20 %, 6 to
30 % relaxation, friction that falls by up to 29 % when sliding begins and differs by side, objects off the centre that are free along the grip's axis, minimum-jerk
lifts, knocks, pushes, vibration, pouring, carrying and slickness, frames that come late, with jitter or not at all, errors of force and load. The ranges
of each kind are in `host_tools/simulation/cell/kinds.cpp`. Only SLIDING is computed by the firmware's own code. No grasp needs more than 16 N.

Dropped: slid by 22 mm in all, or never held. Need: what just holds by static friction. A catch: a slide of 0.3 mm or more that ended, with a need of 1.5 N
or more. Hunting: the commanded width turns by 0.05 mm or more, half a time a second or more often, in the 4 s after the last disturbance. Over the cap: a true
force of either pad. First grip over 2x: the mean force before the lift over twice the start force. An egg breaks at 25 N, a strawberry at 5 N, a cup at
3 N; each is held with its preset. What the tool refuses before it moves (a crisp of 1.5 N in a 2F-85) is in no row. The oracle knows the true load, friction and stiffness, and has the same frames, gripper and least move: a bar that it
meets is one that the gripper allows."""
COLUMNS = {
    "row": "kinds",
    "gripper": "gripper",
    "controller": "controller",
    "grasps": "grasps",
    "drops_percent": "dropped, %",
    "margin_p50": "margin: p50",
    "margin_p95": "p95",
    "catches": "catches",
    "peak_over_need_p50": "peak over need: p50",
    "peak_over_need_p95": "p95 ",
    "slid_p50_mm": "slid, mm: p50",
    "slid_p95_mm": "p95  ",
    "reaction_p50_ms": "reaction, ms: p50",
    "hunting_percent": "hunting, %",
    "crushed_percent": "crushed, %",
    "over_cap": "over the cap",
    "first_grip_over_2x_percent": "first grip over 2x, %",
}


def row_of(program, name, gripper, controller, count, seed):
    text = run(program, "--gripper", gripper, "--controller", controller, "--seed", seed, "--count", count, *ROWS[name][0])
    try:
        found = json.loads(text)
    except ValueError as error:
        raise InputError(f"fingertip_grasp_kinds wrote no JSON ({error})") from None
    return {"row": name, **{key: value for key, value in found.items() if key not in ("kind", "seed")}}


def worst(rows, key, name=None):
    values = [row[key] for row in rows if row["controller"] == "ours" and (name is None or row["row"] == name) and row[key] is not None]
    return max(values) if values else None


def figures(rows):
    """What is judged, of all rows of ours."""
    found = {}
    for row in rows:
        if row["controller"] == "ours" and row["row"] == "usual and rough":
            called = CALLED[row["gripper"]]
            for name, key in (
                ("drops_percent", "drops_percent"),
                ("peak_over_need_p50", "peak_over_need_p50"),
                ("margin_median", "margin_p50"),
                ("reaction_ms", "reaction_p50_ms"),
            ):
                found[f"{name}_{called}"] = row[key]
    return found | {
        "slick_drops_percent_worst": worst(rows, "drops_percent", "slick"),
        "peak_over_need_p95_worst": worst(rows, "peak_over_need_p95", "usual and rough"),
        "hunting_percent_worst": worst(rows, "hunting_percent", "usual and rough"),
        "crushed_percent": worst(rows, "crushed_percent", "fragile"),
        "dropped_fragile_percent": worst(rows, "drops_percent", "fragile"),
        "over_cap": sum(row["over_cap"] for row in rows if row["controller"] == "ours"),
        "first_grip_over_2x_percent": worst(rows, "first_grip_over_2x_percent", "usual and rough"),
        "late_40ms_drops_percent": worst(rows, "drops_percent", "usual and rough, 40 ms later"),
        "step_us": worst(rows, "step_us"),
    }


def measure(options, steps):
    program = pathlib.Path(options.build) / "host_tools/report/grasp/fingertip_grasp_kinds"
    if not program.is_file():
        raise InputError(f"{program} is not there; build it: cmake --build --preset host")
    judged, more = (options.grasps, options.grasps) if options.grasps else (USUAL, USUAL_MORE) if options.usual else (GRASPS, GRASPS_MORE)
    rows = []
    for name, (_, is_judged) in ROWS.items():
        for gripper in CALLED:
            for controller in CONTROLLERS if is_judged else ("ours",):
                count = judged if name == "usual and rough" or controller == "ours" and is_judged else more
                rows.append(row_of(program, name, gripper, controller, count, options.seed))
            steps.report(f"{gripper}, {name}: {rows[-1]['grasps']} grasps")
    return {"kinds": rows, **figures(rows)}


def text(found):
    cells = [[CONTROLLERS[row[key]] if key == "controller" else text_of(row.get(key), 3) for key in COLUMNS] for row in found["kinds"]]
    return [*ABOUT.split("\n"), "", *table_md([name.strip() for name in COLUMNS.values()], cells), ""]
