#!/usr/bin/python3
"""The published experiments repeated on the simulated fingertip: build/report/validation.*

    validation.py --build build/host --image build/pico_mux/fingertip-pico_mux.bin -o build/report

Writes scenes with twin, plays them with fingertip_player through the firmware's own code, and compares what it says with
the truth, beside the figures of De Clercq et al., RA-L 2022 ("the paper"). Theirs are of hardware, these are of a
simulation: they tell how far the method and this code carry on a pad that is as the model says, and what each error of a
pad costs, not how good a fingertip is.

    validation.json   the figures by which this is judged, with their goals
    validation.md     everything, with pictures

A sample is a frame in contact that was fitted. Localisation errors are of samples of at least 1 N. Contact tables are
cached beside the results.
"""
import argparse
import concurrent.futures
import csv
import json
import pathlib
import shutil
import subprocess
import sys
import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "python"))
from fingertip_files import (  # noqa: E402
    CONTACT, FIT_VALID, SENSOR_X_mm, SENSOR_Y_mm, SLIP, InputError, read_recording, run_tool, write_text)

SATURATED = 1 << 12
WARNINGS = sum(1 << bit for bit in (8, 9, 10, 11, 12, 13, 14, 15))
# A saturated or missing sensor is left out of the fit: that alone does not make a location worse.
LOCATION_WARNINGS = WARNINGS & ~(1 << 12 | 1 << 13 | 1 << 14)

PAPER_RATE_Hz = 20
FORCE_MIN_N = 1.0
SIGMA_PER_LAYER = 0.465  # of the best Gaussian on the base, layer of 6 mm (accuracy.twin_physics prints it)
PRIOR_WIDTH_mm = 0.5
SLIP_MARGIN_s = 0.5  # before and after the pusher moves
SECONDS_MIN = 40  # of a scene that is made shorter: one contact of each kind at least

INDENTERS = ("sphere6", "sphere15", "cylinder6", "cube6")
OBJECTS = ("ball_bearing", "bottle_cap", "lime", "ping_pong", "rubber_duck")
SHAPES = ("sphere", "cylinder", "cube")
SIZES = (12, 18, 24)
GAINS = (0, 10)
NAMES = {
    "sphere6": "Small spherical indenter", "sphere15": "Large spherical indenter", "cylinder6": "Cylindrical indenter",
    "cube6": "Cubical indenter", "ball_bearing": "Ball bearing", "bottle_cap": "Bottle cap", "lime": "Lime",
    "ping_pong": "Ping-pong ball", "rubber_duck": "Rubber duck"}

# Of the paper: median and standard deviation of the localisation error, mm (table II).
PAPER_LOCATION_mm = {
    ("grid", "sphere6"): (0.55, 0.84), ("grid", "sphere15"): (0.48, 0.33), ("taps", "sphere6"): (0.52, 1.42),
    ("taps", "sphere15"): (0.53, 0.26), ("taps", "cylinder6"): (0.55, 0.70), ("taps", "cube6"): (0.85, 0.98)}
PAPER_NEAR_mm = {1: 0.54, 2: 0.48, 4: 0.59}  # section IV.B
# RMSE in N and MAPE in percent (section IV.C), r over all samples.
PAPER_FORCE = {"taps": (0.54, 4.5), "pokes": (1.49, 10.2), "high": (4.67, 15.7)}
PAPER_R = 0.985
# Success of the slip detection per step, percent (tables III and IV).
PAPER_SLIP = {
    "ball_bearing": 82.3, "bottle_cap": 82.7, "lime": 82.6, "ping_pong": 78.3, "rubber_duck": 79.7, "sphere12": 80.5,
    "sphere18": 85.4, "sphere24": 82.0, "cylinder12": 78.9, "cylinder18": 77.5, "cylinder24": 81.1, "cube12": 84.0,
    "cube18": 76.9, "cube24": 77.6}
PAPER_SLIP_ALL = 81.1

BUDGET = (
    ("nothing but the model", "", 0), ("noise, OSR 1024", "", 1), ("gain spread 2 %", "gain=2", 0),
    ("gain spread 5 %", "gain=5", 0), ("gain spread 10 %", "gain=10", 0), ("drift 170 Pa in 16 min", "drift", 0),
    ("relaxation 17.5 % in a hold", "relaxation", 0), ("hysteresis 3 %", "hysteresis", 0),
    ("warming by 6 K", "temperature", 0), ("low by 1 % at 2 bar", "bias", 0), ("clip at 2.02 bar", "clip", 0),
    ("clip at the ADC's 5 bar", "clip=5", 0), ("all of them, gain spread 10 %", "all", 1))

GOALS = (
    ("samples", ">=", 40000), ("seconds", "<=", 300), ("h12_gain0_median_mm", "<=", 0.12), ("h12_gain10_median_mm", "<=", 0.40),
    ("force_mape_scaled_gain0_percent", "<=", 0.5), ("force_mape_scaled_gain10_percent", "<=", 3.5), ("h6_prior_p99_mm", "<=", 1.5),
    ("h6_bad_unflagged_percent", "<=", 0.5), ("saturated_median_mm", "<=", 0.1), ("emulated_frames_different", "<=", 0))


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip().splitlines() or ["nothing said"]
        raise InputError(f"{pathlib.Path(str(command[0])).name} failed: {said[-1]}")
    return done.stdout


