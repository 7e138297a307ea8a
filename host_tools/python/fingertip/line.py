"""written by firmware/wire/line.py from line.toml; change it there.

The packets of the line between a fingertip and its host (firmware/wire/PROTOCOL.md), and the names of what they number. The annotations of a
body are its layout, for both directions. A quantity that is there only under a bit of another field is NaN (a float) or None without it.
"""
import enum
import math
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from .flags import Flags

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

VERSION = 9
SENSORS_MAX = 36
SENSORS_OF_WORD, ALL_OF_WORD = 32, (1 << 32) - 1
WIDE = 128
"""Of a version: the packet is of more sensors, or a map of it has one beyond these, so that its maps have 64 bits."""
MAX_FRAME_BYTES = 1127  # longer is damage
LOADER_MAGIC = 0x746F6F42


class Wire(NamedTuple):
    """How a field travels: struct's code, how many of it, whether once for each sensor, under which bit of which field; of a map, that of a wide one."""

    code: str
    times: int = 1
    each_sensor: bool = False
    when: tuple[str, int] | None = None
    absent: Any = None
    is_map: bool = False


class Flag(Flags):
    """What a frame reports about itself. A quantity may be used only under its VALID flag; without it, it is NaN here."""

    CONTACT = 1 << 0  #: a sensor is pressed
    FIT_VALID = 1 << 1  #: x, y, p0, sigma, force and residual hold a fit
    UNCERTAINTY_VALID = 1 << 2  #: the standard deviations of location and force have values
    SLIP_VALID = 1 << 3  #: the slip distance spans its whole window
    SLIP = 1 << 4  #: the slip distance is above the threshold
    TARED = 1 << 5  #: readings are relative to a measured zero
    HELD = 1 << 6  #: all values are those of the frame before: the sensors measured their temperature
    WIDTHS_VALID = 1 << 7  #: the widths along the axes and their correlation have values
    LOW_SIGNAL = 1 << 8  #: warning: the peak is below 20 standard deviations of the noise
    FLAT = 1 << 9  #: warning: there is pressure without a peak: no location
    UNCERTAIN = 1 << 10  #: warning: location_sd_mm is above the limit that is set
    MODEL = 1 << 11  #: warning: the residual is too large for one Gaussian
    SATURATED = 1 << 12  #: warning: a sensor is beyond its range and was left out
    FORCE_LOWER_BOUND = 1 << 13  #: warning: too few sensors are in their range: the force is at least this
    SENSOR_MASKED = 1 << 14  #: warning: a sensor is missing or was left out
    AT_BOUND = 1 << 15  #: warning: the fit stopped at a limit
    ELONGATED = 1 << 16  #: warning: the contact is not round
    ZERO_DOUBTFUL = 1 << 17  #: warning: the pressure may be a force or a zero that has moved
    SENSOR_DOUBTFUL = 1 << 18  #: warning: a sensor in use gives reason to doubt it
    CALIBRATED = 1 << 19  #: gains and force scale of a calibration are applied
    TANGENTIAL_VALID = 1 << 20  #: the tangential force has values; location and force are corrected for it
    TANGENTIAL_FROM_TOUCH = 1 << 21  #: the tangential force is the change since the first touch
    VELOCITY_VALID = 1 << 22  #: the velocity of the contact has values
    MOVING = 1 << 23  #: the speed of the contact is above the threshold
    SLIDING = 1 << 24  #: the contact moves beyond what the tangential force explains, however slowly
    TANGENTIAL_LATE = 1 << 25  #: warning: the second processor did not estimate the tangential force in time: location and force are not corrected for it
    SHAPE_VALID = 1 << 26  #: the contact shape is known: one contact, unless one of the three below is set
    TWO_CONTACTS = 1 << 27  #: warning: two contacts press, and each has a place and a force: x_mm and y_mm are the place of neither
    EDGE = 1 << 28  #: one long contact presses, and its direction and length have values
    SHAPE_UNKNOWN = 1 << 29  #: warning: the contact shape is neither one contact nor a long one nor two


WARNINGS = Flag(0x2A07FF00)
"""The numbers are there, but deserve less trust: look at these before you use them."""


class Streams(Flags):
    """What a fingertip sends unasked."""

    NONE = 0
    CONTACT = 1 << 0  #: contact packets
    RAW = 1 << 1  #: raw packets
    HEALTH = 1 << 2  #: health packets, once a second
    ALL = CONTACT | RAW | HEALTH


class Capability(Flags):
    """What a firmware can do."""

    FIT = 1 << 0  #: contact packets: location and force; and calibrations
    SLIP = 1 << 1  #: slip, and the command that sets it
    RAW_STREAM = 1 << 2  #: raw packets
    TANGENTIAL = 1 << 3  #: tangential force, where the pad's profile is stored
    SYNC = 1 << 4  #: sync packets, and the command that sets the sync pin
    SECOND = 1 << 5  #: the second processor runs, now; without it the first does its work, with the same results at fewer frames a second


class Stored(Flags):
    """What a fingertip keeps without power."""

    CALIBRATION = 1 << 0  #: a calibration, and it is applied; never without capability fit
    SETTINGS = 1 << 1  #: settings; it started with them
    WRITING = 1 << 2  #: a change is on its way into the flash
    DAMAGED = 1 << 3  #: the content is damaged, or of a later firmware, and not used; storing again repairs it
    PAD = 1 << 4  #: a pad's profile, and it is applied; never without capability tangential


