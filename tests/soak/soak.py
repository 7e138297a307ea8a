#!/usr/bin/python3
"""Runs episodes of faults on the firmware, and judges each frame against the truth: fingertip_soak, and the release images in the emulator.

    soak.py --build build/host --boards build --hours 8            episodes of every kind, from another seed each time
    soak.py --build build/host --boards build --least 1 24         until one hour is emulated and 24 are native, earlier runs of the
                                                                   same images and programs, whatever commit, included
    soak.py --build build/host --boards build --kinds native --episodes 3 --seconds 30 --seed 1    the same each time

Kinds: native (boards/native in one process), pico_mux, pico_parallel (emulated). steady_native and steady_pico_parallel: nothing goes wrong,
at the highest rate with a pad's profile, over a wrap of the clock's 32 bits; natively with the second processor as a thread. What is found is kept in build/soak/findings, named and
told with the command that does it again; every episode is a line of build/soak/results.jsonl. Exit status 1 if there is any finding.
"""

import argparse
import concurrent.futures
import hashlib
import itertools
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
EMULATED = ("pico_mux", "pico_parallel")
KINDS = (*EMULATED, "native")
STEADY = {"steady_native": "native", "steady_pico_parallel": "pico_parallel"}
EPISODE_s = {"native": 600, "pico_mux": 60, "pico_parallel": 60, "steady_native": 3600, "steady_pico_parallel": 600}
COUNTS = ("hangs", "wrong_unflagged", "uncounted_losses", "disorder")
SUMS = (
    "seconds",
    "bouts",
    "frames",
    "unwarned",
    "at_rest",
    "readings",
    "missing",
    "skipped",
    "answered",
    "excused",
    "loads",
    "late",
    "sequence_wraps",
    *COUNTS,
)
WORST = ("worst_mm", "worst_force", "worst_Pa")
COMMIT = re.compile(rb"fingertip-git=[0-9a-z]+\+?\0")  # write_build_info.cmake
# No machine is too slow for an episode in this; one that takes longer hangs.
HANGS_s = 3600


class Stop(Exception):
    """What the user can mend, in one line."""


class Soak:
    def __init__(self, build, boards, out, kinds):
        self.out = out
        self.program = build / "tests/soak/fingertip_soak"
        self.images = {
            board: boards / board / f"fingertip-{board}.bin" for board in EMULATED if board in [STEADY.get(kind, kind) for kind in kinds]
        }
        for path in (self.program, *self.images.values()):
            if not path.is_file():
                raise Stop(f"{path}: is not there; build it: cmake --preset host && cmake --build --preset host")
        self.keys = {kind: self.key(kind) for kind in kinds}

    def key(self, kind):
        """What an episode is of: code and constants of the program and the image, whatever commit they name."""
        parts = [self.program.read_bytes()]
        if parts[0].startswith(b"\x7fELF"):
            with tempfile.NamedTemporaryFile() as stripped:
                subprocess.run(
                    [
                        "objcopy",
                        "-O",
                        "binary",
                        "--only-section=.text",
                        "--only-section=.rodata",
                        "--only-section=.data",
                        self.program,
                        stripped.name,
                    ],
                    check=True,
                )
                parts = [pathlib.Path(stripped.name).read_bytes()]
        if STEADY.get(kind, kind) in self.images:
            parts.append(self.images[STEADY.get(kind, kind)].read_bytes())
        return hashlib.sha256(b"".join(COMMIT.sub(b"", part) for part in parts)).hexdigest()[:16]

    def command(self, kind, seed, seconds):
        board, how = STEADY.get(kind, kind), ["--seed", seed, "--seconds", seconds, *(["--steady"] if kind in STEADY else [])]
        if board == "native":
            return [self.program, *how]
        return ["node", HERE / "emulated.mjs", "--image", self.images[board], "--board", board, "--soak", self.program, *how]

    def episode(self, kind, seed, seconds):
        call = [str(part) for part in self.command(kind, seed, seconds)]
        begun_s = time.monotonic()
        try:
            done = subprocess.run(call, capture_output=True, text=True, timeout=HANGS_s, check=False)
            said, why = done.stdout.strip().splitlines(), f"ended with {done.returncode}: {done.stderr.strip()[-600:]}"
        except subprocess.TimeoutExpired:
            said, why = [], f"did not end within {HANGS_s} s"
        try:
            result = json.loads(said[-1])
        except (IndexError, ValueError):
            result = {name: 0 for name in (*SUMS, *WORST)} | {"hangs": 1, "findings": [why], "recovery": {}, "seed": seed}
        result["findings"] += result.pop("warnings", [])
        result = {"kind": kind, "key": self.keys[kind], **result, "wall_s": round(time.monotonic() - begun_s, 2)}
        if result["findings"]:
            self.keep(result, call)
        with open(self.out / "results.jsonl", "a", encoding="utf-8") as file:
            file.write(json.dumps(result) + "\n")
        return result

    def keep(self, result, call):
        findings = self.out / "findings"
        findings.mkdir(parents=True, exist_ok=True)
        path = findings / f"{result['kind']}-{result['key']}-{result['seed']}.txt"
        path.write_text("\n".join([*result["findings"], "to do it again:", " ".join(call)]) + "\n", encoding="utf-8")

    def earlier(self):
        """Of the same images and programs, each seed once."""
        found = {}
        try:
            lines = (self.out / "results.jsonl").read_text(encoding="utf-8").splitlines()
        except FileNotFoundError:
            lines = []
        for line in lines:
            try:
                result = json.loads(line)
            except ValueError:
                continue  # the end of a run that was killed
            if result["key"] == self.keys.get(result["kind"]):
                found[result["kind"], result["seed"], result["seconds"]] = result
        return list(found.values())


