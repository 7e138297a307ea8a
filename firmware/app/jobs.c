#include "app/jobs.h"

#include "port/port.h"

static bool serve(void *context) {
  struct jobs *jobs = context;
  return worker_serve(&jobs->worker[JOB_TANGENTIAL]) || worker_serve(&jobs->worker[JOB_SHAPES]);
}

void jobs_set(struct jobs *jobs, enum job job, void (*work)(void *context), void *context) {
  worker_init(&jobs->worker[job], work, context);
}

void jobs_start(struct jobs *jobs) {
  port_worker_stop();
  for (unsigned i = 0; i < JOBS; i++) {
    worker_init(&jobs->worker[i], jobs->worker[i].work, jobs->worker[i].job);
  }
  jobs->starts++;
  jobs->has_processor = port_worker_start(serve, jobs);
}

void jobs_begin_frame(struct jobs *jobs, uint64_t t_us) {
  const uint64_t interval_us = t_us - jobs->frame_us;
  jobs->short_interval_us = interval_us < jobs->interval_us ? interval_us : jobs->interval_us;
  jobs->interval_us = interval_us;
  jobs->frame_us = t_us;
}

void jobs_cancel(struct jobs *jobs) {
  if (!jobs_is_free(jobs, JOB_TANGENTIAL) || !jobs_is_free(jobs, JOB_SHAPES)) {
    jobs_start(jobs);
  }
}
