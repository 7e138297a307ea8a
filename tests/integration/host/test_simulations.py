"""What `fingertip web` passes on of `fingertip simulate`, as the page asks for it and as another site would: usage
test_simulations.py FINGERTIP [unittest arguments].

real time: a simulation, a server and clients on the kernel's sockets. Waits are for what they say.
"""

import contextlib
import http.client
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

FINGERTIP = os.path.abspath(sys.argv[1])
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "host_tools/python"))
from fingertip import wire  # noqa: E402
from fingertip.line import AskInfo  # noqa: E402

PATIENCE_s = 300
LEFT, RIGHT = "00000000000CE110", "00000000000CE111"
ONE, OTHER = "0123456789abcdef", "fedcba9876543210"


class SimulationsTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory(prefix="fingertip-test-")
        self.addCleanup(holder.cleanup)
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": holder.name}

    @contextlib.contextmanager
    def run_tool(self, *words):
        """Yields its first line."""
        process = subprocess.Popen([FINGERTIP, *words], env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            line = process.stdout.readline()
            self.assertTrue(line, process.stderr.read() if process.poll() is not None else "")
            yield line.strip()
        finally:
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=PATIENCE_s)
        self.assertEqual(process.returncode, 0, err)

    @contextlib.contextmanager
    def served(self, *options):
        with self.run_tool("web", "--port", "0", "--no-browser", *options) as url:
            self.host, port = url.removeprefix("http://").rstrip("/").rsplit(":", 1)
            self.port = int(port)
            yield

    def ask(self, path, body=None, **headers):
        """Status and body; a POST if there is a body."""
        connection = http.client.HTTPConnection(self.host, self.port, timeout=PATIENCE_s)
        try:
            connection.request(
                "GET" if body is None else "POST", path, body, {name.replace("_", "-"): value for name, value in headers.items()}
            )
            answer = connection.getresponse()
            return answer.status, answer.read().decode()
        finally:
            connection.close()

    @contextlib.contextmanager
    def line(self, client=ONE, serial=LEFT):
        connection = http.client.HTTPConnection(self.host, self.port, timeout=PATIENCE_s)
        try:
            connection.request("GET", f"/simulated/line?serial={serial}&client={client}")
            answer = connection.getresponse()
            self.assertEqual(answer.status, 200, answer.read() if answer.status != 200 else "")
            yield answer
        finally:
            connection.close()

    def hand(self, command="", client=ONE):
        """What is true then, once anything is known."""
        while True:
            status, body = self.ask(f"/simulated/hand?client={client}", command)
            self.assertEqual(status, 200, body)
            if body != "{}":
                return json.loads(body)

    def until(self, condition):
        end_s = time.monotonic() + PATIENCE_s
        while not condition():
            self.assertLess(time.monotonic(), end_s)


class Hand(SimulationsTest):
    def test_it_presses_and_the_truth_follows(self):
        with self.served():
            self.assertEqual(self.ask("/simulated"), (200, "[]"))
            with self.run_tool("simulate", "--mouse", "--fingertips", "2"):
                self.assertEqual(json.loads(self.ask("/simulated")[1]), [{"serial": LEFT, "hand": True}, {"serial": RIGHT, "hand": True}])
                with self.line(), self.line(OTHER, RIGHT):
                    self.hand("press 3 -5.5 2")
                    self.until(lambda: self.hand()["force_N"] > 1.99)
                    truth = self.hand()
                    self.assertEqual((truth["x_mm"], truth["y_mm"]), (3, -5.5))
                    self.assertEqual(self.hand(client=OTHER)["force_N"], 0)
                    self.hand("press 3 -5.5 2000", OTHER)
                    self.until(lambda: self.hand(client=OTHER)["force_N"] > 49.9)  # and no more
                    self.assertLessEqual(self.hand(client=OTHER)["force_N"], 50)
                    self.hand("lift")
                    self.until(lambda: self.hand()["force_N"] == 0)

    def test_one_that_leaves_lifts(self):
        with self.served(), self.run_tool("simulate", "--mouse"), self.line(OTHER):
            with self.line():
                self.hand("press 0 0 3")
                self.until(lambda: self.hand(client=OTHER)["force_N"] > 2.9)
            self.until(lambda: self.hand(client=OTHER)["force_N"] == 0)
            self.assertEqual(self.ask(f"/simulated/hand?client={ONE}", "lift")[0], 404)

    def test_what_it_cannot_do_is_said(self):
        with self.served(), self.run_tool("simulate", "--mouse"), self.line():
            for words in ("press 1 2", "press 1 2 x", "press 1 2 3 4", "push 1 2 3", "lift left", "press 1 2 3\nlift", "press nan 0 1"):
                status, said = self.ask(f"/simulated/hand?client={ONE}", words)
                self.assertEqual((status, said), (400, "give press X_mm Y_mm FORCE_N, lift, or nothing\n"), words)

    def test_a_simulation_without_a_hand(self):
        with self.served(), self.run_tool("simulate"), self.line():
            self.assertEqual(json.loads(self.ask("/simulated")[1]), [{"serial": LEFT, "hand": False}])
            self.until(lambda: self.hand()["force_N"] > 2)  # its weight
            self.hand("press 0 0 1")
            self.until(
                lambda: (
                    (409, "no hand presses here; start fingertip simulate --mouse\n") == self.ask(f"/simulated/hand?client={ONE}", "lift")
                )
            )