class Progress:
    def __init__(self, total):
        self.start_s = time.monotonic()
        self.total, self.done = total, 0

    def step(self, what):
        self.done += 1
        elapsed_s = time.monotonic() - self.start_s
        text = f"{elapsed_s:5.0f} s  scene {self.done} of {self.total}: {what}"
        if sys.stdout.isatty():
            print(f"\r{text:<78}", end="\n" if self.done == self.total else "", flush=True)
        elif self.done % 10 == 0 or self.done == self.total:
            print(text, flush=True)


class Played:
    """Arrays over the frames of one scene: time_s, truth and what was said; acts: rows of the truth file as dicts of floats."""

    def __init__(self, scenario, recording, truth):
        # The truth columns only: t_s, contact, x_mm, y_mm, force_N, (p0, sigma), slip
        table = np.loadtxt(scenario, delimiter=",", comments=["#", "t_s"], usecols=(0, 1, 2, 3, 4, 7), ndmin=2)
        said = read_recording(recording)
        rows = said.has_contact
        self.time_s = said["t_us"][rows] * 1e-6
        flags = said["flags"][rows].astype(np.int64)
        at = [np.interp(self.time_s, table[:, 0], table[:, i]) for i in range(1, 6)]
        self.touched = at[0] > 1 - 1e-9
        self.free = at[0] < 1e-9
        self.x_mm, self.y_mm, self.force_N = at[1:4]
        self.slips = at[4] > 0.5
        self.flags = flags
        self.fitted = (flags & FIT_VALID) != 0
        self.felt = (flags & CONTACT) != 0
        self.said = {name: said[name][rows] for name in ("x_mm", "y_mm", "p0_Pa", "sigma_mm", "force_N", "slip_mm")}
        if said.sensors_Pa.shape[1]:
            self.above_Pa = (said.sensors_Pa - said.tare_Pa)[rows]
        with open(truth, newline="", encoding="utf-8") as file:
            self.phases = list(csv.DictReader(line for line in file if not line.startswith("#")))
        self.sample = self.touched & self.fitted
        self.error_mm = np.hypot(self.said["x_mm"] - self.x_mm, self.said["y_mm"] - self.y_mm)

    def located(self, force_min_N=FORCE_MIN_N):
        return self.sample & (self.force_N >= force_min_N)


class Workshop:
    """Scenes are written, played and read; the files go, the arrays stay."""

    def __init__(self, options, out):
        tools = pathlib.Path(options.build) / "host_tools"
        self.twin, self.player, self.fingertip = tools / "twin/twin", tools / "player/fingertip_player", tools / "cli/fingertip"
        for tool in (self.twin, self.player, self.fingertip):
            if not tool.exists():
                raise InputError(f"{tool} is not there; build it: cmake --build --preset host")
        self.image, self.seed, self.scale = pathlib.Path(options.image), options.seed, options.scale
        self.tables = pathlib.Path(options.tables or out / "contact_tables")
        self.work = out / "validation_work"
        self.work.mkdir(parents=True, exist_ok=True)
        self.indenters = set(options.indenters.split(",")) if options.indenters else None
        self.pads = options.pads
        self.jobs, self.played = {}, {}

    def add(self, key, kind, indenter, layer_mm=12, seconds=120, effects="", noise=1, rate=PAPER_RATE_Hz, play=(), scene=(), raw=False):
        """key: as which Played it is found; skipped if its indenter is not among those asked for."""
        if self.indenters is None or indenter in self.indenters:
            self.jobs[key] = (kind, indenter, layer_mm, seconds, effects, noise, rate, tuple(play), tuple(scene), raw)

    def build_tables(self):
        pairs = sorted({(job[1], job[2]) for job in self.jobs.values()})
        print(f"        contact tables: {len(pairs)} (the first time some five minutes)", flush=True)
        for layer_mm in sorted({layer for _, layer in pairs}):
            names = ",".join(sorted({name for name, layer in pairs if layer == layer_mm}))
            done = subprocess.run([str(self.twin), "tables", "--indenter", names, "--layer", str(layer_mm), "--cache", str(self.tables)],
                                  stdout=subprocess.DEVNULL)
            if done.returncode != 0:
                raise InputError("twin tables failed; see above")

    def play_one(self, key):
        kind, indenter, layer_mm, seconds, effects, noise, rate, play, scene, raw = self.jobs[key]
        name = "-".join(str(part) for part in key).replace("/", "_").replace(" ", "_")
        scenario, recording = self.work / f"{name}.csv", self.work / f"{name}.recording.csv"
        length = ("--seconds", min(seconds, max(SECONDS_MIN, seconds * self.scale)))
        run(self.twin, "scene", kind, "--indenter", indenter, "--layer", layer_mm, "--effects", effects or "none", "--seed", self.seed,
            "--cache", self.tables, "-o", scenario, "--overwrite", *length, *scene)
        run(self.player, "play", scenario, "-o", recording, "--overwrite", "--quiet", "--rate", rate, "--noise", noise, "--seed", self.seed,
            *(("--raw",) if raw else ()), *play)
        played = Played(scenario, recording, scenario.with_suffix(".truth.csv"))
        for file in (scenario, scenario.with_suffix(".truth.csv"), recording):
            file.unlink()
        return played

    def play_all(self):
        progress = Progress(len(self.jobs))
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            running = {pool.submit(self.play_one, key): key for key in self.jobs}
            for done in concurrent.futures.as_completed(running):
                key = running[done]
                self.played[key] = done.result()
                progress.step(" ".join(str(part) for part in key))
        return time.monotonic() - progress.start_s

    def emulate(self, seconds):
        """The image on the emulated chip plays a scene; its contact packets computed here from its pressures."""
        if not self.image.exists():
            raise InputError(f"{self.image} is not there; build it: cmake --preset pico_mux && cmake --build --preset pico_mux")
        scenario, script, capture = self.work / "emulated.csv", self.work / "emulated.txt", self.work / "emulated.bin"
        run(self.twin, "scene", "taps", "--indenter", "sphere6", "--layer", 12, "--effects", "all", "--seconds", seconds, "--seed",
            self.seed, "--cache", self.tables, "-o", scenario, "--overwrite")
        commands = [run(self.fingertip, "encode", *words).strip() for words in (("stream", "contact,raw"), ("info",), ("tare",))]
        script.write_text("0.7 dtr 1\n" + "".join(f"{0.72 + 0.01 * i:.2f} {word}\n" for i, word in enumerate(commands)))
        run("node", HERE.parent / "emulator/main.mjs", "--board", "pico_mux", "--image", self.image, "--scenario", scenario,
            "--host-script", script, "--capture", capture, "--fast-enumeration")
        return json.loads(run(self.player, "repeat", capture))

    def get(self, *key):
        return self.played.get(key)

    def scenes(self, kind, indenter, level):
        """Of every pad."""
        return [played for key, played in self.played.items() if (key[0], *key[1:2], key[-1]) == (kind, indenter, level)]


