#!/usr/bin/python3
"""The published experiments repeated on the simulated fingertip: build/report/validation.*

    validation.py --build build/host --boards build -o build/report

Writes scenarios with twin, runs them with fingertip_player through the firmware's own code, and compares its estimates with
the truth, beside the figures of De Clercq et al., RA-L 2022 ("the paper"). Theirs are of hardware, these are of a
simulation: they show how far the method and this code carry on a pad that is as the model, and what each error of a
pad costs, not how good a fingertip is.

    validation.json   all that was measured; "goals": the figures by which this is judged
    validation.md     the same as text (text.md.in), with a picture

A sample is a frame in contact that was fitted. Localisation errors are of samples of at least 1 N. Contact tables are
cached beside the results.
"""

import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
import cards  # noqa: E402
from fingertip.command import run_tool  # noqa: E402
from fingertip.files import SLIP, InputError  # noqa: E402
from fingertip.line import Flag  # noqa: E402
from presentation import BLUE, FAINT, ORANGE, judge, plt, save  # noqa: E402
from playing import PAPER_RATE_Hz, PRIOR_WIDTH_mm, STIFF_LAYER_mm, Workshop  # noqa: E402
from reporting import Steps, option_parser, output_folder, publish  # noqa: E402

# A saturated or missing sensor is left out: that alone makes no location worse.
LOCATION_WARNINGS = int(Flag.LOW_SIGNAL | Flag.FLAT | Flag.UNCERTAIN | Flag.MODEL | Flag.AT_BOUND)

SLIP_MARGIN_s = 0.5  # before and after the pusher moves

INDENTERS = ("sphere6", "sphere15", "cylinder6", "cube6")
OBJECTS = ("ball_bearing", "bottle_cap", "lime", "ping_pong", "rubber_duck")
SOLIDS = tuple(f"{shape}{size_mm}" for shape in ("sphere", "cylinder", "cube") for size_mm in (12, 18, 24))
# What a pad is, and whether it was calibrated: effects, which act on the calibration too. Real pads have a dip (twin/README.md).
NEVER = {"gain0": "", "gain10": "gain=10", "dip": "gain=10,dip"}
CALIBRATED = {"gain10 calibrated": "gain=10", "dip calibrated": "gain=10,dip"}
CASES = {**NEVER, **CALIBRATED}
EVERY_EFFECT = "every effect"
# Beyond the paper's grid of 9 mm by 27 mm: none; up to the outer sensors; up to half a millimetre from the pad's long edge.
STIFF_MARGINS_mm = (0, 4.5, 10)

PRIORS = {False: (False, True), True: (False,)}  # a calibration finds the width itself
SLIP_DIPS = ("dip", "dip calibrated")
SLIP_DIP = "dip"  # of equal sensors: the paper's slips are judged without a spread of gains too
# Every effect; the shortest scenarios, too, get across the compensation's branch, which is 7 s from 9 degC.
ALL = "all,branch=9"
# What, effects, noise of the sensors.
BUDGET = (
    ("nothing but the model", "", 0),
    ("noise, OSR 1024", "", 1),
    *((f"gain spread {gain} %", f"gain={gain}", 0) for gain in (2, 5, 10, 15)),
    ("drift 170 Pa in 16 min", "drift", 0),
    ("each sensor's own part of a hold, 1 %", "memory", 0),
    ("hysteresis 3 %", "hysteresis", 0),
    ("after-effect of 2 %", "aftereffect", 0),
    ("warming across a branch of the compensation", "branch=9", 0),
    ("dip of 5 %", "dip", 0),
    ("widths 3.5 % apart", "widths", 0),
    ("places 0.1 mm off", "places", 0),
    ("warming by 6 K", "temperature", 0),
    ("low by 1 % at 2 bar", "bias", 0),
    ("clip at 2.02 bar", "clip", 0),
    ("clip at the ADC's 5 bar", "clip=5", 0),
    ("all of them, gain spread 10 %", ALL, 1),
)

