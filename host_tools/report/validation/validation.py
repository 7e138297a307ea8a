#!/usr/bin/python3
"""The published experiments repeated on the simulated fingertip: build/report/validation.*

    validation.py --build build/host --boards build -o build/report

Writes scenarios with twin, plays them with fingertip_player through the firmware's own code, and compares what it says with
the truth, beside the figures of De Clercq et al., RA-L 2022 ("the paper"). Theirs are of hardware, these are of a
simulation: they tell how far the method and this code carry on a pad that is as the model says, and what each error of a
pad costs, not how good a fingertip is.

    validation.json   all that was measured; "goals": the figures by which this is judged
    validation.md     the same as text, with pictures (validation_report.py)

A sample is a frame in contact that was fitted. Localisation errors are of samples of at least 1 N. Contact tables are
cached beside the results.
"""
import concurrent.futures
import csv
import dataclasses
import json
import pathlib
import subprocess
import sys
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/report/shared"), str(ROOT / "host_tools/python")]
from boards import MULTIPLEXED, TO_BUILD, image_of  # noqa: E402
from fingertip.files import FIT_VALID, SLIP, InputError, read_recording, run_tool  # noqa: E402
from fingertip.line import Flag  # noqa: E402
from goals import judge  # noqa: E402
from reporting import finish, option_parser, output_folder, run, write_json  # noqa: E402
from validation_report import draw, write_report  # noqa: E402

# A saturated or missing sensor is left out: that alone makes no location worse.
LOCATION_WARNINGS = int(Flag.LOW_SIGNAL | Flag.FLAT | Flag.UNCERTAIN | Flag.MODEL | Flag.AT_BOUND)

PAPER_RATE_Hz = 20
FORCE_MIN_N = 1.0
STIFF_LAYER_mm = 6
PRIOR_WIDTH_mm = 0.5
SLIP_MARGIN_s = 0.5  # before and after the pusher moves
SECONDS_MIN = 40  # of a scenario that is made shorter: one contact of each kind at least

INDENTERS = ("sphere6", "sphere15", "cylinder6", "cube6")
OBJECTS = ("ball_bearing", "bottle_cap", "lime", "ping_pong", "rubber_duck")
SOLIDS = tuple(f"{shape}{size_mm}" for shape in ("sphere", "cylinder", "cube") for size_mm in (12, 18, 24))
GAINS = (0, 10)
# Beyond the paper's grid of 9 mm by 27 mm: none; up to the outer sensors; up to half a millimetre from the pad's long edge.
STIFF_MARGINS_mm = (0, 4.5, 10)

BUDGET_GAINS = (2, 5, 10, 15)
# Every effect; the shortest scenarios, too, get across the compensation's branch, which is 7 s from 9 degC.
ALL = "all,branch=9"
# What, effects, noise of the sensors.
BUDGET = (
    ("nothing but the model", "", 0), ("noise, OSR 1024", "", 1),
    *((f"gain spread {gain} %", f"gain={gain}", 0) for gain in BUDGET_GAINS),
    ("drift 170 Pa in 16 min", "drift", 0), ("relaxation 17.5 % in a hold", "relaxation", 0), ("hysteresis 3 %", "hysteresis", 0),
    ("after-effect of 4 %", "aftereffect", 0), ("warming across a branch of the compensation", "branch=9", 0),
    ("warming by 6 K", "temperature", 0), ("low by 1 % at 2 bar", "bias", 0), ("clip at 2.02 bar", "clip", 0),
    ("clip at the ADC's 5 bar", "clip=5", 0), ("all of them, gain spread 10 %", ALL, 1))

GOALS = (
    ("samples", ">=", 40000), ("seconds", "<=", 300), ("h12_gain0_median_mm", "<=", 0.12), ("h12_gain10_median_mm", "<=", 0.40),
    ("force_mape_scaled_gain0_percent", "<=", 0.5), ("force_mape_scaled_gain10_percent", "<=", 3.5), ("h6_prior_p99_mm", "<=", 1.5),
    ("h6_bad_unflagged_percent", "<=", 0.5), ("saturated_median_mm", "<=", 0.1), ("emulated_frames_different", "<=", 0))


