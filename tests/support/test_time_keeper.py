"""The keeper of simulated time: usage test_time_keeper.py SIMULATED_DEVICE TIME_KEEPER [unittest arguments]."""

import os
import sys
import tempfile
import unittest

from simulated_time import FOR_EVER_us, SimulatedTime, TimedOut

SIMULATED_DEVICE, TIME_KEEPER = (os.path.abspath(path) for path in sys.argv[1:3])


class TimeKeeper(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-"))
        self.world = self.enterContext(SimulatedTime(TIME_KEEPER, self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-time-"))))
        self.port = os.path.join(self.folder, "tty")

    def device(self, *options):
        return self.world.start([SIMULATED_DEVICE, self.port, *options])

    def test_patience_is_of_the_worlds_time(self):
        self.device()
        begun_s = self.world.now_s
        with self.assertRaises(TimedOut):
            self.world.until(lambda: False, limit_s=50)
        self.assertAlmostEqual(self.world.now_s - begun_s, 50, delta=0.1)

    def test_a_signal_ends_a_wait_before_time_goes_on(self):
        device = self.device()
        self.world.sleep(1)
        begun_s = self.world.now_s
        device.terminate()
        self.assertEqual(device.wait(), 0)
        self.assertAlmostEqual(self.world.now_s, begun_s, delta=0.001)

    def test_one_that_is_held_up_gets_no_turn_until_it_goes_on(self):
        device = self.device()
        self.world.sleep(1)
        device.hold_up(2)
        turns = device.turns()
        self.world.sleep(1.9)
        self.assertEqual(device.turns(), turns)
        self.world.sleep(0.2)
        self.assertGreater(device.turns(), turns)

    def test_a_world_that_waits_for_ever_is_an_error(self):
        with self.assertRaisesRegex(AssertionError, "ended with 1"):
            self.world._turn(self.world._line.wait(FOR_EVER_us))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