# Of the paper: median and standard deviation of the localisation error, mm (table II); median by the number of sensors near (section IV.B);
# RMSE in N and MAPE in percent (section IV.C); success of the slip detection per step, percent (tables III and IV).
PAPER_LOCATION_mm = {("grid", "sphere6"): (0.55, 0.84), ("grid", "sphere15"): (0.48, 0.33), ("taps", "sphere6"): (0.52, 1.42)}
PAPER_LOCATION_mm |= {("taps", "sphere15"): (0.53, 0.26), ("taps", "cylinder6"): (0.55, 0.70), ("taps", "cube6"): (0.85, 0.98)}
PAPER_NEAR_mm = {"1": 0.54, "2": 0.48, "4": 0.59}
PAPER_FORCE = {"taps": (0.54, 4.5), "pokes": (1.49, 10.2), "high": (4.67, 15.7)}
PAPER_SLIP = dict(zip(OBJECTS, (82.3, 82.7, 82.6, 78.3, 79.7))) | dict(zip(SOLIDS, (80.5, 85.4, 82.0, 78.9, 77.5, 81.1, 84.0, 76.9, 77.6)))

GOALS = (
    ("samples", ">=", 40000),
    ("seconds", "<=", 300),
    ("h12_gain0_median_mm", "<=", 0.12),
    ("h12_gain10_median_mm", "<=", 0.40),
    ("h12_dip_median_mm", "<=", 0.40),
    ("h12_dip_calibrated_median_mm", "<=", 0.13),
    ("dip_calibrated_bad_unflagged_percent", "<=", 0.1),
    ("force_mape_scaled_gain0_percent", "<=", 0.5),
    ("force_mape_scaled_gain10_percent", "<=", 3.5),
    ("force_mape_dip_calibrated_percent", "<=", 2),
    ("h6_prior_p99_mm", "<=", 1.5),
    ("h6_bad_unflagged_percent", "<=", 0.5),
    ("saturated_median_mm", "<=", 0.1),
    ("emulated_frames_different", "<=", 0),
    *cards.GOALS,
)


def calibrated_with(case):
    return {"calibrated": CALIBRATED[case]} if case in CALIBRATED else {}


def key_of(case):
    return case.replace(" ", "_")


def plan(shop):
    for case, effects in CASES.items():
        more = {"case": case, **calibrated_with(case)}
        for indenter in INDENTERS[:2]:
            # 200 s is once over the grid.
            shop.add_on_pads("grid", "grid", indenter, 200 * shop.pads if effects else 400, effects, **more)
        for indenter in INDENTERS:
            shop.add_on_pads("taps", "taps", indenter, 600, effects, margin_mm=0, **more)
            for margin_mm in STIFF_MARGINS_mm:
                for prior in PRIORS[case in CALIBRATED]:
                    shop.add_on_pads(
                        "stiff", "taps", indenter, 300, effects, layer_mm=STIFF_LAYER_mm, margin_mm=margin_mm, prior=prior, **more
                    )
            shop.add("high", "high", indenter, effects=",".join(filter(None, (effects, "clip"))), **more)
        for indenter in OBJECTS:
            shop.add("pokes", "pokes", indenter, effects=effects, **more)
    for indenter in INDENTERS:
        shop.add_on_pads("taps", "taps", indenter, 300, ALL, case=EVERY_EFFECT, margin_mm=0)
        shop.add("high biased", "high", indenter, effects="clip,bias")
    shop.add("cycle", "cycle", "sphere6", seconds=120, effects="memory,hysteresis")
    for indenter in (*OBJECTS, *SOLIDS):
        shop.add("slip", "slip", indenter, case="steady")
        shop.add("slip", "slip", indenter, case="stick-slip", options=("--stick-slip", 2))
        shop.add("slip", "slip", indenter, case="dip", effects=SLIP_DIP)
        shop.add("slip", "slip", indenter, case="dip calibrated", effects=SLIP_DIP, calibrated=SLIP_DIP)
    for dead_travel_mm in (0, 0.5, 2):
        shop.add("dead travel", "slip", "sphere18", case=dead_travel_mm, options=("--dead-travel", dead_travel_mm))
    shop.add("slip fast", "slip", "sphere18", rate="max")
    for what, effects, noise in BUDGET:
        shop.add_on_pads("budget", "taps", "sphere6", 300, effects, case=what, noise=noise, margin_mm=0)
    for kind in ("twist", "rolloff", "two"):
        for effects in ("", "dip"):
            shop.add("other", kind, "cube12" if kind == "twist" else "sphere15", case=kind, effects=effects, seconds=60)


