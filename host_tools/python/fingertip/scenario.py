"""Writes a scenario: what the fifteen sensors feel over time, and the truth behind it.

    fingertip-scenario NAME -o FILE.csv [--overwrite] [--seconds S] [--seed N]

ideal   ideal Gaussian presses (sigma 5.7 mm) of 0.5 to 20 N at random places of the array; no slip
demo    taps of different force and place, two slips, a figure-eight stroke; 10 s
wander  one contact of 5 N from 0.6 s to the end that never rests: every frame has something to fit

The pressure is the Gaussian of De Clercq et al., RA-L 2022, eq. (2), and the force its integral, eq. (4). slip is 1 above 10 mm/s.
"""

import numpy as np

from .command import Parser, check_output, check_range
from .files import SENSOR_X_mm, SENSOR_Y_mm, SLIP_SPEED_mm_s, InputError, write_scenario

STEP_s = 1e-3
SIGMA_mm = 5.7
QUIET_s = 0.5  # without contact, for the tare


def smooth_step(t, start, length):
    """0 before start, 1 after start + length, a raised cosine between."""
    u = np.clip((t - start) / length, 0.0, 1.0)
    return 0.5 - 0.5 * np.cos(np.pi * u)


class Motion:
    """Force and place over time, put together from presses and moves."""

    def __init__(self, seconds):
        self.t_s = np.arange(int(round(seconds / STEP_s)) + 1) * STEP_s
        self.force_N = np.zeros_like(self.t_s)
        self.x_mm = np.zeros_like(self.t_s)
        self.y_mm = np.zeros_like(self.t_s)

    def press(self, start_s, end_s, force_N, x_mm, y_mm, ramp_s):
        """One contact from start to end, the ramps included; x_mm and y_mm are its place at its start."""
        t = self.t_s
        self.force_N += force_N * smooth_step(t, start_s, ramp_s) * (1 - smooth_step(t, end_s - ramp_s, ramp_s))
        inside = (t >= start_s) & (t <= end_s)
        self.x_mm[inside] = x_mm
        self.y_mm[inside] = y_mm

    def slide(self, start_s, press_end_s, direction, speed_mm_s, length_mm):
        """Moves at constant speed, between accelerations of 10 ms, and stays at the end until the press ends."""
        t = self.t_s
        accelerate_s = 0.01
        cruise_s = length_mm / speed_mm_s - accelerate_s
        if cruise_s <= 0:
            raise ValueError("the slide is shorter than its accelerations")
        times = [start_s, start_s + accelerate_s, start_s + accelerate_s + cruise_s, start_s + 2 * accelerate_s + cruise_s]
        speed = np.interp(t, times, [0, speed_mm_s, speed_mm_s, 0])
        way = np.concatenate(([0], np.cumsum((speed[1:] + speed[:-1]) / 2 * STEP_s)))
        inside = (t >= start_s) & (t <= press_end_s)
        unit = np.asarray(direction, float) / np.hypot(*direction)
        self.x_mm[inside] += unit[0] * way[inside]
        self.y_mm[inside] += unit[1] * way[inside]
        return times[-1]

    def columns(self, sigma_mm=SIGMA_mm):
        """The columns of the scenario file."""
        contact = self.force_N > 0
        force = np.where(contact, self.force_N, 0)
        x = np.where(contact, self.x_mm, 0)
        y = np.where(contact, self.y_mm, 0)
        p0 = force / (2 * np.pi * (sigma_mm * 1e-3) ** 2)
        speed = np.hypot(np.gradient(self.x_mm, STEP_s), np.gradient(self.y_mm, STEP_s))
        steady = contact & np.roll(contact, 1) & np.roll(contact, -1)
        slip = steady & (speed > SLIP_SPEED_mm_s)
        distance2 = (SENSOR_X_mm[None, :] - x[:, None]) ** 2 + (SENSOR_Y_mm[None, :] - y[:, None]) ** 2
        sensors = p0[:, None] * np.exp(-0.5 * distance2 / sigma_mm**2)
        return {
            "t_s": self.t_s,
            "contact": contact,
            "x_mm": x,
            "y_mm": y,
            "force_N": force,
            "p0_Pa": p0,
            "sigma_mm": np.where(contact, sigma_mm, 0),
            "slip": slip,
            "sensors_Pa": sensors,
        }


