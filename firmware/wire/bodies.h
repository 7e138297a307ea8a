/* written by firmware/wire/line.py from line.toml; change it there.
 *
 * The bodies of packets and commands; PROTOCOL.md is the specification. Included by packet.h alone.
 */
#pragma once

#include "common/calibration.h"
#include "common/crash.h"
#include "common/limits.h"
#include "common/pad_profile.h"

#include <stdint.h>

#define WIRE_VERSION 9

/* Of a packet of more sensors, or whose maps have one beyond these: they are of 64 bits there, and this is added to its version. */
enum { WIRE_SENSORS_OF_WORD = 32, WIRE_WIDE = 128 };

enum { WIRE_TEXT_BYTES = 16, WIRE_MAX_BODY_BYTES = FT_MAX_SENSORS > 32 ? 1105 : 1017 };

enum wire_type {
  /* device to host */
  WIRE_CONTACT = 0x01,
  WIRE_RAW = 0x02,
  WIRE_INFO = 0x03,
  WIRE_HEALTH = 0x04,
  WIRE_ACK = 0x05,
  WIRE_CRASH = 0x06,
  WIRE_SYNC = 0x07,
  /* host to device */
  WIRE_CMD_STREAM = 0x80,
  WIRE_CMD_TARE = 0x81,
  WIRE_CMD_RATE = 0x82,
  WIRE_CMD_OSR = 0x83,
  WIRE_CMD_SLIP = 0x84,
  WIRE_CMD_INFO = 0x85,
  WIRE_CMD_HEALTH = 0x86,
  WIRE_CMD_CRASH = 0x8F,
  WIRE_CMD_LOADER = 0x87,
  WIRE_CMD_CALIBRATE = 0x88,
  WIRE_CMD_ERASE_CALIBRATION = 0x89,
  WIRE_CMD_KEEP = 0x8A,
  WIRE_CMD_PRIOR = 0x8B,
  WIRE_CMD_LOCATION_LIMIT = 0x8C,
  WIRE_CMD_PAD = 0x8D,
  WIRE_CMD_ERASE_PAD = 0x8E,
  WIRE_CMD_SYNC = 0x90,
};

/* Bits of the stream mask. */
enum wire_stream {
  WIRE_STREAM_CONTACT = 1 << 0, /* contact packets */
  WIRE_STREAM_RAW = 1 << 1, /* raw packets */
  WIRE_STREAM_HEALTH = 1 << 2, /* health packets, once a second */
  WIRE_STREAM_ALL = WIRE_STREAM_CONTACT | WIRE_STREAM_RAW | WIRE_STREAM_HEALTH,
};

/* What a build can do: cmake/options.cmake. */
enum wire_capability {
  WIRE_CAPABILITY_FIT = 1 << 0, /* contact packets: location and force; and calibrations */
  WIRE_CAPABILITY_SLIP = 1 << 1, /* slip, and the command that sets it */
  WIRE_CAPABILITY_RAW_STREAM = 1 << 2, /* raw packets */
  WIRE_CAPABILITY_TANGENTIAL = 1 << 3, /* tangential force, where the pad's profile is stored */
  WIRE_CAPABILITY_SYNC = 1 << 4, /* sync packets, and the command that sets the sync pin */
  /* the second processor runs, now; without it the first does its work, with the same results at
   * fewer frames a second */
  WIRE_CAPABILITY_SECOND = 1 << 5,
};

/* The result code of an acknowledgement. */
enum wire_result {
  WIRE_RESULT_DONE = 0, /* the command was carried out */
  WIRE_RESULT_UNKNOWN_COMMAND = 1, /* the firmware does not know this command */
  WIRE_RESULT_OUT_OF_RANGE = 2, /* a value is out of range for this firmware */
  /* not now: a tare while no sensor answers, or in contact and not forced; a command that stores
   * while another is being written, or if the flash fails */
  WIRE_RESULT_NOT_NOW = 3,
};

/* Bits of the word that reports what the fingertip keeps without power. */
enum wire_stored {
  /* a calibration, and it is applied; never without capability fit */
  WIRE_STORED_CALIBRATION = 1 << 0,
  WIRE_STORED_SETTINGS = 1 << 1, /* settings; it started with them */
  WIRE_STORED_WRITING = 1 << 2, /* a change is on its way into the flash */
  /* the content is damaged, or of a later firmware, and not used; storing again repairs it */
  WIRE_STORED_DAMAGED = 1 << 3,
  /* a pad's profile, and it is applied; never without capability tangential */
  WIRE_STORED_PAD = 1 << 4,
};

