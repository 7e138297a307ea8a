"""The page in a browser: what its user does, against emulated release images on the browser's serial ports.

usage: test_page.py --build BUILD --image FILE.bin --node NODE [--pictures] [unittest arguments]

With --pictures Appearance writes the reference pictures again, and that of the manual: check them by eye. Exit status 77: there is no such browser here, or it may get no ports.

real time: a browser, whose fingertips are on pseudo-terminals.
"""

import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/web"), str(ROOT / "tests/support")]
import driven  # noqa: E402
import figures  # noqa: E402
import pictures  # noqa: E402
from browser import Browser, CannotRun  # noqa: E402
from called import run  # noqa: E402
from fingertip import files  # noqa: E402
from fingertips import Bench  # noqa: E402

OPTIONS = argparse.Namespace()
WEB = ROOT / "build/report/web.json"  # beside what tests/nightly writes there
SKIPPED = 77
PATIENCE_s = 1200  # ends what hangs
SERIALS = ("E660583883265A01", "E660583883265A02")
FORCE_N = 3.0
REPEATED = 5
REFERENCES = pathlib.Path(__file__).parent / "pictures"
MANUALS = pathlib.Path(__file__).parents[2] / "host_tools/web/page.png"  # in host_tools/README.md
MANUALS_STEPS = 5  # the same: the object hangs
MOMENT_STEPS = 8  # of half a second before the end of the recording: the lime slips
COUNT_MESSAGES = """
import collections, json, sys
from mcap.reader import make_reader
with open(sys.argv[1], "rb") as file:
    print(json.dumps(collections.Counter(channel.topic for _, channel, _ in make_reader(file, validate_crcs=True).iter_messages())))
"""
# A page that lives ten times as fast: a replay of twelve seconds takes one.
TEN_TIMES = "const now_ms = performance.now.bind(performance); performance.now = () => 10 * now_ms();"
# The page is as patient as this test: a busy machine makes it slower, never red.
PATIENT = {"tries": PATIENCE_s} | {f"{name}_ms": 1000 * PATIENCE_s for name in ("version", "frame", "tared", "back")}
NO_SAVE_DIALOG = "delete window.showSaveFilePicker; delete window.showOpenFilePicker;"


class PageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="fingertip-")))
        cls.tool = OPTIONS.build / "host_tools/tool/cli/fingertip"
        cls.runtime = cls.folder / "run"
        cls.runtime.mkdir()
        cls.url = cls.enterClassContext(Bench(OPTIONS)).served(cls.runtime)
        cls.browser = cls.enterClassContext(Browser(cls.folder, OPTIONS.ports, cls.policy()))

    @classmethod
    def policy(cls):
        return {"SerialAllowAllPortsForUrls": [cls.url.partition("/?")[0]]}

    def setUp(self):
        self.bench = self.enterContext(Bench(OPTIONS))

    def open(self, before="", **options):
        before = f"globalThis.fingertipPatience = {json.dumps(PATIENT)}; {NO_SAVE_DIALOG}{before}"
        page = self.browser.page(self.url, before=before, **options)
        self.addCleanup(page.close)
        self.addCleanup(self.nothing_else_happened, page)
        driven.ready_s(page)
        return page

    def nothing_else_happened(self, page):
        """Whatever was done: no request to elsewhere, nothing that its policy refused, no error that was not caught."""
        self.assertEqual(page.foreign(), [])
        self.assertEqual([each["exceptionDetails"] for each in page.of("Runtime.exceptionThrown")], [])

    def alert(self, page, pattern):
        """What the page says and leaves standing."""
        alerts = "[...document.querySelectorAll('[role=alert]')].map(each => each.textContent)"
        return page.until(f"{alerts}.find(text => {pattern}.test(text))")

    def scenario(self, kind, *options):
        path = self.folder / f"{kind}.csv"
        if not path.exists():
            twin = OPTIONS.build / "host_tools/simulation/twin/twin"
            run(twin, "scenario", kind, "-o", path, "--cache", OPTIONS.build / "contact_tables", *options)
        return path


