"""Names of what the wire protocol numbers (firmware/wire/PROTOCOL.md)."""
import enum


class Flag(enum.IntFlag):
    """What a frame says about itself. A quantity may be used only under its VALID flag; without it, it is NaN here."""

    CONTACT = 1 << 0  #: a sensor is pressed
    FIT_VALID = 1 << 1  #: x, y, p0, sigma, force and residual hold a fit
    UNCERTAINTY_VALID = 1 << 2  #: the standard deviations of location and force have values
    SLIP_VALID = 1 << 3  #: slip_mm spans its whole window
    SLIP = 1 << 4  #: slip_mm is above the threshold
    TARED = 1 << 5  #: readings are relative to a measured zero
    HELD = 1 << 6  #: all of the frame before: the sensors measured their temperature
    WIDTHS_VALID = 1 << 7  #: the widths along the axes have values
    LOW_SIGNAL = 1 << 8  #: warning: peak below 20 noise standard deviations
    FLAT = 1 << 9  #: warning: pressure without a peak, no location
    UNCERTAIN = 1 << 10  #: warning: location_sd_mm exceeds the limit that is set
    MODEL = 1 << 11  #: warning: residual too large for one Gaussian
    SATURATED = 1 << 12  #: warning: a sensor is beyond its range and was left out
    FORCE_LOWER_BOUND = 1 << 13  #: warning: the force is at least this
    SENSOR_MASKED = 1 << 14  #: warning: a sensor is missing or was left out
    AT_BOUND = 1 << 15  #: warning: the fit stopped at a limit
    ELONGATED = 1 << 16  #: warning: the contact is not round
    ZERO_DOUBTFUL = 1 << 17  #: warning: a force and a zero that has moved cannot be told apart
    SENSOR_DOUBTFUL = 1 << 18  #: warning: a sensor in use gives reason to doubt it
    CALIBRATED = 1 << 19  #: gains and force scale of a calibration act
    TANGENTIAL_VALID = 1 << 20  #: the tangential load has values
    TANGENTIAL_FROM_TOUCH = 1 << 21  #: it is what changed since the first touch
    VELOCITY_VALID = 1 << 22  #: the velocity of the contact has values
    MOVING = 1 << 23  #: its speed is above the threshold
    SLIDING = 1 << 24  #: it moves beyond what the load explains


WARNINGS = Flag(0x7FF00)
"""LOW_SIGNAL to SENSOR_DOUBTFUL: the numbers are there, but deserve less trust. Whoever uses them heeds these."""


class Streams(enum.IntFlag):
    """What a fingertip sends unasked."""

    NONE = 0
    CONTACT = 1 << 0
    RAW = 1 << 1
    HEALTH = 1 << 2  #: once a second
    ALL = CONTACT | RAW | HEALTH


class Capability(enum.IntFlag):
    """What a firmware can do."""

    FIT = 1 << 0  #: contact packets: location and force; and calibrations
    SLIP = 1 << 1
    RAW_STREAM = 1 << 2
    TANGENTIAL = 1 << 3  #: tangential load, where the pad's profile is stored


class Stored(enum.IntFlag):
    """What a fingertip keeps without power."""

    CALIBRATION = 1 << 0  #: it acts
    SETTINGS = 1 << 1
    WRITING = 1 << 2  #: a write is under way
    DAMAGED = 1 << 3  #: what is there is damaged or of a later firmware, and not used
    PAD = 1 << 4  #: the pad's profile; it acts


class Result(enum.IntEnum):
    """What an acknowledgement says."""

    DONE = 0
    UNKNOWN_COMMAND = 1
    OUT_OF_RANGE = 2
    NOT_NOW = 3
