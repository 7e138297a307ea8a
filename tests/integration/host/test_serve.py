"""Several programs on one fingertip, through fingertip serve: usage test_serve.py FINGERTIP FAKE_DEVICE TIME_KEEPER [unittest arguments]."""

import contextlib
import grp
import os
import re
import shutil
import signal
import socket
import stat
import sys
import unittest

import test_flash
from cli_case import FINGERTIP, CliTest
from fingertip import files

SERIAL = "E660583883265A2C"  # of the fake device where none is said


class ServeTest(CliTest):
    def setUp(self):
        super().setUp()
        self.environment["FINGERTIP_PORT"] = self.port
        self.sockets = os.path.join(self.folder, "fingertip")
        self.log = os.path.join(self.folder, "serve.log")

    def socket_of(self, serial=SERIAL):
        return os.path.join(self.sockets, f"{serial}.sock")

    def said(self):
        with open(self.log, encoding="utf-8") as file:
            return file.read()

    @contextlib.contextmanager
    def served(self, *arguments, serials=(SERIAL,)):
        with open(self.log, "w", encoding="utf-8") as log:
            process = self.start("serve", *arguments, stderr=log)
        self.world.until(lambda: all(f"{serial}: shared as" in self.said() for serial in serials))
        process.expected = 0
        yield process
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(), process.expected, self.said())

    def finished(self, process, status=0):
        _, err = process.communicate()
        self.assertEqual(process.returncode, status, err)
        return err

    def rows_but_numbers(self, path):
        """Of packets: each client has its own."""
        return [{key: value for key, value in row.items() if key not in ("sequence", "raw_sequence")} for row in self.rows(path)[0]]

    def recording(self, name, *arguments):
        """A recorder that has rows, and its file."""
        path = self.path(name)
        process = self.start("record", path, "--until-gone", *arguments)
        self.world.until(lambda: os.path.exists(path) and len(self.rows(path)[0]) > 5)
        return process, path


class Sharing(ServeTest):
    def test_all_at_once_and_each_recording_is_what_the_line_said(self):
        line = self.path("line.ftr")
        with self.device("frames=700", "health=50", f"tap={line}"), self.served():
            first, first_csv = self.recording("first.csv", "--raw-bytes", self.ftr)
            second, second_csv = self.recording("second.csv")
            monitor = self.start("monitor", "--until-gone")
            commands = f"tare, set osr=256, set rate=400, info, list, set limit=0.5 --keep, info --device {SERIAL.lower()}"
            commands += ", set slip_threshold=0.25"
            for process in [self.start(*command.split()) for command in commands.split(", ")]:
                self.finished(process)
            out = self.run_cli("info")[0]
            for said in ("osr 256", "rate_mHz 400000", "location_limit_mm 0.5", "slip_threshold_mm 0.25", f"port {self.socket_of()}"):
                self.assertIn(said, re.sub(" +", " ", out))
            for process in (first, second, monitor):
                self.finished(process)
        direct = self.path("direct.csv")
        self.run_cli("convert", line, direct)
        expected = self.rows_but_numbers(direct)
        self.assertEqual(sorted({int(row["frame"]) for row in expected}), list(range(1, 701)))
        for path in (first_csv, second_csv):
            rows, comments = self.rows_but_numbers(path), self.rows(path)[1]
            begin = int(rows[0]["frame"])
            self.assertTrue(rows == [row for row in expected if int(row["frame"]) >= begin], path)
            end = rf"reason=gone frames={len(rows)} .*dropped_packets=0 out_of_order=0 crc_errors=0 format_errors=0"
            self.assertRegex(comments[-1], end)
            self.assertIn(f" {701 - begin} frames in ", self.run_cli("replay", path, "--speed", "max")[0])
            self.assertTrue(any(c.startswith(f"# port: {self.socket_of()}") for c in comments))
            # its own exchanges alone: before, the streams on, and none of the others' answers
            self.assertFalse(any("packet: ack" in c and "command=129" in c for c in comments), comments)
        self.assertEqual(int(self.rows(first_csv)[0][0]["frame"]), 1)
        # what the client's own line held is the same again
        again = self.path("again.csv")
        self.run_cli("convert", self.ftr, again)
        self.assertEqual(self.rows(again)[0], self.rows(first_csv)[0])

    def test_two_fingertips_on_one_clock_while_others_look(self):
        other = self.port + "2"
        self.environment["FINGERTIP_PORT"] = self.port + ":" + other
        with self.device("serial=AAAA"), self.device("serial=BBBB", port=other), self.served(serials=("AAAA", "BBBB")):
            for serial, port in (("AAAA", self.port), ("BBBB", other)):
                self.assertIn(f"{serial}\tpico_mux\t1.20.3\tsocket {self.socket_of(serial)}, port {port}\n", self.run_cli("list")[0])
            joint = [self.start("record", self.path(name), "--all", "--seconds", "1.5") for name in ("j.csv", "k.csv")]
            self.assertEqual(self.run_cli("tare", "--device", "BBBB")[0], "tared\n")
            for process in joint:
                self.assertIn(" of 2 fingertips, aligned to ", self.finished(process))
            self.assertIn("choose one with --device", self.error("info"))
        for name in ("j.csv", "k.csv"):
            for serial in ("AAAA", "BBBB"):
                recording = files.read_recording(self.path(name), serial=serial)
                self.assertEqual(recording.end["dropped_packets"], "0")
                self.assertTrue(((recording["frame"][1:] - recording["frame"][:-1]) == 1).all())

    def test_the_doctor_knows_it(self):
        with self.device(), self.served():
            _, out, _ = self.world.run([FINGERTIP, "doctor", "--seconds", "1"], env=self.environment)
        self.assertRegex(out, rf"(?m)^ok +port +{self.socket_of()}, shared$")
        self.assertRegex(out, r"(?m)^ok +packets +\d+ packets, 0 lost, 0 damaged$")

    def test_a_fingertip_that_goes_and_comes_back(self):
        with self.device("vanish=100,700"), self.served():
            waiting = self.start("record", self.csv)
            self.world.until(lambda: os.path.exists(self.csv) and any("event: back" in c for c in self.rows()[1]))
            self.assertRegex(self.said(), rf"(?s){SERIAL}: gone.*{SERIAL}: shared as")
            self.world.until(lambda: len(self.rows()[0]) >= 220)
            self.assertRegex(self.run_cli("info")[0], f"(?m)^port +{self.socket_of()}$")
            self.interrupt(waiting)
        rows, comments = self.rows()
        frames = [int(row["frame"]) for row in rows]
        restart = frames.index(1, 1)
        self.assertEqual(frames[:restart], list(range(1, 101)))
        self.assertEqual(frames[restart:], list(range(1, len(frames) - restart + 1)))
        self.assertIn("dropped_packets=0", comments[-1])

    def test_without_it_there_is_no_socket(self):
        with self.served(serials=()) as server:
            self.world.until(lambda: self.said())
            self.assertIn("no such port", self.said())
            self.assertEqual(server.wait(), 1)
            server.expected = 1
        self.environment.pop("FINGERTIP_PORT")
        with self.served(serials=()):
            self.world.until(lambda: "no fingertip here yet; each that is plugged in will be shared" in self.said())

    def test_into_the_loader(self):
        with self.device("loader=1") as device, self.served():
            recorder, path = self.recording("r.csv")
            self.assertIn("RPI-RP2", self.run_cli("loader")[0])
            self.assertEqual(device.wait(), 0)
            self.finished(recorder)
            self.world.until(lambda: not os.path.exists(self.socket_of()))
        self.assertIn("reason=gone", self.rows(path)[1][-1])


