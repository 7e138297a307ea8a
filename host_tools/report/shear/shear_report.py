"""What shear.py measured, as text and as a picture."""

import numpy as np
from presentation import BLUE, FAINT, GOAL, INK, ORANGE, goal_table_md, plt, save, table_md, table_of_dicts_md, text_of
from fingertip.files import write_text

USUAL = (
    "pads of 10 % gain spread after a calibration, 12 mm of rubber without end, noise of OSR 1024, 1 to 10 N, seven objects at any angle (spheres of "
    "6 and 15 mm, flat ends of a cylinder and a cube of 6 mm, ping-pong ball, rubber duck, lime), anywhere on the array (|x| <= 9 mm, |y| <= 18 mm), "
    "the tangential force Q in any direction, risen while the normal force F stayed, at a friction of 0.5"
)
# figure, or the beginning of its name: what differs from the usual case
OVER = (
    ("ratio_error_*", "Q/F = 0.3: error of the size of Q / F, the ratio that is published"),
    ("vector_error_*", "Q/F = 0.3: error of Q / F as a vector"),
    ("direction_p90_deg", "Q/F = 0.3"),
    ("no_lime_no_corner_*", "the same without the lime, and without locations within half a pitch of both outer rows"),
    ("location_loaded_*", "Q/F = 0.3, all touches: where the estimate is not valid, the Gaussian's; `without`: the Gaussian's"),
    ("location_price_mm, location_unloaded_*", "Q = 0: median with the estimate less the median without"),
    ("equal_*", "pads of equal gains"),
    ("force_*", "Q/F = 0.3; a known weight has calibrated each pad's scale"),
    ("q_cover_*, location_cover_*", "Q/F = 0.3: share of true values within 1 and 2 estimated standard deviations; ideal 63 and 98 %"),
    (
        "elongated_false_percent",
        "Q = 0 at every angle: five lying cylinders (6 by 12, 12 by 12, 18 by 18, 24 by 24, 22 by 7 mm) and an edge of 20 mm, equally; "
        "valid, and claims more than 0.05 and more than two standard deviations",
    ),
    (
        "elongated_false_surely_percent",
        "claims more than 2.8 standard deviations, below which 98 % of a normal distribution in the plane are",
    ),
    ("elongated_false_unflagged_percent", "those of `elongated_false_percent` that the Gaussian fit does not flag as elongated"),
    ("learned_ratio_error_p50, _p95", "the profile of the thickness that each of 20 calibrations found"),
    ("dip_*", "Q/F = 0.3; rubber with the twin's dip of 5 %, calibrated as it is; a tangential force has no dip of its own"),
    ("cast_*", "the same on pads like real arrays: gains of 20 %, dip of 5 %, sensors 0.1 mm off their locations and 3.5 % apart in width"),
    ("told_wrong_said_percent", "calibrations that warn where the set thickness is 15 % less or more than the true one"),
    ("told_right_said_percent", "calibrations that warn where the set thickness is the true one"),
    ("raw_beyond_2sd_percent", "Q = 0, pads of 10 % that were never calibrated: share with a valid estimate beyond two of its q_sd_N"),
    (
        "screw_ratio, screw_change_p95",
        "a screw by a sphere of 15 mm, 6 N: the estimate while it spins (median), and how much it differs from before",
    ),
    (
        "zero_error_p50_*mm, increment_error_p50_*mm",
        "a block with this much rubber beyond the outer sensors, the profile with its thickness alone: the estimate at Q = 0; that at Q/F = 0.3 less "
        "that at the beginning of the same touch, at 0.5 to 2 N. As vectors",
    ),
    ("*_own_tables_*mm", "the same, the profile with the effect of the pad's ends as well"),
    ("zero_error_p50_own_tables", "the worse of 9 and 13 mm"),
    ("lift_*, slide_*", "lifts and slides of the twin, as in the first row of their table"),
    ("optimum_*", "the estimate on the chip against an independent one in double precision, on readings of the model itself"),
    ("shear_cycles", "of the estimate alone on the emulated chip, most of 100 presses"),
    ("chip_*", "an image of scene grasp on the emulated board with a data line for each sensor; `fps`: frames with an estimate"),
)
COLUMNS = {
    "case": "case",
    "touches": "touches",
    "valid_percent": "valid %",
    "ratio_error_p50": "ratio p50",
    "ratio_error_p95": "p95",
    "vector_error_p50": "vector p50",
    "vector_error_p95": "p95",
    "direction_p90_deg": "direction p90, deg",
    "elongated_percent": "flagged elongated %",
    "claimed_percent": "claims a force %",
    "claimed_surely_percent": "surely %",
    "claimed_unflagged_percent": "claims, not flagged %",
    "location_p50_mm": "location p50, mm",
    "location_p95_mm": "p95",
    "location_without_p50_mm": "without: p50",
    "location_without_p95_mm": "p95",
    "force_p50_percent": "force p50, %",
    "force_without_p50_percent": "without",
    "q_cover_1sd": "Q within 1 sd, %",
    "q_cover_2sd": "2 sd",
    "location_cover_1sd": "location within 1 sd, %",
    "location_cover_2sd": "2 sd",
}
TAPS = {
    "location_without_p50_mm": "location before, mm: p50",
    "location_without_p95_mm": "p95",
    "location_p50_mm": "after: p50",
    "location_p95_mm": "p95",
    "force_without_p50_percent": "force before: p50, %",
    "force_p50_percent": "after",
    "force_scaled_without_p50_percent": "force scaled before: p50, %",
    "force_scaled_p50_percent": "after",
    "elongated_percent": "flagged elongated, %",
}
# table: title, what is in it
TABLES = {
    "by_pad_and_load": (
        "By pad and tangential force",
        "`sliding`: Q = 0.5 F and all of the contact slides; `risen with the force`: nothing slides.",
    ),
    "by_place": (
        "By location",
        "Q/F = 0.3. Inner: half a pitch inside the outer sensors (|x| <= 4.5 mm, |y| <= 13.5 mm); border: within half a pitch of one "
        "outer row of them; corner: of two.",
    ),
    "where_misses_lie": ("Where the misses lie", "Q/F = 0.3, by object and location."),
    "by_cast": (
        "Pads with a dip",
        "Pads without a dip, with one of 5 %, and like real arrays (gains of 20 %, dip of 5 %, sensors 0.1 mm off their locations and 3.5 % apart in "
        "width). Each is calibrated as it is; the touches are the same. The estimate knows the dip that the calibration found. It knows neither the "
        "sensors' own locations nor their widths, which the fingertip does not keep: pads like real ones lose by these.",
    ),
    "by_object": ("By object", ""),
    "elongated": ("Elongated objects without a tangential force", ""),
    "by_force": ("By force", "Q/F = 0.3."),
    "light_touches": ("Light touches", ""),
    "by_osr": ("By oversampling", "Q/F = 0.3."),
    "by_sensors": ("Sensors missing", "Q/F = 0.3; which are missing is drawn for each touch."),
    "by_thickness": (
        "By thickness",
        "Spheres of 6 and 15 mm, flat cylinder of 6 mm; the true thickness and the set one. Sensors beyond their range are left out.",
    ),
    "by_rubber": (
        "Creep and relaxation",
        "Gains are equal, or calibrated to what placements read 0.75 s after. Press of 0.3 s; the tangential force comes after 1 s, within "
        "0.3 s, and goes after 11.3 s.",
    ),
    "screws": ("Screws", "Objects under a torque, without a tangential force."),
    "by_overhang": ("Pads that end", "Finite block, edges free; by the profile: the thickness alone, or the effect of the ends as well."),
}