def plan(shop):
    """Unequal sensors are drawn anew for each pad: one pad's luck is not what the spread costs."""
    for gain in GAINS:
        effects = f"gain={gain}" if gain else ""
        pads = shop.pads if gain else 1
        for pad in range(1, pads + 1):
            for indenter in INDENTERS[:2]:
                shop.add(("grid", indenter, pad, gain), "grid", indenter, seconds=360 / pads, effects=effects, scene=("--pad", pad))
            for indenter in INDENTERS:
                shop.add(("taps", indenter, pad, gain), "taps", indenter, seconds=600 / pads, effects=effects, scene=("--margin", 0, "--pad", pad))
                shop.add(("stiff", indenter, pad, gain), "taps", indenter, layer_mm=6, seconds=300 / pads, effects=effects,
                         scene=("--margin", 0, "--pad", pad), play=("--prior-sigma", SIGMA_PER_LAYER * 6, "--prior-width", PRIOR_WIDTH_mm))
        for indenter in INDENTERS:
            shop.add(("high", indenter, gain), "high", indenter, seconds=150, effects=",".join(filter(None, (effects, "clip"))))
        for indenter in OBJECTS:
            shop.add(("pokes", indenter, gain), "pokes", indenter, seconds=150, effects=effects)
    for indenter in INDENTERS:
        for pad in range(1, shop.pads + 1):
            shop.add(("taps", indenter, pad, "all"), "taps", indenter, seconds=300 / shop.pads, effects="all", scene=("--margin", 0, "--pad", pad))
        shop.add(("stiff without prior", indenter, 0), "taps", indenter, layer_mm=6, seconds=300, scene=("--margin", 0))
        shop.add(("high biased", indenter, 0), "high", indenter, seconds=150, effects="clip,bias")
    shop.add(("cycle", "sphere6"), "cycle", "sphere6", seconds=120, effects="relaxation,hysteresis")
    shop.add(("signals", "sphere6"), "taps", "sphere6", seconds=12, effects="gain=10,relaxation", rate="max", raw=True)
    for indenter in (*OBJECTS, *(f"{shape}{size}" for shape in SHAPES for size in SIZES)):
        shop.add(("slip", indenter, "steady"), "slip", indenter, seconds=150)
        shop.add(("slip", indenter, "stick-slip"), "slip", indenter, seconds=150, scene=("--stick-slip", 2))
    for dead_travel_mm in (0, 0.5, 2):
        shop.add(("dead travel", dead_travel_mm), "slip", "sphere18", seconds=150, scene=("--dead-travel", dead_travel_mm))
    shop.add(("slip fast",), "slip", "sphere18", seconds=150, rate="max")
    shop.add(("reconstructed",), "slip", "sphere18", seconds=12, raw=True, scene=("--speed", 20))
    for what, effects, noise in BUDGET:
        shop.add(("budget", what), "taps", "sphere6", seconds=300, effects=effects, noise=noise, scene=("--margin", 0))
    for kind in ("twist", "rolloff", "two"):
        shop.add(("other", kind), kind, "cube12" if kind == "twist" else "sphere15", seconds=60)


