/* The C interface of libfingertip as a C program uses it, in C11. */
#include "libfingertip/fingertip.h"
#include "support/unit.h"
#include "unit/wire/wire_samples.h"

#include <stdlib.h>

#define OK(call) TEST_ASSERT_EQUAL_INT(FINGERTIP_OK, call)

enum { CONTACT = 0x01, RAW = 0x02, INFO = 0x03, HEALTH = 0x04, ACK = 0x05, CMD_TARE = 0x81 };

/* Place of a field's first number. */
static size_t at(uint8_t type, const char *name) {
  struct fingertip_field field;
  for (size_t i = 0; fingertip_field_of(type, i, &field) == FINGERTIP_OK; i++) {
    if (strcmp(field.name, name) == 0) {
      return field.at;
    }
  }
  TEST_FAIL_MESSAGE(name);
  return 0;
}

/* The numbers of a packet, all 0 but what is given. */
struct numbers {
  double of[FINGERTIP_VALUES_MOST];
};

static void set(struct numbers *numbers, uint8_t type, const char *name, double value) { numbers->of[at(type, name)] = value; }

static struct numbers contact_of(double frame, double t_us) {
  struct numbers numbers = {{0}};
  set(&numbers, CONTACT, "frame", frame);
  set(&numbers, CONTACT, "t_us", t_us);
  set(&numbers, CONTACT, "flags", 3); /* CONTACT, FIT_VALID */
  set(&numbers, CONTACT, "x_mm", 1.5);
  set(&numbers, CONTACT, "force_N", 0.25);
  return numbers;
}

/* Its frame's length; 0: refused. */
static size_t frame_of(uint8_t type, const struct numbers *numbers, uint8_t *frame) {
  size_t length = 0;
  fingertip_encode(type, numbers->of, fingertip_value_count(type), frame, FINGERTIP_FRAME_MOST, &length);
  return length;
}

static struct numbers raw_of(double frame, double t_us) {
  struct numbers numbers = {{0}};
  set(&numbers, RAW, "frame", frame);
  set(&numbers, RAW, "t_us", t_us);
  set(&numbers, RAW, "sensor_count", 2);
  numbers.of[at(RAW, "pressure_Pa_q10") + 1] = 1024 * 101325.0;
  return numbers;
}

static struct numbers info_of(char serial) {
  struct numbers numbers = {{0}};
  set(&numbers, INFO, "sensor_count", 2);
  set(&numbers, INFO, "capabilities", 5); /* fit, raw */
  for (size_t i = 0; i < FINGERTIP_TEXT_LENGTH; i++) {
    numbers.of[at(INFO, "serial") + i] = serial;
  }
  numbers.of[at(INFO, "x_mm") + 1] = 9;
  return numbers;
}

TEST(every_packet_comes_back_as_its_numbers) {
  struct fingertip_decoder *decoder = fingertip_decoder_new();
  double values[1 + FINGERTIP_VALUES_MOST];
  size_t filled = 0;
  const uint8_t joined = 0;
  TEST_ASSERT_EQUAL_size_t(1, fingertip_decoder_feed(decoder, &joined, 1, values, 1 + FINGERTIP_VALUES_MOST, &filled));
  for (const uint8_t *type = wire_types; type < wire_types + WIRE_TYPES; type++) {
    struct sampler sampler = {SAMPLE_RANDOM, {*type}};
    struct wire_packet packet;
    sample_packet(&sampler, *type, &packet);
    packet.t_us &= (1ull << 53) - 1; /* as the header says */
    if (*type == ACK) {
      packet.body.ack.host_time_us &= (1ull << 53) - 1;
    } else if (*type == WIRE_CRASH) {
      packet.body.crash.t_us &= (1ull << 53) - 1;
    }
    uint8_t frame[FINGERTIP_FRAME_MOST], again[FINGERTIP_FRAME_MOST];
    size_t length = 0, length_again = 0;
    TEST_ASSERT_EQUAL_INT(FT_OK, encode(&packet, frame, &length));
    TEST_ASSERT_EQUAL_size_t(length, fingertip_decoder_feed(decoder, frame, length, values, 1 + FINGERTIP_VALUES_MOST, &filled));
    TEST_ASSERT_EQUAL_size_t(1 + fingertip_value_count(*type), filled);
    TEST_ASSERT_TRUE(values[0] == *type);
    OK(fingertip_encode(*type, values + 1, filled - 1, again, FINGERTIP_FRAME_MOST, &length_again));
    TEST_ASSERT_EQUAL_size_t(length, length_again);
    TEST_ASSERT_EQUAL_MEMORY(frame, again, length);
  }
  fingertip_decoder_free(decoder);
}