class Use(PageTest):
    """One after the other as a user would, on one page."""

    def test_set_tare_record_and_replay(self):
        self.bench.emulated(self.browser, SERIALS[0], self.scenario("taps", "--seconds", 120), "--pace", "real")
        page = self.open()
        driven.connected(page, 1)
        self.assertEqual(page.run("fingertip.fingertips[0].info.serial"), SERIALS[0])

        page.click("button", "Set")
        page.type("textbox", "Frame rate, Hz", "5000")
        page.click("button", "Apply")
        self.alert(page, '/"5000" is not a number from 0.1 to 2000/')
        page.type("textbox", "Frame rate, Hz", "100")
        page.click("button", "Apply")
        page.until("fingertip.fingertips[0].info.rate_mHz === 100000")
        page.click("button", "Close")

        done = page.run("fingertip.fingertips[0].health?.commands_done ?? 0")
        page.click("button", "Tare")
        page.until(f"(fingertip.fingertips[0].health?.commands_done ?? 0) > {done}")
        page.until("[...document.querySelectorAll('[role=alert], h2')].some(each => /: tared|Not tared/.test(each.textContent))")
        if page.has("button", "Try again"):  # a tap was there
            page.click("button", "Tare anyway")
            self.alert(page, "/: tared/")

        recorded = {}
        for kind in ("CSV", "MCAP"):
            page.click("button", "Record")
            page.click("radio", kind)
            page.click("button", "Start recording")
            page.until("!document.querySelector('dialog')")
            begun = page.run("fingertip.fingertips[0].contacts")
            page.until(f"fingertip.fingertips[0].contacts > {begun + 150}")
            page.click("button", "Stop")
            recorded[kind] = self.browser.saved(f".{kind.lower()}")
        self.assertEqual(page.run("fingertip.fingertips[0].lost"), 0)
        self.judge(recorded)

        page.give("input[type=file]", recorded["CSV"])
        page.until("fingertip.fingertips.length === 2")
        frames = len(files.read_recording(recorded["CSV"])["frame"])
        page.until(f"fingertip.fingertips[1].contacts === {frames}")
        self.assertEqual(page.run("fingertip.fingertips[1].info.serial"), SERIALS[0])

    def judge(self, recorded):
        """By the tool and the Python package, which read each, and by the library of MCAP's makers."""
        for kind, path in recorded.items():
            through = self.folder / f"through_{kind}.csv"
            run(self.tool, "convert", path, through, "--overwrite")
            recording = files.read_recording(through)
            self.assertGreater(len(recording["frame"]), 150, kind)
            self.assertTrue((np.diff(recording["frame"]) == 1).all(), kind)
            self.assertEqual(recording.end["dropped_packets"], "0", kind)
            self.assertEqual(recording.metadata["serial"], SERIALS[0])
            # It may begin and end between the two packets of a frame.
            self.assertTrue(np.isfinite(recording.sensors_Pa[1:-1]).all())
            if kind == "CSV":
                self.assertEqual(path.read_text(), through.read_text())
        read = run(ROOT / "build/venv/bin/python", "-c", COUNT_MESSAGES, recorded["MCAP"])
        counts = json.loads(read)
        self.assertGreater(min(counts.values()), 0, counts)
        frames = len(files.read_recording(self.folder / "through_MCAP.csv")["frame"])
        self.assertEqual(next(count for topic, count in counts.items() if topic.endswith("/contact")), frames)

    def test_gone_and_back_and_two_at_once(self):
        scenario = self.scenario("taps", "--seconds", 120)
        first = self.bench.fake(self.browser, SERIALS[0], "rate=200")
        page = self.open()
        driven.connected(page, 1)
        self.bench.end(first)
        page.until("fingertip.fingertips[0].state === 'closed'")
        self.assertIn("plug it in again", page.run("fingertip.fingertips[0].why"))
        before = page.run("fingertip.fingertips[0].contacts")
        self.bench.fake(self.browser, SERIALS[0], "rate=200")
        page.until(f"fingertip.fingertips[0].state === 'live' && fingertip.fingertips[0].contacts > {before}")
        self.assertEqual(page.run("fingertip.fingertips.length"), 1)

        self.bench.emulated(self.browser, SERIALS[1], scenario, "--pace", "real")
        driven.connected(page, 2)
        before = page.run("fingertip.fingertips.map(each => each.contacts)")
        for k, count in enumerate(before):
            page.until(f"fingertip.fingertips[{k}].contacts > {count + 100}")
        self.assertEqual(sorted(page.run("fingertip.fingertips.map(each => each.info.serial)")), sorted(SERIALS))
        self.assertEqual(page.run("fingertip.fingertips.map(each => each.lost)"), [0, 0])

    def test_flash(self):
        image = OPTIONS.build.parent / "pico_mux/fingertip-pico_mux.uf2"
        device = self.bench.fake(self.browser, SERIALS[0], "rate=100", "board=pico_mux", "loader=1")
        page = self.open()
        driven.connected(page, 1)
        page.click("button", "Flash")
        torn = self.folder / "torn.uf2"
        torn.write_bytes(image.read_bytes()[:-100])
        page.give("dialog input[type=file]", image)
        page.find("button", "Reboot to the loader")
        for wrong, pattern in (
            (torn, "/torn.uf2/"),
            (OPTIONS.image.with_suffix(".uf2"), "/is for board pico_parallel, but this fingertip is a pico_mux/"),
        ):
            page.give("dialog input[type=file]", wrong)
            self.alert(page, pattern)
            self.assertFalse(page.has("button", "Reboot to the loader"))  # nor is the one before meant any more
        page.give("dialog input[type=file]", image)
        page.click("button", "Reboot to the loader")
        self.assertEqual(device.wait(PATIENCE_s), 0)
        page.click("button", "Save onto the drive")
        self.assertEqual(self.browser.saved(".uf2").read_bytes(), image.read_bytes())
        self.bench.fake(self.browser, SERIALS[0], "rate=100", "board=pico_mux")
        driven.connected(page, 1)