class Result(enum.IntEnum):
    """What an acknowledgement reports."""

    DONE = 0  #: the command was carried out
    UNKNOWN_COMMAND = 1  #: the firmware does not know this command
    OUT_OF_RANGE = 2  #: a value is out of range for this firmware
    NOT_NOW = 3  #: not now: a tare while no sensor answers, or in contact and not forced; a command that stores while another is being written, or if the flash fails


class Calibration(NamedTuple):
    """Gains (pressure = reading / gain) and force scale of one pad."""

    date_s: Annotated[int, Wire("I")]
    """date of the calibration, Unix time"""
    placements: Annotated[int, Wire("H")]
    """placements that entered it"""
    force_scale: Annotated[float, Wire("f")]
    """force is this times 2 pi p0 sigma^2"""
    force_scale_sd: Annotated[float, Wire("f")]
    """its standard deviation"""
    sigma_um: Annotated[int, Wire("H")]
    """sigma of a usual contact on this pad, um; 0: not known"""
    sigma_sd_um: Annotated[int, Wire("H")]
    """its standard deviation from contact to contact"""
    dip_share_q16: Annotated[int, Wire("H")]
    """depth of the dip around a contact, of its peak, 1/65536; 0: none"""
    dip_sd_um: Annotated[int, Wire("H")]
    """standard deviation of the dip's Gaussian"""
    ambient_kPa: Annotated[int, Wire("B")]
    """air in which the force scale was found; 0: not known"""
    gains_and_sds: Annotated[tuple[float, ...], Wire("f", 2, each_sensor=True)]
    """of each sensor: gain, and its relative standard deviation"""
    places_and_widths: Annotated[tuple[int, ...], Wire("h", 3, each_sensor=True)]
    """of each sensor: how far it lies from its place in the layout, um, and the log of the width in which it measures a contact over that
    of the others, 1/32768; zeros: not known
    """

    @property
    def gains(self) -> tuple[float, ...]:
        """Of each sensor."""
        return self.gains_and_sds[0::2]

    @property
    def gain_sds(self) -> tuple[float, ...]:
        """Of each sensor."""
        return self.gains_and_sds[1::2]

    @property
    def off_x_um(self) -> tuple[int, ...]:
        """Of each sensor."""
        return self.places_and_widths[0::3]

    @property
    def off_y_um(self) -> tuple[int, ...]:
        """Of each sensor."""
        return self.places_and_widths[1::3]

    @property
    def wider_q15(self) -> tuple[int, ...]:
        """Of each sensor."""
        return self.places_and_widths[2::3]


class PadProfile(NamedTuple):
    """How the rubber of a pad spreads a press and a pull (firmware/common/pad_profile.h has meaning and ranges)."""

    thickness_mm: Annotated[float, Wire("f")]
    """of the rubber"""
    overhang_mm: Annotated[float, Wire("f")]
    """of the rubber beyond the outer sensors; 0: not set"""
    normal: Annotated[tuple[float, ...], Wire("f", 4)]
    """two normal terms: share and sd_mm of each"""
    tangential: Annotated[tuple[float, ...], Wire("f", 6)]
    """three tangential terms: moment_mm and sd_mm of each"""
    spread_mm2: Annotated[float, Wire("f")]
    """expected value of a contact's own spread"""
    spread_sd_mm2: Annotated[float, Wire("f")]
    """its standard deviation"""
    force_ratio: Annotated[float, Wire("f")]
    """2 pi p0 sigma^2 of a usual contact over its force"""
    tangential_scale: Annotated[float, Wire("f")]
    """tangential force is this times the profile's"""
    tangential_scale_sd: Annotated[float, Wire("f")]
    """its standard deviation"""
    edge_ratio_x: Annotated[tuple[float, ...], Wire("f", 3)]
    """effect of the pad's ends, three coefficients each: on the ratio along x"""
    edge_ratio_y: Annotated[tuple[float, ...], Wire("f", 3)]
    """on the ratio along y"""
    edge_gain_x: Annotated[tuple[float, ...], Wire("f", 3)]
    """on the gain along x"""
    edge_gain_y: Annotated[tuple[float, ...], Wire("f", 3)]
    """on the gain along y"""
    edge_place_x_mm: Annotated[tuple[float, ...], Wire("f", 3)]
    """on the place, x"""
    edge_place_y_mm: Annotated[tuple[float, ...], Wire("f", 3)]
    """on the place, y"""
    edge_pull_x_mm: Annotated[tuple[float, ...], Wire("f", 3)]
    """on the place by a tangential force along x"""
    edge_pull_y_mm: Annotated[tuple[float, ...], Wire("f", 3)]
    """on the place by a tangential force along y"""
    edge_force: Annotated[tuple[float, ...], Wire("f", 3)]
    """on the force"""
    from_touch: Annotated[int, Wire("B")]
    """1: the fingertip reports the tangential force from the first touch on; 0: from zero"""


