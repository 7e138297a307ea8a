"""Emulated fingertips and the host's tool on one simulated time: however slow the machine is, two runs are the same.

with World(OPTIONS.support, OPTIONS.node, folder) as world:
    emulator = world.emulator(port, "--board", "pico_mux", "--image", IMAGE, "--scenario", SCENARIO)
    print(world.tool("info", "--port", port))
"""

import pathlib
import sys

from emulation import MAIN, ROOT
from simulated_time import PATIENCE_s, SimulatedTime


class World(SimulatedTime):
    """support: the folder with the programs built of tests/support."""

    def __init__(self, support, node, folder):
        self._support, self._node = pathlib.Path(support), node
        super().__init__(self._support / "time_keeper", folder)

    def emulator(self, port, *options, wait_open=True):
        """One whose power comes when the port is first opened; a process, whose first line is the world's time then, us."""
        program = ROOT / "tests/support/emulated_fingertip.py"
        call = (sys.executable, program, port, *["--wait-open"] * wait_open, self._node, MAIN, *options)
        process = self.start([str(part) for part in call])
        if process.poll() is not None:
            raise AssertionError(f"the emulator did not start: {process.communicate()[1]}")
        return process

    def start_tool(self, *arguments, **options):
        return self.start([str(self._support / "simulated_fingertip"), *map(str, arguments)], **options)

    def tool(self, *arguments, limit_s=PATIENCE_s, **options):
        """What it says on standard output, once it has ended well."""
        tool = self.start_tool(*arguments, **options)
        out, err = tool.communicate(limit_s)
        if tool.returncode != 0:
            raise AssertionError(f"fingertip {' '.join(map(str, arguments))}: {tool.returncode}, {out}{err}")
        return out