class Calibrate(PageTest):
    """On the emulated image, which runs as fast as it can: host time does not matter."""

    PLACEMENTS = ("--effects", "gain=10", "--seed", 41, "--pad", 7)

    def start(self):
        """Its placements come again and again: how many pass before the page asks for them depends on this machine."""
        once = self.scenario("placements", *self.PLACEMENTS).read_text().splitlines(keepends=True)
        first = next(i for i, line in enumerate(once) if line.startswith("t_s,")) + 1
        rows = [line.split(",", 1) for line in once[first:]]
        often = self.folder / "placements_often.csv"
        period_s = float(rows[-1][0]) + 0.1
        repeated = [f"{float(t_s) + again * period_s:.6f},{rest}" for again in range(REPEATED) for t_s, rest in rows]
        often.write_text("".join(once[:first] + repeated))
        long = ("--pace", "fast", "--seconds", 3600, "--flash", self.folder / "flash.bin")
        return self.bench.emulated(self.browser, SERIALS[0], often, *long)

    def test_a_weight_finds_the_gains(self):
        process = self.start()
        page = self.open()
        driven.connected(page, 1)
        page.click("button", "Set")
        page.type("textbox", "Frame rate, Hz", "50")
        page.click("button", "Apply and keep")
        page.until("/kept for good/.test(document.querySelector('dialog [role=status]').textContent)")
        page.click("button", "Close")
        self.bench.end(process)
        self.assertEqual(process.returncode, 0)
        page.until("fingertip.fingertips[0].state === 'closed'")
        process = self.start()
        driven.connected(page, 1)
        self.assertEqual(page.run("fingertip.fingertips[0].info.rate_mHz"), 50000)
        page.click("button", "Calibrate")
        page.type("textbox", "Weight, g", f"{1000 * FORCE_N / 9.80665:.6g}")
        page.click("button", "Begin")
        page.find("button", "Store")
        table = "document.querySelector('dialog table').textContent"
        after_mm = page.run(f"Number({table}.match(/location off by[ 0-9.]*? mm *([0-9.]+) mm/)?.[1] ?? NaN)")
        page.click("button", "Store")
        page.until("document.querySelector('dialog [role=status]').textContent.startsWith('Stored')")
        self.assertLess(after_mm, 0.15)
        found = np.array(page.run("Array.from(fingertip.fingertips[0].info.gain)"))
        text = self.scenario("placements", *self.PLACEMENTS).read_text()
        true = 1 + np.array(re.search("(?m)^# gain_errors_percent: (.*)$", text)[1].split(), float) / 100
        self.assertEqual(len(found), len(true))
        self.assertLess(np.std(found / true), 0.015)
        self.assertGreater(np.std(true), 0.1)
        self.bench.end(process)

    def test_the_doctor_examines(self):
        rest = self.folder / "rest.csv"
        row = ",".join("0" for _ in files.TRUTH_COLUMNS) + ",0" * 15
        head = ",".join(["t_s", *files.TRUTH_COLUMNS, *(f"s{k}_Pa" for k in range(15))])
        rest.write_text(f"# fingertip-scenario 1\n{head}\n0,{row}\n3600,{row}\n")
        process = self.bench.emulated(self.browser, SERIALS[0], rest, "--pace", "fast")
        page = self.open()
        driven.connected(page, 1)
        page.click("button", "Doctor")
        page.click("button", "Examine")
        page.until("/found something|All is well/.test(document.querySelector('dialog [role=status]').textContent)")
        said = page.run("[...document.querySelectorAll('dialog .findings li')].map(each => each.textContent)")
        self.assertGreater(len(said), 4)
        self.assertEqual([each for each in said if each.startswith("wrong")], [], said)
        self.bench.end(process)


