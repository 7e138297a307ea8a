"""The columns of a recording, narrow until one is asked for."""

import weakref
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .frames import Q10

Array = npt.NDArray[np.float64]
_BLOCK_rows = 4096
_KEPT_bytes = 40_000_000  # of columns that were made; one of an hour
_NARROW = 2.0**32 - 1  # a wider span of whole numbers is kept as doubles
_SENT = {"h": (100.0, 2), "i": (Q10, 4)}  # by struct's codes: as parts of the unit, and the decimals in text


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
    """By its name, a column's number for each row, NaN where the cell is empty; not to be changed. It is made when it is asked for, and kept while
    someone has it, or there is room. Each block has the distance of its numbers, or of a float's bits, from the least: in as many bytes as that
    needs, and none where all are the same."""

    def __init__(self, codes: Mapping[str, str], shown: Sequence[str], absent: Sequence[str]) -> None:
        """codes: struct's, by names. shown: the names to be asked for; absent: those that have no number."""
        self._codes = {"time_us": "d", "line": "Q", **codes}
        self._shown, self._absent = shown, absent
        self._floats = [at for at, code in enumerate(self._codes.values()) if code == "f"]
        self._scales = np.array([_SENT[code][0] for code in self._codes.values() if code in _SENT])[:, None]
        self._sent = len(self._codes) - len(self._scales)  # from here on
        self._waiting: list[Array] = []
        self._blocks: list[tuple[int, list[Any]]] = []  # rows, and of each column the least number and the distances, or doubles
        self._made: dict[str, Array] = {}  # the last one asked for at the end
        self._held: weakref.WeakValueDictionary[str, Array] = weakref.WeakValueDictionary()
        self.rows = 0

    def append(self, table: Array, lines: Sequence[int], times_us: Sequence[float]) -> None:
        """Rows, the numbers of their lines, and in a recording of several their times on the recorder's clock."""
        self._waiting.append(np.column_stack((times_us if len(times_us) else np.full(len(table), np.nan), lines, table)))
        self.rows += len(table)
        if sum(map(len, self._waiting)) >= _BLOCK_rows:
            self._pack()

    def _pack(self) -> None:
        whole = np.concatenate(self._waiting).T.copy()
        self._waiting = []
        whole[self._floats] = whole[self._floats].astype(np.float32).view(np.uint32)
        sent = whole[self._sent :]
        sent *= self._scales
        sent += np.copysign(0.5, sent)
        np.trunc(sent, out=sent)
        block: list[Any] = []
        for values, low, high in zip(whole, whole.min(axis=1).tolist(), whole.max(axis=1).tolist()):
            least, most = (float(np.fmin.reduce(values)), float(np.fmax.reduce(values))) if np.isnan(low) else (low, high)
            if most - least < _NARROW and least - 1 < least and block:
                far = (np.nan_to_num(values - (least - 1)) if np.isnan(low) else values - (least - 1)).astype("<u4")  # from 1; 0 is a gap
                width = (int(most - least + 1).bit_length() + 7) // 8
                block.append((least - 1, far.view(np.uint8).reshape(-1, 4)[: 1 if low == high else None, :width].copy()))
            else:
                block.append(values[: 1 if np.isnan(most) else None].copy())
        self._blocks.append((whole.shape[1], block))

    def take(self, names: Sequence[str]) -> Array:
        """[row, name]; once, of columns that are not shown."""
        if any(map(len, self._waiting)):
            self._pack()
        found = np.empty((self.rows, len(names)))
        for to, name in enumerate(names):
            at, code, begin = list(self._codes).index(name), self._codes[name], 0
            for count, block in self._blocks:
                kept, block[at] = block[at], block[at] if name in self._shown else None
                if isinstance(kept, tuple):
                    words = np.zeros((len(kept[1]), 4), np.uint8)
                    words[:, : kept[1].shape[1]] = kept[1]
                    far = words.view("<u4")[:, 0]
                    kept = np.where(far == 0, np.nan, far + kept[0])
                    kept = shortest(kept.astype(np.uint32).view(np.float32)) if code == "f" else kept
                found[begin : begin + count, to] = kept
                begin += count
            if code in _SENT:
                found[:, to] = np.round(found[:, to] / _SENT[code][0], _SENT[code][1])
        return found

    def __getitem__(self, name: str) -> Array:
        if name in self._absent:
            return np.broadcast_to(np.nan, self.rows)  # without memory
        if name not in self._shown:
            raise KeyError(name)
        column = self._held.get(name)
        if column is None:
            self._held[name] = column = self.take([name])[:, 0]
            column.flags.writeable = False
        self._made.pop(name, None)
        self._made[name] = column
        while len(self._made) > 1 and sum(each.nbytes for each in self._made.values()) > _KEPT_bytes:
            del self._made[next(iter(self._made))]
        return column

    def __iter__(self) -> Iterator[str]:
        return iter((*self._shown, *self._absent))

    def __len__(self) -> int:
        return len(self._shown) + len(self._absent)
