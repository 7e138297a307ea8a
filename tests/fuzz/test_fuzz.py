"""fuzz.py with stand-ins for the targets: what it feeds, keeps and says."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import fuzz  # noqa: E402

PROGRAM = """#!/usr/bin/python3
import os, pathlib, struct, sys
options = dict(word.split("=", 1) for word in sys.argv[1:] if "=" in word)
given = [pathlib.Path(word) for word in sys.argv[1:] if "=" not in word]
files = given if given[0].is_file() else list(given[1].iterdir())
pathlib.Path(os.environ["FINGERTIP_FUZZ_COUNT"]).write_bytes(struct.pack("<QQ", 7, sum(len(file.read_bytes()) for file in files)))
if files is not given:
    print("#7 DONE cov: 42 ft: 1", file=sys.stderr)
"""
CRASHES = """
pathlib.Path(options["-artifact_prefix"] + "crash-1234").write_bytes(b"wrong")
print("%s", file=sys.stderr)
sys.exit(77)
"""


class FuzzTest(unittest.TestCase):
    def setUp(self):
        self.build = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (self.build / "tests/fuzz").mkdir(parents=True)

    def target(self, name, more="", options="max_len = 100"):
        program = self.build / f"tests/fuzz/fuzz_{name}"
        program.write_text(PROGRAM + more)
        program.chmod(0o755)
        program.with_name(program.name + ".options").write_text(f"[libfuzzer]\n{options}\n")

    def fuzz(self, *options):
        return subprocess.run(
            [sys.executable, HERE / "fuzz.py", "--build", self.build, "--json", self.build / "found.json", *options],
            capture_output=True,
            text=True,
            timeout=60,
        )

    def found(self):
        return json.loads((self.build / "found.json").read_text())

    def test_all_targets_run_and_are_added_up(self):
        self.target("usb")
        self.target("wire")
        done = self.fuzz("--runs", "300")
        self.assertEqual(done.returncode, 0, done.stderr)
        found = self.found()
        self.assertEqual([row["target"] for row in found["fuzz_targets"]], ["usb", "wire"])
        self.assertNotIn("edges", done.stdout)
        self.assertEqual(found["fuzz_bytes"], sum(row["bytes"] for row in found["fuzz_targets"]))
        vectors = fuzz.vectors().values()
        self.assertGreaterEqual(len(vectors), 20)
        self.assertGreater(found["fuzz_targets"][1]["bytes"], sum(len(frame) for _, frame in vectors))
        self.assertFalse((self.build / "findings").exists())

    def test_a_finding_is_kept_told_and_fails(self):
        for kind, words in (
            ("crashes", "SUMMARY: libFuzzer: deadly signal"),
            ("sanitizer_findings", "a.c:1: runtime error: overflow"),
            ("sanitizer_findings", "ERROR: AddressSanitizer: heap-use-after-free"),
        ):
            for how in (("--seconds", "2"), ("--runs", "7")):
                with self.subTest(words, how=how):
                    self.finding(kind, words, how)

    def finding(self, kind, words, how):
        self.target("usb", CRASHES % words)
        self.target("wire")
        done = self.fuzz(*how)
        self.assertEqual(done.returncode, 1)
        found = self.found()
        self.assertEqual(
            {name: found[name] for name in ("crashes", "sanitizer_findings")}, {"crashes": 0, "sanitizer_findings": 0, kind: 1}
        )
        (kept,) = (self.build / "findings").iterdir()
        self.assertEqual(kept.read_bytes(), b"wrong")
        self.assertIn(words, done.stderr)
        self.assertIn(f"to do it again: {self.build / 'tests/fuzz/fuzz_usb'} {kept}", done.stderr)
        self.assertIn("wire", done.stdout)
        kept.unlink()

    def test_time_tells_how_far_it_came(self):
        self.target("usb")
        self.assertIn("42 edges", self.fuzz("--seconds", "1").stdout)
        self.assertEqual([row["edges"] for row in self.found()["fuzz_targets"]], [42])

    def test_hours_keep_what_is_new(self):
        self.target("usb", '(given[0] / "new").write_bytes(b"x")')
        self.assertEqual(self.fuzz("--hours", "0.0005").returncode, 0)
        self.assertEqual((self.build / "corpus/usb/new").read_bytes(), b"x")

    def test_a_walk_is_the_same_each_time(self):
        seeds = [b"abc", b"", bytes(range(100))]
        inputs = list(fuzz.walk(seeds, 1000, 50, 1))
        self.assertEqual(inputs, list(fuzz.walk(seeds, 1000, 50, 1)))
        self.assertNotEqual(inputs, list(fuzz.walk(seeds, 1000, 50, 2)))
        self.assertEqual(inputs[:3], [data[:50] for data in seeds])
        self.assertGreater(len(set(inputs)), 700)
        self.assertEqual(max(map(len, inputs)), 50)

    def test_an_interrupted_target_is_no_finding(self):
        self.target("usb", f"sys.exit({fuzz.INTERRUPTED})")
        self.assertEqual(self.fuzz("--runs", "1").returncode, 0)


if __name__ == "__main__":
    unittest.main()