class BadInput(PageTest):
    """Each is a sentence that says what to do."""

    def test_a_torn_recording_is_shown_to_its_tear(self):
        whole = self.folder / "whole.csv"
        with Bench(OPTIONS) as bench:
            bench.fake(self.browser, SERIALS[1], "rate=200")
            run(self.tool, "record", whole, "--overwrite", "--seconds", 1, "--port", self.browser.ports / f"1209:0001:{SERIALS[1]}")
        lines = whole.read_text().splitlines(keepends=True)
        (self.folder / "torn.csv").write_text("".join(lines[:-20]) + lines[-20][:40])
        page = self.open()
        page.give("input[type=file]", self.folder / "torn.csv")
        said = self.alert(page, "/torn.csv/").removesuffix("Close")
        page.until("fingertip.fingertips[0].state === 'closed'")
        page.shown()
        page.until("[...document.querySelectorAll('.pad-card .state')].every(each => /ended/.test(each.textContent))")
        self.assertEqual(page.run("document.body.textContent").count(said), 1, said)
        self.assertGreater(page.run("fingertip.fingertips[0].contacts"), 100)

    def test_a_recording_of_two(self):
        """Each has its name, and the traces the colour of the pad that is chosen; nothing in a replay is live."""
        two, here = self.folder / "two.csv", ["env", "-u", "FINGERTIP_PORT", f"XDG_RUNTIME_DIR={self.folder}", self.tool]
        with subprocess.Popen([*here, "simulate", "--fingertips", "2"], stdout=subprocess.PIPE, text=True) as simulated:
            simulated.stdout.readline()
            run(*here, "record", "--all", two, "--overwrite", "--seconds", 3)
            simulated.terminate()
        page = self.open(before=TEN_TIMES)
        page.give("input[type=file]", two)
        page.until("fingertip.fingertips.length === 2 && fingertip.fingertips.every(each => each.state === 'closed')")
        page.shown()
        named = "[...document.querySelectorAll('.pad-card .name')].map(each => each.textContent)"
        names = page.until(f"(names => names.every(name => /fingertip/.test(name)) && names)({named})")
        self.assertEqual(names, ["two.csv: fingertip E110", "two.csv: fingertip E111"])
        self.assertEqual(page.run("document.querySelector('.moment').textContent"), "newest")
        self.assertEqual([page.has("button", name) for name in ("Look back", "Go live")], [True, False])
        for finger in (0, 1):
            page.run(f"document.querySelectorAll('.pad-name')[{finger}].click()")
            page.until(f"document.querySelector('.trace-title .key')?.dataset.finger === '{finger}'")

    def test_a_part_of_the_page_that_cannot_be_fetched(self):
        page = self.browser.page()
        self.addCleanup(page.close)
        page.call("Network.setBlockedURLs", urls=["*core.wasm"])
        page.go(self.url)
        self.assertRegex(self.alert(page, "/cannot start/"), "core.wasm.*load the page again.*copy all of its files")

    def test_a_browser_without_web_serial(self):
        page = self.open(before="delete Navigator.prototype.serial;")
        self.assertEqual(page.run("document.querySelector('.top button').textContent"), "Simulate")
        page.click("button", "Connect")
        self.assertRegex(self.alert(page, "/cannot reach serial ports/"), "open this page in Chrome")


class Refused(PageTest):
    @classmethod
    def policy(cls):
        return {"DefaultSerialGuardSetting": 2}  # no page may ask

    def test_ports_that_the_user_does_not_give(self):
        self.bench.fake(self.browser, SERIALS[0], "rate=100")
        page = self.open()
        page.click("button", "Connect")
        self.alert(page, "/allow|choose|chosen/")
        self.assertEqual(page.run("fingertip.fingertips.length"), 0)