/* Ranges of the settings that commands carry; the device answers OUT_OF_RANGE beyond them. */
/* frame rate; 0 means as fast as the sensors allow */
#define WIRE_RATE_MIN_mHz 100u
#define WIRE_RATE_MAX_mHz 2000000u
/* oversampling ratio of the sensors */
#define WIRE_OSR_MIN 256u /* and its doubles */
#define WIRE_OSR_MAX 8192u
/* slip distance above which SLIP is set */
#define WIRE_SLIP_THRESHOLD_MIN_mm 0.01f
#define WIRE_SLIP_THRESHOLD_MAX_mm 50.0f
/* time over which the slip distance is taken */
#define WIRE_SLIP_WINDOW_MIN_ms 5u
#define WIRE_SLIP_WINDOW_MAX_ms 1000u
/* width to expect of a contact */
#define WIRE_PRIOR_SIGMA_MIN_mm 0.5f
#define WIRE_PRIOR_SIGMA_MAX_mm 100.0f
/* standard deviation of that; 0: none is set */
#define WIRE_PRIOR_WIDTH_MIN_mm 0.01f
#define WIRE_PRIOR_WIDTH_MAX_mm 100.0f
#define WIRE_PRIOR_WIDTH_DEFAULT_mm 0.5f
/* location_sd_mm above which UNCERTAIN is set */
#define WIRE_LOCATION_LIMIT_MIN_mm 0.01f
#define WIRE_LOCATION_LIMIT_MAX_mm 100.0f
/* sync pin; 0: off */
#define WIRE_SYNC_MIN 1u /* and its doubles */
#define WIRE_SYNC_MAX 3u
#define WIRE_LOADER_MAGIC 0x746F6F42u /* "Boot" */

/* Where the time of one frame went, us. The stages follow one another without a gap. Values
 * above 65535 saturate. */
struct wire_stages {
  uint16_t convert_us; /* broadcast of the conversion command, and the sensors' conversion */
  uint16_t read_us; /* reading every sensor */
  uint16_t queue_us; /* the complete frame waits for the processor */
  uint16_t condition_us; /* compensation, tare, gate */
  uint16_t fit_us; /* the fit */
  uint16_t contact_us; /* slip, and the flags of the result */
  /* the sum of the six stages: from the first bus activity of the frame to the encoding of this
   * packet */
  uint16_t total_us;
};

/* One judged frame. The header's time is the middle of the sensors' conversion. A quantity
 * travels only under its VALID flag. Without it the encoder leaves it out and the decoder gives
 * 0 (NaN in Python and in messages). */
struct wire_contact {
  uint32_t frame; /* counts every frame since start, fitted or not */
  uint32_t flags; /* flags of the frame, see below */
  struct wire_stages stages;
  /* FIT_VALID */
  sensor_map sensors_used; /* bitmap of the sensors that entered the fit */
  float x_mm; /* location across the strips, from the centre of the pad */
  float y_mm; /* location along the strips */
  float p0_Pa; /* peak of the fitted Gaussian */
  float sigma_mm; /* standard deviation of the fitted Gaussian */
  /* force scale times 2 pi p0 sigma^2, paper eq. (4), where AT_BOUND with at most the largest
   * reading for p0; positive: pressing */
  float force_N;
  float residual_rms_Pa; /* root mean square of the residuals of the fit */
  /* UNCERTAINTY_VALID */
  float location_sd_mm; /* predicted radial standard deviation of the location */
  /* predicted standard deviation of the force, with that of the force scale: 0.8 of the force on
   * a pad that was never calibrated with a weight */
  float force_sd_N;
  /* SLIP_VALID */
  float slip_mm; /* slip distance, paper eq. (7): from the mean location over the slip window */
  /* WIDTHS_VALID */
  float sigma_x_mm; /* standard deviation of an elliptic Gaussian along x */
  float sigma_y_mm; /* standard deviation of that along y */
  float width_correlation; /* of that Gaussian, -1 to 1; 0 unless it lies aslant */
  /* TANGENTIAL_VALID */
  float qx_N; /* tangential force of the object on the rubber, along x */
  float qy_N; /* tangential force along y */
  /* predicted standard deviation of either where force_N is right, with that of the tangential
   * scale */
  float q_sd_N;
  float tangential_ratio; /* size of the tangential force over force_N */
  /* VELOCITY_VALID */
  float vx_mm_s; /* velocity of the contact along x */
  float vy_mm_s; /* velocity of the contact along y */
  /* SHAPE_VALID */
  float shape_age_ms; /* age of the frame that the following values are of */
  /* TWO_CONTACTS */
  float x1_mm; /* location of the stronger of two contacts, as x_mm */
  float y1_mm; /* as y_mm */
  float location1_sd_mm; /* predicted radial standard deviation of this location */
  float force1_N; /* force of the stronger of two contacts */
  float force1_sd_N; /* its predicted standard deviation, with that of the force scale */
  float x2_mm; /* location of the weaker of two contacts, as x_mm */
  float y2_mm; /* as y_mm */
  float location2_sd_mm; /* predicted radial standard deviation of this location */
  float force2_N; /* force of the weaker of two contacts */
  float force2_sd_N; /* its predicted standard deviation, with that of the force scale */
  /* EDGE */
  float edge_angle_deg; /* direction of a long contact, from x towards y, -90 to 90 */
  float edge_angle_sd_deg; /* its predicted standard deviation */
  float edge_length_mm; /* length of the line that presses evenly */
};