class Samples:
    """The located samples of some scenarios."""

    def __init__(self, scenarios):
        def gathered(member):
            return np.concatenate([member(played)[played.located] for played in scenarios])

        self.error_mm, self.flags = gathered(lambda p: p.error_mm), gathered(lambda p: p.flags)
        self.force_N, self.estimated_N = gathered(lambda p: p.force_N), gathered(lambda p: p.estimated["force_N"])

    @property
    def scale(self):
        """The one factor that a user finds with one known weight: median of true over estimated."""
        return float(np.median(self.force_N / self.estimated_N))

    @property
    def warned(self):
        return (self.flags & LOCATION_WARNINGS) != 0

    def location(self):
        at = {"median_mm": np.median, "sd_mm": np.std, "p95_mm": lambda e: np.quantile(e, 0.95), "p99_mm": lambda e: np.quantile(e, 0.99)}
        return {name: float(of(self.error_mm)) for name, of in (at | {"max_mm": np.max}).items()}

    def trust(self):
        return {
            "warned_percent": float(100 * np.mean(self.warned)),
            "bad_percent": float(100 * np.mean(self.error_mm > 1)),
            "bad_unflagged_percent": float(100 * np.mean((self.error_mm > 1) & ~self.warned)),
        }

    def force(self, scale=1.0):
        """RMSE, MAPE (median of the absolute errors), correlation."""
        scaled_N = scale * self.estimated_N
        return {
            "rmse_N": float(np.sqrt(np.mean((scaled_N - self.force_N) ** 2))),
            "mape_percent": float(100 * np.median(np.abs(scaled_N - self.force_N) / self.force_N)),
            "r": float(np.corrcoef(self.force_N, self.estimated_N)[0, 1]),
        }


def pads_of(shop, what, **wanted):
    return [Samples(played) for played in shop.pads_of(what, **wanted)]


def scaled_force(pads):
    """Each pad has a factor of its own."""
    off = [pad.scale * pad.estimated_N - pad.force_N for pad in pads]
    relative = np.abs(np.concatenate([o / pad.force_N for o, pad in zip(off, pads)]))
    return {
        "scale": float(np.median([pad.scale for pad in pads])),
        "rmse_N": float(np.sqrt(np.mean(np.concatenate(off) ** 2))),
        "mape_percent": float(100 * np.median(relative)),
        "p95_percent": float(100 * np.quantile(relative, 0.95)),
    }


def slip_steps(scenarios):
    """Of each act of slip scenarios: speed, steps judged, steps right, seconds from the pusher's start to the first SLIP (NaN: none)."""
    rows = []
    for played in scenarios:
        reported = (played.flags & SLIP) != 0
        contacts = {}
        for phase in played.phases:
            contacts.setdefault(phase["act"], []).append(phase)
        for phases in contacts.values():
            moving = [p for p in phases if p["phase"] in ("dead_travel", "slip")]
            if not moving:
                continue
            begin, end = float(moving[0]["t_begin_s"]), float(moving[-1]["t_end_s"])
            near = (played.time_s >= begin - SLIP_MARGIN_s) & (played.time_s <= end + SLIP_MARGIN_s) & played.touched
            found = played.time_s[reported & (played.time_s >= begin) & (played.time_s <= end + 0.1)]
            right = (reported == played.slips)[near].sum()
            rows.append((float(moving[0]["speed_mm_s"]), near.sum(), right, found[0] - begin if len(found) else np.nan))
    return np.array(rows).reshape(-1, 4)


