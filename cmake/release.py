#!/usr/bin/python3
"""Builds all that a release has, from the last commit and from nothing else.

    release.py FOLDER    makes FOLDER with the files, and SHA256SUMS

    fingertip-V.tar.gz                    the source
    fingertip-V-BOARD-SCENE.uf2           firmware: every board in every scene
    fingertip_V_ARCH.deb and two more     tool, library, development
    fingertip_tactile-V-...whl            Python
    fingertip-V-page.tar.gz               the page, for any server
    fingertip-V-BOARD-circuit.tar.gz      circuit board: Gerbers, parts and placement; where KiCad 6 is installed

The same commit gives the same bytes, in whatever folder. Times are that of the commit. It is built in a temporary folder, which stays there if
something fails. clang 14 orders the landing pads of wasm32 by addresses in its memory. So compilers run without random ones, and the name of that
folder is always as long: the names of files are in that memory, too.
"""

import ctypes
import gzip
import hashlib
import io
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
ADDR_NO_RANDOMIZE = 0x0040000  # linux/personality.h


def fix_addresses():
    """Of this process's children. Where the system refuses it the release is as good, but not the same bytes each time."""
    if ctypes.CDLL(None, use_errno=True).personality(ADDR_NO_RANDOMIZE) < 0:
        print("release.py: this system keeps addresses random, so another build of this commit may differ in judges.wasm", file=sys.stderr)


def work_folder():
    return pathlib.Path(tempfile.mkdtemp(prefix="fingertip-release-"))


def run(*command, **how):
    done = subprocess.run([str(word) for word in command], capture_output=True, **how)
    if done.returncode:
        sys.exit(f"release.py: {' '.join(map(str, command))} failed\n{(done.stdout + done.stderr).decode(errors='replace')[-2000:]}")
    return done.stdout


def packed(tar):
    """The bytes of a tar archive, compressed without a time."""
    out = io.BytesIO()
    with gzip.GzipFile(fileobj=out, mode="wb", mtime=0) as file:
        file.write(tar)
    return out.getvalue()


def folder_as_tar(folder, prefix, time_s):
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w", format=tarfile.PAX_FORMAT) as tar:
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            entry = tarfile.TarInfo(f"{prefix}/{path.relative_to(folder)}")
            entry.size, entry.mtime, entry.mode = path.stat().st_size, time_s, 0o644
            with open(path, "rb") as file:
                tar.addfile(entry, file)
    return out.getvalue()


def scenes(source):
    return re.search(r"^set\(FINGERTIP_SCENES (.*)\)$", (source / "cmake/options.cmake").read_text(encoding="utf-8"), re.M)[1].split()


def boards(source):
    return sorted(path.parent.name for path in source.glob("boards/*/board.json") if "bus" in json.loads(path.read_text(encoding="utf-8")))


def main(argv):
    if len(argv) != 1 or argv[0].startswith("-"):
        sys.exit(__doc__)
    out = pathlib.Path(argv[0]).resolve()
    if out.exists():
        sys.exit(f"release.py: {out} is there already; give another folder")
    if run("git", "status", "--porcelain", "--untracked-files=no", cwd=ROOT).strip():
        sys.exit("release.py: there are changes that are in no commit; commit them first")
    run(sys.executable, ROOT / "cmake/version.py", "--check")
    version = run(sys.executable, ROOT / "cmake/version.py", "--print").decode().strip()
    time_s = int(run("git", "log", "-1", "--format=%ct", cwd=ROOT))
    os.environ |= {"SOURCE_DATE_EPOCH": str(time_s), "TZ": "UTC", "LC_ALL": "C.UTF-8", "PYTHONDONTWRITEBYTECODE": "1"}
    os.umask(0o022)
    fix_addresses()
    out.mkdir(parents=True)
    name, work = f"fingertip-{version}", work_folder()
    source = work / name
    run("git", "clone", "--quiet", "--shared", "--config", "core.fileMode=true", ROOT, source)
    run("git", "checkout", "--quiet", "--detach", run("git", "rev-parse", "HEAD", cwd=ROOT).decode().strip(), cwd=source)
    # Folders in debug information would change what identifies a program.
    flags = f"-ffile-prefix-map={source}=."
    (out / f"{name}.tar.gz").write_bytes(packed(run("git", "archive", "--format=tar", f"--prefix={name}/", "HEAD", cwd=source)))

    release_for_chip = ["-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_TOOLCHAIN_FILE={source}/cmake/toolchain-arm-none-eabi.cmake"]
    for board in boards(source):
        for scene in scenes(source):
            print(f"firmware: {board}, {scene}", flush=True)
            build = work / f"{board}-{scene}"
            options = [*release_for_chip, f"-DFINGERTIP_BOARD={board}", f"-DFINGERTIP_SCENE={scene}"]
            run("cmake", "-G", "Ninja", "-S", source, "-B", build, *options)
            run("cmake", "--build", build, "--target", f"fingertip-{board}")
            shutil.copy(build / f"fingertip-{board}.uf2", out / f"{name}-{board}-{scene}.uf2")

    print("tool, library and page", flush=True)
    mujoco = source / "build/mujoco"
    exactly = ("--quiet", "--require-hashes", "--no-deps")
    run(sys.executable, "-m", "pip", "install", *exactly, "--target", mujoco, "-r", source / "cmake/mujoco.txt")
    build = source / "build/host"
    options = ["-DBUILD_TESTING=OFF", "-DFINGERTIP_WEB=ON", "-DFINGERTIP_IMAGES="]
    run("cmake", "--preset", "host", *options, *(f"-DCMAKE_{language}_FLAGS={flags}" for language in ("C", "CXX")), cwd=source)
    run("cmake", "--build", build)
    (out / f"{name}-page.tar.gz").write_bytes(packed(folder_as_tar(build / "host_tools/web/page", f"{name}-page", time_s)))
    run("cpack", "--config", build / "CPackConfig.cmake", "-B", work / "packages")
    for package in (work / "packages").glob("*.deb"):
        shutil.copy(package, out)

    print("Python package", flush=True)
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", work / "wheel", source / "host_tools/python")
    for wheel in (work / "wheel").glob("*.whl"):
        shutil.copy(wheel, out)

    if pathlib.Path("/usr/lib/python3/dist-packages/pcbnew.py").exists():
        print("circuit boards", flush=True)
        run("/usr/bin/python3", source / "boards/drawing/fabricate.py", work / "circuit")
        for folder in (work / "circuit").iterdir():
            whole = f"{name}-{folder.name}-circuit"
            (out / f"{whole}.tar.gz").write_bytes(packed(folder_as_tar(folder, whole, time_s)))

    files = sorted(path for path in out.iterdir() if path.is_file())
    sums = "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files)
    (out / "SHA256SUMS").write_text(sums, encoding="ascii")
    shutil.rmtree(work)
    print(f"{len(files)} files in {out}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