def rows_md(rows):
    """With short names where a row is one of touches."""
    if "ratio_error_p50" not in rows[0]:
        return table_of_dicts_md(rows)
    columns = [name for name in COLUMNS if any(name in row for row in rows)]
    columns += [name for name in dict.fromkeys(key for row in rows for key in row) if name.startswith("off_by_")]
    return table_md([COLUMNS.get(name, name) for name in columns], [[text_of(row.get(name), 3) for name in columns] for row in rows])


def bounds_md(found):
    """The bounds with what was found between them."""
    rows = [dict(row) for row in found["bounds"]]
    for row in found["by_pad_and_load"]:
        if row["load"] == 0.3 and "risen" not in row["case"]:
            rows.append({**{name: row.get(name) for name in rows[0]}, "case": f"found: {row['pad']}"})
    return rows_md(rows)


def taps_md(rows):
    """The paper's table II under a tangential force, before and after."""
    cells = [[row["pad"], text_of(row["load"]), *(text_of(row[name], 3) for name in TAPS)] for row in rows]
    return table_md(("pad", "Q/F", *TAPS.values()), cells)


def missed_md(found):
    """In words, what of the usual case is off, by object and location."""
    worst = sorted(found.get("where_misses_lie", ()), key=lambda row: -(row["off_by_0_05_percent"] or 0) * row["touches"])
    total = sum(row["off_by_0_05_percent"] * row["touches"] for row in worst)
    if not total:
        return []
    named = ", ".join(f"{row['case']} ({100 * row['off_by_0_05_percent'] * row['touches'] / total:.0f} %)" for row in worst[:4])
    return ["", f"Of all touches whose Q / F is off by more than 0.05, most are of: {named}."]