class Progress:
    def __init__(self, total):
        self.start_s = time.monotonic()
        self.total, self.done = total, 0

    def step(self, what):
        self.done += 1
        elapsed_s = time.monotonic() - self.start_s
        text = f"{elapsed_s:5.0f} s  scenario {self.done} of {self.total}: {what}"
        if sys.stdout.isatty():
            print(f"\r{text:<78}", end="\n" if self.done == self.total else "", flush=True)
        elif self.done % 10 == 0 or self.done == self.total:
            print(text, flush=True)


@dataclasses.dataclass(frozen=True)
class Scenario:
    what: str  # what it is played for
    kind: str
    indenter: str
    case: object = 0  # what is varied: the gain spread in percent, or something else
    seconds: float = 150
    effects: str = ""
    margin_mm: float = None
    pad: int = 1
    layer_mm: float = 12
    prior: bool = False
    noise: int = 1
    rate: object = PAPER_RATE_Hz
    raw: bool = False
    options: tuple = ()  # more of twin scenario

    def __str__(self):
        return f"{self.what}, {self.indenter}, {self.case}" + (f", pad {self.pad}" if self.pad > 1 else "")


class Played:
    """Arrays over the frames of one scenario: time_s, truth and what was said; phases: rows of the truth file."""

    def __init__(self, scenario, recording, truth):
        # The truth columns only: t_s, contact, x_mm, y_mm, force_N, (p0, sigma), slip
        table = np.loadtxt(scenario, delimiter=",", comments=["#", "t_s"], usecols=(0, 1, 2, 3, 4, 7), ndmin=2)
        said = read_recording(recording)
        rows = said.has_contact
        self.time_s = said["t_us"][rows] * 1e-6
        self.flags = said["flags"][rows].astype(np.int64)
        at = [np.interp(self.time_s, table[:, 0], table[:, i]) for i in range(1, 6)]
        self.touched = at[0] > 1 - 1e-9
        self.x_mm, self.y_mm, self.force_N = at[1:4]
        self.slips = at[4] > 0.5
        self.said = {name: said[name][rows] for name in ("x_mm", "y_mm", "p0_Pa", "sigma_mm", "force_N")}
        if said.sensors_Pa.shape[1]:
            self.above_Pa = (said.sensors_Pa - said.tare_Pa)[rows]
        with open(truth, newline="", encoding="utf-8") as file:
            self.phases = list(csv.DictReader(line for line in file if not line.startswith("#")))
        self.sample = self.touched & ((self.flags & FIT_VALID) != 0)
        self.located = self.sample & (self.force_N >= FORCE_MIN_N)
        self.error_mm = np.hypot(self.said["x_mm"] - self.x_mm, self.said["y_mm"] - self.y_mm)


