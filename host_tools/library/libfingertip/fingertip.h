/* libfingertip in C, for programs in other languages: bytes of a fingertip's line to numbers and back, recordings,
 * clocks, names. It opens no port and no file. The caller moves the bytes, on any thread, in any loop.
 *
 * Handles. A _new function makes a handle, and _free ends it. _free accepts NULL. Two threads may
 * use two handles at once, but never one handle. Functions without a handle may run on any thread.
 *
 * Memory. Buffers belong to the caller. The library keeps no pointer to them. Returned strings belong to the library:
 * names for good, fingertip_error until the thread's next call. Functions that write a text work as snprintf: they cut
 * the text to size - 1 characters, end it with a zero, and return its whole length.
 *
 * Errors. No C++ exception leaves the library. A function that can fail returns a status, negative
 * for failure. fingertip_error then has one line about it. Outputs are written on success only.
 *
 * Numbers. A packet is an array of doubles in the order of its fields. fingertip_field_of gives the order. The first two numbers are in
 * every packet: sequence, which counts the packets of a sender modulo 65536, and t_us, microseconds on its clock since its start. A double
 * holds every number of a packet exactly, a count of microseconds up to 2^53, which is 285 years. A text is the codes of 16 characters,
 * zeros behind. Fields with an element for each sensor have FINGERTIP_SENSORS_MOST elements. The first sensor_count of them are of sensors.
 * A field whose flag is off is 0. PROTOCOL.md explains the fields. Their names end with their units: mm, N, Pa, us; q10 are 1/1024, cC
 * 1/100 of a degree Celsius. */
