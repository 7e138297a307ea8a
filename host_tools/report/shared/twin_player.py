"""Scenarios of the twin, and fingertip_player, which runs them through the firmware's own code."""

import subprocess

from fingertip.files import InputError
from reporting import built, run


class TwinPlayer:
    """tables: the folder of the contact tables."""

    def __init__(self, build, tables):
        self.twin, self.player = (built(build, "host_tools/simulation", tool) for tool in ("twin/twin", "player/fingertip_player"))
        self.tables = tables

    def write(self, path, kind, effects, seed, seconds, *more):
        options = ("--effects", effects or "none", "--seed", seed, "--seconds", seconds, "--cache", self.tables, "-o", path, "--overwrite")
        run(self.twin, "scenario", kind, *options, *more)

    def play(self, path, recording, seed, *more):
        run(self.player, "play", path, "-o", recording, "--overwrite", "--quiet", "--seed", seed, *more)

    def accepts(self, recording, weight_N, commands, *more):
        """Whether what it recorded of a weight's placements is a calibration. Then the file has the commands that bring what was found."""
        command = [str(part) for part in (self.player, "calibrate", recording, "--force", weight_N, "-o", commands, *more)]
        judged = subprocess.run(command, capture_output=True, text=True)
        if judged.returncode and "not calibrated: " not in judged.stderr:
            raise InputError(judged.stderr.strip())
        return judged.returncode == 0
