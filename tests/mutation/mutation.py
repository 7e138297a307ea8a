#!/usr/bin/python3
"""Changes the firmware in one small place at a time and looks whether its unit tests notice.

    mutation.py --build build/host                                 650 mutants, spread evenly over the modules
    mutation.py --build build/host --count 100 --only scan usb     of these modules; --seed: others
    mutation.py --build build/host --file firmware/scan/scan.c     all mutants of one file

The tests must be built there and pass. A mutant is compiled into those test programs that run its line; what was found is kept in
build/mutation until the programs change. Changes that make no other code are left out. equivalent.txt says which survivors change
nothing that anybody could see, each with its reason; one that is not true any more is an error. Exit status 1 if more than
--most percent of the others survive.
"""

import argparse
import collections
import concurrent.futures
import json
import math
import os
import pathlib
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import built as builds  # noqa: E402
import equivalent  # noqa: E402
import mutants  # noqa: E402
from built import Stop, digest  # noqa: E402

ROOT = HERE.parents[1]
# Of headers only the code: tests take its constants from them too.
MUTATED = ("firmware/*/*.[ch]", "boards/pico_mux/mux_bus.c", "boards/pico_parallel/i2c_wave.c", "boards/pico_parallel/parallel_bus.c")
# A test that takes so much longer than it did hangs.
HANGS = 3
HANGS_s = 2
# As the preset sanitize runs the same tests; of those that survive without.
UNDEFINED = ["-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"]
LEFT_OUT = ("not compiled", "same code")


def module_of(path):
    return path.split("/")[1]


class Mutation:
    def __init__(self, build, folder, jobs):
        self.jobs = jobs
        self.built = builds.Built(ROOT, build)
        self.folder = folder
        builds.cover(self.built, folder, jobs)
        self.tree = builds.Tree(self.built, folder / "objects", [], jobs)
        for program in self.built.programs:  # by its code, so that a comment makes it no other
            program.digest = digest(
                program.link,
                *((self.tree.folder / o.output).read_bytes() for o in program.objects if not o.output.endswith("build_info.c.o")),
            )
        self.names, self.lock = {}, threading.Lock()
        self.kept = {}
        self.kept_file = folder / "kept.json"
        if self.kept_file.exists():
            self.kept = json.loads(self.kept_file.read_text(encoding="utf-8"))

    def objects_of(self, path):
        file = ROOT / path
        return [o for o in self.built.objects.values() if file in o.depends and any(o in p.objects for p in self.built.programs)]

    def find(self, path):
        for o in self.objects_of(path):
            if path.endswith(".c") or self.built.is_ours(o.source):
                found = mutants.find(ROOT, path, o.source, o.includes)
                return [m for m in found if path.endswith(".c") or m.function and not m.in_macro]
        return []

    def find_all(self, paths):
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            found = dict(zip(paths, pool.map(self.find, paths)))
        for own in found.values():
            seen = collections.Counter()
            for mutant in own:
                seen[mutant.key] += 1
                self.names[mutant] = digest(mutant.key, seen[mutant.key])
        return found

    def programs_for(self, mutant):
        """Those that run its line, the fastest first."""
        programs = [p for p in self.built.programs if p.lines.get(mutant.path)]
        if not programs:  # nothing in it runs: a table
            programs = [p for p in self.built.programs if any(ROOT / mutant.path in o.depends for o in p.objects)]
        if not mutant.in_macro and mutant.function:
            known = {line for p in programs for line in p.known.get(mutant.path, ()) if line <= mutant.line}
            line = max(known, default=0)
            programs = [p for p in programs if line in p.lines.get(mutant.path, ())]
        return sorted(programs, key=lambda program: program.time_s)

    def judge(self, mutant):
        """ "not compiled", "same code", "survived", or who killed it."""
        programs = self.programs_for(mutant)
        with self.lock:
            kept = self.kept.setdefault(self.names[mutant], {})
        for program in programs:
            if kept.get(program.digest):
                return kept[program.digest]
        missing = [program for program in programs if program.digest not in kept]
        return self.run(mutant, programs, missing, kept) if missing or not programs else "survived"

    def run(self, mutant, programs, missing, kept):
        text = (ROOT / mutant.path).read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory(prefix="fingertip-mutant-") as work:
            work = pathlib.Path(work)
            file = work / "source" / mutant.path.split("/", 1)[1]
            file.parent.mkdir(parents=True)
            file.write_text(text[: mutant.begin] + mutant.text + text[mutant.end :])
            changed = self.compile(mutant, file, programs, [])
            if changed is None:
                return self.note(kept, programs, "not compiled")
            if programs and not changed:
                return self.note(kept, programs, "same code")
            for program in missing:
                if how := self.fails(program, changed, work):
                    return self.note(kept, [program], how)
            checked = self.compile(mutant, file, programs, UNDEFINED)
            for program in missing:
                if how := self.fails(program, checked, work):
                    return self.note(kept, [program], how)
            self.note(kept, missing, "")
        return "survived"

    def compile(self, mutant, file, programs, flags):
        """{object: file} of those that became another; None if it cannot be."""
        changed = {}
        for o in self.objects_of(mutant.path):
            if not any(o in program.objects for program in programs):
                continue
            output = file.parents[2] / digest(o.output, flags)[:8] / pathlib.Path(o.output).name
            output.parent.mkdir()
            source = file if mutant.path.endswith(".c") else o.source
            done = builds.run([*o.command, *flags, "-iquote", file.parents[2] / "source", "-c", source, "-o", output], cwd=self.built.build)
            if done.returncode:
                return None
            if flags or output.read_bytes() != (self.tree.folder / o.output).read_bytes():
                changed[o.output] = output
        return changed

    def fails(self, program, changed, work):
        if not any(o.output in changed for o in program.objects):
            return ""
        self.tree.link(program, work / "test", changed)
        how = builds.fails(work / "test", math.ceil(HANGS * program.time_s) + HANGS_s, cwd=work)
        return how and f"{program.name.rsplit('/', 1)[-1]}: {how}"

    def note(self, kept, programs, how):
        """ "": survived this one."""
        with self.lock:
            kept.update({program.digest: how for program in programs})
        return how

    def judge_all(self, chosen):
        """(mutant, what became of it) as they come; keeps it."""
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            futures = {pool.submit(self.judge, mutant): mutant for mutant in chosen}
            try:
                for i, future in enumerate(concurrent.futures.as_completed(futures), 1):
                    yield futures[future], future.result()
                    if i % 50 == 0:
                        self.keep()
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
            finally:
                self.keep()

    def keep(self):
        with self.lock:
            self.kept_file.write_text(json.dumps(self.kept), encoding="utf-8")


