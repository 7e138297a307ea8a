#include "worker/worker.h"

static uint32_t own(const _Atomic uint32_t *count) { return atomic_load_explicit(count, memory_order_relaxed); }

/* What the other has done to the job before it counted is there. */
static uint32_t of_other(const _Atomic uint32_t *count) { return atomic_load_explicit(count, memory_order_acquire); }

static void hand_over(_Atomic uint32_t *count) { atomic_store_explicit(count, own(count) + 1, memory_order_release); }

void worker_init(struct worker *worker, void (*work)(void *job), void *job) {
  worker->work = work;
  worker->job = job;
  atomic_store_explicit(&worker->asked, 0, memory_order_relaxed);
  atomic_store_explicit(&worker->answered, 0, memory_order_relaxed);
}

bool worker_is_free(const struct worker *worker) { return of_other(&worker->answered) == own(&worker->asked); }

void worker_ask(struct worker *worker) { hand_over(&worker->asked); }

bool worker_serve(struct worker *worker) {
  if (of_other(&worker->asked) == own(&worker->answered)) {
    return false;
  }
  worker->work(worker->job);
  hand_over(&worker->answered);
  return true;
}
