"""Drives a headless Chromium over the pipe of its DevTools protocol (https://chromedevtools.github.io/devtools-protocol).

The browser gets a profile, a policy and serial ports of its own: every page of ALLOWED may use every port without a
click, and the ports are the links of a folder (ports.c). Its policy folder is in /etc, so it is started in a mount
namespace where another one lies there.
"""
import base64
import contextlib
import json
import os
import pathlib
import select
import shutil
import subprocess
import tempfile
import time

PATIENCE_s = 60
BINARIES = ("/usr/lib/chromium/chromium",)
POLICY_FOLDER = "/etc/chromium"
# software rendering, and nothing of the browser's own on the network
FLAGS = ("--headless", "--no-sandbox", "--remote-debugging-pipe", "--no-first-run", "--no-default-browser-check", "--disable-extensions",
         "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-default-apps", "--disable-breakpad",
         "--disable-dev-shm-usage", "--mute-audio", "--hide-scrollbars", "--force-color-profile=srgb", "--force-device-scale-factor=1",
         "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
START = 'mount --bind "$1" "$2" && shift 2 && exec "$@" 3<&"$FROM_TEST" 4>&"$TO_TEST"'


class CannotRun(Exception):
    """Why there can be no such browser here."""


class PageError(AssertionError):
    pass


def serial_driver():
    """Major and minor number of a terminal that this kernel calls a serial port."""
    try:
        lines = pathlib.Path("/proc/tty/drivers").read_text(encoding="ascii").splitlines()
    except OSError:
        lines = []
    for words in map(str.split, lines):
        if len(words) >= 5 and words[4] == "serial":
            return words[2], words[3].partition("-")[0]
    raise CannotRun("this kernel has no serial driver")


def unshare():
    """The command that starts another in a mount namespace of its own."""
    for command in (["unshare", "--mount"], ["unshare", "--map-root-user", "--mount"]):
        with contextlib.suppress(OSError):
            if subprocess.run([*command, "true"], capture_output=True).returncode == 0:
                return command
    raise CannotRun("no mount namespace may be made here; run as root")


class Browser:
    """With ports: a folder, and the library made of ports.c; without: without Web Serial's ports."""

    def __init__(self, folder, library=None, policy=None, flags=()):
        binary = next(filter(os.path.exists, BINARIES), None)
        if binary is None:
            raise CannotRun("chromium is not installed")
        self.folder = pathlib.Path(folder)
        self.ports = self.folder / "ports"
        self.downloads = self.folder / "downloads"
        managed = self.folder / "policies/policies/managed"
        for each in (self.ports, self.downloads, managed):
            each.mkdir(parents=True, exist_ok=True)
        (managed / "test.json").write_text(json.dumps(policy or {}), encoding="utf-8")
        environment = {**os.environ, "HOME": str(self.folder), "FINGERTIP_PORTS": str(self.ports)}
        if library is not None:
            environment["FINGERTIP_MAJOR"], environment["FINGERTIP_MINOR"] = serial_driver()
            libraries = self.folder / "libraries"
            libraries.mkdir(exist_ok=True)
            if not (libraries / "libudev.so.1").exists():
                shutil.copy(library, libraries / "libudev.so.1")
            environment["LD_LIBRARY_PATH"] = str(libraries)
        from_test, self._to_browser = os.pipe()
        self._from_browser, to_test = os.pipe()
        environment |= {"FROM_TEST": str(from_test), "TO_TEST": str(to_test)}
        self._log = open(self.folder / "browser.log", "wb")
        self._process = subprocess.Popen(
            [*unshare(), "bash", "-c", START, "bash", self.folder / "policies", POLICY_FOLDER, binary, *FLAGS, *flags,
             f"--user-data-dir={self.folder / 'profile'}", "about:blank"],
            env=environment, pass_fds=(from_test, to_test), stdin=subprocess.DEVNULL, stdout=self._log, stderr=self._log)
        os.close(from_test)
        os.close(to_test)
        self._received = b""
        self._answers = {}
        self._number = 0
        self._pages = {}
        self.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(self.downloads), eventsEnabled=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    @property
    def process_id(self):
        return self._process.pid

    def close(self):
        with contextlib.suppress(OSError, PageError):
            self.call("Browser.close")
        os.close(self._to_browser)
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._from_browser)
        self._log.close()

    def _take(self, wait_s):
        """What has come: answers are kept, events go to their page."""
        if not select.select([self._from_browser], [], [], max(0, wait_s))[0]:
            return
        chunk = os.read(self._from_browser, 1 << 20)
        if not chunk:
            log = (self.folder / "browser.log").read_text(errors="replace")
            raise PageError(f"the browser has ended: {log[-2000:]}")
        *messages, self._received = (self._received + chunk).split(b"\0")
        for message in map(json.loads, messages):
            if "id" in message:
                self._answers[message["id"]] = message
            else:
                page = self._pages.get(message.get("sessionId"))
                if page is not None:
                    page.events.append((message["method"], message["params"]))

    def call(self, method, session=None, **parameters):
        self._number += 1
        number = self._number
        message = {"id": number, "method": method, "params": parameters} | ({"sessionId": session} if session else {})
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._to_browser, data):]
        end_s = time.monotonic() + PATIENCE_s
        while number not in self._answers:
            if time.monotonic() > end_s:
                raise PageError(f"no answer to {method}")
            self._take(1)
        answer = self._answers.pop(number)
        if "error" in answer:
            raise PageError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def pump(self, seconds=0.0):
        """Hear events for so long."""
        end_s = time.monotonic() + seconds
        while True:
            self._take(end_s - time.monotonic())
            if time.monotonic() >= end_s:
                return

    def page(self, url="about:blank", width=1280, height=800, before=None):
        """A new page; before: a script that runs in it before its own."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, target, session)
        self._pages[session] = page
        for domain in ("Page", "Runtime", "Network", "Log", "Audits"):
            page.call(f"{domain}.enable")
        page.size(width, height)
        if before:
            page.call("Page.addScriptToEvaluateOnNewDocument", source=before)
        if url != "about:blank":
            page.go(url)
        return page


class Page:
    def __init__(self, browser, target, session):
        self.browser = browser
        self._target = target
        self._session = session
        self.events = []  # (method, parameters) of all that was heard

    def call(self, method, **parameters):
        return self.browser.call(method, self._session, **parameters)

    def close(self):
        self.browser.call("Target.closeTarget", targetId=self._target)

    def size(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def media(self, **features):
        """prefers_color_scheme="dark" and the like."""
        self.call("Emulation.setEmulatedMedia", features=[{"name": name.replace("_", "-"), "value": value} for name, value in features.items()])

    def go(self, url):
        answer = self.call("Page.navigate", url=url)
        if answer.get("errorText"):
            raise PageError(f"{url}: {answer['errorText']}")
        self.until("document.readyState === 'complete'")

    def run(self, expression):
        """The expression's value in the page; promises are awaited."""
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True, userGesture=True)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            raise PageError(f"{expression}: {details.get('exception', {}).get('description') or details['text']}")
        return answer["result"].get("value")

    def until(self, expression, patience_s=PATIENCE_s):
        """Its value once that is true."""
        end_s = time.monotonic() + patience_s
        while True:
            value = self.run(expression)
            if value:
                return value
            if time.monotonic() > end_s:
                raise PageError(f"never became true: {expression}")
            self.browser.pump(0.05)

    def of(self, *methods):
        """What was heard of these events."""
        return [parameters for method, parameters in self.events if method in methods]

    def picture(self):
        """PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