def slip_success(contacts):
    found_s = contacts[np.isfinite(contacts[:, 3]), 3]
    latency = {f"latency_p{share}_ms": float(1e3 * np.quantile(found_s, share / 100)) if len(found_s) else None for share in (50, 95)}
    steps = contacts[:, 1].sum()
    return {"percent": float(100 * contacts[:, 2].sum() / steps) if steps else None, **latency, "not_found": len(contacts) - len(found_s)}


def measure_location(shop):
    rows = []
    for kind in ("grid", "taps"):
        for indenter in INDENTERS:
            for case in (*CASES, EVERY_EFFECT):
                if scenarios := shop.select(kind, indenter=indenter, case=case):
                    paper = "{} / {}".format(*PAPER_LOCATION_mm.get((kind, indenter), ("", "")))
                    rows.append({"kind": kind, "indenter": indenter, "case": case, "paper": paper, **Samples(scenarios).location()})
    near_mm = {}
    for played in shop.select("grid", case="gain10"):
        for phase in played.phases:
            inside = played.located & (played.time_s >= float(phase["t_begin_s"])) & (played.time_s < float(phase["t_end_s"]))
            near_mm.setdefault(phase["sensors_near"], []).append(played.error_mm[inside])
    near = [(n, float(np.median(np.concatenate(parts)))) for n, parts in sorted(near_mm.items())]
    return {
        "location": rows,
        "taps_trust": [{"case": case, **Samples(shop.select("taps", case=case)).trust()} for case in CASES],
        "grid_by_sensors_near": [{"sensors_near": n, "paper": PAPER_NEAR_mm.get(n, ""), "median_mm": median_mm} for n, median_mm in near],
    }


def measure_force(shop, scales):
    """scales: the factors that one known weight finds, by case; what is calibrated has its own."""
    rows = []
    for kind in ("taps", "pokes", "high"):
        for case in CASES:
            if scenarios := shop.select(kind, case=case):
                samples = Samples(scenarios)
                paper = dict(zip(("rmse_N", "mape_percent"), PAPER_FORCE[kind]))
                row = {"kind": kind, "case": case, "paper": paper, "raw": samples.force()}
                rows.append(row | {"scaled": samples.force(scales.get(case, 1.0))})
    every = Samples([p for kind in ("grid", "taps", "pokes", "high", "high biased") for p in shop.select(kind)])
    return {"force": rows, "force_r": every.force()["r"], "gaussians": shop.gaussians}


def measure_stiff(shop):
    rows = []
    for margin_mm in STIFF_MARGINS_mm:
        for case in CASES:
            for prior in PRIORS[case in CALIBRATED]:
                wanted = {"margin_mm": margin_mm, "case": case, "prior": prior}
                samples = Samples(shop.select("stiff", **wanted))
                rows.append(wanted | samples.location() | samples.trust() | {"force": scaled_force(pads_of(shop, "stiff", **wanted))})
    return {"stiff": rows, "prior_sigma_mm": shop.prior_sigma_mm, "prior_width_mm": PRIOR_WIDTH_mm}


