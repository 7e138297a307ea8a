"""What the tests of the fingertip command share, on simulated time; they are called with FINGERTIP, FAKE_DEVICE and TIME_KEEPER first."""

import os
import pathlib
import re
import shutil
import signal
import sys

FINGERTIP, FAKE_DEVICE, TIME_KEEPER = (os.path.abspath(path) for path in sys.argv[1:4])
ROOT = pathlib.Path(__file__).resolve().parents[3]
PYTHON_TOOLS = ROOT / "host_tools/python"
sys.path[:0] = [str(PYTHON_TOOLS), str(ROOT / "tests/support")]
from world_case import WorldCase  # noqa: E402


class CliTest(WorldCase):
    TIME_KEEPER, DEVICE = TIME_KEEPER, FAKE_DEVICE

    def setUp(self):
        super().setUp()
        self.ftr = self.path("r.ftr")

    def start(self, *arguments, **options):
        return self.world.start([FINGERTIP, *arguments], **{"env": self.environment, **options})

    def run_cli(self, *arguments, status=0, **options):
        process = self.start(*arguments, **options)
        out, err = process.communicate()
        self.assertEqual(process.returncode, status, (arguments, out, err))
        return out, err

    def info(self, *arguments):
        """What info prints, by key."""
        return dict(re.findall(r"(?m)^(\S+) +(.*)$", self.run_cli("info", *arguments)[0]))

    def interrupt(self, process, status=0):
        """Ends it as Ctrl-C does; what it printed."""
        process.send_signal(signal.SIGINT)
        out, err = process.communicate()
        self.assertEqual(process.returncode, status, err)
        return out, err

    def error(self, *arguments, status=1):
        """The one line that a failing command prints."""
        out, err = self.run_cli(*arguments, status=status)
        self.assertEqual(out, "")
        self.assertEqual(err.count("\n"), 1, err)
        self.assertTrue(err.startswith("fingertip: "), err)
        return err

    RULE = (
        "permission denied; install the udev rule: fingertip rule | sudo tee /etc/udev/rules.d/60-fingertip.rules, "
        "then sudo udevadm control --reload, and plug it in again"
    )

    def other_user(self):
        """The tool where every user may run it, and what makes it run as one who owns nothing, if this one is root."""
        os.chmod(self.folder, 0o777)
        if os.geteuid() != 0:
            return FINGERTIP, {}
        tool = os.path.join(self.folder, "fingertip-of-all")
        shutil.copy(FINGERTIP, tool)
        return tool, {"user": 65534, "group": 65534, "extra_groups": []}

    def without_permission(self, *arguments, status=1):
        """What the tool says to a user who may not open the port."""
        os.chmod(os.path.realpath(self.port), 0)
        tool, user = self.other_user()
        ended, out, err = self.world.run([tool, *arguments], env=self.environment, **user)
        self.assertEqual((ended, out), (status, ""))
        return err

    def rows(self, path=None):
        """Data rows as dictionaries, and the comment lines."""
        with open(path or self.csv, encoding="utf-8") as file:
            lines = file.read().splitlines()
        data = [line.split(",") for line in lines if not line.startswith("#")]
        return [dict(zip(data[0], row)) for row in data[1:]], [line for line in lines if line.startswith("#")]