TEST(numbers_stand_under_their_names) {
  struct numbers contact = contact_of(70000, 123456789012.0);
  uint8_t frame[FINGERTIP_FRAME_MOST];
  const size_t length = frame_of(CONTACT, &contact, frame);
  struct wire_packet packet;
  TEST_ASSERT_EQUAL_INT(FT_OK, wire_decode(wire_all_layouts, frame, length - 1, &packet));
  TEST_ASSERT_EQUAL_UINT32(70000, packet.body.contact.frame);
  TEST_ASSERT_EQUAL_UINT64(123456789012u, packet.t_us);
  TEST_ASSERT_TRUE(packet.body.contact.x_mm == 1.5f);
  TEST_ASSERT_TRUE(packet.body.contact.force_N == 0.25f);
  struct fingertip_field field;
  OK(fingertip_field_of(INFO, 6, &field));
  TEST_ASSERT_EQUAL_STRING("board", field.name);
  TEST_ASSERT_EQUAL_UINT32(FINGERTIP_TEXT_LENGTH, field.count);
  TEST_ASSERT_TRUE(field.is_text);
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_ARGUMENT, fingertip_field_of(0x7F, 0, &field));
  TEST_ASSERT_EQUAL_size_t(0, fingertip_value_count(0x7F));
}

TEST(what_no_packet_may_hold_is_refused_by_its_name) {
  const struct {
    uint8_t type;
    const char *name;
    double value;
  } wrong[] = {{CONTACT, "x_mm", NAN},
               {CONTACT, "x_mm", 1e39},
               {CONTACT, "frame", 4294967296.0},
               {CONTACT, "frame", -1},
               {CONTACT, "frame", 0.5},
               {CONTACT, "t_us", 18446744073709555712.0},
               {RAW, "pressure_Pa_q10", 2147483648.0},
               {RAW, "sensor_count", 37},
               {RAW, "sensor_count", 0}};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
    struct numbers numbers = wrong[i].type == CONTACT ? contact_of(1, 1) : raw_of(1, 1);
    uint8_t unwritten[FINGERTIP_FRAME_MOST];
    size_t before = 7;
    set(&numbers, wrong[i].type, wrong[i].name, wrong[i].value);
    TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_VALUE, fingertip_encode(wrong[i].type, numbers.of, fingertip_value_count(wrong[i].type), unwritten,
                                                                sizeof unwritten, &before));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(fingertip_error(), wrong[i].name), fingertip_error());
    TEST_ASSERT_EQUAL_size_t(7, before);
  }
  struct numbers info = info_of('A');
  info.of[at(INFO, "board")] = 7;
  uint8_t frame[FINGERTIP_FRAME_MOST];
  size_t length = 0;
  const size_t count = fingertip_value_count(INFO);
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_VALUE, fingertip_encode(INFO, info.of, count, frame, sizeof frame, &length));
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_ARGUMENT, fingertip_encode(INFO, info.of, count - 1, frame, sizeof frame, &length));
  info = info_of('A');
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_ARGUMENT, fingertip_encode(INFO, info.of, count, frame, 20, &length));
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_ARGUMENT, fingertip_encode(INFO, NULL, count, frame, sizeof frame, &length));
}

TEST(a_full_buffer_takes_no_more_bytes_than_it_has_packets_for) {
  uint8_t line[40 * FINGERTIP_FRAME_MOST];
  size_t length = 0, packets = 0, taken = 0;
  line[length++] = 0;
  for (int i = 0; i < 40; i++) {
    struct numbers contact = contact_of(i, 1000 * i);
    contact.of[0] = i + (i > 20); /* one is lost */
    length += frame_of(CONTACT, &contact, line + length);
  }
  line[length - 5] ^= 8;
  struct fingertip_decoder *decoder = fingertip_decoder_new();
  double values[1 + FINGERTIP_VALUES_MOST];
  while (taken < length) {
    size_t filled = 0;
    const size_t step = fingertip_decoder_feed(decoder, line + taken, length - taken, values, 1 + FINGERTIP_VALUES_MOST, &filled);
    TEST_ASSERT_TRUE(step > 0);
    taken += step;
    if (filled > 0) {
      TEST_ASSERT_EQUAL_size_t(1 + fingertip_value_count(CONTACT), filled);
      TEST_ASSERT_TRUE(values[1 + at(CONTACT, "frame")] == (double)packets);
      packets++;
    }
  }
  double counts[FINGERTIP_COUNTS];
  fingertip_decoder_counts(decoder, counts);
  TEST_ASSERT_EQUAL_size_t(39, packets);
  TEST_ASSERT_TRUE(counts[FINGERTIP_COUNT_BYTES] == (double)length);
  TEST_ASSERT_TRUE(counts[FINGERTIP_COUNT_PACKETS] == 39);
  TEST_ASSERT_TRUE(counts[FINGERTIP_COUNT_DROPPED] == 1);
  TEST_ASSERT_TRUE(counts[FINGERTIP_COUNT_CRC_ERRORS] == 1);
  size_t filled = 1;
  TEST_ASSERT_EQUAL_size_t(0, fingertip_decoder_feed(decoder, line, length, values, FINGERTIP_VALUES_MOST, &filled));
  TEST_ASSERT_EQUAL_size_t(0, filled);
  fingertip_decoder_free(decoder);
}

