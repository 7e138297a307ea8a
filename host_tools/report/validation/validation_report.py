"""What validation.py measured as text and pictures, beside the paper's figures.

write_report takes the dict that is in validation.json, draw the arrays of validation.curves; neither measures anything.
"""

import cards
import numpy as np
from presentation import BLUE, FAINT, INK, ORANGE, goal_table_md, plt, save, table_md
from fingertip.files import SENSOR_X_mm, SENSOR_Y_mm, write_text

NAMES = {
    "sphere6": "Small spherical indenter",
    "sphere15": "Large spherical indenter",
    "cylinder6": "Cylindrical indenter",
    "cube6": "Cubical indenter",
    "ball_bearing": "Ball bearing",
    "bottle_cap": "Bottle cap",
    "lime": "Lime",
    "ping_pong": "Ping-pong ball",
    "rubber_duck": "Rubber duck",
}
CASES = {
    "gain0": "equal sensors",
    "gain10": "gains 10 % apart",
    "dip": "gains 10 % apart, dip",
    "gain10 calibrated": "gains 10 % apart, calibrated",
    "dip calibrated": "gains 10 % apart, dip, calibrated",
    "every effect": "every effect",
}

# Of the paper: median and standard deviation of the localisation error, mm (table II).
PAPER_LOCATION_mm = {
    ("grid", "sphere6"): (0.55, 0.84),
    ("grid", "sphere15"): (0.48, 0.33),
    ("taps", "sphere6"): (0.52, 1.42),
    ("taps", "sphere15"): (0.53, 0.26),
    ("taps", "cylinder6"): (0.55, 0.70),
    ("taps", "cube6"): (0.85, 0.98),
}
PAPER_NEAR_mm = {"1": 0.54, "2": 0.48, "4": 0.59}  # section IV.B
# RMSE in N and MAPE in percent (section IV.C), r over all samples.
PAPER_FORCE = {"taps": (0.54, 4.5), "pokes": (1.49, 10.2), "high": (4.67, 15.7)}
PAPER_R = 0.985
# Success of the slip detection per step, percent (tables III and IV).
PAPER_SLIP = {
    "ball_bearing": 82.3,
    "bottle_cap": 82.7,
    "lime": 82.6,
    "ping_pong": 78.3,
    "rubber_duck": 79.7,
    "sphere12": 80.5,
    "sphere18": 85.4,
    "sphere24": 82.0,
    "cylinder12": 78.9,
    "cylinder18": 77.5,
    "cylinder24": 81.1,
    "cube12": 84.0,
    "cube18": 76.9,
    "cube24": 77.6,
}
PAPER_SLIP_ALL = 81.1


class Report:
    def __init__(self):
        self.lines = []

    def text(self, *lines):
        self.lines += [*lines, ""]

    def table(self, header, rows):
        self.lines += [*table_md(header, rows), ""]

    def write(self, path):
        write_text(path, "\n".join(self.lines))


def pick(rows, **wanted):
    """The first of them that has these values, or None."""
    return next((row for row in rows if all(row[name] == value for name, value in wanted.items())), None)