/* The readings of one frame, without the gains of a calibration. The header's time is that of
 * the contact packet of the same frame number. */
struct wire_raw {
  uint32_t frame; /* the same number as in the contact packet of this frame */
  /* as in the contact packet; firmware without capability fit sets only CONTACT, TARED, HELD,
   * SATURATED, SENSOR_MASKED, ZERO_DOUBTFUL and SENSOR_DOUBTFUL */
  uint32_t flags;
  /* bitmap: the reading is a measurement; 0 in a held frame, whose readings are those of the
   * frame before */
  sensor_map valid;
  /* bitmap: the reading is above 1980 mbar, where the sensor's range ends, and does not enter
   * the fit */
  sensor_map saturated;
  sensor_map doubtful; /* bitmap: a measurement with a reason to doubt it; 0 in a held frame */
  int16_t temperature_cC; /* mean of the sensors, 0.01 degC; 0 until measured */
  uint8_t sensor_count; /* number of sensors, 1 to 36 */
  /* of each sensor: absolute pressure, and the zero, of which the fit subtracts what has not
   * faded in this contact; both in 1/1024 Pa */
  int32_t pressure_Pa_q10[FT_MAX_SENSORS];
  int32_t baseline_Pa_q10[FT_MAX_SENSORS];
};

/* Identity, settings and stored data of a fingertip. Without its capability a field is 0 (None
 * or NaN in Python). */
struct wire_info {
  uint8_t firmware_version[3]; /* major, minor, patch */
  uint8_t sensor_count; /* number of sensors, 1 to 36 */
  uint32_t capabilities; /* what the firmware can do, see below */
  char git_hash[WIRE_TEXT_BYTES]; /* commit of the firmware; a final + means uncommitted changes */
  char board[WIRE_TEXT_BYTES]; /* name of the board */
  char scene[WIRE_TEXT_BYTES]; /* name of the scene */
  char serial[WIRE_TEXT_BYTES]; /* 16 hexadecimal digits, the flash chip's unique id */
  uint32_t rate_mHz; /* requested frame rate; 0: as fast as the sensors allow */
  uint32_t measured_rate_mHz; /* frame rate over the last second; 0 before */
  uint16_t osr; /* oversampling ratio, 256 to 8192 */
  /* time between temperature conversions while the temperature changes; up to four times as long
   * while it is constant */
  uint16_t temperature_interval_ms;
  uint8_t streams; /* streams that are on */
  /* with WIRE_CAPABILITY_FIT, else 0 */
  uint8_t fit_iterations; /* iterations of the fit */
  /* with WIRE_CAPABILITY_SLIP, else 0 */
  uint16_t slip_window_ms; /* slip window */
  float slip_threshold_mm; /* slip threshold */
  /* always */
  float pitch_mm; /* of a rectangular layout; 0 for a free one */
  float x_mm[FT_MAX_SENSORS]; /* of each sensor: x and y, from the centre of the pad */
  float y_mm[FT_MAX_SENSORS];
  /* with WIRE_CAPABILITY_FIT, else 0 */
  float prior_sigma_mm; /* prior on sigma that is set */
  /* its standard deviation; 0: none is set, and the sigma of a calibration is applied */
  float prior_width_mm;
  float location_limit_mm; /* UNCERTAIN is set where location_sd_mm is above it */
  /* with WIRE_CAPABILITY_SYNC, else 0 */
  uint8_t sync; /* sync pin: 0 off, 1 in, 2 frame, 3 second */
  /* always */
  uint32_t stored; /* what the fingertip keeps without power, see below */
  /* with WIRE_STORED_CALIBRATION, else 0 */
  struct calibration calibration; /* the calibration, below */
  /* with WIRE_STORED_PAD, else 0 */
  struct pad_profile pad; /* the pad's profile, below */
};

