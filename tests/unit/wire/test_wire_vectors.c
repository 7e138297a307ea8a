/* The byte images of tests/vectors/wire, assembled by hand from PROTOCOL.md, against the codec. Their comments have the
 * values by the names of libfingertip: "# NAME", for an element of an array "[index]", then numbers or a text. */
#include "libfingertip/fingertip.h"
#include "support/unit.h"
#include "wire/packet.h"

#include <glob.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct vector {
  uint8_t packet[WIRE_MAX_PACKET_BYTES], frame[WIRE_MAX_FRAME_BYTES];
  size_t packet_length, frame_length;
  double values[FINGERTIP_VALUES_MOST];
};

static bool find_field(uint8_t type, const char *name, size_t length, struct fingertip_field *field) {
  for (size_t i = 0; fingertip_field_of(type, i, field) == FINGERTIP_OK; i++) {
    if (strlen(field->name) == length && strncmp(field->name, name, length) == 0) {
      return true;
    }
  }
  return false; /* of the version, the type, or the CRC */
}

static void take_comment(struct vector *vector, char *comment) {
  const size_t length = strcspn(comment, "[ ");
  struct fingertip_field field;
  if (!find_field(vector->packet[1], comment, length, &field)) {
    return;
  }
  double *value = &vector->values[field.at];
  comment += length;
  if (*comment == '[') {
    value += strtoul(comment + 1, &comment, 10);
    comment++;
  }
  if (comment[1] == '"') {
    for (comment += 2; *comment != '"'; comment++) {
      *value++ = *comment;
    }
    return;
  }
  char *end;
  for (double number = strtod(comment, &end); end != comment; number = strtod(comment, &end)) {
    *value++ = number;
    comment = end;
  }
}

static void read_vector(const char *path, struct vector *vector) {
  memset(vector, 0, sizeof *vector);
  FILE *file = fopen(path, "r");
  TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
  uint8_t *to = NULL;
  size_t *length = NULL;
  char line[256];
  while (fgets(line, sizeof line, file)) {
    char *comment = strstr(line, "# ");
    line[strcspn(line, "#\n")] = '\0';
    for (char *word = strtok(line, " "); word; word = strtok(NULL, " ")) {
      const bool is_packet = strcmp(word, "packet") == 0;
      if (is_packet || strcmp(word, "frame") == 0) {
        to = is_packet ? vector->packet : vector->frame;
        length = is_packet ? &vector->packet_length : &vector->frame_length;
        continue;
      }
      unsigned value;
      TEST_ASSERT_TRUE_MESSAGE(length && *length < sizeof vector->packet && sscanf(word, "%2x", &value) == 1, path);
      to[(*length)++] = (uint8_t)value;
    }
    if (comment && to == vector->packet) {
      take_comment(vector, comment + 2);
    }
  }
  fclose(file);
}

/* The frame is the packet under COBS and a delimiter, and both have the values of the comments. A double has counts of
 * microseconds up to 2^53 only. */
static void check(const char *path) {
  struct vector vector;
  read_vector(path, &vector);
  const uint8_t type = vector.packet[1];
  const size_t count = fingertip_value_count(type);
  uint8_t frame[WIRE_MAX_FRAME_BYTES];
  size_t length = 0;
  TEST_ASSERT_EQUAL_INT_MESSAGE(FINGERTIP_OK, fingertip_encode(type, vector.values, count, frame, sizeof frame, &length), path);
  TEST_ASSERT_EQUAL_size_t_MESSAGE(vector.frame_length, length, path);
  bool is_wide = false;
  for (size_t i = 0; i < count; i++) {
    is_wide = is_wide || vector.values[i] > 9007199254740992.0;
  }
  if (!is_wide) {
    TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(vector.frame, frame, length, path);
  }

  double values[1 + FINGERTIP_VALUES_MOST];
  size_t filled = 0;
  struct fingertip_decoder *decoder = fingertip_decoder_new();
  fingertip_decoder_feed(decoder, &(const uint8_t){0}, 1, values, sizeof values / sizeof values[0], &filled);
  fingertip_decoder_feed(decoder, vector.frame, length, values, sizeof values / sizeof values[0], &filled);
  fingertip_decoder_free(decoder);
  TEST_ASSERT_EQUAL_size_t_MESSAGE(1 + count, filled, path);
  TEST_ASSERT_EQUAL_MEMORY_MESSAGE(vector.values, values + 1, count * sizeof values[0], path);

  struct wire_packet packet;
  TEST_ASSERT_EQUAL_INT_MESSAGE(FT_OK, wire_decode(wire_all_layouts, vector.frame, length - 1, &packet), path);
  /* wire_decode has left the packet itself in the buffer. */
  TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(vector.packet, vector.frame, vector.packet_length, path);
}

TEST(test_every_vector_is_what_its_comments_state) {
  glob_t found;
  TEST_ASSERT_EQUAL_INT(0, glob(VECTORS "*.txt", 0, NULL, &found));
  TEST_ASSERT_GREATER_OR_EQUAL_size_t(36, found.gl_pathc);
  for (size_t i = 0; i < found.gl_pathc; i++) {
    check(found.gl_pathv[i]);
  }
  globfree(&found);
}
