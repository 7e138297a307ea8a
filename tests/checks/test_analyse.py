"""analyse.py finds what it is for, with each of its tools."""

import pathlib
import shutil
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import analyse  # noqa: E402


class Analyse(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        shutil.copy(analyse.ROOT / ".clang-tidy", self.folder)

    def unit(self, text, on_chip=False):
        source = self.folder / "a.c"
        source.write_text(text)
        compiler = "arm-none-eabi-gcc" if on_chip else "gcc"
        entry = {"directory": str(self.folder), "words": [compiler, "-std=c11", "-Wall", "-o", "a.o", "-c", str(source)]}
        analyse.database([(source, entry, on_chip)], self.folder)
        return source, entry

    def assert_found(self, lines, word):
        self.assertTrue(any(word in line for line in lines), lines)

    def test_clang_tidy(self):
        source, _ = self.unit("int half(int x);\n#define HALF(x) x / 2\nint half(int x) { return HALF(x + 1); }\n", on_chip=True)
        self.assert_found(analyse.tidy(source, self.folder, False), "bugprone-macro-parentheses")
        source, _ = self.unit("int f(int i);\nint f(int i) { return (int)sizeof(i++) + i; }\n")
        self.assert_found(analyse.tidy(source, self.folder, False), "unevaluated-expression")

    def test_clangs_paths(self):
        source, _ = self.unit("int f(int a);\nint f(int a) { int x; if (a > 3) { x = 1; } if (a > 2) { return x; } return 0; }\n")
        self.assert_found(analyse.tidy(source, self.folder, True), "clang-analyzer-core")
        self.assertFalse([line for line in analyse.tidy(source, self.folder, False) if "clang-analyzer" in line])

    def test_cppcheck(self):
        self.unit("int f(void);\nint f(void) { int x[3] = {0}; return x[3]; }\n")
        self.assert_found(analyse.cppcheck(self.folder), "[arrayIndexOutOfBounds]")
        self.unit("int f(int i);\nint f(int i) { return (int)sizeof(i++) + i; }\n")
        self.assert_found(analyse.cppcheck(self.folder, True), "[misra-c2012-13.6]")

    def test_gccs_paths(self):
        source, entry = self.unit("#include <stdlib.h>\nvoid f(void *p);\nvoid f(void *p) { free(p); free(p); }\n")
        self.assert_found(analyse.analyse_paths(source, entry), "-Wanalyzer-double-free")

    def test_mandatory_rules(self):
        for text, rule in (
            ("void f(int a[static 3]);", "17.6"),
            ("#include <ctype.h>", "21: <ctype.h>"),
            ("n = strlen(s);", "21.17"),
            ("char *s = getenv(n);", "21.19"),
            ("t = localtime(&n);", "21.20"),
            ("free(p);", "22.2"),
            ("FILE *f;", "22.5"),
        ):
            for path in ("firmware/a/a.c", "boards/rp2040/a.c"):
                told = list(analyse.mandatory(pathlib.Path(path), f"\n{text}\n"))
                self.assertEqual(len(told), 1, text)
                self.assertIn(f"{path}:2: MISRA C:2012 {rule}", told[0])
        self.assertFalse(list(analyse.mandatory(pathlib.Path("boards/native/a.c"), "#include <stdlib.h>\nfree(p);\n/* FILE */\n")))
        self.assertTrue(list(analyse.mandatory(pathlib.Path("firmware/a/a.c"), "#include <stdlib.h>\n")))


if __name__ == "__main__":
    unittest.main()
