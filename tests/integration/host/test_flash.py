"""`fingertip flash` against a fake loader: usage test_flash.py FINGERTIP FAKE_DEVICE TIME_KEEPER [unittest arguments]."""

import os
import pathlib
import subprocess
import sys
import unittest

from cli_case import CliTest, ROOT


class Flash(CliTest):
    """Images as the build makes them, a fake loader's drive, and a fake device that comes back."""

    def setUp(self):
        super().setUp()
        self.environment["FINGERTIP_PORT"] = self.port
        self.volume = os.path.join(self.folder, "RPI-RP2")
        self.image = self.uf2()

    def uf2(self, board="pico_mux", git="abcdef012345", name="new.uf2"):
        """An image with a second boot stage, an identity and some code, by the build's own scripts."""
        cmake = ROOT / "cmake"
        path = os.path.join(self.folder, name)
        pathlib.Path(path + ".code").write_bytes(bytes(range(200)))
        subprocess.run([sys.executable, cmake / "boot2_checksum.py", path + ".code", path + ".boot2"], check=True)
        identity = f"fingertip-version=9.8.7 fingertip-git={git}\0fingertip-board={board}\0".encode()
        flash = pathlib.Path(path + ".boot2").read_bytes() + bytes(1000) + identity + bytes(range(256)) * 8
        pathlib.Path(path + ".bin").write_bytes(flash)
        subprocess.run([sys.executable, cmake / "bin2uf2.py", path + ".bin", path], check=True)
        return path

    def make_volume(self, board="RPI-RP2"):
        os.mkdir(self.volume)
        with open(os.path.join(self.volume, "INFO_UF2.TXT"), "w", encoding="ascii") as file:
            file.write(f"UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: {board}\n")

    def assert_written(self):
        self.assertEqual(pathlib.Path(self.volume, "fingertip.uf2").read_bytes(), pathlib.Path(self.image).read_bytes())

    def flash(self, *first, after=("board=pico_mux", "git=abcdef012345", "firmware=9.8.7"), status=0):
        """Runs flash against a device with these options, that ends in its loader, and comes back with those."""
        with self.device("loader=1", *first) as device:
            process = self.start("flash", self.image, "--volume", self.volume)
            self.world.until(lambda: device.poll() is not None or process.poll() is not None)
            if process.poll() is None:
                self.make_volume()
                written = os.path.join(self.volume, "fingertip.uf2")
                size = os.path.getsize(self.image)
                self.world.until(lambda: os.path.exists(written) and os.path.getsize(written) == size)
                self.assert_written()
                os.unlink(os.path.join(self.volume, "INFO_UF2.TXT"))
                with self.device(*after):
                    out, err = process.communicate()
            else:
                out, err = process.communicate()
        self.assertEqual(process.returncode, status, err)
        return out, err

    def test_by_the_command(self):
        out, err = self.flash()
        self.assertEqual(out, "fingertip E660583883265A2C: firmware 9.8.7 abcdef012345, board pico_mux\n")
        self.assertEqual(err, "writing 9.8.7 abcdef012345 for pico_mux\n")

    def test_in_the_loader_already(self):
        self.make_volume()
        with self.device("board=pico_mux", "git=abcdef012345", "firmware=9.8.7"):
            self.assertIn("firmware 9.8.7", self.run_cli("flash", self.image, "--volume", self.volume)[0])

    def test_back_before_the_rule_is_installed(self):
        self.make_volume()
        os.chmod(self.volume, 0o777)
        with self.device():
            err = self.without_permission("flash", self.image, "--volume", self.volume, status=0)
        said = f"written, and it came back; its version was not read: {self.port}: {self.RULE}\n"
        self.assertEqual(err, f"writing 9.8.7 abcdef012345 for pico_mux\n{said}")
        self.assert_written()

    def test_another_version_came_back(self):
        err = self.flash(after=(), status=1)[1]
        self.assertIn("came back with firmware 1.20.3 0123456789ab+ instead of 9.8.7 abcdef012345; unplug the Pico, hold its BOOTSEL", err)

    def test_another_board_is_refused_before_anything_happens(self):
        err = self.flash("board=pico_parallel", status=1)[1]
        self.assertIn("for board pico_mux, but fingertip E660583883265A2C is a pico_parallel; give fingertip-pico_parallel.uf2", err)
        self.assertIn("is simulated, and takes no firmware", self.flash("board=native", status=1)[1])
        self.assertFalse(os.path.exists(self.volume))

    def test_nothing_there_says_what_to_press(self):
        del self.environment["FINGERTIP_PORT"]
        self.assertIn("unplug the Pico, hold its BOOTSEL button while plugging it in", self.error("flash", self.image))
        self.make_volume(board="RP2350")
        err = self.error("flash", self.image, "--volume", self.volume)
        self.assertIn("another chip (RP2350); there is no firmware for a Pico 2 yet, take a Pico", err)

    def test_a_folder_that_is_no_boot_volume_is_refused_before_anything_happens(self):
        with self.device("loader=1") as device:
            why = "no RP2040 boot volume (no INFO_UF2.TXT); leave out --volume, or give that of the drive RPI-RP2"
            self.assertEqual(self.error("flash", self.image, "--volume", self.folder), f"fingertip: {self.folder}: {why}\n")
            self.assertIsNone(device.poll())
        self.assertFalse(os.path.exists(os.path.join(self.folder, "fingertip.uf2")))

    def test_damaged_and_foreign_images_are_refused(self):
        good = pathlib.Path(self.image).read_bytes()

        def with_word(block, word, value):
            at = 512 * block + 4 * word
            return good[:at] + value.to_bytes(4, "little") + good[at + 4 :]

        path = os.path.join(self.folder, "bad.uf2")
        for message, content in (
            ("no UF2 file", b""),
            ("no UF2 file", b"\x7fELF" + good),
            ("cut off", good[:-1]),
            ("numbered", good[:-512]),
            ("block 1: numbered 2", good[:512] + good[1024:1536] + good[512:1024] + good[1536:]),
            ("block 1: no UF2 block", with_word(1, 1, 0)),
            ("block 2: no UF2 block", with_word(2, 127, 0)),
            ("for another chip (UF2 family 0xe48bff59)", with_word(0, 7, 0xE48BFF59)),
            ("for another chip", with_word(0, 2, 0)),
            ("not the next page", with_word(1, 3, 0x10000000)),
            ("not the next page", with_word(0, 4, 476)),
            ("the boot ROM would refuse", with_word(0, 10, 1)),
            ("the CRC of the image differs", with_word(3, 30, 0x12345678)),
            ("no Fingertip firmware", good.replace(b"fingertip-board", b"fingertip-bored")),
        ):
            pathlib.Path(path).write_bytes(content)
            self.assertIn(message, self.error("flash", path))
        self.assertIn("No such file", self.error("flash", self.folder + "/none.uf2"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