def hours(results, *kinds):
    return sum(result["seconds"] for result in results if result["kind"] in kinds) / 3600


def summary(results):
    """Figures of all these episodes."""
    found = {"soak_hours_emulated": round(hours(results, *EMULATED), 3), "soak_hours_native": round(hours(results, "native"), 3)}
    found |= {name: sum(result[name] for result in results) for name in COUNTS}
    found["soak"] = []
    for kind in (*KINDS, *(kind for kind in STEADY if any(result["kind"] == kind for result in results))):
        own = [result for result in results if result["kind"] == kind]
        row = {"bench": kind, "episodes": len(own)} | {name: sum(result[name] for result in own) for name in SUMS}
        row |= {name: max((result[name] for result in own), default=0) for name in WORST}
        row["device_s_per_wall_s"] = round(row["seconds"] / max(1e-9, sum(result["wall_s"] for result in own)), 2)
        found["soak"].append(row)
    recovery = {}
    for result in results:
        bench = "native" if STEADY.get(result["kind"], result["kind"]) == "native" else "emulated"
        for fault, one in result["recovery"].items():
            row = recovery.setdefault(
                fault, {"fault": fault, "native_bouts": 0, "native_worst_s": None, "emulated_bouts": 0, "emulated_worst_s": None}
            )
            row[f"{bench}_bouts"] += one["bouts"]
            row[f"{bench}_worst_s"] = round(max(row[f"{bench}_worst_s"] or 0, one["worst_s"]), 3)
    found["recovery"] = [recovery[name] for name in sorted(recovery)]
    worst = [row[name] for row in found["recovery"] for name in ("native_worst_s", "emulated_worst_s") if row[name] is not None]
    found["worst_recovery_s"] = max(worst, default=None)
    found["findings"] = [f"{result['kind']}, seed {result['seed']}: {line}" for result in results for line in result["findings"]]
    return found


def tell(result):
    counts = ", ".join(f"{result[name]} {name}" for name in COUNTS if result[name])
    print(
        f"{result['kind']:20s} seed {result['seed']:<10d} {result['seconds']:7.1f} s in {result['wall_s']:7.1f} s  {result['bouts']:4d} bouts "
        f"{result['frames']:7d} frames{'  FOUND ' + counts if result['findings'] else ''}",
        flush=True,
    )