def by_level(shop, first, level, pad=None):
    """error_mm, force_N, said force_N, flags of the located samples of the scenes of this kind and level, of one pad or of all."""
    keys = [key for key in shop.played if key[0] == first and key[-1] == level and (pad is None or key[2] == pad)]
    parts = [shop.played[key] for key in keys]
    if not parts:
        return None
    take = [(p, p.located()) for p in parts]
    return tuple(np.concatenate([getter(p)[keep] for p, keep in take]) for getter in (
        lambda p: p.error_mm, lambda p: p.force_N, lambda p: p.said["force_N"], lambda p: p.flags))


def force_errors(force_N, said_N):
    """RMSE in N, MAPE (median of the absolute errors) in percent, r."""
    relative = np.abs(said_N - force_N) / force_N
    return float(np.sqrt(np.mean((said_N - force_N) ** 2))), float(100 * np.median(relative)), float(np.corrcoef(force_N, said_N)[0, 1])


def scale_of(force_N, said_N):
    """The one factor that a user finds with one known weight: median of true over said."""
    return float(np.median(force_N / said_N))


class Slips:
    """The acts of slip scenes: speed, steps judged, steps right, seconds from the pusher's start to the first SLIP (NaN: none)."""

    def __init__(self, *scenes):
        self.acts = np.array([act for played in scenes for act in self.judge(played)]).reshape(-1, 4)

    @staticmethod
    def judge(played):
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
            yield float(moving[0]["speed_mm_s"]), near.sum(), (said == played.slips)[near].sum(), found[0] - begin if len(found) else np.nan

    def at(self, speed_mm_s):
        made = Slips()
        made.acts = self.acts[self.acts[:, 0] == speed_mm_s]
        return made

    @property
    def speeds_mm_s(self):
        return sorted(set(self.acts[:, 0]))

    @property
    def steps(self):
        return int(self.acts[:, 1].sum())

    @property
    def success_percent(self):
        return float(100 * self.acts[:, 2].sum() / self.steps) if self.steps else None

    @property
    def success(self):
        return f"{self.success_percent:.1f} %" if self.steps else "-"

    @property
    def latency(self):
        """Median / 95 % in ms, and how many were never found."""
        found = self.acts[np.isfinite(self.acts[:, 3]), 3]
        if not len(found):
            return "none found"
        missed = len(self.acts) - len(found)
        return f"{1e3 * np.median(found):.0f} / {1e3 * np.quantile(found, 0.95):.0f}" + (f", {missed} of {len(self.acts)} not found" if missed else "")


def figures(shop, seconds, emulated):
    found = {"samples": int(sum(p.sample.sum() for p in shop.played.values())), "frames": int(sum(len(p.time_s) for p in shop.played.values())),
             "seconds": seconds}
    for gain in GAINS:
        taps = by_level(shop, "taps", gain)
        found[f"h12_gain{gain}_median_mm"] = float(np.median(taps[0]))
        pads = sorted({key[2] for key in shop.played if key[0] == "taps" and key[-1] == gain})
        per_pad = [by_level(shop, "taps", gain, pad) for pad in pads]
        found[f"h12_gain{gain}_median_mm_per_pad"] = [float(np.median(data[0])) for data in per_pad]
        scales = [scale_of(data[1], data[2]) for data in per_pad]  # each pad has a factor of its own
        found[f"force_scale_gain{gain}"] = float(np.median(scales))
        relative = np.concatenate([np.abs(scale * data[2] / data[1] - 1) for scale, data in zip(scales, per_pad)])
        found[f"force_mape_scaled_gain{gain}_percent"] = float(100 * np.median(relative))
        if gain == 0:
            found["force_mape_raw_percent"] = force_errors(taps[1], taps[2])[1]
    stiff = by_level(shop, "stiff", 0)
    found["h6_prior_p99_mm"] = float(np.quantile(stiff[0], 0.99))
    found["h6_bad_unflagged_percent"] = float(100 * np.mean((stiff[0] > 1) & ((stiff[3] & LOCATION_WARNINGS) == 0)))
    bare = by_level(shop, "stiff without prior", 0)
    found["h6_no_prior_p99_mm"] = float(np.quantile(bare[0], 0.99))
    found["h6_no_prior_bad_unflagged_percent"] = float(100 * np.mean((bare[0] > 1) & ((bare[3] & LOCATION_WARNINGS) == 0)))
    for name, first in (("saturated_median_mm", "high"), ("saturated_biased_median_mm", "high biased")):
        high = by_level(shop, first, 0)
        saturated = (high[3] & SATURATED) != 0
        found[name] = float(np.median(high[0][saturated])) if saturated.any() else None
        found[name.replace("median_mm", "samples")] = int(saturated.sum())
    slips = Slips(*(p for key, p in shop.played.items() if key[0] == "slip" and key[-1] == "steady"))
    found["slip_success_percent"], found["slip_steps"] = slips.success_percent, slips.steps
    found["emulated_frames"] = emulated["frames"] if emulated else None
    found["emulated_frames_different"] = emulated["frames"] - emulated["equal"] if emulated else None
    found["goals"] = {}
    for name, sign, bound in GOALS:
        value = found[name]
        met = None if value is None else value <= bound if sign == "<=" else value >= bound
        found["goals"][name] = {"goal": f"{sign} {bound:g}", "met": met}
    return found


