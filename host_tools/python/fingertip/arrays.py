"""The firmware's own C and the tool's calibration, called with arrays: a shared object of entry points (host_tools/tool/arrays/entry.hpp).

    firmware = Firmware(path)
    array = firmware.array(x_mm, y_mm, pitch_mm)
    fits = firmware.fit(array, firmware.settings(noise_Pa=5.0), q10(pressure_Pa))

Arrays have a row for each press. Records are numpy's structured arrays with the fields of the C struct of that name. Units are in the names; what is
named _q10 is 1/1024 of the unit. An argument that suits no parameter, and what C++ throws, is a MeasureError.
"""

import ctypes
import pathlib

import numpy as np

from .errors import InputError
from .version import __version__

ARRAY_OF_SHAPE = 4  # dimensions at most


class MeasureError(InputError):
    pass


class Argument(ctypes.Structure):
    """struct measure_argument"""

    _fields_ = (
        ("data", ctypes.c_void_p),
        ("shape", ctypes.c_int64 * ARRAY_OF_SHAPE),
        ("integer", ctypes.c_int64),
        ("real", ctypes.c_double),
        ("dimensions", ctypes.c_int32),
        ("item_bytes", ctypes.c_int32),
        ("kind", ctypes.c_char),
        ("writable", ctypes.c_bool),
    )


def argument_of(value):
    if isinstance(value, (int, np.integer)):
        return Argument(integer=int(value), real=float(value), kind=b"n")
    if isinstance(value, (float, np.floating)):
        return Argument(real=float(value), kind=b"r")
    if isinstance(value, bytes):
        return Argument(data=ctypes.cast(value, ctypes.c_void_p), kind=b"t")
    if not isinstance(value, np.ndarray) or value.ndim > ARRAY_OF_SHAPE or not value.flags.c_contiguous:
        raise MeasureError(f"{type(value).__name__}: neither a number, a text nor an array in C order")
    padded = value.shape + (0,) * (ARRAY_OF_SHAPE - value.ndim)
    return Argument(
        data=value.ctypes.data,
        shape=(ctypes.c_int64 * ARRAY_OF_SHAPE)(*padded),
        dimensions=value.ndim,
        item_bytes=value.itemsize,
        kind=value.dtype.kind.encode(),
        writable=value.flags.writeable,
    )


def dtype_of(line):
    """A record as measure_records() describes it."""
    name, size, *fields = line.split(" ")
    names, formats, offsets = [], [], []
    for field in fields:
        member, offset, kind, item_bytes, count = field.split(":")
        names.append(member)
        formats.append(f"{count if int(count) else ''}{kind}{item_bytes}" if kind != "S" else f"S{count}")
        offsets.append(int(offset))
    return name, np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": int(size)})


class Library:
    """One shared object. Every entry point measure_NAME is call("NAME", ...)."""

    def __init__(self, path):
        try:
            self.path, self.library = path, ctypes.CDLL(str(path))
        except OSError as error:
            raise MeasureError(f"{path}: {error}; build it: cmake --build --preset host") from None
        for name in ("measure_failure", "measure_records"):
            self._known(name, getattr(self.library, name, None)).restype = ctypes.c_char_p
        self.records = dict(dtype_of(line) for line in self.library.measure_records().decode().splitlines())

    def _known(self, name, found):
        if found is None:
            raise MeasureError(f"{self.path}: knows no {name}: it is of another version than this package, which is {__version__}")
        return found

    def call(self, name, *values):
        self.prepare(name, *values)()

    def prepare(self, name, *values):
        """The call as a function, which takes what these arrays hold when it is called."""
        values = [str(value).encode() if isinstance(value, (str, pathlib.Path)) else value for value in values]
        arguments = (Argument * len(values))(*(argument_of(value) for value in values))
        entry, count = self._known(name, getattr(self.library, f"measure_{name}", None)), ctypes.c_int64(len(values))

        def run(_kept=values):
            if entry(arguments, count):
                raise MeasureError(self.library.measure_failure().decode())

        return run

    def made(self, record, *shape):
        """A new array of such records, all zeros."""
        return np.zeros(shape, self._known(record, self.records.get(record)))


def table_of(rows):
    """Readings, a row for each. Raises InputError."""
    try:
        return np.ma.filled(np.ma.array(rows, float), np.nan)
    except (TypeError, ValueError):
        raise InputError("readings are no numbers, or not as many in each row") from None


def q10(value_Pa):
    """As the firmware has readings, 1/1024 Pa."""
    return np.ascontiguousarray(np.where(np.isnan(value_Pa), 0.0, round_half_away(1024.0 * value_Pa)), np.int32)


def round_half_away(value):
    """As C's round() and lround()."""
    return np.copysign(np.floor(np.abs(value) + 0.5), value)


def usable_of(readings):
    """Bitmap for each row of the sensors with a reading, [.., sensor] -> [..]."""
    bits = np.uint64(1) << np.arange(readings.shape[-1], dtype=np.uint64)
    return np.where(np.isnan(readings), np.uint64(0), bits).sum(axis=-1, dtype=np.uint64)


