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
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name) / "image.elf"
        self.elf = Elf(IMAGE)
        self.data = bytearray(self.elf.data)

    def tearDown(self):
        self.folder.cleanup()

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
        everything = ["FIT", "FULL_GRID", "OUTLIERS", "TANGENTIAL_DOUBT", "SLIP", "TANGENTIAL", "RAW_STREAM", "SYNC"]
        self.assertEqual(self.run_check(*scene, *everything).returncode, 0)
        for off, symbol in (("SLIP", "cmd_slip_"), ("FIT", ""), ("SYNC", ""), ("TANGENTIAL", "")):
            self.assert_fails(f"{off} is off, but the image has {symbol}", *scene, *(name for name in everything if name != off))
        self.rename("wire_raw_layout", "layout")
        self.rename("wire_raw_runs", "runs")
        self.assert_fails("RAW_STREAM is on, but the image has no symbol of it", *scene, *everything)
        self.assert_fails("no objects", "check_scene.py", "--build", self.folder.name, "--capabilities", "FIT")

    def test_flash_limit(self):
        self.assert_fails("60000 are allowed", "check_image.py", "--flash-limit", "60000")

    def test_boot2_crc(self):
        self.poke(".boot2", 20, b"\xff")
        self.assert_fails("CRC", "check_image.py")

    def test_stack_pointer(self):
        self.poke(".boot", 0, (0x20000000).to_bytes(4, "little"))
        self.assert_fails("stack pointer", "check_image.py")

    def test_reset_vector_without_the_thumb_bit(self):
        self.poke(".boot", 4, (0x10000140).to_bytes(4, "little"))
        self.assert_fails("reset vector", "check_image.py")

    def test_vector_outside_the_code(self):
        self.poke(".vectors", 4 * 21, (0x20030001).to_bytes(4, "little"))
        self.assert_fails("SRAM vector 21", "check_image.py")

    def test_forbidden_symbols(self):
        for name, reason in [
            ("__aeabi_dadd", "double"),
            ("__aeabi_f2d", "double"),
            ("__muldf3", "double"),
            ("sqrt", "double"),
            ("malloc", "allocation"),
            ("_sbrk", "allocation"),
            ("_free_r", "allocation"),
            ("printf", "stdio"),
            ("sniprintf", "stdio"),
            ("puts", "stdio"),
            ("_write_r", "stdio"),
            ("exit", "way out"),
            ("longjmp", "way out"),
        ]:
            self.data = bytearray(self.elf.data)
            self.rename("usb_controller_request_service", name)
            self.assert_fails(reason, "check_image.py")

    def test_allowed_symbols(self):
        for name in ("__aeabi_fadd", "__aeabi_idiv", "__aeabi_uldivmod", "sqrtf", "expf", "__ieee754_sqrtf", "memcpy"):
            self.data = bytearray(self.elf.data)
            self.rename("usb_controller_request_service", name)
            self.assertEqual(self.run_check("check_image.py").returncode, 0, name)

    def test_section_that_is_not_placed(self):
        self.rename(".rodata", ".mydata")
        self.assert_fails("section .mydata is unknown", "check_image.py")

    def test_raw_image_of_another_build(self):
        other = pathlib.Path(self.folder.name) / "other.bin"
        other.write_bytes(b"\0" * 1000)
        self.assert_fails("differs", "check_image.py", "--bin", str(other))

    def test_no_elf(self):
        self.data = bytearray(b"MZ" * 100)
        self.assert_fails("not a 32-bit", "check_image.py")

    def test_stack_limit(self):
        self.assert_fails("more than the 100 allowed", "stack_usage.py", "--su-dir", *SU_FOLDERS, "--limit", "100")

    def test_stack_of_functions(self):
        self.assert_fails("the image has no function fit_nothing", "stack_usage.py", "--su-dir", *SU_FOLDERS, "--of", "fit_nothing")
        self.assert_fails("boot_main may need", "stack_usage.py", "--su-dir", *SU_FOLDERS, "--limit", "16", "--of", "boot_main")

    def test_handlers_of_several_priorities_nest(self):
        worst = lambda: int(re.search(r"worst +(\d+)", self.run_check("stack_usage.py", "--su-dir", *SU_FOLDERS).stdout)[1])
        nested = worst()
        at = self.elf.value("rp2040_irq_priorities") - self.elf.section(".rodata").address
        self.poke(".rodata", at, bytes([0x80] * 32))
        self.assertLess(worst(), nested - 2 * 36)

    def test_frames_without_compiler_files(self):
        self.assert_fails("-fstack-usage", "stack_usage.py", "--su-dir", self.folder.name)

    def test_frame_of_variable_size(self):
        (pathlib.Path(self.folder.name) / "a.su").write_text("a.c:1:2:f\t8\tdynamic\n")
        self.assert_fails("variable size", "stack_usage.py", "--su-dir", self.folder.name)

    def test_call_through_a_pointer_that_the_table_lacks(self):
        table = pathlib.Path(self.folder.name) / "table"
        table.write_text("# empty\n")
        self.assert_fails("calls through a pointer", "stack_usage.py", "--su-dir", *SU_FOLDERS, "--indirect", str(table))

    def test_recursion(self):
        table = pathlib.Path(self.folder.name) / "table"
        good = (HERE / "indirect_calls.txt").read_text()
        table.write_text(good.replace("boot_reset: ", "boot_reset: boot_reset "))
        self.assert_fails("recursion: boot_reset -> boot_reset", "stack_usage.py", "--su-dir", *SU_FOLDERS, "--indirect", str(table))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