class Flash(ServeTest):
    uf2, make_volume = test_flash.Flash.uf2, test_flash.Flash.make_volume

    def test_new_firmware_while_others_wait(self):
        image, self.volume = self.uf2(), self.path("RPI-RP2")
        with self.device("loader=1") as device, self.served():
            recorder = self.start("record", self.csv)
            self.world.until(lambda: os.path.exists(self.csv))
            flash = self.start("flash", image, "--volume", self.volume)
            self.assertEqual(device.wait(), 0)
            self.make_volume()
            written = os.path.join(self.volume, "fingertip.uf2")
            self.world.until(lambda: os.path.exists(written) and os.path.getsize(written) == os.path.getsize(image))
            os.unlink(os.path.join(self.volume, "INFO_UF2.TXT"))
            with self.device("board=pico_mux", "git=abcdef012345", "firmware=9.8.7"):
                out, err = flash.communicate()
                self.assertEqual(out, f"fingertip {SERIAL}: firmware 9.8.7 abcdef012345, board pico_mux\n", err)
                self.world.until(lambda: any("event: back" in comment for comment in self.rows()[1]))
                self.interrupt(recorder)


class Clients(ServeTest):
    def test_a_stopped_client_loses_its_own_packets_counted_and_nobody_elses(self):
        with self.device("rate=1500"), self.served():
            (stopped, stopped_csv), (other, other_csv) = self.recording("stopped.csv"), self.recording("other.csv")
            stopped.hold_up()
            self.world.until(lambda: "does not read in time and loses packets" in self.said())
            self.assertEqual(self.run_cli("tare")[0], "tared\n")
            self.world.sleep(0.5)
            stopped.go_on()
            last = self.rows(other_csv)[0][-1]["frame"]
            self.world.until(lambda: int(self.rows(stopped_csv)[0][-1]["frame"]) > int(last) + 200)
            for process in (stopped, other):
                self.interrupt(process)
            self.world.until(lambda: " lost " in self.said())
        lost = int(re.search(rf"{SERIAL}: pid {stopped.pid}, simulated_finge lost (\d+) packets", self.said())[1])
        self.assertGreater(lost, 500)
        self.assertEqual(self.said().count(" lost "), 1)
        rows, comments = self.rows(other_csv)
        self.assertIn("dropped_packets=0 out_of_order=0", comments[-1])
        self.assertEqual([int(row["frame"]) for row in rows], list(range(int(rows[0]["frame"]), int(rows[0]["frame"]) + len(rows))))
        self.assertIn(f"dropped_packets={lost} out_of_order=0 crc_errors=0 format_errors=0", self.rows(stopped_csv)[1][-1])

    def test_a_past_client_is_streamed_nothing(self):
        with self.device(), self.served() as server:
            killed, _ = self.recording("killed.csv")
            killed.kill()
            killed.communicate()
            self.world.until(lambda: re.search(r"(?m)^streams +none$", self.run_cli("info")[0]))
            turns = server.turns()
            self.world.sleep(1)
            self.assertLessEqual(server.turns() - turns, 3, "idle is idle: a look every half second")

    def test_too_many_are_turned_away(self):
        with self.device(), self.served(), contextlib.ExitStack() as many:
            recorder, path = self.recording("r.csv")
            for _ in range(59):
                client = many.enter_context(socket.socket(socket.AF_UNIX))
                client.connect(self.socket_of())
            self.assertIn("as many programs use this fingertip as can share it; end that one first", self.error("info"))
            self.assertIn(", simulated_finge is one too many, after 60", self.said())
            many.close()
            self.run_cli("info")
            self.interrupt(recorder)
        self.assertIn("dropped_packets=0", self.rows(path)[1][-1])


