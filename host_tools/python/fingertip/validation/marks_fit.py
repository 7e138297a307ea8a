"""What the presses at known places state of the sensors: where each one is, how much and how widely it responds, and how far its readings
leave this picture. Nothing is assumed of the sensors' places at first, so two swapped wires, a sensor without response and a loose one
appear as what they are.

Press i is at c_i, near its mark; sensor k is at s_k. With R = |c_i - s_k|^2 and c = NARROW,

    reading = g_k A exp(e_i) [(1 - m) exp(-R / 2 S^2) + m exp(-R / 2 c^2 S^2) - h exp(-R / 2 B^2)]
    S = S0 exp(b_k + w_x X_i + w_y Y_i),   X, Y: the mark's place, from -1 to 1 over the marks

Unknowns are A, S0, m, h, B, the slopes w, per sensor g, s, b, per press c and e. Marks are known up to the hand's error, whose sd is
learnt from the presses (expectation and maximisation). Robust least squares (Huber) by Levenberg-Marquardt. Same input, same bits.

The fit runs twice. First nothing is assumed of the sensors' places: where the print is on the pad, shifted and turned by a little, follows
from where the sensors are found, against the layout; sensors that are found elsewhere have little weight in it. Then each sensor is at the
place that it was found nearest to, but for a tenth of a millimetre. So the readings of all sensors give the place of each press, better than
the hand hits a mark, whatever the gains are: the pad's own estimates are judged against that. A shift that all sensors have in common
against the board's drawing remains invisible.
"""

import math
from typing import NamedTuple

import numpy as np

NARROW = 0.64  # width of the narrow part of the profile over that of the wide one; as calibration/solver.hpp, like the priors below
_HUBER = 2.5
_MIXING_0, _MIXING_SD, _DIP_0, _DIP_SD = 0.2, 0.1, 0.03, 0.03
_DIP_PITCHES_0, _DIP_LOG_SD = 1.9, 0.3  # between the twin's pads and what calibrations find
_SLOPE_SD, _GAIN_SD, _OWN_WIDTH_SD, _FORCE_SD = 0.3, 0.5, 0.035, 0.025
_FREE_pitches, _SEATED_mm, _FIXED = 3.0, 0.1, 1e-6  # sd of a sensor's place in the first fit and in the second
_HAND_BEGIN_mm, _HAND_MIN_mm = 0.5, 0.02
_MODEL_SHARE, _READING_SHARE = 0.003, 0.005  # error of the picture itself, of the peak and of the reading
_STEPS, _HAND_TURNS, _ALIGN_TURNS = 40, 4, 30
_CAUCHY_mm = 1.0  # a sensor found further away hardly counts for where the print is

RESPONDS_SHARE = 0.2  # of the strongest reading: less does not count
# A sensor that is left out is loose if its scatter_share is more: up to 0.025 where it is not loose, with a dead neighbour too, 0.069 at least
# where it is (seeds as assess.py has them).
LOOSE_SCATTER = 0.04
NO_RESPONSE = 0.2  # less gain than this counts in no mean
SWAPPED_PITCHES = 0.5
MARKS_MIN = 6

_LOG_PEAK, _LOG_WIDTH, _MIXING, _DIP, _DIP_WIDTH, _SLOPE_X, _SLOPE_Y = range(7)
_COMMON, _OF_SENSOR, _OF_PRESS, _PRINT = 7, 4, 3, 3  # unknowns of all, of a sensor, of a press, of the print


class MarksFit(NamedTuple):
    """By sensor: answers (measured in most presses), gain over the mean of those that respond, where it is found in the layout's axes, off_mm
    from its place there, whose place it has, residual_share (rms of what the picture leaves, of its readings that respond), scatter_share
    (sd of the same readings over the expected ones among the presses of one mark: without the error of the picture, and without what is not
    known of the press) and responses (their number). By press: where it was, its mark in the layout's axes."""

    answers: np.ndarray
    gain: np.ndarray
    sensor_mm: np.ndarray  # [sensor][axis]
    off_mm: np.ndarray
    place: np.ndarray
    residual_share: np.ndarray
    scatter_share: np.ndarray
    responses: np.ndarray
    press_mm: np.ndarray  # [press][axis]
    mark_mm: np.ndarray
    hand_sd_mm: float
    width_mm: float
    slope: np.ndarray  # [axis]: the width grows by this share from the middle to an end
    slope_sd: np.ndarray
    shift_mm: np.ndarray  # of the print on the pad
    turn_rad: float


