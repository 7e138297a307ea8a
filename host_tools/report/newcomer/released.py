"""Whether a release is the same bytes each time that it is built: cmake/release.py twice, into folders of different names."""

import os
import pathlib
import subprocess
import sys
import tempfile

from fingertip.files import InputError

ROOT = pathlib.Path(__file__).resolve().parents[3]
GOALS = (("release_differs", "<=", 0),)
wanted = False  # it takes half an hour on two cores that others use too


def sums(folder):
    """Name to hash."""
    lines = (folder / "SHA256SUMS").read_text(encoding="ascii").splitlines()
    return {name: found for found, name in (line.split("  ", 1) for line in lines)}


def differing(one, other):
    return sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))


def last_commit():
    return subprocess.run(["git", "-C", ROOT, "rev-parse", "HEAD"], capture_output=True, text=True, check=True).stdout


def measure(_, steps):
    if not wanted:
        return {"release_differs": None, "release_files": None, "release_that_differ": None}
    commit = last_commit()
    with tempfile.TemporaryDirectory(prefix="fingertip-") as folder:
        found = []
        for name in ("first", "a_second_one"):
            out = pathlib.Path(folder) / name
            done = subprocess.run(
                [sys.executable, ROOT / "cmake/release.py", out],
                capture_output=True,
                text=True,
                check=False,
                env={**os.environ, "CCACHE_DISABLE": "1"},
            )  # the second is compiled again, too
            if done.returncode != 0:
                raise InputError(done.stderr.strip())
            found.append(sums(out))
            if last_commit() != commit:
                raise InputError(
                    "a commit was made between the two releases, which are of the last one; run again and commit when it is done"
                )
            steps.say(f"a release of {len(found[-1])} files")
    differ = differing(*found)
    return {"release_differs": len(differ), "release_files": len(found[0]), "release_that_differ": differ}


def text(_):
    return [
        "## A release",
        "",
        "`cmake/release.py` builds the last commit twice, in folders of different names. `release_differs` counts the files whose SHA-256 differs: source, "
        "firmware of every board and scene, Debian packages, wheel, page.",
        "",
    ]
