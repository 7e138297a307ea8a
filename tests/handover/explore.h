/* What interrupts may do to the main context, tried in every place: a checker of the hand-overs between contexts that
 * runs the firmware's own code.
 *
 * The modules under test are compiled with -fsanitize=thread and linked without its library, so that each access to
 * memory they make calls a function here, as each piece of a memcpy does. An access to a variable that is not on the
 * stack is a point at which interrupts of a higher priority may come, none, one or several, each of them whole. All
 * choices are tried, one run for each, up to so many interrupts in a run; then all that was static is as it was before.
 *
 * Order within a context is that of this build: that the compiler of an image keeps it (release, acquire,
 * atomic_signal_fence) is not shown. A second processor is an interrupt too: it comes in whole steps. A test of two
 * processors lets each in turn be the one that is interrupted. */
#pragma once

#include <stdbool.h>

struct explore_interrupt {
  void (*run)(void);
  unsigned priority; /* 1 interrupts the main context, 2 that too, ... */
  unsigned most;     /* in one run */
};

/* Calls run() for every choice: some `most` interrupts in one run at most. What is static is put
 * back before each. Returns the number of runs; *points: of all of them. */
unsigned long explore(void (*run)(void), const struct explore_interrupt *interrupts, unsigned count, unsigned most, unsigned long *points);

/* Within run(): points count from here on, and no more. */
void explore_begin(void);
void explore_end(void);
