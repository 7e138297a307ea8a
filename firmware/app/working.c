#include "app/working.h"

#include "port/port.h"

#include <string.h>

/* A force that changes by more from one frame to the next is another contact's. */
#define LEAST_SHARE 0.5f

#if FT_WITH_TANGENTIAL
/* The load first: its frame waits for it. */
static bool serve(void *context) {
  struct app *app = context;
  return worker_serve(&app->worker) || worker_serve(&app->shapes_worker);
}

void working_start(struct app *app) {
  port_worker_stop();
  worker_init(&app->worker, tangential_estimate, &app->tangential_job);
  worker_init(&app->shapes_worker, shapes_estimate, &app->shapes_job);
  app->load_is_asked = false;
  app->tangential_follows = false;
  app->shapes_begin = true;
  app->has_worker = port_worker_start(serve, app);
}

/* Whether there is one. The processor sleeps meanwhile. */
static bool wait_for_answer(struct app *app) {
  const uint64_t began_us = port_now_us();
  uint64_t now_us = began_us;
  while (!worker_is_free(&app->worker) && now_us - app->load_asked_us < app->load_limit_us) {
    port_sleep();
    now_us = port_now_us();
  }
  app->asleep_us += now_us - began_us;
  return worker_is_free(&app->worker);
}

static void set_question(struct app *app, struct shapes_question *question) {
  question->begins = app->shapes_begin;
  question->t_us = app->frame.t_us;
  memcpy(question->pressure_Pa_q10, app->conditioned.pressure_Pa_q10, sizeof question->pressure_Pa_q10);
  question->settings = app->fit_settings;
  question->fit = app->fit;
  question->force_scale = app->tangential_settings.force_scale;
  question->force_scale_sd = app->tangential_settings.force_scale_sd;
}

/* Takes what is known of what presses, and asks for more. What was asked of another contact or pad
 * is no answer. */
static void ask_for_shapes(struct app *app, uint64_t apart_us) {
  struct shapes_job *job = &app->shapes_job;
  const bool asks = app->shapes_act && app->conditioned.contact;
  if (!asks || app->shapes_begin) {
    app->shapes_begin = true;
    memset(&app->shapes, 0, sizeof app->shapes);
  }
  if (!asks || !worker_is_free(&app->shapes_worker)) {
    return;
  }
  if (app->shapes_begin) {
    memset(&job->report, 0, sizeof job->report);
    job->progress = FIT_SHAPES_STEPPED;
  }
  app->shapes = job->report;
  if (job->progress == FIT_SHAPES_UNFINISHED) {
    job->question.begins = false;
  } else {
    set_question(app, &job->question);
  }
  job->question.parts = shapes_parts(apart_us);
  app->shapes_begin = false;
  worker_ask(&app->shapes_worker);
}

static void ask_for_load(struct app *app) {
  const uint64_t last_us = app->tangential_job.question.t_us;
  const bool slow = app->frame.t_us - last_us >= TANGENTIAL_SLOW_us;
  app->load_limit_us = (slow ? TANGENTIAL_SLOW_LATE_us : TANGENTIAL_LATE_us) +
                       (worker_is_free(&app->shapes_worker) ? 0 : SHAPES_PART_us);
  memcpy(app->load_of.pressure_Pa_q10, app->conditioned.pressure_Pa_q10, sizeof app->load_of.pressure_Pa_q10);
  app->load_of.settings = app->fit_settings;
  app->load_of.fit = app->fit;
  app->tangential_job.question = (struct tangential_question){
      .begins = !app->tangential_follows,
      .saturated = app->frame.saturated,
      .t_us = app->frame.t_us,
      .pressure_Pa_q10 = app->load_of.pressure_Pa_q10,
      .settings = &app->load_of.settings,
      .fit = &app->load_of.fit,
  };
  worker_ask(&app->worker);
  port_worker_wake();
  app->load_asked_us = port_now_us();
  app->load_is_asked = true;
}

/* The answer is of the frame that was asked about: since then the contact has moved, and its force
 * has changed, as the Gaussian says. */
static void take_answer(struct app *app) {
  struct fit_tangential *found = &app->estimate;
  const struct fit_result *then = &app->load_of.fit, *now = &app->fit;
  *found = app->tangential_job.estimate;
  app->tangential = found;
  if (!found->valid || app->waits_for_load) {
    return;
  }
  const float share = then->force_N > 0.0f ? now->force_N / then->force_N : 0.0f;
  if (!tangential_is_worthwhile(now, app->frame.saturated) || share < LEAST_SHARE || share > 1.0f / LEAST_SHARE) {
    memset(found, 0, sizeof *found);
    return;
  }
  found->x_mm += now->x_mm - then->x_mm;
  found->y_mm += now->y_mm - then->y_mm;
  found->force_N *= share;
  found->force_sd_N *= share;
  found->qx_N *= share;
  found->qy_N *= share;
  found->q_sd_N *= share;
}

/* Whether what was asked is answered; if not, the worker is started again. */
static bool is_answered(struct app *app) {
  app->load_is_asked = false;
  if (app->has_worker ? wait_for_answer(app) : worker_is_free(&app->worker)) {
    return true;
  }
  port_event(CRASH_EVENT_WORKER, 0);
  working_start(app);
  return false;
}

void working_ask(struct app *app) {
  const bool asks = app->pad && app->conditioned.contact;
  const uint64_t apart_us = app->frame.t_us - app->worked_us;
  /* One long pause does not make the frames slow. */
  const uint64_t pace_us = apart_us < app->worked_apart_us ? apart_us : app->worked_apart_us;
  app->waits_for_load = asks && pace_us >= TANGENTIAL_BESIDE_us;
  app->tangential = NULL;
  app->tangential_is_late = false;
  if (app->load_is_asked && !is_answered(app)) {
    app->tangential_is_late = asks;
  } else if (asks && app->tangential_follows && !app->waits_for_load && apart_us < TANGENTIAL_SLOW_us) {
    take_answer(app);
  }
  if (asks) {
    ask_for_load(app);
  }
  app->tangential_follows = asks;
  ask_for_shapes(app, pace_us);
  app->worked_us = app->frame.t_us;
  app->worked_apart_us = apart_us;
}

void working_wait(struct app *app) {
  if (app->waits_for_load) {
    if (!app->has_worker) {
      worker_serve(&app->worker);
    }
    if (is_answered(app)) {
      take_answer(app);
    } else {
      app->tangential_is_late = true;
    }
  }
  if (app->shapes.shape == FIT_SHAPE_TWO) {
    app->tangential = NULL;
  }
}

void working_follow(struct app *app) {
  if (!app->has_worker) {
    worker_serve(&app->worker);
    worker_serve(&app->shapes_worker);
  }
}

void working_forget(struct app *app) {
  if (!worker_is_free(&app->worker) || !worker_is_free(&app->shapes_worker)) {
    working_start(app);
  }
  app->load_is_asked = false;
  app->tangential_follows = false;
  app->shapes_begin = true;
}
#endif
