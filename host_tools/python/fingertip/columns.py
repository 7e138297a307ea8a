"""The columns of a recording, narrow until one is asked for."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .frames import Q10

Array = npt.NDArray[np.float64]
_BLOCK_rows = 4096
_NARROW = 2.0**32 - 1  # a wider span of whole numbers is kept as doubles
_SENT = {"h": (100.0, 2), "i": (Q10, 4)}  # by struct's codes: as parts of the unit, which text has with so many decimals
_LINE, _TIME = "line", "time_us"
_COUNTING = ("t_us", "frame", "sequence", "raw_sequence", _LINE)  # by about the same step


def shortest(values: npt.NDArray[np.float32]) -> Array:
    """The number of the shortest text that reads back the same binary32."""
    exact = values.astype(np.float64)
    size = np.abs(exact)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        scale = 10.0 ** np.clip(5 - np.floor(np.log10(size)), -30, 40)
        found = np.rint(exact * scale) / scale
        for more in (10.0, 100.0, 1000.0):
            wrong = np.flatnonzero(found.astype(np.float32) != values)
            if not len(wrong):
                break
            found[wrong] = np.rint(exact[wrong] * scale[wrong] * more) / (scale[wrong] * more)
        return np.where((found.astype(np.float32) == values) & (size > 0), found, exact)


class Columns(Mapping[str, Array]):
    """By its name, a column's number for each row, NaN where the cell is empty. It is made when it is first asked for, and kept. Before that
        it takes the bytes that its numbers need: those of a float, of a whole number those of its distance from the least in the block; none where
    all are the same, or count on."""

    def __init__(self, codes: Mapping[str, str], shown: Sequence[str], absent: Sequence[str]) -> None:
        """codes: struct's, by names. shown: the names to be asked for; absent: those that have no number."""
        self._codes = {_TIME: "d", _LINE: "Q", **codes}
        self._shown, self._absent = shown, absent
        names = list(self._codes)
        self._floats = [at for at, name in enumerate(names) if self._codes[name] == "f"]
        self._whole = [at for at, name in enumerate(names) if self._codes[name] not in "fd"]
        self._counting = [(row, at) for row, at in enumerate(self._whole) if names[at] in _COUNTING]
        scales = [_SENT[self._codes[names[at]]][0] if self._codes[names[at]] in _SENT else 1.0 for at in self._whole]
        self._scales, self._unscaled = np.array(scales)[:, None], scales.count(1.0)
        self._waiting = np.empty((len(names), _BLOCK_rows))
        self._filled = 0
        self._blocks: list[tuple[int, list[Any]]] = []  # rows, and of each column one number for all or an array
        self._made: dict[str, Array] = {}
        self.rows = 0

    def append(self, table: Array, lines: Sequence[int], times_us: Sequence[float]) -> None:
        """Rows, the numbers of their lines, and in a recording of several their times on the recorder's clock."""
        at = 0
        while at < len(table):
            to = min(len(table), at + _BLOCK_rows - self._filled)
            rows = self._waiting[:, self._filled : self._filled + to - at]
            rows[0] = times_us[at:to] if len(times_us) else np.nan
            rows[1], rows[2:] = lines[at:to], table[at:to].T
            self._filled += to - at
            at = to
            if self._filled == _BLOCK_rows:
                self._pack()
        self.rows += len(table)

    def _pack(self) -> None:
        table = self._waiting[:, : self._filled]
        block: list[Any] = [self._all_or_one(table[0])] * len(table)
        for at, values in zip(self._floats, table[self._floats].astype(np.float32)):
            block[at] = self._all_or_one(values)
        whole = table[self._whole]
        scaled = whole[self._unscaled :]  # these come last
        scaled *= self._scales[self._unscaled :]
        scaled += np.copysign(0.5, scaled)
        np.trunc(scaled, out=scaled)
        steps = dict.fromkeys(self._whole, 0.0)
        for row, at in self._counting:
            step = (whole[row, -1] - whole[row, 0]) / max(self._filled - 1, 1)
            if np.isfinite(step):
                whole[row] -= np.rint(np.arange(self._filled) * step)
                steps[at] = float(step)
        least, most = whole.min(axis=1).tolist(), whole.max(axis=1).tolist()
        for row, (at, values, low, high) in enumerate(zip(self._whole, whole, least, most)):
            if low != low:
                low, high = float(np.fmin.reduce(values)), float(np.fmax.reduce(values))
                values = np.where(np.isnan(values), low - 1, values)
            if not high - low < _NARROW:
                block[at] = self._all_or_one(table[at] * self._scales[row])
                continue
            width = (int(high - low + 1).bit_length() + 7) // 8 if least[row] != high else 0
            offsets = (values - (low - 1)).astype("<u4") if width else None  # from 1; 0 is a gap
            block[at] = low - 1, steps[at], offsets.view(np.uint8).reshape(-1, 4)[:, :width].copy() if offsets is not None else None
        self._blocks.append((self._filled, block))
        self._filled = 0

    @staticmethod
    def _all_or_one(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        bits = values.view(f"u{values.itemsize}")
        return values[: 1 if (bits == bits[0]).all() else None].copy()

    def take(self, names: Sequence[str]) -> Array:
        """[row, name] of columns that are not shown; once."""
        if self._filled:
            self._pack()
        found = np.empty((self.rows, len(names)))
        for to, name in enumerate(names):
            at, code, begin = list(self._codes).index(name), self._codes[name], 0
            for count, block in self._blocks:
                kept, block[at] = block[at], None
                column = found[begin : begin + count, to]
                if isinstance(kept, tuple):
                    least, step, offsets = kept
                    words = np.zeros((count, 4), np.uint8)
                    words[:, 0] = 1
                    if offsets is not None:
                        words[:, : offsets.shape[1]] = offsets
                    column[:] = words.view("<u4")[:, 0]
                    column[column == 0] = np.nan
                    column += least + np.rint(np.arange(count) * step)
                else:
                    column[:] = shortest(kept) if code == "f" else kept
                begin += count
            if code in _SENT:
                scale, decimals = _SENT[code]
                found[:, to] = np.round(found[:, to] / scale, decimals)
        return found

    def __getitem__(self, name: str) -> Array:
        if name in self._absent:
            return np.broadcast_to(np.nan, self.rows)  # without memory
        if name not in self._shown:
            raise KeyError(name)
        if name not in self._made:
            self._made[name] = self.take([name])[:, 0]
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter((*self._shown, *self._absent))

    def __len__(self) -> int:
        return len(self._shown) + len(self._absent)