class Report:
    def __init__(self):
        self.lines = []

    def text(self, *lines):
        self.lines += [*lines, ""]

    def table(self, header, rows):
        self.lines += ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
        self.lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
        self.lines.append("")

    def write(self, path):
        write_text(path, "\n".join(self.lines))


def median_std(scenes):
    errors = np.concatenate([played.error_mm[played.located()] for played in scenes])
    return f"{np.median(errors):.3f} / {np.std(errors):.3f}"


def write_report(shop, found, out):
    r = Report()
    r.text("# The published experiments on the simulated fingertip",
           "Columns headed *paper* are measured on hardware (De Clercq et al., RA-L 2022). Columns headed *simulated* come from the twin: an "
           "elastic layer under the paper's indenters, the firmware's own code on simulated sensors. The two do not compare as better and worse: "
           "a simulated pad is as straight, as bonded and as quiet as it is told to be.",
           f"{found['samples']} samples (frames in contact with a fit) out of {found['frames']} frames, at {PAPER_RATE_Hz} Hz where nothing else is "
           f"said, OSR 1024, in {found['seconds']:.0f} s. The image on the emulated chip played {found['emulated_frames']} frames of such taps: "
           f"{found['emulated_frames'] - found['emulated_frames_different']} of its contact packets are what the same code gives here, byte for "
           "byte. Layers: rubber of Shore 15 A, 12 mm unless said otherwise.")
    r.text("## Figures and goals")
    r.table(("figure", "value", "goal", ""), [
        (f"`{name}`", "-" if found[name] is None else f"{found[name]:.4g}", goal["goal"], {True: "met", False: "**missed**", None: "not measured"}[goal["met"]])
        for name, goal in found["goals"].items()])

    r.text("## Where: localisation", "Median / standard deviation of the error in mm, samples of at least 1 N (paper: table II). Unequal sensors: "
           f"{shop.pads} pads, medians of their taps {min(found['h12_gain10_median_mm_per_pad']):.2f} to "
           f"{max(found['h12_gain10_median_mm_per_pad']):.2f} mm.")
    rows = []
    for kind, label in (("grid", "Sampling grid"), ("taps", "Random taps, 1 to 15 N")):
        for indenter in INDENTERS:
            paper = PAPER_LOCATION_mm.get((kind, indenter))
            cells = [shop.scenes(kind, indenter, level) for level in (*GAINS, "all")]
            if paper and any(cells):
                rows.append((label, NAMES[indenter], f"{paper[0]} / {paper[1]}", *(median_std(c) if c else "-" for c in cells)))
    r.table(("", "", "paper", "simulated, equal sensors", "simulated, gain spread 10 %", "simulated, every effect"), rows)
    shares = []
    for level in GAINS:
        taps = by_level(shop, "taps", level)
        warned = (taps[3] & LOCATION_WARNINGS) != 0
        bad = (taps[0] > 1) & ~warned
        shares.append(f"gain spread {level} %: {100 * warned.mean():.1f} % carry a warning, {100 * bad.mean():.2f} % are off by more than 1 mm without one")
    r.text("Of the taps, " + "; ".join(shares) + ". UNCERTAIN begins at a predicted standard deviation of 0.12 mm where the residuals are rough, "
           "as unequal sensors make them.")
    near = {}
    for p in (p for key, p in shop.played.items() if key[0] == "grid" and key[-1] == 10):
        for phase in p.phases:
            inside = p.located() & (p.time_s >= float(phase["t_begin_s"])) & (p.time_s < float(phase["t_end_s"]))
            near.setdefault(int(phase["sensors_near"]), []).append(p.error_mm[inside])
    if near:
        r.text("By place on the grid, gain spread 10 % (paper: section IV.B), median in mm:")
        r.table(("place", "paper", "simulated"), [
            (label, PAPER_NEAR_mm[n], f"{np.median(np.concatenate(near[n])):.3f}")
            for n, label in ((1, "above a sensor"), (2, "between two"), (4, "between four")) if n in near])
    r.text("What remains with equal sensors is the difference between a layer's pressure and a Gaussian; the gains of the sensors dominate "
           "everything else (error budget below). The paper's 0.5 mm are what a spread of some 10 to 15 % would give here; its standard deviations "
           "of up to 1.42 mm have outliers of several mm that nothing in this model produces. The paper finds the cube worse than the others; here "
           "it is not, since under 12 mm of rubber a face of 6 mm is as good as a point.")

    r.text("## How hard: force", "RMSE in N / MAPE in % (median) / correlation r. *Scaled*: times one factor, "
           f"{found['force_scale_gain0']:.3f}, found on the taps with equal sensors.",
           "The paper's F = 2 pi p0 sigma^2 is low by some 9 % for physics: the Gaussian that fits the pressure on the base best holds 0.9 of the "
           "force, whatever presses and however thick the layer; the rest is in tails that fall off slower. One known weight finds the factor.")
    rows = []
    for kind, label in (("taps", "Robot taps, 1 to 15 N"), ("pokes", "Five objects, 0 to 25 N"), ("high", "25 to 50 N, clip at 2 bar")):
        cells = []
        for gain in GAINS:
            data = by_level(shop, kind, gain)
            if data is None:
                cells += ["-", "-"]
                continue
            raw, scaled = force_errors(data[1], data[2]), force_errors(data[1], found["force_scale_gain0"] * data[2])
            cells += [f"{raw[0]:.2f} / {raw[1]:.1f} / {raw[2]:.4f}", f"{scaled[0]:.2f} / {scaled[1]:.2f}"]
        rows.append((label, "{} / {}".format(*PAPER_FORCE[kind]), *cells))
    r.table(("", "paper", "simulated, equal sensors", "the same, scaled", "simulated, gain spread 10 %", "the same, scaled"), rows)
    everything = [(p.force_N[keep], p.said["force_N"][keep]) for p, keep in (
        (p, p.located()) for key, p in shop.played.items() if key[0] in ("grid", "taps", "pokes", "high"))]
    force, said = (np.concatenate(parts) for parts in zip(*everything))
    r.text(f"Over all samples of at least 1 N, every effect among them, r = {np.corrcoef(force, said)[0, 1]:.4f} (paper: {PAPER_R}).",
           "![Force: taps, an object, all samples, a quasi-static loop](validation_force.png)")

    stiff = by_level(shop, "stiff", 10)
    r.text("## A stiff pad: layer of 6 mm",
           "There the pressure is so narrow (sigma 2.8 mm at a pitch of 9 mm) that the array hardly tells its width. With the prior on sigma "
           f"({SIGMA_PER_LAYER * 6:.2f} mm, standard deviation {PRIOR_WIDTH_mm} mm) the error over the taps is "
           f"p99 {found['h6_prior_p99_mm']:.2f} mm, without it {found['h6_no_prior_p99_mm']:.2f} mm; samples off by more than 1 mm without a warning: "
           f"{found['h6_bad_unflagged_percent']:.2f} % and {found['h6_no_prior_bad_unflagged_percent']:.2f} %. With a gain spread of 10 % and the prior: "
           f"p99 {np.quantile(stiff[0], 0.99):.2f} mm." if stiff else "")
    if found["saturated_median_mm"] is not None:
        r.text("## Beyond the range: 25 to 50 N",
               f"Sensors beyond 2 bar are left out of the fit ({found['saturated_samples']} samples): median error {found['saturated_median_mm']:.3f} mm; "
               f"with readings that come out low by up to 1 % above 1.2 bar {found['saturated_biased_median_mm']:.3f} mm.")

    write_slip(shop, found, r)
    write_budget(shop, r)
    r.text("## What is not the paper",
           "The pad has no edges, no friction and no large strain; at high forces a ball of 6 mm would be pressed in deeper than the layer "
           "allows. The objects are stand-ins whose shape is ours. Relaxation and hysteresis act on the readings at a given force. The paper's layer "
           "thickness and gains are not known.")
    r.text("![Signals of the fifteen sensors during taps](validation_signals.png)",
           "*Readings of the fifteen sensors and the force, as the paper's Fig. 6: gain spread 10 %, relaxation.*")
    r.write(out / "validation.md")


