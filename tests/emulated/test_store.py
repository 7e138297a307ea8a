"""What the release image keeps in its flash over restarts; power cuts are test_power_cuts.mjs. And the nightly measurement of storing in short.

usage: test_store.py --build BUILD --boards BOARDS --node NODE
"""

import argparse
import pathlib
import tempfile
import unittest

from emulation import Run, main, write_scenario
from storing import storing

TOOLS = argparse.Namespace()
SETTINGS = 2
KEEP = 0x8A
STATE = ((0.9, "info"), (0.91, "stream", "contact"))


class Store(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.scenario = write_scenario(self.folder / "rest.csv")
        TOOLS.image = f"{TOOLS.boards}/pico_mux/fingertip-pico_mux.bin"
        TOOLS.fingertip, TOOLS.command_frame = (
            f"{TOOLS.build}/{path}" for path in ("host_tools/tool/cli/fingertip", "tests/support/command_frame")
        )

    def life(self, *commands, seconds=1.0, **options):
        """One run of the image with its flash; its last info packet, and its acknowledgements of keep."""
        kept = {"flash": self.folder / "flash.bin", "fast_enumeration": True}
        run = Run(TOOLS, self.folder, "life", "pico_mux", self.scenario, seconds, commands, **kept, **options)
        results = [int(f["result"]) for kind, f in run.recording.packets if kind == "ack" and int(f["command"]) == KEEP]
        lines = [line.removeprefix("# ").partition(": ") for line in run.path("csv").read_text().splitlines() if line.startswith("# ")]
        return {key: value for key, separator, value in lines if separator}, results

    def test_settings_are_kept_until_they_are_forgotten(self):
        stored = ("osr", "prior_sigma_mm", "prior_width_mm", "location_limit_mm", "stored")
        commands = (("osr", "512"), ("prior", "3.1:0.4"), ("limit", "0.8"), ("keep",))
        told = [(0.5 + 0.01 * i, *command) for i, command in enumerate(commands)]
        info, results = self.life(*told, (1.2, "info"), (1.21, "stream", "contact"), seconds=1.3, slow_flash=True)
        self.assertEqual((results, info["stored"]), ([0], str(SETTINGS)))
        info, _ = self.life(*STATE)
        self.assertEqual([info[name] for name in stored], ["512", "3.1", "0.4", "0.8", str(SETTINGS)])
        info, results = self.life((0.5, "forget"), *STATE)
        self.assertEqual((results, info["osr"], info["stored"]), ([0], "512", "0"))
        self.assertEqual(self.life(*STATE)[0]["osr"], "1024")

    def test_frames_come_while_it_stores(self):
        found = storing(TOOLS.build, TOOLS.boards, commands=2)
        self.assertEqual(found["flash_frames_skipped"], 0)
        quiet, quickly, slowly = (found["flash"][name] for name in ("quiet", "storing", "storing_slowly"))
        self.assertEqual((quiet["stored"], quickly["stored"], slowly["stored"]), (0, 2, 2))
        # None is lost or skipped; the last may still be on its way at the end.
        self.assertLessEqual(abs(quiet["frames"] - quickly["frames"]), 1)
        for run_of in (quickly, slowly):
            self.assertLess(abs(run_of["latency_us"]["median"] - quiet["latency_us"]["median"]), 3)
            # The main loop looks after the store beside the frames, for a load, and for the second processor. 48 us are measured.
            self.assertLess(run_of["latency_us"]["p99"] - quiet["latency_us"]["p99"], 54)


if __name__ == "__main__":
    main(TOOLS, "build", "boards", "node")