def measure_slip(shop):
    rows = []
    for indenter in (*OBJECTS, *SOLIDS):
        if shop.select("slip", indenter=indenter):
            found = {case: shop.select("slip", indenter=indenter, case=case) for case in ("steady", "stick-slip", *SLIP_DIPS)}
            rows.append(
                {"indenter": indenter, "paper percent": PAPER_SLIP[indenter]}
                | {case: slip_success(slip_steps(played)) for case, played in found.items()}
            )
    steady, fast = slip_steps(shop.select("slip", case="steady")), slip_steps(shop.select("slip fast"))
    dips = {case: slip_steps(shop.select("slip", case=case)) for case in SLIP_DIPS}
    speeds = []
    for speed in sorted(set(steady[:, 0])):
        columns = {"paper_rate": steady, "every_frame": fast} | dips
        speeds.append({"speed_mm_s": speed} | {name: slip_success(found[found[:, 0] == speed]) for name, found in columns.items()})
    dead = [scenario for scenario in shop.scenarios if scenario.what == "dead travel"]
    return {
        "slip_success_percent": slip_success(steady)["percent"],
        **{f"slip_success_{key_of(case)}_percent": slip_success(contacts)["percent"] for case, contacts in dips.items()},
        "slip_steps": int(steady[:, 1].sum()),
        "slip_by_object": rows,
        "slip_by_speed": speeds,
        "slip_by_dead_travel": [{"dead_travel_mm": one.case} | slip_success(slip_steps([shop.played[one]])) for one in dead],
    }


def measure_budget(shop):
    rows = []
    for what, _, _ in BUDGET:
        if pads := pads_of(shop, "budget", case=what):
            location = Samples(shop.select("budget", case=what)).location()
            rows.append({"effect": what, "pads": len(pads)} | location | {"force": scaled_force(pads)})
    other = []
    for scenario in (one for one in shop.scenarios if one.what == "other"):
        played = shop.played[scenario]
        samples, slips = Samples([played]), (played.flags[played.touched] & SLIP) != 0
        row = {"scenario": scenario.kind + (", dip" if scenario.effects else "")} | samples.trust() | samples.location()
        other.append(row | {"slip_percent": float(100 * np.mean(slips))})
    return {"budget": rows, "other": other}


def measure(shop, seconds, emulated):
    found = {
        "samples": int(sum(p.sample.sum() for p in shop.played.values())),
        "frames": int(sum(len(p.time_s) for p in shop.played.values())),
        "seconds": seconds,
        "pads": shop.pads,
        "rate_Hz": PAPER_RATE_Hz,
        "calibrated_pads": sum(commands is not None for commands in shop.sessions.values()),
        "sessions_refused": shop.refused,
        "refused_pads": sum(commands is None for commands in shop.sessions.values()),
    }
    scales = {}
    for case in CASES:
        pads = pads_of(shop, "taps", case=case)
        taps, scaled, key = Samples(shop.select("taps", case=case)), scaled_force(pads), key_of(case)
        found[f"h12_{key}_median_mm"] = taps.location()["median_mm"]
        found[f"h12_{key}_median_mm_per_pad"] = [pad.location()["median_mm"] for pad in pads]
        if case in CALIBRATED:
            found[f"force_mape_{key}_percent"] = taps.force()["mape_percent"]
            found[f"{key}_bad_unflagged_percent"] = taps.trust()["bad_unflagged_percent"]
        else:
            scales[case] = found[f"force_scale_{key}"] = scaled["scale"]
            found[f"force_mape_scaled_{key}_percent"] = scaled["mape_percent"]
    scales["gain10"] = scales["gain0"]  # of the published figures: one factor, of equal sensors
    found["force_mape_raw_percent"] = Samples(shop.select("taps", case="gain0")).force()["mape_percent"]
    for name, prior in (("h6", True), ("h6_no_prior", False)):
        stiff = Samples(shop.select("stiff", case="gain0", margin_mm=0, prior=prior))
        found["h6_prior_p99_mm" if prior else "h6_no_prior_p99_mm"] = stiff.location()["p99_mm"]
        found[f"{name}_bad_unflagged_percent"] = stiff.trust()["bad_unflagged_percent"]
    for name, what in (("saturated", "high"), ("saturated_biased", "high biased")):
        high = Samples(shop.select(what, case="gain0") or shop.select(what))
        saturated = (high.flags & int(Flag.SATURATED)) != 0
        found[f"{name}_median_mm"] = float(np.median(high.error_mm[saturated])) if saturated.any() else None
        found[f"{name}_samples"] = int(saturated.sum())
    found |= measure_location(shop) | measure_force(shop, scales) | measure_stiff(shop) | measure_slip(shop)
    found |= measure_budget(shop)
    found["emulated_frames"], found["emulated_frames_different"] = emulated["frames"], emulated["frames"] - emulated["equal"]
    return found


