"""Fingertips for a browser under test: emulated release images, and programs that say what a fingertip says, on its ports."""

# real time: a browser and emulated boards on ports that it opens
import contextlib
import os
import pathlib
import re
import signal
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PATIENCE_s = 1200  # ends what hangs
USB_ID = "1209:0001"  # as in cmake/options.cmake


class Bench(contextlib.ExitStack):
    """Starts them and ends them. tools: build (a folder), node, image."""

    def __init__(self, tools):
        super().__init__()
        self._tools = tools

    def _start(self, *call, **options):
        process = subprocess.Popen([str(part) for part in call], stdin=subprocess.DEVNULL, **options)
        self.callback(self.end, process)
        return process

    @staticmethod
    def end(process, number=signal.SIGTERM):
        if process.poll() is None:
            process.send_signal(number)
        try:
            process.wait(PATIENCE_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        for pipe in filter(None, (process.stdout, process.stderr)):
            pipe.close()

    def _until_there(self, process, port):
        end_s = time.monotonic() + PATIENCE_s
        while not os.path.lexists(port):
            if process.poll() is not None or time.monotonic() > end_s:
                raise AssertionError(f"no port {port}")
            time.sleep(0.02)
        return process

    def emulated(self, browser, serial, scenario, *options):
        """The release image of pico_parallel, powered on when its port is first opened."""
        port = browser.ports / f"{USB_ID}:{serial}"
        main, board = ROOT / "host_tools/simulation/emulator/main.mjs", ("--board", "pico_parallel")
        emulator = [self._tools.node, main, *board, "--image", self._tools.image]
        press = ["--scenario", scenario, "--serial", serial, "--pty", port, "--wait-open", "--fast-enumeration", *options]
        return self._until_there(self._start(*emulator, *press, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL), port)

    def fake(self, browser, serial, *options):
        """tests/support/fake_device.cpp, with its options."""
        port, device = browser.ports / f"{USB_ID}:{serial}", self._tools.build / "tests/support/fake_device"
        call = (device, port, f"serial={serial}", f"life={PATIENCE_s}", *options)
        return self._until_there(self._start(*call, stdout=subprocess.DEVNULL), port)

    def _tool(self, runtime, *arguments):
        """The tool's first line, once it is there; runtime: folder where programs find what is simulated."""
        tool, environment = self._tools.build / "host_tools/tool/cli/fingertip", {**os.environ, "XDG_RUNTIME_DIR": str(runtime)}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
        process = self._start(tool, *arguments, **pipes, env=environment)
        return process, process.stdout.readline().strip()

    def simulated(self, runtime, *options):
        """`fingertip simulate`, which a page served with the same runtime folder finds."""
        process, line = self._tool(runtime, "simulate", *options)
        if not line.startswith("ready: "):
            raise AssertionError("nothing is simulated")
        return process

    def served(self, runtime):
        """The page, by `fingertip web`: its address, with the token."""
        _, url = self._tool(runtime, "web", "--port", "0", "--no-browser")
        if not re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=\w+", url):
            raise AssertionError("the page is not served")
        return url