/* Counters since start, modulo 2^32, and present state. */
struct wire_health {
  uint32_t capabilities; /* as in info */
  uint32_t uptime_s; /* since start */
  uint32_t frames; /* frames that were read from the array */
  uint32_t frames_incomplete; /* of these, with at least one sensor missing */
  uint32_t frames_skipped; /* of these, never fitted: the processor was behind */
  uint32_t packets_sent; /* handed to the USB queue */
  /* the queue was full: whole packets, and each leaves a gap in the sequence */
  uint32_t packets_dropped;
  uint32_t commands_done; /* commands carried out */
  /* commands that were unknown, out of range, damaged, or not possible at that time */
  uint32_t commands_rejected;
  uint32_t bus_nacks; /* reads that a sensor did not acknowledge, or that broke off */
  uint32_t bus_timeouts; /* operations on the bus that did not end in time */
  uint32_t bus_recoveries; /* nine clocks, and resets of multiplexers */
  /* conversions that had not finished, and those that are void after one of these or after a
   * missed reading */
  uint32_t zero_readings;
  /* readings left out: below zero, or a step that no other sensor shared */
  uint32_t implausible_readings;
  sensor_map sensors_present; /* bitmap: the sensor answered at the last attempt */
  /* bitmap: the PROM's CRC is wrong, and the sensor still streams; or the PROM is blank, and it
   * does not */
  sensor_map sensors_prom_bad;
  /* since power-on. Faults and panics end in one too. The command crash asks for the last */
  uint32_t watchdog_resets;
  uint16_t cpu_busy_permille; /* main loop without interrupts, over the last second */
  uint16_t stack_free_bytes; /* never touched since start */
  /* with WIRE_CAPABILITY_FIT, else 0 */
  uint32_t fit_failures; /* frames in contact whose fit could not be solved */
};

/* The answer to a command. */
struct wire_ack {
  uint8_t command; /* type of the command */
  uint8_t result; /* result, see below */
  uint16_t sequence; /* the command's own */
  uint64_t host_time_us; /* time in the command's header, so that the host can relate the clocks */
};

/* An edge at the sync pin. The header's time is that of the edge. */
struct wire_sync {
  /* counts the edges since the pin was set, from 1, modulo 2^32; a gap is edges that came too
   * fast. An odd one rises */
  uint32_t number;
  uint8_t level; /* of the pin after it: 1 high, 0 low */
};

/* Set the streams to send; 0 stops. A stream that the firmware's capabilities lack is out of
 * range. Nothing streams until this command, so that a terminal that echoes cannot start it by
 * accident. */
struct wire_cmd_stream {
  uint8_t streams; /* bits of the streams */
};

/* Measure the zero over the next 16 frames (at rates below 16 Hz those of a second, three at
 * least). The device reports no contact meanwhile. In contact, and while no sensor answers, it
 * refuses with "not now", since the press would become the zero. The zero follows slow drift
 * only while nothing touches the pad. So send this between grasps, as the paper does. */
struct wire_cmd_tare {
  uint8_t force; /* 1: tare even in contact, if that contact is known to be none; 0 */
};

/* Set the frame rate; 0: as fast as the sensors allow. */
struct wire_cmd_rate {
  uint32_t rate_mHz; /* frame rate, or 0 */
};

/* Set the oversampling. */
struct wire_cmd_osr {
  uint16_t osr; /* oversampling ratio */
};

/* Set the slip metric. The device keeps 160 frames of the window: 122 ms at 1307 frames/s, 390
 * ms at 410. */
struct wire_cmd_slip {
  float threshold_mm; /* slip threshold */
  uint16_t window_ms; /* slip window */
};

/* Acknowledge, then reboot to the boot ROM's USB loader. Opening the port at 1200 baud does the
 * same. */
struct wire_cmd_loader {
  uint32_t magic; /* 0x746F6F42, so that a stray byte never reboots a fingertip */
};

