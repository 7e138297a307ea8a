"""How different two pictures look: in CIE L*a*b*, after the blur of an eye that does not look for single pixels."""

import io

import matplotlib.image
import numpy as np

BLUR_px = 3  # of half the size
# sRGB, IEC 61966-2-1
TO_XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]])
WHITE = TO_XYZ.sum(axis=1)


def read(png):
    """float[height][width][3], 0 to 1, of a file's name or its bytes."""
    return matplotlib.image.imread(io.BytesIO(png) if isinstance(png, bytes) else png)[..., :3].astype(np.float64)


def half(picture):
    """Of half the width and height; of an odd one the last line is left out."""
    height, width = (size // 2 * 2 for size in picture.shape[:2])
    return picture[:height, :width].reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))


def write(path, picture):
    matplotlib.image.imsave(path, picture, metadata={"Software": None})


def lab(picture):
    linear = np.where(picture <= 0.04045, picture / 12.92, ((picture + 0.055) / 1.055) ** 2.4)
    ratio = linear @ TO_XYZ.T / WHITE
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)


def blurred(picture):
    """Means of squares of BLUR_px; the margin that fills none is left out."""
    sums = np.pad(picture.cumsum(0).cumsum(1), ((1, 0), (1, 0), (0, 0)))
    return (sums[BLUR_px:, BLUR_px:] - sums[:-BLUR_px, BLUR_px:] - sums[BLUR_px:, :-BLUR_px] + sums[:-BLUR_px, :-BLUR_px]) / BLUR_px**2


def difference(one, other):
    """CIE 1976 colour difference that one place in a hundred exceeds. 2.3 is just noticeable (Mahy et al., 1994)."""
    if one.shape != other.shape:
        raise AssertionError(f"pictures of {one.shape[1]} x {one.shape[0]} and {other.shape[1]} x {other.shape[0]}")
    apart = np.linalg.norm(blurred(lab(one)) - blurred(lab(other)), axis=-1)
    return float(np.percentile(apart, 99))