class Workshop:
    """Scenarios are written, played and read; the files go, the arrays stay."""

    def __init__(self, options, out):
        tools = pathlib.Path(options.build) / "host_tools"
        self.twin, self.player, self.fingertip = tools / "simulation/twin/twin", tools / "simulation/player/fingertip_player", tools / "tool/cli/fingertip"
        self.command_frame = pathlib.Path(options.build) / "tests/support/command_frame"
        for tool in (self.twin, self.player, self.fingertip, self.command_frame):
            if not tool.exists():
                raise InputError(f"{tool} is not there; build it: cmake --build --preset host")
        self.image, self.seed, self.scale = image_of(options.boards, MULTIPLEXED), options.seed, options.scale
        self.tables = pathlib.Path(options.tables or out / "contact_tables")
        self.work = out / "validation_work"
        self.work.mkdir(parents=True, exist_ok=True)
        self.indenters = set(options.indenters.split(",")) if options.indenters else None
        self.pads = options.pads
        self.scenarios, self.played, self.gaussians = [], {}, []

    def add(self, what, kind, indenter, **more):
        """Nothing if its indenter is not among those asked for."""
        if self.indenters is None or indenter in self.indenters:
            self.scenarios.append(Scenario(what, kind, indenter, **more))

    def add_on_pads(self, what, kind, indenter, seconds, gain, **more):
        """Unequal sensors are drawn again for each pad, the presses too: one pad's luck is not what the spread costs."""
        pads = self.pads if gain else 1
        for pad in range(1, pads + 1):
            self.add(what, kind, indenter, seconds=seconds / pads, pad=pad, **{"case": gain, "effects": f"gain={gain}" if gain else "", **more})

    def build_tables(self):
        """And the Gaussian that comes closest to each pressure on the base."""
        pairs = sorted({(scenario.indenter, scenario.layer_mm) for scenario in self.scenarios})
        print(f"        contact tables: {len(pairs)} (the first time some five minutes)", flush=True)
        for layer_mm in sorted({layer for _, layer in pairs}):
            names = ",".join(sorted({name for name, layer in pairs if layer == layer_mm}))
            done = subprocess.run([str(self.twin), "tables", "--indenter", names, "--layer", str(layer_mm), "--cache", str(self.tables)],
                                  stdout=subprocess.DEVNULL)
            if done.returncode != 0:
                raise InputError("twin tables failed; see above")
        for indenter, layer_mm in pairs:
            said = run(self.twin, "width", "--indenter", indenter, "--layer", layer_mm, "--cache", self.tables)
            self.gaussians.append({"indenter": indenter, "layer_mm": layer_mm} | {
                name: float(value) for name, value in (word.split("=") for word in said.split())})

    @property
    def prior_sigma_mm(self):
        """Of the stiff layer: the mean over what presses there, for a prior does not know which it will be."""
        return float(np.mean([g["sigma_mm"] for g in self.gaussians if g["layer_mm"] == STIFF_LAYER_mm]))

    def play_one(self, scenario):
        name = f"scenario{self.scenarios.index(scenario)}"
        path, recording = self.work / f"{name}.csv", self.work / f"{name}.recording.csv"
        seed = self.seed + scenario.pad - 1
        run(self.twin, "scenario", scenario.kind, "--indenter", scenario.indenter, "--layer", scenario.layer_mm, "--effects", scenario.effects or "none",
            "--seed", seed, "--seconds", min(scenario.seconds, max(SECONDS_MIN, scenario.seconds * self.scale)), "--cache", self.tables,
            "-o", path, "--overwrite", *(() if scenario.margin_mm is None else ("--margin", scenario.margin_mm)), *scenario.options)
        run(self.player, "play", path, "-o", recording, "--overwrite", "--quiet", "--rate", scenario.rate, "--noise", scenario.noise,
            "--seed", seed, *(("--raw",) if scenario.raw else ()),
            *(("--prior-sigma", self.prior_sigma_mm, "--prior-width", PRIOR_WIDTH_mm) if scenario.prior else ()))
        played = Played(path, recording, path.with_suffix(".truth.csv"))
        for file in (path, path.with_suffix(".truth.csv"), recording):
            file.unlink()
        return played

    def play_all(self):
        progress = Progress(len(self.scenarios))
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            running = {pool.submit(self.play_one, scenario): scenario for scenario in self.scenarios}
            for done in concurrent.futures.as_completed(running):
                self.played[running[done]] = done.result()
                progress.step(running[done])
        return time.monotonic() - progress.start_s

    def emulate(self, seconds):
        """The image on the emulated chip plays a scenario; its contact packets computed here from its pressures."""
        if not self.image.exists():
            raise InputError(f"{self.image} is not there; {TO_BUILD}")
        scenario, script, capture = self.work / "emulated.csv", self.work / "emulated.txt", self.work / "emulated.bin"
        run(self.twin, "scenario", "taps", "--indenter", "sphere6", "--layer", 12, "--effects", ALL, "--seconds", seconds, "--seed",
            self.seed, "--cache", self.tables, "-o", scenario, "--overwrite")
        commands = [run(self.command_frame, *words).strip() for words in (("stream", "contact,raw"), ("info",), ("tare",))]
        script.write_text("0.7 dtr 1\n" + "".join(f"{0.72 + 0.01 * i:.2f} {word}\n" for i, word in enumerate(commands)))
        run("node", ROOT / "host_tools/simulation/emulator/main.mjs", "--board", MULTIPLEXED, "--image", self.image, "--scenario", scenario,
            "--host-script", script, "--capture", capture, "--fast-enumeration")
        return json.loads(run(self.player, "repeat", capture))

    def select(self, what, **wanted):
        """What was played for it, those scenarios only that have these members."""
        return [self.played[scenario] for scenario in self.scenarios
                if scenario.what == what and all(getattr(scenario, name) == value for name, value in wanted.items())]

    def first(self, what, **wanted):
        return next(iter(self.select(what, **wanted)), None)

    def pads_of(self, what, **wanted):
        """The same for each pad."""
        return [Samples(played) for pad in range(1, self.pads + 1) if (played := self.select(what, pad=pad, **wanted))]


