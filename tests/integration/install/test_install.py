"""What `cmake --install` gives: tool and library, from a prefix that was moved, used as a stranger would.

usage: test_install.py --cmake CMAKE --build FOLDER --fake-device PROGRAM
"""

# real time: installed programs on pseudo-terminals
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/support"))
from real_time import plugged_in  # noqa: E402

EXAMPLE = ROOT / "host_tools/library/libfingertip/example"
TOOLS = argparse.Namespace()
PATIENCE_s = 300
PUBLIC = set(
    """clock.hpp clock_fit.hpp command.hpp connection.hpp decoder.hpp device_loop.hpp discovery.hpp error.hpp fingertip.h fingertip_grip.h line_source.hpp
    names.hpp packet_fields.hpp packet_file.hpp recording_reader.hpp session.hpp transport.hpp wire.hpp common/calibration.h
    common/contact_flags.h common/crash.h common/limits.h common/pad_profile.h common/status.h wire/bodies.h wire/packet.h""".split()
)
FLAG_CONTACT, FLAG_FIT_VALID, FLAG_UNCERTAIN = 1 << 0, 1 << 1, 1 << 10


def run(*command, **environment):
    environment = {**os.environ, **{name: str(value) for name, value in environment.items()}}
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=PATIENCE_s, env=environment)
    if done.returncode:
        raise AssertionError(f"{command}: {done.stdout}{done.stderr}")
    return done.stdout


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))
        first = cls.folder / "first"
        manifest = pathlib.Path(TOOLS.build) / "install_manifest.txt"  # by it a true installation is removed
        before = manifest.read_bytes() if manifest.exists() else None
        run(TOOLS.cmake, "--install", TOOLS.build, "--prefix", first)
        if before is None:
            manifest.unlink()
        else:
            manifest.write_bytes(before)
        cls.prefix = cls.folder / "moved"
        first.rename(cls.prefix)
        cls.library = next(cls.prefix.rglob("libfingertip.so"))
        cls.pkgconfig = cls.library.parent / "pkgconfig"
        # what the fingertip's users are to build
        cls.by_cmake = cls.folder / "by_cmake/follow"
        run(TOOLS.cmake, "-S", EXAMPLE, "-B", cls.by_cmake.parent, f"-DCMAKE_PREFIX_PATH={cls.prefix}")
        run(TOOLS.cmake, "--build", cls.by_cmake.parent)
        flags = run("pkg-config", "--cflags", "--libs", "fingertip", PKG_CONFIG_PATH=cls.pkgconfig).split()
        cls.by_pkg_config = cls.folder / "follow"
        run("c++", "-std=c++17", "-Wall", "-Wextra", "-Werror", EXAMPLE / "follow.cpp", *flags, "-o", cls.by_pkg_config)

    def installed(self):
        return [path for path in self.prefix.rglob("*") if path.is_file()]

    def test_everything_is_there(self):
        names = {path.relative_to(self.prefix).name for path in self.installed()}
        expected = """fingertip 60-fingertip.rules fingertip.1 _fingertip fingertip.fish fingertip.pc fingertipConfig.cmake
            fingertipConfigVersion.cmake fingertipTargets.cmake PROTOCOL.md fingertip-simulate fingertip.service"""
        self.assertLessEqual(set(expected.split()), names)
        headers = self.prefix / "include/fingertip"
        self.assertEqual({str(path.relative_to(headers)) for path in headers.rglob("*") if path.is_file()}, PUBLIC)

    def test_no_file_names_the_build_tree(self):
        for path in self.installed():
            content = path.read_bytes()
            for tree in (str(ROOT), str(pathlib.Path(TOOLS.build).resolve()), str(self.folder)):
                self.assertNotIn(tree.encode(), content, path)
        for path in (self.prefix / "bin/fingertip", self.library):
            dynamic = run("readelf", "-d", path)
            self.assertIn("NEEDED", dynamic)
            for entry in re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*)\]", dynamic):
                self.assertTrue(entry.startswith("$ORIGIN"), entry)

    def test_the_tool_runs_where_it_was_moved_to(self):
        tool = self.prefix / "bin/fingertip"
        version = run(tool, "--version").split()[1]
        self.assertEqual(self.library.resolve().name, f"libfingertip.so.{version}")
        self.assertEqual(run(tool, "rule"), (self.prefix / "lib/udev/rules.d/60-fingertip.rules").read_text())
        self.assertEqual(len(list((self.prefix / "share/fingertip/tables").glob("sphere1[58]-*.table"))), 2)
        package = ROOT / "host_tools/python/fingertip"
        sources = [path for path in package.rglob("*.*") if path.suffix in (".py", ".json", ".msg")]
        installed = [path for path in (self.prefix / "share/fingertip/python").rglob("*") if path.is_file()]
        self.assertEqual(len(installed), len(sources) + 1)
        sheet = self.folder / "sheet.pdf"
        run(tool, "validate", "--template", sheet)
        self.assertTrue(sheet.exists())

    def test_versions(self):
        version = run(self.prefix / "bin/fingertip", "--version").split()[1]
        self.assertEqual(run("pkg-config", "--modversion", "fingertip", PKG_CONFIG_PATH=self.pkgconfig).strip(), version)
        major, minor, _ = version.split(".")
        self.assertIn(f"[libfingertip.so.{major}.{minor}]", run("readelf", "-d", self.library))
        self.assertIn(f"libfingertip.so.{major}.{minor}]", run("readelf", "-d", self.by_pkg_config))
        project = self.folder / "wrong"
        project.mkdir()
        (project / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.16)\nproject(wrong LANGUAGES CXX)\nfind_package(fingertip 99.0 REQUIRED)\n"
        )
        with self.assertRaisesRegex(AssertionError, "99.0"):
            run(TOOLS.cmake, "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.prefix}")

    def test_each_header_stands_alone(self):
        for header in sorted(PUBLIC):
            language = "c++" if header.endswith(".hpp") else "c"
            source = self.folder / f"alone.{language}"
            source.write_text(f"#include <fingertip/{header}>\n")
            standard = "c++17" if language == "c++" else "c11"
            options = f"-x {language} -std={standard} -Wall -Wextra -Werror -fsyntax-only -I{self.prefix / 'include'}"
            run("cc", *options.split(), source)

    def test_only_the_public_is_visible(self):
        symbols = run("nm", "-DC", "--defined-only", self.library)
        ours = {part for name in re.findall(r"^\S+ [TDR] ((?:\w+::)*\w+)", symbols, re.M) for part in name.split("::")}
        public = """Session Decoder DeviceLoop PacketFile RecordingReader choose_endpoint open_endpoint find_usb command_stream setting_from_text
            flags_text warning_flags info_metadata wire_encode wire_decode fingertip_decoder_feed fingertip_reader_next fingertip_writer_new fingertip_grip_step"""
        own = "SerialTransport UsbTransport RecordingWriter ProgressBar OutputFile read_firmware printable"
        self.assertLessEqual(set(public.split()), ours)
        self.assertFalse(set(own.split()) & ours)
        # nothing that is declared to the public is missing
        declared = set()
        for header in (self.prefix / "include/fingertip").glob("*.h*"):
            text = re.sub(r"/\*.*?\*/", "", header.read_text(), flags=re.S)
            declared |= set(re.findall(r"^[\w:<>, &*]+?[ &*](\w+)\([^;{]*\)(?: const)?;", text, re.M))
        self.assertGreater(len(declared), 30)
        self.assertLessEqual(declared, ours)

    def follow(self, program, port):
        """The lines that the example prints before the fingertip vanishes."""
        return run(program, FINGERTIP_PORT=port, LD_LIBRARY_PATH=self.library.parent).splitlines()

    def test_the_example_prints_where_and_how_hard(self):
        for program in (self.by_cmake, self.by_pkg_config):
            port = self.folder / f"tty-{program.parent.name}"
            self.enterContext(plugged_in(TOOLS.fake_device, port, "frames=40"))
            lines = self.follow(program, port)
            self.assertEqual(len(lines), 40)
            for line in lines:
                x_mm, y_mm, force_N = map(float, re.fullmatch(r"(\S+) mm (\S+) mm (\S+) N", line).groups())
                self.assertAlmostEqual((x_mm / 8) ** 2 + (y_mm / 16) ** 2, 1, delta=0.01)
                self.assertEqual(force_N, 5)

    def test_the_example_heeds_flags(self):
        for flags, expected in ((FLAG_CONTACT, set()), (FLAG_CONTACT | FLAG_FIT_VALID | FLAG_UNCERTAIN, {"not to be trusted: UNCERTAIN"})):
            port = self.folder / f"tty-{flags}"
            self.enterContext(plugged_in(TOOLS.fake_device, port, "frames=20", f"flags={flags}"))
            self.assertEqual(set(self.follow(self.by_pkg_config, port)), expected)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name in ("cmake", "build", "fake-device"):
        parser.add_argument(f"--{name}", required=True)
    _, rest = parser.parse_known_args(namespace=TOOLS)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
