#!/usr/bin/python3
"""Runs the fuzz targets, which `cmake --preset fuzz && cmake --build --preset fuzz` makes.

    fuzz.py --build build/fuzz --runs 1000 wire      the seeds, and what a fixed walk makes of them: the same each time
    fuzz.py --build build/fuzz --seconds 300         all targets, two at a time, each for its share of the time
    fuzz.py --build build/fuzz --hours 8             the same, in rounds of ten minutes, each from where the last one ended

What stops a target is kept in build/fuzz/findings, named and told with the command that does it again; the others go on. What new
ways of a target were found in hours is kept in build/fuzz/corpus. Exit status 1 if there is any finding.
"""

import argparse
import concurrent.futures
import configparser
import hashlib
import itertools
import json
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
VECTORS = HERE.parent / "vectors/wire"
SANITIZERS = ("ERROR: AddressSanitizer", "ERROR: LeakSanitizer", "runtime error:")
ROUND_s = 600
# A target that takes longer for one input hangs; of tests no machine is too slow.
HANGS_s = 300
POOL, BATCH = 64, 500  # of the walk
INTERRUPTED = 72  # exit status of libFuzzer
TEST_SEED = 1
# In place of cells and lines of recordings.
WORDS = (b"18446744073709551616", b"-1", b"1e400", b"nan", b"inf", b"0x10", b"1_000", b"", b"\n", b"\r\n", b",", b"#", b": ", b"\x00") + (
    b"\xff\xfe",
    b"\xe2\x80\xa8",
    *(f"# {key}: {value}".encode() for key, value in {"end": "", "packet": "info", "grip": "", "devices": ""}.items()),
)


class Stop(Exception):
    """What the user can mend, in one line."""


def vectors():
    """{name: (packet with its CRC, frame)} of the test vectors."""
    found = {}
    for path in sorted(VECTORS.glob("*.txt")):
        parts, name = {"packet": b"", "frame": b""}, None
        for line in path.read_text(encoding="ascii").splitlines():
            words = line.split("#")[0].strip()
            if words in parts:
                name = words
            elif words:
                parts[name] += bytes.fromhex(words)
        found[path.stem] = parts["packet"], parts["frame"]
    return found


def part_of_packet(packet):
    """As line.hpp takes it apart: header and CRC are made by the target."""
    kind, body = packet[1], packet[12:-4]
    return bytes([kind & 0x8F]) + struct.pack("<H", len(body)) + packet[2:12] + body


def part_of_frame(frame):
    return b"".join(bytes([0xC0 | len(frame[i : i + 63])]) + frame[i : i + 63] for i in range(0, len(frame), 63))


def vector_seeds(target):
    """Inputs for the targets that a line leads to."""
    head = {"wire": bytes(3), "capture": b"\x02"}.get(target)
    for packet, frame in vectors().values():
        if head is not None:
            yield head + part_of_packet(packet)
            yield head + part_of_frame(frame)
        elif target == "commands" and packet[1] & 0x80:
            yield bytes([1, packet[1] & 0x0F]) + packet[2:4] + packet[12:-4]
            yield bytes([0, len(frame)]) + frame