class Lift(SimulationsTest):
    def test_the_truth_has_the_pull(self):
        """An object's weight, which both carry, is along y."""
        with self.served(), self.run_tool("simulate", "--lift", "--mass", "0.2"):
            with (
                subprocess.Popen(
                    [FINGERTIP, "grasp", "--gripper", "2f85", "--gripper-port", "sim:gripper"],
                    env=self.environment,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                ) as grasp,
                self.line(),
                self.line(OTHER, RIGHT),
            ):
                try:
                    self.until(lambda: self.hand()["qy_N"] > 0.9 * 0.1 * 9.81)
                    truth = self.hand()
                    self.assertAlmostEqual(truth["qy_N"], 0.1 * 9.81, delta=0.1 * 9.81)  # it swings at first
                    self.assertGreater(truth["force_N"], truth["qy_N"])
                    self.assertGreater(self.hand(client=OTHER)["force_N"], 0)
                finally:
                    grasp.kill()


class Line(SimulationsTest):
    def test_it_is_a_line_to_the_fingertip(self):
        with self.served(), self.run_tool("simulate"):
            with self.line() as line:
                status, said = self.ask(f"/simulated/line?client={ONE}", wire.encode(wire.Packet(7, 0, AskInfo())))
                self.assertEqual((status, said), (200, ""))
                came = b""
                while b"native" not in came:  # the name of its board
                    came += line.read1()

    def test_it_ends_with_the_simulation(self):
        with self.served():
            with self.run_tool("simulate"):
                connection = http.client.HTTPConnection(self.host, self.port, timeout=PATIENCE_s)
                connection.request("GET", f"/simulated/line?serial={LEFT}&client={ONE}")
                answer = connection.getresponse()
            answer.read()  # to its end
            connection.close()
            self.assertEqual(self.ask("/simulated"), (200, "[]"))


class Strangers(SimulationsTest):
    def test_only_the_page_may_ask(self):
        with self.served(), self.run_tool("simulate", "--mouse"), self.line():
            here = f"http://{self.host}:{self.port}"
            for headers in (
                {"Origin": "http://evil.example"},
                {"Origin": "null"},
                {"Sec_Fetch_Site": "cross-site"},
                {"Sec_Fetch_Site": "same-site"},
                {"Origin": f"http://{self.host}:{self.port + 1}"},
            ):
                for path, body in (
                    ("/simulated", None),
                    (f"/simulated/line?serial={LEFT}&client={OTHER}", None),
                    (f"/simulated/hand?client={ONE}", "press 0 0 9"),
                    (f"/simulated/line?client={ONE}", "x"),
                ):
                    self.assertEqual(self.ask(path, body, **headers)[0], 403, (path, headers))
            self.assertEqual(self.ask("/simulated", Host="evil.example")[0], 421)
            self.assertEqual(self.ask("/simulated", Origin=here, Sec_Fetch_Site="same-origin")[0], 200)
            self.assertEqual(self.hand()["force_N"], 0)

    def test_what_is_wrong_is_said(self):
        with self.served(), self.run_tool("simulate"), self.line():
            for path, body, status, words in (
                (f"/simulated/line?serial={RIGHT}&client={OTHER}", None, 404, "start fingertip simulate"),
                (f"/simulated/line?serial={LEFT}&client=../..", None, 400, "hexadecimal"),
                (f"/simulated/line?serial={LEFT}", None, 400, "hexadecimal"),
                (f"/simulated/line?serial={LEFT}&client={ONE}", None, 409, "a line already"),
                (f"/simulated/hand?client={OTHER}", "lift", 404, "open one first"),
                (f"/simulated/line?client={OTHER}", "x", 404, "open one first"),
                (f"/simulated/line?client={ONE}", "x" * 5000, 400, "more than"),
                ("/simulated/more", None, 404, ""),
            ):
                found, said = self.ask(path, body)
                self.assertEqual(found, status, (path, said))
                self.assertIn(words, said)
            self.assertEqual(self.ask(f"/simulated/line?client={ONE}", "x" * 100000)[0], 413)

    def test_a_server_for_other_machines_passes_nothing_on(self):
        with self.served("--address", "0.0.0.0"), self.run_tool("simulate", "--mouse"):
            self.assertEqual(self.ask("/simulated")[0], 404)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]], verbosity=2)
