#!/usr/bin/env python3
"""Gathers the documents of the tree, and the files they link to, for the site that mkdocs.yml describes.

usage: docs.py [ROOT]

The pages keep their folders in build/docs/pages, so that links between them hold. A file that a page links to is copied. A link to a folder
leads to its README.md, and becomes plain text where there is none. A link to what is not in the tree is an error, and so is a document that
mkdocs.yml does not list.
"""

import pathlib
import re
import shutil
import subprocess
import sys

LINK = re.compile(r"\]\(([^)#\s]+)(#[^)\s]*)?\)")
PAGES = "build/docs/pages"


def targets(text):
    """Relative paths that a document links to."""
    return [path for path, _ in LINK.findall(text) if not re.match(r"[a-z]+:", path)]


def gather(root):
    """Copies documents and what they link to; returns links that lead nowhere, as (document, link)."""
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=root, capture_output=True, text=True, check=True).stdout.split()
    listed = [name for name in listed if not name.startswith(".github/")]
    pages = root / PAGES
    shutil.rmtree(pages, ignore_errors=True)
    missing = []
    for name in listed:
        text = (root / name).read_text(encoding="utf-8")
        for link in targets(text):
            path = (root / name).parent / link
            if path.is_dir() and not (path / "README.md").is_file():
                text = re.sub(rf"\[([^\]]*)\]\({re.escape(link)}\)", r"\1", text)
                continue
            if path.is_dir():
                text = re.sub(rf"\]\({re.escape(link)}(?=[)#])", f"]({link.rstrip('/')}/README.md", text)
            elif not path.is_file():
                missing.append((name, link))
            elif path.suffix != ".md":
                copy = pages / path.resolve().relative_to(root)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, copy)
        page = pages / name
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(text, encoding="utf-8")
    config = root / "mkdocs.yml"
    navigation = re.findall(r"[\w/]+\.md", config.read_text(encoding="utf-8").split("\nnav:")[1])
    missing += [("mkdocs.yml", name) for name in navigation if not (pages / name).is_file()]
    missing += [(name, "a page of mkdocs.yml") for name in listed if name not in navigation]
    return missing


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    missing = gather(root)
    for name, link in missing:
        print(f"docs.py: {name} leads to {link}, which is not there", file=sys.stderr)
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
