"""A third board is a folder: beside nothing else that is new, it is built, emulated, examined and measured by its descriptor. It has the largest pad.

usage: test_board.py --fingertip TOOL --command_frame PROGRAM --node NODE
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

from emulation import ROOT, Run, emulate, main, write_scenario

TOOLS = argparse.Namespace()
PATTERN, THIRD = "pico_mux", "pico_third"
# No pin of it is as on the board that it is a copy of.
SENSORS = 36
WIRING = {"pin_sda": 12, "pin_scl": 13, "pin_mux_reset_0": 14, "sensor_count": SENSORS, "sensors_of_strip": 6}
EXAMINER = """
#include "tool/doctor/wiring.hpp"
#include <iostream>
int main() {
  const auto wiring = fingertip::Wiring::of_board("pico_third");
  std::cout << wiring->place_text(13) << '\\n' << wiring->check_multiplexer(2) << '\\n' << wiring->check_all() << '\\n' << wiring->overhead_us << '\\n';
}
"""


def run(*command, check=True):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if check and done.returncode != 0:
        raise AssertionError(f"{command[0]} ended with {done.returncode}:\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done


class ThirdBoard(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.tree = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory())) / "tree"
        shutil.copytree(ROOT, cls.tree, symlinks=True, ignore=shutil.ignore_patterns("build", "node_modules", ".git"))
        emulator = "host_tools/simulation/emulator"
        (cls.tree / emulator / "node_modules").symlink_to(ROOT / emulator / "node_modules")
        board = cls.tree / "boards" / THIRD
        shutil.copytree(cls.tree / "boards" / PATTERN, board)
        for path in [*board.glob("*.[ch]"), board / "CMakeLists.txt"]:
            path.write_text(path.read_text().replace(PATTERN, THIRD))
        descriptor = json.loads((board / "board.json").read_text())
        descriptor["pad"], descriptor["wiring"] = "6x6", descriptor["wiring"] | WIRING
        descriptor["overhead_us"] = 1000
        (board / "board.json").write_text(json.dumps(descriptor))
        cls.build = cls.tree / "build" / THIRD
        toolchain = cls.tree / "cmake/toolchain-arm-none-eabi.cmake"
        settings = (
            "-DCMAKE_BUILD_TYPE=Release",
            "-DCMAKE_C_FLAGS_RELEASE=-Os",  # not debugged
            f"-DCMAKE_TOOLCHAIN_FILE={toolchain}",
            f"-DFINGERTIP_BOARD={THIRD}",
            "-DFINGERTIP_PICO_W=ON",
        )
        run("cmake", "-G", "Ninja", "-S", cls.tree, "-B", cls.build, *settings)

    def test_it_is_built_and_runs_on_its_own_pins(self):
        run("cmake", "--build", self.build, "--target", f"fingertip-{THIRD}")
        emulator, image = self.tree / "host_tools/simulation/emulator/main.mjs", self.build / f"fingertip-{THIRD}.bin"
        rest, commands = (
            write_scenario(self.tree / "build/rest.csv", sensors=SENSORS),
            [(0.46, "info"), (0.47, "stream", "contact,raw,health")],
        )
        done = Run(TOOLS, self.build, "third", THIRD, rest, 0.8, commands, emulator=emulator, image=image)
        self.assertEqual(done.report["warnings"], [])
        self.assertEqual(done.recording.metadata["board"], THIRD)
        self.assertIn((1 << SENSORS) - 1, done.recording["valid"])
        capture = {"capture": self.build / "none.ftr", "host_script": done.path("script")}
        rest = write_scenario(rest)
        emulate(TOOLS, emulator, board=PATTERN, image=image, scenario=rest, seconds=0.8, **capture)  # whose pins are others
        bench = f"import {{ ImageBench }} from '{self.tree}/tests/emulated/harness/image_bench.mjs'; const b = new ImageBench("
        tools = {"fingertip": str(TOOLS.fingertip), "command_frame": str(TOOLS.command_frame)}
        bench += f"'{self.tree}/build', {json.dumps(tools)}, '{THIRD}'); b.stream(); const p = b.machine.chip.pins; b.end(); "
        driven = run(TOOLS.node, "--input-type=module", "-e", bench + "console.log((p.high | p.low) >>> 23 & 1)")
        self.assertEqual(driven.stdout, "0\n")  # of a Pico W
        self.assertIn("is empty", run(TOOLS.fingertip, "replay", capture["capture"], check=False).stderr)

    def test_the_host_builds_its_image_and_knows_its_pins(self):
        host = self.tree / "build/host"
        run("cmake", "-G", "Ninja", "-S", self.tree, "-B", host, "-DBUILD_TESTING=OFF")
        self.assertIn(f"image_{THIRD}:", run("cmake", "--build", host, "--target", "help").stdout)
        source, program = host / "examiner.cpp", host / "examiner"
        source.write_text(EXAMINER)
        folders = (f"-I{self.tree}/host_tools", f"-I{host}/boards")
        run("g++", "-std=c++17", *folders, source, self.tree / "host_tools/tool/doctor/wiring.cpp", "-o", program)
        place, multiplexer, everything, overhead_us = run(program).stdout.splitlines()
        self.assertEqual(place, "strip 2, channel 1 of multiplexer 0x72")
        self.assertIn("RESET on GP16 (pin 21)", multiplexer)
        self.assertIn("SDA on GP12 (pin 16), SCL on GP13 (pin 17)", everything)
        self.assertEqual(overhead_us, "1000")

    def test_whoever_lists_boards_lists_it(self):
        boards = ["pico_mux", "pico_parallel", THIRD]
        listed = run(sys.executable, self.tree / "host_tools/report/shared/boards.py").stdout.split()
        self.assertEqual(listed, ["pico_parallel", THIRD, "pico_mux"])
        for program in ("main.mjs", "lockstep.mjs"):
            self.assertIn(" or ".join(boards), run(TOOLS.node, self.tree / "host_tools/simulation/emulator" / program, "--help").stdout)
        where = ("-S", self.tree, "-B", self.tree / "build/toaster")
        refused = run("cmake", "-G", "Ninja", *where, "-DFINGERTIP_BOARD=toaster", check=False)
        self.assertIn(";".join(["native", *boards]), "".join(refused.stderr.split()))


if __name__ == "__main__":
    main(TOOLS, "fingertip", "command_frame", "node")
