"""The picture of the house shows what the CMake lists say."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

import rooms

FIRMWARE = "ft_library(common SOURCES a.c)\nft_library(fit SOURCES b.c c.c DEPENDS common)\n"
LIBRARY = "add_library(low STATIC a.cpp)\ntarget_link_libraries(low PUBLIC ft_fit)  # not high\n"
TOOL = "set(low ${CMAKE_SOURCE_DIR}/host_tools/low)\nadd_executable(tool main.cpp ${low}/a.cpp)\n"


def lists(**texts):
    places = {"firmware": "firmware", "low": "host_tools/low", "high": "host_tools/high", "tool": "host_tools/tool"}
    return {pathlib.PurePosixPath(places[name], "CMakeLists.txt"): text for name, text in texts.items()}


class Rooms(unittest.TestCase):
    def test_libraries_and_sources_of_others_are_needs_and_comments_are_not(self):
        high = "add_library(high STATIC b.cpp)\ntarget_link_libraries(high PRIVATE low ft_common)\n"
        self.assertEqual(
            rooms.needs(lists(firmware=FIRMWARE, low=LIBRARY, high=high, tool=TOOL)),
            {
                "firmware/common": set(),
                "firmware/fit": {"firmware/common"},
                "host_tools/low": {"firmware/fit"},
                "host_tools/high": {"host_tools/low", "firmware/common"},
                "host_tools/tool": {"host_tools/low"},
            },
        )

    def test_a_need_that_follows_from_another_is_left_out(self):
        needs = {"host_tools/b": {"host_tools/a", "firmware/c"}, "host_tools/a": {"firmware/c"}, "firmware/c": set()}
        self.assertEqual(rooms.picture(needs), "    b           a\n    a           firmware/c\n    firmware/c\n")

    def run_in(self, folder, *options):
        return subprocess.run([sys.executable, rooms.__file__, folder, *options], capture_output=True, text=True, check=False)

    def test_an_old_picture_and_a_circle_fail(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name in ("low", "high"):
                (root / "host_tools" / name).mkdir(parents=True)
            low, page = root / "host_tools/low/CMakeLists.txt", root / "CONTRIBUTING.md"
            low.write_text("add_library(low STATIC a.cpp)\n")
            (root / "host_tools/high/CMakeLists.txt").write_text("add_library(high STATIC b.cpp)\ntarget_link_libraries(high PUBLIC low)\n")
            page.write_text("before\n" + "".join(rooms.MARKS) + "after\n")
            self.assertIn("is not that of the CMake lists", self.run_in(root, "--check").stderr)
            self.assertEqual(page.read_text(), "before\n" + "".join(rooms.MARKS) + "after\n")
            self.assertEqual(self.run_in(root).returncode, 0)
            self.assertEqual(page.read_text(), "before\n" + ("\n    high  low\n    low\n\n").join(rooms.MARKS) + "after\n")
            self.assertEqual(self.run_in(root, "--check").returncode, 0)
            low.write_text("add_library(low STATIC a.cpp)\ntarget_link_libraries(low PUBLIC high)\n")
            self.assertIn("host_tools/high, host_tools/low", self.run_in(root, "--check").stderr)
            page.write_text("no mark\n")
            low.write_text("add_library(low STATIC a.cpp)\n")
            self.assertIn("needs each of the marks", self.run_in(root, "--check").stderr)


if __name__ == "__main__":
    unittest.main()