class Contact(NamedTuple):
    """One judged frame. The header's time is the middle of the sensors' conversion. A quantity travels only under its VALID flag. Without
    it the encoder leaves it out and the decoder gives 0 (NaN in Python and in messages).
    """

    frame: Annotated[int, Wire("I")]
    """counts every frame since start, fitted or not"""
    flags: Annotated[int, Wire("I")]
    """flags of the frame, see below"""
    convert_us: Annotated[int, Wire("H")]
    """broadcast of the conversion command, and the sensors' conversion"""
    read_us: Annotated[int, Wire("H")]
    """reading every sensor"""
    queue_us: Annotated[int, Wire("H")]
    """the complete frame waits for the processor"""
    condition_us: Annotated[int, Wire("H")]
    """compensation, tare, gate"""
    fit_us: Annotated[int, Wire("H")]
    """the fit"""
    contact_us: Annotated[int, Wire("H")]
    """slip, and the flags of the result"""
    total_us: Annotated[int, Wire("H")]
    """the sum of the six stages: from the first bus activity of the frame to the encoding of this packet"""
    sensors_used: Annotated[int, Wire("Q", is_map=True, when=("flags", Flag.FIT_VALID), absent=0)]
    """bitmap of the sensors that entered the fit"""
    x_mm: Annotated[float, Wire("f", when=("flags", Flag.FIT_VALID), absent=math.nan)]
    """location across the strips, from the centre of the pad"""
    y_mm: Annotated[float, Wire("f", when=("flags", Flag.FIT_VALID), absent=math.nan)]
    """location along the strips"""
    p0_Pa: Annotated[float, Wire("f", when=("flags", Flag.FIT_VALID), absent=math.nan)]
    """peak of the fitted Gaussian"""
    sigma_mm: Annotated[float, Wire("f", when=("flags", Flag.FIT_VALID), absent=math.nan)]
    """standard deviation of the fitted Gaussian"""
    force_N: Annotated[float, Wire("f", when=("flags", Flag.FIT_VALID), absent=math.nan)]
    """force scale times 2 pi p0 sigma^2, paper eq. (4), where AT_BOUND with at most the largest reading for p0; positive: pressing"""
    residual_rms_Pa: Annotated[float, Wire("f", when=("flags", Flag.FIT_VALID), absent=math.nan)]
    """root mean square of the residuals of the fit"""
    location_sd_mm: Annotated[float, Wire("f", when=("flags", Flag.UNCERTAINTY_VALID), absent=math.nan)]
    """predicted radial standard deviation of the location"""
    force_sd_N: Annotated[float, Wire("f", when=("flags", Flag.UNCERTAINTY_VALID), absent=math.nan)]
    """predicted standard deviation of the force, with that of the force scale: 0.8 of the force on a pad that was never calibrated with a
    weight
    """
    slip_mm: Annotated[float, Wire("f", when=("flags", Flag.SLIP_VALID), absent=math.nan)]
    """slip distance, paper eq. (7): from the mean location over the slip window"""
    sigma_x_mm: Annotated[float, Wire("f", when=("flags", Flag.WIDTHS_VALID), absent=math.nan)]
    """standard deviation of an elliptic Gaussian along x"""
    sigma_y_mm: Annotated[float, Wire("f", when=("flags", Flag.WIDTHS_VALID), absent=math.nan)]
    """standard deviation of that along y"""
    width_correlation: Annotated[float, Wire("f", when=("flags", Flag.WIDTHS_VALID), absent=math.nan)]
    """of that Gaussian, -1 to 1; 0 unless it lies aslant"""
    qx_N: Annotated[float, Wire("f", when=("flags", Flag.TANGENTIAL_VALID), absent=math.nan)]
    """tangential force of the object on the rubber, along x"""
    qy_N: Annotated[float, Wire("f", when=("flags", Flag.TANGENTIAL_VALID), absent=math.nan)]
    """tangential force along y"""
    q_sd_N: Annotated[float, Wire("f", when=("flags", Flag.TANGENTIAL_VALID), absent=math.nan)]
    """predicted standard deviation of either where force_N is right, with that of the tangential scale"""
    tangential_ratio: Annotated[float, Wire("f", when=("flags", Flag.TANGENTIAL_VALID), absent=math.nan)]
    """size of the tangential force over force_N"""
    vx_mm_s: Annotated[float, Wire("f", when=("flags", Flag.VELOCITY_VALID), absent=math.nan)]
    """velocity of the contact along x"""
    vy_mm_s: Annotated[float, Wire("f", when=("flags", Flag.VELOCITY_VALID), absent=math.nan)]
    """velocity of the contact along y"""
    shape_age_ms: Annotated[float, Wire("f", when=("flags", Flag.SHAPE_VALID), absent=math.nan)]
    """age of the frame that the following values are of"""
    x1_mm: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """location of the stronger of two contacts, as x_mm"""
    y1_mm: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """as y_mm"""
    location1_sd_mm: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """predicted radial standard deviation of this location"""
    force1_N: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """force of the stronger of two contacts"""
    force1_sd_N: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """its predicted standard deviation, with that of the force scale"""
    x2_mm: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """location of the weaker of two contacts, as x_mm"""
    y2_mm: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """as y_mm"""
    location2_sd_mm: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """predicted radial standard deviation of this location"""
    force2_N: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """force of the weaker of two contacts"""
    force2_sd_N: Annotated[float, Wire("f", when=("flags", Flag.TWO_CONTACTS), absent=math.nan)]
    """its predicted standard deviation, with that of the force scale"""
    edge_angle_deg: Annotated[float, Wire("f", when=("flags", Flag.EDGE), absent=math.nan)]
    """direction of a long contact, from x towards y, -90 to 90"""
    edge_angle_sd_deg: Annotated[float, Wire("f", when=("flags", Flag.EDGE), absent=math.nan)]
    """its predicted standard deviation"""
    edge_length_mm: Annotated[float, Wire("f", when=("flags", Flag.EDGE), absent=math.nan)]
    """length of the line that presses evenly"""


