"""Drives a headless Chromium over the pipe of its DevTools protocol (https://chromedevtools.github.io/devtools-protocol).

The browser gets a profile, a policy and serial ports of its own: every page of ALLOWED may use every port without a click, and the ports
are the links of a folder (ports.c). Its policy folder is in /etc, so it is started in a mount namespace where another one lies there.

real time: a browser. Waits are for what it says or shows; PATIENCE_s only ends what hangs.
"""

import base64
import contextlib
import json
import os
import pathlib
import re
import select
import shutil
import subprocess
import time

PATIENCE_s = 1200
BINARIES = ("/usr/lib/chromium/chromium",)
POLICY_FOLDER = "/etc/chromium"
# nothing of the browser's own on the network
FLAGS = """
--headless --no-sandbox --remote-debugging-pipe --no-first-run --no-default-browser-check
--disable-extensions --disable-background-networking --disable-component-update --disable-sync --disable-default-apps
--disable-breakpad --disable-dev-shm-usage --mute-audio --hide-scrollbars --force-color-profile=srgb
--force-device-scale-factor=1 --disable-renderer-backgrounding --disable-backgrounding-occluded-windows
""".split()
AXE = pathlib.Path(__file__).resolve().parents[2] / "host_tools/web/node_modules/axe-core/axe.min.js"
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

    def __init__(self, folder, library=None, policy=None):
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
        command = [*unshare(), "bash", "-c", START, "bash", self.folder / "policies", POLICY_FOLDER]
        command += [binary, *FLAGS, f"--user-data-dir={self.folder / 'profile'}", "about:blank"]
        streams = {"stdin": subprocess.DEVNULL, "stdout": self._log, "stderr": self._log}
        self._process = subprocess.Popen(command, env=environment, pass_fds=(from_test, to_test), **streams)
        os.close(from_test)
        os.close(to_test)
        self._received = b""
        self._answers = {}
        self._awaited = set()
        self._number = 0
        self._pages = {}
        self._saved = 0  # files, and those of them that were asked for
        self._taken = 0
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
            page = self._pages.get(message.get("sessionId"))
            if "id" in message:
                if message["id"] in self._awaited:
                    self._answers[message["id"]] = message
            elif message["method"] == "Browser.downloadProgress":
                self._saved += message["params"]["state"] == "completed"
            elif page is not None:
                page.events.append((message["method"], message["params"]))
                if message["method"] == "Target.attachedToTarget":  # a worker of the page waits
                    session = message["params"]["sessionId"]
                    self._pages[session] = page
                    for method in ("Network.enable", "Log.enable", "Runtime.enable", "Runtime.runIfWaitingForDebugger"):
                        self._send(method, session, {})

    def _send(self, method, session, parameters):
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters} | ({"sessionId": session} if session else {})
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._to_browser, data) :]
        return self._number

    def _until(self, is_so, otherwise):
        end_s = time.monotonic() + PATIENCE_s
        while not is_so():
            if time.monotonic() > end_s:
                raise TimeoutError(otherwise)
            self._take(1)

    def call(self, method, session=None, **parameters):
        number = self._send(method, session, parameters)
        self._awaited.add(number)
        self._until(lambda: number in self._answers, f"no answer to {method}")
        self._awaited.remove(number)
        answer = self._answers.pop(number)
        if "error" in answer:
            raise PageError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def saved(self, suffix):
        """The next file that a page saves, once it is whole."""
        self._until(lambda: self._saved > self._taken, f"no file {suffix} was saved")
        self._taken += 1
        return max(self.downloads.glob(f"*{suffix}"), key=lambda path: path.stat().st_mtime)

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
        for domain in ("Page", "Runtime", "Network", "Log", "Audits", "DOM", "Accessibility"):
            page.call(f"{domain}.enable")
        page.call("Target.setAutoAttach", autoAttach=True, waitForDebuggerOnStart=True, flatten=True)
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
        self._at = (0, 0)
        self._held = False

    def call(self, method, **parameters):
        return self.browser.call(method, self._session, **parameters)

    def close(self):
        self.browser.call("Target.closeTarget", targetId=self._target)

    def size(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def media(self, **features):
        """prefers_color_scheme="dark" and the like."""
        named = [{"name": name.replace("_", "-"), "value": value} for name, value in features.items()]
        self.call("Emulation.setEmulatedMedia", features=named)

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

    def until(self, expression):
        """Its value once that is true: the page looks before each picture of it."""
        look = (
            f"new Promise((resolve, reject) => {{ const look = () => {{ try {{ const value = ({expression}); if (value) resolve(value); "
            "else requestAnimationFrame(look); } catch (error) { reject(error); } }; look(); })"
        )
        try:
            return self.run(look)
        except TimeoutError:
            said = self.run("(document.querySelector('dialog') ?? document.body).innerText")
            raise PageError(f"never became true: {expression}; the page says: {said[-1000:]}") from None

    def shown(self):
        """Until all that was done until now is in the picture."""
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    # What a reader of the screen is told.

    def accessible(self):
        """(role, name, backend node) of all that is not left out of the accessibility tree."""
        return [
            (node["role"]["value"], node.get("name", {}).get("value", "").strip(), node.get("backendDOMNodeId"))
            for node in self.call("Accessibility.getFullAXTree")["nodes"]
            if not node["ignored"]
        ]

    def has(self, role, name):
        return self._find(role, name) is not None

    def _find(self, role, name):
        pattern = re.compile(name)
        return next((node for its_role, its_name, node in self.accessible() if its_role == role and pattern.fullmatch(its_name)), None)

    def find(self, role, name):
        """The backend node, once it is there; name: a regular expression of the whole name."""
        end_s = time.monotonic() + PATIENCE_s
        while (node := self._find(role, name)) is None:
            if time.monotonic() > end_s:
                raise PageError(f"no {role} named {name} among {sorted(set(each[:2] for each in self.accessible() if each[1]))}")
            self.shown()
        return node

    def click(self, role, name):
        """As a pointer does: on what lies there."""
        node = self.find(role, name)
        self.call("DOM.scrollIntoViewIfNeeded", backendNodeId=node)
        quad = self.call("DOM.getContentQuads", backendNodeId=node)["quads"][0]
        self.press_at(sum(quad[0::2]) / 4, sum(quad[1::2]) / 4)
        self.release()

    def press_at(self, x, y):
        self._at = (x, y)
        for kind in ("mouseMoved", "mousePressed"):
            self._mouse(kind)

    def drag_to(self, x, y):
        self._at = (x, y)
        self._mouse("mouseMoved")

    def release(self):
        self._mouse("mouseReleased")

    def _mouse(self, kind):
        x, y = self._at
        held = kind == "mousePressed" or (kind == "mouseMoved" and self._held)
        self._held = kind != "mouseReleased" and held
        button = "left" if kind != "mouseMoved" or held else "none"
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=int(held), clickCount=1)

    def key(self, key, code=None, **more):
        text = {"text": key} if len(key) == 1 else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, code=code or key, **(text | more))
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, code=code or key)

    def enter(self):
        self.key("Enter", windowsVirtualKeyCode=13, text="\r")

    def type(self, role, name, text):
        """Into a field, instead of what it holds."""
        node = self.find(role, name)
        self.call("DOM.focus", backendNodeId=node)
        self.run("document.activeElement.select?.()")
        self.call("Input.insertText", text=text)
        self.run("document.activeElement.dispatchEvent(new Event('change', {bubbles: true}))")

    def give(self, selector, *paths):
        """Files to an <input type=file>."""
        found = self.call("Runtime.evaluate", expression=f"document.querySelector({json.dumps(selector)})")["result"]
        self.call("DOM.setFileInputFiles", files=[str(pathlib.Path(path).resolve()) for path in paths], objectId=found["objectId"])

    def violations(self):
        """What axe-core finds that keeps people out: a rule and an element each."""
        self.run(f"{AXE.read_text(encoding='utf-8')}; 0")
        return self.run("axe.run().then(({violations}) => violations.flatMap(({id, nodes}) => nodes.map(each => `${id}: ${each.target}`)))")

    def foreign(self):
        """Addresses asked for, or refused by its policy, that are not of the page's own origin."""
        origin = self.run("location.origin")
        asked = [each["request"]["url"] for each in self.of("Network.requestWillBeSent")]
        asked += [each["url"] for each in self.of("Network.webSocketCreated")]
        issues = [each["issue"] for each in self.of("Audits.issueAdded")]
        broken = [json.dumps(issue["details"]) for issue in issues if issue["code"] == "ContentSecurityPolicyIssue"]
        return [url for url in asked if not url.startswith((origin + "/", "data:", "blob:", "about:"))] + broken

    def of(self, *methods):
        """What was heard of these events."""
        return [parameters for method, parameters in self.events if method in methods]

    def picture(self):
        """PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