def gain_of(effects):
    """Percent; of what BUDGET names."""
    return int(effects.removeprefix("gain=")) if effects.startswith("gain=") else 10 if effects == ALL else 0


def plan(shop):
    for gain in GAINS:
        effects = f"gain={gain}" if gain else ""
        for indenter in INDENTERS[:2]:
            # 200 s is once over the grid.
            shop.add_on_pads("grid", "grid", indenter, 200 * shop.pads if gain else 400, gain)
        for indenter in INDENTERS:
            shop.add_on_pads("taps", "taps", indenter, 600, gain, margin_mm=0)
            for margin_mm in STIFF_MARGINS_mm:
                for prior in (False, True):
                    shop.add_on_pads("stiff", "taps", indenter, 300, gain, layer_mm=STIFF_LAYER_mm, margin_mm=margin_mm, prior=prior)
            shop.add("high", "high", indenter, case=gain, effects=",".join(filter(None, (effects, "clip"))))
        for indenter in OBJECTS:
            shop.add("pokes", "pokes", indenter, case=gain, effects=effects)
    for indenter in INDENTERS:
        shop.add_on_pads("taps", "taps", indenter, 300, 10, case="all", effects=ALL, margin_mm=0)
        shop.add("high biased", "high", indenter, effects="clip,bias")
    shop.add("cycle", "cycle", "sphere6", seconds=120, effects="relaxation,hysteresis")
    shop.add("signals", "taps", "sphere6", seconds=12, effects="gain=10,relaxation", rate="max", raw=True)
    for indenter in (*OBJECTS, *SOLIDS):
        shop.add("slip", "slip", indenter, case="steady")
        shop.add("slip", "slip", indenter, case="stick-slip", options=("--stick-slip", 2))
    for dead_travel_mm in (0, 0.5, 2):
        shop.add("dead travel", "slip", "sphere18", case=dead_travel_mm, options=("--dead-travel", dead_travel_mm))
    shop.add("slip fast", "slip", "sphere18", rate="max")
    shop.add("reconstructed", "slip", "sphere18", seconds=12, options=("--speed", 20))
    for what, effects, noise in BUDGET:
        shop.add_on_pads("budget", "taps", "sphere6", 300, gain_of(effects), case=what, effects=effects, noise=noise, margin_mm=0)
    for kind in ("twist", "rolloff", "two"):
        shop.add("other", kind, "cube12" if kind == "twist" else "sphere15", case=kind, seconds=60)


class Samples:
    """The located samples of some scenarios."""

    def __init__(self, scenarios):
        def gathered(member):
            return np.concatenate([member(played)[played.located] for played in scenarios])

        self.error_mm, self.flags = gathered(lambda p: p.error_mm), gathered(lambda p: p.flags)
        self.force_N, self.said_N = gathered(lambda p: p.force_N), gathered(lambda p: p.said["force_N"])

    @property
    def scale(self):
        """The one factor that a user finds with one known weight: median of true over said."""
        return float(np.median(self.force_N / self.said_N))

    @property
    def warned(self):
        return (self.flags & LOCATION_WARNINGS) != 0

    def location(self):
        return {"median_mm": float(np.median(self.error_mm)), "sd_mm": float(np.std(self.error_mm)),
                "p95_mm": float(np.quantile(self.error_mm, 0.95)), "p99_mm": float(np.quantile(self.error_mm, 0.99)),
                "max_mm": float(np.max(self.error_mm))}

    def trust(self):
        return {"warned_percent": float(100 * np.mean(self.warned)), "bad_percent": float(100 * np.mean(self.error_mm > 1)),
                "bad_unflagged_percent": float(100 * np.mean((self.error_mm > 1) & ~self.warned))}

    def force(self, scale=1.0):
        """RMSE, MAPE (median of the absolute errors), correlation."""
        said_N = scale * self.said_N
        return {"rmse_N": float(np.sqrt(np.mean((said_N - self.force_N) ** 2))),
                "mape_percent": float(100 * np.median(np.abs(said_N - self.force_N) / self.force_N)),
                "r": float(np.corrcoef(self.force_N, self.said_N)[0, 1])}


