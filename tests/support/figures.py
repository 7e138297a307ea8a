"""Figures of tests: their bounds, and a JSON file that several tests write to."""

import json
import pathlib


def assert_within(case, found, bounds):
    """bounds: (key, least, most) of each figure."""
    for key, least, most in bounds:
        with case.subTest(key):
            case.assertGreaterEqual(found[key], least)
            case.assertLessEqual(found[key], most)


def add(path, figures, stale=()):
    """Without those of the names in stale, unless they are among the new figures."""
    path = pathlib.Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    whole = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    kept = {name: value for name, value in whole.items() if name not in stale}
    fresh = path.with_suffix(".new")
    fresh.write_text(json.dumps({**kept, **figures}, indent=2, sort_keys=True) + "\n", encoding="utf-8")
    fresh.replace(path)
