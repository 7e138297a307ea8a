"""The mutants of a source, what equivalent.txt may say, and how the mutants are chosen."""

import pathlib
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))
import equivalent  # noqa: E402
import mutants  # noqa: E402
import mutation  # noqa: E402

SOURCE = """#include <stdbool.h>
#define LIMIT 100
int count(int n);
static int twice;
int count(int n) {
  int sum = 0;
  for (int i = 0; i < n; i++) {
    if (n > LIMIT && !twice) {
      sum += 2 * i;
    }
  }
  return sum;
}
"""


class Mutants(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name).resolve()

    def find(self, text=SOURCE):
        (self.folder / "a.c").write_text(text)
        return mutants.find(self.folder, "a.c", self.folder / "a.c", [])

    def test_kinds(self):
        changes = {(mutant.before, mutant.after) for mutant in self.find()}
        loop = "for (int i = 0; i < n; i++) {"
        test = "if (n > LIMIT && !twice) {"
        for change in (
            ("#define LIMIT 100", "#define LIMIT 200"),
            (loop, "for (int i = 0; i <= n; i++) {"),
            (loop, "for (int i = 1; i < n; i++) {"),
            (loop, "for (int i = 0; i < n; i--) {"),
            (test, "if (n >= LIMIT && !twice) {"),
            (test, "if (n > LIMIT || !twice) {"),
            (test, "if (n > LIMIT && twice) {"),
            (test, "if ((0 && (n > LIMIT && !twice))) {"),
            ("sum += 2 * i;", "sum -= 2 * i;"),
            ("sum += 2 * i;", "sum += 2 / i;"),
            ("sum += 2 * i;", "(void)0;"),
        ):
            self.assertIn(change, changes)

    def test_each_changes_the_text_where_it_says(self):
        text = SOURCE
        for mutant in self.find():
            changed = (text[: mutant.begin] + mutant.text + text[mutant.end :]).split("\n")
            self.assertEqual(changed[mutant.line - 1].strip(), mutant.after)
            self.assertEqual(mutant.in_macro, mutant.line == 2)
            self.assertEqual(mutant.function, "count")

    def test_a_source_that_does_not_compile(self):
        with self.assertRaises(mutants.NoTree):
            self.find("int f(")

    def test_equivalents_go_stale(self):
        found = self.find()
        key = next(mutant.key for mutant in found if mutant.after == "(void)0;")
        file = self.folder / "equivalent.txt"
        file.write_text(f"# about\n\n{key}\n= because\nof that\n")
        known = equivalent.read(file)
        self.assertEqual(known, {key: "because of that"})
        self.assertEqual(equivalent.stale(known, {"a.c": found}), [])
        self.assertEqual(equivalent.gone(known, self.folder), [])
        changed = self.find(SOURCE.replace("sum += 2 * i", "sum += 3 * i"))
        self.assertEqual(equivalent.stale(known, {"a.c": changed}), [key])
        self.assertEqual(equivalent.gone(known, self.folder), [key])
        for wrong in (f"{key}\n", f"{key}\n= a\n\n{key}\n= b\n", "a.c f\n= a\n"):
            file.write_text(wrong)
            with self.assertRaises(equivalent.Unclear):
                equivalent.read(file)

    def test_what_equivalent_txt_speaks_of_is_there(self):
        self.assertEqual(equivalent.gone(equivalent.read(HERE / "equivalent.txt"), ROOT), [])

    def test_shares_are_even(self):
        self.assertEqual(mutation.shares({"a": 4, "b": 100, "c": 100}, 50), {"a": 4, "b": 23, "c": 23})
        self.assertEqual(sum(mutation.shares({"a": 40, "b": 30, "c": 70}, 100).values()), 100)
        self.assertEqual(mutation.shares({"a": 4, "b": 5}, 50), {"a": 4, "b": 5})

    def test_survivors_count_unless_they_are_set_apart(self):
        found = [mutation.mutants.Mutant("firmware/a/a.c", "f", 1, 0, 1, "", f"line {i}", "", False) for i in range(4)]
        judged = dict(zip(found, ("survived", "survived", "test_a: f", "test_a: f")))
        result, survivors, wrong = mutation.summary(judged, {found[0].key: "same", found[2].key: "same"})
        self.assertEqual((result["mutants"], result["mutants_survived"], result["mutants_set_apart"]), (3, 1, 1))
        self.assertEqual(result["mutants_survived_percent"], 33.33)
        self.assertEqual((survivors, wrong), ([found[1]], [found[2]]))


if __name__ == "__main__":
    unittest.main()
