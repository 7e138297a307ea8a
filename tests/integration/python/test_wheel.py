"""Wheel and source distribution of the Python package, and its types: usage test_wheel.py FAKE_DEVICE [unittest arguments]."""

# real time: an installed wheel reads a pseudo-terminal
import os
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile

FAKE_DEVICE = os.path.abspath(sys.argv[1])
ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/support"))
from called import run  # noqa: E402
from real_time import plugged_in  # noqa: E402

PACKAGE = ROOT / "host_tools/python"
PATIENCE_s = 300


class Distribution(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))
        cls.source = cls.folder / "source"
        shutil.copytree(PACKAGE, cls.source, ignore=shutil.ignore_patterns("__pycache__"))
        cls.dist = cls.folder / "dist"
        cls.dist.mkdir()
        backend = f"from setuptools import build_meta as b; b.build_sdist({str(cls.dist)!r}); b.build_wheel({str(cls.dist)!r})"
        run(sys.executable, "-c", backend, cwd=cls.source)
        (cls.wheel,) = cls.dist.glob("*.whl")
        (cls.sdist,) = cls.dist.glob("*.tar.gz")

    def test_names(self):
        self.assertRegex(self.wheel.name, r"^fingertip_tactile-\d+\.\d+\.\d+-py3-none-any\.whl$")
        self.assertRegex(self.sdist.name, r"^fingertip[-_]tactile-\d+\.\d+\.\d+\.tar\.gz$")
        with zipfile.ZipFile(self.wheel) as wheel:
            names = set(wheel.namelist())
            (metadata,) = (wheel.read(name).decode() for name in names if name.endswith(".dist-info/METADATA"))
        files = [path for path in (PACKAGE / "fingertip").rglob("*.*") if path.suffix in (".py", ".json", ".msg", ".typed")]
        modules = {str(path.relative_to(PACKAGE)) for path in files}
        self.assertEqual({name for name in names if ".dist-info/" not in name}, modules)
        self.assertIn("fingertip/py.typed", names)
        for line in (r"Name: fingertip[-_]tactile", r"Requires-Dist: numpy", r"Requires-Dist: pyserial", r"Requires-Python: >=3.10"):
            self.assertRegex(metadata, f"(?m)^{line}")

    def test_the_source_distribution_builds_the_same_wheel(self):
        with tarfile.open(self.sdist) as file:
            file.extractall(self.folder / "sdist")
        (unpacked,) = (self.folder / "sdist").iterdir()
        again = self.folder / "again"
        again.mkdir()
        run(sys.executable, "-c", f"from setuptools import build_meta as b; b.build_wheel({str(again)!r})", cwd=unpacked)
        contents = [
            {name: wheel.read(name) for name in wheel.namelist()} for wheel in map(zipfile.ZipFile, (self.wheel, *again.glob("*.whl")))
        ]
        self.assertEqual(*contents)

    def test_in_a_clean_environment(self):
        clean = self.folder / "clean"
        run("/usr/bin/python3", "-m", "venv", clean)
        run(clean / "bin/python", *"-m pip --disable-pip-version-check".split(), "install", "--no-index", "--no-deps", self.wheel)
        (site,) = clean.glob("lib/python3*/site-packages")
        for module in ("numpy", "serial"):  # what pip would fetch
            place = pathlib.Path(run(sys.executable, "-c", f"import {module}; print({module}.__file__)").strip()).parent
            (site / module).symlink_to(place)
            for libraries in place.parent.glob(f"{module}.libs"):
                (site / libraries.name).symlink_to(libraries)
        scenario = self.folder / "demo.csv"
        run(clean / "bin/fingertip-scenario", "demo", "-o", scenario, "--seconds", "1", cwd=self.folder)
        self.assertTrue(scenario.read_text(encoding="utf-8").startswith("# fingertip-scenario 1\n"))
        for command in ([clean / "bin/fingertip-evaluate"], [clean / "bin/python", "-m", "fingertip", "evaluate"]):
            self.assertIn("usage: fingertip-evaluate", run(*command, "--help", cwd=self.folder))
        done = subprocess.run(
            [clean / "bin/fingertip-plot", "x.csv", "-o", "x.png"], capture_output=True, text=True, cwd=self.folder, timeout=PATIENCE_s
        )
        self.assertEqual((done.returncode, done.stderr), (1, "fingertip-plot: matplotlib is not installed: pip install matplotlib\n"))
        with plugged_in(FAKE_DEVICE, self.folder / "tty") as port:
            code = "import fingertip, sys\nwith fingertip.Fingertip(sys.argv[1]) as f: print(fingertip.__file__, len(f.read_block(20)))"
            where, count = run(clean / "bin/python", "-c", code, port, cwd=self.folder, env={"XDG_RUNTIME_DIR": str(self.folder)}).split()
            self.assertEqual((where.startswith(str(clean)), count), (True, "20"))


class Types(unittest.TestCase):
    PLATFORMS = ("linux",)

    def test_strict(self):
        for platform in self.PLATFORMS:
            with self.subTest(platform), tempfile.TemporaryDirectory(prefix="fingertip-test-") as folder:
                out = run(sys.executable, "-m", "mypy", "--platform", platform, "--cache-dir", folder, cwd=PACKAGE)
                self.assertRegex(out, r"no issues found in \d\d source files")


class TypesElsewhere(Types):
    PLATFORMS = ("darwin", "win32")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
