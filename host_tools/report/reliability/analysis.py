"""Analysis of the firmware without running it, and mutation of it: tests/checks/analyse.py and tests/mutation."""

import json
import pathlib
import subprocess
import tempfile

from fingertip.files import InputError
from tables import table_of_dicts_md

ROOT = pathlib.Path(__file__).resolve().parents[3]
COUNT = 650
SEED = 1
GOALS = (("mutants", ">=", 500), ("mutants_survived_percent", "<=", 5), ("analyzer_findings", "<=", 0))


def figures_of(*command):
    """Findings do not end it: they are figures, and reported."""
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder:
        result = pathlib.Path(folder) / "found.json"
        done = subprocess.run(["/usr/bin/python3", *map(str, command), "--json", result], check=False)
        if not result.exists():
            raise InputError(f"{pathlib.Path(command[0]).name} ended with status {done.returncode}, see above")
        return json.loads(result.read_text(encoding="utf-8"))


def measure(build, steps):
    found = figures_of(ROOT / "tests/checks/analyse.py", "--build", build.parent, "--all")
    steps.say(f"analysis of {found['analyzed_files']} files")
    found.update(figures_of(ROOT / "tests/mutation/mutation.py", "--build", build, "--count", COUNT, "--seed", SEED))
    steps.say(f"{found['mutants']} mutants")
    return found


def text(found):
    lines = [
        "## Analysis",
        "",
        f"clang-tidy with clang's analyser of paths, cppcheck, gcc's -fanalyzer and the mandatory rules of MISRA C:2012 over the "
        f"{found['analyzed_files']} C files of firmware/ and boards/ (tests/checks/analyse.py says which tool holds which rule).",
        "",
        "## Mutation",
        "",
        f"Of the {found['mutants_possible']} small changes that can be made to the firmware and the two buses, a sample spread evenly "
        f"over the modules (seed {found['mutation_seed']}): an operator, a number, a condition, a statement. Killed: a unit test fails, "
        "or does under the sanitizer of undefined behaviour. Set apart: changes that cannot be seen, each with its reason in "
        "tests/mutation/equivalent.txt; changes that make the same code are not counted. The tests were bettered with survivors of "
        "this sample in view, so of other samples more survive (`mutation.py --seed`).",
        "",
        *table_of_dicts_md(found["mutation_modules"]),
        "",
    ]
    if found["mutation_survivors"]:
        lines += ["Survivors:", ""]
        for survivor in found["mutation_survivors"]:
            lines += [f"    {survivor['file']}:{survivor['line']}", f"    - {survivor['before']}", f"    + {survivor['after']}"]
        lines += [""]
    return lines