def write_slip(shop, found, r):
    r.text("## Slip, step by step",
           "Success per step of 50 ms: SLIP against whether the pusher moves, from half a second before it starts to half a second after it "
           "stops; eq. (7), n = 2, threshold 0.75 mm, 20 Hz; speeds 20, 50, 100, 150 and 200 mm/s over 24 mm; elastic dead travel of 1 mm, which "
           "counts as slip as in the paper. The contact moves as the kinematics of `twin scene slip` say: in the paper friction decides.")
    objects = [indenter for indenter in (*OBJECTS, *(f"{s}{n}" for s in SHAPES for n in SIZES)) if shop.get("slip", indenter, "steady")]
    rows = []
    for name in objects:
        steady, jumps = Slips(shop.get("slip", name, "steady")), Slips(shop.get("slip", name, "stick-slip"))
        label = NAMES.get(name, f"{name.rstrip('0123456789').capitalize()}, {name.lstrip('abcdefghijklmnopqrstuvwxyz')} mm")
        rows.append((label, f"{PAPER_SLIP[name]} %", steady.success, jumps.success, steady.latency))
    r.text("Latency: from the pusher's start to the first SLIP, median / 95 %, ms.")
    r.table(("", "paper", "simulated, steady", "simulated, stick-slip of 2 mm", "latency, steady"), rows)
    if found["slip_success_percent"] is not None:
        r.text(f"Over all: {found['slip_success_percent']:.1f} % of {found['slip_steps']} steps, steady (paper: {PAPER_SLIP_ALL} % over its five objects). "
               "The steps that are missed are the first of each slip and the dead travel; those found too many are the last, since the mean of "
               "the past two places lags. That the objects hardly differ is the model's doing: it has no friction that would.")
    steady = Slips(*(p for key, p in shop.played.items() if key[0] == "slip" and key[-1] == "steady"))
    fast = Slips(*filter(None, [shop.get("slip fast")]))
    r.text("By speed, over all objects; beside it the sphere of 18 mm with every frame that the sensors give, where eq. (7) looks back over the "
           "same 0.1 s:")
    r.table(("speed", "success", "latency", "success, every frame", "latency, every frame"), [
        (f"{speed:g} mm/s", steady.at(speed).success, steady.at(speed).latency, fast.at(speed).success, fast.at(speed).latency)
        for speed in steady.speeds_mm_s])
    r.text("By dead travel, sphere of 18 mm:")
    r.table(("dead travel", "success", "latency"), [
        (f"{key[1]:g} mm", Slips(played).success, Slips(played).latency) for key, played in shop.played.items() if key[0] == "dead travel"])
    r.text("![Reconstructed pressure during a slip](validation_slip.png)",
           "*Reconstructed pressure p0 exp(-r^2 / 2 sigma^2) during a slip, as the paper's Fig. 8c.*")


