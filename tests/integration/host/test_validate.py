"""fingertip validate, live on a simulated pad and from recordings, on simulated time.

usage: test_validate.py FINGERTIP SIMULATE TIME_KEEPER NEWCOMER_VALIDATED TABLES [unittest arguments]
"""
import getpass
import json
import math
import os
import re
import signal
import socket
import statistics
import subprocess
import sys
import unittest

from cli_case import FAKE_DEVICE as SIMULATE
from cli_case import CliTest

PAD, TABLES = (os.path.abspath(path) for path in sys.argv[4:6])
SERIAL = "00000000000CE110"


class ValidateTest(CliTest):
    def setUp(self):
        super().setUp()
        self.card, self.figures, self.truth = (os.path.join(self.folder, name) for name in ("card.html", "card.json", "truth.json"))

    def recorded(self, *options):
        """The truth; the recording is in self.csv."""
        subprocess.run([PAD, "-o", self.csv, "--truth", self.truth, "--cache", TABLES, "--overwrite", *options], check=True)
        with open(self.truth, encoding="utf-8") as file:
            return json.load(file)

    def carded(self, *options):
        """What the card says, and what was printed."""
        out, err = self.run_cli("validate", "--from", self.csv, "-o", self.card, "--figures", self.figures, "--overwrite", *options)
        self.assertEqual(err, "")
        with open(self.figures, encoding="utf-8") as file:
            return json.load(file), out

    def read(self, path):
        with open(path, encoding="utf-8") as file:
            return file.read()


class Live(ValidateTest):
    def test_from_the_first_step_to_the_card(self):
        process = self.world.start([SIMULATE, "--cache", TABLES, "--validate", "--seed", "3"], env=self.environment)
        self.assertTrue(process.readline().startswith("ready: "))
        before = self.run_cli("info", "--port", "sim:")[0]
        tool = self.start("validate", "--port", "sim:", "--weight", "300", "--record", self.csv, "-o", self.card)
        out, err = tool.communicate(limit_s=600)
        self.assertEqual((tool.returncode, err), (0, ""))
        after = self.run_cli("info", "--port", "sim:")[0]
        rate = re.compile(r"(?m)^rate_mHz .*$")
        self.assertEqual(rate.findall(after), rate.findall(before))
        process.send_signal(signal.SIGINT)
        process.communicate()
        for words in ("leave it alone", "set the weight down on mark 1, turn 1 of 2", "set the weight down on mark 23, turn 2 of 2", "lift it",
                      "location off by, median", "nothing is wrong that this validation can see"):
            self.assertIn(words, out)
        # the recording holds what was measured, and the card can be made from it again
        recording = self.read(self.csv)
        self.assertEqual(recording.count("# event: validate: press "), 46)
        for private in (SERIAL, socket.gethostname(), self.folder, "sim", "port", "started"):
            self.assertNotIn(private, re.sub("(?m)^[^#].*$", "", recording), private)
        if len(getpass.getuser()) > 4:
            self.assertNotIn(getpass.getuser(), recording)
        live = self.read(self.card)
        figures, _ = self.carded()
        self.assertEqual(self.read(self.card), live)
        self.assertNotIn(SERIAL, live)
        self.assertLess(figures["figures"]["hand_mm"], 0.5)


