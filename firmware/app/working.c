#include "app/working.h"

#include "app/acting.h"
#include "port/port.h"

#include <string.h>

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
  app->tangential_follows = false;
  app->shapes_begin = true;
  app->has_worker = port_worker_start(serve, app);
}

/* Whether there is one. The processor sleeps meanwhile. */
static bool wait_for_answer(struct app *app, uint32_t limit_us) {
  const uint64_t asked_us = port_now_us();
  uint64_t now_us = asked_us;
  while (!worker_is_free(&app->worker) && now_us - asked_us < limit_us) {
    port_sleep();
    now_us = port_now_us();
  }
  app->asleep_us += now_us - asked_us;
  return worker_is_free(&app->worker);
}

static void set_question(struct app *app, struct shapes_question *question) {
  question->begins = app->shapes_begin;
  question->t_us = app->frame.t_us;
  memcpy(question->pressure_Pa_q10, app->conditioned.pressure_Pa_q10,
         sizeof question->pressure_Pa_q10);
  question->settings = app->fit_settings;
  app_set_dip(app, &question->settings);
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

/* Whether the load is estimated. */
static bool ask_for_load(struct app *app, uint64_t apart_us) {
  const uint64_t last_us = app->tangential_job.question.t_us;
  const bool slow = app->frame.t_us - last_us >= TANGENTIAL_SLOW_us;
  const uint32_t limit_us = (slow ? TANGENTIAL_SLOW_LATE_us : TANGENTIAL_LATE_us) +
                            (worker_is_free(&app->shapes_worker) ? 0 : SHAPES_PART_us);
  app->tangential_job.question = (struct tangential_question){
      .begins = !app->tangential_follows,
      .saturated = app->frame.saturated,
      .t_us = app->frame.t_us,
      .pressure_Pa_q10 = app->conditioned.pressure_Pa_q10,
      .settings = &app->fit_settings,
      .fit = &app->fit,
  };
  worker_ask(&app->worker);
  port_worker_wake();
  ask_for_shapes(app, apart_us);
  return app->has_worker ? wait_for_answer(app, limit_us) : worker_serve(&app->worker);
}

void working_estimate(struct app *app) {
  const bool asks = app->pad && app->conditioned.contact;
  const uint64_t apart_us = app->frame.t_us - app->worked_us;
  bool answered = false;
  if (asks) {
    /* One long pause does not make the frames slow. */
    answered = ask_for_load(app, apart_us < app->worked_apart_us ? apart_us : app->worked_apart_us);
    if (!answered) {
      port_event(CRASH_EVENT_WORKER, 0);
      working_start(app);
    }
  } else {
    ask_for_shapes(app, apart_us);
  }
  app->worked_us = app->frame.t_us;
  app->worked_apart_us = apart_us;
  app->tangential =
      answered && app->shapes.shape != FIT_SHAPE_TWO ? &app->tangential_job.estimate : NULL;
  app->tangential_is_late = asks && !answered;
  app->tangential_follows = answered;
}

void working_follow(struct app *app) {
  if (!app->has_worker) {
    worker_serve(&app->shapes_worker);
  }
}
#endif
