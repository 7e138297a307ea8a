/* The packets of the wire protocol, and their only encoder and decoder.
 *
 * PROTOCOL.md is the specification. Firmware and host use this same code. A frame on the line is
 *   COBS(header 12 bytes, body, CRC-32/ISO-HDLC of header and body) 0x00
 * and nothing on the line depends on the byte order, the alignment or the structure padding of the
 * machine. Floats are IEEE 754 binary32 and always finite: the encoder refuses others and the
 * decoder rejects them.
 *
 * Each body is described by one constant, its layout, for both directions. Whoever encodes or
 * decodes names the layouts, so an image holds those of its own packets and commands only.
 */
#ifndef WIRE_PACKET_H
#define WIRE_PACKET_H

#include "common/calibration.h"
#include "common/crash.h"
#include "common/limits.h"
#include "common/pad_profile.h"
#include "common/status.h"

#include <stddef.h>
#include <stdint.h>

#define WIRE_VERSION 5

enum {
  WIRE_HEADER_BYTES = 12,
  WIRE_CRC_BYTES = 4,
  WIRE_PAD_BYTES = 4 * PAD_PROFILE_FLOATS + 1,
  /* Info of a calibrated fingertip that knows its pad. */
  WIRE_MAX_BODY_BYTES = 126 + 16 * FT_MAX_SENSORS + WIRE_PAD_BYTES,
  WIRE_MAX_PACKET_BYTES = WIRE_HEADER_BYTES + WIRE_MAX_BODY_BYTES + WIRE_CRC_BYTES,
  /* COBS adds one byte, and one more for each full 254 bytes; then the delimiter. */
  WIRE_MAX_FRAME_BYTES = WIRE_MAX_PACKET_BYTES + WIRE_MAX_PACKET_BYTES / 254 + 2,
};

enum wire_type {
  /* device to host */
  WIRE_CONTACT = 0x01,
  WIRE_RAW = 0x02,
  WIRE_INFO = 0x03,
  WIRE_HEALTH = 0x04,
  WIRE_ACK = 0x05,
  WIRE_CRASH = 0x06,
  /* host to device */
  WIRE_CMD_STREAM = 0x80,
  WIRE_CMD_TARE = 0x81,
  WIRE_CMD_RATE = 0x82,
  WIRE_CMD_OSR = 0x83,
  WIRE_CMD_SLIP = 0x84,
  WIRE_CMD_INFO = 0x85,
  WIRE_CMD_HEALTH = 0x86,
  WIRE_CMD_LOADER = 0x87,
  WIRE_CMD_CALIBRATE = 0x88,
  WIRE_CMD_ERASE_CALIBRATION = 0x89,
  WIRE_CMD_KEEP = 0x8A,
  WIRE_CMD_PRIOR = 0x8B,
  WIRE_CMD_LOCATION_LIMIT = 0x8C,
  WIRE_CMD_PAD = 0x8D,
  WIRE_CMD_ERASE_PAD = 0x8E,
  WIRE_CMD_CRASH = 0x8F,
};

/* Bits of the stream mask. */
enum wire_stream {
  WIRE_STREAM_CONTACT = 1 << 0,
  WIRE_STREAM_RAW = 1 << 1,
  WIRE_STREAM_HEALTH = 1 << 2, /* once a second */
  WIRE_STREAM_ALL = WIRE_STREAM_CONTACT | WIRE_STREAM_RAW | WIRE_STREAM_HEALTH,
};

/* What a build can do: cmake/options.cmake. */
enum wire_capability {
  WIRE_CAPABILITY_FIT = 1 << 0,        /* contact packets: location and force; and calibrations */
  WIRE_CAPABILITY_SLIP = 1 << 1,       /* and slip, and the command that sets it */
  WIRE_CAPABILITY_RAW_STREAM = 1 << 2, /* raw packets */
  WIRE_CAPABILITY_TANGENTIAL = 1 << 3, /* tangential load, where the pad's profile is stored */
};

/* The result code of an ACK. */
enum wire_result {
  WIRE_RESULT_DONE = 0,
  WIRE_RESULT_UNKNOWN_COMMAND = 1,
  WIRE_RESULT_OUT_OF_RANGE = 2,
  WIRE_RESULT_NOT_NOW =
      3, /* tare while no sensor answers, or in contact and not forced; a change of
            what is stored while one is being written, or where the flash fails */
};

/* Bits of the word that says what the fingertip keeps without power. */
enum wire_stored {
  WIRE_STORED_CALIBRATION = 1 << 0, /* it acts */
  WIRE_STORED_SETTINGS = 1 << 1,    /* it started with those of a keep command */
  WIRE_STORED_WRITING = 1 << 2,     /* a change is on its way into the flash */
  WIRE_STORED_DAMAGED = 1 << 3, /* what is there cannot be read, or is of a later firmware: it is
                                   not used */
  WIRE_STORED_PAD = 1 << 4,     /* the pad's profile; it acts */
};