class FromARecording(ValidateTest):
    def test_location_and_gains_are_what_is_true(self):
        truth = self.recorded("--seed", "31")
        said, out = self.carded()
        off_mm = [math.hypot(one["x_mm"] - press["x_mm"], one["y_mm"] - press["y_mm"]) for one, press in zip(said["presses"], truth["presses"])]
        self.assertEqual(len(off_mm), 46)
        self.assertAlmostEqual(said["figures"]["location_error_mm"] / statistics.median(off_mm), 1, delta=0.25)
        errors = [math.log(gain / true) for gain, true in zip(said["gain"], truth["gains"])]
        self.assertLess(statistics.pstdev(errors), 0.025)
        self.assertGreater(statistics.pstdev(map(math.log, truth["gains"])), 0.06)
        self.assertEqual(said["findings"], [])
        self.assertIn("nothing is wrong", out)
        page = self.read(self.card)
        self.assertEqual(page.count("<figure>"), 6)
        self.assertNotRegex(page, r"<script|https?://|<link|<img")
        self.assertGreater(len(re.findall(r"<td class=\"n\">[0-9.-]+ to ", page)), 15)  # the twin's figures stand beside

    def test_faults_are_found_with_their_sensors(self):
        # dead: where the presses beside it are hardly known; loose: along an edge, at a corner, at a corner where the presses follow it; thin:
        # where presses follow a sensor that is not loose; drift: beside a sensor that is odd by the same each time
        for fault, seed in (("dead_sensor", 32), ("dead_sensor", 33), ("dead_sensor", 953), ("loose_sensor", 32), ("loose_sensor", 38),
                            ("loose_sensor", 890), ("tilted_skin", 32), ("thin_skin", 852), ("drift", 945), ("wrong_weight", 32), ("swapped_wires", 32)):
            with self.subTest(fault=fault, seed=seed):
                truth = self.recorded("--fault", fault, "--seed", str(seed))
                said, out = self.carded()
                self.assertEqual([(one["finding"], one["sensors"]) for one in said["findings"]], [(fault, truth["faulty"])])
                self.assertIn(f"{fault}: ", out)
                self.assertIn('class="find"', self.read(self.card))

    def test_the_same_recording_makes_the_same_card(self):
        self.recorded("--seed", "34", "--calibrated")
        self.carded()
        first = self.read(self.card)
        self.carded()
        self.assertEqual(self.read(self.card), first)
        self.assertIn("calibrated", first)

    def test_what_is_no_validation_is_refused(self):
        self.recorded("--seed", "35")
        lines = self.read(self.csv).splitlines(keepends=True)
        for kept, words in ((lambda line: "validate:" not in line, "holds no validation; record one with `fingertip validate`"),
                            (lambda line: not re.search("press mark=([6-9]|[12][0-9])", line), "holds presses at 5 marks, and a card needs 6")):
            with open(self.csv, "w", encoding="utf-8") as file:
                file.writelines(filter(kept, lines))
            self.assertIn(words, self.error("validate", "--from", self.csv, "-o", self.card))
            self.assertFalse(os.path.exists(self.card))


class Template(ValidateTest):
    def test_both_files_have_the_marks_at_1_to_1(self):
        svg, pdf = (os.path.join(self.folder, f"sheet.{kind}") for kind in ("svg", "pdf"))
        for path in (svg, pdf):
            self.assertIn("measure its line of 50 mm", self.run_cli("validate", "--template", path)[0])
        text = self.read(svg)
        width_mm, _, view = re.search(r'width="([0-9.]+)mm" height="([0-9.]+)mm" viewBox="([^"]*)"', text).groups()
        self.assertEqual(float(width_mm), float(view.split()[2]))  # a unit is a millimetre
        circles = [(float(x), -float(y)) for x, y in re.findall(r'<circle cx="([^"]*)" cy="([^"]*)"', text)]
        self.assertEqual(len(set(circles)), 23)
        self.assertIn('d="M-25.00 26.00L25.00 26.00"', text)
        with open(pdf, "rb") as file:
            page = file.read()
        # what the table of objects says is where they are
        start = int(re.search(rb"startxref\n(\d+)\n%%EOF\n$", page).group(1))
        self.assertTrue(page[start:].startswith(b"xref\n0 6\n"))
        for number, place in enumerate(re.findall(rb"(\d{10}) 00000 n ", page), 1):
            self.assertTrue(page[int(place):].startswith(b"%d 0 obj\n" % number))
        point_mm = 25.4 / 72
        drawn = [(round(float(x) * point_mm - 105 - 2, 1), round(float(y) * point_mm - 148.5, 1))
                 for x, y in re.findall(rb"(?m)^([0-9.]+) ([0-9.]+) m [^l\n]* c S$", page)]
        self.assertEqual(sorted(drawn), sorted(circles))

    def test_usage(self):
        for options, words in (([], "give -o CARD.html, or --template"), (["-o", "c.html"], "give --weight GRAMS, or --from"),
                               (["-o", "c.html", "--weight", "300"], "give --record FILE.csv"), (["--template", "a.pdf", "--weight", "300"], "excludes")):
            self.assertIn(words, self.error("validate", *options, status=2))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[6:]], verbosity=2)
