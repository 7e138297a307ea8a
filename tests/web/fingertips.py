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

    def emulated(self, browser, serial, scenario, *options, image=None):
        """The release image of pico_parallel, powered on when its port is first opened."""
        port = browser.ports / f"{USB_ID}:{serial}"
        return self._until_there(
            self._start(
                self._tools.node,
                ROOT / "host_tools/simulation/emulator/main.mjs",
                "--board",
                "pico_parallel",
                "--image",
                image or self._tools.image,
                "--scenario",
                scenario,
                "--serial",
                serial,
                "--pty",
                port,
                "--wait-open",
                "--fast-enumeration",
                *options,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            ),
            port,
        )

    def fake(self, browser, serial, *options, usb_id=USB_ID):
        """tests/support/fake_device.cpp, with its options."""
        port = browser.ports / f"{usb_id}:{serial}"
        return self._until_there(
            self._start(
                self._tools.build / "tests/support/fake_device",
                port,
                f"serial={serial}",
                f"life={PATIENCE_s}",
                *options,
                stdout=subprocess.DEVNULL,
            ),
            port,
        )

    def simulated(self, runtime, *options):
        """`fingertip simulate`, which a page served with the same runtime folder finds."""
        process = self._start(
            self._tools.build / "host_tools/tool/cli/fingertip",
            "simulate",
            *options,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "XDG_RUNTIME_DIR": str(runtime)},
        )
        if not process.stdout.readline().startswith("ready: "):
            raise AssertionError("nothing is simulated")
        return process

    def served(self, runtime):
        """The page, by `fingertip web`: its address without the last slash. runtime: folder where it finds what is simulated."""
        process = self._start(
            self._tools.build / "host_tools/tool/cli/fingertip",
            "web",
            "--port",
            "0",
            "--no-browser",
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, "XDG_RUNTIME_DIR": str(runtime)},
        )
        url = process.stdout.readline().strip()
        if not re.fullmatch(r"http://127\.0\.0\.1:\d+/", url):
            raise AssertionError("the page is not served")
        return url.rstrip("/")