/* Ranges of the settings that commands carry; the device answers OUT_OF_RANGE beyond them. */
#define WIRE_RATE_MAX_mHz 2000000u /* 0 means as fast as the sensors allow */
#define WIRE_RATE_MIN_mHz 100u
#define WIRE_SLIP_THRESHOLD_MIN_mm 0.01f
#define WIRE_SLIP_THRESHOLD_MAX_mm 50.0f
#define WIRE_SLIP_WINDOW_MIN_ms 5u
#define WIRE_SLIP_WINDOW_MAX_ms 1000u
#define WIRE_PRIOR_SIGMA_MIN_mm 0.5f /* of a prior; with a width of 0 there is none */
#define WIRE_PRIOR_SIGMA_MAX_mm 100.0f
#define WIRE_PRIOR_WIDTH_MIN_mm 0.01f
#define WIRE_PRIOR_WIDTH_MAX_mm 100.0f
#define WIRE_LOCATION_LIMIT_MIN_mm 0.01f
#define WIRE_LOCATION_LIMIT_MAX_mm 100.0f
#define WIRE_LOADER_MAGIC 0x746F6F42u /* "Boot": a stray byte never reboots a fingertip */

/* Where the time of one frame went, us. The stages follow one another without a gap: their sum is
 * total_us, from the first bus activity of the frame to the encoding of its packet. Values above
 * 65535 saturate.
 */
struct wire_stages {
  uint16_t convert_us;   /* broadcast of the conversion command and the sensors' conversion */
  uint16_t read_us;      /* reading every sensor */
  uint16_t queue_us;     /* complete frame waiting for the processor */
  uint16_t condition_us; /* compensation, tare, gate */
  uint16_t fit_us;
  uint16_t contact_us; /* slip and the judgement of the result */
  uint16_t total_us;
};

/* One judged frame. header.t_us is the middle of the sensors' conversion. A quantity travels only
 * under its VALID flag; without it the encoder leaves it out and the decoder gives 0. */
struct wire_contact {
  uint32_t frame; /* counts every frame since start, fitted or not */
  uint32_t flags; /* enum contact_flag */
  struct wire_stages stages;
  /* FIT_VALID */
  uint32_t sensors_used; /* bitmap of the sensors that entered the fit */
  float x_mm, y_mm;      /* contact location, origin in the centre of the pad */
  float p0_Pa;           /* peak of the fitted Gaussian */
  float sigma_mm;        /* its standard deviation */
  float force_N;         /* force scale times 2 pi p0 sigma^2, paper eq. (4) */
  float residual_rms_Pa; /* root mean square of the fit residuals */
  /* UNCERTAINTY_VALID */
  float location_sd_mm; /* predicted radial standard deviation of the location */
  float force_sd_N;     /* predicted standard deviation of the force */
  /* SLIP_VALID */
  float slip_mm; /* slip distance, paper eq. (7) */
  /* WIDTHS_VALID: of an elliptic Gaussian */
  float sigma_x_mm, sigma_y_mm; /* standard deviations along the axes */
  float width_correlation;      /* -1..1; 0 unless it lies aslant */
  /* TANGENTIAL_VALID: location, force and their standard deviations are corrected for it */
  float qx_N, qy_N;       /* tangential load on the rubber, along x and y */
  float q_sd_N;           /* predicted standard deviation of either */
  float tangential_ratio; /* its size over the force */
  /* VELOCITY_VALID */
  float vx_mm_s, vy_mm_s; /* of the contact */
};

/* The readings of one frame. header.t_us as in the contact packet of the same frame number. */
struct wire_raw {
  uint32_t frame;
  uint32_t flags;         /* enum contact_flag; those of a fit or a slip only with the fit */
  uint32_t valid;         /* bitmap: the reading is a measurement; 0 in a held frame, whose readings
                             are those of the frame before */
  uint32_t saturated;     /* bitmap: above 1980 mbar, where the sensor's range ends */
  uint32_t doubtful;      /* bitmap: a measurement, but there is reason to doubt it */
  int16_t temperature_cC; /* mean of the sensors, 0.01 degC; 0 until first measured */
  uint8_t sensor_count;   /* 1..FT_MAX_SENSORS */
  int32_t pressure_Pa_q10[FT_MAX_SENSORS]; /* absolute, 1/1024 Pa */
  int32_t baseline_Pa_q10[FT_MAX_SENSORS]; /* the tare that is subtracted before the fit */
};

enum { WIRE_TEXT_BYTES = 16 };