def ideal(seconds, random):
    """A Latin hypercube over place and log force: however few the presses, they reach every edge."""
    motion = Motion(seconds)
    ramp, hold, gap_min, gap_max = 0.15, 0.1, 0.1, 0.2
    length = 2 * ramp + hold
    count = int((seconds - QUIET_s) / (length + gap_max))
    strata = [(random.permutation(count) + random.random(count)) / count for _ in range(3)]
    start = QUIET_s
    for u_force, u_x, u_y in zip(*strata):
        motion.press(start, start + length, 0.5 * (20 / 0.5) ** u_force, 18 * u_x - 9, 36 * u_y - 18, ramp)
        start += length + random.uniform(gap_min, gap_max)
    return motion


def demo(seconds, random):
    del random
    motion = Motion(seconds)
    for start, force, x, y in [(0.7, 1.0, -6, 12), (1.2, 4.0, 7, -9), (1.7, 14.0, 1, 3)]:
        motion.press(start, start + 0.4, force, x, y, 0.12)
    motion.press(2.4, 5.2, 8.0, -4, -9, 0.2)
    motion.slide(3.2, 5.2, (0, 1), 40, 12)
    motion.slide(4.2, 5.2, (3, -4), 80, 16)
    motion.press(5.7, 9.4, 6.0, 0, 0, 0.2)
    inside = (motion.t_s >= 5.7) & (motion.t_s <= 9.4)
    phase = 2 * np.pi * smooth_step(motion.t_s[inside], 6.0, 3.1)
    motion.x_mm[inside] = 7 * np.sin(2 * phase)
    motion.y_mm[inside] = 15 * np.sin(phase)
    return motion


def wander(seconds, random):
    del random
    motion = Motion(seconds)
    start, ramp = QUIET_s + 0.1, 0.05
    motion.press(start, seconds + 2 * ramp, 5.0, 0, 0, ramp)
    angle = 5.0 / 6.0 * np.maximum(motion.t_s - start, 0)
    motion.x_mm[:] = 6 * np.cos(angle)
    motion.y_mm[:] = 6 * np.sin(angle)
    return motion


# name: what makes it, its usual length, what it is
SCENARIOS = {
    "ideal": (ideal, 20.0, "ideal Gaussian presses at random places, forces log-uniform from 0.5 to 20 N"),
    "demo": (demo, 10.0, "three taps, slips at 40 and 80 mm/s, a figure-eight stroke"),
    "wander": (wander, 10.0, "one contact of 5 N that moves around the centre at 5 mm/s"),
}


def main(argv):
    parser = Parser(prog="fingertip-scenario", description=__doc__)
    parser.add_argument("name", choices=sorted(SCENARIOS), metavar="NAME", help=", ".join(sorted(SCENARIOS)))
    parser.add_argument("-o", "--output", required=True, metavar="FILE.csv")
    parser.add_argument("--seconds", type=float, metavar="S", help="length; default: that of the scenario")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the random places and forces; default 1")
    parser.add_argument("--overwrite", action="store_true", help="replace the file if it exists")
    options = parser.parse_args(argv)
    make, usual, description = SCENARIOS[options.name]
    seconds = usual if options.seconds is None else options.seconds
    check_range("seconds", seconds, 1, 3600)
    if options.seed < 0:
        raise InputError(f"--seed {options.seed} is out of range; give 0 or more")
    check_output(options.output, replace=options.overwrite)
    motion = make(seconds, np.random.default_rng(options.seed))
    metadata = {
        "name": options.name,
        "description": description,
        "seed": options.seed,
        "ambient_Pa": 101325,
        "temperature_degC": 25,
        "sensors": len(SENSOR_X_mm),
    }
    write_scenario(options.output, metadata, motion.columns())
    return 0