def write_budget(shop, r):
    rows = []
    for what, effects, noise in BUDGET:
        played = shop.get("budget", what)
        if played is None:
            continue
        keep = played.located()
        scale = scale_of(played.force_N[keep], played.said["force_N"][keep])
        mape = force_errors(played.force_N[keep], scale * played.said["force_N"][keep])
        rows.append((what, f"{np.median(played.error_mm[keep]):.3f}", f"{np.quantile(played.error_mm[keep], 0.95):.3f}", f"{mape[1]:.2f}",
                     f"{mape[0]:.3f}", f"{scale:.3f}"))
    if rows:
        r.text("## Error budget", "Taps of 1 to 15 N with the small sphere on 12 mm, one effect at a time; force after one factor for the pad.",
               "Conversions of all sensors run at the same moment, so reading them one after the other costs nothing in place; a contact that "
               "moves during the 2.2 ms of a conversion is found where it was in its middle.")
        r.table(("effect", "location, median mm", "95 % mm", "force, MAPE %", "RMSE N", "factor"), rows)
    other = [(key[1], shop.played[key]) for key in shop.played if key[0] == "other"]
    if other:
        r.text("Other scenes: share of samples with a warning, and of those off by more than 1 mm without one.")
        rows = []
        for kind, played in other:
            keep = played.located()
            warned = (played.flags[keep] & LOCATION_WARNINGS) != 0
            bad = (played.error_mm[keep] > 1) & ~warned
            slips = 100 * np.mean((played.flags[played.touched] & SLIP) != 0)
            rows.append((kind, f"{100 * warned.mean():.1f} %", f"{100 * bad.mean():.1f} %", f"{np.median(played.error_mm[keep]):.2f}", f"{slips:.1f} %"))
        r.table(("scene", "warned", "off by 1 mm, not warned", "median mm", "frames with SLIP"), rows)


