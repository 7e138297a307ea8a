#include "explore.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CHOICES_MAX = 4096, INTERRUPTS_MAX = 8 };

/* Beside the statics, which go back. */
struct explorer {
  const struct explore_interrupt *interrupts;
  unsigned count, most;
  struct {
    uint8_t of, is;
  } choices[CHOICES_MAX];
  unsigned known, made; /* choices */
  bool active;
  unsigned priority; /* of what runs */
  unsigned highest;  /* of all interrupts */
  unsigned came[INTERRUPTS_MAX], came_in_all;
  const char *stack;
  unsigned long runs, points;
};
static struct explorer *explorer;

extern char __data_start[], _end[];

void *__real_memcpy(void *to, const void *from, size_t size);
void *__wrap_memcpy(void *to, const void *from, size_t size);

static unsigned choose(unsigned of) {
  if (explorer->made == explorer->known) {
    if (explorer->known == CHOICES_MAX) {
      fputs("explore: too many choices\n", stderr);
      abort();
    }
    explorer->choices[explorer->known].of = (uint8_t)of;
    explorer->choices[explorer->known++].is = 0;
  } else if (explorer->choices[explorer->made].of != of) {
    fputs("explore: the same choices led elsewhere\n", stderr);
    abort();
  }
  return explorer->choices[explorer->made++].is;
}

static bool choose_otherwise(void) {
  while (explorer->known > 0) {
    unsigned last = explorer->known - 1;
    if (++explorer->choices[last].is < explorer->choices[last].of) {
      return true;
    }
    explorer->known--;
  }
  return false;
}

/* The interrupt chosen of those that may come now, or -1. */
static int choose_interrupt(void) {
  int may[INTERRUPTS_MAX];
  unsigned count = 0;
  for (unsigned i = 0; i < explorer->count; i++) {
    const struct explore_interrupt *interrupt = &explorer->interrupts[i];
    if (interrupt->priority > explorer->priority && explorer->came[i] < interrupt->most) {
      may[count++] = (int)i;
    }
  }
  if (count == 0 || explorer->came_in_all == explorer->most) {
    return -1;
  }
  unsigned choice = choose(count + 1);
  return choice == 0 ? -1 : may[choice - 1];
}

static void let_interrupts_come(void) {
  for (int i = choose_interrupt(); i >= 0; i = choose_interrupt()) {
    explorer->came[i]++;
    explorer->came_in_all++;
    unsigned interrupted = explorer->priority;
    explorer->priority = explorer->interrupts[i].priority;
    explorer->interrupts[i].run();
    explorer->priority = interrupted;
  }
}

static void point(const void *address) {
  const char *here = (const char *)&address;
  struct explorer *now = explorer;
  if (!now || !now->active || ((const char *)address > here && (const char *)address < now->stack)) {
    return;
  }
  now->points++;
  if (now->came_in_all < now->most && now->priority < now->highest) { /* else none may come */
    let_interrupts_come();
  }
}

void explore_begin(void) { explorer->active = true; }

void explore_end(void) {
  let_interrupts_come();
  explorer->active = false;
}

unsigned long explore(void (*run)(void), const struct explore_interrupt *interrupts, unsigned count, unsigned most, unsigned long *points) {
  char here;
  size_t size = (size_t)(_end - __data_start);
  char *before = malloc(size);
  explorer = calloc(1, sizeof *explorer);
  if (!before || !explorer || count > INTERRUPTS_MAX) {
    abort();
  }
  explorer->interrupts = interrupts;
  explorer->count = count;
  explorer->most = most;
  explorer->stack = &here;
  for (unsigned i = 0; i < count; i++) {
    unsigned priority = interrupts[i].priority;
    explorer->highest = priority > explorer->highest ? priority : explorer->highest;
  }
  __real_memcpy(before, __data_start, size);
  do {
    __real_memcpy(__data_start, before, size);
    explorer->made = 0;
    explorer->priority = 0;
    explorer->came_in_all = 0;
    memset(explorer->came, 0, sizeof explorer->came);
    explorer->runs++;
    run();
  } while (choose_otherwise());
  unsigned long runs = explorer->runs;
  *points = explorer->points;
  free(before);
  free(explorer);
  explorer = NULL;
  return runs;
}

/* A copy comes in words. */
void *__wrap_memcpy(void *to, const void *from, size_t size) {
  for (size_t at = 0; at < size; at += 16) {
    size_t length = size - at < 16 ? size - at : 16;
    point((const char *)from + at);
    point((char *)to + at);
    __real_memcpy((char *)to + at, (const char *)from + at, length);
  }
  return to;
}

/* What the compiler calls ---------------------------------------------------------------------- */

void __tsan_init(void);
void __tsan_func_entry(void *caller);
void __tsan_func_exit(void);
void __tsan_read_range(void *address, size_t size);
void __tsan_write_range(void *address, size_t size);
void __tsan_atomic_signal_fence(int order);

void __tsan_init(void) {}
void __tsan_func_entry(void *caller) { (void)caller; }
void __tsan_func_exit(void) {}
void __tsan_read_range(void *address, size_t size) {
  (void)size;
  point(address);
}
void __tsan_write_range(void *address, size_t size) {
  (void)size;
  point(address);
}
void __tsan_atomic_signal_fence(int order) { (void)order; }

#define ACCESS(name)                                                                                                                       \
  void name(void *address);                                                                                                                \
  void name(void *address) { point(address); }
#define ACCESSES(bytes)                                                                                                                    \
  ACCESS(__tsan_read##bytes)                                                                                                               \
  ACCESS(__tsan_write##bytes)                                                                                                              \
  ACCESS(__tsan_unaligned_read##bytes)                                                                                                     \
  ACCESS(__tsan_unaligned_write##bytes)
ACCESSES(1)
ACCESSES(2)
ACCESSES(4)
ACCESSES(8)
ACCESSES(16)

#define ATOMICS(bits)                                                                                                                      \
  uint##bits##_t __tsan_atomic##bits##_load(const volatile uint##bits##_t *address, int order);                                            \
  uint##bits##_t __tsan_atomic##bits##_load(const volatile uint##bits##_t *address, int order) {                                           \
    (void)order;                                                                                                                           \
    point((const void *)address);                                                                                                          \
    return *address;                                                                                                                       \
  }                                                                                                                                        \
  void __tsan_atomic##bits##_store(volatile uint##bits##_t *address, uint##bits##_t value, int order);                                     \
  void __tsan_atomic##bits##_store(volatile uint##bits##_t *address, uint##bits##_t value, int order) {                                    \
    (void)order;                                                                                                                           \
    point((const void *)address);                                                                                                          \
    *address = value;                                                                                                                      \
  }
ATOMICS(32)
ATOMICS(64)