class Raw(NamedTuple):
    """The readings of one frame, without the gains of a calibration. The header's time is that of the contact packet of the same frame
    number.
    """

    frame: Annotated[int, Wire("I")]
    """the same number as in the contact packet of this frame"""
    flags: Annotated[int, Wire("I")]
    """as in the contact packet; firmware without capability fit sets only CONTACT, TARED, HELD, SATURATED, SENSOR_MASKED, ZERO_DOUBTFUL and
    SENSOR_DOUBTFUL
    """
    valid: Annotated[int, Wire("Q", is_map=True)]
    """bitmap: the reading is a measurement; 0 in a held frame, whose readings are those of the frame before"""
    saturated: Annotated[int, Wire("Q", is_map=True)]
    """bitmap: the reading is above 1980 mbar, where the sensor's range ends, and does not enter the fit"""
    doubtful: Annotated[int, Wire("Q", is_map=True)]
    """bitmap: a measurement with a reason to doubt it; 0 in a held frame"""
    temperature_cC: Annotated[int, Wire("h")]
    """mean of the sensors, 0.01 degC; 0 until measured"""
    sensors: Annotated[int, Wire("n")]
    """number of sensors, 1 to 36"""
    readings: Annotated[tuple[int, ...], Wire("i", 2, each_sensor=True)]
    """of each sensor: absolute pressure, and the zero, of which the fit subtracts what has not faded in this contact; both in 1/1024 Pa"""


class Info(NamedTuple):
    """Identity, settings and stored data of a fingertip. Without its capability a field is 0 (None or NaN in Python)."""

    firmware: Annotated[tuple[int, ...], Wire("B", 3)]
    """major, minor, patch"""
    sensors: Annotated[int, Wire("n")]
    """number of sensors, 1 to 36"""
    capabilities: Annotated[int, Wire("I")]
    """what the firmware can do, see below"""
    git: Annotated[str, Wire("16s")]
    """commit of the firmware; a final + means uncommitted changes"""
    board: Annotated[str, Wire("16s")]
    """name of the board"""
    scene: Annotated[str, Wire("16s")]
    """name of the scene"""
    serial: Annotated[str, Wire("16s")]
    """16 hexadecimal digits, the flash chip's unique id"""
    rate_mHz: Annotated[int, Wire("I")]
    """requested frame rate; 0: as fast as the sensors allow"""
    measured_rate_mHz: Annotated[int, Wire("I")]
    """frame rate over the last second; 0 before"""
    osr: Annotated[int, Wire("H")]
    """oversampling ratio, 256 to 8192"""
    temperature_interval_ms: Annotated[int, Wire("H")]
    """time between temperature conversions while the temperature changes; up to four times as long while it is constant"""
    streams: Annotated[int, Wire("B")]
    """streams that are on"""
    fit_iterations: Annotated[int | None, Wire("B", when=("capabilities", Capability.FIT))]
    """iterations of the fit"""
    slip_window_ms: Annotated[int | None, Wire("H", when=("capabilities", Capability.SLIP))]
    """slip window"""
    slip_threshold_mm: Annotated[float, Wire("f", when=("capabilities", Capability.SLIP), absent=math.nan)]
    """slip threshold"""
    pitch_mm: Annotated[float, Wire("f")]
    """of a rectangular layout; 0 for a free one"""
    xy_mm: Annotated[tuple[float, ...], Wire("f", 2, each_sensor=True)]
    """of each sensor: x and y, from the centre of the pad"""
    prior_sigma_mm: Annotated[float, Wire("f", when=("capabilities", Capability.FIT), absent=math.nan)]
    """prior on sigma that is set"""
    prior_width_mm: Annotated[float, Wire("f", when=("capabilities", Capability.FIT), absent=math.nan)]
    """its standard deviation; 0: none is set, and the sigma of a calibration is applied"""
    location_limit_mm: Annotated[float, Wire("f", when=("capabilities", Capability.FIT), absent=math.nan)]
    """UNCERTAIN is set where location_sd_mm is above it"""
    sync: Annotated[int | None, Wire("B", when=("capabilities", Capability.SYNC))]
    """sync pin: 0 off, 1 in, 2 frame, 3 second"""
    stored: Annotated[int, Wire("I")]
    """what the fingertip keeps without power, see below"""
    calibration: Annotated[Calibration | None, Wire("Calibration", when=("stored", Stored.CALIBRATION))]
    """the calibration, below"""
    pad: Annotated[PadProfile | None, Wire("PadProfile", when=("stored", Stored.PAD))]
    """the pad's profile, below"""

    @property
    def x_mm(self) -> tuple[float, ...]:
        """Of each sensor."""
        return self.xy_mm[0::2]

    @property
    def y_mm(self) -> tuple[float, ...]:
        """Of each sensor."""
        return self.xy_mm[1::2]


class Health(NamedTuple):
    """Counters since start, modulo 2^32, and present state."""

    capabilities: Annotated[int, Wire("I")]
    """as in info"""
    uptime_s: Annotated[int, Wire("I")]
    """since start"""
    frames: Annotated[int, Wire("I")]
    """frames that were read from the array"""
    frames_incomplete: Annotated[int, Wire("I")]
    """of these, with at least one sensor missing"""
    frames_skipped: Annotated[int, Wire("I")]
    """of these, never fitted: the processor was behind"""
    packets_sent: Annotated[int, Wire("I")]
    """handed to the USB queue"""
    packets_dropped: Annotated[int, Wire("I")]
    """the queue was full: whole packets, and each leaves a gap in the sequence"""
    commands_done: Annotated[int, Wire("I")]
    """commands carried out"""
    commands_rejected: Annotated[int, Wire("I")]
    """commands that were unknown, out of range, damaged, or not possible at that time"""
    bus_nacks: Annotated[int, Wire("I")]
    """reads that a sensor did not acknowledge, or that broke off"""
    bus_timeouts: Annotated[int, Wire("I")]
    """operations on the bus that did not end in time"""
    bus_recoveries: Annotated[int, Wire("I")]
    """nine clocks, and resets of multiplexers"""
    zero_readings: Annotated[int, Wire("I")]
    """conversions that had not finished, and those that are void after one of these or after a missed reading"""
    implausible_readings: Annotated[int, Wire("I")]
    """readings left out: below zero, or a step that no other sensor shared"""
    sensors_present: Annotated[int, Wire("Q", is_map=True)]
    """bitmap: the sensor answered at the last attempt"""
    sensors_prom_bad: Annotated[int, Wire("Q", is_map=True)]
    """bitmap: the PROM's CRC is wrong, and the sensor still streams; or the PROM is blank, and it does not"""
    watchdog_resets: Annotated[int, Wire("I")]
    """since power-on. Faults and panics end in one too. The command crash asks for the last"""
    cpu_busy_permille: Annotated[int, Wire("H")]
    """main loop without interrupts, over the last second"""
    stack_free_bytes: Annotated[int, Wire("H")]
    """never touched since start"""
    fit_failures: Annotated[int | None, Wire("I", when=("capabilities", Capability.FIT))]
    """frames in contact whose fit could not be solved"""


