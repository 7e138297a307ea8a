"""The test programs of a build tree, built again with something changed: their objects, archives and link lines are the build's."""

import concurrent.futures
import dataclasses
import hashlib
import json
import os
import pathlib
import re
import resource
import shlex
import subprocess
import tempfile

OURS = ("firmware/", "boards/")


class Stop(Exception):
    """What the user can mend, in one line."""


def digest(*parts):
    sha = hashlib.sha256()
    for part in parts:
        data = part if isinstance(part, bytes) else str(part).encode()
        sha.update(len(data).to_bytes(8, "little") + data)
    return sha.hexdigest()


def run(command, **how):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, errors="replace", **how)


@dataclasses.dataclass
class Object:
    output: str  # below the build tree
    source: pathlib.Path
    command: list  # without -o, -c, warnings and debugging
    depends: set  # files of this project, resolved, the source among them
    digest: str

    @property
    def includes(self):
        return [word for word in self.command if word.startswith(("-I", "-D", "-std="))]


@dataclasses.dataclass
class Program:
    name: str  # below the build tree
    link: list
    objects: list  # all that may be in it: its own and its archives'
    digest: str = ""
    time_s: float = 0
    lines: dict = dataclasses.field(default_factory=dict)  # {path below the root: lines that it runs}
    known: dict = dataclasses.field(default_factory=dict)  # {path: lines that have code}


class Built:
    """Programs of Unity in C that hold something of OURS."""

    def __init__(self, root, build):
        self.root, self.build = root, build
        self.digests = {}
        try:
            entries = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
        except OSError as error:
            raise Stop(f"{error.filename}: {error.strerror}; configure it: cmake --preset host") from None
        depends = self.read_depends()
        self.objects = {}
        for entry in entries:
            words = shlex.split(entry["command"])
            output, source = words[words.index("-o") + 1], pathlib.Path(entry["file"])
            if source.suffix != ".c" or output not in depends:
                continue
            if not source.is_relative_to(root) and "unity" not in source.name:
                continue
            at = words.index("-o")
            kept = [w for w in words[:at] + words[at + 2 :] if not w.startswith("-W") and w not in ("-g", "-c", entry["file"])]
            files = {path for path in depends[output] if path.is_relative_to(root) and not path.is_relative_to(root / "build")}
            self.objects[output] = Object(output, source, kept + ["-w"], files, digest(kept, *(self.content(f) for f in sorted(files))))
        self.programs = [program for program in map(self.program, self.names()) if any(self.is_ours(o.source) for o in program.objects)]
        if not self.programs:
            raise Stop(f"{build}: no test programs; build them: cmake --build {build}")

    def content(self, path):
        if path not in self.digests:
            self.digests[path] = digest(path.read_bytes())
        return self.digests[path]

    def is_ours(self, path):
        return path.is_relative_to(self.root) and str(path.relative_to(self.root)).startswith(OURS)

    def read_depends(self):
        """{object: files}, as the last build saw them."""
        done = run(["ninja", "-C", self.build, "-t", "deps"])
        found, resolved = {}, {}
        for line in done.stdout.splitlines():
            if line.startswith("    "):
                path = line.strip()
                if path not in resolved:
                    resolved[path] = (self.build / path).resolve()
                found[output].add(resolved[path])
            elif ":" in line:
                output = line.split(":")[0]
                found[output] = set()
        return found

    def names(self):
        found = {}
        for output in self.objects:
            match = re.fullmatch(r"(tests/(?:unit|integration)/.*)CMakeFiles/(test_\w+)\.dir/.*", output)
            if match:
                found["".join(match.groups())] = True
        return list(found)

    def program(self, name):
        lines = run(["ninja", "-C", self.build, "-t", "commands", name]).stdout.splitlines()
        link = [word for word in shlex.split(lines[-1]) if word not in (":", "&&", "-g")]
        link = [word for word in link if word != name and word != "-o"]
        found = {}
        for word in link:
            for o in [self.objects[word]] if word in self.objects else self.members(word) if word.endswith(".a") else []:
                found[o.output] = o
        objects = list(found.values())
        return Program(name, link, objects, digest(link, *(o.digest for o in objects)))

    def members(self, archive):
        folder, target = archive.rsplit("/", 1)
        prefix = f"{folder}/CMakeFiles/{target[3:-2]}.dir/"
        return [o for output, o in self.objects.items() if output.startswith(prefix)]