#ifndef LIBFINGERTIP_FINGERTIP_H
#define LIBFINGERTIP_FINGERTIP_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#pragma GCC visibility push(default)
#endif
#ifdef __cplusplus
extern "C" {
#endif

enum fingertip_status {
  FINGERTIP_OK = 0,
  FINGERTIP_END = 1,                  /* there is no more */
  FINGERTIP_WAIT = 2,                 /* feed more bytes first */
  FINGERTIP_ERR_ARGUMENT = -1,        /* NULL, an unknown type, a buffer too small */
  FINGERTIP_ERR_VALUE = -2,           /* a number that no packet may hold, or that a file cannot */
  FINGERTIP_ERR_NOT_A_RECORDING = -3, /* nor bytes of a line */
  FINGERTIP_ERR_OTHER_FORMAT = -4,    /* a recording, newer or older than this library */
  FINGERTIP_ERR_DAMAGED_LINE = -5,    /* of a recording; the next call goes on behind it */
  FINGERTIP_ERR_DAMAGED_HEAD = -6,    /* of a recording: no row of it can be read */
  FINGERTIP_ERR_SENSORS = -7,         /* all rows of a recording have equally many sensors */
  FINGERTIP_ERR_FIRMWARE = -8,        /* no firmware of a fingertip, or a damaged one */
  FINGERTIP_ERR_OTHER = -9            /* out of memory, or a bug */
};

/* What went wrong in this thread's last call that failed: one line, in English. */
const char *fingertip_error(void);

enum {
  FINGERTIP_PROTOCOL = 9,      /* version of the line's protocol */
  FINGERTIP_SENSORS_MOST = 36, /* of one fingertip */
  FINGERTIP_FRAME_MOST = 1127, /* bytes of a packet on the line, its final zero included */
  FINGERTIP_VALUES_MOST = 416, /* at least as many as the longest packet has numbers */
  FINGERTIP_TEXT_LENGTH = 16
};

/* ---- Packets as numbers
 *
 * type: enum wire_type of wire/bodies.h, 0x01 contact, 0x02 raw, ... Commands, too. */

struct fingertip_field {
  const char *name;
  uint32_t at;    /* place of its first number in the packet's */
  uint32_t count; /* of its numbers: 1, or as many as its array has */
  uint32_t is_text;
};

/* The field number index, from 0. FINGERTIP_END: there are fewer. */
enum fingertip_status fingertip_field_of(uint8_t type, size_t index, struct fingertip_field *field);
/* The number of values of all its fields; 0: there is no such type. */
size_t fingertip_value_count(uint8_t type);

/* The frame of a packet or a command as it goes onto the line, final zero included. count: of values,
 * fingertip_value_count. FINGERTIP_ERR_VALUE names the field. */
enum fingertip_status fingertip_encode(uint8_t type, const double *values, size_t count, uint8_t *frame, size_t size, size_t *length);
/* The command info in another version of the protocol: a fingertip that speaks that version answers. */
enum fingertip_status fingertip_encode_info_of(uint8_t version, uint8_t *frame, size_t size, size_t *length);

/* ---- Bytes of a line to packets */

enum fingertip_count {
  FINGERTIP_COUNT_BYTES,
  FINGERTIP_COUNT_PACKETS,      /* undamaged and of a known type */
  FINGERTIP_COUNT_DROPPED,      /* missing from the sequence */
  FINGERTIP_COUNT_OUT_OF_ORDER, /* repeated, or older than one before */
  FINGERTIP_COUNT_CRC_ERRORS,
  FINGERTIP_COUNT_FORMAT_ERRORS, /* right or no CRC, but no frame of this protocol */
  FINGERTIP_COUNT_VERSION_ERRORS,
  FINGERTIP_COUNT_UNKNOWN_TYPES, /* undamaged, from a newer firmware */
  FINGERTIP_COUNTS
};

struct fingertip_decoder;
struct fingertip_decoder *fingertip_decoder_new(void); /* NULL: out of memory */
void fingertip_decoder_free(struct fingertip_decoder *decoder);

/* Takes bytes as they come, cut anywhere. For each packet that they complete it writes 1 + n numbers to values, one
 * packet behind the other: its type, then its n = fingertip_value_count(type). *filled: count of all numbers. Returns
 * how many bytes were taken; fewer than length where values is full: use what is there, and call again with the rest.
 * size: 1 + FINGERTIP_VALUES_MOST at least, else none is taken. A receiver that joins gets only the end of the first
 * frame, which counts as nothing. */
size_t fingertip_decoder_feed(struct fingertip_decoder *decoder, const uint8_t *bytes, size_t length, double *values, size_t size,
                              size_t *filled);
/* The line was interrupted: join again, and expect no particular sequence number. */
void fingertip_decoder_restart(struct fingertip_decoder *decoder);
void fingertip_decoder_counts(const struct fingertip_decoder *decoder, double counts[FINGERTIP_COUNTS]);
/* The version of the last packet that counted as a version error; 0: there was none. */
uint8_t fingertip_decoder_other_version(const struct fingertip_decoder *decoder);

/* ---- Reading recordings: CSV, MCAP, and captures of the line, known by their first bytes */

struct fingertip_reader;
/* name: of the file, for errors. size: of all its bytes. salvage: 1 to skip what is damaged. */
struct fingertip_reader *fingertip_reader_new(const char *name, uint64_t size, int salvage);
void fingertip_reader_free(struct fingertip_reader *reader);

/* Where in the file the bytes to be fed next are: at first its beginning, then behind those that were fed, but for MCAP
 * files, whose index at the end is read first, and whose chunks may be in another order than that of time. */
uint64_t fingertip_reader_wants(const struct fingertip_reader *reader);

/* The bytes of the file from fingertip_reader_wants on. They are copied. */
enum fingertip_status fingertip_reader_feed(struct fingertip_reader *reader, const uint8_t *bytes, size_t length);

struct fingertip_item {
  double time_us;  /* of a row: on the recorder's clock in a recording of several, else on the
                      fingertip's; NAN of anything else */
  uint32_t device; /* number in a recording of several */
  uint32_t type;   /* of the packet; 0: an event, fingertip_reader_event has its text */
};

/* The next packet or event, with its numbers. FINGERTIP_WAIT: feed more. FINGERTIP_END: that was all.
 * Where no info packet precedes a fingertip's first row, one is made of the head's keys; the counts are without it. */
enum fingertip_status fingertip_reader_next(struct fingertip_reader *reader, struct fingertip_item *item, double *values, size_t size,
                                            size_t *count);
const char *fingertip_reader_event(const struct fingertip_reader *reader);

/* 1: a capture of the line, no recording. */
int fingertip_reader_is_capture(const struct fingertip_reader *reader);
/* Whether the last line of a recording was seen, without which its recorder was killed or its disk was full; 1 at the end of a capture. */
int fingertip_reader_has_end(const struct fingertip_reader *reader);
/* Lines that were skipped, and in a capture the line's counters by its packets. */
uint64_t fingertip_reader_skipped(const struct fingertip_reader *reader);
void fingertip_reader_counts(const struct fingertip_reader *reader, double counts[FINGERTIP_COUNTS]);
/* The same as fingertip_decoder_other_version, for a capture. */
uint8_t fingertip_reader_other_version(const struct fingertip_reader *reader);

/* ---- Writing recordings */

enum fingertip_format { FINGERTIP_CSV, FINGERTIP_MCAP };

struct fingertip_writer;

/* infos: of each of the fingertips an info packet's numbers, fingertip_value_count(0x03), one behind
 * the other; all have equally many sensors. comments: lines "key: value" of the recorder's own for the
 * head, such as "started_utc: 2026-08-05T12:00:00.125Z", each ended by "\n". NULL on failure. */
struct fingertip_writer *fingertip_writer_new(enum fingertip_format format, const double *info, const char *comments);
/* A recording of several on one clock, host_zero_us of which its times are counted from. */
struct fingertip_writer *fingertip_writer_new_joint(enum fingertip_format format, const double *infos, size_t devices, int64_t host_zero_us,
                                                    const char *comments);
void fingertip_writer_free(struct fingertip_writer *writer);

/* A packet of a device, 0 in a recording of one. host_us: its time on the recorder's clock, for a recording of several
 * alone. A contact packet waits for the raw packet of its frame where the fingertip sends both. */
enum fingertip_status fingertip_writer_packet(struct fingertip_writer *writer, size_t device, uint8_t type, const double *values,
                                              size_t count, double host_us);
/* "gone ..." and "back ..." with the time: the port vanished, and was there again. */
enum fingertip_status fingertip_writer_event(struct fingertip_writer *writer, size_t device, const char *text);
/* In a recording of several: the present estimate of fingertip_clock for a device. Rows from before
 * host_us will not come any more, so that lines until then may be written. */
enum fingertip_status fingertip_writer_clock(struct fingertip_writer *writer, size_t device, const double estimate[4], unsigned jumps);
enum fingertip_status fingertip_writer_settle(struct fingertip_writer *writer, double host_us);
/* Last of all. counts: FINGERTIP_COUNTS of each device, one behind the other; reason: one word. */
enum fingertip_status fingertip_writer_finish(struct fingertip_writer *writer, const char *reason, const double *counts);
/* Rows until now. */
uint64_t fingertip_writer_frames(const struct fingertip_writer *writer);

/* Moves bytes of the file out, in their order: at most size; returns how many. They wait in memory
 * until then, so call it after each of the calls above, and until it returns 0 after the last. */
size_t fingertip_writer_take(struct fingertip_writer *writer, uint8_t *bytes, size_t size);

/* ---- A fingertip's clock in terms of the host's (clock_fit.hpp has the method) */

struct fingertip_clock;
struct fingertip_clock *fingertip_clock_new(void);
void fingertip_clock_free(struct fingertip_clock *clock);
/* A command that was sent and answered at these times of the host's clock; device_us: t_us of its
 * acknowledgement. In order of device time. */
void fingertip_clock_add(struct fingertip_clock *clock, double sent_us, double received_us, double device_us);
/* device_us of the last exchange; host_us at that time; drift_ppm, positive where the fingertip's
 * clock is fast; uncertainty_us, no error at that time is larger. FINGERTIP_END: no exchange yet. */
enum fingertip_status fingertip_clock_estimate(const struct fingertip_clock *clock, double estimate[4]);
unsigned fingertip_clock_jumps(const struct fingertip_clock *clock);
/* The fingertip was gone: its clock may be another. */
void fingertip_clock_restart(struct fingertip_clock *clock);

/* ---- Names and texts */

/* The flag number index, lowest bit first; NULL: there are fewer. bit and is_warning may be NULL. A
 * warning means that the numbers deserve less trust. */
const char *fingertip_flag(size_t index, uint32_t *bit, int *is_warning);
size_t fingertip_flags_text(uint32_t flags, char *text, size_t size); /* "CONTACT FIT_VALID" */
size_t fingertip_command_name(uint8_t type, char *text, size_t size); /* "tare" */
/* What an acknowledgement's result means, for the end of a sentence. */
size_t fingertip_result_text(uint8_t result, char *text, size_t size);
size_t fingertip_capabilities_text(uint32_t capabilities, char *text, size_t size); /* "fit,slip" */
size_t fingertip_stored_text(uint32_t stored, char *text, size_t size);
/* The columns of a recording's rows, separated by commas, from t_us on. */
size_t fingertip_columns(uint8_t sensor_count, char *text, size_t size);
/* The shortest text that reads back as the same float. */
size_t fingertip_number_text(float value, char *text, size_t size);

/* ---- Firmware images */

/* What a UF2 file is the firmware of: board, version and commit, each a text of up to size - 1
 * characters. Fails unless it is whole, undamaged, and for the RP2040. name: of the file, for errors. */
enum fingertip_status fingertip_firmware(const char *name, const uint8_t *bytes, size_t length, char *board, char *version, char *git_hash,
                                         size_t size);

#ifdef __cplusplus
}
#endif
#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#endif
