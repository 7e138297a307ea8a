"""The nightly measurement of storing in short. What is kept over restarts: test_power_cuts.mjs.

usage: test_store.py --build BUILD --boards BOARDS --node NODE
"""

import argparse
import unittest

from emulation import main
from storing import storing

TOOLS = argparse.Namespace()


class Store(unittest.TestCase):
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
