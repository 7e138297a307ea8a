"""The bound of the report on two contacts against what the most likely answer reaches, where nothing but the bound's own errors is in the
readings: both models fitted from several starts, and two where the pair leaves less than the long contact by as much as keeps FALSE_TWO.

usage: test_two_bound.py BUILD [unittest arguments]
"""

import pathlib
import sys
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/shared", "report/measure", "report/two", "python")]
import pair_bound  # noqa: E402
from contacts import SENSORS, Contacts  # noqa: E402

CONTACTS = Contacts(sys.argv.pop(1))
RIGHT, FALSE_TWO, DRAWS = (1.5, 0.1), 0.02, 150


def rubber(count):
    return pair_bound.Rubber(CONTACTS, 12.0, "sphere6", np.full(count, 0.0125))


def bound(pair, noise_Pa, gain_sd, model_share):
    normals = CONTACTS.random(1, 2, [3]).normal(pair_bound.DRAWS * pair_bound.PAIR).reshape(1, -1, pair_bound.PAIR)
    placed, discerned, line = pair_bound.bounds(rubber(1), pair, noise_Pa, gain_sd, model_share, RIGHT, FALSE_TWO, normals)
    return min(placed[0], discerned[0]), line


def answered(readings_Pa, weights, pair, line, random):
    """How much less the pair leaves than the line in each of DRAWS disturbed readings, and the pair."""
    every = lambda one: np.repeat(one, DRAWS, axis=0)
    weights = every(weights)
    disturbed = every(readings_Pa) + random.normal(DRAWS * SENSORS).reshape(DRAWS, SENSORS) / weights
    fitted = lambda start: pair_bound.fitted(rubber(DRAWS), disturbed, weights, start)
    wider = pair.copy()
    wider[:, :2] += 0.3 * (pair[:, :2] - pair[:, 3:5])
    wider[:, 3:5] += 0.3 * (pair[:, 3:5] - pair[:, :2])
    (found, left), (other, other_left) = fitted(every(pair)), fitted(every(wider))
    found = np.where((other_left < left)[:, None], other, found)
    of_lines = [fitted(start)[1] for start in (every(line), every(pair_bound.line_like(pair)), pair_bound.line_like(found))]
    return np.min(of_lines, axis=0) - np.minimum(left, other_left), found


class TwoBound(unittest.TestCase):
    def test_the_most_likely_answer_is_near_it(self):
        errors, random = (2.0, np.full(SENSORS, 0.005), 0.004), CONTACTS.random(1, 2, [4])
        reached, possible = 0.0, 0.0
        for apart_mm in (6.0, 7.0, 8.0):
            pair = np.array([[-2.0, 0.0, 3.0, -2.0 + 0.5 * apart_mm, np.sqrt(0.75) * apart_mm, 3.0]])
            limit, line = bound(pair, *errors)
            readings_Pa, of_line_Pa = (rubber(1).readings_Pa(each) for each in (pair, line))
            weights = pair_bound.per_sd(readings_Pa, *errors)
            enough = np.sort(answered(of_line_Pa, weights, pair, line, random)[0])[int((1.0 - FALSE_TWO) * DRAWS)]
            less, found = answered(readings_Pa, weights, pair, line, random)
            share = float(((less > enough) & pair_bound.is_right(found, pair, *RIGHT)).mean())
            self.assertLessEqual(share, limit + 0.12)  # three standard deviations of the draws
            reached, possible = reached + share, possible + limit
        self.assertGreater(reached, 0.75 * possible)

    def test_it_falls_with_distance_and_with_each_error(self):
        def limit(apart_mm, noise_Pa, gain_sd, model_share):
            pair = np.array([[-1.0, 2.0, 3.0, -1.0 + 0.6 * apart_mm, 2.0 + 0.8 * apart_mm, 3.0]])
            return bound(pair, noise_Pa, np.full(SENSORS, gain_sd), model_share)[0]

        self.assertGreater(limit(8.0, 0.1, 0.0, 0.0), 0.99)
        self.assertLess(limit(8.0, 0.1, 0.0, 0.02), 0.5)
        self.assertLess(limit(8.0, 0.1, 0.05, 0.0), 0.5)
        self.assertLess(limit(8.0, 500.0, 0.0, 0.0), 0.5)
        self.assertLess(limit(6.0, 2.0, 0.005, 0.004), limit(12.0, 2.0, 0.005, 0.004) - 0.3)


if __name__ == "__main__":
    unittest.main()
