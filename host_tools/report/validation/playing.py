"""Scenarios of the twin, played with fingertip_player through the firmware's own code, and read. For validation.py.

A calibrated pad is calibrated as a user does it: a weight is set down on it, `fingertip calibrate` judges the recording, and
the player is sent what it finds. A session that is refused is followed by another, with other places. A pad on which all are
refused has no calibrated rows.
"""

import concurrent.futures
import csv
import dataclasses
import json
import pathlib
import time

import numpy as np
from boards import MULTIPLEXED, image_of
from fingertip import Streams, wire
from fingertip.files import FIT_VALID, read_recording
from reporting import built, run
from twin_player import TwinPlayer

ROOT = pathlib.Path(__file__).resolve().parents[3]

PAPER_RATE_Hz = 20
FORCE_MIN_N = 1.0
STIFF_LAYER_mm = 6
PRIOR_WIDTH_mm = 0.5
SECONDS_MIN = 40  # of a scenario that is made shorter: one contact of each kind at least
WEIGHT_N, SESSION_s, SESSION_RATE_Hz, SESSIONS_MAX = 3, 200, 50, 5  # of a calibration
OTHER_PLACES = 1000  # added to a seed: the same pad, other places


@dataclasses.dataclass(frozen=True)
class Scenario:
    what: str  # its purpose
    kind: str
    indenter: str
    case: object = 0  # what is varied: the gain spread in percent, or something else
    seconds: float = 150
    effects: str = ""
    margin_mm: float = None
    pad: int = 1
    layer_mm: float = 12
    prior: bool = False
    calibrated: str = None  # with these effects, before; None: never
    noise: int = 1
    rate: object = PAPER_RATE_Hz
    options: tuple = ()  # more of twin scenario

    @property
    def session(self):
        return self.layer_mm, self.calibrated, self.pad


class Played:
    """Arrays over the frames of one scenario: time_s, truth and estimates; phases: rows of the truth file."""

    def __init__(self, scenario, recording, truth):
        # The truth columns only: t_s, contact, x_mm, y_mm, force_N, (p0, sigma), slip
        table = np.loadtxt(scenario, delimiter=",", comments=["#", "t_s"], usecols=(0, 1, 2, 3, 4, 7), ndmin=2)
        read = read_recording(recording)
        rows = read.has_contact
        self.time_s = read["t_us"][rows] * 1e-6
        self.flags = read["flags"][rows].astype(np.int64)
        touched, self.x_mm, self.y_mm, self.force_N, slips = (np.interp(self.time_s, table[:, 0], table[:, i]) for i in range(1, 6))
        self.touched, self.slips = touched > 1 - 1e-9, slips > 0.5
        self.estimated = {name: read[name][rows] for name in ("x_mm", "y_mm", "p0_Pa", "sigma_mm", "force_N")}
        with open(truth, newline="", encoding="utf-8") as file:
            self.phases = list(csv.DictReader(line for line in file if not line.startswith("#")))
        self.sample = self.touched & ((self.flags & FIT_VALID) != 0)
        self.located = self.sample & (self.force_N >= FORCE_MIN_N)
        self.error_mm = np.hypot(self.estimated["x_mm"] - self.x_mm, self.estimated["y_mm"] - self.y_mm)


