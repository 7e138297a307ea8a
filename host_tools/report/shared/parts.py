#!/usr/bin/python3
"""The parts of the report: each is a folder beside this one with a part.json.

    parts.py --list            the names of what can run
    parts.py report|all        runs what such a report holds
    parts.py NAME [FOLDER]     runs one part whole; FOLDER is what it judges, for a part that names one

part.json has

    order            its place in the run and on the page
    run              step: what is shown while it runs. program, arguments: with paths from the top of the project.
                     in_report, in_all: the arguments to add there; without them that report leaves it out.
                     folder: what lies in the folder that it needs, if it needs one
    page             title, about, origin of the figures; origins: [pattern, origin], the first that matches goes before origin;
                     text: its file if that is not NAME.md; pictures, tables: [file, what it shows]
"""

import dataclasses
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "host_tools/python"))
from fingertip.command import InputError, run_tool  # noqa: E402


@dataclasses.dataclass(frozen=True)
class Run:
    step: str
    program: str
    arguments: list
    in_report: list = None
    in_all: list = None
    folder: str = None


@dataclasses.dataclass(frozen=True)
class Page:
    title: str
    about: str
    origin: str
    origins: list = ()
    text: str = None
    pictures: list = ()
    tables: list = ()


@dataclasses.dataclass(frozen=True)
class Part:
    name: str  # of its folder; NAME.json has its figures
    order: int
    run: Run = None
    page: Page = None

    @property
    def command(self):
        return " ".join(["sh cmake/bootstrap.sh report", self.name] + ["FOLDER"] * bool(self.run.folder))


def read(path):
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        made = {key: kind(**found[key]) for key, kind in (("run", Run), ("page", Page)) if key in found}
        return Part(path.parent.name, **(found | made))
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: {error}") from None


PARTS = tuple(sorted((read(path) for path in ROOT.glob("host_tools/report/*/part.json")), key=lambda part: part.order))


def steps(what, folder=None):
    """[(step, command)] of report, all, or one part."""
    running = [part for part in PARTS if part.run]
    if what in ("report", "all"):
        if folder:
            raise InputError(f"{what} takes no folder")
        chosen = [(part, part.run.in_report if what == "report" or part.run.in_all is None else part.run.in_all) for part in running]
        chosen = [(part, more) for part, more in chosen if more is not None]
    else:
        chosen = [(part, part.run.in_all or part.run.in_report or []) for part in running if part.name == what]
        if not chosen:
            raise InputError(f"there is no part {what}; there are {', '.join(part.name for part in running)}")
        needed = chosen[0][0].run.folder
        if bool(needed) != bool(folder):
            raise InputError(f"{what} needs the folder {needed}" if needed else f"{what} takes no folder")
    return [
        (
            part.run.step,
            [
                "/usr/bin/python3",
                f"host_tools/report/{part.name}/{part.run.program}",
                *part.run.arguments,
                *more,
                *([folder] if folder else []),
            ],
        )
        for part, more in chosen
    ]


def main(argv):
    if argv == ["--list"]:
        print(*(part.name for part in PARTS if part.run), sep="\n")
        return 0
    if not 1 <= len(argv) <= 2:
        raise InputError("usage: parts.py --list | report | all | NAME [FOLDER]")
    for step, command in steps(*argv):
        print(f"== {step}", flush=True)
        done = subprocess.run(command, cwd=ROOT)
        if done.returncode:
            return done.returncode
    print(f"== every table and picture: {ROOT / 'build/report/index.html'}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(run_tool("parts.py", main))
