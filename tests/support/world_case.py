"""What tests of programs share: a folder, an environment in which no other fingertip is found, and a world in which programs run."""

import contextlib
import os
import tempfile
import unittest

from real_time import RealTime
from simulated_time import SimulatedTime


class WorldCase(unittest.TestCase):
    """In simulated time by a TIME_KEEPER, in real time without; DEVICE is the program that plays a fingertip."""

    TIME_KEEPER = DEVICE = None

    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-"))
        self.port, self.csv = self.path("tty"), self.path("r.csv")
        self.environment = {k: v for k, v in os.environ.items() if k != "FINGERTIP_PORT" and not k.startswith("LC_")}
        self.environment |= {"LC_ALL": "C.UTF-8", "XDG_RUNTIME_DIR": self.folder, "PYTHONDONTWRITEBYTECODE": "1"}
        self.begin_world()

    def begin_world(self):
        room = self.TIME_KEEPER and self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-time-"))
        self.world = SimulatedTime(self.TIME_KEEPER, room) if room else RealTime()
        self.addCleanup(self.world.close)

    def path(self, name):
        return os.path.join(self.folder, name)

    @contextlib.contextmanager
    def device(self, *options, port=None):
        port = port or self.port
        process = self.world.start([self.DEVICE, port, *options], stdout=None, stderr=None)
        if not self.TIME_KEEPER:
            self.world.until(lambda: os.path.lexists(port))
        try:
            yield process
        finally:
            process.terminate()
            process.wait()
