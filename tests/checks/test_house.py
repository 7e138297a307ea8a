"""The counts of the house see what they are for."""

import pathlib
import tempfile
import unittest

import house


class House(unittest.TestCase):
    def test_names_are_whole_words_outside_the_own_folder(self):
        files = {"a/own.c": "vy_mm_s", "b/one.c": "x = c.vy_mm_s;", "b/longer.c": "vy_mm_s_", "b/none.c": "vx_mm_s"}
        self.assertEqual(house.naming(files, "vy_mm_s", ("a/",)), ["b/one.c"])

    def test_who_names_half_of_a_packet_lists_it(self):
        files = {"list.py": "a b", "one.py": "a", "all.ts": "a b c d"}
        self.assertEqual(house.listing(files, ("a", "b", "c", "d")), ["all.ts", "list.py"])

    def test_a_line_that_takes_numbers_out_of_bytes_is_seen(self):
        text = "const a = view.getFloat32(4, true);\nconst b = new DataView(bytes);\nconst c = getFloat(4);\nview.setBigUint64(0, n);\n"
        self.assertEqual(len(house.OUT_OF_BYTES.findall(text)), 3)

    def test_a_circle_by_way_of_a_third_is_found(self):
        self.assertEqual(house.circle({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}), ["a", "b", "c"])

    def test_imports_within_a_package_are_needs_also_within_functions(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "a.py").write_text("from .b import x\nimport e\n\n\ndef f():\n    from . import c, d\n")
            self.assertEqual(house.python_needs(pathlib.Path(folder)), {"a": {"b", "c", "d"}})

    def test_calls_between_sources_are_needs(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "a.c").write_text("int a_do(int x) {\n  return b_do(x);\n}\nstatic int hidden(void) {\n  return 1;\n}\n")
            (root / "b.c").write_text("int b_do(int x) {\n  return x + hidden();\n}\n")
            self.assertEqual(house.call_needs(root), {"a": {"b"}, "b": set()})
            (root / "b.c").write_text("int b_do(int x) {\n  return a_do(x);\n}\n")
            self.assertEqual(house.circle(house.call_needs(root)), ["a", "b"])

    def test_a_private_word_counts_alone_and_as_part_of_a_name(self):
        files = {"a.c": "told_frames; ToldFrames; TOLD; untold; C_STANDARD; what presses", "b.md": "a retelling", "CHANGELOG.md": "it says"}
        self.assertEqual(house.private_words(files), {"a.c": 4})

    def test_lines_of_a_function_include_its_head_of_several_lines(self):
        text = "static int a(int x,\n             int y) {\n  return x;\n}\n\nstruct s s = {\n  1,\n  2,\n};\n\nvoid b(void) {\n}\n"
        self.assertEqual(house.function_lines(text), [("static int a", 4), ("void b", 2)])

    def test_more_than_may_be_fails(self):
        figures = {name: may for name, (_, may) in house.LIMITS.items()}
        self.assertEqual(house.judged(figures), [])
        figures["rooms"] += 1
        self.assertEqual([name for name, *_ in house.judged(figures)], ["rooms"])

    def test_what_may_be_is_never_below_the_goal(self):
        for name, (goal, may) in house.LIMITS.items():
            self.assertGreaterEqual(may, goal, name)


if __name__ == "__main__":
    unittest.main()