/* Store a calibration. Gains 0.25 to 4, their standard deviations 0 to 0.5, sensors up to 2000
 * um from their places and wider or narrower by up to 9830/32768, scale 0.1 to 10, its standard
 * deviation 0 to 1. It is applied from the first frame after the acknowledgement. */
struct wire_cmd_calibrate {
  uint8_t sensor_count; /* that of the fingertip */
  struct calibration calibration; /* as in info */
};

/* Keep settings without power. */
struct wire_cmd_keep {
  /* 1: from now on start with the present rate, OSR, slip settings, prior, limit and sync pin;
   * 0: with the firmware's own again */
  uint8_t keep;
};

/* Set the width to expect of a contact, and its standard deviation; 0 and 0: none, and the sigma
 * of a calibration is applied. */
struct wire_cmd_prior {
  float sigma_mm; /* width */
  float width_mm; /* its standard deviation */
};

/* Set the limit of location_sd_mm above which UNCERTAIN is set. */
struct wire_cmd_location_limit {
  float limit_mm; /* limit */
};

/* Store a pad's profile, each value in its range and the terms in order of width. It is applied
 * from the first frame after the acknowledgement. */
struct wire_cmd_pad {
  struct pad_profile profile; /* as in info */
};

/* Set the sync pin, as in packet sync; 0: off. */
struct wire_cmd_sync {
  uint8_t mode; /* 1 in, 2 frame, 3 second */
};

union wire_body {
  struct wire_contact contact;
  struct wire_raw raw;
  struct wire_info info;
  struct wire_health health;
  struct wire_ack ack;
  struct crash_record crash;
  struct wire_sync sync;
  struct wire_cmd_stream cmd_stream;
  struct wire_cmd_tare cmd_tare;
  struct wire_cmd_rate cmd_rate;
  struct wire_cmd_osr cmd_osr;
  struct wire_cmd_slip cmd_slip;
  struct wire_cmd_loader cmd_loader;
  struct wire_cmd_calibrate cmd_calibrate;
  struct wire_cmd_keep cmd_keep;
  struct wire_cmd_prior cmd_prior;
  struct wire_cmd_location_limit cmd_location_limit;
  struct wire_cmd_pad cmd_pad;
  struct wire_cmd_sync cmd_sync;
};

/* The layout of one body. */
struct wire_layout;
extern const struct wire_layout wire_contact_layout;
extern const struct wire_layout wire_raw_layout;
extern const struct wire_layout wire_info_layout;
extern const struct wire_layout wire_health_layout;
extern const struct wire_layout wire_ack_layout;
extern const struct wire_layout wire_crash_layout;
extern const struct wire_layout wire_sync_layout;
extern const struct wire_layout cmd_stream_layout;
extern const struct wire_layout cmd_tare_layout;
extern const struct wire_layout cmd_rate_layout;
extern const struct wire_layout cmd_osr_layout;
extern const struct wire_layout cmd_slip_layout;
extern const struct wire_layout cmd_info_layout;
extern const struct wire_layout cmd_health_layout;
extern const struct wire_layout cmd_crash_layout;
extern const struct wire_layout cmd_loader_layout;
extern const struct wire_layout cmd_calibrate_layout;
extern const struct wire_layout cmd_erase_calibration_layout;
extern const struct wire_layout cmd_keep_layout;
extern const struct wire_layout cmd_prior_layout;
extern const struct wire_layout cmd_location_limit_layout;
extern const struct wire_layout cmd_pad_layout;
extern const struct wire_layout cmd_erase_pad_layout;
extern const struct wire_layout cmd_sync_layout;

/* The commands that every fingertip knows, and those of its capabilities, for its set. */
#define WIRE_COMMANDS \
  &cmd_stream_layout, \
  &cmd_tare_layout, \
  &cmd_rate_layout, \
  &cmd_osr_layout, \
  &cmd_info_layout, \
  &cmd_health_layout, \
  &cmd_loader_layout, \
  &cmd_keep_layout, \
  &cmd_crash_layout
#define WIRE_COMMANDS_OF_SLIP \
  &cmd_slip_layout
#define WIRE_COMMANDS_OF_FIT \
  &cmd_calibrate_layout, \
  &cmd_erase_calibration_layout, \
  &cmd_prior_layout, \
  &cmd_location_limit_layout
#define WIRE_COMMANDS_OF_TANGENTIAL \
  &cmd_pad_layout, \
  &cmd_erase_pad_layout
#define WIRE_COMMANDS_OF_SYNC \
  &cmd_sync_layout
