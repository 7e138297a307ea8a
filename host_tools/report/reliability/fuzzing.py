"""Fuzzing of everything that meets the outside world: the targets of tests/fuzz, each for the same time."""

import json
import pathlib
import subprocess
import tempfile

from fingertip.files import InputError
from tables import table_of_dicts_md

ROOT = pathlib.Path(__file__).resolve().parents[3]
SECONDS = 300
SEED = 1
GOALS = (("fuzz_bytes", ">=", 1e9), ("crashes", "<=", 0), ("sanitizer_findings", "<=", 0))


def measure(build, steps):
    """Findings do not end it: they are figures, and reported."""
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder:
        result = pathlib.Path(folder) / "fuzz.json"
        done = subprocess.run(
            [
                "/usr/bin/python3",
                ROOT / "tests/fuzz/fuzz.py",
                "--build",
                build.parent / "fuzz",
                "--seconds",
                str(SECONDS),
                "--seed",
                str(SEED),
                "--json",
                result,
            ],
            check=False,
        )
        if not result.exists():
            raise InputError(f"the fuzz targets did not run (status {done.returncode}), see above")
        found = json.loads(result.read_text(encoding="utf-8"))
    steps.say(f"{len(found['fuzz_targets'])} fuzz targets")
    return {"fuzz_seconds": SECONDS, "fuzz_seed": SEED, **found}


def text(found):
    return [
        "## Fuzzing",
        "",
        "libFuzzer under the address and undefined-behaviour sanitizers: every parser that meets the outside world, and what must hold "
        "whatever it is fed (tests/fuzz/README.md). All targets get the same time; fast ones get long inputs too. Bytes are "
        "those that the targets were fed, counted by themselves; edges are those of their code that were reached.",
        "",
        *table_of_dicts_md(found["fuzz_targets"]),
        "",
    ]