def draw(shop, out):
    grey, blue, orange = "#8a8f9c", "#2463a8", "#e07b39"
    figure, axes = plt.subplots(2, 2, figsize=(11, 7.5), layout="constrained")
    for axis, key, title in ((axes[0, 0], ("taps", "sphere6", 10), "(a) taps, small sphere"), (axes[0, 1], ("pokes", "ping_pong", 10), "(b) ping-pong ball")):
        scenes = shop.scenes(*key)
        if not scenes:
            axis.set_axis_off()
            continue
        played = scenes[0]
        shown = (played.time_s > 20) & (played.time_s < 40)
        axis.plot(played.time_s[shown], played.force_N[shown], color=orange, label="true")
        axis.plot(played.time_s[shown], played.said["force_N"][shown], ".-", color=blue, ms=3, lw=0.8, label="estimated")
        axis.set(title=title, xlabel="time, s", ylabel="force, N")
        axis.legend(frameon=False)
    axis = axes[1, 0]
    for key, played in shop.played.items():
        if key[0] in ("grid", "taps", "pokes", "high") and key[-1] == 10:
            keep = np.flatnonzero(played.sample)[::7]
            axis.plot(played.force_N[keep], played.said["force_N"][keep], ",", color=blue, rasterized=True)
    axis.plot((0, 50), (0, 50), color=grey, lw=0.8)
    axis.set(title="(c) all samples, gain spread 10 %", xlabel="true force, N", ylabel="estimated force, N")
    played = shop.get("cycle", "sphere6")
    if played is not None:
        acts = [float(phase["t_begin_s"]) for phase in played.phases if phase["phase"] == "load"]
        ends = [float(phase["t_end_s"]) for phase in played.phases if phase["phase"] == "unload"]
        keep = played.touched & (played.time_s >= acts[0]) & (played.time_s <= ends[0])
        axes[1, 1].plot(played.force_N[keep], played.said["force_N"][keep], color=blue)
        axes[1, 1].plot((0, 20), (0, 20), color=grey, lw=0.8)
        axes[1, 1].set(title="(d) slow load cycle, relaxation and hysteresis", xlabel="true force, N", ylabel="estimated force, N")
    figure.suptitle("Simulated fingertip, as the paper's Fig. 7")
    figure.savefig(out / "validation_force.png", dpi=110)
    plt.close(figure)

    played = shop.get("signals", "sphere6")
    if played is not None:
        figure, axis = plt.subplots(figsize=(11, 4), layout="constrained")
        for k in range(played.above_Pa.shape[1]):
            axis.plot(played.time_s, 1e-3 * played.above_Pa[:, k], lw=0.9)
        other = axis.twinx()
        other.plot(played.time_s, played.force_N, color="black", lw=1.2, ls="--")
        other.set_ylabel("true force, N (dashed)")
        axis.set(xlabel="time, s", ylabel="pressure above tare, kPa", title="Readings of the fifteen sensors, simulated")
        figure.savefig(out / "validation_signals.png", dpi=110)
        plt.close(figure)

    played = shop.get("reconstructed")
    if played is not None:
        first = next(phase for phase in played.phases if phase["phase"] == "slip")
        inside = (played.time_s >= float(first["t_begin_s"])) & (played.time_s <= float(first["t_end_s"]))
        moving = np.flatnonzero(played.slips & played.fitted & inside)
        figure, axes = plt.subplots(1, 5, figsize=(11, 4.2), layout="constrained")
        if len(moving) >= 5:
            x, y = np.meshgrid(np.linspace(-15, 15, 120), np.linspace(-25, 25, 200))
            for axis, n in zip(axes, moving[np.linspace(0, len(moving) - 1, 5).astype(int)]):
                s = {name: values[n] for name, values in played.said.items()}
                pressure = 1e-3 * s["p0_Pa"] * np.exp(-((x - s["x_mm"]) ** 2 + (y - s["y_mm"]) ** 2) / (2 * s["sigma_mm"] ** 2))
                image = axis.imshow(pressure, extent=(-15, 15, -25, 25), origin="lower", cmap="viridis", vmin=0)
                axis.plot(SENSOR_X_mm, SENSOR_Y_mm, "w.", ms=3)
                axis.plot(played.x_mm[n], played.y_mm[n], "r+", ms=9)
                axis.set_title(f"{1e3 * (played.time_s[n] - played.time_s[moving[0]]):.0f} ms", fontsize=9)
            figure.colorbar(image, ax=axes, label="kPa", shrink=0.7)
        figure.suptitle("Slip at 20 mm/s, simulated: reconstructed pressure, true place +")
        figure.savefig(out / "validation_slip.png", dpi=110)
        plt.close(figure)


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, metavar="DIR", help="of the host tools")
    parser.add_argument("--image", required=True, metavar="FILE.bin", help="firmware for pico_mux")
    parser.add_argument("-o", "--output", required=True, metavar="DIR")
    parser.add_argument("--picture", metavar="FILE.png", help="where the picture of the force goes too")
    parser.add_argument("--tables", metavar="DIR", help="cache of the contact tables; default: contact_tables in the output")
    parser.add_argument("--seed", type=int, default=1, metavar="N")
    parser.add_argument("--scale", type=float, default=1, metavar="FACTOR", help="of the scenes' lengths; default 1")
    parser.add_argument("--pads", type=int, default=8, metavar="N", help="with unequal sensors; default 8")
    parser.add_argument("--indenters", metavar="NAME,...", help="only scenes with these; sphere6 must be among them")
    parser.add_argument("--emulated-seconds", type=float, default=12, metavar="S", help="of the image on the emulated chip; default 12")
    options = parser.parse_args(argv)
    if not 1 <= options.pads <= 100:
        raise InputError(f"--pads {options.pads} is out of range; give 1 to 100")
    if not 0.01 <= options.scale <= 100:
        raise InputError(f"--scale {options.scale:g} is out of range; give 0.01 to 100")
    out = pathlib.Path(options.output)
    out.mkdir(parents=True, exist_ok=True)
    shop = Workshop(options, out)
    plan(shop)
    shop.build_tables()
    seconds = shop.play_all()
    print("        the image on the emulated chip", flush=True)
    emulated = shop.emulate(options.emulated_seconds)
    for file in shop.work.iterdir():
        file.unlink()
    shop.work.rmdir()
    found = figures(shop, seconds, emulated)
    write_text(out / "validation.json", json.dumps(found, indent=1) + "\n")
    draw(shop, out)
    if options.picture:
        shutil.copy(out / "validation_force.png", options.picture)
    write_report(shop, found, out)
    for name, goal in found["goals"].items():
        value = "-" if found[name] is None else f"{found[name]:.6g}"
        print(f"{ {True: 'ok', False: 'MISSED', None: '-'}[goal['met']]:<7} {name:<34} {value:>10}   goal {goal['goal']}")
    print(f"validation: {out / 'validation.json'}, {out / 'validation.md'}")
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("validation.py", main))
