"""What every report does besides measuring: its options, its steps, its files, and how it ends."""

import argparse
import concurrent.futures
import json
import math
import pathlib
import shutil
import subprocess
import threading
import time

import page
import text
from boards import ROOT, TO_BUILD
from fingertip.command import check_output
from fingertip.files import InputError, write_text
from presentation import judge, missed, print_goals


def option_parser(description, boards=False):
    """With the options that every report has; boards: and that of reports with images."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, metavar="DIR", help="build folder of the host tools")
    parser.add_argument("-o", "--output", required=True, metavar="DIR")
    parser.add_argument("--picture", metavar="FILE.png", help="a second copy of the picture, the first if there are several")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a goal is missed")
    if boards:
        parser.add_argument("--boards", default=ROOT / "build", metavar="DIR", help="folder of the boards' builds; default %(default)s")
    return parser


def output_folder(options):
    """There; called before anything is measured, so that a wrong place costs no time."""
    if options.picture:
        check_output(options.picture)
    out = pathlib.Path(options.output)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{out}: {error.strerror}; choose another place") from None
    return out


def run(*call):
    """What it printed."""
    done = subprocess.run([str(part) for part in call], capture_output=True, text=True)
    if done.returncode != 0:
        shown = " ".join(str(part) for part in call[:3])
        raise InputError(f"{shown} ... failed: {(done.stderr or done.stdout).strip()[-500:]}")
    return done.stdout


def built(build, *path):
    """A file of a build folder."""
    path = pathlib.Path(build, *path)
    if not path.is_file():
        raise InputError(f"{path} is not there; {TO_BUILD}")
    return path


class Steps:
    """Runs what is to be done, some at a time, and reports what is done and when."""

    def __init__(self):
        self.start_s = time.monotonic()
        self.lock = threading.Lock()

    def report(self, what):
        with self.lock:
            print(f"{time.monotonic() - self.start_s:5.0f} s  {what}", flush=True)

    def run_all(self, jobs, workers=2):
        """jobs: key -> (what, function). key -> result."""

        def one(what, function):
            result = function()
            self.report(what)
            return result

        with concurrent.futures.ThreadPoolExecutor(workers) as pool:
            futures = {key: pool.submit(one, *job) for key, job in jobs.items()}
            try:
                return {key: future.result() for key, future in futures.items()}
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise


def finite(value):
    """For JSON, which has no infinity."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_json(path, found):
    write_text(path, json.dumps(finite(found), indent=1) + "\n")


def finish(found, options, files):
    """Prints the figures and makes the page again. files: in the output folder, all that was written; the first picture goes to
    --picture, too. Exit status."""
    out = pathlib.Path(options.output)
    if options.picture:
        picture = out / next(name for name in files if name.endswith(".png"))
        if picture.resolve() != pathlib.Path(options.picture).resolve():
            shutil.copyfile(picture, options.picture)
    print_goals(found)
    print(f"report: {', '.join(str(out / name) for name in files)}")
    print(f"page: {page.write(out)}")
    return 1 if options.check and missed(found) else 0


def publish(found, options, name, pictures, pictured=()):
    """Writes NAME.json, NAME.md and the pictures of judged figures, and ends. pictures: {file: draw(path)}; pictured: tables that only they show. Exit
    status."""
    out = pathlib.Path(options.output)
    write_json(out / f"{name}.json", found)
    text.write(found, name, out, pictured)
    for file, draw in pictures.items():
        draw(out / file)
    return finish(found, options, (f"{name}.json", f"{name}.md", *pictures))


def figures_printed(name, command):
    """The JSON that a program prints; its progress goes to stderr as it comes."""
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise InputError(f"{name} ended with status {done.returncode}; its own words are above")
    try:
        return json.loads(done.stdout)
    except ValueError as error:
        raise InputError(f"{name} wrote no JSON ({error})") from None


def figures_kept(path, names):
    """These figures of a file, None where it is not there."""
    try:
        found = json.loads(path.read_text())
    except OSError:
        found = {}
    return {name: found.get(name) for name in names}


def positive(text):
    """The type of an option that is a number of things."""
    if (value := int(text)) < 1:
        raise argparse.ArgumentTypeError("must be 1 or more")
    return value


def given(options, *names):
    """Those of these options that the user has set."""
    return {name: value for name in names if (value := getattr(options, name)) is not None}


def contacts_of(options):
    """The firmware, the twin and their contacts (measure/contacts.py) of the build folder."""
    from contacts import Contacts

    return Contacts(options.build)


def add_parts(parser, name, parts):
    parser.add_argument("--parts", metavar="NAME,...", help=f"only these of {','.join(parts)}; the others from the folder's {name}.json")


def report_of_parts(options, name, parts, goals, measure, pages, derive=lambda found, out: {}):
    """A report of parts that run one after the other: those of --parts, or the usual ones, or all. parts: what each does; measure[part](options) ->
    figures; derive(found, out) -> figures that follow from others; pages: the module that draws name.png, and names in PICTURED the tables that only
    the picture shows. Exit status."""
    chosen = options.parts.split(",") if options.parts else list(parts)
    if unknown := [part for part in chosen if part not in parts]:
        raise InputError(f"--parts: {unknown[0]} is none of {','.join(parts)}")
    out = output_folder(options)
    path = out / f"{name}.json"
    found = {figure: None for figure, _, _ in goals}
    if options.parts and path.is_file():
        found |= json.loads(path.read_text())
    for part in chosen:
        print(f"        {parts[part]}", flush=True)
        found |= measure[part](options)
        found = judge({**found, **derive(found, out)}, goals)
        write_json(path, found)  # what is found is kept though a later part fails
    return publish(found, options, name, {f"{name}.png": lambda path: pages.draw(found, path)}, pages.PICTURED)
