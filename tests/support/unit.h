/* Tests of Unity that register themselves. unit.c has main, which runs them in the order of their file, and a setUp and
 * a tearDown for programs that define none. */
#pragma once

#include <stdio.h>
#include <unity.h>

struct unit_test {
  void (*run)(void);
  const char *name, *file;
  int line;
  struct unit_test *next;
};

void unit_add(struct unit_test *test);

#define TEST(test_name)                                                                                                                    \
  static void test_name(void);                                                                                                             \
  __attribute__((constructor)) static void add_##test_name(void) {                                                                         \
    static struct unit_test test = {.run = test_name, .name = #test_name, .file = __FILE__, .line = __LINE__};                             \
    unit_add(&test);                                                                                                                       \
  }                                                                                                                                        \
  static void test_name(void)

/* An assertion that fails with these words, as printf() has them. */
#define CHECK(condition, ...)                                                                                                              \
  do {                                                                                                                                     \
    char words[200];                                                                                                                       \
    snprintf(words, sizeof words, __VA_ARGS__);                                                                                            \
    TEST_ASSERT_TRUE_MESSAGE(condition, words);                                                                                            \
  } while (0)
