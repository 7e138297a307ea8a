"""Runs of the emulator, and the command line of its tests.

Run(TOOLS, folder, "name", "pico_mux", scenario, 2.0, faults=[...]).recording
"""

import argparse
import json
import pathlib
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("host_tools/python", "host_tools/report/shared", "tests/support")]
from fingertip import files  # noqa: E402

MAIN = ROOT / "host_tools/simulation/emulator/main.mjs"


def main(tools, *names):
    """The tests of the program that runs, with an option of each name in `tools`."""
    parser = argparse.ArgumentParser()
    for name in names:
        parser.add_argument(f"--{name}", required=True)
    _, rest = parser.parse_known_args(namespace=tools)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)


def options(**values):
    """A command line's: slow_flash=True is --slow-flash; what is None is left out."""
    words = []
    for name, value in values.items():
        if value is not None:
            words += [f"--{name.replace('_', '-')}", *([] if value is True else [str(value)])]
    return words


def emulate(tools, main=MAIN, **values):
    """A process that has ended."""
    return subprocess.run([tools.node, main, *options(**values)], capture_output=True, text=True)


def encoded(tools, *command):
    return subprocess.run([tools.command_frame, *command], capture_output=True, text=True, check=True).stdout.strip()


def make_scenario(path, name, seconds):
    words = ["scenario", name, "-o", path, "--seconds", str(seconds), "--overwrite"]
    subprocess.run([sys.executable, ROOT / "host_tools/python", *words], check=True)
    return path


def write_scenario(path, *rows, sensors=15):
    """Rows of a time and the pressure on each sensor, or one of all; without rows at rest."""
    names = ["t_s", *files.TRUTH_COLUMNS, *(f"s{k}_Pa" for k in range(sensors))]
    truth = [0] * len(files.TRUTH_COLUMNS)
    lines = [[t_s, *truth, *(pressures * sensors if len(pressures) == 1 else pressures)] for t_s, *pressures in rows or [(0, 0)]]
    path.write_text(
        "\n".join(["# fingertip-scenario 1", f"# sensors: {sensors}", *(",".join(map(str, line)) for line in [names, *lines])]) + "\n"
    )
    return path


class Run:
    """A run of an image that the host reads: report and recording. commands: (s, line of the host's script), or (s, command, ...)."""

    def __init__(self, tools, folder, name, board, scenario, seconds=None, commands=(), faults=(), emulator=MAIN, **more):
        self.base = pathlib.Path(folder) / name
        said = [(t_s, words[0] if " " in words[0] else encoded(tools, *words)) for t_s, *words in sorted([(0.45, "dtr 1"), *commands])]
        self.path("script").write_text("".join(f"{t_s} {line}\n" for t_s, line in said))
        self.path("faults").write_text(json.dumps(list(faults)))
        paths = {"faults": self.path("faults"), "capture": self.path("ftr"), "report": self.path("json")}
        values = {"image": getattr(tools, "image", None), "host_script": self.path("script"), **paths, **more}
        done = emulate(tools, emulator, board=board, scenario=scenario, seconds=seconds, **values)
        if done.returncode != 0:
            raise AssertionError(f"the emulator found something wrong:\n{done.stderr}")
        self.report = json.loads(self.path("json").read_text())
        replay = [tools.fingertip, "convert", self.path("ftr"), self.path("csv"), "--overwrite"]
        subprocess.run(replay, check=True, capture_output=True)
        self.recording = files.read_recording(self.path("csv"))

    def path(self, suffix):
        return self.base.with_suffix(f".{suffix}")
