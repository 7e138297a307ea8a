"""The documents are gathered with all that they link to, and a link that leads nowhere is found."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "cmake"))
import docs


class Docs(unittest.TestCase):
    def gather(self, files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in {"mkdocs.yml": "site_name: x\nnav:\n  - README.md\n", **files}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            subprocess.run(["git", "init", "--quiet"], cwd=root, check=True)
            subprocess.run(["git", "add", "."], cwd=root, check=True)
            missing = docs.gather(root)
            pages = root / docs.PAGES
            return missing, {str(path.relative_to(pages)): path.read_text(encoding="utf-8") for path in pages.rglob("*") if path.is_file()}

    def test_a_link_that_leads_nowhere_is_found(self):
        missing, _ = self.gather({"README.md": "[a](LICENSE#b) [c](c/d.png) [out](https://example.org)", "LICENSE": ""})
        self.assertEqual(missing, [("README.md", "c/d.png")])

    def test_pages_and_the_navigation_are_the_same(self):
        missing, _ = self.gather({"README.md": "", "more.md": ""})
        self.assertEqual(missing, [("more.md", "a page of mkdocs.yml")])
        missing, _ = self.gather({"mkdocs.yml": "\nnav:\n", "LICENSE": ""})
        self.assertEqual(missing, [])
        missing, _ = self.gather({"LICENSE": ""})
        self.assertEqual(missing, [("mkdocs.yml", "README.md")])

    def test_linked_files_are_copied_and_folders_lead_to_their_readme(self):
        files = {"README.md": "[x](f/x.h) [f](f) [g](g)", "f/x.h": "int x;", "f/README.md": "", "g/y.c": ""}
        missing, pages = self.gather({**files, "mkdocs.yml": "\nnav: README.md f/README.md"})
        self.assertEqual(missing, [])
        self.assertEqual(pages, {"README.md": "[x](f/x.h) [f](f/README.md) g", "f/x.h": "int x;", "f/README.md": ""})


if __name__ == "__main__":
    unittest.main()