def scaled_force(pads):
    """Each pad has a factor of its own."""
    off = [pad.scale * pad.said_N - pad.force_N for pad in pads]
    relative = np.abs(np.concatenate([o / pad.force_N for o, pad in zip(off, pads)]))
    return {"scale": float(np.median([pad.scale for pad in pads])), "rmse_N": float(np.sqrt(np.mean(np.concatenate(off) ** 2))),
            "mape_percent": float(100 * np.median(relative)), "p95_percent": float(100 * np.quantile(relative, 0.95))}


def slip_steps(scenarios):
    """Of each act of slip scenarios: speed, steps judged, steps right, seconds from the pusher's start to the first SLIP (NaN: none)."""
    rows = []
    for played in scenarios:
        said = (played.flags & SLIP) != 0
        acts = {}
        for phase in played.phases:
            acts.setdefault(phase["act"], []).append(phase)
        for phases in acts.values():
            moving = [p for p in phases if p["phase"] in ("dead_travel", "slip")]
            if not moving:
                continue
            begin, end = float(moving[0]["t_begin_s"]), float(moving[-1]["t_end_s"])
            near = (played.time_s >= begin - SLIP_MARGIN_s) & (played.time_s <= end + SLIP_MARGIN_s) & played.touched
            found = played.time_s[said & (played.time_s >= begin) & (played.time_s <= end + 0.1)]
            rows.append((float(moving[0]["speed_mm_s"]), near.sum(), (said == played.slips)[near].sum(), found[0] - begin if len(found) else np.nan))
    return np.array(rows).reshape(-1, 4)


def slip_success(acts):
    found_s = acts[np.isfinite(acts[:, 3]), 3]
    steps = int(acts[:, 1].sum())
    return {"steps": steps, "success_percent": float(100 * acts[:, 2].sum() / steps) if steps else None,
            "acts": len(acts), "acts_not_found": len(acts) - len(found_s),
            "latency_median_ms": float(1e3 * np.median(found_s)) if len(found_s) else None,
            "latency_p95_ms": float(1e3 * np.quantile(found_s, 0.95)) if len(found_s) else None}


def measure_location(shop):
    rows = []
    for kind in ("grid", "taps"):
        for indenter in INDENTERS:
            for case in (*GAINS, "all"):
                if scenarios := shop.select(kind, indenter=indenter, case=case):
                    rows.append({"kind": kind, "indenter": indenter, "case": case, **Samples(scenarios).location()})
    near_mm = {}
    for played in shop.select("grid", case=10):
        for phase in played.phases:
            inside = played.located & (played.time_s >= float(phase["t_begin_s"])) & (played.time_s < float(phase["t_end_s"]))
            near_mm.setdefault(phase["sensors_near"], []).append(played.error_mm[inside])
    return {"location": rows, "taps_trust": [{"gain": gain, **Samples(shop.select("taps", case=gain)).trust()} for gain in GAINS],
            "grid_median_mm_by_sensors_near": {n: float(np.median(np.concatenate(parts))) for n, parts in sorted(near_mm.items())}}


def measure_force(shop, scale):
    rows = []
    for kind in ("taps", "pokes", "high"):
        for gain in GAINS:
            if scenarios := shop.select(kind, case=gain):
                samples = Samples(scenarios)
                rows.append({"kind": kind, "gain": gain, "raw": samples.force(), "scaled": samples.force(scale)})
    every = Samples([p for kind in ("grid", "taps", "pokes", "high", "high biased") for p in shop.select(kind)])
    return {"force": rows, "force_r": every.force()["r"], "gaussians": shop.gaussians}