/* ---- Recordings */

struct file {
  uint8_t bytes[1 << 20];
  size_t length;
};
static struct file file;

static void take(struct fingertip_writer *writer) {
  size_t count;
  while ((count = fingertip_writer_take(writer, file.bytes + file.length, 100)) > 0) {
    file.length += count;
  }
}

static void put(struct fingertip_writer *writer, size_t device, uint8_t type, struct numbers numbers, double host_us) {
  OK(fingertip_writer_packet(writer, device, type, numbers.of, fingertip_value_count(type), host_us));
  take(writer);
}

static void write_one(enum fingertip_format format) {
  file.length = 0;
  const struct numbers info = info_of('A');
  struct fingertip_writer *writer = fingertip_writer_new(format, info.of, "recorded_by: a test\nstarted_utc: 2026-08-05T12:00:00.125Z\n");
  TEST_ASSERT_NOT_NULL_MESSAGE(writer, fingertip_error());
  for (int i = 0; i < 100; i++) {
    put(writer, 0, CONTACT, contact_of(i, 1000 * i), 0);
    put(writer, 0, RAW, raw_of(i, 1000 * i), 0);
  }
  OK(fingertip_writer_event(writer, 0, "gone 2026-08-05T12:00:01.000Z"));
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_ARGUMENT, fingertip_writer_event(writer, 1, "gone"));
  struct numbers three = raw_of(100, 100000);
  set(&three, RAW, "sensor_count", 3);
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_SENSORS, fingertip_writer_packet(writer, 0, RAW, three.of, fingertip_value_count(RAW), 0));
  double counts[FINGERTIP_COUNTS] = {0};
  counts[FINGERTIP_COUNT_PACKETS] = 200;
  OK(fingertip_writer_finish(writer, "stopped", counts));
  TEST_ASSERT_EQUAL_UINT64(100, fingertip_writer_frames(writer));
  take(writer);
  fingertip_writer_free(writer);
}

/* What a reader that is fed in such steps finds: its last status, and how many of what. */
struct found {
  enum fingertip_status status;
  unsigned contacts, raws, infos, events, of_device_1;
  double last_us;
  bool has_end;
  double counts[FINGERTIP_COUNTS];
};

static struct found found_in(size_t step, int salvage) {
  struct found found = {.status = FINGERTIP_WAIT};
  struct fingertip_reader *reader = fingertip_reader_new("a.file", file.length, salvage);
  while (found.status == FINGERTIP_WAIT) {
    double values[FINGERTIP_VALUES_MOST];
    struct fingertip_item item;
    size_t count = 0;
    while ((found.status = fingertip_reader_next(reader, &item, values, FINGERTIP_VALUES_MOST, &count)) == FINGERTIP_OK) {
      found.contacts += item.type == CONTACT;
      found.raws += item.type == RAW;
      found.infos += item.type == INFO && values[at(INFO, "sensor_count")] == 2;
      found.of_device_1 += item.device == 1;
      if (item.type == 0) {
        found.events++;
        TEST_ASSERT_NOT_NULL(strstr(fingertip_reader_event(reader), "gone"));
      } else {
        TEST_ASSERT_EQUAL_size_t(fingertip_value_count((uint8_t)item.type), count);
      }
      if (item.type == CONTACT) {
        TEST_ASSERT_TRUE(values[at(CONTACT, "x_mm")] == 1.5);
        found.last_us = item.time_us;
      }
    }
    if (found.status == FINGERTIP_WAIT) {
      const size_t from = (size_t)fingertip_reader_wants(reader);
      TEST_ASSERT_TRUE_MESSAGE(from < file.length, "waits at the end");
      const size_t more = file.length - from < step ? file.length - from : step;
      OK(fingertip_reader_feed(reader, file.bytes + from, more));
    }
  }
  found.has_end = fingertip_reader_has_end(reader) != 0;
  fingertip_reader_counts(reader, found.counts);
  fingertip_reader_free(reader);
  return found;
}