def shares(sizes, count):
    """So many of each: the same, but for those that have less."""
    left, given = dict(sizes), {}
    while left:
        share = (count - sum(given.values())) / len(left)
        small = {name: size for name, size in left.items() if size <= share}
        if not small:
            names = sorted(left)
            rest = count - sum(given.values()) - math.floor(share) * len(names)
            given.update({name: math.floor(share) + (i < rest) for i, name in enumerate(names)})
            break
        given.update(small)
        left = {name: size for name, size in left.items() if name not in small}
    return given


def in_order(found, seed):
    """The mutants of one module, one of each file after another, those of a file as the seed has it."""
    queues = []
    for path in sorted(found):
        seen = collections.Counter()
        keyed = []
        for mutant in found[path]:
            seen[mutant.key] += 1
            keyed.append((digest(seed, mutant.key, seen[mutant.key]), mutant))
        queues.append([mutant for _, mutant in sorted(keyed, key=lambda pair: pair[0])])
    return [queue[i] for i in range(max(map(len, queues), default=0)) for queue in queues if i < len(queue)]


def sample(mutation, found, count, seed, tell):
    """{mutant: what became of it}, without those that are left out."""
    modules = collections.defaultdict(dict)
    for path, own in found.items():
        modules[module_of(path)][path] = own
    waiting = {name: in_order(own, seed) for name, own in modules.items()}
    judged = {name: {} for name in modules}
    while True:
        share = shares({name: len(judged[name]) + len(waiting[name]) for name in modules}, count)
        chosen = {}
        for name in modules:
            wanted = share[name] - len(judged[name])
            chosen.update({mutant: name for mutant in waiting[name][: max(0, wanted)]})
            waiting[name] = waiting[name][max(0, wanted) :]
        if not chosen:
            return {mutant: how for own in judged.values() for mutant, how in own.items()}
        for mutant, how in mutation.judge_all(chosen):
            if how not in LEFT_OUT:
                judged[chosen[mutant]][mutant] = how
            tell(mutant, how)