class Appearance(PageTest):
    """Against pictures that somebody has looked at, of the same moment of a recording."""

    LIMIT = 11  # of what one place in a hundred exceeds: other fonts 4 (with serifs) to 10.5 (of one width), no traces 24 in their part, no colours 45, no pad 57
    SIZES = {"light": (1280, 800), "dark": (1280, 800), "phone": (390, 780)}
    MANUALS_SIZE = (1280, 800)

    def recorded(self, name, scenario, *options):
        recording = self.folder / name
        if not recording.exists():
            run(OPTIONS.build / "host_tools/simulation/player/fingertip_player", "play", scenario, "-o", recording, "--quiet", *options)
        return recording

    def paused(self, recording=None, steps=MOMENT_STEPS):
        """A page that shows the same moment of the same recording; without one: of a lime that slips, simulated."""
        recording = recording or self.recorded("lime.csv", self.scenario("slip", "--indenter=lime", "--effects=gain=10", "--seconds", 12))
        page = self.open(before=TEN_TIMES)
        page.give("input[type=file]", recording)
        page.until("fingertip.fingertips[0]?.state === 'closed'")
        root = page.call("DOM.getDocument")["root"]["nodeId"]
        page.call("DOM.focus", nodeId=page.call("DOM.querySelector", nodeId=root, selector="main")["nodeId"])
        page.key(" ", "Space")
        for _ in range(steps):
            page.key("ArrowLeft")
        return page

    def shown(self, page, name):
        page.size(*self.SIZES.get(name, self.MANUALS_SIZE))
        page.media(prefers_color_scheme="dark" if name == "dark" else "light")
        before = None
        for _ in range(40):  # until it stands still
            page.shown()
            now = page.picture()
            if now == before:
                break
            before = now
        return pictures.read(now)

    def apart(self, page, found):
        """From the picture in light colours: of all that is shown, or of the traces alone, which are thin lines in a part of it."""
        reference = pictures.read(str(REFERENCES / "light.png"))
        box = "document.querySelector('.traces').getBoundingClientRect()"
        edges = page.run(f"(({{left, top, right, bottom}}) => [left, top, right, bottom])({box})")
        left, top, right, bottom = (int(edge / 2) for edge in edges)
        traces = [picture[top:bottom, left:right] for picture in (found, reference)]
        return max(pictures.difference(found, reference), pictures.difference(*traces))

    def test_it_looks_as_it_did(self):
        page = self.paused()
        for name in self.SIZES:
            found = pictures.half(self.shown(page, name))
            reference = REFERENCES / f"{name}.png"
            if OPTIONS.pictures:
                pictures.write(reference, found)
                continue
            apart = self.apart(page, found) if name == "light" else pictures.difference(found, pictures.read(str(reference)))
            self.assertLess(apart, self.LIMIT, name)
        if OPTIONS.pictures:
            return
        # and what is missing is noticed
        for what, hide in (
            ("the pad", "document.querySelector('.pad-picture').style.opacity = 0"),
            ("the traces", "document.querySelector('.traces').style.opacity = 0"),
            ("the colours", "document.documentElement.style.filter = 'grayscale(1)'"),
        ):
            page.run(hide)
            self.assertGreater(self.apart(page, pictures.half(self.shown(page, "light"))), self.LIMIT, what)
            page.run("document.querySelectorAll('[style*=opacity]').forEach(each => each.style.opacity = '')")

    def test_the_manuals_picture(self):
        """What the boards' default scene shows of a fingertip that knows its pad: a pull beside force and place."""
        lift = self.scenario("lift", "--seconds", 20, "--force", 6, "--tangential", "0.35,-40", "--effects", "gain=2", "--seed", 5)
        page = self.paused(self.recorded("pulled.csv", lift, "--pad", 12, "--rate", 200), MANUALS_STEPS)
        self.assertRegex(page.run("document.body.innerText"), r"Pull")
        found = self.shown(page, "manual")
        if OPTIONS.pictures:
            pictures.write(MANUALS, found)
            return
        self.assertLess(pictures.difference(pictures.half(found), pictures.half(pictures.read(str(MANUALS)))), self.LIMIT)

    def test_a_pause_follows_the_window(self):
        """The flags, which are drawn with the page's own pen, as the plots."""
        page = self.paused()
        for width in (700, 1280):
            page.size(width, 800)
            flags_px = "document.querySelector('canvas.flags').getBoundingClientRect().width"
            page.until(f"document.querySelector('.traces').clientWidth === {flags_px}")

    def test_a_replay_is_zoomed(self):
        """By drawing over a part, by the wheel and by keys; neither by a click that shakes nor by a wheel that scrolls the page."""
        page = self.paused()
        x, y, width = page.run("(({x, y, width}) => [x, y, width])(document.querySelector('.u-over').getBoundingClientRect())")
        for end in (x + width / 2 + 1, x + 0.75 * width):
            page.press_at(x + width / 2, y + 9)
            page.drag_to(end, y + 9)
            page.release()
        shown = "document.querySelector('.window').selectedOptions[0].textContent + document.querySelector('.moment').textContent"
        page.until(f"{shown} === '5.0 s−9.0 s'")
        for keys, delta, zoomed in ((2, -9, "4.6"), (2, -100, "3.7"), (0, -100, "3.7")):  # Ctrl, then none
            page.call("Input.dispatchMouseEvent", type="mouseWheel", x=x + 9, y=y + 9, modifiers=keys, deltaX=0, deltaY=delta)
            page.until(f"{shown} === '{zoomed} s−9.0 s'")
        page.key("-", "Minus")
        page.until(f"{shown} === '7.3 s−9.0 s'")