def write(found, path):
    lines = [
        "# Tangential force",
        "",
        "Written by `sh cmake/bootstrap.sh report`. Simulated pads and touches, the firmware's own code. No measurement on a real",
        "pad confirms the size or the accuracy of what is read; the shift of the centroid of one thickness for each unit of Q / F follows from the",
        "balance of moments.",
        "",
        "![Errors by place, arrows, location before and after, bounds](shear.png)",
        "",
        *goal_table_md(found),
        "",
        f"The usual case: {USUAL}.",
        "",
        *table_md(("figure", "what differs from the usual case"), OVER),
        *missed_md(found),
        "",
    ]
    if "bounds" in found:
        lines += [
            "## What is physics and what is ours",
            "",
            "Cramer-Rao bounds of the eight unknowns (force, location, spread, two elongations, Q): what errors of the "
            "readings alone cost any unbiased estimate. A model floor is an error of each reading of its own, as a share of the peak. Gains are "
            "those after a calibration. Priors: spread and elongation as the firmware expects them; assumed round: no elongation.",
            "",
            *bounds_md(found),
            "",
        ]
    if "taps" in found:
        lines += [
            "## What a tangential force does to every figure published so far",
            "",
            "The taps of the paper's table II (|x| <= 4.5 mm, |y| <= 13.5 mm, 1 to 15 N, "
            "four indenters, readings at 20 Hz of 1 N or more, relative to the true zero), each under a tangential force of the same share of its normal one. Before: "
            "the Gaussian, as published so far. Scaled: with each pad's own factor. Nothing here is elongated: the Gaussian fit flags it so because of the tangential force.",
            "",
            *taps_md(found["taps"]),
            "",
        ]
    for name, (title, about) in TABLES.items():
        if name in found:
            lines += [f"## {title}", "", about, "", *rows_md(found[name]), ""]
    known = {"bounds", "taps", "map", "arrows", "location_quantiles", *TABLES}
    for name, rows in found.items():
        if name not in known and isinstance(rows, list) and rows and all(isinstance(row, dict) for row in rows):
            lines += [f"## {name.replace('_', ' ')}", "", *table_of_dicts_md(rows), ""]
    write_text(path, "\n".join(lines))


