"""The Cramer-Rao bounds of the report shear against the noise that the firmware's estimate has.

usage: test_shear_bounds.py BUILD [unittest arguments]
"""

import pathlib
import sys
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "host_tools" / part) for part in ("report/shared", "report/measure", "report/shear", "python")]
import bounds  # noqa: E402
from contacts import FORCE_N, SENSORS, Contacts  # noqa: E402

CONTACTS = Contacts(sys.argv.pop(1))
NOISE_Pa, LAYER_mm = 4.0, 12.0


def touch_at(x_mm, y_mm, share=1.0):
    touch = CONTACTS.made("twin_touch", 1)
    for name, value in zip(("x_mm", "y_mm", "force_N", *FORCE_N), (x_mm, y_mm, 5.0 * share, share, -0.5 * share)):
        touch[name] = value
    return touch


def bound(touch, noise_Pa=NOISE_Pa, gain_sd=0.0, model_share=0.0, known=bounds.NOTHING):
    """(covariance of Q / F, of the location)"""
    return (each[0] for each in bounds.bounds(CONTACTS, LAYER_mm, touch, noise_Pa, gain_sd, model_share, known))


class Bounds(unittest.TestCase):
    def test_the_noise_of_the_estimate_is_what_they_allow(self):
        """On readings of the profile's own model, so that nothing but noise is in the errors."""
        frames = 3000
        for x_mm, y_mm in ((0.0, 0.0), (4.0, -3.0), (-6.0, 8.0), (2.0, 14.0)):
            touch = touch_at(x_mm, y_mm)
            unknowns = np.array([[5.0, x_mm, y_mm, 4.0, 0.0, 0.0, 1.0, -0.5]])
            profile = CONTACTS.pad_profile(LAYER_mm)
            base_Pa = np.repeat(bounds.model_Pa(profile[0], unknowns, CONTACTS.x_mm, CONTACTS.y_mm), frames, axis=0)
            normals = CONTACTS.random(1, 2, np.arange(frames)).normal(CONTACTS.tangential_frames * SENSORS)
            found, has_fit = CONTACTS.estimated(base_Pa, CONTACTS.perfect_pads(frames), NOISE_Pa, normals, profile)
            self.assertTrue(has_fit.all() and found["valid"].all())
            for names, least in zip((("qx", "qy"), ("x_mm", "y_mm")), bound(touch)):
                for k, name in enumerate(names):
                    share = found[name].std() / np.sqrt(least[k, k])
                    self.assertGreater(share, 0.85, (name, x_mm, y_mm))  # its priors are worth some per cent
                    self.assertLess(share, 1.1, (name, x_mm, y_mm))

    def test_they_go_with_the_errors(self):
        touch, light = touch_at(3.0, 5.0), touch_at(3.0, 5.0, share=0.5)
        one, two = tuple(bound(touch, 4.0)), tuple(bound(touch, 8.0))
        for single, double in zip(one, two):
            np.testing.assert_allclose(double, 4.0 * single, rtol=1e-6, atol=1e-9)
        trace = lambda *errors: np.trace(next(bound(*errors)))
        self.assertGreater(trace(touch, 4.0, 0.02), 2.0 * trace(touch, 4.0))
        # A model's error is a share of the peak: it does not fall with the force, noise's does.
        self.assertAlmostEqual(trace(light, 1e-3, 0.0, 0.01) / trace(touch, 1e-3, 0.0, 0.01), 1.0, delta=1e-3)
        self.assertAlmostEqual(trace(light, 4.0) / trace(touch, 4.0), 4.0, delta=1e-3)

    def test_knowledge_takes_them_down(self):
        nothing, priors, known_round = (
            np.trace(next(bound(touch_at(8.0, 16.0), model_share=0.003, known=known)))
            for known in (bounds.NOTHING, bounds.PRIORS, bounds.ROUND)
        )
        self.assertLess(priors, 0.95 * nothing)
        self.assertLess(known_round, 0.8 * priors)

    def test_they_are_as_symmetric_as_the_array(self):
        mirrored = touch_at(-4.0, -7.0)
        for name in FORCE_N:
            mirrored[name] *= -1.0
        sides = (bound(touch, model_share=0.001, known=bounds.PRIORS) for touch in (touch_at(4.0, 7.0), mirrored))
        for here, there in zip(*sides):
            np.testing.assert_allclose(here, there, rtol=1e-6, atol=1e-9)


if __name__ == "__main__":
    unittest.main()
