"""Rows of numbers as text, many at once: the last sixteen characters of a cell are two words of eight bytes, and those of all cells are read together."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.int64]
Words = npt.NDArray[np.uint64]
_FRONT = b"0" * 16  # so that there are two words before the first cell
_ZEROS, _POINTS, _ONES, _TOPS, _OVER_9 = (np.uint64(0x0101010101010101 * byte) for byte in (ord("0"), ord("0") ^ ord("."), 1, 0x80, 0x76))
_LAST = np.array([2**64 - 2 ** (64 - 8 * count) if count else 0 for count in range(9)], np.uint64)  # so many bytes of a word
_LAST_OF_TWO = np.concatenate((np.zeros(8, np.uint64), _LAST))  # in the first of two words
_STEPS = [tuple(map(np.uint64, step)) for step in ((8, 10, 0x00FF00FF00FF00FF), (16, 100, 0x0000FFFF0000FFFF), (32, 10000, 0xFFFFFFFF))]
_ONE, _BYTE, _BUT_ONE, _SEVEN, _BYTES_BEHIND = map(np.uint64, (1, 8, 56, 7, 0x0706050403020100))
_TENS_8 = np.uint64(10**8)
_DIVISORS = 10.0 ** np.arange(17)


class Cells(NamedTuple):
    values: Array  # [row, cell], NaN where it is empty, or odd
    odd: list[tuple[int, int, bytes]]  # row, column, text of those that hold something else than a plain number


def _two_words(aligned: Words, ends: Places) -> tuple[Words, Words]:
    """The last eight characters before each end, and the eight before them; digits as their numbers."""
    at, bits = (ends >> 3) - 2, ends & 7
    bits <<= 3
    shift, rest = bits.view(np.uint64), (64 - bits).view(np.uint64)
    high, middle, low = (aligned[word:].take(at) for word in range(3))
    low <<= rest
    low |= middle >> shift
    high >>= shift
    middle <<= rest
    high |= middle
    low ^= _ZEROS
    high ^= _ZEROS
    return low, high


def _wrong(digits: Words) -> npt.NDArray[np.bool_]:
    found = digits + _OVER_9
    found |= digits
    found &= _TOPS
    is_wrong: npt.NDArray[np.bool_] = found != 0
    return is_wrong


def _number(digits: Words) -> Words:
    """Of eight digits, in their place."""
    for bits, tens, mask in _STEPS:
        upper = digits >> bits
        digits *= tens
        digits += upper
        digits &= mask
    return digits


def _point(digits: Words) -> Words:
    """1 in the byte that has a point."""
    others = digits ^ _POINTS
    found = others - _ONES
    np.invert(others, out=others)
    found &= others
    found &= _TOPS
    found >>= _SEVEN
    return found


def _without(point: Words, digits: Words) -> Words:
    """What is before the point moves by a byte, into its place."""
    before = point - _ONE
    before &= digits
    before <<= _BYTE
    behind: Words = np.invert((point << _BYTE) - _ONE)
    behind &= digits
    behind |= before
    return behind


def _whole_numbers(aligned: Words, ends: Places, lengths: Places) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Numbers of digits alone, and where there is none."""
    low, high = _two_words(aligned, ends)
    low &= _LAST.take(lengths, mode="clip")
    wrong = _wrong(low)
    values = _number(low).astype(np.float64)
    far = np.flatnonzero(lengths > 8)
    high = high[far] & _LAST_OF_TWO.take(lengths[far], mode="clip")
    wrong[far] |= _wrong(high) | (lengths[far] > 15)
    values[far] += 1e8 * _number(high)
    return values, wrong


def _decimals(aligned: Words, ends: Places, lengths: Places, is_negative: npt.NDArray[np.bool_]) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Numbers with a point or without, and where there is none."""
    lengths = lengths - is_negative
    low, high = _two_words(aligned, ends)
    low &= _LAST.take(lengths, mode="clip")
    high &= _LAST_OF_TWO.take(lengths, mode="clip")
    point = _point(low)
    has_point = point != 0
    places = (point * _BYTES_BEHIND) >> _BUT_ONE
    none = np.flatnonzero(~has_point)  # here, but maybe in the word before
    low_none, high_none = low[none], high[none]
    low = _without(point, low)
    low |= high >> _BUT_ONE
    high <<= _BYTE
    point_none = _point(high_none)
    low[none], high[none] = low_none, _without(point_none, high_none)
    places[none] = np.where(point_none != 0, ((point_none * _BYTES_BEHIND) >> _BUT_ONE) + _BYTE, 0)
    wrong = _wrong(low)
    wrong |= _wrong(high)
    wrong |= (lengths - 1 - has_point).view(np.uint64) > 14  # too long, or without a digit
    wrong[none] |= (lengths[none] > 8) & (point_none == 0)
    total = _number(high)
    total *= _TENS_8
    total += _number(low)
    values = total.astype(np.float64)
    values /= _DIVISORS.take(places.view(np.int64), mode="clip")
    values *= np.where(is_negative, -1.0, 1.0)
    return values, wrong


def cells_of(text: bytes, columns: int, has_point: npt.NDArray[np.bool_]) -> Cells | None:
    """Of lines with so many cells each, None where one has others. has_point: of each column; the others have digits alone."""
    padded = b"".join((_FRONT, text, bytes(16 - len(text) % 8)))
    letters = np.frombuffer(padded, np.uint8)
    is_end = letters == ord(",")
    is_end |= letters == ord("\n")
    ends = np.flatnonzero(is_end)
    rows = len(ends) // columns
    is_line_end = letters.take(ends) == ord("\n")
    if rows * columns != len(ends) or np.count_nonzero(is_line_end) != rows or not is_line_end[columns - 1 :: columns].all():
        return None
    lengths = ends - 1
    lengths[1:] -= ends[:-1]
    lengths[0] = ends[0] - len(_FRONT)
    aligned = np.frombuffer(padded, "<u8")
    values = np.full(rows * columns, np.nan)
    odd = []
    filled = lengths > 0
    for is_chosen in (~has_point, has_point):
        at = np.flatnonzero(filled & np.tile(is_chosen, rows))
        chosen, chars = ends.take(at), lengths.take(at)
        if is_chosen is has_point:
            numbers, wrong = _decimals(aligned, chosen, chars, letters.take(chosen - chars) == ord("-"))
        else:
            numbers, wrong = _whole_numbers(aligned, chosen, chars)
        numbers[wrong] = np.nan
        values[at] = numbers
        odd += [(*divmod(int(cell), columns), padded[ends[cell] - lengths[cell] : ends[cell]]) for cell in at[wrong]]
    return Cells(values.reshape(rows, columns), odd)
