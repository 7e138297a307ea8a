"""`fingertip record` and `replay` against a fake device: usage test_recording.py FINGERTIP FAKE_DEVICE TIME_KEEPER [unittest arguments]."""

import os
import pathlib
import signal
import sys
import unittest

from cli_case import CliTest
from fingertip import files
from small_disk import disk_of


class Recording(CliTest):
    def test_seconds(self):
        with self.device():
            self.run_cli("record", self.csv, "--port", self.port, "--seconds", "1", "--raw-bytes", self.ftr, "--overwrite")
        rows, comments = self.rows()
        # a frame every 5 ms, and the loop looks every 20
        self.assertAlmostEqual((int(rows[-1]["t_us"]) - int(rows[0]["t_us"])) / 1e6, 1.01, delta=0.02)
        self.assertIn("# serial: E660583883265A2C", comments)
        self.assertRegex(comments[-1], r"^# end: reason=seconds frames=\d+ .* dropped_packets=0 .*crc_errors=0")
        self.assertEqual([int(row["frame"]) for row in rows], list(range(1, len(rows) + 1)))
        self.assertTrue(all(row["x_mm"] and row["s14_Pa"] and row["tare0_Pa"] for row in rows[:-1]))
        converted = os.path.join(self.folder, "c.csv")
        self.run_cli("convert", self.ftr, converted)
        again, _ = self.rows(converted)
        self.assertEqual(again[: len(rows) - 1], rows[:-1])
        self.assertIn(" 0 packets dropped", self.run_cli("replay", self.csv, "--speed", "max", "--from", "0.5")[0])

    def test_the_same_twice_is_the_same_to_the_byte(self):
        def recorded():
            with self.device("drop=20", "vanish=60,700"):
                process = self.start("record", self.csv, "--port", self.port, "--overwrite")
                self.world.sleep(3)
                self.interrupt(process)
            self.world.close()
            self.begin_world()
            return pathlib.Path(self.csv).read_bytes()

        first = recorded()
        self.assertIn(b"# event: back", first)
        self.assertTrue(first == recorded())

    def test_interrupt_ends_cleanly(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.device():
                process = self.start("record", self.csv, "--port", self.port)
                self.world.until(lambda: os.path.exists(self.csv) and len(self.rows()[0]) > 20)
                process.send_signal(number)
                _, err = process.communicate()
            self.assertEqual(process.returncode, 0)
            self.assertRegex(err, r"r\.csv: \d+ frames in .* 0 packets dropped")
            _, comments = self.rows()
            os.unlink(self.csv)
            self.assertIn("reason=interrupted", comments[-1])
            # the stop was acknowledged: command 128 is stream
            self.assertTrue(any(c.startswith("# packet: ack") and "command=128" in c for c in comments[-2:]), comments[-2:])

    def test_losses_and_damage_are_counted(self):
        with self.device("drop=20", "flip=25", "frames=100"):
            self.run_cli("record", self.csv, "--port", self.port, "--until-gone")
        rows, comments = self.rows()
        # Frames 20, 40, 60 and 80 lose two packets each, and 25, 50 and 75 a damaged one; 100 has no successor to tell.
        self.assertRegex(comments[-1], "reason=gone frames=95 .*dropped_packets=11 .*crc_errors=3 format_errors=0")
        self.assertEqual(sum(row["x_mm"] == "" for row in rows), 3)

    def test_a_vanished_device_is_waited_for(self):
        with self.device("vanish=100,700", "frames=150"):
            self.world.until(lambda: os.path.lexists(self.port))
            process = self.start("record", self.csv, "--port", self.port)
            self.world.until(lambda: os.path.exists(self.csv) and any("back" in c for c in self.rows()[1]))
            self.world.until(lambda: len(self.rows()[0]) >= 220)
            _, err = self.interrupt(process)
        rows, comments = self.rows()
        self.assertTrue(any(c.startswith("# event: gone") for c in comments))
        self.assertIn("dropped_packets=0", comments[-1])
        frames = [int(row["frame"]) for row in rows]
        restart = frames.index(1, 1)
        self.assertEqual(frames[:restart], list(range(1, 101)))
        self.assertEqual(frames[restart:], list(range(1, len(frames) - restart + 1)))
        t_us = [int(row["t_us"]) for row in rows]
        seconds = (t_us[restart - 1] - t_us[0] + t_us[-1] - t_us[restart]) / 1e6
        self.assertIn(f" seconds={seconds:.6f} ", comments[-1])
        self.assertRegex(self.run_cli("replay", self.csv, "--speed", "max")[0], " 0 packets dropped")

    def test_existing_files_are_kept(self):
        pathlib.Path(self.csv).write_text("precious")
        self.assertIn("exists already", self.error("record", self.csv))
        self.assertIn("exists already", self.error("monitor", "--record", self.csv))
        self.assertIn("exists already", self.error("record", self.path("2.csv"), "--raw-bytes", self.csv))
        self.assertIn("no such port", self.error("record", self.csv, "--port", self.port, "--overwrite"))
        heard = os.path.join(self.folder, "heard")
        with self.device("mute=1", f"heard={heard}"):
            process = self.start("record", self.path("2.csv"), "--raw-bytes", self.csv, "--port", self.port, "--overwrite")
            self.world.until(lambda: os.path.exists(heard))
            self.interrupt(process, status=1)
        self.assertEqual(pathlib.Path(self.csv).read_text(), "precious")

    def test_one_file_cannot_be_two(self):
        self.assertIn("--every-row is for MCAP files", self.error("convert", self.csv, self.ftr, "--every-row", status=2))
        for overwrite in ([], ["--overwrite"]):
            self.assertIn("give --raw-bytes another name", self.error("record", self.csv, "--raw-bytes", self.csv, *overwrite))
        self.assertFalse(os.path.exists(self.csv))

    def test_a_wrong_place_is_found_before_a_port_is_opened(self):
        for option in ([], ["--overwrite"]):
            self.assertIn("No such file or directory; choose another place", self.error("record", self.folder + "/no/r.csv", *option))
            self.assertIn("is a folder; give the name of a file in it", self.error("record", self.folder, *option))
            self.assertIn("must end with .csv or .mcap", self.error("record", self.folder + "/r.mcpa", *option, status=2))
            self.assertIn("is a folder", self.error("record", self.csv, "--raw-bytes", self.folder + "/", *option))
        for words in (["record"], ["monitor", "--record"], ["record", self.csv, "--raw-bytes"], ["grasp", "--gripper", "2f85", "-o"]):
            self.assertIn("takes a text, and this one is empty", self.error(*words, "", status=2))
        self.assertIn("excludes", self.error("record", self.csv, "--all", "--device", "AAAA", status=2))


class LiveData(CliTest):
    """record -: the recording for another program, as it happens."""

    def read_row(self, process):
        while (line := process.stdout.readline()) and not line[0].isdigit():
            pass
        return line.split(",")

    def test_the_last_row_does_not_wait_for_the_next(self):
        with self.device("stall=50"):
            process = self.start("record", "-", "--port", self.port, cwd=self.folder)
            for frame in range(1, 51):
                self.assertEqual(int(self.read_row(process)[1]), frame)
            rest, err = self.interrupt(process)
        self.assertIn("# end: reason=interrupted frames=50 ", rest)
        self.assertRegex(err.splitlines()[-1], r"^50 frames in .* 0 packets dropped")
        self.assertEqual(os.listdir(self.folder), [])

    def test_what_comes_out_is_a_recording(self):
        with self.device("frames=60"):
            out, err = self.run_cli("record", "-", "--port", self.port, "--until-gone", "--raw-bytes", self.ftr)
        pathlib.Path(self.csv).write_text(out, encoding="utf-8")
        self.assertEqual(len(files.read_recording(self.csv)["frame"]), 60)
        self.assertRegex(err, r"^60 frames in .*\n$")
        self.assertIn(" 60 frames in", self.run_cli("replay", self.csv, "--speed", "max")[0])
        self.assertIn(" 60 frames in", self.run_cli("replay", self.ftr, "--speed", "max")[0])

    def test_a_reader_that_leaves_ends_it(self):
        with self.device():
            process = self.start("record", "-", "--port", self.port)
            self.read_row(process)
            process.stdout.close()
            self.assertEqual(process.wait(), 0)
            self.assertRegex(process.stderr.read(), r"^\d+ frames in")
            process.stderr.close()
            self.assertIn("E660583883265A2C", self.run_cli("info", "--port", self.port)[0])

    def test_a_reader_that_does_not_read_keeps_nobody_from_ending_it(self):
        with self.device("rate=2000") as device:
            process = self.start("record", "-", "--port", self.port)
            self.read_row(process)
            self.world.sleep(1.5)  # a pipe holds 64 KiB, a hundred rows
            process.send_signal(signal.SIGTERM)
            try:
                self.assertEqual(process.wait(), 0)
            finally:
                process.kill()
                process.communicate()
                device.kill()  # it waits for its own reader

    def test_trouble_is_told_on_standard_error(self):
        with self.device("vanish=50,2500"), open(self.csv, "wb") as out:
            process = self.start("record", "-", "--port", self.port, stdout=out)
            self.assertEqual(process.stderr.readline(), "gone, plug it in again\n")
            while (line := process.stderr.readline()) != "streaming\n":
                self.assertIn(line, ["waiting for an answer\n", "STALLED\n"])
            self.interrupt(process)
        self.assertRegex(pathlib.Path(self.csv).read_text(encoding="utf-8"), "(?m)^# event: gone .*\n(#.*\n)*# event: back ")

    def test_what_cannot_go_there(self):
        self.assertIn("for - run one `fingertip record - --device SERIAL` for each", self.error("record", "-", "--all", status=2))
        self.assertIn("for each", self.error("record", "-", "--device", "A", "--device", "B", status=2))
        self.assertIn("--raw-bytes needs a file", self.error("record", self.csv, "--raw-bytes", "-", status=2))
        self.assertIn("use `fingertip record -`", self.error("monitor", "--record", "-", status=2))
        with self.device(), open("/dev/full", "w", encoding="ascii") as full:
            err = self.run_cli("record", "-", "--port", self.port, status=1, stdout=full)[1]
            self.assertIn("fingertip: -: No space left on device", err)

    def test_a_full_disk(self):
        """From the beginning or later: what was written stays readable."""
        for command, full in (
            ("record /dev/full", "/dev/full"),
            (f"record {self.csv} --raw-bytes /dev/full --seconds 1", "/dev/full"),
            ("monitor --record /dev/full", "/dev/full"),
            (f"record {self.csv}", self.csv),
            (f"record - --raw-bytes {self.ftr} --seconds 2", self.ftr),
        ):
            with self.device():
                most_bytes = 10**9 if full == "/dev/full" else 20000
                _, err = self.run_cli(*command.split(), "--overwrite", "--port", self.port, status=1, preexec_fn=disk_of(most_bytes))
            why = "No space left on device" if full == "/dev/full" else "File too large"
            self.assertRegex(err.splitlines()[-1], rf"^fingertip: {full}: {why}; .*(make room and start a new file|--salvage)$")
            if "/dev/full --sec" in command:  # the recording is whole, on another disk
                self.assertIn("\n# end: reason=seconds ", pathlib.Path(self.csv).read_text(encoding="utf-8"))
        for path in (self.csv, self.ftr):
            self.assertRegex(self.run_cli("replay", path, "--speed", "max", "--salvage")[0], r" [1-9]\d+ frames in")

    def test_a_file_it_is_appended_to_keeps_what_it_had(self):
        pathlib.Path(self.csv).write_text("precious\n", encoding="utf-8")
        with self.device(), open(self.csv, "a", encoding="utf-8") as file:
            self.run_cli("record", "-", "--port", self.port, status=1, stdout=file, preexec_fn=disk_of(20000))
        self.assertIn("precious\n# fingertip-recording 1\n", pathlib.Path(self.csv).read_text(encoding="utf-8"))


class Replay(CliTest):
    def record(self):
        with self.device("frames=100"):
            self.run_cli("record", self.csv, "--port", self.port, "--until-gone", "--raw-bytes", self.ftr)

    def test_damage_is_named_and_salvaged(self):
        self.record()
        for path in (self.csv, self.ftr):
            self.assertNotIn("cut short", self.run_cli("replay", path, "--speed", "max")[1])
        lines = pathlib.Path(self.csv).read_text(encoding="utf-8").splitlines(keepends=True)
        torn = [i for i, line in enumerate(lines) if line[0].isdigit()][10]
        lines[torn] = lines[torn][:40] + "\n"
        pathlib.Path(self.csv).write_text("".join(lines[:-1]), encoding="utf-8")  # without the end line
        err = self.run_cli("replay", self.csv, "--speed", "max", status=1)[1]
        self.assertRegex(err, f"{self.csv}:{torn + 1}: .*use --salvage")
        out, err = self.run_cli("replay", self.csv, "--speed", "max", "--salvage")
        self.assertIn("1 damaged lines skipped", err)
        self.assertIn(f"{self.csv}: no end line: the recording was cut short", err)
        self.assertIn("99 frames", out)

    def test_a_conversion_never_harms_a_file(self):
        self.record()
        before = pathlib.Path(self.csv).read_bytes()
        self.assertIn("is the file to read; give another name", self.error("convert", self.csv, self.csv, "--overwrite"))
        self.assertIn("exists already", self.error("convert", self.ftr, self.csv))
        part = ("convert", self.csv, self.folder + "/c.csv", "--from", "1000", "--to", "1001")
        self.assertIn("r.csv: no frames from --from to --to", self.error(*part))
        # a disk that is full in the middle
        _, err = self.run_cli("convert", self.ftr, self.csv, "--overwrite", status=1, preexec_fn=disk_of(20000))
        self.assertIn("nothing was changed", err)
        self.assertEqual(pathlib.Path(self.csv).read_bytes(), before)
        self.assertEqual(sorted(os.listdir(self.folder)), ["r.csv", "r.ftr"])
        self.run_cli("convert", self.ftr, self.csv, "--overwrite")
        self.assertIn("reason=converted", self.rows()[1][-1])

    def test_a_conversion_keeps_what_the_recorder_knew(self):
        self.record()
        converted = os.path.join(self.folder, "c.csv")
        self.run_cli("convert", self.csv, converted, "--device", "E660583883265A2C")
        before, after = (files.read_recording(path) for path in (self.csv, converted))
        for key in ("started_utc", "started_device_us", "started_uncertainty_us", "port", "serial"):
            self.assertEqual(after.metadata[key], before.metadata[key])
        self.assertEqual(after.metadata["source"], self.csv)
        self.assertEqual(after.end | {"reason": ""}, before.end | {"reason": ""})
        # once more, and still each key once
        twice = os.path.join(self.folder, "d.csv")
        self.run_cli("convert", converted, twice, "--device", "E660583883265A2C")
        text = pathlib.Path(twice).read_text(encoding="utf-8")
        for key in ("recorded_by", "source", "port", "started_utc"):
            self.assertEqual(text.count(f"\n# {key}: "), 1, key)

    def test_other_files(self):
        noise, text = (os.path.join(self.folder, name) for name in ("noise.ftr", "text.csv"))
        pathlib.Path(noise).write_bytes(bytes(range(256)) * 20)
        pathlib.Path(text).write_text("x\n")
        self.assertIn("no frames in it", self.run_cli("replay", noise, "--speed", "max", status=1)[1])
        self.assertIn("no frames in it", self.error("convert", noise, self.csv))
        for words in (["replay", text], ["convert", text, self.csv]):
            self.assertIn("neither a recording nor bytes of a fingertip's line", self.error(*words))
        self.assertFalse(os.path.exists(self.csv))
        self.assertIn("No such file", self.run_cli("replay", self.folder + "/absent.csv", status=1)[1])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
