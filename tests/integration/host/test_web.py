"""`fingertip web`, with a page of its own, as a browser and as an attacker would ask.

usage: test_web.py --fingertip TOOL
"""

import argparse
import contextlib
import http.client
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "host_tools/python"))
from fingertip.version import __version__  # noqa: E402

TOOLS = argparse.Namespace()
PATIENCE_s = 300
FILES = {
    "index.html": ("text/html; charset=utf-8", f'<meta name="fingertip-version" content="{__version__}">'.encode()),
    "app.js": ("text/javascript; charset=utf-8", b"0;"),
    "app.css": ("text/css; charset=utf-8", b"a{}"),
    "assets/simulated.wasm": ("application/wasm", b"\0asm\1\0\0\0"),
    "assets/pad.bin": ("application/octet-stream", bytes(range(256)) * 4096),
}


class Web(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory(prefix="fingertip-test-")
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        (self.folder / "bin").mkdir()
        self.tool = self.folder / "bin/fingertip"
        shutil.copy(TOOLS.fingertip, self.tool)
        self.page = self.folder / "share/fingertip/web"
        for name, (_, content) in FILES.items():
            (self.page / name).parent.mkdir(parents=True, exist_ok=True)
            (self.page / name).write_bytes(content)
        (self.folder / "share/fingertip/secret").write_text("secret")

    @contextlib.contextmanager
    def served(self, *options, **environment):
        """Host and port of a server, and its process."""
        without = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
        process = subprocess.Popen(
            [self.tool, "web", "--port", "0", *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**without, **environment},
        )
        try:
            url = process.stdout.readline().strip()
            self.assertTrue(url, process.stderr.read() if process.poll() is not None else "")
            host, port = re.fullmatch(r"http://(.+):(\d+)/", url).groups()
            yield host.strip("[]"), int(port), process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            self.said = process.communicate(timeout=PATIENCE_s)[1]
        self.assertEqual(process.returncode, 0, self.said)

    def ask(self, host, port, path="/", method="GET", **headers):
        connection = http.client.HTTPConnection(host, port, timeout=PATIENCE_s)
        try:
            connection.request(method, path, headers={name.replace("_", "-"): value for name, value in headers.items()})
            answer = connection.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()
        finally:
            connection.close()

    def test_the_page_is_served_as_it_is(self):
        with self.served() as (host, port, _):
            self.assertEqual(host, "127.0.0.1")
            for name, (kind, content) in {"": FILES["index.html"], **FILES}.items():
                status, headers, body = self.ask(host, port, f"/{name}")
                self.assertEqual((status, headers["Content-Type"], body), (200, kind, content), name)
                status, headers, body = self.ask(host, port, f"/{name}?any", method="HEAD")
                self.assertEqual((status, headers["Content-Length"], body), (200, str(len(content)), b""), name)

    def test_nothing_else_is(self):
        with self.served() as (host, port, _):
            paths = "/../secret /%2e%2e/secret /..%2fsecret /assets/../../secret //etc/passwd /assets /assets/ /index.html/ /%00 /index.html%00.js"
            for path in (*paths.split(), "/" + "a" * 3000):
                status, headers, body = self.ask(host, port, path)
                self.assertIn(status, (400, 404), path)
                self.assertNotIn(b"secret", body)
                self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
            for method in ("POST", "PUT", "DELETE", "OPTIONS", "PATCH"):
                self.assertEqual(self.ask(host, port, "/", method=method)[0], 405, method)

    def test_the_policy_allows_nothing_from_elsewhere(self):
        with self.served() as (host, port, _):
            for path in ("/", "/assets/simulated.wasm", "/none"):
                headers = self.ask(host, port, path)[1]
                policy = dict(part.split(maxsplit=1) for part in headers["Content-Security-Policy"].split("; "))
                self.assertEqual(policy["default-src"], "'none'")
                self.assertEqual(policy["script-src"], "'self' 'wasm-unsafe-eval'")
                for name, sources in policy.items():
                    self.assertLessEqual(set(sources.split()), {"'self'", "'none'", "data:", "blob:", "'wasm-unsafe-eval'"}, name)
                self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
                self.assertEqual(headers["Cross-Origin-Opener-Policy"], "same-origin")
                self.assertEqual(headers["Cross-Origin-Embedder-Policy"], "require-corp")

    def test_a_name_that_leads_here_is_refused(self):
        with self.served() as (host, port, _):
            hosts = "evil.example", "localhost.evil.example", "127.0.0.1.evil.example"
            for name in (*(f"{name}:{port}" for name in hosts), hosts[0], "", "[evil]", "[", "127.1"):
                status, _, body = self.ask(host, port, Host=name)
                self.assertIn(status, (400, 421), name)
                self.assertNotIn(FILES["index.html"][1], body)
            for name in (f"localhost:{port}", "localhost", f"127.0.0.1:{port}", f"[::1]:{port}"):
                self.assertEqual(self.ask(host, port, Host=name)[0], 200, name)

    def test_only_this_machine_reaches_it_unless_told(self):
        with self.served() as (_, port, process):
            listening = subprocess.run(["cat", f"/proc/{process.pid}/net/tcp"], capture_output=True, text=True, timeout=PATIENCE_s).stdout
            self.assertRegex(listening, rf"0100007F:{port:04X} 00000000:0000 0A")
        with self.served("--address", "0.0.0.0"):
            pass
        self.assertIn("everyone who reaches 0.0.0.0", self.said)
        with self.served("--address", "127.0.0.2") as (host, port, _):
            self.assertEqual(self.ask(host, port)[0], 200)
        self.assertNotIn("anyone", self.said)

    def test_over_ipv6(self):
        try:
            with socket.create_server(("::1", 0), family=socket.AF_INET6):
                pass
        except OSError as error:
            self.skipTest(f"no IPv6 here ({error})")
        with self.served("--address", "::1") as (host, port, _):
            self.assertEqual(self.ask(host, port)[0], 200)

    def refused(self, *options):
        done = subprocess.run([self.tool, "web", *options], capture_output=True, text=True, timeout=PATIENCE_s)
        self.assertEqual(done.stdout, "")
        return done.returncode, done.stderr

    def test_what_cannot_be_served_is_said(self):
        with self.served() as (_, port, _):
            taken = f"port {port} of 127.0.0.1 is taken by another program; end that one, or choose another --port"
            again = "(a browser asks for fingertips again there)"
            self.assertEqual(self.refused("--port", str(port)), (1, f"fingertip: {taken} {again}\n"))
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

    def test_a_page_of_another_version_is_told(self):
        mark = '<meta name="fingertip-version" content="{}">'
        for head, of in ((mark.format(__version__), ""), (mark.format("9.8.7"), "version 9.8.7"), ("<meta>", "an unknown version")):
            (self.page / "index.html").write_text(f"<html><head>{head}</head></html>")
            said = subprocess.run([self.tool, "--version"], capture_output=True, text=True, check=True).stdout
            note = f"the page beside this tool is of {of}, the tool of version {__version__}; install both from one release"
            self.assertEqual(said.splitlines(), [f"fingertip {__version__}"] + [note] * bool(of))

    def test_the_desktops_browser_opens_it(self):
        opener = self.folder / "bin/xdg-open"
        opened = self.folder / "opened"
        os.mkfifo(opened)
        opener.write_text(f'#!/bin/sh\nprintf "%s" "$1" > {opened}\n')
        opener.chmod(0o755)
        path = f"{opener.parent}:{os.environ['PATH']}"
        with self.served(DISPLAY=":0", PATH=path) as (_, port, _):
            self.assertEqual(opened.read_text(), f"http://127.0.0.1:{port}/")
        self.assertIn("opening it in the browser; Ctrl-C ends", self.said)
        for options, environment in ((["--no-browser"], {"DISPLAY": ":0"}), ([], {})):
            with self.served(*options, PATH=path, **environment):
                pass
            self.assertIn("open it in Chromium, Chrome or Edge", self.said)

    def test_a_connection_that_stays_does_not_keep_it_from_ending(self):
        with self.served() as (host, port, process):
            with socket.create_connection((host, port)) as silent:
                process.send_signal(signal.SIGINT)
                process.wait(PATIENCE_s)
                silent.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--fingertip", required=True)
    _, rest = parser.parse_known_args(namespace=TOOLS)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