class Tree:
    """All objects and archives of the programs, with flags of its own, in a folder."""

    def __init__(self, built, folder, flags, jobs):
        self.built, self.folder, self.flags = built, folder, flags
        needed = {o.output: o for program in built.programs for o in program.objects}
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            list(pool.map(self.keep, needed.values()))
        for archive in {word for program in built.programs for word in program.link if word.endswith(".a")}:
            members = [folder / o.output for o in built.members(archive)]
            (folder / archive).unlink(missing_ok=True)
            (folder / archive).parent.mkdir(parents=True, exist_ok=True)
            done = run(["ar", "rcs", folder / archive, *members])
            if done.returncode:
                raise Stop(f"{archive}: {done.stderr.strip()}")

    def keep(self, object_):
        output = self.folder / object_.output
        stamp, wanted = output.with_name(output.name + ".digest"), digest(object_.digest, self.flags)
        if stamp.exists() and stamp.read_text() == wanted:
            return
        output.parent.mkdir(parents=True, exist_ok=True)
        done = run([*object_.command, *self.flags, "-c", object_.source, "-o", output], cwd=self.built.build)
        if done.returncode:
            raise Stop(f"{object_.source}: {done.stderr.strip()}")
        stamp.write_text(wanted)

    def link(self, program, output, changed=()):
        """changed: {object: file in its place}. Raises Stop if it does not link."""
        with tempfile.TemporaryDirectory(prefix="fingertip-link-") as work:
            words = []
            for word in program.link:
                if word in changed:
                    words.append(changed[word])
                elif word.endswith(".a"):
                    words.append(self.archive(word, changed, pathlib.Path(work)))
                else:
                    words.append(self.folder / word if word.endswith(".o") else word)
            done = run([*words, *self.flags, "-o", output], cwd=self.built.build)
            if done.returncode:
                raise Stop(f"{program.name}: {done.stderr.strip()}")

    def archive(self, name, changed, work):
        members = [o.output for o in self.built.members(name)]
        if not any(member in changed for member in members):
            return self.folder / name
        path = work / name.replace("/", "_")
        run(["ar", "rcs", path, *(changed.get(member, self.folder / member) for member in members)], check=True)
        return path


def limits(cpu_s):
    def set_limits():
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s))
        resource.setrlimit(resource.RLIMIT_AS, (2**32, 2**32))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    return set_limits


def fails(program, cpu_s, **how):
    """How it fails, as soon as it does; "" if it passes. Unity goes on after a failure: that is not waited for."""
    test = subprocess.Popen(
        ["stdbuf", "-oL", str(program)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        errors="replace",
        preexec_fn=limits(cpu_s),
        **how,
    )
    try:
        for line in test.stdout:
            found = re.search(r":(\w+):FAIL", line)
            if found:
                return found.group(1)
    finally:
        test.kill()
        test.stdout.close()
        status = test.wait()
    return "" if status == 0 else "time" if status in (-24, -9) else f"status {status}"


def cpu_of_children_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def cover(built, folder, jobs):
    """Fills in time_s, lines and known of each program."""
    tree = None
    for program in built.programs:
        kept = folder / "lines" / (program.name.replace("/", "_") + ".json")
        if kept.exists() and (found := json.loads(kept.read_text()))["digest"] == program.digest:
            pass
        else:
            tree = tree or Tree(built, folder / "coverage", ["--coverage"], jobs)
            found = {"digest": program.digest, **lines_of(built, tree, program)}
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_text(json.dumps(found))
        program.time_s = found["time_s"]
        program.lines = {path: set(lines) for path, lines in found["lines"].items()}
        program.known = {path: set(lines) for path, lines in found["known"].items()}


def lines_of(built, tree, program):
    lines, known = {}, {}
    with tempfile.TemporaryDirectory(prefix="fingertip-cover-") as work:
        work = pathlib.Path(work)
        tree.link(program, work / "test")
        begun_s = cpu_of_children_s()
        how = fails(work / "test", 3600, cwd=work, env={**os.environ, "GCOV_PREFIX": str(work)})
        time_s = cpu_of_children_s() - begun_s
        if how:
            raise Stop(f"{program.name} fails as it is: {how}")
        for o in program.objects:
            counts = work / str((tree.folder / o.output).with_suffix(".gcda")).lstrip("/")
            if not counts.exists():
                continue
            os.symlink((tree.folder / o.output).with_suffix(".gcno"), counts.with_suffix(".gcno"))
            done = run(["gcov", "--json-format", "--stdout", counts], cwd=work)
            for file in json.loads(done.stdout)["files"]:
                path = (built.build / file["file"]).resolve()
                if built.is_ours(path):
                    name = str(path.relative_to(built.root))
                    known.setdefault(name, set()).update(line["line_number"] for line in file["lines"])
                    lines.setdefault(name, set()).update(line["line_number"] for line in file["lines"] if line["count"])
    return {"time_s": time_s, "lines": {p: sorted(l) for p, l in lines.items()}, "known": {p: sorted(l) for p, l in known.items()}}
