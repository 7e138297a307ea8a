"""What the release image keeps in its flash: over restarts, new firmware and power cuts; and the nightly measurement of it in short.

usage: test_store.py --build BUILD --boards BOARDS --node NODE
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("host_tools/python", "host_tools/report/shared", "tests/emulated/storing")]
from fingertip import files  # noqa: E402
from storing import storing  # noqa: E402

OPTIONS = argparse.Namespace()
CALIBRATION, SETTINGS, WRITING, DAMAGED = 1, 2, 4, 8
KEEP = 0x8A


def run(*call):
    done = subprocess.run([str(part) for part in call], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"{call}: {done.stdout}{done.stderr}")
    return done.stdout


class Store(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        cls.scenario = cls.folder / "rest.csv"
        names = ["t_s", "contact", "x_mm", "y_mm", "force_N", "p0_Pa", "sigma_mm", "slip", *(f"s{k}_Pa" for k in range(15))]
        cls.scenario.write_text(f"# fingertip-scenario 1\n{','.join(names)}\n0{',0' * (len(names) - 1)}\n")

    def setUp(self):
        self.flash = self.folder / "flash.bin"
        self.flash.unlink(missing_ok=True)

    def life(self, *commands, seconds=1.0, faults=(), options=()):
        """One run of the image with its flash; its last info packet, and its acknowledgements of keep."""
        script, capture, table = (self.folder / name for name in ("host.txt", "capture.ftr", "capture.csv"))
        faulty = self.folder / "faults.json"
        lines = [
            "0.45 dtr 1",
            *(f"{t} {run(f'{OPTIONS.build}/tests/support/command_frame', *words.split()).strip()}" for t, words in commands),
        ]
        script.write_text("\n".join(lines) + "\n")
        faulty.write_text(json.dumps(list(faults)))
        run(
            OPTIONS.node,
            ROOT / "host_tools/simulation/emulator/main.mjs",
            "--board",
            "pico_mux",
            "--image",
            f"{OPTIONS.boards}/pico_mux/fingertip-pico_mux.bin",
            "--scenario",
            self.scenario,
            "--host-script",
            script,
            "--capture",
            capture,
            "--faults",
            faulty,
            "--seconds",
            seconds,
            "--flash",
            self.flash,
            "--fast-enumeration",
            *options,
        )
        run(self.tool, "replay", capture, "--to-csv", table, "--overwrite")
        recording = files.read_recording(table)
        results = [int(f["result"]) for kind, f in recording.packets if kind == "ack" and int(f["command"]) == KEEP]
        metadata = {}
        for line in table.read_text().splitlines():
            key, separator, value = line.removeprefix("# ").partition(": ")
            if line.startswith("# ") and separator:
                metadata[key] = value
        return metadata, results

    @property
    def tool(self):
        return f"{OPTIONS.build}/host_tools/tool/cli/fingertip"

    STATE = ((0.9, "info"), (0.91, "stream contact"))

    def test_settings_are_kept_until_they_are_forgotten(self):
        for slow in ((), ("--slow-flash",)):
            with self.subTest(slow=slow):
                self.setUp()
                info, results = self.life(
                    (0.5, "osr 512"),
                    (0.51, "prior 3.1:0.4"),
                    (0.52, "limit 0.8"),
                    (0.53, "keep"),
                    (1.2, "info"),
                    (1.21, "stream contact"),
                    seconds=1.3,
                    options=slow,
                )
                self.assertEqual((results, info["stored"]), ([0], str(SETTINGS)))
                info, _ = self.life(*self.STATE)
                self.assertEqual(
                    (info["osr"], info["prior_sigma_mm"], info["prior_width_mm"], info["location_limit_mm"], info["stored"]),
                    ("512", "3.1", "0.4", "0.8", str(SETTINGS)),
                )
                info, results = self.life((0.5, "forget"), *self.STATE)
                self.assertEqual((results, info["osr"], info["stored"]), ([0], "512", "0"))
                self.assertEqual(self.life(*self.STATE)[0]["osr"], "1024")

    def test_power_lost_while_storing(self):
        """At many moments of one update; both answers occur."""
        found = set()
        self.life((0.5, "osr 512"), (0.53, "keep"), *self.STATE)
        kept = self.flash.read_bytes()
        for cut_ms in (0.5, 3, 20, 46, 48, 60, 90, 150):
            self.flash.write_bytes(kept)
            at_s = 0.5315 + cut_ms / 1e3
            self.life(
                (0.5, "osr 256"),
                (0.53, "keep"),
                (1.2, "stream contact"),
                seconds=1.3,
                faults=[{"type": "power_cut", "from_s": at_s, "to_s": at_s + 0.01}],
            )
            info, _ = self.life(*self.STATE)
            self.assertIn(info["osr"], ("256", "512"), cut_ms)
            self.assertEqual(info["stored"], str(SETTINGS))
            found.add(info["osr"])
        self.assertEqual(found, {"256", "512"})

    def test_the_power_is_cut_at_each_step(self):
        """The nightly measurement, in short."""
        found = storing(OPTIONS.build, OPTIONS.boards, updates=80, commands=3)
        self.assertEqual((found["flash_lost"], found["flash_frames_skipped"]), (0, 0))
        power = found["flash"]["power"]
        self.assertEqual(power["updates"], 80)
        self.assertGreater(power["cuts"], 50)
        self.assertGreater(power["cuts_in_mending"], 5)
        self.assertTrue(10 < power["brought"] < power["cuts"] - 10, power)
        quiet, quickly, slowly = (found["flash"][name] for name in ("quiet", "storing", "storing_slowly"))
        self.assertEqual((quiet["stored"], quickly["stored"], slowly["stored"]), (0, 3, 3))
        # None is lost or skipped; the last may still be on its way at the end.
        self.assertLessEqual(abs(quiet["frames"] - quickly["frames"]), 1)
        for run_of in (quickly, slowly):
            self.assertLess(abs(run_of["latency_us"]["median"] - quiet["latency_us"]["median"]), 3)
            # The main loop looks after the store beside the frames, for a load, and for the second processor. 48 us are measured.
            self.assertLess(run_of["latency_us"]["p99"] - quiet["latency_us"]["p99"], 54)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name in ("build", "boards", "node"):
        parser.add_argument(f"--{name}", required=True)
    OPTIONS, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest])
