#!/usr/bin/python3
"""The Python tools' readers on damaged files: recordings, grips, scenarios, truths, run reports. Refused in one line, or read.

    fuzz_files.py --runs 3000 [--seed 1]

libFuzzer cannot see into Python: these are the seeds of `corpus`, damaged at random, without coverage.
"""

import argparse
import pathlib
import random
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT / "host_tools/python"), str(ROOT / "host_tools/demo")]
import fuzz  # noqa: E402
from fingertip import command, files, grip_file  # noqa: E402
from grasp import read_truth  # noqa: E402

TRUTH = "# fingertip-truth 1\nt_s,slips,slid_mm,force_N\n0.000,0,0.0,0.1\n0.002,1,0.5,2.5\n"
RUN = '{"device_time_zero_s": 0.25, "warnings": [], "cycles": 5}\n'


def check_recording(path, prng):
    recording = files.read_recording(path, salvage=prng.random() < 0.5, serial=prng.choice((None, "BBBB")))
    recording.health()
    assert recording["t_us"].shape == recording.has_contact.shape


def check_grip(path, prng):
    grip_file.read_grip(path, salvage=prng.random() < 0.5)


def check_scenario(path, _):
    assert files.read_scenario(path) is not None


def check_truth(path, _):
    for column in read_truth(path).values():
        assert column.ndim == 1


def check_run(path, _):
    assert isinstance(files.read_run(path), dict)


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, required=True)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(argv)
    recordings = [path.read_bytes()[1:] for path in sorted((HERE / "corpus/recording").iterdir())]
    scenarios = [path.read_bytes() for path in sorted((HERE / "corpus/scenario").iterdir())]
    jobs = (
        [(check_recording, data) for data in recordings]
        + [(check_grip, data) for data in recordings]
        + [(check_scenario, data) for data in scenarios]
        + [(check_truth, TRUTH.encode()), (check_run, RUN.encode())]
    )
    prng, seeds = random.Random(options.seed), [seed for _, seed in jobs]
    read = 0
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder:
        path = pathlib.Path(folder) / "file"
        for run in range(options.runs):
            check, seed = jobs[run % len(jobs)]
            data = fuzz.damaged(seed, seeds, prng)
            path.write_bytes(data)
            try:
                check(path, prng)
                read += 1
            except files.InputError as error:
                assert "\n" not in command.printable(str(error))
            except BaseException:
                print(f"fuzz_files.py: run {run}: {check.__name__} of {data!r}", file=sys.stderr)
                raise
    print(f"{options.runs} files, {read} of them read")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
