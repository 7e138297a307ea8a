"""Rows of a recording that are read many at a time are read as those that are read one at a time: usage test_rows.py [unittest arguments]."""

import pathlib
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "host_tools/python"))
from fingertip import recorded  # noqa: E402
from fingertip.line import CONTACT_COLUMNS, LATER_COLUMNS, RAW_COLUMNS  # noqa: E402

SENSORS = 2
ODD = """0 -0 5. .5 -.5 - --5 1.2.3 5.0 -5 1e5 1e-400 18446744073709551615 18446744073709551616 4294967295 4294967296 65536
nan inf 0x1 1_000 1,2 327.68 -327.68 2097152 -2097152.1 3.5e38""".split()
ODD += ["", " 1", "1 ", "\u0663", 40 * "9", 400 * "9", 39 * "3", *("0." + zeros * "0" + "1" for zeros in (44, 46, 400))]


def header(tangential):
    names = ["t_us", "frame", *CONTACT_COLUMNS, *(LATER_COLUMNS if tangential else ()), *RAW_COLUMNS]
    return names + [f"s{k}_Pa" for k in range(SENSORS)] + [f"tare{k}_Pa" for k in range(SENSORS)]


class Rows(unittest.TestCase):
    def alike(self, rows, text):
        """Whether it is taken at once."""
        try:
            alone = np.array(rows.values(text))
        except ValueError:
            alone = None
        table = rows.table([text])
        if table is not None:
            self.assertIsNotNone(alone, text)
            np.testing.assert_array_equal(table[0].view(np.uint64), alone.view(np.uint64), text)
        found = list(rows.tables([self.plain, text, self.plain]))
        if alone is None:
            self.assertEqual([type(each) for each in found], [np.ndarray, ValueError, np.ndarray], text)
        else:
            np.testing.assert_array_equal(np.concatenate(found)[1], alone, text)
        return table is not None

    def test_every_cell_with_every_odd_text(self):
        for tangential in (False, True):
            names = header(tangential)
            rows = recorded.Rows(",".join(names))
            cells = [str(at % 7) for at in range(len(names))]
            first_raw = names.index(RAW_COLUMNS[0])
            for flags in (0, 0x7F):
                cells[names.index("flags")] = str(flags)
                self.plain = ",".join(cells)
                self.assertTrue(self.alike(rows, self.plain))
                for there in ((True, True), (True, False), (False, True), (False, False)):
                    some = [cell if at < 2 or there[at >= first_raw] else "" for at, cell in enumerate(cells)]
                    self.assertEqual(self.alike(rows, ",".join(some)), any(there))
                    for at in range(len(some)):
                        for odd in ODD:
                            self.alike(rows, ",".join(some[:at] + [odd] + some[at + 1 :]))
                        self.alike(rows, ",".join(some[:at] + some[at + 1 :]))

    def test_what_writers_write_is_taken_at_once(self):
        rows = recorded.Rows(",".join(header(False)))
        raw = "6010,175,3,0,0,25.00,107557.2588,-0.5,0,101325.9"
        self.plain = ",".join(["3959394", "3686", *("1" for _ in CONTACT_COLUMNS), raw])
        self.assertTrue(self.alike(rows, self.plain))
        self.assertEqual([len(each) for each in rows.tables(5 * [self.plain])], [5])


if __name__ == "__main__":
    unittest.main(verbosity=2)