class Workshop(TwinPlayer):
    """Scenarios are written, played and read; the files go, the arrays stay."""

    def __init__(self, options, out):
        super().__init__(options.build, pathlib.Path(options.tables or out / "contact_tables"))
        self.image, self.seed, self.scale = image_of(options.boards, MULTIPLEXED), options.seed, options.scale
        self.work = out / "validation_work"
        self.work.mkdir(parents=True, exist_ok=True)
        self.indenters = set(options.indenters.split(",")) if options.indenters else None
        self.pads = options.pads
        self.scenarios, self.played, self.gaussians = [], {}, []
        self.sessions, self.refused = {}, 0  # Scenario.session: the commands for the player that an accepted session found

    def add(self, what, kind, indenter, **more):
        """Nothing if its indenter is not among those asked for."""
        if self.indenters is None or indenter in self.indenters:
            self.scenarios.append(Scenario(what, kind, indenter, **more))

    def add_on_pads(self, what, kind, indenter, seconds, effects, **more):
        """Unequal sensors are drawn again for each pad, the presses too: one pad's luck is not what the spread costs."""
        pads = self.pads if any(name in effects for name in ("gain", "all", "widths", "places", "memory", "aftereffect")) else 1
        for pad in range(1, pads + 1):
            self.add(what, kind, indenter, seconds=seconds / pads, pad=pad, effects=effects, **more)

    def fit_gaussians(self):
        """The Gaussian that comes closest to each pressure on the base."""
        pairs = sorted({(scenario.indenter, scenario.layer_mm) for scenario in self.scenarios})
        for indenter, layer_mm in pairs:
            text = run(self.twin, "width", "--indenter", indenter, "--layer", layer_mm, "--cache", self.tables)
            widths = {name: float(value) for name, value in (word.split("=") for word in text.split())}
            self.gaussians.append({"indenter": indenter, "layer_mm": layer_mm} | widths)

    @property
    def prior_sigma_mm(self):
        """Of the stiff layer: the mean over the indenters there, for a prior does not know which it will be."""
        return float(np.mean([g["sigma_mm"] for g in self.gaussians if g["layer_mm"] == STIFF_LAYER_mm]))

    def calibrate(self, layer_mm, effects, pad):
        """The first session on this pad that is accepted, or None, and how many were refused."""
        path = self.work / f"session-{layer_mm}-{effects}-{pad}.csv"
        recording, commands, seed = path.with_suffix(".recording.csv"), path.with_suffix(".commands"), self.seed + pad - 1
        for refused in range(SESSIONS_MAX):
            more = ("--layer", layer_mm, "--pad", seed, "--force", WEIGHT_N)
            self.write(path, "placements", effects, seed + OTHER_PLACES * refused, SESSION_s, *more)
            self.play(path, recording, seed, "--rate", SESSION_RATE_Hz, "--raw")
            if self.accepts(recording, WEIGHT_N, commands):
                return commands, refused
        return None, SESSIONS_MAX

    def play_one(self, scenario):
        path = self.work / f"scenario{self.scenarios.index(scenario)}.csv"
        recording, truth, seed = path.with_suffix(".recording.csv"), path.with_suffix(".truth.csv"), self.seed + scenario.pad - 1
        seconds = min(scenario.seconds, max(SECONDS_MIN, scenario.seconds * self.scale))
        margin = () if scenario.margin_mm is None else ("--margin", scenario.margin_mm)
        pressed = ("--indenter", scenario.indenter, "--layer", scenario.layer_mm, *margin, *scenario.options)
        self.write(path, scenario.kind, scenario.effects, seed, seconds, *pressed)
        prior = ("--set", f"prior={self.prior_sigma_mm}:{PRIOR_WIDTH_mm}") if scenario.prior else ()
        first = () if scenario.calibrated is None else ("--first", self.sessions[scenario.session])
        self.play(path, recording, seed, "--rate", scenario.rate, "--noise", scenario.noise, *prior, *first)
        played = Played(path, recording, truth)
        for file in (path, truth, recording):
            file.unlink()
        return played

    def play_all(self, steps):
        """Seconds that the scenarios took."""
        wanted = list(dict.fromkeys(scenario.session for scenario in self.scenarios if scenario.calibrated is not None))
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            for session, (commands, refused) in zip(wanted, pool.map(lambda session: self.calibrate(*session), wanted)):
                self.sessions[session] = commands
                self.refused += refused
            steps.report(f"{len(wanted)} pads calibrated")
            start_s = time.monotonic()
            self.scenarios = [one for one in self.scenarios if one.calibrated is None or self.sessions[one.session]]
            for number, (scenario, played) in enumerate(zip(self.scenarios, pool.map(self.play_one, self.scenarios)), 1):
                self.played[scenario] = played
                if number % 10 == 0 or number == len(self.scenarios):
                    steps.report(f"scenario {number} of {len(self.scenarios)}")
        return time.monotonic() - start_s

    def emulate(self, effects, seconds):
        """Runs a scenario on the image of the emulated chip, and computes its contact packets here from its pressures."""
        built(self.image)
        scenario, script, capture = self.work / "emulated.csv", self.work / "emulated.txt", self.work / "emulated.bin"
        self.write(scenario, "taps", effects, self.seed, seconds, "--indenter", "sphere6", "--layer", 12)
        commands = wire.SetStreams(Streams.CONTACT | Streams.RAW), wire.AskInfo(), wire.Tare(0)
        frames = [wire.encode(wire.Packet(0, 0, command)).hex() for command in commands]
        script.write_text("0.7 dtr 1\n" + "".join(f"{0.72 + 0.01 * i:.2f} {frame}\n" for i, frame in enumerate(frames)))
        chip = (ROOT / "host_tools/simulation/emulator/main.mjs", "--board", MULTIPLEXED, "--image", self.image, "--fast-enumeration")
        run("node", *chip, "--scenario", scenario, "--host-script", script, "--capture", capture)
        return json.loads(run(self.player, "repeat", capture))

    def select(self, what, **wanted):
        """What was played for it, those scenarios only that have these members."""
        chosen = [one for one in self.scenarios if one.what == what and all(getattr(one, name) == value for name, value in wanted.items())]
        return [self.played[scenario] for scenario in chosen]

    def first(self, what, **wanted):
        return next(iter(self.select(what, **wanted)), None)

    def pads_of(self, what, **wanted):
        """The same for each pad."""
        return [played for pad in range(1, self.pads + 1) if (played := self.select(what, pad=pad, **wanted))]
