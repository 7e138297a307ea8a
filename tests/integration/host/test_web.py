"""`fingertip web`, with a page of its own, as a browser and as an attacker would ask, and what it passes on of `fingertip simulate`.

usage: test_web.py FINGERTIP SIMULATE [unittest arguments]

real time: a simulation, a server and clients on the kernel's sockets. Waits are for what they say.
"""

import contextlib
import http.client
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

FINGERTIP, SIMULATE = (os.path.abspath(path) for path in sys.argv[1:3])
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host_tools/python"), str(ROOT / "tests/support")]
import figures  # noqa: E402
from fingertip import wire  # noqa: E402
from fingertip.line import AskInfo  # noqa: E402
from fingertip.version import __version__  # noqa: E402

TOOLS = ROOT / "build/report/tools.json"  # beside what tests/nightly writes there
PATIENCE_s = 300
LEFT, RIGHT = "00000000000CE110", "00000000000CE111"
ONE, OTHER = "0123456789abcdef", "fedcba9876543210"
FILES = {
    "index.html": ("text/html; charset=utf-8", f'<meta name="fingertip-version" content="{__version__}">'.encode()),
    "app.js": ("text/javascript; charset=utf-8", b"0;"),
    "app.css": ("text/css; charset=utf-8", b"a{}"),
    "assets/simulated.wasm": ("application/wasm", b"\0asm\1\0\0\0"),
    "assets/pad.bin": ("application/octet-stream", bytes(range(256)) * 4096),
}


