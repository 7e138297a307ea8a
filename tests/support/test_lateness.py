"""A machine that stops is seen, and allowed for. Real time is the subject."""

# real time: a process that is stopped and goes on
import os
import subprocess
import sys
import unittest

from lateness import Lateness

STOPPED_s = 1.0
# Stops this test for a while, as a machine that stands would.
STOPPER = f"import os, signal, time; os.kill({{pid}}, signal.SIGSTOP); time.sleep({STOPPED_s}); os.kill({{pid}}, signal.SIGCONT)"


class StoppedMachine(unittest.TestCase):
    def test_what_a_stop_takes_is_allowed_and_no_more(self):
        with Lateness() as machine:
            subprocess.run([sys.executable, "-c", STOPPER.format(pid=os.getpid())], check=True)
        self.assertGreater(machine.worst_s, 0.9 * STOPPED_s)
        machine.judge(0.1 + STOPPED_s, 0.2)
        with self.assertRaisesRegex(AssertionError, "this machine was"):
            machine.judge(0.2 + machine.late_s + 0.1, 0.2)

    def test_without_a_stop_nothing_is_forgiven_for_good(self):
        machine = Lateness()
        with self.assertRaises(AssertionError):
            machine.judge(0.3, 0.2)


if __name__ == "__main__":
    unittest.main()