def summary(judged, known):
    """Rows by module, and the survivors without an explanation."""
    rows, survivors = [], []
    for name in sorted({module_of(mutant.path) for mutant in judged}):
        own = {mutant: how for mutant, how in judged.items() if module_of(mutant.path) == name}
        survived = [mutant for mutant, how in own.items() if how == "survived"]
        unexplained = [mutant for mutant in survived if mutant.key not in known]
        survivors += unexplained
        rows.append(
            {
                "module": name,
                "mutants": len(own) - len(survived) + len(unexplained),
                "survived": len(unexplained),
                "set_apart": len(survived) - len(unexplained),
            }
        )
    wrong = [mutant for mutant, how in judged.items() if how != "survived" and mutant.key in known]
    total = sum(row["mutants"] for row in rows)
    return (
        {
            "mutants": total,
            "mutants_survived": len(survivors),
            "mutants_set_apart": sum(row["set_apart"] for row in rows),
            "mutants_survived_percent": round(100 * len(survivors) / max(1, total), 2),
            "mutation_modules": rows,
        },
        survivors,
        wrong,
    )


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, type=pathlib.Path, metavar="DIR")
    parser.add_argument("--count", type=int, default=650, metavar="N", help="mutants in all (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the choice (default: %(default)s)")
    parser.add_argument("--only", nargs="+", metavar="MODULE", help="folders of firmware/ and boards/")
    parser.add_argument("--file", metavar="FILE", help="all mutants of this one")
    parser.add_argument("--most", type=float, default=5, metavar="PERCENT", help="that may survive (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="at a time (default: %(default)s)")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="what was found")
    options = parser.parse_args(argv)

    begun_s = time.monotonic()
    paths = sorted(str(path.relative_to(ROOT)) for pattern in MUTATED for path in ROOT.glob(pattern))
    modules = {module_of(path) for path in paths}
    for name in options.only or ():
        if name not in modules:
            raise Stop(f"no module {name}; there are: {', '.join(sorted(modules))}")
    if options.file and options.file not in paths:
        raise Stop(f"{options.file} is not mutated; firmware's sources are, and the buses")
    paths = [path for path in paths if path == options.file or not options.file and (not options.only or module_of(path) in options.only)]

    known = equivalent.read(HERE / "equivalent.txt")
    mutation = Mutation(options.build.resolve(), ROOT / "build/mutation", options.jobs)
    found = mutation.find_all(paths)
    stale = equivalent.stale(known, found)
    if stale:
        raise Stop("\n".join(["equivalent.txt speaks of what is not there any more:", *stale]))

    def tell(mutant, how):
        if how == "survived" and mutant.key not in known:
            print(f"survived: {mutant.path}:{mutant.line} {mutant.function}\n  - {mutant.before}\n  + {mutant.after}", flush=True)

    count = sum(map(len, found.values())) if options.file else options.count
    judged = sample(mutation, found, count, options.seed, tell)
    result, survivors, wrong = summary(judged, known)
    if wrong:
        raise Stop("\n".join(["equivalent.txt calls the same what a test tells apart:", *(mutant.key for mutant in wrong)]))
    for row in result["mutation_modules"]:
        print(f"{row['module']:14s} {row['mutants']:5d} mutants {row['survived']:4d} survived {row['set_apart']:4d} set apart")
    print(
        f"{result['mutants']} mutants, {result['mutants_survived']} survived ({result['mutants_survived_percent']} %), "
        f"{result['mutants_set_apart']} set apart as equivalent, {time.monotonic() - begun_s:.0f} s"
    )
    if options.json:
        unexplained = [{"file": m.path, "line": m.line, "before": m.before, "after": m.after} for m in survivors]
        result.update(mutation_seed=options.seed, mutants_possible=sum(map(len, found.values())), mutation_survivors=unexplained)
        options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return 1 if result["mutants_survived_percent"] > options.most else 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except (Stop, mutants.NoTree) as stop:
        sys.exit(f"mutation.py: {stop}")