def curves(shop):
    """What the picture shows; a part that was not played is not there."""

    def force_of(played, shown):
        return {"time_s": played.time_s[shown], "true_N": played.force_N[shown], "estimated_N": played.estimated["force_N"][shown]}

    force = {}
    for name, what, indenter in (("taps", "taps", "sphere6"), ("object", "pokes", "ping_pong")):
        if played := shop.first(what, indenter=indenter, case="dip calibrated"):
            force[name] = force_of(played, (played.time_s > 20) & (played.time_s < 40))
    for name in ("dip", "dip calibrated"):
        every = [
            force_of(played, np.flatnonzero(played.sample)[::7])
            for kind in ("grid", "taps", "pokes", "high")
            for played in shop.select(kind, case=name)
        ]
        force[name] = {column: np.concatenate([one[column] for one in every]) for column in every[0]}
    if played := shop.first("cycle"):
        begin = next(float(phase["t_begin_s"]) for phase in played.phases if phase["phase"] == "load")
        end = next(float(phase["t_end_s"]) for phase in played.phases if phase["phase"] == "unload")
        force["cycle"] = force_of(played, played.touched & (played.time_s >= begin) & (played.time_s <= end))
    return force


def draw(shown, path):
    figure, axes = plt.subplots(2, 2, figsize=(11, 7.5), layout="constrained")
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
        axes[1, 1].set(title="(d) slow load cycle, memory and hysteresis", xlabel="true force, N", ylabel="estimated force, N")
    figure.suptitle("Simulated fingertip, as the paper's Fig. 7")
    save(figure, path)


def main(argv):
    parser = option_parser(__doc__, boards=True)
    parser.add_argument("--tables", metavar="DIR", help="cache of the contact tables; default: contact_tables in the output")
    parser.add_argument("--seed", type=int, default=1, metavar="N")
    parser.add_argument("--scale", type=float, default=1, metavar="FACTOR", help="of the scenarios' lengths; default 1")
    parser.add_argument("--pads", type=int, default=8, metavar="N", help="with unequal sensors; default 8")
    parser.add_argument("--indenters", metavar="NAME,...", help="only scenarios with these; sphere6 must be among them")
    parser.add_argument("--emulated-seconds", type=float, default=12, metavar="S", help="of the image on the emulated chip; default 12")
    parser.add_argument(
        "--cards", type=int, default=20, metavar="N", help="report cards of at most N pads of each kind; default 20; 0: none"
    )
    options = parser.parse_args(argv)
    for name, value, least in (("pads", options.pads, 1), ("scale", options.scale, 0.01)):
        if not least <= value <= 100:
            raise InputError(f"--{name} {value:g} is out of range; give {least:g} to 100")
    out = output_folder(options)
    shop = Workshop(options, out)
    plan(shop)
    shop.fit_gaussians()
    steps = Steps()
    seconds = shop.play_all(steps)
    print("        the image on the emulated chip", flush=True)
    emulated = shop.emulate(ALL, options.emulated_seconds)
    for file in shop.work.iterdir():
        file.unlink()
    shop.work.rmdir()
    found = {figure: None for figure, _, _ in cards.GOALS}
    if options.cards:
        print("        report cards of simulated pads", flush=True)
        found = cards.measure(pathlib.Path(options.build).resolve(), steps, options.cards)
    found = judge(measure(shop, seconds, emulated) | found, GOALS)
    return publish(found, options, "validation", {"validation_force.png": lambda path: draw(curves(shop), path)})


if __name__ == "__main__":
    sys.exit(run_tool("validation.py", main))
