"""Rows of numbers as text, many at once: the digits before and behind each point are a word of eight bytes or two, read for all cells together."""

import numpy as np
import numpy.typing as npt

_FRONT = b"0" * 16  # so that there are two words before the first cell
_ZEROS, _TOPS, _OVER_9 = (np.uint64(0x0101010101010101 * byte) for byte in (ord("0"), 0x80, 0x76))
_LAST = np.array([2**64 - 2 ** (64 - 8 * count) if count else 0 for count in range(9)], np.uint64)  # a word's first bytes, by how many
_STEPS = [tuple(map(np.uint64, step)) for step in ((8, 10, 0x00FF00FF00FF00FF), (16, 100, 0x0000FFFF0000FFFF), (32, 10000, 0xFFFFFFFF))]
_DIGITS_MOST = 15  # exact in a double
_TENS = np.array([10**digits for digits in range(_DIGITS_MOST + 1)], np.uint64)


def _numbers(
    aligned: npt.NDArray[np.uint64], ends: npt.NDArray[np.int64], lengths: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.uint64], ...]:
    """Of the digits before each end, as many as this, eight at most; and not 0 where something else is among them."""
    at, bits = (ends >> 3) - 1, (ends & 7) << 3
    digits = aligned.take(at) >> bits.view(np.uint64)
    digits |= aligned[1:].take(at) << (64 - bits).view(np.uint64)
    digits ^= _ZEROS
    digits &= _LAST.take(lengths, mode="clip")
    wrong = digits + _OVER_9
    wrong |= digits
    wrong &= _TOPS
    for shift, tens, mask in _STEPS:
        upper = digits >> shift
        digits *= tens
        digits += upper
        digits &= mask
    return digits, wrong


def cells_of(text: bytes, columns: int, is_whole: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]] | None:
    """[row, cell], NaN where one is empty, of lines with this many cells each; None where one has others. And the rows with cells, NaN too, that hold
    something else than a number of 15 digits at most, or than digits alone where the column is_whole."""
    padded = b"".join((_FRONT, text, bytes(16 - len(text) % 8)))
    letters, aligned = np.frombuffer(padded, np.uint8), np.frombuffer(padded, "<u8")
    ends = np.flatnonzero((letters == ord(",")) | (letters == ord("\n")) | (letters == ord(".")))  # of a cell, or before its point
    marks = letters.take(ends)
    is_point = marks == ord(".")
    last = np.flatnonzero(~is_point)
    is_line_end, rows = marks.take(last) == ord("\n"), len(last) // columns
    if rows * columns != len(last) or np.count_nonzero(is_line_end) != rows or not is_line_end[columns - 1 :: columns].all():
        return None
    lengths = ends - 1
    lengths[1:] -= ends[:-1]
    lengths[0] = ends[0] - len(_FRONT)
    is_negative = letters.take(ends - lengths) == ord("-")
    lengths -= is_negative
    parts, wrong = _numbers(aligned, ends, lengths)
    far = np.flatnonzero(lengths > 8)
    high, wrong_high = _numbers(aligned, ends[far] - 8, lengths[far] - 8)
    parts[far] += high * _TENS[8]
    wrong[far] |= wrong_high
    is_behind = np.concatenate(([False], is_point[:-1]))
    is_odd = (wrong != 0) | (is_behind & (is_point | is_negative))
    has_point = is_behind.take(last)
    first = last - has_point
    decimals = lengths.take(last) * has_point
    digits = lengths.take(first) + decimals
    negative = is_negative.take(first)
    is_marked = has_point | negative
    whole = parts.take(first) * has_point
    whole *= _TENS.take(decimals, mode="clip")
    whole += parts.take(last)
    values = whole.astype(np.float64)
    values /= _TENS.take(decimals, mode="clip")
    values *= 1.0 - 2.0 * negative
    odd = is_odd.take(last) | is_odd.take(first)
    odd |= digits > _DIGITS_MOST
    odd |= is_marked & ((digits == 0) | np.tile(is_whole, rows))
    values[odd | (digits == 0)] = np.nan
    return values.reshape(rows, columns), np.flatnonzero(odd.reshape(rows, columns).any(axis=1))