struct wire_info {
  uint8_t firmware_version[3];    /* major, minor, patch */
  uint8_t sensor_count;           /* 1..FT_MAX_SENSORS */
  uint32_t capabilities;          /* enum wire_capability */
  char git_hash[WIRE_TEXT_BYTES]; /* printable ASCII, zero-padded; '+' at its end: uncommitted
                                     changes */
  char board[WIRE_TEXT_BYTES];    /* same form */
  char scene[WIRE_TEXT_BYTES];    /* same form */
  char serial[WIRE_TEXT_BYTES];   /* sixteen hexadecimal digits: the flash chip's unique id */
  uint32_t rate_mHz;              /* requested frame rate, 0 = as fast as the sensors allow */
  uint32_t measured_rate_mHz;     /* over the last second; 0 before */
  uint16_t osr;                   /* 256..8192 */
  uint16_t temperature_interval_ms;
  uint8_t streams;                                  /* enum wire_stream */
  uint8_t fit_iterations;                           /* with WIRE_CAPABILITY_FIT, else 0 */
  uint16_t slip_window_ms;                          /* with WIRE_CAPABILITY_SLIP, else 0 */
  float slip_threshold_mm;                          /* likewise */
  float pitch_mm;                                   /* of a rectangular layout; 0 for a free one */
  float x_mm[FT_MAX_SENSORS], y_mm[FT_MAX_SENSORS]; /* sensor positions */
  /* With WIRE_CAPABILITY_FIT, else 0 */
  float prior_sigma_mm, prior_width_mm; /* on sigma; width 0: none */
  float location_limit_mm;              /* UNCERTAIN where location_sd_mm is above it */
  uint32_t stored;                      /* enum wire_stored */
  struct calibration calibration;       /* with WIRE_STORED_CALIBRATION, else 0 */
  struct pad_profile pad;               /* with WIRE_STORED_PAD, else 0 */
};

/* Counters since start, modulo 2^32, and present state. */
struct wire_health {
  uint32_t capabilities; /* enum wire_capability */
  uint32_t uptime_s;
  uint32_t frames;            /* read from the array */
  uint32_t frames_incomplete; /* of these, with at least one sensor missing */
  uint32_t frames_skipped;    /* of these, never fitted: the processor was behind */
  uint32_t packets_sent;      /* handed to the USB queue */
  uint32_t packets_dropped;   /* queue full: whole packets, each leaving a gap in the sequence */
  uint32_t commands_done;
  uint32_t commands_rejected;    /* unknown, out of range, damaged */
  uint32_t bus_nacks;            /* reads that a sensor did not acknowledge, or that broke off */
  uint32_t bus_timeouts;         /* operations that did not end in time */
  uint32_t bus_recoveries;       /* nine clocks and multiplexer resets */
  uint32_t zero_readings;        /* a conversion result of 0, and those void after one or a NACK */
  uint32_t implausible_readings; /* left out: below zero, or a step that no other sensor shared */
  uint32_t sensors_present;      /* bitmap: answered at the last attempt */
  uint32_t sensors_prom_bad;  /* bitmap: calibration CRC differs, streaming all the same; or blank,
                                 and not */
  uint32_t watchdog_resets;   /* since power-on; faults and panics end in one too */
  uint16_t cpu_busy_permille; /* over the last second */
  uint16_t stack_free_bytes;  /* never touched since start */
  uint32_t fit_failures;      /* frames in contact whose fit could not be solved; with
                                 WIRE_CAPABILITY_FIT, else 0 */
};

struct wire_ack {
  uint8_t command;       /* enum wire_type of the command */
  uint8_t result;        /* enum wire_result */
  uint16_t sequence;     /* the command's own */
  uint64_t host_time_us; /* the command's header.t_us, so that the host can relate the clocks */
};

struct wire_cmd_stream {
  uint8_t streams; /* enum wire_stream; 0 stops */
};
struct wire_cmd_rate {
  uint32_t rate_mHz; /* 0, or WIRE_RATE_MIN_mHz..WIRE_RATE_MAX_mHz */
};
struct wire_cmd_osr {
  uint16_t osr; /* 256, 512, 1024, 2048, 4096, 8192 */
};
struct wire_cmd_slip {
  float threshold_mm;
  uint16_t window_ms;
};
struct wire_cmd_loader {
  uint32_t magic; /* WIRE_LOADER_MAGIC */
};
struct wire_cmd_calibrate {
  uint8_t sensor_count; /* that of the fingertip */
  struct calibration calibration;
};
struct wire_cmd_tare {
  uint8_t force; /* 1: whatever touches; 0: not while contact is reported */
};

struct wire_cmd_keep {
  uint8_t keep; /* 1: the present settings; 0: none, the build's own from the next start on */
};
struct wire_cmd_prior {
  float sigma_mm, width_mm; /* both 0: none */
};
struct wire_cmd_location_limit {
  float limit_mm;
};
struct wire_cmd_pad {
  struct pad_profile profile;
};