class Simulations(PageTest):
    """What `fingertip simulate` runs on this computer."""

    FIRST = "fingertip.fingertips[0]"
    LOOKS = "globalThis.looks = 0; const asked = fetch; globalThis.fetch = (what, ...more) => { looks += /simulated$/.test(what); return asked(what, ...more); };"

    def test_the_pointer_presses_the_pad(self):
        page = self.open()
        simulation = self.bench.simulated(self.runtime, "--mouse")
        driven.connected(page, 1)
        self.assertEqual(page.run(f"{self.FIRST}.info.serial"), "00000000000CE110")
        self.assertFalse(page.has("combobox", "Object"))  # the ball is the only one
        page.click("button", "From above")
        page.shown()
        box = "document.querySelector('.pad').getBoundingClientRect()"
        x, y, width, height = page.run(f"(({{x, y, width, height}}) => [x, y, width, height])({box})")
        page.press_at(x + width / 2, y + height / 2)
        page.until(f"{self.FIRST}.contact.force_N > 2")
        page.until(f"{self.FIRST}.line.truth.force_N > 2")
        felt = page.run(f"(({{x_mm, y_mm}}) => [x_mm, y_mm])({self.FIRST}.contact)")
        true = page.run(f"(({{x_mm, y_mm}}) => [x_mm, y_mm])({self.FIRST}.line.truth)")
        self.assertLess(np.hypot(*true), 2)  # the middle of the picture is that of the pad
        self.assertLess(np.hypot(*np.subtract(felt, true)), 2.5)  # never calibrated
        # Of force, place and pull.
        page.until("[...document.querySelectorAll('.truth')].filter(each => /^true /.test(each.textContent)).length === 3")
        page.until(r"/^\d+\.\d\d.* N .*true \d+\.\d\d$/.test(document.querySelector('.number.force dd').textContent)")
        page.drag_to(x + width / 2, y + height / 2 - height / 8)
        page.until(f"{self.FIRST}.line.truth.y_mm > {true[1] + 2} && {self.FIRST}.contact.y_mm > {felt[1] + 1}")
        page.release()
        page.until(f"{self.FIRST}.line.truth.force_N === 0 && !({self.FIRST}.contact.flags & 1)")
        page.until("[...document.querySelectorAll('.truth')].every(each => each.textContent === '')")

        # It is calibrated where it lies, beside the dialog.
        page.run("globalThis.pad = document.querySelector('.pad')")
        page.click("button", "Calibrate")
        page.click("button", "Begin")
        first = page.until(f"{self.FIRST}.found?.wanted")
        disabled = "[...document.querySelectorAll('.doings button:disabled')].map(each => each.textContent).join()"
        self.assertEqual(page.run(disabled), "Tare,Set,Calibrate,Flash")
        page.click("button", "Press")
        page.until(f"{self.FIRST}.found.placements.length === 1")
        self.assertNotEqual(page.run(f"{self.FIRST}.found.wanted"), first)
        page.click("button", "Cancel")
        page.until(f"{self.FIRST}.found === null && !{disabled}")
        self.assertTrue(page.run("pad === document.querySelector('.pad')"))  # as it was turned

        Bench.end(simulation)
        page.until(f"{self.FIRST}.state === 'closed' && /simulation has ended/.test({self.FIRST}.why)")
        self.bench.simulated(self.runtime, "--mouse")
        driven.connected(page, 1)  # the same one again, and its hand
        self.assertEqual(page.run("fingertip.fingertips.length"), 1)
        page.click("button", "Press")
        page.until(f"{self.FIRST}.contact.force_N > 2")

    def test_two_that_no_hand_presses(self):
        self.bench.simulated(self.runtime, "--fingertips", "2")
        page = self.open(before=self.LOOKS)
        driven.connected(page, 2)
        self.assertFalse(page.has("button", "Press"))
        page.until("fingertip.fingertips.every(each => each.line.truth.contact)")
        page.until("[...document.querySelectorAll('.truth')].some(each => /^true /.test(each.textContent))")
        page.click("button", "Disconnect")
        page.until("fingertip.fingertips.length === 1")
        looks = page.run("looks")
        page.until(f"looks > {looks + 1}")  # it is not found again
        self.assertEqual(page.run("fingertip.fingertips.length"), 1)


