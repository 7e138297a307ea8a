/* A worker beside the main loop: the main loop asks it about one frame, and it answers with one result.
 *
 * Both share one job and nothing else. The one that owns the job reads and writes it, and the other does not look at it. The main loop owns
 * a free job. worker_ask() gives it to the worker, and worker_serve() gives it back with the answer in it. Each of the two counts has one
 * writer, so plain atomic loads and stores suffice, between contexts of one processor and between two processors that share memory.
 *
 * A single processor serves itself (app/jobs.h). The work depends on the job alone, so the answer has the
 * same bits wherever it is done.
 *
 * Cost: some 20 Cortex-M0+ cycles a call. */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

struct worker {
  void (*work)(void *job); /* answers the question in the job */
  void *job;
  _Atomic uint32_t asked;    /* questions so far, modulo 2^32; the main loop writes it */
  _Atomic uint32_t answered; /* of them; the worker writes it */
};

/* Before both use it: the job is free. */
void worker_init(struct worker *worker, void (*work)(void *job), void *job);

/* Main loop: whether it owns the job. If it has asked before, the answer is there. */
bool worker_is_free(const struct worker *worker);

/* Main loop: hands the job over, which was free and has a question in it. */
void worker_ask(struct worker *worker);

/* Worker: answers what was asked, if there is something. Returns whether there was. */
bool worker_serve(struct worker *worker);
