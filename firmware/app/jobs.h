/* The jobs of the second processor. A stage that has one asks by worker/worker.h, and gets the answer in a later call
 * or a later frame. Jobs are done in the order of enum job. While there is no second processor the first serves
 * them itself, after the frame's packets, or before them where a stage waits: the answers have the same bits. */
#pragma once

#include "worker/worker.h"

#include <stdbool.h>
#include <stdint.h>

enum job {
  JOB_TANGENTIAL, /* first, because its frame may wait for it */
  JOB_SHAPES,
  JOBS,
};

struct jobs {
  struct worker worker[JOBS];
  bool has_processor;         /* the second processor runs them */
  uint32_t starts;            /* of the processor so far: with each one all questions are forgotten */
  uint64_t frame_us;          /* time of the frame under way */
  uint64_t interval_us;       /* between it and the frame before */
  uint64_t short_interval_us; /* the shorter of the last two intervals, so that one pause does not count */
};

/* Before jobs_start: what does this job. */
void jobs_set(struct jobs *jobs, enum job job, void (*work)(void *context), void *context);

/* Starts the second processor, whatever it did before. All jobs are free. */
void jobs_start(struct jobs *jobs);

/* Each frame: sets the intervals. */
void jobs_begin_frame(struct jobs *jobs, uint64_t t_us);

/* Ends what is under way: all jobs are free. */
void jobs_cancel(struct jobs *jobs);

static inline bool jobs_is_free(const struct jobs *jobs, enum job job) { return worker_is_free(&jobs->worker[job]); }

/* Does this job here if there is no second processor. */
static inline void jobs_run_here(struct jobs *jobs, enum job job) {
  if (!jobs->has_processor) {
    worker_serve(&jobs->worker[job]);
  }
}