struct wire_packet {
  uint8_t type;      /* enum wire_type */
  uint16_t sequence; /* counts the packets of one sender, also those it had to drop */
  uint64_t t_us;     /* device time since start; in commands the host's own clock */
  union {
    struct wire_contact contact;
    struct wire_raw raw;
    struct wire_info info;
    struct wire_health health;
    struct wire_ack ack;
    struct crash_record crash; /* kind CRASH_NONE, all 0: it never came to an end */
    struct wire_cmd_stream cmd_stream;
    struct wire_cmd_rate cmd_rate;
    struct wire_cmd_osr cmd_osr;
    struct wire_cmd_slip cmd_slip;
    struct wire_cmd_loader cmd_loader;
    struct wire_cmd_calibrate cmd_calibrate;
    struct wire_cmd_tare cmd_tare;
    struct wire_cmd_keep cmd_keep;
    struct wire_cmd_prior cmd_prior;
    struct wire_cmd_location_limit cmd_location_limit;
    struct wire_cmd_pad cmd_pad;
  } body;
};

/* The layout of one body. */
struct wire_layout;
extern const struct wire_layout wire_contact_layout, wire_raw_layout, wire_info_layout,
    wire_health_layout, wire_ack_layout, wire_crash_layout;
extern const struct wire_layout cmd_stream_layout, cmd_tare_layout, cmd_rate_layout, cmd_osr_layout,
    cmd_info_layout, cmd_health_layout, cmd_loader_layout, cmd_keep_layout, cmd_calibrate_layout,
    cmd_erase_calibration_layout, cmd_prior_layout, cmd_location_limit_layout, cmd_slip_layout,
    cmd_pad_layout, cmd_erase_pad_layout, cmd_crash_layout;

/* The commands that every fingertip knows, and those of its capabilities, for its set. */
#define WIRE_COMMANDS                                                                              \
  &cmd_stream_layout, &cmd_tare_layout, &cmd_rate_layout, &cmd_osr_layout, &cmd_info_layout,       \
      &cmd_health_layout, &cmd_loader_layout, &cmd_keep_layout, &cmd_crash_layout
#define WIRE_COMMANDS_OF_FIT                                                                       \
  &cmd_calibrate_layout, &cmd_erase_calibration_layout, &cmd_prior_layout,                         \
      &cmd_location_limit_layout
#define WIRE_COMMANDS_OF_SLIP &cmd_slip_layout
#define WIRE_COMMANDS_OF_TANGENTIAL &cmd_pad_layout, &cmd_erase_pad_layout

/* Sets of layouts, ended by NULL: those of all commands, and all there are. */
extern const struct wire_layout *const wire_commands[];
extern const struct wire_layout *const wire_all_layouts[];

/* NULL: the set has no such type. */
const struct wire_layout *wire_find_layout(const struct wire_layout *const *set, uint8_t type);

/* Encodes one packet as its layout says, of which its type is too, into a complete frame, delimiter
 * included: *length bytes. FT_ERR_ARGUMENT: layout is NULL, sensor_count is 0 or too large, a text
 * is not printable, or a float is not finite; frame is scratch then. Cost: about 40 Cortex-M0+
 * cycles a byte.
 */
enum ft_status wire_encode(const struct wire_layout *layout, const struct wire_packet *packet,
                           uint8_t frame[WIRE_MAX_FRAME_BYTES], size_t *length);

/* Decodes the bytes of one frame without its delimiter. The frame buffer is overwritten.
 * FT_ERR_FORMAT: bad COBS, wrong length for the type, or a value that the encoder would refuse.
 * FT_ERR_CRC. FT_ERR_VERSION: another protocol version, the CRC being right. FT_ERR_TYPE: of a
 * type that the set lacks but undamaged; type, sequence and t_us are set, so that the sender can be
 * answered and its sequence followed.
 */
enum ft_status wire_decode(const struct wire_layout *const *set, uint8_t *frame, size_t length,
                           struct wire_packet *packet);

/* Collects bytes from a line into packets. Resynchronisation: whatever happened, the next
 * frame begins after the next 0x00.
 */
struct wire_receiver {
  const struct wire_layout *const *set;
  uint8_t frame[WIRE_MAX_FRAME_BYTES];
  size_t length;
  uint32_t overlong; /* 1 while skipping a frame that is longer than any valid one */
};

void wire_receiver_init(struct wire_receiver *receiver, const struct wire_layout *const *set);

/* Takes one byte. FT_PENDING: no frame is complete. FT_OK: *packet is a new packet.
 * Else a damaged frame ended here and was discarded, for the reason given by wire_decode, or
 * FT_ERR_SPACE for an overlong one. Empty frames (two delimiters in a row) are legal fill.
 */
enum ft_status wire_receive(struct wire_receiver *receiver, uint8_t byte,
                            struct wire_packet *packet);

#endif