def measure_stiff(shop):
    rows = []
    for margin_mm in STIFF_MARGINS_mm:
        for gain in GAINS:
            for prior in (False, True):
                wanted = {"margin_mm": margin_mm, "case": gain, "prior": prior}
                samples = Samples(shop.select("stiff", **wanted))
                rows.append({"margin_mm": margin_mm, "gain": gain, "prior": prior, **samples.location(), **samples.trust(),
                             "force": scaled_force(shop.pads_of("stiff", **wanted))})
    return {"stiff": rows, "prior_sigma_mm": shop.prior_sigma_mm, "prior_width_mm": PRIOR_WIDTH_mm}


def measure_slip(shop):
    rows = []
    for indenter in (*OBJECTS, *SOLIDS):
        if shop.select("slip", indenter=indenter):
            rows.append({"indenter": indenter, **{case: slip_success(slip_steps(shop.select("slip", indenter=indenter, case=case)))
                                                  for case in ("steady", "stick-slip")}})
    steady, fast = slip_steps(shop.select("slip", case="steady")), slip_steps(shop.select("slip fast"))
    speeds = [{"speed_mm_s": speed, "paper_rate": slip_success(steady[steady[:, 0] == speed]), "every_frame": slip_success(fast[fast[:, 0] == speed])}
              for speed in sorted(set(steady[:, 0]))]
    dead = [{"dead_travel_mm": scenario.case, **slip_success(slip_steps([shop.played[scenario]]))} for scenario in shop.scenarios if scenario.what == "dead travel"]
    every = slip_success(steady)
    return {"slip_success_percent": every["success_percent"], "slip_steps": every["steps"], "slip_by_object": rows, "slip_by_speed": speeds,
            "slip_by_dead_travel": dead}


def measure_budget(shop):
    rows = []
    for what, effects, _ in BUDGET:
        if pads := shop.pads_of("budget", case=what):
            rows.append({"effect": what, "gain": gain_of(effects), "pads": len(pads), **Samples(shop.select("budget", case=what)).location(), "force": scaled_force(pads)})
    other = []
    for scenario in shop.scenarios:
        if scenario.what == "other":
            played = shop.played[scenario]
            samples = Samples([played])
            other.append({"scenario": scenario.kind, **samples.trust(), **samples.location(),
                          "slip_percent": float(100 * np.mean((played.flags[played.touched] & SLIP) != 0))})
    return {"budget": rows, "other": other}


def measure(shop, seconds, emulated):
    found = {"samples": int(sum(p.sample.sum() for p in shop.played.values())), "frames": int(sum(len(p.time_s) for p in shop.played.values())),
             "seconds": seconds, "pads": shop.pads, "rate_Hz": PAPER_RATE_Hz}
    for gain in GAINS:
        pads = shop.pads_of("taps", case=gain)
        taps, scaled = Samples(shop.select("taps", case=gain)), scaled_force(pads)
        found[f"h12_gain{gain}_median_mm"] = taps.location()["median_mm"]
        found[f"h12_gain{gain}_median_mm_per_pad"] = [pad.location()["median_mm"] for pad in pads]
        found[f"force_scale_gain{gain}"] = scaled["scale"]
        found[f"force_mape_scaled_gain{gain}_percent"] = scaled["mape_percent"]
        if gain == 0:
            found["force_mape_raw_percent"] = taps.force()["mape_percent"]
    for name, prior in (("h6", True), ("h6_no_prior", False)):
        stiff = Samples(shop.select("stiff", case=0, margin_mm=0, prior=prior))
        found["h6_prior_p99_mm" if prior else "h6_no_prior_p99_mm"] = stiff.location()["p99_mm"]
        found[f"{name}_bad_unflagged_percent"] = stiff.trust()["bad_unflagged_percent"]
    for name, what in (("saturated", "high"), ("saturated_biased", "high biased")):
        high = Samples(shop.select(what, case=0))
        saturated = (high.flags & int(Flag.SATURATED)) != 0
        found[f"{name}_median_mm"] = float(np.median(high.error_mm[saturated])) if saturated.any() else None
        found[f"{name}_samples"] = int(saturated.sum())
    found |= measure_location(shop) | measure_force(shop, found["force_scale_gain0"]) | measure_stiff(shop) | measure_slip(shop)
    found |= measure_budget(shop)
    found["emulated_frames"], found["emulated_frames_different"] = emulated["frames"], emulated["frames"] - emulated["equal"]
    return judge(found, GOALS)