def _turned(points, turn_rad, shift=(0.0, 0.0)):
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    return points @ np.array([[c, s], [-s, c]]) + shift


class _Fit:
    def __init__(self, array, presses, without):
        self.array, self.without = array, without
        self.sensors, self.presses = array.sensors, len(presses)
        self.places_mm = np.column_stack([array.x_mm, array.y_mm])
        self.mark_mm = np.array([[press.x_mm, press.y_mm] for press in presses])
        reach = np.abs(self.mark_mm).max(axis=0)
        self.along = self.mark_mm / np.where(reach > 0, reach, 1)
        self.mark = np.array([press.mark for press in presses])
        self.reading = np.array([press.placement.reading_Pa for press in presses])
        self.usable = np.array([press.placement.usable for press in presses])
        response = np.where(self.usable, np.maximum(self.reading, 0), 0)
        self.peak_Pa = max(response.max(), 1.0)
        noise = np.array([press.placement.noise_Pa for press in presses])[:, None]
        self.sd = np.sqrt((_MODEL_SHARE * self.peak_Pa) ** 2 + (_READING_SHARE * self.reading) ** 2 + noise**2)
        self.taught = self.usable & ~without
        self.hand_mm, self.is_seated = _HAND_BEGIN_mm, False
        self._lay_out()
        self._begin(response)

    def _lay_out(self):
        """Where each unknown is in the vector, and what each reading depends on."""
        s, p = self.sensors, self.presses
        self.at_sensor = _COMMON + _OF_SENSOR * np.arange(s)
        self.at_press = _COMMON + _OF_SENSOR * s + _OF_PRESS * np.arange(p)
        self.at_print = _COMMON + _OF_SENSOR * s + _OF_PRESS * p
        self.unknowns = self.at_print + _PRINT
        common = np.broadcast_to(np.arange(_COMMON), (p, s, _COMMON))
        own = np.broadcast_to(self.at_sensor[:, None] + np.arange(_OF_SENSOR), (p, s, _OF_SENSOR))
        press = np.broadcast_to((self.at_press[:, None] + np.arange(_OF_PRESS))[:, None], (p, s, _OF_PRESS))
        aimed = [[[at + axis, self.at_print + axis, self.at_print + 2] for axis in range(2)] for at in self.at_press]
        self.touched = np.concatenate([common, own, press], axis=2)[self.taught]
        self.aimed = np.array(aimed).reshape(-1, 3)

    def _begin(self, response):
        # The middle of a sensor's response; a sensor without response is left where it should be.
        weight = response**2
        middle = weight.T @ self.mark_mm / np.maximum(weight.sum(axis=0), 1e-300)[:, None]
        most = response.max(axis=0)
        responds = most > RESPONDS_SHARE**2 * self.peak_Pa
        self.begin_mm = np.where(responds[:, None], middle, self.places_mm)
        width = math.log(0.6 * self.array.pitch_mm)
        dip_width = math.log(_DIP_PITCHES_0 * self.array.pitch_mm)
        common = [math.log(self.peak_Pa), width, _MIXING_0, _DIP_0, dip_width, 0, 0]
        own = np.column_stack([most / self.peak_Pa, self.begin_mm, np.zeros(self.sensors)])
        press = np.column_stack([self.mark_mm, np.zeros(self.presses)])
        self.value = np.concatenate([common, own.ravel(), press.ravel(), np.zeros(_PRINT)])
        self.common_prior = common, [1.0, 1.0, _MIXING_SD, _DIP_SD, _DIP_LOG_SD, _SLOPE_SD, _SLOPE_SD]

    def _priors(self):
        """Mean and 1 / sd of each unknown; 0: no prior."""
        mean, weight = np.zeros(self.unknowns), np.zeros(self.unknowns)
        mean[:_COMMON], weight[:_COMMON] = self.common_prior[0], 1 / np.array(self.common_prior[1])
        place_sd = _SEATED_mm if self.is_seated else _FREE_pitches * self.array.pitch_mm
        own = mean[_COMMON : self.at_press[0]].reshape(-1, _OF_SENSOR)
        own[:, 0], own[:, 1:3] = 1, self.begin_mm
        sds = (_GAIN_SD, place_sd, place_sd, _OWN_WIDTH_SD)
        weight[_COMMON : self.at_press[0]] = np.tile(1 / np.array(sds), self.sensors)
        weight[self.at_press + 2] = 1 / _FORCE_SD
        weight[self.at_print :] = 0 if self.is_seated else 1 / _FIXED
        return mean, weight

    def model(self, v, with_slopes=False):
        """The readings [press][sensor], and their derivatives by what each depends on [press][sensor][unknown]."""
        own = v[_COMMON : self.at_press[0]].reshape(-1, _OF_SENSOR)
        press = v[self.at_press[0] : self.at_print].reshape(-1, _OF_PRESS)
        tilt = self.along @ v[_SLOPE_X : _SLOPE_Y + 1]
        inverse = np.exp(-2 * (v[_LOG_WIDTH] + own[:, 3] + tilt[:, None]))
        dx, dy = press[:, :1] - own[:, 1], press[:, 1:2] - own[:, 2]
        square = dx * dx + dy * dy
        narrow, outer = inverse / NARROW**2, math.exp(-2 * v[_DIP_WIDTH])
        a, b, c = np.exp(-0.5 * square * inverse), np.exp(-0.5 * square * narrow), np.exp(-0.5 * square * outer)
        mixing, dip = v[_MIXING], v[_DIP]
        profile = (1 - mixing) * a + mixing * b - dip * c
        full = np.exp(v[_LOG_PEAK] + press[:, 2:])
        response = own[:, 0] * full * profile
        if not with_slopes:
            return response
        scale = own[:, 0] * full
        core = (1 - mixing) * a * inverse + mixing * b * narrow
        by_square, by_width = -0.5 * (core - dip * c * outer), square * core
        slopes = (
            scale * profile,
            scale * by_width,
            scale * (b - a),
            -scale * c,
            -scale * dip * c * square * outer,
            scale * by_width * self.along[:, :1],
            scale * by_width * self.along[:, 1:],
            full * profile,
            -2 * scale * by_square * dx,
            -2 * scale * by_square * dy,
            scale * by_width,
            2 * scale * by_square * dx,
            2 * scale * by_square * dy,
            scale * profile,
        )
        return response, np.stack(slopes, axis=2)

    def printed_mm(self, v):
        """Where the print has the marks, in the axes of the fit."""
        return _turned(self.mark_mm, v[-1], v[self.at_print : self.at_print + 2])

    def _aim(self, v):
        """How far each press is from its mark, in sds of the hand."""
        press = v[self.at_press[0] : self.at_print].reshape(-1, _OF_PRESS)
        return ((press[:, :2] - self.printed_mm(v)) / self.hand_mm).ravel()

    def cost(self, v):
        """Half of the squares: of readings (Huber), of the hand's aim, of the priors."""
        mean, weight = self._priors()
        size = np.abs(((self.model(v) - self.reading) / self.sd)[self.taught])
        robust = np.where(size <= _HUBER, 0.5 * size**2, _HUBER * (size - 0.5 * _HUBER)).sum()
        return robust + 0.5 * (self._aim(v) ** 2).sum() + 0.5 * (((v - mean) * weight) ** 2).sum()

    def normal_equations(self, v):
        """Matrix and gradient."""
        mean, weight = self._priors()
        expected, slopes = self.model(v, True)
        sd = self.sd[self.taught]
        off = (expected - self.reading)[self.taught] / sd
        robust = np.minimum(1, _HUBER / np.maximum(np.abs(off), 1e-300))
        by = slopes[self.taught] * (np.sqrt(robust) / sd)[:, None]
        around = _turned(self.mark_mm, v[-1])
        by_turn = np.column_stack([around[:, 1], -around[:, 0]]).ravel()
        aim = np.column_stack([np.ones(len(by_turn)), -np.ones(len(by_turn)), by_turn]) / self.hand_mm
        matrix, gradient = np.zeros(self.unknowns**2), (v - mean) * weight**2
        for touched, rows, residual in ((self.touched, by, np.sqrt(robust) * off), (self.aimed, aim, self._aim(v))):
            pairs = (touched[:, :, None] * self.unknowns + touched[:, None, :]).ravel()
            matrix += np.bincount(pairs, (rows[:, :, None] * rows[:, None, :]).ravel(), len(matrix))
            gradient += np.bincount(touched.ravel(), (rows * residual[:, None]).ravel(), self.unknowns)
        return matrix.reshape(self.unknowns, -1) + np.diag(weight**2), gradient

    def solve(self):
        for _ in range(_HAND_TURNS):
            cost, damping = self.cost(self.value), 1e-3
            for _ in range(_STEPS):
                matrix, gradient = self.normal_equations(self.value)
                gained = None
                while gained is None and damping < 1e8:
                    then = self.value - np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), gradient)
                    cost_then = self.cost(then)
                    if cost_then < cost:
                        gained, cost, self.value = cost - cost_then, cost_then, then
                    damping *= 10.0 if gained is None else 0.3
                if gained is None or gained < 1e-6 * (1 + cost):
                    break
            self.covariance = np.linalg.inv(self.normal_equations(self.value)[0])
            variances = np.diag(self.covariance)
            known = variances[self.at_press].sum() + variances[self.at_press + 1].sum()
            squares = ((self._aim(self.value) * self.hand_mm) ** 2).sum() + known
            self.hand_mm = max(math.sqrt(0.5 * squares / self.presses), _HAND_MIN_mm)

    def judge_by_others(self):
        """A sensor that teaches nothing: its readings over those that the others expect of it."""
        gains = self.value[self.at_sensor]
        self.value[self.at_sensor] = np.where(self.without, 1.0, gains)
        expected = np.where(self.usable, self.model(self.value), 0)
        square = (expected**2).sum(axis=0)
        ratio = (expected * np.where(self.usable, self.reading, 0)).sum(axis=0) / np.where(square > 0, square, 1)
        self.value[self.at_sensor] = np.where(self.without, ratio, gains)

    def seat(self, found):
        """At the places where the first fit has found the sensors."""
        self.is_seated, self.hand_mm = True, _HAND_BEGIN_mm
        self.begin_mm = self.places_mm[found.place]
        self.value[_COMMON : self.at_press[0]].reshape(-1, _OF_SENSOR)[:, 1:3] = self.begin_mm
        self.value[self.at_press[0] : self.at_print].reshape(-1, _OF_PRESS)[:, :2] = found.press_mm
        self.value[self.at_print :] = (*found.shift_mm, found.turn_rad)

    def _scatter(self, ratio, variance, counted):
        """The scatter among the presses of one mark that what is not known of the presses does not explain. Where a neighbour is dead, some
        presses are hardly known: the weight of each is how well it would show a scatter of LOOSE_SCATTER."""
        unexplained = weights = 0.0
        for mark in np.unique(self.mark[counted]):
            own = counted & (self.mark == mark)
            rest = 1 - 1 / own.sum()
            weight = (variance[own] + LOOSE_SCATTER**2) ** -2
            unexplained += (weight * ((ratio[own] - ratio[own].mean()) ** 2 - variance[own] * rest)).sum()
            weights += (weight * rest).sum()
        return math.sqrt(max(unexplained / weights, 0)) if weights > 0 else 0.0

    def _align(self, sensor_mm, answers, gain):
        """Turn and shift that bring the sensors as found to their places in the layout."""
        shift, turn = np.zeros(2), 0.0
        for _ in range(_ALIGN_TURNS):
            off = np.hypot(*(_turned(sensor_mm, turn, shift) - self.places_mm).T)
            weight = np.where(answers & (gain > NO_RESPONSE), 1 / (1 + (off / _CAUCHY_mm) ** 2), 0)
            if not weight.sum() > 0:
                break
            found, layout = (weight @ points / weight.sum() for points in (sensor_mm, self.places_mm))
            a, b = sensor_mm - found, self.places_mm - layout
            turn = math.atan2(weight @ (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), weight @ (a * b).sum(axis=1))
            shift = layout - _turned(found, turn)
        return shift, turn

    def result(self):
        own = self.value[_COMMON : self.at_press[0]].reshape(-1, _OF_SENSOR)
        press = self.value[self.at_press[0] : self.at_print].reshape(-1, _OF_PRESS)
        expected, slopes = self.model(self.value, True)
        counted = self.usable & (expected > RESPONDS_SHARE * own[:, 0] * math.exp(self.value[_LOG_PEAK]))
        safe = np.where(counted, expected, 1)
        ratio = np.where(counted, self.reading / safe, 0)
        blocks = np.array([self.covariance[at : at + _OF_PRESS, at : at + _OF_PRESS] for at in self.at_press])
        by_press = slopes[:, :, _COMMON + _OF_SENSOR :]
        variance = np.einsum("pka,pab,pkb->pk", by_press, blocks, by_press) / safe**2
        responses = counted.sum(axis=0)
        residual = np.sqrt(np.where(counted, (ratio - 1) ** 2, 0).sum(axis=0) / np.maximum(responses, 1))
        scatter = np.array([self._scatter(ratio[:, k], variance[:, k], counted[:, k]) for k in range(self.sensors)])
        answers = 2 * self.usable.sum(axis=0) > self.presses
        gain = own[:, 0]
        responding = answers & (gain > NO_RESPONSE * gain[answers].sum() / max(answers.sum(), 1))
        gain = gain / (gain[responding].sum() / max(responding.sum(), 1))
        sensor_mm, press_mm, mark_mm = own[:, 1:3], press[:, :2].copy(), self.printed_mm(self.value)
        shift, turn = self.value[self.at_print : self.at_print + 2], self.value[-1]
        place, off_mm = np.arange(self.sensors), np.zeros(self.sensors)
        if not self.is_seated:
            shift, turn = self._align(sensor_mm, answers, gain)
            sensor_mm, press_mm, mark_mm = (_turned(points, turn, shift) for points in (sensor_mm, press_mm, mark_mm))
            from_places = np.hypot(*(sensor_mm[:, None] - self.places_mm).transpose(2, 0, 1))
            off_mm, limit_mm = np.diag(from_places), SWAPPED_PITCHES * self.array.pitch_mm
            elsewhere = answers & (gain >= NO_RESPONSE) & (off_mm > limit_mm) & (from_places.min(axis=1) < limit_mm)
            place = np.where(elsewhere, from_places.argmin(axis=1), place)
        by_sensor = (answers, gain, sensor_mm, off_mm, place, residual, scatter, responses)
        width_mm, slopes = math.exp(self.value[_LOG_WIDTH]), slice(_SLOPE_X, _SLOPE_Y + 1)
        tilt = self.value[slopes], np.sqrt(np.diag(self.covariance)[slopes])
        return MarksFit(*by_sensor, press_mm, mark_mm, self.hand_mm, width_mm, *tilt, shift, turn)


def fit_marks(array, presses, without=None):
    """without: [sensor] True where the readings teach nothing; their gain and their residual are against what the others teach.
    None: too few marks."""
    if len({press.mark for press in presses}) < MARKS_MIN:
        return None
    fit = _Fit(array, presses, np.zeros(array.sensors, bool) if without is None else without)
    fit.solve()
    found = fit.result()
    fit.seat(found)
    fit.solve()
    fit.judge_by_others()
    return fit.result()._replace(sensor_mm=found.sensor_mm, off_mm=found.off_mm, place=found.place)