class Firmware(Library):
    def prepare(self, name, *values):
        """None: no deviations of sensors."""
        return super().prepare(name, *(self.made("fit_deviation", 0, 0) if value is None else value for value in values))

    @property
    def constants(self):
        """firmware_constants of this build."""
        constants = self.made("firmware_constants", 1)
        self.call("constants_of_build", constants)
        return constants[0]

    def layout(self):
        """(x_mm [sensor], y_mm [sensor], pitch_mm) of the firmware."""
        x_mm, y_mm, pitch_mm = np.zeros(15, np.float32), np.zeros(15, np.float32), np.zeros(1, np.float32)
        self.call("own_layout", x_mm, y_mm, pitch_mm)
        return x_mm.astype(float), y_mm.astype(float), float(pitch_mm[0])

    def array(self, x_mm=None, y_mm=None, pitch_mm=None):
        """fit_array of these sensors, or of the firmware's own."""
        if x_mm is None:
            x_mm, y_mm, pitch_mm = self.layout()
        array = self.made("fit_array", 1)
        self.call("array_of", np.asarray(x_mm, np.float32), np.asarray(y_mm, np.float32), float(pitch_mm), array)
        return array

    def settings(self, count=1, *, noise_Pa=None, gain_sd=None, model_sd=None, **fields):
        """fit_settings [count] of the firmware's defaults, but for what is given. gain_sd, model_sd: shares of 1, noise_Pa: for all or
        for each."""
        settings = self.made("fit_settings", count)
        self.call("default_settings", settings)
        for name, value, scale, most in (("noise_Pa_q10", noise_Pa, 1024.0, 2**31 - 1), ("model_sd_q16", model_sd, 65536.0, 65535)):
            if value is not None:
                settings[name] = np.minimum(round_half_away(scale * np.asarray(value, float)), most)
        if gain_sd is not None:
            gain_sd = np.asarray(gain_sd, float)
            settings["gain_sd_q16"][:, : gain_sd.shape[-1] if gain_sd.ndim else None] = round_half_away(65536.0 * gain_sd)
        for name, value in fields.items():
            settings[name] = value
        return settings

    def fit(self, array, settings, pressure_Pa_q10, usable=None, *, deviations=None, kernel="fit"):
        """fit_result [press] of readings [press, sensor] in 1/1024 Pa. usable: bitmap [press] of the sensors to use."""
        return self.timed_fit(array, settings, pressure_Pa_q10, usable, deviations=deviations, kernel=kernel, threads=2)[0]

    def timed_fit(self, array, settings, pressure_Pa_q10, usable=None, *, deviations=None, kernel="fit", threads=1):
        """(fit_result [press], microseconds of processor time for each)."""
        found, us = self.made("fit_result", len(pressure_Pa_q10)), np.zeros(1)
        if usable is None:
            usable = np.full(len(found), (1 << pressure_Pa_q10.shape[1]) - 1, np.uint64)
        self.call("fit", kernel, threads, array, settings, deviations, pressure_Pa_q10, usable, found, us)
        return found, float(us[0])

    def fit_held(self, array, settings, pressure_Pa_q10, usable=None, *, deviations=None):
        """fit_result of presses that are held [press, frame, sensor], or for seven frames alike [press, sensor]: of the last frame, with what the firmware's
        search for a tangential force has found in the frames before. One frame alone is not searched."""
        if pressure_Pa_q10.ndim == 2:
            pressure_Pa_q10 = np.repeat(pressure_Pa_q10[:, None], 7, axis=1)
        found = self.made("fit_result", len(pressure_Pa_q10))
        usable = self.usable(pressure_Pa_q10, usable)
        self.call("fit_held", array, settings, deviations, pressure_Pa_q10, usable, found)
        return found

    @staticmethod
    def usable(pressure_Pa_q10, usable=None):
        """Bitmaps [contact, frame] of readings [contact, frame, sensor]: all sensors, or those of [contact] or [contact, frame]."""
        every = (1 << pressure_Pa_q10.shape[2]) - 1 if usable is None else usable if usable.ndim == 2 else usable[:, None]
        return np.ascontiguousarray(np.broadcast_to(every, pressure_Pa_q10.shape[:2]), np.uint64)

    def profile(self, thickness_mm, overhang_mm=0.0, from_touch=False, layout=None):
        """pad_profile [1] of a pad over these sensors (x_mm, y_mm, pitch_mm), or the firmware's own."""
        x_mm, y_mm, pitch_mm = layout or self.layout()
        profile = self.made("pad_profile", 1)
        places = (np.asarray(each, np.float32) for each in (x_mm, y_mm))
        self.call("profile_of", *places, float(pitch_mm), float(thickness_mm), float(overhang_mm), profile)
        profile["from_touch"] = from_touch
        return profile

    def tangential(self, array, profile, settings, pressure_Pa_q10, usable=None, saturated=None, *, deviations=None):
        """(fit_result, fit_tangential), each [contact, frame], of readings [contact, frame, sensor]; profile: one for all."""
        pad = self.made("fit_pad", 1)
        self.call("tangential_pad", array, profile, pad)
        shape = pressure_Pa_q10.shape[:2]
        usable = self.usable(pressure_Pa_q10, usable)
        saturated = np.zeros(shape, np.uint64) if saturated is None else saturated
        found = self.made("fit_result", *shape), self.made("fit_tangential", *shape)
        self.call("tangential", array, pad, settings, deviations, pressure_Pa_q10, usable, saturated, *found)
        return found

    def calibrate(self, x_mm, y_mm, pitch_mm, t_s, reading_Pa, noise_Pa, *, force_N=1.0, fading=None, last=True):
        """(calibration [session], calibrated_sensor [session, sensor], fit_deviation [session, sensor]) of sessions of placements: t_s [session, placement],
        reading_Pa [session, placement, sensor], NaN where a sensor has none. force_N: of each; fading: share of the readings
        that each loses in half a second; last: no placement follows."""
        sessions, _, sensors = reading_Pa.shape
        shape = sessions, sensors
        found = self.made("calibration", sessions), self.made("calibrated_sensor", *shape), self.made("fit_deviation", *shape)
        numbers = float(pitch_mm), float(noise_Pa), float(force_N), int(last)
        fading = np.zeros((0, 0)) if fading is None else fading
        self.call("calibrate", np.asarray(x_mm, float), np.asarray(y_mm, float), *numbers, t_s, reading_Pa, fading, *found)
        return found
