"""One corpus of recordings, lines and settings, good and damaged, through the library, the Python package and the page: the same answer, or the
same refusal. usage: formats.py FINGERTIP BY_LIBRARY [--page FOLDER] [--json FILE] [--keep FOLDER]
"""

import argparse
import collections
import json
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import corpus  # noqa: E402

PATIENCE_s = 600
SHOWN = 20


def answers(*command):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=PATIENCE_s, check=False)
    if done.returncode != 0:
        raise SystemExit(f"formats.py: {command[0]}: {done.stderr.strip()[-2000:]}")
    return json.loads(done.stdout)


def judged(answer):
    """An answer; of a refusal not the words, which are each language's own, but the line in a CSV file."""
    if not isinstance(answer, dict) or "refused" not in answer:
        return answer
    line = re.findall(r"\.csv(?::|, line )(\d+):", answer["text"])[:1] if answer["refused"] == "damaged" else []
    return {"refused": answer["refused"], "line": line}


def of_library(answer, who):
    """What the library says to compare `who` with: the page reads all fingertips of a file, so the damage of any of them refuses it."""
    if not isinstance(answer, dict) or "of_all" not in answer:
        return answer
    return answer["of_all"] if who == "page" else {key: value for key, value in answer.items() if key != "of_all"}


def is_of_decompressors(name, library, answer):
    """A flipped bit that the library's zstd or lz4 decodes to the very same and other decoders refuse, which judge checksums: Debian has zstd 1.5.4, PyPI
    1.5.7, the page fzstd. answer: without salvage."""
    is_same = library[name] == library.get(re.sub(r"_chance_\d+ ", "_whole ", name))
    return "_chance_" in name and is_same and re.search("decompression error|cannot be unpacked|LZ4F_", answer.get("text", "")) is not None


def agree(one, other):
    """The page tells of no events."""
    are_answers = isinstance(one, dict) and isinstance(other, dict)
    return one == other or (are_answers and {**one, **other} == one and one.keys() - other.keys() <= {"events"})


def lost(jobs, found):
    """Recordings that were refused although all of their rows are there, and those that lack rows and whose reader reports no loss."""
    refused, silent = [], []
    refused += [job["name"] for job in jobs if "part" in job and len(found[job["name"]].get("rows", ())) != job["part"][2]]
    for job in (job for job in jobs if "rows" in job and not job["salvage"]):
        answer = found[job["name"]]
        is_right = len(answer.get("rows", ())) == job["rows"] if job["rows"] else "refused" in answer
        refused += [job["name"]] * (not is_right)
    for job in (job for job in jobs if "rows_of" in job):
        answer, rows = found[job["name"]], found[job["rows_of"]]["rows"]
        refused += [job["name"]] * (job["is_whole"] and answer.get("rows") != rows)
        is_silent = "rows" in answer and len(answer["rows"]) < len(rows) and answer["has_end"] and not answer["skipped"]
        silent += [job["name"]] * is_silent
    return refused, silent


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fingertip")
    parser.add_argument("by_library")
    parser.add_argument("--page", nargs="+", metavar="WORD", help="the command that answers as the page does")
    parser.add_argument("--json")
    parser.add_argument("--keep", help="leave the corpus there")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="fingertip-") as name:
        folder = pathlib.Path(options.keep or name)
        folder.mkdir(exist_ok=True)

        def convert(start, end):
            subprocess.run([options.fingertip, "convert", start, end, "--overwrite"], check=True, capture_output=True, timeout=PATIENCE_s)

        jobs = corpus.make(folder, convert)
        job_file = folder / "jobs.json"
        job_file.write_text(json.dumps(jobs), encoding="utf-8")
        found = {"library": answers(options.by_library, job_file), "Python": answers(sys.executable, HERE / "by_python.py", job_file)}
        if options.page:
            found["page"] = answers(*options.page, job_file)
    disagreements = []
    for name in found["library"]:
        told = {who: judged(answer[name]) for who, answer in found.items() if name in answer}
        others = [
            who
            for who, answer in told.items()
            if who != "library"
            and not agree(judged(of_library(found["library"][name], who)), answer)
            and not is_of_decompressors(name, found["library"], found[who][name.removesuffix(" salvage")])
        ]
        if others:
            disagreements.append({"input": name, "of": others, **{who: found[who][name] for who in told}})
    refusals = collections.Counter(answer.get("refused", "taken") for answer in found["library"].values() if isinstance(answer, dict))
    wrongly, silently = lost(jobs, found["library"])
    said = {
        "inputs": len(jobs),
        "recordings_refused_wrongly": len(wrongly),
        "rows_lost_silently": len(silently),
        "refused": dict(refusals),
        "through": {who: len(each) for who, each in found.items()},
        "format_disagreements": len(disagreements),
        "disagreements": disagreements,
    }
    if options.json:
        path = pathlib.Path(options.json)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    for each in disagreements[:SHOWN]:
        print(f"{each['input']}: " + ", ".join(f"{who}: {json.dumps(each[who])[:300]}" for who in found if who in each), file=sys.stderr)
    for each in wrongly + silently:
        print(f"{each}: its rows are not all there", file=sys.stderr)
    print(f"{len(jobs)} inputs, {dict(refusals)}; {len(disagreements)} disagreements")
    return 1 if disagreements or wrongly or silently else 0


if __name__ == "__main__":
    sys.exit(main())