def tidy(axes, title, label=""):
    axes.set_title(title, loc="left", size=10, color=INK)
    axes.set_ylabel(label, size=9)
    axes.tick_params(labelsize=8)


def draw_map(axes, figure, cells):
    xs, ys = (sorted({cell[name] for cell in cells}) for name in ("x_mm", "y_mm"))
    values = {(cell["x_mm"], cell["y_mm"]): cell["vector_error_p50"] for cell in cells}
    step = xs[1] - xs[0]
    grid = np.array([[values[x, y] for x in xs] for y in ys], dtype=float)
    extent = (xs[0] - step / 2, xs[-1] + step / 2, ys[0] - step / 2, ys[-1] + step / 2)
    image = axes.imshow(grid, origin="lower", extent=extent, cmap="viridis", vmin=0)
    axes.plot(*zip(*((9 * i, 9 * k) for i in (-1, 0, 1) for k in range(-2, 3))), "o", color="white", mec=INK, ms=4, clip_on=False)
    figure.colorbar(image, ax=axes, shrink=0.8).ax.tick_params(labelsize=8)
    tidy(axes, "Error of Q/F by place\n(median, Q/F = 0.3; dots: sensors)", "y, mm")
    axes.set_xlabel("x, mm", size=9)


def draw_arrows(axes, arrows):
    scale = 25  # mm for Q/F = 1
    for arrow in arrows:
        for x, y, qx, qy, colour, width in (
            (arrow["x_mm"], arrow["y_mm"], arrow["qx"], arrow["qy"], GOAL, 3),
            (arrow["estimated_x_mm"], arrow["estimated_y_mm"], arrow["estimated_qx"], arrow["estimated_qy"], BLUE, 1.2),
        ):
            axes.annotate(
                "",
                (x + scale * qx, y + scale * qy),
                (x, y),
                arrowprops={"arrowstyle": "->", "color": colour, "lw": width, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8},
            )
        axes.plot(arrow["without_x_mm"], arrow["without_y_mm"], "x", color=ORANGE, ms=5)
    for colour, style, label in ((GOAL, "-", "true"), (BLUE, "-", "estimated"), (ORANGE, "x", "location without the correction")):
        axes.plot([], [], style, color=colour, label=label)
    axes.plot(*zip(*((9 * i, 9 * k) for i in (-1, 0, 1) for k in range(-2, 3))), ".", color=FAINT, ms=3)
    axes.set_xlim(-15, 15)
    axes.set_ylim(-22, 27)
    axes.set_aspect("equal")
    axes.legend(fontsize=7, loc="upper right")
    tidy(axes, "Fifteen touches of 5 N that pull by 1.5 N\n(sphere of 15 mm, a calibrated pad)", "y, mm")
    axes.set_xlabel("x, mm", size=9)


def draw_location(axes, rows):
    for load, style in ((0, "--"), (0.3, "-")):
        some = [row for row in rows if row["load"] == load]
        for key, colour, label in (("without_mm", ORANGE, "before"), ("with_mm", BLUE, "after")):
            axes.plot([row[key] for row in some], [row["percent"] for row in some], style, color=colour, label=f"{label}, Q/F = {load:g}")
    axes.set_xscale("log")
    axes.set_xlim(0.01, 3)
    axes.grid()
    axes.legend(fontsize=8)
    axes.set_xlabel("error of the location, mm", size=9)
    tidy(axes, "Location before and after (calibrated pads)", "% of touches below")