class Server(ServeTest):
    def test_the_end_of_it(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.device(), self.served() as server:
                recorder, path = self.recording(f"{number}.csv")
                server.send_signal(number)
                self.assertEqual(server.wait(), 0)
                self.assertEqual(os.listdir(self.sockets), [])
                self.finished(recorder)
                self.assertRegex(self.run_cli("info")[0], f"(?m)^port +{self.port}$")
            self.assertRegex(self.rows(path)[1][-1], "reason=gone .*dropped_packets=0")

    def test_a_second_one_is_refused(self):
        with self.device(), self.served():
            why = "another program shares this fingertip; use it as if it were your own, or end that one first"
            self.assertEqual(self.error("serve"), f"fingertip: {self.socket_of()}: {why}\n")
            self.run_cli("info")

    def test_one_that_cannot_be_shared_keeps_none_of_the_others(self):
        with self.device(), self.served("--device", SERIAL, "--device", "99"):
            self.assertIn("99", self.said())
            self.run_cli("info")

    def test_what_a_killed_one_leaves_is_replaced(self):
        with self.device():
            with self.served() as server:
                server.kill()
                server.wait()
                server.expected = -signal.SIGKILL
            self.assertTrue(os.path.exists(self.socket_of()))
            self.assertRegex(self.run_cli("info")[0], f"(?m)^port +{self.port}$")
            self.assertNotIn("socket", self.run_cli("list")[0])
            with self.served():
                self.assertRegex(self.run_cli("info")[0], f"(?m)^port +{self.socket_of()}$")
            self.assertFalse(os.path.exists(self.socket_of()))

    def test_past_it_and_only_by_it(self):
        with self.device():
            self.assertIn("no program shares it; share it with `fingertip serve`", self.error("info", "--transport", "socket"))
            with self.served():
                self.assertIn("in use by another program", self.error("info", "--transport", "serial"))
                self.run_cli("info", "--transport", "socket")
                self.run_cli("info", "--port", os.path.realpath(self.port), "--transport", "socket")

    def test_who_may(self):
        with self.device(), self.served():
            self.assertEqual(stat.S_IMODE(os.stat(self.sockets).st_mode), 0o750)
            self.assertEqual(stat.S_IMODE(os.stat(self.socket_of()).st_mode), 0o660)

    def as_nobody(self, *arguments, group):
        os.chmod(self.folder, 0o755)
        tool = self.path("tool")
        shutil.copy(FINGERTIP, tool)
        return self.world.run([tool, *arguments], env=self.environment, user=65534, group=group, extra_groups=[])

    @unittest.skipUnless(os.geteuid() == 0, "only root changes groups and users")
    def test_the_group_may_and_others_may_not(self):
        group = grp.getgrnam("dialout")
        with self.device(), self.served("--group", group.gr_name):
            self.assertEqual((os.stat(self.sockets).st_gid, os.stat(self.socket_of()).st_gid), (group.gr_gid, group.gr_gid))
            allowed = self.as_nobody("info", group=group.gr_gid)
            self.assertEqual((allowed[0], allowed[2]), (0, ""))
            denied = self.as_nobody("info", group=65534)
            self.assertEqual(denied[:2], (1, ""))
            os.chmod(self.sockets, 0o755)
            denied = self.as_nobody("info", group=65534)
            why = "permission denied: it is its owner's and group's; join the group, or share it with serve --group"
            self.assertEqual(denied[2], f"fingertip: {self.socket_of()}: {why}\n")

    def test_wrong_places_and_names(self):
        self.assertIn('--group "no such" is not possible; give the name of a group', self.error("serve", "--group", "no such", status=2))
        os.symlink("/tmp", self.sockets)
        self.assertIn("is no folder of this user", self.error("serve"))
        os.unlink(self.sockets)
        self.environment["XDG_RUNTIME_DIR"] = self.path("none")
        self.assertIn("cannot share there (No such file or directory); set XDG_RUNTIME_DIR", self.error("serve"))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