def span(values, digits=2):
    low, high = (f"{value:.{digits}f}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def write_report(found, path):
    r = Report()
    r.text(
        "# The published experiments on the simulated fingertip",
        "Columns headed *paper* are measured on hardware (De Clercq et al., RA-L 2022). Columns headed *simulated* come from the twin: an "
        "elastic layer under the paper's indenters, the firmware's own code on simulated sensors. The two do not compare as better and worse: "
        "a simulated pad is as straight, as bonded and as quiet as its settings.",
        f"{found['samples']} samples (frames in contact with a fit) out of {found['frames']} frames, at {found['rate_Hz']} Hz where nothing else is "
        f"named, OSR 1024, in {found['seconds']:.0f} s. The image on the emulated chip played {found['emulated_frames']} frames of such taps: "
        f"{found['emulated_frames'] - found['emulated_frames_different']} of its contact packets are what the same code gives here, byte for "
        f"byte. Layers: rubber of Shore 15 A, 12 mm unless another thickness is named. Unequal sensors are drawn for {found['pads']} pads.",
    )
    write_dip(found, r)
    r.text("## Figures and goals")
    r.text(*goal_table_md(found))
    write_location(found, r)
    write_force(found, r)
    write_stiff(found, r)
    if found["saturated_median_mm"] is not None:
        r.text(
            "## Beyond the range: 25 to 50 N",
            f"Sensors beyond 2 bar are left out of the fit ({found['saturated_samples']} samples): median error {found['saturated_median_mm']:.3f} mm; "
            f"with readings that come out low by up to 1 % above 1.2 bar {found['saturated_biased_median_mm']:.3f} mm.",
        )
    write_slip(found, r)
    write_budget(found, r)
    if found["validate_finds"] is not None:
        r.text(*cards.text(found))
    r.text(
        "## What is not the paper",
        "The pad has no edges, no friction and no large strain; at high forces a ball of 6 mm would be pressed in deeper than the layer "
        "allows. The objects are substitutes whose shape is ours. Relaxation and hysteresis act on the readings at a given force. The paper's layer "
        "thickness and gains are not known.",
    )
    r.text(
        "![Signals of the fifteen sensors during taps](validation_signals.png)",
        "*Readings of the fifteen sensors and the force, as the paper's Fig. 6: gain spread 10 %, dip, relaxation.*",
    )
    r.write(path)


def write_dip(found, r):
    taps = {row["case"]: row for row in found["taps_trust"]}
    r.text(
        "## Pads with a dip",
        "On recordings of real pads a sensor three to five widths away from a press reads 1 to 2 % of the peak below its zero. The paper's model has no "
        "such dip. So each figure is beside the same one on pads whose rubber has the twin's dip of 5 %, which leaves that much "
        "([twin](../../host_tools/simulation/twin/README.md)). The columns with a dip and without have the same sensors and the same presses. "
        "*Calibrated*: a weight of 3 N on a ball was set down before, as `fingertip calibrate` asks for it; the firmware has what it found. On 12 mm that "
        "is the pad's profile too, as scene `grasp` takes it. "
        f"{found['calibrated_pads']} pads were calibrated. {found['sessions_refused']} sessions were refused. Pads on which the first five were, so that they "
        f"have no calibrated rows: {found['refused_pads']}.",
        f"What the dip changes on 12 mm: without a calibration the taps are off by {found['h12_dip_median_mm']:.2f} mm in the median, and by "
        f"{found['h12_gain10_median_mm']:.2f} mm without a dip; {taps['dip']['warned_percent']:.0f} % of the samples carry a warning, not "
        f"{taps['gain10']['warned_percent']:.0f} %, and {taps['dip']['bad_unflagged_percent']:.1f} % are off by more than 1 mm without one, not "
        f"{taps['gain10']['bad_unflagged_percent']:.1f} %. Calibrated it is {found['h12_dip_calibrated_median_mm']:.2f} mm, and "
        f"{found['h12_gain10_calibrated_median_mm']:.2f} mm without a dip.",
    )


def write_location(found, r):
    r.text(
        "## Where: localisation",
        "Median / standard deviation of the error in mm, samples of at least 1 N (paper: table II). Unequal sensors: "
        f"medians of the pads' taps {span(found['h12_gain10_median_mm_per_pad'])} mm.",
    )
    rows = []
    for (kind, indenter), paper in PAPER_LOCATION_mm.items():
        cells = [pick(found["location"], kind=kind, indenter=indenter, case=case) for case in CASES]
        if any(cells):
            label = {"grid": "Sampling grid", "taps": "Random taps, 1 to 15 N"}[kind]
            rows.append(
                (
                    label,
                    NAMES[indenter],
                    "{} / {}".format(*paper),
                    *(f"{c['median_mm']:.3f} / {c['sd_mm']:.3f}" if c else "-" for c in cells),
                )
            )
    r.table(("", "", "paper", *CASES.values()), rows)
    r.text(
        "Of the taps, "
        + "; ".join(
            f"{CASES[row['case']]}: {row['warned_percent']:.1f} % carry a warning, {row['bad_unflagged_percent']:.2f} % are off by more than 1 mm "
            "without one"
            for row in found["taps_trust"]
        )
        + ". UNCERTAIN begins at a standard deviation of 0.6 mm, in which the firmware counts the spread "
        "of gains of a pad that was never calibrated, whatever it is here."
    )
    near_mm = found["grid_median_mm_by_sensors_near"]
    r.text("By place on the grid, gain spread 10 % (paper: section IV.B), median in mm:")
    r.table(
        ("place", "paper", "simulated"),
        [
            (label, PAPER_NEAR_mm[n], f"{near_mm[n]:.3f}")
            for n, label in (("1", "above a sensor"), ("2", "between two"), ("4", "between four"))
            if n in near_mm
        ],
    )

    paper_mm = PAPER_LOCATION_mm["taps", "sphere6"][0]
    spreads = [row for row in found["budget"] if row["effect"] == "nothing but the model" or row["effect"].startswith("gain spread")]
    medians = [row["median_mm"] for row in spreads]
    if paper_mm <= max(medians):
        spread = f"are what a gain spread of {np.interp(paper_mm, medians, [row['gain'] for row in spreads]):.0f} % would give here"
    else:
        spread = f"are more than a gain spread of {spreads[-1]['gain']} % gives here ({medians[-1]:.2f} mm)"
    taps = [row for row in found["location"] if row["kind"] == "taps"]
    r.text(
        "What remains with equal sensors is the difference between a layer's pressure and a Gaussian; the gains of the sensors dominate "
        f"everything else (error budget below). The paper's {paper_mm} mm for taps of the small sphere {spread}. Its standard deviations of up to "
        f"{max(sd for _, sd in PAPER_LOCATION_mm.values())} mm have outliers of several mm; the worst tap here is off by {max(row['max_mm'] for row in taps):.1f} mm."
    )
    cube = pick(taps, indenter="cube6", case="gain0")
    others = [row["median_mm"] for row in taps if row["case"] == "gain0" and row is not cube]
    if cube and others:
        r.text(
            f"The paper finds the cube worse than the others ({PAPER_LOCATION_mm['taps', 'cube6'][0]} mm). Here its median with equal sensors is "
            f"{cube['median_mm']:.3f} mm, that of the others {span(others, 3)} mm: under 12 mm of rubber the shape of a face of 6 mm is all but gone."
        )


def write_force(found, r):
    pressed = found["gaussians"]
    shares = [g["force_share"] for g in pressed if g["indenter"] in NAMES]
    wide = [g for g in pressed if g["indenter"] not in NAMES and not 0.85 <= g["force_share"] <= 0.95]
    r.text(
        "## How hard: force",
        "RMSE in N / MAPE in % (median) / correlation r. *Scaled*: times one factor, "
        f"{found['force_scale_gain0']:.3f}, found on the taps with equal sensors, with a dip {found['force_scale_dip']:.3f}, found on its own. A calibration has a "
        "factor of its own.",
        "The paper's F = 2 pi p0 sigma^2 is low for physics: under 2 N of the paper's indenters and objects the Gaussian that fits the pressure on "
        f"the base best holds {span(shares)} of the force, on 12 mm and on 6 mm; the rest is in tails that fall off slower. One known weight finds "
        "the factor."
        + (
            " Wide faces are no Gaussian and have factors of their own: "
            + ", ".join(f"{g['indenter']} on {g['layer_mm']} mm {g['force_share']:.2f}" for g in wide)
            + "."
            if wide
            else ""
        ),
    )
    rows = []
    for kind, label in (("taps", "Robot taps, 1 to 15 N"), ("pokes", "Five objects, 0 to 25 N"), ("high", "25 to 50 N, clip at 2 bar")):
        for case, name in CASES.items():
            if row := pick(found["force"], kind=kind, case=case):
                raw, scaled = row["raw"], row["scaled"]
                rows.append(
                    (
                        label,
                        "{} / {}".format(*PAPER_FORCE[kind]),
                        name,
                        f"{raw['rmse_N']:.2f} / {raw['mape_percent']:.1f} / {raw['r']:.4f}",
                        "its own" if "calibrated" in case else f"{scaled['rmse_N']:.2f} / {scaled['mape_percent']:.2f}",
                    )
                )
    r.table(("", "paper", "pad", "simulated", "the same, scaled"), rows)
    r.text(
        f"Over all samples of at least 1 N, every effect among them, r = {found['force_r']:.4f} (paper: {PAPER_R}).",
        "![Force: taps, an object, all samples, a quasi-static loop](validation_force.png)",
    )


def write_stiff(found, r):
    areas = {0: "the paper's grid, 9 by 27 mm", 4.5: "up to the outer sensors, 18 by 36 mm", 10: "all but the pad's edge, 29 by 47 mm"}
    widths_mm = [g["sigma_mm"] for g in found["gaussians"] if g["layer_mm"] == 6]
    r.text(
        "## A stiff pad: layer of 6 mm",
        f"There the pressure is narrow: best Gaussians have a sigma of {span(widths_mm)} mm, at a pitch of 9 mm. Taps at random places, without and "
        f"with a prior on sigma, their mean ({found['prior_sigma_mm']:.2f} mm) with a standard deviation of {found['prior_width_mm']} mm. *Unflagged*: "
        "off by more than 1 mm without a warning. Force after one factor for the pad.",
    )
    r.table(
        ("where", "pad", "prior", "median mm", "99 % mm", "off by 1 mm", "warned", "unflagged", "force off, median / 95 %"),
        [
            (
                areas[row["margin_mm"]],
                CASES[row["case"]],
                "yes" if row["prior"] else "no",
                f"{row['median_mm']:.3f}",
                f"{row['p99_mm']:.2f}",
                f"{row['bad_percent']:.1f} %",
                f"{row['warned_percent']:.1f} %",
                f"{row['bad_unflagged_percent']:.2f} %",
                f"{row['force']['mape_percent']:.1f} % / {row['force']['p95_percent']:.0f} %",
            )
            for row in found["stiff"]
        ],
    )
    parts = []
    for margin_mm, area in areas.items():
        without, given = (pick(found["stiff"], margin_mm=margin_mm, case="gain0", prior=prior) for prior in (False, True))
        helps = given["p99_mm"] < 0.5 * without["p99_mm"]
        parts.append(
            f"{area}: {'it decides' if helps else 'it is not needed'}, 99 % are within {given['p99_mm']:.2f} mm with it and within "
            f"{without['p99_mm']:.2f} mm without"
        )
    r.text("What the prior is worth with equal sensors, by where the presses are: " + "; ".join(parts) + ".")
    outer = {(row["case"], row["prior"]): row for row in found["stiff"] if row["margin_mm"] == 4.5}
    r.text(
        "On rubber as thin as this the dip decides. Up to the outer sensors the median without a calibration is "
        f"{outer['gain10', False]['median_mm']:.2f} mm without a dip and {outer['dip', False]['median_mm']:.2f} mm with it, "
        f"{outer['dip', True]['median_mm']:.2f} mm with the prior. Calibrated it is {outer['dip calibrated', False]['median_mm']:.2f} mm, "
        f"{outer['dip calibrated', False]['bad_unflagged_percent']:.2f} % off by more than 1 mm without a warning."
    )


def latency(success):
    """Median / 95 % in ms, and how many were never found."""
    if success["latency_median_ms"] is None:
        return "none found"
    missed = f", {success['contacts_not_found']} of {success['contacts']} not found" if success["contacts_not_found"] else ""
    return f"{success['latency_median_ms']:.0f} / {success['latency_p95_ms']:.0f}{missed}"


def percent(success):
    return f"{success['success_percent']:.1f} %" if success["steps"] else "-"


def write_slip(found, r):
    r.text(
        "## Slip, step by step",
        "Success per step of 50 ms: SLIP against whether the pusher moves, from half a second before it starts to half a second after it "
        "stops; eq. (7), n = 2, threshold 0.75 mm, 20 Hz; speeds 20, 50, 100, 150 and 200 mm/s over 24 mm; elastic dead travel of 1 mm, which "
        "counts as slip as in the paper. The contact moves by the kinematics of `twin scenario slip`: in the paper friction decides.",
    )
    rows = []
    for row in found["slip_by_object"]:
        name = row["indenter"]
        label = NAMES.get(name, f"{name.rstrip('0123456789').capitalize()}, {name.lstrip('abcdefghijklmnopqrstuvwxyz')} mm")
        rows.append(
            (
                label,
                f"{PAPER_SLIP[name]} %",
                percent(row["steady"]),
                percent(row["stick-slip"]),
                latency(row["steady"]),
                percent(row["dip"]),
                percent(row["dip calibrated"]),
            )
        )
    r.text("Latency: from the pusher's start to the first SLIP, median / 95 %, ms.")
    r.table(
        ("", "paper", "simulated, steady", "simulated, stick-slip of 2 mm", "latency, steady", "steady, dip", "steady, dip, calibrated"),
        rows,
    )
    if found["slip_success_percent"] is not None:
        r.text(
            f"Over all: {found['slip_success_percent']:.1f} % of {found['slip_steps']} steps, steady (paper: {PAPER_SLIP_ALL} % over its five objects); with a dip "
            f"{found['slip_success_dip_percent']:.1f} %, calibrated {found['slip_success_dip_calibrated_percent']:.1f} %. "
            "The steps that are missed are the first of each slip and the dead travel; those found too many are the last, since the mean of "
            "the past two places lags. That the objects hardly differ is the model's doing: it has no friction that would."
        )
    r.text(
        "By speed, over all objects; beside it the sphere of 18 mm with every frame that the sensors give, where eq. (7) covers the "
        "same 0.1 s:"
    )
    r.table(
        ("speed", "success", "latency", "success, every frame", "latency, every frame", "success, dip", "success, dip, calibrated"),
        [
            (
                f"{row['speed_mm_s']:g} mm/s",
                percent(row["paper_rate"]),
                latency(row["paper_rate"]),
                percent(row["every_frame"]),
                latency(row["every_frame"]),
                percent(row["dip"]),
                percent(row["dip calibrated"]),
            )
            for row in found["slip_by_speed"]
        ],
    )
    r.text("By dead travel, sphere of 18 mm:")
    r.table(
        ("dead travel", "success", "latency"),
        [(f"{row['dead_travel_mm']:g} mm", percent(row), latency(row)) for row in found["slip_by_dead_travel"]],
    )
    r.text(
        "![Reconstructed pressure during a slip](validation_slip.png)",
        "*Reconstructed pressure p0 exp(-r^2 / 2 sigma^2) during a slip, as the paper's Fig. 8c.*",
    )


def write_budget(found, r):
    r.text(
        "## Error budget",
        "Taps of 1 to 15 N with the small sphere on 12 mm, one effect at a time, unequal sensors on several pads; force after one "
        "factor for the pad.",
        "Conversions of all sensors run at the same moment, so reading them one after the other costs nothing in place; a contact that "
        "moves during the 2.2 ms of a conversion is found where it was in its middle.",
    )
    r.table(
        ("effect", "pads", "location, median mm", "95 % mm", "force, MAPE %", "RMSE N", "factor"),
        [
            (
                row["effect"],
                row["pads"],
                f"{row['median_mm']:.3f}",
                f"{row['p95_mm']:.3f}",
                f"{row['force']['mape_percent']:.2f}",
                f"{row['force']['rmse_N']:.3f}",
                f"{row['force']['scale']:.3f}",
            )
            for row in found["budget"]
        ],
    )
    if found["other"]:
        r.text("Other scenarios: share of samples with a warning, and of those off by more than 1 mm without one.")
        r.table(
            ("scenario", "warned", "off by 1 mm, not warned", "median mm", "frames with SLIP"),
            [
                (
                    row["scenario"],
                    f"{row['warned_percent']:.1f} %",
                    f"{row['bad_unflagged_percent']:.1f} %",
                    f"{row['median_mm']:.2f}",
                    f"{row['slip_percent']:.1f} %",
                )
                for row in found["other"]
            ],
        )


def draw(curves, folder):
    """validation_force.png, validation_signals.png, validation_slip.png: the names of those that were drawn."""
    drawn = ["validation_force.png"]
    figure, axes = plt.subplots(2, 2, figsize=(11, 7.5), layout="constrained")
    shown = curves["force"]
    for axis, name, title in (
        (axes[0, 0], "taps", "(a) taps, small sphere, dip, calibrated"),
        (axes[0, 1], "object", "(b) ping-pong ball, dip, calibrated"),
    ):
        if name not in shown:
            axis.set_axis_off()
            continue
        axis.plot(shown[name]["time_s"], shown[name]["true_N"], color=ORANGE, label="true")
        axis.plot(shown[name]["time_s"], shown[name]["estimated_N"], ".-", color=BLUE, ms=3, lw=0.8, label="estimated")
        axis.set(title=title, xlabel="time, s", ylabel="force, N")
        axis.legend()
    for name, colour, label in (("dip", ORANGE, "never calibrated"), ("dip calibrated", BLUE, "calibrated")):
        axes[1, 0].plot(shown[name]["true_N"], shown[name]["estimated_N"], ",", color=colour, rasterized=True)
        axes[1, 0].plot([], [], "o", ms=4, color=colour, label=label)
    axes[1, 0].plot((0, 50), (0, 50), color=FAINT, lw=0.8)
    axes[1, 0].legend()
    axes[1, 0].set(title="(c) all samples, gain spread 10 %, dip", xlabel="true force, N", ylabel="estimated force, N")
    if "cycle" in shown:
        axes[1, 1].plot(shown["cycle"]["true_N"], shown["cycle"]["estimated_N"], color=BLUE)
        axes[1, 1].plot((0, 20), (0, 20), color=FAINT, lw=0.8)
        axes[1, 1].set(title="(d) slow load cycle, relaxation and hysteresis", xlabel="true force, N", ylabel="estimated force, N")
    figure.suptitle("Simulated fingertip, as the paper's Fig. 7")
    save(figure, folder / drawn[-1])

    if shown := curves["signals"]:
        figure, axis = plt.subplots(figsize=(11, 4), layout="constrained")
        axis.plot(shown["time_s"], 1e-3 * shown["above_Pa"], lw=0.9)
        other = axis.twinx()
        other.plot(shown["time_s"], shown["true_N"], color=INK, lw=1.2, ls="--")
        other.set_ylabel("true force, N (dashed)")
        axis.set(xlabel="time, s", ylabel="pressure above tare, kPa", title="Readings of the fifteen sensors, simulated")
        drawn.append("validation_signals.png")
        save(figure, folder / drawn[-1])

    if shown := curves["slip"]:
        figure, axes = plt.subplots(1, 5, figsize=(11, 4.2), layout="constrained")
        x_mm, y_mm = np.meshgrid(np.linspace(-15, 15, 120), np.linspace(-25, 25, 200))
        for axis, n in zip(axes, np.linspace(0, len(shown["time_s"]) - 1, 5).astype(int)):
            at = {name: values[n] for name, values in shown.items()}
            squares = (x_mm - at["x_mm"]) ** 2 + (y_mm - at["y_mm"]) ** 2
            image = axis.imshow(
                1e-3 * at["p0_Pa"] * np.exp(-squares / (2 * at["sigma_mm"] ** 2)),
                extent=(-15, 15, -25, 25),
                origin="lower",
                cmap="viridis",
                vmin=0,
            )
            axis.plot(SENSOR_X_mm, SENSOR_Y_mm, "w.", ms=3)
            axis.plot(at["true_x_mm"], at["true_y_mm"], "r+", ms=9)
            axis.set_title(f"{1e3 * (at['time_s'] - shown['time_s'][0]):.0f} ms", fontsize=9)
        figure.colorbar(image, ax=axes, label="kPa", shrink=0.7)
        figure.suptitle("Slip at 20 mm/s, simulated: reconstructed pressure, true place +")
        drawn.append("validation_slip.png")
        save(figure, folder / drawn[-1])
    return drawn