def bulk_seed(target, seeds, length):
    """One long input: rows of a text over and over, or seeds one after another."""
    if target in ("recording", "scenario"):
        lines = max(seeds, key=len).splitlines(keepends=True)
        rows = [line for line in lines if line[:1].isdigit() and b"fingertip" not in line]
        head = b"".join(lines[: lines.index(rows[0])])
        if target == "recording":
            return head + b"".join(rows) * (length // len(rows[0]) // len(rows))
        cells = rows[0].split(b",", 1)[1]
        return head + b"".join(b"%d.5," % i + cells for i in range(length // (len(cells) + 6)))
    return (b"".join(seeds) * (length // max(1, sum(map(len, seeds))) + 1))[:length]


def changed(data, pool, max_len, prng):
    """At a few places."""
    for _ in range(prng.randrange(1, 7)):
        at, itself, donor = prng.randrange(len(data) + 1), prng.randrange(len(data) + 1), prng.choice(pool)
        few = data[at : at + prng.randrange(1, 17)]
        from_donor = donor[prng.randrange(len(donor) + 1) :][: prng.randrange(len(donor) + 1)]
        new, taken = prng.choice(
            (
                (bytes(byte ^ 1 << prng.randrange(8) for byte in few[:1]), 1),
                (bytes((byte + prng.randrange(-8, 9)) % 256 for byte in few[:1]), 1),  # a number that is a little more or less
                (len(few) * prng.choice((b"\0", b"\1", b"\x7f", b"\x80", b"\xff")), len(few)),  # at an end of its range
                (prng.randbytes(len(few)), len(few)),
                (prng.randbytes(prng.randrange(1, 17)), 0),
                (b"", len(few)),
                (data[itself : itself + prng.randrange(len(data) + 1)], 0),
                (from_donor, prng.choice((0, len(data)))),
            )
        )
        data = (data[:at] + new + data[at + taken :])[:max_len]
    return data


def damaged(data, seeds, prng):
    """Words in place of cells, lines, or what is between them; then maybe anything."""
    for _ in range(prng.randrange(1, 5)):
        parts = re.split(rb"([,\n])", data)
        at = prng.randrange(len(parts))
        parts[at : at + prng.choice((0, 1, 1, 20))] = prng.choice(([prng.choice(WORDS)], [prng.choice(parts)], []))
        data = b"".join(parts)
    return changed(data, seeds, 1 << 16, prng) if prng.randrange(2) else data


def walk(seeds, runs, max_len, seed):
    """Inputs that depend on the seed alone: each is one of a pool, changed. It or a given one takes the place of another one of the pool."""
    prng = random.Random(seed)
    seeds = [data[:max_len] for data in seeds]
    pool = [seeds[i % len(seeds)] for i in range(POOL)]
    for run in range(runs):
        data = seeds[run] if run < len(seeds) else changed(prng.choice(pool), pool, max_len, prng)
        yield data
        pool[prng.randrange(POOL)] = data if prng.randrange(2) else prng.choice(seeds)


class Target:
    def __init__(self, program):
        self.program, self.name = program, program.name[len("fuzz_") :]
        options = configparser.ConfigParser()
        options.read(f"{program}.options")
        self.options = dict(options["libfuzzer"])

    def seeds(self):
        """Targets that take any bytes as steps have some that are none in particular."""
        seeds = [path.read_bytes() for path in sorted((HERE / "corpus" / self.name).glob("*"))] + list(vector_seeds(self.name))
        return seeds or [random.Random(seed).randbytes(64 << seed) for seed in range(4)]

    def said(self, folder, *words):
        """Exit status, and standard error."""
        call = (self.program, f"-artifact_prefix={folder}/", f"-timeout={HANGS_s}", *words)
        environment = {**os.environ, "FINGERTIP_FUZZ_COUNT": f"{folder}/count", "UBSAN_OPTIONS": "print_stacktrace=1"}
        done = subprocess.run([str(part) for part in call], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=environment)
        return done.returncode, done.stderr.decode("utf-8", "replace")

    def walk(self, folder, inputs):
        """Until one ends the target."""
        files = [folder / f"given/{i:03d}" for i in range(BATCH)]
        while batch := list(itertools.islice(inputs, BATCH)):
            for file, data in zip(files, batch):
                file.write_bytes(data)
            status, said = self.said(folder, *files[: len(batch)])
            if status != 0:
                break
        return status, said

    def libfuzzer(self, folder, seeds, max_len, seconds, seed, bulk, grown):
        new = grown or folder / "new"
        new.mkdir(parents=True, exist_ok=True)
        for i, data in enumerate(seeds):
            (folder / f"given/{i:03d}").write_bytes(data)
        words = [f"-{name}={self.options[name]}" for name in ("dict",) if name in self.options] + ["-len_control=0"] * bulk
        return self.said(folder, f"-max_total_time={seconds}", f"-seed={seed}", f"-max_len={max_len}", *words, new, folder / "given")

    def run(self, findings, seed, runs=None, seconds=None, grown=None, bulk=False):
        """So many runs, the same each time, or libFuzzer for so long. grown: a folder that keeps what is new, or None."""
        with tempfile.TemporaryDirectory(prefix="fingertip-fuzz-") as folder:
            folder = pathlib.Path(folder)
            (folder / "given").mkdir()
            seeds = self.seeds()
            max_len = int(self.options["max_len"])
            if bulk and "bulk" in self.options:
                max_len = int(self.options["bulk"])
                seeds.append(bulk_seed(self.name, seeds, max_len // 2))
            begun_s = time.monotonic()
            if runs is not None:
                status, said = self.walk(folder, walk(seeds, runs, max_len, seed))
            else:
                status, said = self.libfuzzer(folder, seeds, max_len, seconds, seed, bulk, grown)
            count = folder / "count"
            done_runs, size = struct.unpack("<QQ", count.read_bytes()) if count.exists() else (0, 0)
            covered = re.findall(r"cov: (\d+)", said)
            result = {"target": self.name, "seconds": round(time.monotonic() - begun_s, 1), "runs": done_runs, "bytes": size, "seed": seed}
            result |= {"edges": int(covered[-1]) if covered else 0, "crashes": 0, "sanitizer_findings": 0}
            if status not in (0, INTERRUPTED):
                kind = "sanitizer_findings" if any(word in said for word in SANITIZERS) else "crashes"
                result[kind] = 1
                self.tell_finding(findings, folder, said)
            return result

    def tell_finding(self, findings, folder, said):
        findings.mkdir(parents=True, exist_ok=True)
        lines = said.splitlines()
        words = (*SANITIZERS, "does not hold:", "ERROR: ")
        first = next((i for i, line in enumerate(lines) if any(word in line for word in words)), len(lines) - 40)
        print("\n".join(lines[max(0, first) : first + 60]), file=sys.stderr)
        inputs = [path for path in folder.iterdir() if path.is_file() and re.match(r"(crash|leak|oom|timeout)-", path.name)]
        for path in inputs:
            data = path.read_bytes()
            kept = findings / f"{self.name}-{path.name.split('-')[0]}-{hashlib.sha256(data).hexdigest()[:16]}"
            kept.write_bytes(data)
            print(f"fuzz.py: {self.name}: found; to do it again: {self.program} {kept}", file=sys.stderr)
        if not inputs:
            print(f"fuzz.py: {self.name} ended without an input to blame: see above", file=sys.stderr)


def targets_in(build, names):
    folder = build / "tests/fuzz"
    found = {path.stem[len("fuzz_") :]: Target(path.with_suffix("")) for path in sorted(folder.glob("fuzz_*.options"))}
    missing = [target.program for target in found.values() if not target.program.is_file()]
    if not found or missing:
        raise Stop(f"{missing[0] if missing else folder}: is not there; build it: cmake --preset fuzz && cmake --build --preset fuzz")
    unknown = [name for name in names if name not in found]
    if unknown:
        raise Stop(f"no target {unknown[0]}; there are: {', '.join(found)}")
    return [found[name] for name in names] if names else list(found.values())


def round_of(targets, jobs, one):
    """The results, as they come."""
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        try:
            for future in concurrent.futures.as_completed([pool.submit(one, target) for target in targets]):
                result = future.result()
                found = result["crashes"] + result["sanitizer_findings"]
                edges = f" {result['edges']:6d} edges" if result["edges"] else ""
                amount = f"{result['runs']:10d} runs {result['bytes']:12d} bytes{edges} {result['seconds']:7.1f} s"
                print(f"{result['target']:10s} {amount}  seed {result['seed']}{'  FOUND' if found else ''}", flush=True)
                yield result
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def summary(targets, results):
    rows = []
    for target in targets:
        own = [result for result in results if result["target"] == target.name]
        row = {"target": target.name, "edges": max((result["edges"] for result in own), default=0)}
        for name in ("seconds", "runs", "bytes", "crashes", "sanitizer_findings"):
            row[name] = sum(result[name] for result in own)
        rows.append(row)
    size, crashes, findings = (sum(row[name] for row in rows) for name in ("bytes", "crashes", "sanitizer_findings"))
    return {"fuzz_bytes": size, "crashes": crashes, "sanitizer_findings": findings, "fuzz_targets": rows}


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, type=pathlib.Path, metavar="DIR")
    how = parser.add_mutually_exclusive_group(required=True)
    how.add_argument("--runs", type=int, metavar="N", help="of each target")
    how.add_argument("--seconds", type=float, metavar="S", help="of all targets together, by the wall")
    how.add_argument("--hours", type=float, metavar="H", help="the same in hours; Ctrl-C ends it sooner")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="targets at a time (default: %(default)s)")
    parser.add_argument("--seed", type=int, metavar="N", help="of the first round (default: another one each time; of --runs 1)")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="what was run and found")
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="default: all")
    options = parser.parse_args(argv)
    build = options.build.resolve()
    findings = build / "findings"
    targets = targets_in(build, options.targets)
    if options.seed is None:
        options.seed = TEST_SEED if options.runs is not None else int(time.time()) % 2**31
    results = []
    if options.runs is not None:
        results += round_of(targets, options.jobs, lambda target: target.run(findings, options.seed, runs=options.runs))
    else:
        total_s = options.seconds if options.seconds is not None else 3600 * options.hours
        end_s, seed = time.monotonic() + total_s, options.seed
        try:
            while (left_s := end_s - time.monotonic()) > (0 if not results else 10):
                own_s = max(1, round(min(left_s, ROUND_s) * min(options.jobs, len(targets)) / len(targets)))
                bulk = options.seconds is not None
                grown = {target: None if bulk else build / "corpus" / target.name for target in targets}
                one = lambda target: target.run(findings, seed, seconds=own_s, grown=grown[target], bulk=bulk)
                results += round_of(targets, options.jobs, one)
                seed += 1
                if bulk:
                    break
        except KeyboardInterrupt:
            print("fuzz.py: ended", file=sys.stderr)
    found = summary(targets, results)
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    count = found["crashes"] + found["sanitizer_findings"]
    print(f"{found['fuzz_bytes']} bytes, {count} finding{'' if count == 1 else 's'}{f', kept in {findings}' if count else ''}")
    return 1 if count else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except Stop as stop:
        sys.exit(f"fuzz.py: {stop}")
