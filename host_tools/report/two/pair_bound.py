"""What no judge of a pair does better than, on a pad whose gains are known as well as its calibration knows them.

The judge knows all else: the rubber's response to the ball and its dip, but for a share of the largest reading by which its model is off at
each sensor; the noise, as the mean of the frames that it has; and that it is one of the two contacts below.

Two limits, each of its own. Placed: the Cramer-Rao bound is the least covariance of unbiased estimates of two locations and two forces.
Discerned: a long contact under a tangential force may make nearly the same readings. Among the tests that call it two in at most false_two of
its touches, the likelihood ratio finds most pairs (Neyman and Pearson): Phi(d - Phi^-1(1 - false_two)), d the distance of the readings of
both in standard deviations. Each long contact sets such a limit, and the nearest that is found sets this one: no longer than the report's
longest edge, under no more than its tangential forces.

A pair is x, y, force of each, in mm and N. A line is its middle, force, half of the line along x and y, tangential force along x and y.
Arrays have a row for each.
"""

import dataclasses
import statistics

import numpy as np
from contacts import terms_of
from sessions import SENSORS

PAIR, LINE = 6, 7
LINE_LONGEST_mm, LINE_TANGENTIAL_MOST = 20.0, 0.3  # the second of the force
FORCE_LEAST_N = 0.05
DRAWS = 400
normal = statistics.NormalDist()


@dataclasses.dataclass
class Rubber:
    """Balls on the rubber, in a pair or evenly along a line under a tangential force. dip_share: of each row."""

    contacts: object
    layer_mm: float
    ball: str
    dip_share: np.ndarray

    def where(self, chosen):
        return dataclasses.replace(self, dip_share=self.dip_share[chosen])

    def balls_Pa(self, x_mm, y_mm, force_N):
        """[row][sensor], of balls [row][ball]."""
        touch = self.contacts.made("twin_touch", x_mm.size)
        touch["x_mm"], touch["y_mm"], touch["force_N"] = x_mm.ravel(), y_mm.ravel(), np.maximum(force_N.ravel(), FORCE_LEAST_N)
        base_Pa = self.contacts.base_pressure(self.ball, self.layer_mm, touch, dip_share=np.repeat(self.dip_share, x_mm.shape[1]))
        return base_Pa.reshape(*x_mm.shape, SENSORS).sum(axis=1)

    def readings_Pa(self, at):
        if at.shape[1] == PAIR:
            return self.balls_Pa(*(at[:, [k, k + 3]] for k in range(3)))
        # Nodes and weights of Gauss's quadrature.
        nodes = np.array([-0.906180, -0.538469, 0.0, 0.538469, 0.906180])
        shares = np.array([0.118463, 0.239314, 0.284444, 0.239314, 0.118463])
        x, y, force, half_x, half_y, tangential_x, tangential_y = at.T[:, :, None]
        readings_Pa = self.balls_Pa(x + nodes * half_x, y + nodes * half_y, shares * force)
        dx, dy = self.contacts.x_mm - x, self.contacts.y_mm - y
        for moment_mm, sd_mm in terms_of(self.contacts.pad_profile(self.layer_mm)["tangential"]):
            v = sd_mm**2
            along = tangential_x * dx + tangential_y * dy
            readings_Pa += 1e6 * along * moment_mm / (2.0 * np.pi * v * v) * np.exp(-0.5 * (dx * dx + dy * dy) / v)
        return readings_Pa

    def slopes(self, at):
        """[row][sensor][unknown]"""
        step, count = 1e-3, at.shape[1]  # mm and N
        moves = step * np.concatenate([np.eye(count), -np.eye(count)])
        moved = dataclasses.replace(self, dip_share=np.repeat(self.dip_share, 2 * count))
        readings_Pa = moved.readings_Pa((at[:, None] + moves).reshape(-1, count)).reshape(len(at), 2, count, SENSORS)
        return ((readings_Pa[:, 0] - readings_Pa[:, 1]) / (2.0 * step)).transpose(0, 2, 1)