TEST(a_recording_comes_back_however_it_is_cut) {
  for (int format = FINGERTIP_CSV; format <= FINGERTIP_MCAP; format++) {
    write_one((enum fingertip_format)format);
    for (size_t step = 1; step <= sizeof file.bytes; step *= 16) {
      const struct found found = found_in(step, 0);
      TEST_ASSERT_EQUAL_INT_MESSAGE(FINGERTIP_END, found.status, fingertip_error());
      TEST_ASSERT_EQUAL_UINT(100, found.contacts);
      TEST_ASSERT_EQUAL_UINT(100, found.raws);
      TEST_ASSERT_EQUAL_UINT(1, found.events);
      TEST_ASSERT_TRUE(found.last_us == 99000);
      TEST_ASSERT_TRUE(found.has_end);
      TEST_ASSERT_TRUE(found.counts[FINGERTIP_COUNT_PACKETS] == 200);
    }
  }
}

TEST(several_fingertips_share_a_recording_and_a_clock) {
  for (int format = FINGERTIP_CSV; format <= FINGERTIP_MCAP; format++) {
    file.length = 0;
    const size_t count = fingertip_value_count(INFO);
    double *infos = malloc(2 * count * sizeof *infos);
    TEST_ASSERT_NOT_NULL(infos);
    const struct numbers a = info_of('A'), b = info_of('B');
    memcpy(infos, a.of, count * sizeof *infos);
    memcpy(infos + count, b.of, count * sizeof *infos);
    struct fingertip_writer *writer = fingertip_writer_new_joint((enum fingertip_format)format, infos, 2, 5000, "");
    TEST_ASSERT_NOT_NULL_MESSAGE(writer, fingertip_error());
    const double clock[4] = {0, 5000, 1.5, 20};
    OK(fingertip_writer_clock(writer, 0, clock, 0));
    for (int i = 0; i < 20; i++) {
      put(writer, 0, CONTACT, contact_of(i, 1000 * i), 5000 + 1000 * i);
      put(writer, 0, RAW, raw_of(i, 1000 * i), 5000 + 1000 * i);
      put(writer, 1, RAW, raw_of(i, 777 + 1000 * i), 5500 + 1000 * i);
      OK(fingertip_writer_settle(writer, 5000 + 1000 * i));
    }
    OK(fingertip_writer_finish(writer, "stopped", NULL));
    take(writer);
    fingertip_writer_free(writer);
    const struct found found = found_in(1000, 0);
    TEST_ASSERT_EQUAL_INT_MESSAGE(FINGERTIP_END, found.status, fingertip_error());
    TEST_ASSERT_EQUAL_UINT(20, found.contacts);
    TEST_ASSERT_EQUAL_UINT(40, found.raws);
    TEST_ASSERT_EQUAL_UINT(2, found.infos);            /* of the head's keys */
    TEST_ASSERT_EQUAL_UINT(1 + 20, found.of_device_1); /* that, and its rows */
    TEST_ASSERT_TRUE(found.last_us == 19000);
    infos[count + at(INFO, "sensor_count")] = 3;
    TEST_ASSERT_NULL(fingertip_writer_new_joint((enum fingertip_format)format, infos, 2, 0, ""));
    TEST_ASSERT_NOT_NULL(strstr(fingertip_error(), "sensors"));
    free(infos);
  }
}

TEST(damage_is_told_and_reading_goes_on_behind_it) {
  write_one(FINGERTIP_CSV);
  char *row = strstr((char *)file.bytes, "\n50000,50,");
  TEST_ASSERT_NOT_NULL(row);
  row[1] = 'x';
  struct found found = found_in(4096, 0);
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_DAMAGED_LINE, found.status);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(fingertip_error(), "t_us is \"x0000\""), fingertip_error());
  TEST_ASSERT_EQUAL_UINT(50, found.contacts);
  found = found_in(4096, 1);
  TEST_ASSERT_EQUAL_INT(FINGERTIP_END, found.status);
  TEST_ASSERT_EQUAL_UINT(99, found.contacts);

  write_one(FINGERTIP_MCAP);
  file.length -= 200; /* the summary, and a bit of the end of the data */
  found = found_in(100, 0);
  TEST_ASSERT_TRUE(found.contacts > 0);
  file.length = 1000;
  found = found_in(100, 0);
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_NOT_A_RECORDING, found.status);
}