def draw_bounds(axes, found):
    rows = [(row["case"].replace("; priors", ""), row["vector_error_p50"], FAINT) for row in found["bounds"] if ";" in row["case"]]
    rows += [
        (f"found: {row['pad']}", row["vector_error_p50"], BLUE)
        for row in found["by_pad_and_load"]
        if row["load"] == 0.3 and "risen" not in row["case"]
    ]
    places = range(len(rows))
    axes.barh(places, [value for _, value, _ in rows], color=[colour for *_, colour in rows])
    axes.set_yticks(places, [name for name, *_ in rows], size=7)
    axes.set_xscale("log")
    axes.invert_yaxis()
    axes.grid(axis="x")
    axes.axvline(0.02, color=GOAL, lw=1, ls="--")
    axes.set_xlabel("median error of Q/F, at 0.3 (dashed: goal)", size=9)
    tidy(axes, "Cramer-Rao bounds with the priors (grey)\nand what was found")


def draw_objects(axes, rows):
    rows = sorted((row for row in rows if row["load"] == 0.3), key=lambda row: (row["vector_error_p50"] is None, row["vector_error_p50"]))
    places = range(len(rows))
    axes.bar(places, [row["vector_error_p50"] or 0 for row in rows], 0.7, color=BLUE, label="median")
    axes.plot(places, [row["vector_error_p95"] for row in rows], "_", color=INK, ms=8, label="95 %")
    for x, row in enumerate(rows):
        if row["valid_percent"] < 99:
            axes.annotate(
                f"{row['valid_percent']:.0f} %", (x, row["vector_error_p95"] or 0), ha="center", va="bottom", size=7, color=ORANGE
            )
    axes.set_xticks(places, [row["object"] for row in rows], rotation=60, ha="right")
    axes.axhline(0.05, color=GOAL, lw=1, ls="--")
    axes.grid(axis="y")
    axes.legend(fontsize=8, loc="upper left")
    tidy(axes, "Error of Q/F by object (orange: share that is valid)", "error at Q/F = 0.3")


def draw_overhang(axes, rows):
    rows = sorted((row for row in rows if row["place"] == "anywhere"), key=lambda row: row["overhang_mm"])
    overhangs = sorted({row["overhang_mm"] for row in rows})
    bars = (
        ("thickness", "zero_error_p50", "#f0c891", "zero, thickness set"),
        ("thickness", "increment_error_p50", "#9cc1f0", "increment since first touch"),
        ("thickness and ends", "zero_error_p50", ORANGE, "zero, ends set"),
        ("thickness and ends", "increment_error_p50", BLUE, "increment"),
    )
    for place, (profile, key, colour, label) in enumerate(bars):
        heights = [next(row[key] for row in rows if (row["profile"], row["overhang_mm"]) == (profile, overhang)) for overhang in overhangs]
        axes.bar([x + 0.2 * (place - 1.5) for x in range(len(overhangs))], heights, 0.19, color=colour, label=label)
    axes.set_xticks(range(len(overhangs)), [f"{overhang:g} mm" for overhang in overhangs])
    axes.axhline(0.05, color=GOAL, lw=1, ls="--")
    axes.grid(axis="y")
    axes.legend(fontsize=8)
    axes.set_xlabel("rubber beyond the outer sensors, 12 mm thick", size=9)
    tidy(axes, "Pads that end", "median error of Q/F")


def draw(found, path):
    """Only what was measured."""
    figure, places = plt.subplots(2, 3, figsize=(15, 9.5), layout="constrained")
    panels = (
        ("map", lambda axes: draw_map(axes, figure, found["map"])),
        ("arrows", lambda axes: draw_arrows(axes, found["arrows"])),
        ("location_quantiles", lambda axes: draw_location(axes, found["location_quantiles"])),
        ("bounds", lambda axes: draw_bounds(axes, found)),
        ("by_object", lambda axes: draw_objects(axes, found["by_object"])),
        ("by_overhang", lambda axes: draw_overhang(axes, found["by_overhang"])),
    )
    for axes, (name, panel) in zip(places.flat, panels):
        if name in found:
            panel(axes)
        else:
            axes.set_axis_off()
    figure.suptitle("Tangential force: simulated pads, the firmware's own code", x=0.01, ha="left", size=12, weight="bold")
    save(figure, path)