def curves(shop):
    """What the pictures show, by picture; a part that was not played is not there."""
    def force_of(played, shown):
        return {"time_s": played.time_s[shown], "true_N": played.force_N[shown], "said_N": played.said["force_N"][shown]}

    force = {}
    for name, what, indenter in (("taps", "taps", "sphere6"), ("object", "pokes", "ping_pong")):
        if played := shop.first(what, indenter=indenter, case=10):
            force[name] = force_of(played, (played.time_s > 20) & (played.time_s < 40))
    every = [force_of(played, np.flatnonzero(played.sample)[::7])
             for kind in ("grid", "taps", "pokes", "high") for played in shop.select(kind, case=10)]
    force["all"] = {name: np.concatenate([one[name] for one in every]) for name in every[0]}
    if played := shop.first("cycle"):
        begin = next(float(phase["t_begin_s"]) for phase in played.phases if phase["phase"] == "load")
        end = next(float(phase["t_end_s"]) for phase in played.phases if phase["phase"] == "unload")
        force["cycle"] = force_of(played, played.touched & (played.time_s >= begin) & (played.time_s <= end))
    signals = slip = None
    if played := shop.first("signals"):
        signals = {"time_s": played.time_s, "true_N": played.force_N, "above_Pa": played.above_Pa}
    if played := shop.first("reconstructed"):
        first = next(phase for phase in played.phases if phase["phase"] == "slip")
        inside = (played.time_s >= float(first["t_begin_s"])) & (played.time_s <= float(first["t_end_s"]))
        moving = np.flatnonzero(played.slips & played.sample & inside)
        if len(moving):
            slip = {"time_s": played.time_s[moving], "true_x_mm": played.x_mm[moving], "true_y_mm": played.y_mm[moving],
                    **{name: values[moving] for name, values in played.said.items()}}
    return {"force": force, "signals": signals, "slip": slip}


def main(argv):
    parser = option_parser(__doc__)
    parser.add_argument("--boards", required=True, metavar="DIR", help="folder of the boards' builds")
    parser.add_argument("--tables", metavar="DIR", help="cache of the contact tables; default: contact_tables in the output")
    parser.add_argument("--seed", type=int, default=1, metavar="N")
    parser.add_argument("--scale", type=float, default=1, metavar="FACTOR", help="of the scenarios' lengths; default 1")
    parser.add_argument("--pads", type=int, default=8, metavar="N", help="with unequal sensors; default 8")
    parser.add_argument("--indenters", metavar="NAME,...", help="only scenarios with these; sphere6 must be among them")
    parser.add_argument("--emulated-seconds", type=float, default=12, metavar="S", help="of the image on the emulated chip; default 12")
    options = parser.parse_args(argv)
    if not 1 <= options.pads <= 100:
        raise InputError(f"--pads {options.pads} is out of range; give 1 to 100")
    if not 0.01 <= options.scale <= 100:
        raise InputError(f"--scale {options.scale:g} is out of range; give 0.01 to 100")
    out = output_folder(options)
    shop = Workshop(options, out)
    plan(shop)
    shop.build_tables()
    seconds = shop.play_all()
    print("        the image on the emulated chip", flush=True)
    emulated = shop.emulate(options.emulated_seconds)
    for file in shop.work.iterdir():
        file.unlink()
    shop.work.rmdir()
    found = measure(shop, seconds, emulated)
    write_json(out / "validation.json", found)
    pictures = draw(curves(shop), out)
    write_report(found, out / "validation.md")
    return finish(found, options, ("validation.json", "validation.md", *pictures))


if __name__ == "__main__":
    sys.exit(run_tool("validation.py", main))
