"""A fingertip's clock in terms of the host's, from commands and their acknowledgements.

By an exchange the host's clock was between sent and received when the fingertip's was at device_us. A straight line,
offset and drift, must pass between all of these of the last half minute; how far the lines that do are apart at one time bounds the
error, whatever the delays were. The line in the middle, as far from the nearest limits on both sides as it can be, is the estimate.
If no line passes, the clock has jumped, and the older half of the exchanges goes. The same as host_tools/library/libfingertip/clock_fit.hpp.

The host's clock is time.perf_counter(), in microseconds: on Linux CLOCK_MONOTONIC, which joint recordings are in, too.
"""

import collections
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from . import host_time

host_now_us = host_time.now_us
WINDOW_us = 30e6
EXCHANGES = 512
# Crystals are good to 100 ppm with all their errors, at both ends.
SLOPE_LIMIT = 200e-6
# What drift is worth in gap: while the exchanges span less time than this, they do not show it.
DRIFT_COST_us = 1.5e6
# (2/3)^40 of SLOPE_LIMIT, over WINDOW_us: nanoseconds.
STEPS = 40


class ClockExchange(NamedTuple):
    sent_us: int  # host's clock
    received_us: int
    device_us: int


class ClockEstimate(NamedTuple):
    """device_us: of the last exchange; host_us: at that time; drift_ppm: positive is a fast fingertip; uncertainty_us: no error at
    that time is larger."""

    device_us: int
    host_us: float
    drift_ppm: float
    uncertainty_us: float

    def host_at(self, device_us: int) -> float:
        """The host's clock, us, at another time of the fingertip's."""
        return self.host_us + (device_us - self.device_us) / (1 + self.drift_ppm * 1e-6)


def _highest(low: float, high: float, value: Callable[[float], float]) -> float:
    """Where a function that first rises and then falls is highest."""
    for _ in range(STEPS):
        a = low + (high - low) / 3
        b = high - (high - low) / 3
        if value(a) < value(b):
            low = a
        else:
            high = b
    return (low + high) / 2


def _edge(inside: float, outside: float, value: Callable[[float], float]) -> float:
    """The last place on the way from inside to outside where the function is not negative."""
    if value(outside) >= 0:
        return outside
    for _ in range(STEPS):
        middle = (inside + outside) / 2
        if value(middle) >= 0:
            inside = middle
        else:
            outside = middle
    return inside


class ClockFit:
    def __init__(self) -> None:
        self._exchanges: collections.deque[ClockExchange] = collections.deque()
        self.estimate: ClockEstimate | None = None
        """Nothing before the first exchange."""
        self.jumps = 0

    def add(self, exchange: ClockExchange) -> None:
        """In order of device time; what is not, or ends before it began, is left out."""
        if exchange.received_us < exchange.sent_us or (self._exchanges and exchange.device_us < self._exchanges[-1].device_us):
            return
        self._exchanges.append(exchange)
        while len(self._exchanges) > EXCHANGES or exchange.device_us - self._exchanges[0].device_us > WINDOW_us:
            self._exchanges.popleft()
        self.estimate = self._fit()
        if self.estimate is None:
            self.jumps += 1
            while self.estimate is None:
                for _ in range((len(self._exchanges) + 1) // 2):
                    self._exchanges.popleft()
                if not self._exchanges:
                    self._exchanges.append(exchange)
                self.estimate = self._fit()

    def _fit(self) -> ClockEstimate | None:
        last = self._exchanges[-1]
        sent, received, device = np.array(self._exchanges, dtype=np.int64).T - np.array([[last.sent_us], [last.sent_us], [last.device_us]])

        # Limits at the time of the last exchange of a line of this slope, relative to its sending.
        def upper(slope: float) -> float:
            return float((received - device * (1 + slope)).min())

        def lower(slope: float) -> float:
            return float((sent - device * (1 + slope)).max())

        def gap(slope: float) -> float:
            return upper(slope) - lower(slope)

        widest = _highest(-SLOPE_LIMIT, SLOPE_LIMIT, gap)
        if gap(widest) < 0:
            return None
        slowest, fastest = _edge(widest, -SLOPE_LIMIT, gap), _edge(widest, SLOPE_LIMIT, gap)
        slope = _highest(slowest, fastest, lambda s: gap(s) - DRIFT_COST_us * abs(s))
        middle = (upper(slope) + lower(slope)) / 2
        latest = upper(_highest(slowest, fastest, upper))
        earliest = lower(_highest(slowest, fastest, lambda s: -lower(s)))
        return ClockEstimate(last.device_us, last.sent_us + middle, (1 / (1 + slope) - 1) * 1e6, max(latest - middle, middle - earliest))


NO_CLOCK = ClockEstimate(0, math.nan, 0.0, math.inf)
"""Before the first exchange: no time of the host is known."""