class Acknowledgement(NamedTuple):
    """The answer to a command."""

    command: Annotated[int, Wire("B")]
    """type of the command"""
    result: Annotated[int, Wire("B")]
    """result, see below"""
    command_sequence: Annotated[int, Wire("H")]
    """the command's own"""
    host_time_us: Annotated[int, Wire("Q")]
    """time in the command's header, so that the host can relate the clocks"""


class Crash(NamedTuple):
    """How the firmware last ended since power-on. If kind and all else is 0, it did not (firmware/common/crash.h explains the codes)."""

    kind: Annotated[int, Wire("B")]
    """0 none, 1 hard fault, 2 panic, 3 watchdog, 4 an unhandled exception, 5 stack overflow, 6 start-up gave up"""
    exception: Annotated[int, Wire("B")]
    """exception in which the code at pc ran: 0 main loop, 16 + n interrupt n"""
    vector: Annotated[int, Wire("B")]
    """exception that made the record; 0 for a panic"""
    activity: Annotated[int, Wire("B")]
    """activity of the main loop: 0 start, 1 rest, 2 commands, 3 readings, 4 condition, 5 fit, 6 contact, 7 packet, 8 health, 9 store"""
    stuck: Annotated[int, Wire("B")]
    """parts without progress, for kind 3: bit 0 main loop, 1 scan, 2 USB, 3 interrupts"""
    events: Annotated[tuple[int, ...], Wire("B", 8)]
    """the last events, newest first: 0 none, 1 start, 2 command, 3 port closed, 4 bus asleep, 5 awake, 6 stored, 7 other sensors answer, 8
    timeouts on the sensor bus, 9 frames skipped, 10 the second processor did not answer, and was started again
    """
    event_details: Annotated[tuple[int, ...], Wire("B", 8)]
    """of these: type of the command; 1 if storing failed; 1 if the second processor does not start; number of timeouts or frames in a
    second
    """
    r0: Annotated[int, Wire("I")]
    """registers; all 0 if they could not be recorded"""
    r1: Annotated[int, Wire("I")]
    r2: Annotated[int, Wire("I")]
    r3: Annotated[int, Wire("I")]
    r12: Annotated[int, Wire("I")]
    lr: Annotated[int, Wire("I")]
    pc: Annotated[int, Wire("I")]
    xpsr: Annotated[int, Wire("I")]
    sp: Annotated[int, Wire("I")]
    event_ages: Annotated[tuple[int, ...], Wire("I", 8)]
    """ages of the events at the end, in 1024 us; they saturate"""
    end_us: Annotated[int, Wire("Q")]
    """time of the end, since the start before it"""


class SyncEdge(NamedTuple):
    """An edge at the sync pin. The header's time is that of the edge."""

    number: Annotated[int, Wire("I")]
    """counts the edges since the pin was set, from 1, modulo 2^32; a gap is edges that came too fast. An odd one rises"""
    level: Annotated[int, Wire("B")]
    """of the pin after it: 1 high, 0 low"""


class SetStreams(NamedTuple):
    """Set the streams to send; 0 stops. A stream that the firmware's capabilities lack is out of range. Nothing streams until this command,
    so that a terminal that echoes cannot start it by accident.
    """

    streams: Annotated[int, Wire("B")]
    """bits of the streams"""


class Tare(NamedTuple):
    """Measure the zero over the next 16 frames (at rates below 16 Hz those of a second, three at least). The device reports no contact
    meanwhile. In contact, and while no sensor answers, it refuses with "not now", since the press would become the zero. The zero
    follows slow drift only while nothing touches the pad. So send this between grasps, as the paper does.
    """

    force: Annotated[int, Wire("B")]
    """1: tare even in contact, if that contact is known to be none; 0"""


class SetRate(NamedTuple):
    """Set the frame rate; 0: as fast as the sensors allow."""

    rate_mHz: Annotated[int, Wire("I")]
    """frame rate, or 0"""


class SetOsr(NamedTuple):
    """Set the oversampling."""

    osr: Annotated[int, Wire("H")]
    """oversampling ratio"""


class SetSlip(NamedTuple):
    """Set the slip metric. The device keeps 160 frames of the window: 122 ms at 1307 frames/s, 390 ms at 410."""

    threshold_mm: Annotated[float, Wire("f")]
    """slip threshold"""
    window_ms: Annotated[int, Wire("H")]
    """slip window"""


class AskInfo(NamedTuple):
    """Send info, after the acknowledgement."""