def per_sd(readings_Pa, noise_Pa, gain_sd, model_share):
    """1 / Pa, of the standard deviation by noise, the gain's share of the reading, and the model's of the largest."""
    of_model = np.reshape(model_share, (-1, 1)) * readings_Pa.max(axis=1, keepdims=True)
    return 1.0 / np.sqrt(np.square(noise_Pa) + np.square(gain_sd * readings_Pa) + np.square(of_model))


def within_limits(at):
    """A line that is no longer than the longest edge, and its tangential force no larger than that of the report."""
    if at.shape[1] == LINE:
        for first, most in ((3, 0.5 * LINE_LONGEST_mm), (5, LINE_TANGENTIAL_MOST * np.maximum(at[:, 2], FORCE_LEAST_N))):
            size = np.hypot(at[:, first], at[:, first + 1])
            at[:, first : first + 2] *= np.minimum(1.0, most / np.maximum(size, 1e-12))[:, None]
    return at


def fitted(rubber, readings_Pa, weights, start):
    """The most likely unknowns by Levenberg and Marquardt's steps from there, and the sum of squares that they leave."""
    settled = 1e-4  # of a sum of squares, of which 1 is a standard deviation
    at = start.copy()
    off = weights * (readings_Pa - rubber.readings_Pa(at))
    left = np.square(off).sum(axis=1)
    damping = np.full(len(at), 1e-3)
    going = np.arange(len(at))
    for _ in range(25):
        some = rubber.where(going)
        J = weights[going, :, None] * some.slopes(at[going])
        normal_matrix = J.transpose(0, 2, 1) @ J
        diagonal = np.einsum("nii->ni", normal_matrix)
        diagonal *= 1.0 + damping[going, None]
        step = np.linalg.solve(normal_matrix, (J.transpose(0, 2, 1) @ off[going, :, None]))[:, :, 0]
        nearer = within_limits(at[going] + step)
        off_there = weights[going] * (readings_Pa[going] - some.readings_Pa(nearer))
        less = left[going] - np.square(off_there).sum(axis=1)
        better = less > 0.0
        damping[going] *= np.where(better, 0.3, 5.0)
        chosen = going[better]
        at[chosen], off[chosen], left[chosen] = nearer[better], off_there[better], left[chosen] - less[better]
        going = going[(less < 0.0) | (less >= settled)]
        if not len(going):
            break
    return at, left


def line_like(pair):
    """With the pair's middle and second moment: where the search for the nearest line begins."""
    force_N = pair[:, 2] + pair[:, 5]
    share = (pair[:, 2] / force_N)[:, None]
    apart = pair[:, 3:5] - pair[:, :2]
    middle, half = pair[:, :2] + (1.0 - share) * apart, np.sqrt(3.0 * share * (1.0 - share)) * apart
    return within_limits(np.column_stack([middle, force_N, half, np.zeros((len(pair), 2))]))


def is_right(found, pair, near_mm, force_share):
    """Within near_mm each, and the sum of the forces within force_share of it. [..., PAIR]"""
    off = found - pair
    near = [np.hypot(off[..., k], off[..., k + 1]) <= near_mm for k in (0, 3)]
    return near[0] & near[1] & (np.abs(off[..., 2] + off[..., 5]) <= force_share * (pair[..., 2] + pair[..., 5]))


def bounds(rubber, pair, noise_Pa, gain_sd, model_share, right, false_two, normals):
    """The limits placed and discerned of each pair, and the line of the second. right: near_mm, force_share; normals: [pair][DRAWS][PAIR]."""
    readings_Pa = rubber.readings_Pa(pair)
    weights = per_sd(readings_Pa, noise_Pa, gain_sd, model_share)
    J = weights[:, :, None] * rubber.slopes(pair)
    root = np.linalg.cholesky(np.linalg.inv(J.transpose(0, 2, 1) @ J))
    found = pair[:, None] + normals @ root.transpose(0, 2, 1)
    placed = is_right(found, pair[:, None], *right).mean(axis=1)
    line, _ = fitted(rubber, readings_Pa, weights, line_like(pair))
    distance = np.linalg.norm(weights * (readings_Pa - rubber.readings_Pa(line)), axis=1)
    discerned = np.array([normal.cdf(each - normal.inv_cdf(1.0 - false_two)) for each in distance])
    return placed, discerned, line
