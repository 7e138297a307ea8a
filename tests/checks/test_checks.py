#!/usr/bin/env python3
"""Spoils a good image in every way that the checks guard against, and expects them to say so.

usage: test_checks.py IMAGE.elf BUILD
"""

import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE))
from elf import Elf  # noqa: E402

IMAGE = sys.argv[1]
BUILD = sys.argv[2]
SU_FOLDERS = [str(pathlib.Path(BUILD) / part) for part in ("firmware", "boards")]


class Checks(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.path = self.folder / "image.elf"
        self.elf = Elf(IMAGE)
        self.data = bytearray(self.elf.data)

    def run_check(self, script, *options):
        self.path.write_bytes(self.data)
        return subprocess.run([sys.executable, HERE / script, self.path, *options], capture_output=True, text=True)

    def assert_fails(self, message, script, *options):
        done = self.run_check(script, *options)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn(message, done.stderr)

    def poke(self, section, offset, data):
        at = self.elf.section(section).offset + offset
        self.data[at : at + len(data)] = data

    def rename(self, old, new):
        # The string tables of the symbols and sections come behind that of the debugger.
        at = self.data.rindex(b"\0" + old.encode() + b"\0") + 1
        self.assertLessEqual(len(new), len(old))
        self.data[at : at + len(old)] = new.encode().ljust(len(old), b"\0")

    def test_good_image_passes(self):
        done = self.run_check("check_image.py")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        done = self.run_check("stack_usage.py", "--su-dir", *SU_FOLDERS)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_what_a_scene_switches_off(self):
        scene = ("check_scene.py", "--build", BUILD, "--capabilities")
        everything = ["FIT", "FULL_GRID", "OUTLIERS", "TANGENTIAL_BIAS", "SLIP", "TANGENTIAL", "RAW_STREAM", "SYNC"]
        self.assertEqual(self.run_check(*scene, *everything).returncode, 0)
        for off, symbol in (("SLIP", "cmd_slip_"), ("FIT", ""), ("SYNC", ""), ("TANGENTIAL", "")):
            self.assert_fails(f"{off} is off, but the image has {symbol}", *scene, *(name for name in everything if name != off))
        self.rename("wire_raw_layout", "layout")
        self.rename("wire_raw_runs", "runs")
        self.assert_fails("RAW_STREAM is on, but the image has no symbol of it", *scene, *everything)
        self.assert_fails("no objects", "check_scene.py", "--build", self.folder, "--capabilities", "FIT")

    def test_flash_limit(self):
        self.assert_fails("60000 are allowed", "check_image.py", "--flash-limit", "60000")

    def test_spoilt_words(self):
        for section, offset, word, message in (
            (".boot2", 20, 0xFFFFFFFF, "CRC"),
            (".boot", 0, 0x20000000, "stack pointer"),
            (".boot", 4, 0x10000140, "reset vector"),  # without the Thumb bit
            (".vectors", 4 * 21, 0x20030001, "SRAM vector 21"),  # outside the code
        ):
            self.data = bytearray(self.elf.data)
            self.poke(section, offset, word.to_bytes(4, "little"))
            self.assert_fails(message, "check_image.py")

    def test_forbidden_symbols(self):
        names = {"double": "__aeabi_dadd __aeabi_f2d __muldf3 sqrt", "allocation": "malloc _sbrk _free_r"}
        names |= {"stdio": "printf sniprintf puts _write_r", "way out": "exit longjmp"}
        for reason, name in ((reason, name) for reason, each in names.items() for name in each.split()):
            self.data = bytearray(self.elf.data)
            self.rename("usb_controller_request_service", name)
            self.assert_fails(reason, "check_image.py")

    def test_section_that_is_not_placed(self):
        self.rename(".rodata", ".mydata")
        self.assert_fails("section .mydata is unknown", "check_image.py")

    def test_raw_image_of_another_build(self):
        other = self.folder / "other.bin"
        other.write_bytes(b"\0" * 1000)
        self.assert_fails("differs", "check_image.py", "--bin", str(other))

    def assert_stack_fails(self, message, *options):
        self.assert_fails(message, "stack_usage.py", "--su-dir", *SU_FOLDERS, *options)

    def test_stack_limit_and_functions(self):
        self.assert_stack_fails("more than the 100 allowed", "--limit", "100")
        self.assert_stack_fails("the image has no function fit_nothing", "--of", "fit_nothing")
        self.assert_stack_fails("boot_main may need", "--limit", "16", "--of", "boot_main")

    def test_handlers_of_several_priorities_nest(self):
        worst = lambda: int(re.search(r"worst +(\d+)", self.run_check("stack_usage.py", "--su-dir", *SU_FOLDERS).stdout)[1])
        nested = worst()
        at = self.elf.value("rp2040_irq_priorities") - self.elf.section(".rodata").address
        self.poke(".rodata", at, bytes([0x80] * 32))
        self.assertLess(worst(), nested - 2 * 36)

    def test_frame_of_variable_size(self):
        (self.folder / "a.su").write_text("a.c:1:2:f\t8\tdynamic\n")
        self.assert_fails("variable size", "stack_usage.py", "--su-dir", self.folder)

    def test_calls_through_pointers(self):
        table, good = self.folder / "table", (HERE / "indirect_calls.txt").read_text()
        recursion = good.replace("boot_reset: ", "boot_reset: boot_reset ")
        for text, message in (("# empty\n", "calls through a pointer"), (recursion, "recursion: boot_reset -> boot_reset")):
            table.write_text(text)
            self.assert_stack_fails(message, "--indirect", str(table))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
