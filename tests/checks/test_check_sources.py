"""The source rules catch what they are for."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

from check_sources import waits

CHECK = pathlib.Path(__file__).with_name("check_sources.py")


class CheckSources(unittest.TestCase):
    def check(self, path, text):
        with tempfile.TemporaryDirectory() as root:
            (pathlib.Path(root) / "firmware").mkdir()
            file = pathlib.Path(root) / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
            done = subprocess.run([sys.executable, CHECK, root], capture_output=True, text=True)
            return done.returncode, done.stdout

    def assert_caught(self, path, text, word):
        code, output = self.check(path, text)
        self.assertEqual(code, 1, output)
        self.assertIn(f"{path}:1: ", output)
        self.assertIn(word, output)

    def test_each_rule_fires(self):
        for path in ("firmware/a/a.c", "boards/a/a.c"):
            self.assert_caught(path, '#include "../b/b.h"\n', "../")
        self.assert_caught("firmware/a/a.c", "static volatile int x;\n", "volatile")
        self.assert_caught("firmware/a/a.h", "double x;\n", "double")
        self.assert_caught("firmware/a/a.c", "void *p = malloc (4);\n", "allocate")
        self.assert_caught("firmware/a/a.c", "#include <stdio.h>\n", "stdio")
        self.assert_caught("firmware/a/a.c", "int *p = (int *)0x40044000;\n", "register")
        self.assert_caught("firmware/a/a.c", '#include "rp2040/i2c.h"\n', "boards")
        self.assert_caught("tests/a.py", "time.sleep(1)\n", "sleeps")
        self.assert_caught("host_tools/library/pad/a.cpp", '#include "simulation/twin/contact.hpp"\n', "simulation")

        for line in ("auto t = std::chrono::steady_clock::now();", "std::this_thread::sleep_for(PAUSE);", "poll(&waiting, 1, 100);"):
            self.assert_caught("host_tools/tool/cli/a.cpp", line + "\n", "libfingertip/clock.hpp")

    def test_who_measures_may_look_at_the_clock_and_all_may_ask_at_once(self):
        for path, line in (
            ("host_tools/report/a.cpp", "steady_clock::now();"),
            ("host_tools/library/libfingertip/clock.cpp", "steady_clock::now();"),
            ("host_tools/tool/cli/a.cpp", "poll(&asked, 1, 0);"),
        ):
            self.assertEqual(self.check(path, line + "\n")[0], 0, path)

    def test_comments_and_strings_are_free(self):
        code, output = self.check("firmware/a/a.c", '/* double\n volatile */ // malloc(1)\nchar s[] = "double";\n')
        self.assertEqual(code, 0, output)


class Waits(unittest.TestCase):
    def found(self, name, text):
        with tempfile.TemporaryDirectory() as root:
            path = pathlib.Path(root) / "tests" / name
            path.parent.mkdir()
            path.write_text(text)
            return [(str(where), number, what) for where, number, what in waits(pathlib.Path(root))]

    def test_each_way_to_wait_is_found(self):
        for name, line in (
            ("a.py", "    time.sleep(1)"),
            ("a.py", "    await asyncio.sleep(1)"),
            ("a.py", '    self.sh("sleep 4")'),
            ("a.cpp", "  std::this_thread::sleep_for(milliseconds(1));"),
            ("a.c", "  usleep(100);"),
            ("a.mjs", "await new Promise((r) => setTimeout(r, 25));"),
            ("a.sh", "while :; do sleep 0.1; done"),
        ):
            self.assertEqual(self.found(name, f"one\n{line}\n"), [(f"tests/{name}", 2, "sleep")], line)
        self.assertEqual(self.found("a.py", "def once_in_three():\n"), [("tests/a.py", 1, "retry")])

    def test_simulated_time_comments_and_a_file_about_real_time_are_free(self):
        for text in ("world.sleep(1)\ndef sleep(self):\n# time.sleep(1)\nasleep(3)\n", "# real time: of a kernel\ntime.sleep(1)\n"):
            self.assertEqual(self.found("a.py", text), [])


if __name__ == "__main__":
    unittest.main()