def run(soak, jobs, wanted, until):
    """wanted: (kind, seed, seconds), without an end perhaps; until(): no more are begun."""
    results, running = [], set()
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        try:
            for job in wanted:
                while len(running) >= jobs:
                    done, running = concurrent.futures.wait(running, return_when=concurrent.futures.FIRST_COMPLETED)
                    for future in done:
                        results.append(future.result())
                        tell(results[-1])
                if until(results):
                    break
                running.add(pool.submit(soak.episode, *job))
        except KeyboardInterrupt:
            print("soak.py: ends with what is under way", file=sys.stderr)
        for future in concurrent.futures.as_completed(running):
            results.append(future.result())
            tell(results[-1])
    return results


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, type=pathlib.Path, metavar="DIR", help="build folder of the host tools")
    parser.add_argument("--boards", required=True, type=pathlib.Path, metavar="DIR", help="folder of the boards' builds")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "build/soak", metavar="DIR", help="default: build/soak")
    how = parser.add_mutually_exclusive_group(required=True)
    how.add_argument("--hours", type=float, metavar="H", help="by the wall; Ctrl-C ends it sooner")
    how.add_argument("--least", type=float, nargs=2, metavar=("EMULATED_H", "NATIVE_H"), help="hours of device time")
    how.add_argument("--episodes", type=int, metavar="N", help="of each kind")
    parser.add_argument("--kinds", nargs="+", choices=(*KINDS, *STEADY), default=KINDS, metavar="KIND")
    parser.add_argument("--seconds", type=float, metavar="S", help="of an episode (default: 600 native, 60 emulated)")
    parser.add_argument("--seed", type=int, metavar="N", help="of the first episode (default: another one each time; with --least 1)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="episodes at a time (default: %(default)s)")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="the figures")
    options = parser.parse_args(argv)
    options.output.mkdir(parents=True, exist_ok=True)
    soak = Soak(options.build.resolve(), options.boards.resolve(), options.output.resolve(), KINDS if options.least else options.kinds)

    def length(kind):
        return options.seconds or EPISODE_s[kind]

    first = options.seed or (1 if options.least else int(time.time()) % 10**9)
    earlier = soak.earlier() if options.least else []
    if options.episodes is not None:
        wanted = [(kind, seed, length(kind)) for seed in range(first, first + options.episodes) for kind in options.kinds]
        results = run(soak, options.jobs, wanted, lambda _: False)
    elif options.hours is not None:
        end_s = time.monotonic() + 3600 * options.hours
        wanted = ((kind, seed, length(kind)) for seed in itertools.count(first) for kind in options.kinds)
        results = run(soak, options.jobs, wanted, lambda _: time.monotonic() >= end_s)
    else:
        has = {(result["kind"], result["seed"]) for result in earlier}
        wanted = []
        for kinds, least_h in ((EMULATED, options.least[0]), (("native",), options.least[1])):
            left_s = 3600 * (least_h - hours(earlier, *kinds))
            for seed, kind in ((seed, kind) for seed in itertools.count(first) for kind in kinds):
                if left_s <= 1e-6:
                    break
                if (kind, seed) not in has:
                    wanted.append((kind, seed, length(kind)))
                    left_s -= length(kind)
        if earlier:
            print(f"soak.py: {len(earlier)} episodes of these images and programs are there, {len(wanted)} are run", flush=True)
        results = run(soak, options.jobs, wanted, lambda _: False)
    found = summary(earlier + results) | {"soak_episodes_now": len(results)}
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    count = len(found["findings"])
    print(
        f"{found['soak_hours_emulated']:.2f} h emulated and {found['soak_hours_native']:.2f} h native, "
        f"{count} finding{'' if count == 1 else 's'}{f', kept in {soak.out}/findings' if count else ''}"
    )
    return 1 if count else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except Stop as stop:
        sys.exit(f"soak.py: {stop}")
