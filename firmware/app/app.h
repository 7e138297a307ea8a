/* The fingertip: frames in, packets out, commands obeyed. Everything below it is wired here and
 * only here, as far as this build has it (config/capabilities.h).
 *
 * One instance per image, static. The board's main installs an event handler (port.h) that calls
 * app_on_event, calls app_start once and then app_run for ever.
 */
#ifndef APP_APP_H
#define APP_APP_H

#include "array_bus/array_bus.h"
#include "condition/condition.h"
#include "condition/rest.h"
#include "config/capabilities.h"
#include "contact/contact.h"
#include "contact/motion.h"
#include "contact/shapes.h"
#include "contact/tangential.h"
#include "fit/fit.h"
#include "fit/fit_doubt.h"
#include "fit/fit_gains.h"
#include "fit/fit_tangential.h"
#include "port/sync.h"
#include "scan/scan.h"
#include "store/store.h"
#include "wire/packet.h"
#include "worker/worker.h"

#include <stdbool.h>
#include <stdint.h>

struct app {
  struct scan scan; /* shared with the event context under scan's own rules; the rest is main's */
  struct condition condition;
#if FT_WITH_FIT
  struct fit_array fit_array;
  struct fit_settings fit_settings;
  struct fit_own own[FT_MAX_SENSORS]; /* of the calibration that acts */
  struct fit_watch fit_watch;         /* of the contact under way */
  uint32_t fit_frame_us;              /* the last frame's time */
  uint32_t fit_failures;
  float set_sigma_mm, set_sigma_sd_mm;   /* to expect of a contact; sd 0: as the calibration says */
  const struct calibration *calibration; /* that acts; NULL: none */
  struct condition_gains gains;          /* of it */
  struct contact_settings contact_settings;
#endif
#if FT_WITH_TANGENTIAL
  const struct pad_profile *pad;                  /* that acts; NULL: none */
  struct tangential_settings tangential_settings; /* of it and the calibration */
  struct worker worker;                           /* of the job below */
  struct tangential_job tangential_job;
  bool has_worker;         /* a processor of its own; else the main loop serves itself */
  bool waits_for_load;     /* in this frame; else the next one takes its answer */
  bool load_is_asked;      /* and not answered yet */
  bool tangential_is_late; /* in this frame */
  uint64_t load_asked_us;
  uint32_t load_limit_us; /* it is waited for so long after that */
  struct {                /* what it is about, which the frames that follow leave alone */
    int32_t pressure_Pa_q10[FT_MAX_SENSORS];
    struct fit_settings settings;
    struct fit_result fit;
  } load_of;
  struct fit_tangential estimate; /* the answer, moved to this frame */
  bool tangential_follows;        /* the question before was of the same contact and pad */
  struct worker shapes_worker;    /* of the job below: the same processor, after the other job */
  struct shapes_job shapes_job;
  bool shapes_act;             /* the profile is one that they know */
  bool shapes_begin;           /* what is asked next is of another contact or pad */
  struct shapes_report shapes; /* of the contact under way */
  uint64_t worked_us;          /* the last frame's time */
  uint64_t worked_apart_us;    /* between it and the one before */
  struct tangential_history tangential_history;
  struct motion_history motion_history;
#endif
#if FT_WITH_TANGENTIAL_DOUBT
  struct fit_doubt load_doubt;
  struct fit_gains learnt_gains; /* while no calibration acts */
  bool gains_due;                /* of this contact, between two looks */
  uint32_t load_frame_us;        /* the last frame's time */
#endif
#if FT_WITH_SLIP
  struct slip_history slip_history;
#endif
  struct wire_receiver receiver;
  struct store store;
  struct wire_ack owed; /* for what is being stored; .command 0: none */

  /* The frame under way. */
  struct frame frame;
  struct conditioned conditioned;
#if FT_WITH_FIT
  struct fit_result fit;
  struct contact_force force;
#endif
#if FT_WITH_TANGENTIAL
  const struct fit_tangential *tangential; /* NULL: not estimated; else app->estimate */
  struct tangential_load load;
  struct shapes_place place; /* of the packet */
  struct motion motion;
#endif
  struct contact_result contact;
  struct wire_packet packet;                         /* in or out, one at a time */
  _Alignas(4) uint8_t out[WIRE_MAX_FRAME_BYTES + 3]; /* filled up to whole words */

  uint8_t streams; /* enum wire_stream */
  uint16_t sequence;
  uint32_t news;        /* of the port, when last looked at */
  uint32_t close_count; /* the same */
  bool active;          /* the last round had something to do, so there may be more */
  bool reads_below;     /* in the last frame a sensor was below its zero */
  bool saves_power;
  uint64_t saving_since_us; /* if .saves_power */
  uint16_t osr;
  uint32_t rate_mHz;

  uint32_t packets_sent, packets_dropped;
  uint32_t commands_done, commands_rejected;

  /* Set by the event context from time to time, so that the main loop looks at the clock. */
  _Atomic uint32_t tick;
  _Atomic uint32_t tick_interval_us;
  uint64_t next_tick_us; /* event context only */

  /* Over the second under way, and the one before. */
  uint32_t uptime_s, uptime_rest_us;
  uint64_t second_began_us;
  uint64_t idle_since_us; /* unless .active */
  uint64_t asleep_us;
  uint32_t frames_at_second;
  uint32_t measured_rate_mHz;
  uint16_t cpu_busy_permille;

  /* Of the scan, when last looked at for the record of a crash. */
  struct {
    uint32_t timeouts, skipped, present;
  } noted;

  uint64_t loader_at_us; /* 0: no reboot is planned */

#if FT_WITH_FIT
  struct rest rest;
#endif
#if FT_WITH_SYNC
  struct {
    uint8_t mode; /* enum port_sync, as it is set */
    bool paused;
    uint64_t looked_us;            /* at the edges */
    _Atomic uint32_t shows_frames; /* for the event context */
  } sync;
#endif
};

/* Starts the pipeline on this bus, which must outlive it. Attaches to USB. */
void app_start(struct app *app, const struct array_bus *bus);

/* Event context: moves the scan on and arms the next alarm. */
void app_on_event(struct app *app);

/* Interprets app->frame and sends what the open streams ask for; app->fit and app->contact keep it,
 * and app->packet the last packet. A held frame brings nothing to interpret: what was found in the
 * frame before goes out again. app_run calls it with the time at which it took the frame; so may a
 * host that has frames of its own. */
void app_process_frame(struct app *app, uint64_t taken_us);

/* One round of the main loop: does what is due, or sleeps until something happens. */
void app_run(struct app *app);

#endif
