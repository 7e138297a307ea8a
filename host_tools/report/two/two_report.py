"""What two.py measured as text and as a picture."""

from presentation import BLUE, FAINT, INK, ORANGE, goal_table_md, plt, save, table_md, table_of_dicts_md, text_of, tidy
from fingertip.files import write_text

CALLED = (("one", BLUE), ("pulled", "#8fb4d9"), ("long", ORANGE), ("two", "#4a9a5b"), ("none", FAINT), ("undecided", "#dddddd"))
DISTANCES_mm = (6, 8, 10, 12, 15, 20)
# pair: end of the names of its figures
PAIRS = {"8 mm, 1:1": "8mm", "12 mm, 1:1": "12mm", "10 mm, 3:1": "10mm_3to1"}


def possible_rows(found):
    """(pair, asked, possible with the rubber known, with models of rising errors, found), percent."""
    kinds = (
        "two_possible_rubber_known_percent",
        "two_possible_model_quartered_percent",
        "two_possible_model_halved_percent",
        "two_possible_percent",
        "two_right_percent",
    )
    return [
        (pair, found["goals"][f"two_right_percent_{end}"]["goal"], *(text_of(found[f"{kind}_{end}"], 3) for kind in kinds))
        for pair, end in PAIRS.items()
    ]


def write(found, path):
    lines = [
        "# Contact shapes",
        "",
        "Written by `sh cmake/bootstrap.sh report two`. Simulated pads of 12 mm with a dip, calibrated; the firmware's own code,",
        "as scene shapes runs it. No public recording has two contacts and their truth.",
        "",
        "![Pairs by distance, what touches are called](two.png)",
        "",
        *goal_table_md(found),
        "",
    ]
    if "touches" in found:
        lines += [
            *table_md(
                ("pairs", "asked", "possible, rubber known", "model off by 0.0005", "by 0.001", "by 0.002", "right"), possible_rows(found)
            ),
            "",
            "`possible`: what no judge does better than on such pads, be it with the rubber's response known exactly, or with a model that is off by",
            "this share of the largest reading at each sensor: 0.002, as the firmware states of its own, half or a quarter of it. Noise and the gains'",
            "errors are in all. It is the smaller of two limits, touch by touch: the Cramer-Rao bound of locations and forces, and the likelihood ratio",
            "of the pair to the nearest long contact, of at most 20 mm and Q/F 0.3, of which at most 0.2 % may be called two (pair_bound.py).",
            "",
            "Shares in percent. `two_and_right`: both locations within 1.5 mm and the sum of the forces within 10 %. `off`: of a pair that is called one",
            "or long, from the middle of the forces. `silent`: what the packet shows is off by more than 1 mm, or is one for two, or",
            "two for one, with a standard deviation below 0.6 mm and no shape that shows it. `warned`: the standard deviation is above that. `exact gains`:",
            "a pad whose gains are known without error. `along` and `across`: the pad's longer and shorter side, within 45 degrees. `first`: in the first answer;",
            "all else when the touch has been held for a while. The worse of the two is judged. Edges of 24 mm and more and pairs of cubes are not.",
            "",
            *table_of_dicts_md(found["touches"]),
            "",
        ]
    write_text(path, "\n".join(lines))


def draw_pairs(axes, rows):
    for ratio, colour in (("1:1", BLUE), ("3:1", ORANGE)):
        line = [rows[f"two, {apart} mm, {ratio}"] for apart in DISTANCES_mm]
        axes.plot(DISTANCES_mm, [row["two_and_right"] for row in line], "o-", color=colour, label=f"{ratio}, two and right")
        axes.plot(DISTANCES_mm, [row["possible"] for row in line], "--", color=colour, lw=1, label=f"{ratio}, possible, model off by 0.002")
        axes.plot(
            DISTANCES_mm, [row["possible_rubber_known"] for row in line], ":", color=colour, lw=1, label=f"{ratio}, possible, rubber known"
        )
    axes.set_ylim(0, 105)
    axes.set_xlabel("distance of the two, mm", size=9)
    axes.legend(fontsize=8)
    tidy(axes, "Pairs that are found", "% of touches")


def draw_called(axes, rows):
    names = list(rows)
    left = [0.0] * len(names)
    for called, colour in CALLED:
        shares = [rows[name][called] for name in names]
        axes.barh(range(len(names)), shares, left=left, color=colour, label=called)
        left = [before + share for before, share in zip(left, shares)]
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.legend(fontsize=8, ncols=len(CALLED), loc="lower center", bbox_to_anchor=(0.4, -0.14))
    axes.set_title("What each touch is called, %", loc="left", size=10, color=INK)
    axes.tick_params(labelsize=7.5)


def draw_errors(axes, rows):
    names = [name for name, row in rows.items() if row["one"] + row["pulled"] + row["long"] + row["two"] > 50]
    places = range(len(names))
    axes.bar([x - 0.2 for x in places], [rows[name]["off_p50_mm"] for name in names], 0.38, color=BLUE, label="median")
    axes.bar([x + 0.2 for x in places], [rows[name]["off_p95_mm"] for name in names], 0.38, color=ORANGE, label="95 %")
    axes.set_xticks(places, names, rotation=60, ha="right")
    axes.legend(fontsize=8)
    tidy(axes, "Error of the place, of two the worse", "mm")


def draw(found, path):
    figure, places = plt.subplots(1, 3, figsize=(15, 7), layout="constrained")
    if "touches" in found:
        rows = {row["case"]: row for row in found["touches"]}
        plain = {name: row for name, row in rows.items() if name.count(",") < 3}
        draw_pairs(places[0], rows)
        draw_called(places[1], plain)
        draw_errors(places[2], plain)
    else:
        for axes in places:
            axes.set_axis_off()
    figure.suptitle(
        "Contact shapes: simulated pads, calibrated, with a dip; the firmware's own code; no real pad",
        x=0.01,
        ha="left",
        size=12,
        weight="bold",
    )
    save(figure, path)
