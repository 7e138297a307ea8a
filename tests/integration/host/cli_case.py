"""What the tests of the fingertip command share; they are called with FINGERTIP and FAKE_DEVICE first."""
import contextlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

FINGERTIP, FAKE_DEVICE = (os.path.abspath(path) for path in sys.argv[1:3])
PATIENCE_s = 30
PYTHON_TOOLS = pathlib.Path(__file__).resolve().parents[3] / "host_tools/python"
sys.path.insert(0, str(PYTHON_TOOLS))


def end(process):
    """Whatever becomes of the test that started it, nothing is left running."""
    process.kill()
    with process:
        pass


class CliTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="fingertip-test-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.port = os.path.join(self.folder, "tty")
        self.csv = os.path.join(self.folder, "r.csv")
        self.ftr = os.path.join(self.folder, "r.ftr")
        self.environment = {k: v for k, v in os.environ.items() if k != "FINGERTIP_PORT" and not k.startswith("LC_")}
        self.environment["LC_ALL"] = "C.UTF-8"
        self.environment["XDG_RUNTIME_DIR"] = self.folder  # where nobody shares a fingertip

    @contextlib.contextmanager
    def device(self, *options, port=None):
        port = port or self.port
        process = subprocess.Popen([FAKE_DEVICE, port, *options])
        try:
            self.wait_for(lambda: os.path.lexists(port))
            yield process
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(PATIENCE_s)
            end(process)

    def wait_for(self, condition):
        end = time.monotonic() + PATIENCE_s
        while not condition():
            self.assertLess(time.monotonic(), end, "waited too long")
            time.sleep(0.01)

    def once_in_three(self, measure, limit):
        """A busy computer may make anything late, but hardly thrice in a row."""
        measured = [measure()]
        while measured[-1] >= limit and len(measured) < 3:
            measured.append(measure())
        self.assertLess(measured[-1], limit, measured)

    def start(self, *arguments, **options):
        process = subprocess.Popen([FINGERTIP, *arguments], env=self.environment, text=True, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)
        self.addCleanup(end, process)
        return process

    def run_cli(self, *arguments, status=0, patience_s=PATIENCE_s, **options):
        process = self.start(*arguments, **options)
        out, err = process.communicate(timeout=patience_s)
        self.assertEqual(process.returncode, status, (arguments, out, err))
        return out, err

    def error(self, *arguments, status=1):
        """The one line that a failing command prints."""
        out, err = self.run_cli(*arguments, status=status)
        self.assertEqual(out, "")
        self.assertEqual(err.count("\n"), 1, err)
        self.assertTrue(err.startswith("fingertip: "), err)
        return err

    RULE = "permission denied; install the udev rule: fingertip rule | sudo tee /etc/udev/rules.d/60-fingertip.rules, " \
           "then sudo udevadm control --reload, and plug it in again"

    def without_permission(self, *arguments, status=1):
        """What the tool says to a user who may not open the port."""
        os.chmod(os.path.realpath(self.port), 0)
        os.chmod(self.folder, 0o777)
        tool, user = FINGERTIP, {}
        if os.geteuid() == 0:
            tool, user = os.path.join(self.folder, "fingertip"), {"user": 65534, "group": 65534, "extra_groups": []}
            shutil.copy(FINGERTIP, tool)  # where everybody may run it
        done = subprocess.run([tool, *arguments], capture_output=True, text=True, env=self.environment, timeout=PATIENCE_s, **user)
        self.assertEqual((done.returncode, done.stdout), (status, ""))
        return done.stderr

    def rows(self, path=None):
        """Data rows as dictionaries, and the comment lines."""
        with open(path or self.csv, encoding="utf-8") as file:
            lines = file.read().splitlines()
        data = [line.split(",") for line in lines if not line.startswith("#")]
        return [dict(zip(data[0], row)) for row in data[1:]], [line for line in lines if line.startswith("#")]