TEST(what_is_no_recording_is_refused) {
  const struct {
    const char *text;
    enum fingertip_status status;
  } files[] = {{"", FINGERTIP_ERR_NOT_A_RECORDING},
               {"hello\n", FINGERTIP_ERR_NOT_A_RECORDING},
               {"# fingertip-recording 3\n", FINGERTIP_ERR_OTHER_FORMAT},
               {"# fingertip-recording 1\n# serial: A\n", FINGERTIP_ERR_DAMAGED_HEAD},
               {"# fingertip-scenario 1\n", FINGERTIP_ERR_NOT_A_RECORDING}};
  for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
    file.length = strlen(files[i].text);
    memcpy(file.bytes, files[i].text, file.length);
    TEST_ASSERT_EQUAL_INT_MESSAGE(files[i].status, found_in(7, 0).status, files[i].text);
  }
  TEST_ASSERT_NULL(fingertip_writer_new(FINGERTIP_CSV, NULL, ""));
  const struct numbers info = info_of('A');
  TEST_ASSERT_NULL(fingertip_writer_new(FINGERTIP_CSV, info.of, "no key"));
}

TEST(a_clock_is_fitted) {
  struct fingertip_clock *clock = fingertip_clock_new();
  double estimate[4];
  TEST_ASSERT_EQUAL_INT(FINGERTIP_END, fingertip_clock_estimate(clock, estimate));
  for (int i = 0; i < 30; i++) {
    const double host_us = 1e6 * i;
    fingertip_clock_add(clock, host_us, host_us + 400, (host_us + 200) * (1 + 60e-6) + 5e6);
  }
  OK(fingertip_clock_estimate(clock, estimate));
  TEST_ASSERT_TRUE(fabs(estimate[1] - (estimate[0] - 5e6) / (1 + 60e-6)) <= estimate[3] + 1);
  TEST_ASSERT_TRUE(fabs(estimate[2] - 60) < 20);
  TEST_ASSERT_EQUAL_UINT(0, fingertip_clock_jumps(clock));
  fingertip_clock_add(clock, 31e6, 31e6 + 400, 50e6);
  TEST_ASSERT_EQUAL_UINT(1, fingertip_clock_jumps(clock));
  fingertip_clock_restart(clock);
  TEST_ASSERT_EQUAL_INT(FINGERTIP_END, fingertip_clock_estimate(clock, estimate));
  fingertip_clock_free(clock);
}

TEST(names_are_those_of_the_library) {
  uint32_t bit = 0, warnings = 0;
  int is_warning = 0;
  size_t flags = 0;
  for (; fingertip_flag(flags, &bit, &is_warning); flags++) {
    warnings |= is_warning ? bit : 0;
  }
  TEST_ASSERT_EQUAL_size_t(30, flags);
  TEST_ASSERT_EQUAL_UINT32(705167104, warnings);
  char text[32];
  TEST_ASSERT_EQUAL_size_t(9, fingertip_flags_text(0x40000001, text, sizeof text) - 4);
  TEST_ASSERT_EQUAL_STRING("CONTACT bit30", text);
  TEST_ASSERT_EQUAL_size_t(13, fingertip_flags_text(0x40000001, text, 4));
  TEST_ASSERT_EQUAL_STRING("CON", text);
  fingertip_command_name(CMD_TARE, text, sizeof text);
  TEST_ASSERT_EQUAL_STRING("tare", text);
  fingertip_result_text(0, text, sizeof text);
  TEST_ASSERT_EQUAL_STRING("done", text);
  fingertip_capabilities_text(5, text, sizeof text);
  TEST_ASSERT_EQUAL_STRING("fit,raw", text);
  fingertip_stored_text(0, text, sizeof text);
  TEST_ASSERT_EQUAL_STRING("nothing", text);
  fingertip_number_text(0.1f, text, sizeof text);
  TEST_ASSERT_EQUAL_STRING("0.1", text);
  fingertip_columns(2, text, sizeof text);
  TEST_ASSERT_EQUAL_STRING_LEN("t_us,frame,sequence,flags,", text, 26);
  TEST_ASSERT_EQUAL_INT(FINGERTIP_ERR_FIRMWARE, fingertip_firmware("x.uf2", (const uint8_t *)"UF2", 3, text, text, text, sizeof text));
  TEST_ASSERT_EQUAL_STRING("x.uf2: no UF2 file", fingertip_error());
  uint8_t frame[FINGERTIP_FRAME_MOST];
  size_t length = 0;
  OK(fingertip_encode_info_of(4, frame, sizeof frame, &length));
  struct wire_packet packet;
  TEST_ASSERT_EQUAL_INT(FT_ERR_VERSION, wire_decode(wire_all_layouts, frame, length - 1, &packet));
}
