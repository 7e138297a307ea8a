#define _DEFAULT_SOURCE /* ftruncate */

#include "fuzz.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

struct count {
  uint64_t runs, bytes;
  uint64_t length; /* of the input that is running */
};

static void *shared_file(const char *path, size_t bytes) {
  int fd = open(path, O_RDWR | O_CREAT, 0666);
  FUZZ_CHECK(fd >= 0 && ftruncate(fd, (off_t)bytes) == 0);
  void *mapped = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  FUZZ_CHECK(mapped != MAP_FAILED);
  close(fd);
  return mapped;
}

/* Shared with the file, which so has the last run as well. */
static struct count *open_count(void) {
  static struct count unread;
  const char *path = getenv("FINGERTIP_FUZZ_COUNT");
  return path ? shared_file(path, sizeof(struct count)) : &unread;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length) {
  static struct count *count;
  if (!count) {
    count = open_count();
  }
  count->runs++;
  count->bytes += length;
  count->length = length;
  fuzz_one(bytes, length);
  return 0;
}

/* The walk --------------------------------------------------------------------------------------
 * What libFuzzer tries next depends on addresses and times, so no two of its runs are the same. A
 * test's inputs depend on its seed alone: each is one of a pool, changed at a few places. It or a
 * given one takes the place of another one of the pool. */

enum { POOL = 64, MAX_CHANGES = 6 };

struct text {
  uint8_t *bytes;
  size_t length;
};

static uint64_t walk_state;
static size_t walk_max;

/* xorshift64* (Vigna, 2016); below `limit`, which is not 0. */
static size_t some(size_t limit) {
  walk_state ^= walk_state >> 12;
  walk_state ^= walk_state << 25;
  walk_state ^= walk_state >> 27;
  return (size_t)((walk_state * UINT64_C(2685821657736338717)) >> 33) % limit;
}

static struct text copy_of(const uint8_t *bytes, size_t length) {
  struct text text = {malloc(length ? length : 1), length};
  FUZZ_CHECK(text.bytes);
  memcpy(text.bytes, bytes, length);
  return text;
}

static struct text read_text(const char *path) {
  FILE *file = fopen(path, "rb");
  FUZZ_CHECK(file);
  struct text text = {malloc(walk_max), 0};
  FUZZ_CHECK(text.bytes);
  text.length = fread(text.bytes, 1, walk_max, file);
  (void)fclose(file);
  return text;
}

/* In place of `taken` bytes of an input, `length` others, as far as it may grow. */
static void replace(struct text *text, size_t at, size_t taken, const uint8_t *bytes, size_t length) {
  size_t room = walk_max - (text->length - taken);
  length = length < room ? length : room;
  struct text other = {malloc(text->length - taken + length + 1), text->length - taken + length};
  FUZZ_CHECK(other.bytes);
  memcpy(other.bytes, text->bytes, at);
  memcpy(other.bytes + at, bytes, length);
  memcpy(other.bytes + at + length, text->bytes + at + taken, text->length - at - taken);
  free(text->bytes);
  *text = other;
}

static void change(struct text *text, const struct text *donor) {
  static const uint8_t ends[] = {0, 1, 0x7F, 0x80, 0xFF};
  uint8_t fresh[16];
  for (size_t i = 0; i < sizeof fresh; i++) {
    fresh[i] = (uint8_t)some(256);
  }
  size_t at = some(text->length + 1), left = text->length - at;
  size_t few = left ? some(left < sizeof fresh ? left : sizeof fresh) + 1 : 0;
  switch (some(8)) {
  case 0: /* bits */
    if (left) {
      text->bytes[at] ^= (uint8_t)(1 << some(8));
    }
    break;
  case 1: /* a number at an end of its range */
    memset(fresh, ends[some(sizeof ends)], sizeof fresh);
    replace(text, at, few, fresh, few);
    break;
  case 2: /* a number that is a little more or less */
    if (left) {
      text->bytes[at] = (uint8_t)(text->bytes[at] + some(17) - 8);
    }
    break;
  case 3:
    replace(text, at, few, fresh, few);
    break;
  case 4:
    replace(text, at, 0, fresh, some(sizeof fresh) + 1);
    break;
  case 5:
    replace(text, at, few, fresh, 0);
    break;
  case 6: /* a part of itself again */
    if (text->length) {
      size_t from = some(text->length);
      struct text part = copy_of(text->bytes + from, some(text->length - from) + 1);
      replace(text, at, 0, part.bytes, part.length);
      free(part.bytes);
    }
    break;
  default: /* a part of another one */
    if (donor->length) {
      size_t from = some(donor->length), length = some(donor->length - from) + 1;
      replace(text, at, some(2) ? 0 : left, donor->bytes + from, length);
    }
  }
}

/* walk RUNS MAX_LEN SEED KEPT FILE...: KEPT is a file that has the input which is running. */
static void walk(int argc, char **argv) {
  const uint64_t runs = strtoull(argv[2], NULL, 10);
  walk_max = strtoull(argv[3], NULL, 10);
  walk_state = strtoull(argv[4], NULL, 10) + UINT64_C(0x9E3779B97F4A7C15);
  uint8_t *kept = shared_file(argv[5], walk_max);
  char **files = argv + 6;
  const size_t seeds = (size_t)argc - 6;
  struct text pool[POOL];
  for (size_t i = 0; i < POOL; i++) {
    pool[i] = read_text(files[i % seeds]);
  }
  for (uint64_t run = 0; run < runs; run++) {
    struct text input;
    if (run < seeds) {
      input = read_text(files[run]);
    } else {
      const struct text *from = &pool[some(POOL)];
      input = copy_of(from->bytes, from->length);
      for (size_t changes = some(MAX_CHANGES) + 1; changes > 0; changes--) {
        change(&input, &pool[some(POOL)]);
      }
    }
    memcpy(kept, input.bytes, input.length);
    struct text exact = copy_of(input.bytes, input.length); /* so that the sanitizer sees its end */
    LLVMFuzzerTestOneInput(exact.bytes, exact.length);
    free(exact.bytes);
    struct text *place = &pool[some(POOL)];
    free(place->bytes);
    if (some(2)) {
      *place = input;
    } else {
      free(input.bytes);
      *place = read_text(files[some(seeds)]);
    }
  }
  for (size_t i = 0; i < POOL; i++) {
    free(pool[i].bytes);
  }
}

int LLVMFuzzerInitialize(int *argc, char ***argv);

int LLVMFuzzerInitialize(int *argc, char ***argv) {
  if (*argc > 6 && strcmp((*argv)[1], "walk") == 0) {
    walk(*argc, *argv);
    exit(0);
  }
  return 0;
}
