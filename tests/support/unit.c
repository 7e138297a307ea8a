#include "support/unit.h"

static struct unit_test *first, **last = &first;

void unit_add(struct unit_test *test) {
  *last = test;
  last = &test->next;
}

__attribute__((weak)) void setUp(void) {}

__attribute__((weak)) void tearDown(void) {}

int main(void) {
  if (!first) {
    return 1;
  }
  UnityBegin(first->file);
  for (const struct unit_test *test = first; test; test = test->next) {
    UnityDefaultTestRun(test->run, test->name, test->line);
  }
  return UnityEnd();
}