class AskHealth(NamedTuple):
    """Send health, after the acknowledgement."""


class AskCrash(NamedTuple):
    """Send crash, after the acknowledgement."""


class Loader(NamedTuple):
    """Acknowledge, then reboot to the boot ROM's USB loader. Opening the port at 1200 baud does the same."""

    magic: Annotated[int, Wire("I")]
    """0x746F6F42, so that a stray byte never reboots a fingertip"""


class StoreCalibration(NamedTuple):
    """Store a calibration. Gains 0.25 to 4, their standard deviations 0 to 0.5, sensors up to 2000 um from their places and wider or
    narrower by up to 9830/32768, scale 0.1 to 10, its standard deviation 0 to 1. It is applied from the first frame after the
    acknowledgement.
    """

    sensors: Annotated[int, Wire("n")]
    """that of the fingertip"""
    calibration: Annotated[Calibration, Wire("Calibration")]
    """as in info"""


class EraseCalibration(NamedTuple):
    """Erase the calibration: gains and scale are 1 again."""


class Keep(NamedTuple):
    """Keep settings without power."""

    keep: Annotated[int, Wire("B")]
    """1: from now on start with the present rate, OSR, slip settings, prior, limit and sync pin; 0: with the firmware's own again"""


class SetPrior(NamedTuple):
    """Set the width to expect of a contact, and its standard deviation; 0 and 0: none, and the sigma of a calibration is applied."""

    sigma_mm: Annotated[float, Wire("f")]
    """width"""
    width_mm: Annotated[float, Wire("f")]
    """its standard deviation"""


class SetLocationLimit(NamedTuple):
    """Set the limit of location_sd_mm above which UNCERTAIN is set."""

    limit_mm: Annotated[float, Wire("f")]
    """limit"""


class StorePad(NamedTuple):
    """Store a pad's profile, each value in its range and the terms in order of width. It is applied from the first frame after the
    acknowledgement.
    """

    profile: Annotated[PadProfile, Wire("PadProfile")]
    """as in info"""


class ErasePad(NamedTuple):
    """Erase the pad profile: there is no tangential force from now on."""


class SetSync(NamedTuple):
    """Set the sync pin, as in packet sync; 0: off."""

    mode: Annotated[int, Wire("B")]
    """1 in, 2 frame, 3 second"""


Body = Contact | Raw | Info | Health | Acknowledgement | Crash | SyncEdge | SetStreams | Tare | SetRate | SetOsr | SetSlip | AskInfo | AskHealth | AskCrash | Loader | StoreCalibration | EraseCalibration | Keep | SetPrior | SetLocationLimit | StorePad | ErasePad | SetSync
CONTACT, RAW = 0x01, 0x02
TYPES: dict[int, type[Body]] = {
    0x01: Contact,
    0x02: Raw,
    0x03: Info,
    0x04: Health,
    0x05: Acknowledgement,
    0x06: Crash,
    0x07: SyncEdge,
    0x80: SetStreams,
    0x81: Tare,
    0x82: SetRate,
    0x83: SetOsr,
    0x84: SetSlip,
    0x85: AskInfo,
    0x86: AskHealth,
    0x8F: AskCrash,
    0x87: Loader,
    0x88: StoreCalibration,
    0x89: EraseCalibration,
    0x8A: Keep,
    0x8B: SetPrior,
    0x8C: SetLocationLimit,
    0x8D: StorePad,
    0x8E: ErasePad,
    0x90: SetSync,
}
NESTED: dict[str, Any] = {"Calibration": Calibration, "PadProfile": PadProfile}


class Setting(NamedTuple):
    """An argument of Fingertip.set: a field of a command. In a packet it is `per` times as much."""

    argument: str
    command: type[Any]
    field: str
    info: str
    least: float
    most: float
    choices: tuple[int, ...]
    words: tuple[str, ...]
    """What is given for each choice, and for 0 the last; none: the number."""
    per: int
    whole: bool
    give: str
    default: float | None
    of: str
    """The capability whose firmware has it; none: every one."""
    needs: str
    """Another argument, without which this one means nothing."""
    zero: bool
    """It may be 0, and so may what needs it."""


SETTINGS = (
    Setting("rate_Hz", SetRate, "rate_mHz", "rate_mHz", 0.1, 2000, (), (), 1000, True, "0.1 to 2000 Hz, or 0 for as fast as possible", None, "", "", True),
    Setting("osr", SetOsr, "osr", "osr", 256, 8192, (256, 512, 1024, 2048, 4096, 8192), (), 1, True, "one of 256, 512, 1024, 2048, 4096, 8192", None, "", "", False),
    Setting("slip_threshold_mm", SetSlip, "threshold_mm", "slip_threshold_mm", 0.01, 50, (), (), 1, False, "0.01 to 50 mm", None, "slip", "", False),
    Setting("slip_window_ms", SetSlip, "window_ms", "slip_window_ms", 5, 1000, (), (), 1, True, "5 to 1000 ms", None, "slip", "", False),
    Setting("prior_sigma_mm", SetPrior, "sigma_mm", "prior_sigma_mm", 0.5, 100, (), (), 1, False, "0.5 to 100 mm, or 0 for none", None, "fit", "", True),
    Setting("prior_width_mm", SetPrior, "width_mm", "prior_width_mm", 0.01, 100, (), (), 1, False, "0.01 to 100 mm", 0.5, "fit", "prior_sigma_mm", True),
    Setting("location_limit_mm", SetLocationLimit, "limit_mm", "location_limit_mm", 0.01, 100, (), (), 1, False, "0.01 to 100 mm", None, "fit", "", False),
    Setting("sync", SetSync, "mode", "sync", 1, 3, (1, 2, 3), ('in', 'frame', 'second', 'off'), 1, True, "one of in, frame, second, or off", None, "sync", "", True),
)


