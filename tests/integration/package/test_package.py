"""The Debian packages: what lintian and piuparts say, and the tool used where nothing else is installed.

usage: test_package.py --cpack CPACK --build FOLDER --fingertip PROGRAM --fake-device PROGRAM
"""

# real time: an installed package records from a pseudo-terminal
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from called import run  # noqa: E402

TOOLS = argparse.Namespace()
PATIENCE_s = 600
USE = """#!/bin/sh
set -e
cd {packages}
fingertip --version > version
fingertip rule > rule
cmp rule /usr/lib/udev/rules.d/60-fingertip.rules
ldconfig -p > libraries
fingertip convert press.csv again.csv
"""


def system(name):
    lines = pathlib.Path("/etc/os-release").read_text().splitlines()
    return dict(line.split("=", 1) for line in lines if "=" in line)[name]


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="fingertip-test-")))
        run(TOOLS.cpack, "--config", pathlib.Path(TOOLS.build) / "CPackConfig.cmake", "-B", cls.folder / "packages")
        cls.packages = sorted((cls.folder / "packages").glob("*.deb"))

    def test_three_packages(self):
        names = [run("dpkg-deb", "--field", package, "Package").strip() for package in self.packages]
        version = run(TOOLS.fingertip, "--version").split()[1]
        self.assertEqual(names, ["fingertip", "libfingertip-dev", f"libfingertip{version.rsplit('.', 1)[0]}"])
        for package in self.packages:
            self.assertEqual(run("dpkg-deb", "--field", package, "Version").strip(), version)
        held = run("dpkg-deb", "--contents", self.packages[0])
        expected = """bin/fingertip lib/udev/rules.d/60-fingertip.rules lib/systemd/user/fingertip.service share/man/man1/fingertip.1.gz
            share/bash-completion/completions/fingertip share/doc/fingertip/mujoco/LICENSES_THIRD_PARTY.md"""
        for path in expected.split():
            self.assertIn(f"./usr/{path}\n", held)
        for path in (pathlib.Path(TOOLS.build) / "host_tools/web/page").rglob("*.*"):  # where it was built
            self.assertIn(f"./usr/share/fingertip/web/{path.relative_to(pathlib.Path(TOOLS.build) / 'host_tools/web/page')}\n", held)

    def test_lintian_is_content(self):
        if not shutil.which("lintian"):
            self.skipTest("lintian is not here")
        done = subprocess.run(["lintian", "--fail-on", "error,warning", *self.packages], capture_output=True, text=True, timeout=PATIENCE_s)
        self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)

    def test_in_a_bare_debian(self):
        """piuparts installs the packages into a new Debian, runs what post_install_... says, purges them, and tells what is left."""
        if os.geteuid() != 0 or not shutil.which("piuparts"):
            self.skipTest("a bare Debian needs root and piuparts")
        packages = self.packages[0].parent  # the same folder in there
        recording = self.record()
        shutil.copy(recording, packages / "press.csv")
        (packages / "Packages").write_text(run("dpkg-scanpackages", ".", cwd=packages))
        scripts = self.folder / "scripts"
        scripts.mkdir()
        (scripts / "post_install_fingertip").write_text(USE.format(packages=packages))
        (scripts / "post_install_fingertip").chmod(0o755)
        mirror = run("apt-get", "indextargets", "--format", "$(SITE)", "Created-By: Packages").splitlines()[0]
        options = ["-D", system("ID"), "-d", system("VERSION_CODENAME"), "-m", f"{mirror} main", "--no-eatmydata", "--no-upgrade-test"]
        folders = ["--bindmount", packages, "--testdebs-repo", packages, "--scriptsdir", scripts]
        run("piuparts", *options, *folders, *self.packages)
        self.assertEqual((packages / "version").read_text(), run(TOOLS.fingertip, "--version"))
        self.assertEqual((packages / "rule").read_text(), run(TOOLS.fingertip, "rule"))
        self.assertIn("libfingertip.so", (packages / "libraries").read_text())
        run(TOOLS.fingertip, "convert", recording, self.folder / "again.csv")
        there, here = (
            [line for line in path.read_text().splitlines() if "press.csv" not in line]  # where it came from
            for path in (packages / "again.csv", self.folder / "again.csv")
        )
        self.assertEqual(there, here)
        self.assertGreater(len(here), 100)

    def record(self):
        port, recording = self.folder / "tty", self.folder / "press.csv"
        device = subprocess.Popen([TOOLS.fake_device, port, "frames=300"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(device.wait)
        self.addCleanup(device.kill)
        end_s = time.monotonic() + PATIENCE_s
        while not os.path.lexists(port) and time.monotonic() < end_s:
            time.sleep(0.02)
        run("timeout", "-s", "INT", "20", TOOLS.fingertip, "record", recording, "--port", port, "--seconds", "1", "--until-gone")
        return recording


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name in ("cpack", "build", "fingertip", "fake-device"):
        parser.add_argument(f"--{name}", required=True)
    _, rest = parser.parse_known_args(namespace=TOOLS)
    unittest.main(argv=[sys.argv[0], *rest], verbosity=2)
