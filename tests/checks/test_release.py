"""What a release is made by: version.py and release.py."""

import gzip
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cmake"))
import release  # noqa: E402
import version  # noqa: E402


class Folder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))


class Version(Folder):
    def setUp(self):
        super().setUp()
        for name in {"CMakeLists.txt", "CHANGELOG.md", *(name for name, _ in version.COPIES)}:
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.folder / name)
        self.number = version.version(ROOT)

    def change(self, name, old, new):
        path = self.folder / name
        text = path.read_text(encoding="utf-8")
        self.assertIn(old, text)
        path.write_text(text.replace(old, new, 1), encoding="utf-8")

    def test_each_copy_is_compared_and_written(self):
        self.change("CMakeLists.txt", f"VERSION {self.number}", "VERSION 7.8.9")
        self.change("CHANGELOG.md", f"## [{self.number}]", "## [7.8.9]")
        with self.assertRaises(SystemExit) as raised:
            version.main(["--check"], self.folder)
        for name, _ in version.COPIES:
            self.assertIn(name, str(raised.exception))
        version.main([], self.folder)
        self.assertEqual(version.main(["--check"], self.folder), 0)
        self.assertEqual((self.folder / "host_tools/python/fingertip/version.py").read_text(), '__version__ = "7.8.9"\n')
        lock = (self.folder / "host_tools/web/package-lock.json").read_text()
        self.assertEqual(lock.count('"version": "7.8.9"'), 2)
        self.assertEqual(lock.replace("7.8.9", self.number), (ROOT / "host_tools/web/package-lock.json").read_text())

    def test_what_changed_is_written_down(self):
        self.change("CHANGELOG.md", f"## [{self.number}]", "## [0.0.1]")
        with self.assertRaisesRegex(SystemExit, f"CHANGELOG.md begins with version 0.0.1, not with {self.number}"):
            version.main(["--check"], self.folder)


class Release(Folder):
    def test_an_archive_is_of_names_and_contents_alone(self):
        archives = []
        for place, order, time_s in (("one", "ab", 1), ("two", "ba", 2_000_000_000)):
            tree = self.folder / place
            (tree / "in").mkdir(parents=True)
            for name in order:
                (tree / "in" / name).write_text(name)
                os.utime(tree / "in" / name, (time_s, time_s))
                (tree / "in" / name).chmod(0o600 if place == "two" else 0o664)
            archives.append(release.packed(release.folder_as_tar(tree, "page", 5)))
        self.assertEqual(archives[0], archives[1])
        (self.folder / "two/in/a").write_text("c")
        self.assertNotEqual(gzip.decompress(archives[0]), release.folder_as_tar(self.folder / "two", "page", 5))

    def test_addresses_are_not_random(self):
        """clang 14 compiled judges.wasm in two ways by them."""
        where = "import sys; sys.path.insert(0, %r); import release, subprocess; release.fix_addresses();" % str(ROOT / "cmake")
        where += "print(len({subprocess.run([sys.executable, '-c', 'print(id([]))'], capture_output=True).stdout for _ in range(4)}))"
        done = subprocess.run([sys.executable, "-c", where], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue("keeps addresses random" in done.stderr or done.stdout == "1\n", done)

    def test_the_folder_of_a_build_has_a_name_as_long_each_time(self):
        """In folders named `first` and `a_second_one` clang 14 compiled judges.wasm in two ways, without random addresses too."""
        folders = [release.work_folder() for _ in range(3)]
        for folder in folders:
            folder.rmdir()
        self.assertEqual(len(set(folders)), 3)
        self.assertEqual(len({len(str(folder)) for folder in folders}), 1)

    def test_every_board_in_every_scene(self):
        self.assertLessEqual({"pico_mux", "pico_parallel"}, set(release.boards(ROOT)))
        self.assertEqual(release.scenes(ROOT), ["raw", "press", "slip", "grasp", "shapes", "paper"])

    def test_what_it_refuses(self):
        tree = self.folder / "tree"
        (tree / "cmake").mkdir(parents=True)
        shutil.copy(ROOT / "cmake/release.py", tree / "cmake")

        def git(*words):
            subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b.example", *words], cwd=tree, check=True, capture_output=True)

        def refused(*words):
            done = subprocess.run([sys.executable, tree / "cmake/release.py", *words], capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            return done.stderr

        git("init", "-q")
        git("add", ".")
        git("commit", "-q", "-m", "first")
        self.assertIn("is there already; give another folder", refused(self.folder))
        with open(tree / "cmake/release.py", "a", encoding="utf-8") as file:
            file.write("\n")
        self.assertIn("changes that are in no commit", refused(self.folder / "out"))
        self.assertFalse((self.folder / "out").exists())
        self.assertIn("release.py FOLDER", refused())


if __name__ == "__main__":
    unittest.main(verbosity=2)