class Settable:
    """What takes settings."""

    def set(self, *, rate_Hz: float | None = None, osr: int | None = None, slip_threshold_mm: float | None = None,
            slip_window_ms: int | None = None, prior_sigma_mm: float | None = None, prior_width_mm: float | None = None,
            location_limit_mm: float | None = None, sync: str | None = None, keep: bool | None = None) -> Info:
        """Changes what is given, until power-off; keep True: from now on start with all present settings, False: with the firmware's own.

        rate_Hz: 0.1 to 2000, 0 is as fast as the sensors allow.
        osr: the sensors' oversampling, one of 256, 512, 1024, 2048, 4096, 8192.
        slip_threshold_mm: 0.01 to 50.
        slip_window_ms: 5 to 1000.
        prior_sigma_mm: the width to expect of a contact, 0.5 to 100, 0 is none.
        prior_width_mm: its standard deviation, 0.01 to 100, 0.5 if not given.
        location_limit_mm: UNCERTAIN above it, 0.01 to 100.
        sync: the sync pin, one of in, frame, second, or off.
        Raises BadValueError before anything is sent. Returns how it is set now.
        """
        return self._set({"rate_Hz": rate_Hz, "osr": osr, "slip_threshold_mm": slip_threshold_mm, "slip_window_ms": slip_window_ms,
                          "prior_sigma_mm": prior_sigma_mm, "prior_width_mm": prior_width_mm, "location_limit_mm": location_limit_mm, "sync": sync}, keep)

    def _set(self, given: dict[str, float | str | None], keep: bool | None) -> Info:
        raise NotImplementedError


# Columns of recordings, and what their comments have of an info packet.
STAGES = (
    "convert_us", "read_us", "queue_us", "condition_us", "fit_us", "contact_us")
MAPS = (
    "sensors_used", "valid", "saturated", "doubtful")
CONTACT_COLUMNS = (
    "sequence", "flags", "sensors_used", "x_mm", "y_mm", "p0_Pa", "sigma_mm", "force_N", "slip_mm", "residual_rms_Pa", "location_sd_mm",
    "force_sd_N", "sigma_x_mm", "sigma_y_mm", "width_correlation", "convert_us", "read_us", "queue_us", "condition_us", "fit_us", "contact_us",
    "total_us")
TANGENTIAL_COLUMNS = ( # NaN in recordings of before there were any
    "qx_N", "qy_N", "q_sd_N", "tangential_ratio", "vx_mm_s", "vy_mm_s")
SHAPE_COLUMNS = ( # NaN in recordings of before there were any
    "shape_age_ms", "x1_mm", "y1_mm", "location1_sd_mm", "force1_N", "force1_sd_N", "x2_mm", "y2_mm", "location2_sd_mm", "force2_N",
    "force2_sd_N", "edge_angle_deg", "edge_angle_sd_deg", "edge_length_mm")
LATER_COLUMNS = (*TANGENTIAL_COLUMNS, *SHAPE_COLUMNS)
RAW_COLUMNS = (
    "raw_sequence", "raw_flags", "valid", "saturated", "doubtful", "temperature_degC")
INFO_KEYS = (
    "sensors", "capabilities", "rate_mHz", "measured_rate_mHz", "osr", "temperature_interval_ms", "slip_threshold_mm", "slip_window_ms",
    "fit_iterations", "streams", "pitch_mm", "prior_sigma_mm", "prior_width_mm", "location_limit_mm", "sync", "stored")
# Of a calibration, one value for each sensor, and struct's code of it.
SENSOR_LISTS = {"gains": "f", "gain_sds": "f", "off_x_um": "h", "off_y_um": "h", "wider_q15": "h"}