class WebCase(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))
        self.tool, simulate = (self.folder / path for path in ("root/bin/fingertip", "root/libexec/fingertip/fingertip-simulate"))
        self.page = self.folder / "root/share/fingertip/web"
        for folder in (self.tool, simulate, *(self.page / name for name in FILES)):
            folder.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(FINGERTIP, self.tool)
        simulate.symlink_to(SIMULATE)
        for name, (_, content) in FILES.items():
            (self.page / name).write_bytes(content)
        (self.page.parent / "secret").write_text("secret")
        self.environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
        self.environment["XDG_RUNTIME_DIR"] = str(self.folder)

    @contextlib.contextmanager
    def run_tool(self, *words, **environment):
        """Yields the process and its first line; self.said is what it said on standard error."""
        environment = {**self.environment, **environment}
        process = subprocess.Popen([self.tool, *words], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            line = process.stdout.readline().strip()
            self.assertTrue(line, process.stderr.read() if process.poll() is not None else "")
            yield process, line
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            self.said = process.communicate(timeout=PATIENCE_s)[1]
        self.assertEqual(process.returncode, 0, self.said)

    @contextlib.contextmanager
    def served(self, *options, **environment):
        with self.run_tool("web", "--port", "0", *options, **environment) as (process, self.url):
            place, _, self.token = self.url.partition("/?token=")
            self.host, port = place.removeprefix("http://").rstrip("/").rsplit(":", 1)
            self.host, self.port = self.host.strip("[]"), int(port)
            yield process

    def ask(self, path="/", method="GET", content=None, **headers):
        if path.startswith("/simulated") and "Cookie" not in headers:
            headers["Cookie"] = f"a=b; fingertip-{self.port}={self.token}"
        connection = http.client.HTTPConnection(self.host, self.port, timeout=PATIENCE_s)
        try:
            connection.request(method, path, content, {name.replace("_", "-"): value for name, value in headers.items()})
            answer = connection.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()
        finally:
            connection.close()


class Web(WebCase):
    def test_the_page_is_served_as_it_is(self):
        with self.served():
            self.assertEqual(self.host, "127.0.0.1")
            for name, (kind, content) in {"": FILES["index.html"], **FILES}.items():
                status, headers, body = self.ask(f"/{name}")
                self.assertEqual((status, headers["Content-Type"], body), (200, kind, content), name)
                status, headers, body = self.ask(f"/{name}?any", method="HEAD")
                self.assertEqual((status, headers["Content-Length"], body), (200, str(len(content)), b""), name)

    def test_nothing_else_is(self):
        with self.served():
            paths = "/../secret /%2e%2e/secret /..%2fsecret /assets/../../secret //etc/passwd /assets /assets/ /index.html/ /%00 /index.html%00.js"
            for path in (*paths.split(), "/" + "a" * 3000):
                status, headers, body = self.ask(path)
                self.assertIn(status, (400, 404), path)
                self.assertNotIn(b"secret", body)
                self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
            for method in ("POST", "PUT", "DELETE", "OPTIONS", "PATCH"):
                self.assertEqual(self.ask("/", method=method)[0], 405, method)

    def test_the_policy_allows_nothing_from_elsewhere(self):
        with self.served():
            for path in ("/", "/assets/simulated.wasm", "/none"):
                headers = self.ask(path)[1]
                policy = dict(part.split(maxsplit=1) for part in headers["Content-Security-Policy"].split("; "))
                self.assertEqual(policy["default-src"], "'none'")
                self.assertEqual(policy["script-src"], "'self' 'wasm-unsafe-eval'")
                for name, sources in policy.items():
                    self.assertLessEqual(set(sources.split()), {"'self'", "'none'", "data:", "blob:", "'wasm-unsafe-eval'"}, name)
                self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
                self.assertEqual(headers["Cross-Origin-Opener-Policy"], "same-origin")
                self.assertEqual(headers["Cross-Origin-Embedder-Policy"], "require-corp")

    def test_a_name_that_leads_here_is_refused(self):
        with self.served():
            hosts = "evil.example", "localhost.evil.example", "127.0.0.1.evil.example"
            for name in (*(f"{name}:{self.port}" for name in hosts), hosts[0], "", "[evil]", "[", "127.1"):
                status, _, body = self.ask(Host=name)
                self.assertIn(status, (400, 421), name)
                self.assertNotIn(FILES["index.html"][1], body)
            for name in (f"localhost:{self.port}", "localhost", f"127.0.0.1:{self.port}", f"[::1]:{self.port}"):
                self.assertEqual(self.ask(Host=name)[0], 200, name)

    def test_only_this_machine_reaches_it_unless_asked(self):
        with self.served() as process:
            listening = subprocess.run(["cat", f"/proc/{process.pid}/net/tcp"], capture_output=True, text=True, timeout=PATIENCE_s).stdout
            self.assertRegex(listening, rf"0100007F:{self.port:04X} 00000000:0000 0A")
        with self.served("--address", "0.0.0.0"):
            self.assertEqual(self.ask("/simulated")[0], 404)  # passes nothing on
        self.assertIn("everyone who reaches 0.0.0.0", self.said)
        for address in ("127.0.0.2", *["::1"] * self.has_ipv6()):
            with self.served("--address", address):
                self.assertEqual(self.ask()[0], 200)

    @staticmethod
    def has_ipv6():
        with contextlib.suppress(OSError), socket.create_server(("::1", 0), family=socket.AF_INET6):
            return True
        return False

    def refused(self, *options):
        done = subprocess.run([self.tool, "web", *options], capture_output=True, text=True, timeout=PATIENCE_s)
        self.assertEqual(done.stdout, "")
        return done.returncode, done.stderr

    def test_what_cannot_be_served_is_said(self):
        with self.served():
            taken = f"port {self.port} of 127.0.0.1 is taken by another program; end that one, or choose another --port"
            again = "(a browser asks for fingertips again there)"
            self.assertEqual(self.refused("--port", str(self.port)), (1, f"fingertip: {taken} {again}\n"))
        for address in ("192.0.2.1", "no.such.name.invalid", "1.2.3"):
            status, said = self.refused("--address", address, "--port", "0")
            self.assertEqual(status, 1, address)
            self.assertIn("is it an address of this machine?", said)
        for port in ("65536", "-1", "x", "/dev/ttyACM0"):
            self.assertEqual(self.refused("--port", port)[0], 2, port)
        (self.page / "index.html").unlink()
        status, said = self.refused()
        self.assertEqual(status, 1)
        self.assertIn("the page is not built", said)
        self.assertIn("sh cmake/bootstrap.sh web", said)

    def test_a_page_of_another_version_is_reported(self):
        mark = '<meta name="fingertip-version" content="{}">'
        for head, of in ((mark.format(__version__), ""), (mark.format("9.8.7"), "version 9.8.7"), ("<meta>", "an unknown version")):
            (self.page / "index.html").write_text(f"<html><head>{head}</head></html>")
            said = subprocess.run([self.tool, "--version"], capture_output=True, text=True, check=True).stdout
            note = f"the page beside this tool is of {of}, the tool of version {__version__}; install both from one release"
            self.assertEqual(said.splitlines(), [f"fingertip {__version__}"] + [note] * bool(of))

    def test_the_desktops_browser_opens_it(self):
        opener = self.tool.parent / "xdg-open"
        opened = self.folder / "opened"
        os.mkfifo(opened)
        opener.write_text(f'#!/bin/sh\nprintf "%s" "$1" > {opened}\n')
        opener.chmod(0o755)
        path = f"{opener.parent}:{os.environ['PATH']}"
        with self.served(DISPLAY=":0", PATH=path):
            self.assertEqual(opened.read_text(), self.url)
        self.assertIn("opening it in the browser; Ctrl-C ends", self.said)
        for options, environment in ((["--no-browser"], {"DISPLAY": ":0"}), ([], {})):
            with self.served(*options, PATH=path, **environment):
                pass
            self.assertIn("open it in Chromium, Chrome or Edge", self.said)

    def attack(self, head, piece, count):
        """The end of what it answers to count pieces after a head, or to as many as it takes."""
        with socket.create_connection((self.host, self.port), timeout=PATIENCE_s) as attacker, contextlib.suppress(OSError):
            attacker.sendall(head)
            for _ in range(count):
                attacker.sendall(piece)
            return attacker.recv(65536)
        return b""

    def test_what_a_peer_may_use_is_bounded(self):
        """Bytes without end, and silent connections in number, before they ask and after: neither memory nor time of others."""
        with self.served() as process, contextlib.ExitStack() as many:
            megabyte = b"%x\r\n%b\r\n" % (1 << 20, bytes(1 << 20))
            for head, piece, status in (
                (b"POST /simulated/hand HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n", megabyte, b"411"),
                (b"POST /simulated/hand HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 99999999999\r\n\r\n", megabyte, b"413"),
                (b"GET / HTTP/1.1\r\n", b"".join(b"a%d: %b\r\n" % (k, b"b" * 1000) for k in range(1000)), b"431"),
                (b"", bytes(1 << 20), b"431"),
            ):
                self.assertIn(self.attack(head, piece, 300)[9:12], (status, b""), head)
                self.assertEqual(self.attack(head, piece[:20000], 1)[9:12], status, head)
            with socket.create_connection((self.host, self.port)) as ahead:  # of its answers
                threading.Thread(target=lambda: all(iter(lambda: ahead.recv(1 << 16), b""))).start()
                for _ in range(300):
                    ahead.sendall(125 * (b"HEAD / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: %b\r\n\r\n" % bytes(8000)))
                ahead.shutdown(socket.SHUT_RDWR)
            slow_s = 0.0
            for ask in (b"", b"GET /", b"GET /assets/pad.bin HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 3):
                for _ in range(300):
                    many.enter_context(socket.create_connection((self.host, self.port))).sendall(ask)
                begun_s = time.monotonic()
                self.assertEqual(self.ask()[0], 200)
                slow_s = max(slow_s, time.monotonic() - begun_s)
            peak = pathlib.Path(f"/proc/{process.pid}/status").read_text().partition("VmHWM:")[2].split()[0]
            figures.add(TOOLS, {"web_attack_MB": int(peak) / 1000, "web_slow_answer_s": slow_s})
            self.assertLess(int(peak), 100e3)
            process.send_signal(signal.SIGINT)
            process.wait(PATIENCE_s)


class SimulationsCase(WebCase):
    def answered(self, path, body=None, **headers):
        """Status and text; a POST if there is a body."""
        status, _, text = self.ask(path, "GET" if body is None else "POST", body, **headers)
        return status, text.decode()

    @contextlib.contextmanager
    def line(self, client=ONE, serial=LEFT):
        connection = http.client.HTTPConnection(self.host, self.port, timeout=PATIENCE_s)
        try:
            connection.request("GET", f"/simulated/line?serial={serial}&client={client}&token={self.token}")
            answer = connection.getresponse()
            self.assertEqual(answer.status, 200, answer.read() if answer.status != 200 else "")
            yield answer
        finally:
            connection.close()

    def hand(self, command="", client=ONE):
        """What is true then, once anything is known."""
        while True:
            status, body = self.answered(f"/simulated/hand?client={client}", command)
            self.assertEqual(status, 200, body)
            if body != "{}":
                return json.loads(body)

    def until(self, condition):
        end_s = time.monotonic() + PATIENCE_s
        while not condition():
            self.assertLess(time.monotonic(), end_s)


class Hand(SimulationsCase):
    def test_it_presses_and_the_truth_follows(self):
        with self.served():
            self.assertEqual(self.answered("/simulated"), (200, "[]"))
            with self.run_tool("simulate", "--mouse", "--fingertips", "2"):
                self.assertEqual(
                    json.loads(self.answered("/simulated")[1]), [{"serial": LEFT, "hand": True}, {"serial": RIGHT, "hand": True}]
                )
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
            self.assertEqual(self.answered(f"/simulated/hand?client={ONE}", "lift")[0], 404)

    def test_what_it_cannot_do_is_said(self):
        with self.served(), self.run_tool("simulate", "--mouse"), self.line():
            for words in ("press 1 2", "press 1 2 x", "press 1 2 3 4", "push 1 2 3", "lift left", "press 1 2 3\nlift", "press nan 0 1"):
                status, said = self.answered(f"/simulated/hand?client={ONE}", words)
                self.assertEqual((status, said), (400, "give press X_mm Y_mm FORCE_N, lift, or nothing\n"), words)

    def test_a_simulation_without_a_hand(self):
        with self.served(), self.run_tool("simulate"), self.line():
            self.assertEqual(json.loads(self.answered("/simulated")[1]), [{"serial": LEFT, "hand": False}])
            self.until(lambda: self.hand()["force_N"] > 2)  # its weight
            # The simulation refuses in its own time: the answer to this press may have it, or one of those to the next.
            without = 409, "no hand presses here; start fingertip simulate --mouse\n"
            self.until(lambda: self.answered(f"/simulated/hand?client={ONE}", "press 0 0 1") == without)


class Lift(SimulationsCase):
    def test_the_truth_has_the_pull(self):
        """An object's weight, which both carry, is along y."""
        words = [self.tool, *"grasp --gripper 2f85 --gripper-port sim:gripper".split()]
        with self.served(), self.run_tool("simulate", "--lift", "--mass", "0.2"):
            with (
                subprocess.Popen(words, env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as grasp,
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


class Line(SimulationsCase):
    def test_it_is_a_line_to_the_fingertip(self):
        with self.served(), self.run_tool("simulate"), self.line() as line:
            status, said = self.answered(f"/simulated/line?client={ONE}", wire.encode(wire.Packet(7, 0, AskInfo())))
            self.assertEqual((status, said), (200, ""))
            came = b""
            while b"native" not in came:  # the name of its board
                came += line.read1()

    def test_it_ends_with_the_simulation(self):
        with self.served(), contextlib.ExitStack() as lines:
            with self.run_tool("simulate"):
                line = lines.enter_context(self.line())
            line.read()  # to its end
            self.assertEqual(self.answered("/simulated"), (200, "[]"))


class Strangers(SimulationsCase):
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
                    self.assertEqual(self.answered(path, body, **headers)[0], 403, (path, headers))
            self.assertEqual(self.answered("/simulated", Host="evil.example")[0], 421)
            self.assertEqual(self.answered("/simulated", Origin=here, Sec_Fetch_Site="same-origin")[0], 200)
            self.assertEqual(self.hand()["force_N"], 0)

    def test_only_who_has_the_token_may_ask(self):
        with self.served(), self.run_tool("simulate", "--mouse"):
            cookie = self.ask(f"/?token={self.token}")[1]["Set-Cookie"]
            self.assertEqual(cookie, f"fingertip-{self.port}={self.token}; Path=/simulated; HttpOnly; SameSite=Strict")
            self.assertNotIn("Set-Cookie", self.ask("/?token=0")[1])
            self.assertEqual(self.answered("/simulated", Cookie=cookie)[0], 200)
            for wrong in ("", f"fingertip-{self.port}=0", f"fingertip={self.token}"):
                self.assertIn("open the address", self.answered("/simulated", Cookie=wrong)[1])

    @unittest.skipUnless(os.geteuid() == 0, "only root becomes another user")
    def test_another_user_may_not_even_with_the_token(self):
        ask = f"import http.client as h; c = h.HTTPConnection('{{}}', {{}}); c.request('GET', '/simulated?token={{}}'); print(c.getresponse().status)"
        with self.served():
            words = [sys.executable, "-c", ask.format(self.host, self.port, self.token)]
            answers = [subprocess.run(words, capture_output=True, text=True, check=True, user=user).stdout for user in (0, 65534)]
        figures.add(TOOLS, {"others_may_set": answers[1:].count("200\n")})
        self.assertEqual(answers, ["200\n", "403\n"])

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
                found, said = self.answered(path, body)
                self.assertEqual(found, status, (path, said))
                self.assertIn(words, said)
            self.assertEqual(self.answered(f"/simulated/line?client={ONE}", "x" * 100000)[0], 413)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
