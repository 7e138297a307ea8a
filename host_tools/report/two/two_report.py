"""The picture of what two.py measured."""

from presentation import BLUE, FAINT, INK, ORANGE, draw_panels, tidy

CALLED = (("one", BLUE), ("pulled", "#8fb4d9"), ("long", ORANGE), ("two", "#4a9a5b"), ("none", FAINT), ("undecided", "#dddddd"))
DISTANCES_mm = (6, 8, 10, 12, 15, 20)
PICTURED = ()


def draw_pairs(axes, rows):
    for ratio, colour in (("1:1", BLUE), ("3:1", ORANGE)):
        line = [rows[f"two, {apart} mm, {ratio}"] for apart in DISTANCES_mm]
        axes.plot(DISTANCES_mm, [row["two_and_right"] for row in line], "o-", color=colour, label=f"{ratio}, two and right")
    axes.set_ylim(0, 105)
    axes.set_xlabel("distance of the two, mm", size=9)
    axes.legend(fontsize=8, loc="lower right")
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
    rows = {row["case"]: row for row in found.get("touches", ())}
    plain = {name: row for name, row in rows.items() if name.count(",") < 3}
    title = "Contact shapes: simulated pads, calibrated, with a dip; the firmware's own code; no real pad"
    panels = ((draw_pairs, rows), (draw_called, plain), (draw_errors, plain))
    panels = [("touches", lambda axes, draw=draw, shown=shown: draw(axes, shown)) for draw, shown in panels]
    draw_panels(found, path, title, (1, 3), (15, 7), panels)