class ContactQuantities:
    """The quantities of a contact packet by their names; NaN without their flag, or without a packet."""

    __slots__ = ()
    contact: Contact

    @property
    def sensors_used(self) -> int:
        """Bitmap of the sensors that entered the fit."""
        return self.contact.sensors_used

    @property
    def x_mm(self) -> float:
        """Location across the strips, from the centre of the pad."""
        return self.contact.x_mm

    @property
    def y_mm(self) -> float:
        """Location along the strips."""
        return self.contact.y_mm

    @property
    def p0_Pa(self) -> float:
        """Peak of the fitted Gaussian."""
        return self.contact.p0_Pa

    @property
    def sigma_mm(self) -> float:
        """Standard deviation of the fitted Gaussian."""
        return self.contact.sigma_mm

    @property
    def force_N(self) -> float:
        """Force scale times 2 pi p0 sigma^2, paper eq. (4), where AT_BOUND with at most the largest reading for p0; positive: pressing."""
        return self.contact.force_N

    @property
    def residual_rms_Pa(self) -> float:
        """Root mean square of the residuals of the fit."""
        return self.contact.residual_rms_Pa

    @property
    def location_sd_mm(self) -> float:
        """Predicted radial standard deviation of the location."""
        return self.contact.location_sd_mm

    @property
    def force_sd_N(self) -> float:
        """Predicted standard deviation of the force, with that of the force scale: 0.8 of the force on a pad that was never calibrated with
        a weight.
        """
        return self.contact.force_sd_N

    @property
    def slip_mm(self) -> float:
        """Slip distance, paper eq. (7): from the mean location over the slip window."""
        return self.contact.slip_mm

    @property
    def sigma_x_mm(self) -> float:
        """Standard deviation of an elliptic Gaussian along x."""
        return self.contact.sigma_x_mm

    @property
    def sigma_y_mm(self) -> float:
        """Standard deviation of that along y."""
        return self.contact.sigma_y_mm

    @property
    def width_correlation(self) -> float:
        """Of that Gaussian, -1 to 1; 0 unless it lies aslant."""
        return self.contact.width_correlation

    @property
    def qx_N(self) -> float:
        """Tangential force of the object on the rubber, along x."""
        return self.contact.qx_N

    @property
    def qy_N(self) -> float:
        """Tangential force along y."""
        return self.contact.qy_N

    @property
    def q_sd_N(self) -> float:
        """Predicted standard deviation of either where force_N is right, with that of the tangential scale."""
        return self.contact.q_sd_N

    @property
    def tangential_ratio(self) -> float:
        """Size of the tangential force over force_N."""
        return self.contact.tangential_ratio

    @property
    def vx_mm_s(self) -> float:
        """Velocity of the contact along x."""
        return self.contact.vx_mm_s

    @property
    def vy_mm_s(self) -> float:
        """Velocity of the contact along y."""
        return self.contact.vy_mm_s

    @property
    def shape_age_ms(self) -> float:
        """Age of the frame that the following values are of."""
        return self.contact.shape_age_ms

    @property
    def x1_mm(self) -> float:
        """Location of the stronger of two contacts, as x_mm."""
        return self.contact.x1_mm

    @property
    def y1_mm(self) -> float:
        """As y_mm."""
        return self.contact.y1_mm

    @property
    def location1_sd_mm(self) -> float:
        """Predicted radial standard deviation of this location."""
        return self.contact.location1_sd_mm

    @property
    def force1_N(self) -> float:
        """Force of the stronger of two contacts."""
        return self.contact.force1_N

    @property
    def force1_sd_N(self) -> float:
        """Its predicted standard deviation, with that of the force scale."""
        return self.contact.force1_sd_N

    @property
    def x2_mm(self) -> float:
        """Location of the weaker of two contacts, as x_mm."""
        return self.contact.x2_mm

    @property
    def y2_mm(self) -> float:
        """As y_mm."""
        return self.contact.y2_mm

    @property
    def location2_sd_mm(self) -> float:
        """Predicted radial standard deviation of this location."""
        return self.contact.location2_sd_mm

    @property
    def force2_N(self) -> float:
        """Force of the weaker of two contacts."""
        return self.contact.force2_N

    @property
    def force2_sd_N(self) -> float:
        """Its predicted standard deviation, with that of the force scale."""
        return self.contact.force2_sd_N

    @property
    def edge_angle_deg(self) -> float:
        """Direction of a long contact, from x towards y, -90 to 90."""
        return self.contact.edge_angle_deg

    @property
    def edge_angle_sd_deg(self) -> float:
        """Its predicted standard deviation."""
        return self.contact.edge_angle_sd_deg

    @property
    def edge_length_mm(self) -> float:
        """Length of the line that presses evenly."""
        return self.contact.edge_length_mm


class BlockQuantities:
    """The quantities of both packets by their names, an array each."""

    convert_us: "npt.NDArray[np.int64]"
    read_us: "npt.NDArray[np.int64]"
    queue_us: "npt.NDArray[np.int64]"
    condition_us: "npt.NDArray[np.int64]"
    fit_us: "npt.NDArray[np.int64]"
    contact_us: "npt.NDArray[np.int64]"
    total_us: "npt.NDArray[np.int64]"
    sensors_used: "npt.NDArray[np.int64]"
    x_mm: "npt.NDArray[np.float64]"
    y_mm: "npt.NDArray[np.float64]"
    p0_Pa: "npt.NDArray[np.float64]"
    sigma_mm: "npt.NDArray[np.float64]"
    force_N: "npt.NDArray[np.float64]"
    residual_rms_Pa: "npt.NDArray[np.float64]"
    location_sd_mm: "npt.NDArray[np.float64]"
    force_sd_N: "npt.NDArray[np.float64]"
    slip_mm: "npt.NDArray[np.float64]"
    sigma_x_mm: "npt.NDArray[np.float64]"
    sigma_y_mm: "npt.NDArray[np.float64]"
    width_correlation: "npt.NDArray[np.float64]"
    qx_N: "npt.NDArray[np.float64]"
    qy_N: "npt.NDArray[np.float64]"
    q_sd_N: "npt.NDArray[np.float64]"
    tangential_ratio: "npt.NDArray[np.float64]"
    vx_mm_s: "npt.NDArray[np.float64]"
    vy_mm_s: "npt.NDArray[np.float64]"
    shape_age_ms: "npt.NDArray[np.float64]"
    x1_mm: "npt.NDArray[np.float64]"
    y1_mm: "npt.NDArray[np.float64]"
    location1_sd_mm: "npt.NDArray[np.float64]"
    force1_N: "npt.NDArray[np.float64]"
    force1_sd_N: "npt.NDArray[np.float64]"
    x2_mm: "npt.NDArray[np.float64]"
    y2_mm: "npt.NDArray[np.float64]"
    location2_sd_mm: "npt.NDArray[np.float64]"
    force2_N: "npt.NDArray[np.float64]"
    force2_sd_N: "npt.NDArray[np.float64]"
    edge_angle_deg: "npt.NDArray[np.float64]"
    edge_angle_sd_deg: "npt.NDArray[np.float64]"
    edge_length_mm: "npt.NDArray[np.float64]"
    valid: "npt.NDArray[np.int64]"
    saturated: "npt.NDArray[np.int64]"
    doubtful: "npt.NDArray[np.int64]"
