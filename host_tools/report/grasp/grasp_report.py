"""What grasp.py measured as a picture."""

from presentation import plt, save, text_of, tidy
from kinds import GRIPPERS


def labelled(axes, title, label, up=""):
    tidy(axes, title, up, grid="both")
    axes.set_xlabel(label, size=9)


def draw_distribution(axes, found, key, title, label, most):
    for one in found["distributions"]:
        values = one[key]
        shares = [100 * i / (len(values) - 1) for i in range(len(values))] if len(values) > 1 else []
        axes.plot(values, shares, color=GRIPPERS[one["gripper"]][1], label=one["gripper"])
    axes.set_xlim(0, most)
    axes.set_ylim(0, 100)
    axes.legend(fontsize=8, loc="lower right")
    labelled(axes, title, label, "% below")


def draw_drops(axes, found):
    rows = {}
    for row in found["kinds"]:
        name = row["row"] + ("" if row["controller"] == "ours" else f", {row['controller']}")
        rows.setdefault(name, {})[row["gripper"]] = row["drops_percent"]
    for i, (gripper, (_, colour)) in enumerate(GRIPPERS.items()):
        places = [place + 0.26 * (i - 1) for place in range(len(rows))]
        bars = axes.barh(places, [values[gripper] for values in rows.values()], 0.25, color=colour, label=gripper)
        axes.bar_label(bars, [text_of(values[gripper], 2) for values in rows.values()], size=6, padding=2)
    axes.set_yticks(range(len(rows)), list(rows), size=7)
    axes.invert_yaxis()
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=3)
    counts = sorted({row["grasps"] for row in found["kinds"]})
    labelled(axes, "Dropped", f"% of {' to '.join(str(count) for count in dict.fromkeys((counts[0], counts[-1])))} grasps")


def draw(found, path):
    figure, places = plt.subplots(1, 4, figsize=(15, 6), width_ratios=(1.3, 1, 1, 1), layout="constrained")
    draw_drops(places[0], found)
    draw_distribution(places[1], found, "margin", "Grip over the least that holds", "median over the hold", 8)
    draw_distribution(places[2], found, "reaction_ms", "From slip to 5 % more grip", "ms", 120)
    draw_distribution(places[3], found, "slid_mm", "Slid in all, what was not dropped", "mm", 6)
    figure.suptitle("Grasps: simulated, the tool's own controller", x=0.01, ha="left", size=12, weight="bold")
    save(figure, path)