class Everyone(PageTest):
    """Who does not see it, who sees little, who holds it in one hand."""

    def everything(self, before=""):
        """A page with a simulated fingertip on it."""
        page = self.open(before=before)
        page.click("button", "Simulate")
        driven.connected(page, 1)
        return page

    def test_nobody_is_kept_out(self):
        """In any size, light and dark: names, roles, contrast and whatever else axe-core judges."""
        page, found = self.open(), []

        def check(where):
            for size in ((1280, 800), (1920, 1080), (390, 844)):
                page.size(*size)
                page.shown()
                found.extend((where, scheme, size, each) for each in page.violations())

        steps = (("Set", "Close"), ("Calibrate", "Cancel"), ("Record", "Cancel"), ("Doctor", "Close"))
        for fingertips, scheme in ((0, "light"), (0, "dark"), (1, "light"), (1, "dark")):
            page.media(prefers_color_scheme=scheme)
            if fingertips and not page.run("fingertip.fingertips.length"):
                page.click("button", "Simulate")
                driven.connected(page, 1)
            check(f"{fingertips} fingertips")
            for step, close in steps[: len(steps) * fingertips]:
                page.click("button", step)
                check(step)
                page.click("button", close)
                page.until("!document.querySelector('dialog')")
        figures.add(WEB, {"axe_violations": len(found)})
        self.assertEqual(found, [])

    WRITTEN = """globalThis.written = []; const fillText = CanvasRenderingContext2D.prototype.fillText;
      CanvasRenderingContext2D.prototype.fillText = function (text, x, y, most) {
        written.push({where: this.canvas, text, x, y, width: this.measureText(text).width});
        return fillText.call(this, text, x, y, ...(most === undefined ? [] : [most])); };
      const clearRect = CanvasRenderingContext2D.prototype.clearRect;
      CanvasRenderingContext2D.prototype.clearRect = function (...all) {
        written = written.filter(each => each.where !== this.canvas); return clearRect.apply(this, all); };"""

    OVERLAP = """(() => {
      const box = each => each.getBoundingClientRect(), found = [], low = document.querySelector('.timeline');
      const inside = (part, whole) => box(part).top >= box(whole).top - 1 && box(part).bottom <= box(whole).bottom + 1 && box(part).right <= box(whole).right + 1;
      const traces = document.querySelector('.traces'), parts = [...document.querySelectorAll('.trace, canvas.flags')];
      for (const [i, part] of parts.entries()) {
        if (box(part).height < 30) found.push(`${part.textContent}: ${box(part).height} px high`);
        if (!inside(part, traces)) found.push(`${part.textContent || part.className} is cut`);
        if (box(part).bottom > box(low).top + 1) found.push(`${part.textContent || part.className} under the time bar`);
        if (i && box(part).top < box(parts[i - 1]).bottom - 1) found.push(`${part.textContent || part.className} over what is before it`);
      }
      const on = canvas => written.filter(each => each.where === canvas), labels = on(document.querySelector('.pad-labels'));
      labels.forEach((one, i) => labels.slice(0, i).forEach(other => {
        if (Math.abs(one.x - other.x) < (one.width + other.width) / 2 && Math.abs(one.y - other.y) < 9) found.push(`${one.text} on ${other.text}`);
      }));
      const reach = (axis, whole) => (Math.max(...labels.map(each => each[axis])) - Math.min(...labels.map(each => each[axis]))) / whole;
      const pad = box(document.querySelector('.pad')), share = reach('x', pad.width) * reach('y', pad.height);
      if (!(share > 0.25)) found.push(`the pad has ${share} of its card`);
      for (const part of document.querySelectorAll('.trace'))
        if (new Set(on(part.querySelector('canvas')).map(each => each.text).filter(text => !/ s$/.test(text))).size < 3) found.push(`${part.textContent}: no three ticks`);
      return parts.length < 4 ? ['no traces'] : found;
    })()"""

    def test_nothing_covers_another(self):
        """Traces, their ticks and the flags stand free, whatever was scrolled, and the pad's numbers; where there is room, on the first screen, the time bar too."""
        page, found = self.everything(self.WRITTEN), []
        page.click("button", "Press")
        page.until("fingertip.fingertips[0].contact.force_N > 2")
        for width, height in ((1280, 800), (1920, 1080), (390, 844), (360, 740), (800, 600), (3840, 2160)):
            page.size(width, height)
            for part in (".top", ".over-time"):
                page.run(f"document.querySelector('{part}').scrollIntoView()")
                page.until(f"document.querySelector('.traces canvas').clientWidth <= {width}")
                for _ in range(3):
                    page.shown()
                found += [(width, height, each) for each in page.run(self.OVERLAP)]
            self.assertLessEqual(page.run("document.documentElement.scrollWidth"), width)
            if width > 800:
                page.run("scrollTo(0, 0)")
                self.assertLessEqual(page.run("document.querySelector('.timeline').getBoundingClientRect().bottom"), height)
                self.assertGreater(page.run("document.querySelector('.pad').getBoundingClientRect().height"), 200)
        figures.add(WEB, {"overlaps": len(found)})
        self.assertEqual(found, [])

    def test_the_pad_has_axes_in_mm(self):
        page = self.everything(self.WRITTEN)
        page.click("button", "From above")
        page.run("written.length = 0")
        page.until("written.some(each => /y mm/.test(each.text))")
        said = page.run("written.filter(each => each.where.className === 'pad-labels').map(each => [each.text, [each.x, each.y]])")
        at = dict(said)
        for axis, name, most_mm in ((0, "x", 10), (1, "y", 20)):
            sensors_mm = page.run(f"Array.from(fingertip.fingertips[0].info.{name}_mm)")
            px_per_mm = (at["14"][axis] - at["6"][axis]) / (sensors_mm[14] - sensors_mm[6])
            ends = [place for text, place in said if text == str(most_mm) and abs(place[0] - at[f"{name} mm"][0]) < 2]
            opposite = [place for text, place in said if text == f"−{most_mm}" and abs(place[1 - axis] - ends[0][1 - axis]) < 2]
            self.assertAlmostEqual((ends[0][axis] - opposite[0][axis]) / px_per_mm, 2 * most_mm, delta=0.5, msg=name)

    def test_the_focus_stays_where_something_was_pressed(self):
        """Though its control is hidden, disabled or gone."""
        page = self.open()
        at = "document.activeElement"

        def enter(name):
            page.call("DOM.focus", backendNodeId=page.find("button", name))
            page.enter()

        enter("Try the simulated one")
        driven.connected(page, 1)
        page.until(f"{at}.closest('main') && {at} !== document.querySelector('main')")
        enter("Tare")
        page.until("[...document.querySelectorAll('[role=alert], h2')].some(each => /: tared/.test(each.textContent))")
        page.until(f"{at}.textContent === 'Tare'")
        enter("Close")
        page.until(f"!document.querySelector('.notice') && {at} !== document.body")
        enter("Record")
        page.run("[1, 2].forEach(() => document.querySelector('dialog form').requestSubmit())")  # Enter, twice
        page.until("!document.querySelector('dialog')")
        self.assertEqual(page.run("fingertip.fingertips[0].taps.size"), 1)
        self.assertTrue(page.run("!dispatchEvent(new Event('beforeunload', {cancelable: true}))"))
        page.until(f"{at}.closest('.doings')")
        enter("Stop")
        self.browser.saved(".csv")
        page.until(f"{at}.closest('.doings')")

    def test_by_keys_alone(self):
        """Every control is reached, and none holds the focus."""
        page = self.everything()
        facts = page.until("(text => text.includes('running for') && text)(document.querySelector('.fact-groups').textContent)")
        self.assertNotRegex(facts, "busy|stack")  # of a simulated processor
        wanted = {"Connect", "Simulate", "Replay a file", "Tare", "Set", "Calibrate", "Record", "Doctor", "Disconnect"}
        reached = set()
        for _ in range(60):
            page.key("Tab")
            reached.add(page.run("document.activeElement.textContent.trim()"))
        self.assertLessEqual(wanted, reached)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("build", "image"):
        parser.add_argument(f"--{name}", required=True, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--node", required=True)
    parser.add_argument("--pictures", action="store_true", help="write the reference pictures again")
    _, rest = parser.parse_known_args(namespace=OPTIONS)
    OPTIONS.ports = OPTIONS.build / "tests/web/libweb_test_ports.so"
    try:
        with tempfile.TemporaryDirectory(prefix="fingertip-") as folder, Browser(folder, OPTIONS.ports):
            pass
    except CannotRun as why:
        print(f"skipped: {why}")
        sys.exit(SKIPPED)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
