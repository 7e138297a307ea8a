/* What presses, from sensors to packets: one contact, a pulled one, a long one, two, and what is
 * none of these, on the pad that the profile describes. */
#include "app_rig.h"
#include "common/contact_flags.h"
#include "support/pad.h"

#define PRESS_us 1500000u
#define OBJECTS_MAX 40

static struct object { double x_mm, y_mm, force_N; } objects[OBJECTS_MAX];
static unsigned object_count;
static double load_qx_N;
static uint64_t ends_us; /* 0: never */

static const uint32_t SHAPES = CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_TWO_CONTACTS | CONTACT_FLAG_EDGE | CONTACT_FLAG_SHAPE_UNKNOWN;

/* x and y count from the middle of the pad. */
static double field_Pa(double x_mm, double y_mm, uint64_t t_us) {
  const struct pad_profile pad = pad_of_12_mm();
  double sum_Pa = 0.0;
  const bool is_away = ends_us != 0 && t_us >= ends_us && t_us < ends_us + 100000;
  for (unsigned i = 0; i < object_count && !is_away; i++) {
    const struct object *object = &objects[i];
    sum_Pa += pad_pressure_Pa(&pad, 4.0, x_mm - object->x_mm, y_mm - object->y_mm, (struct pad_load){object->force_N, load_qx_N, 0.0});
  }
  return sum_Pa;
}

static void put(double x_mm, double y_mm, double force_N) { objects[object_count++] = (struct object){x_mm, y_mm, force_N}; }

void setUp(void) {
  rig_start();
  world_field_Pa = field_Pa;
  press.force_N = 1.0; /* it stands where the objects count from */
  press.from_us = PRESS_us;
  object_count = 0;
  load_qx_N = 0.0;
  ends_us = 0;
}

void tearDown(void) {
  rig_end();
  native_set_worker(false, 0);
}

/* Until this time, frames as fast as they come, on a calibrated pad with this profile. */
static void run_until(uint64_t t_us, const struct pad_profile *profile) {
  connect_for(300);
  const struct wire_packet osr = {.type = WIRE_CMD_OSR, .body.cmd_osr = {256}};
  obey(osr);
  const struct wire_packet pad = {.type = WIRE_CMD_PAD, .body.cmd_pad = {*profile}};
  obey(pad);
  obey(calibrate_command((struct calibration){.placements = 20, .force_scale = 1.25f}));
  start_streams(WIRE_STREAM_CONTACT);
  run_for((uint32_t)((t_us - port_now_us()) / 1000));
}

enum { FRAMES_MAX = 600 };
static struct wire_contact contacts[FRAMES_MAX];

/* Contact packets of the press, and no more than the last of it. */
static unsigned take_contacts(struct wire_contact *to) {
  unsigned count = 0;
  struct wire_packet packet;
  while (next_packet(&packet) && count < FRAMES_MAX) {
    if (packet.type == WIRE_CONTACT && packet.body.contact.flags & CONTACT_FLAG_FIT_VALID) {
      to[count++] = packet.body.contact;
    }
  }
  TEST_ASSERT_GREATER_THAN(30, count);
  return count;
}

/* The contacts of a press of this time: how many. */
static unsigned press_for(uint32_t us) {
  const struct pad_profile profile = pad_of_12_mm();
  run_until(PRESS_us + us, &profile);
  return take_contacts(contacts);
}

static struct wire_contact last_of_press(void) { return contacts[press_for(250000) - 1]; }

static float scale(void) { return 1.25f * pad_of_12_mm().force_ratio; }

TEST(two_contacts_have_their_places_and_forces) {
  put(1.0, 7.0, 3.0);
  put(-2.0, -7.0, 6.0);
  const struct wire_contact contact = last_of_press();
  TEST_ASSERT_BITS(SHAPES, CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_TWO_CONTACTS, contact.flags);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_VELOCITY_VALID, contact.flags);
  TEST_ASSERT_FLOAT_WITHIN(0.4f, -2.0f, contact.x1_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.4f, -7.0f, contact.y1_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.4f, scale() * 6.0f, contact.force1_N);
  TEST_ASSERT_FLOAT_WITHIN(0.4f, 1.0f, contact.x2_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.4f, 7.0f, contact.y2_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.4f, scale() * 3.0f, contact.force2_N);
  TEST_ASSERT_TRUE(contact.location1_sd_mm > 0.01f && contact.location1_sd_mm < 0.6f);
  TEST_ASSERT_TRUE(contact.location2_sd_mm > contact.location1_sd_mm);
  TEST_ASSERT_TRUE(contact.force1_sd_N > 0.0f && contact.force2_sd_N > 0.0f);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, contact.edge_length_mm);
  TEST_ASSERT_EQUAL_FLOAT(app.found.fit.x_mm, contact.x_mm);
}

TEST(a_long_contact_has_its_direction) {
  for (int turn = -1; turn <= 1; turn++) {
    tearDown();
    setUp();
    const double angle = turn * 65.0 * PI / 180.0;
    for (int i = 0; i < OBJECTS_MAX; i++) {
      double at = 20.0 * ((i + 0.5) / OBJECTS_MAX - 0.5);
      put(at * cos(angle), at * sin(angle), 8.0 / OBJECTS_MAX);
    }
    const struct wire_contact contact = last_of_press();
    TEST_ASSERT_BITS(SHAPES, CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_EDGE, contact.flags);
    TEST_ASSERT_FLOAT_WITHIN(2.0f, (float)(turn * 65), contact.edge_angle_deg);
    TEST_ASSERT_TRUE(contact.edge_angle_sd_deg > 0.05f && contact.edge_angle_sd_deg < 8.0f);
    TEST_ASSERT_FLOAT_WITHIN(2.0f, 20.0f, contact.edge_length_mm);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, contact.force1_N);
  }
}

/* Partly beyond the sensors, where the Gaussian is off. */
TEST(a_long_contact_doubts_its_place_by_what_its_line_has) {
  for (int i = 0; i < OBJECTS_MAX; i++) {
    double at = 20.0 * ((i + 0.5) / OBJECTS_MAX - 0.5);
    put(5.0 + 0.8 * at, -13.0 + 0.6 * at, 8.0 / OBJECTS_MAX);
  }
  const struct wire_contact contact = last_of_press();
  TEST_ASSERT_BITS(SHAPES | CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_UNCERTAIN,
                   CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_EDGE | CONTACT_FLAG_UNCERTAIN, contact.flags);
  const float off_mm = hypotf(contact.x_mm - 5.0f, contact.y_mm + 13.0f);
  TEST_ASSERT_EQUAL_FLOAT(app.found.fit.x_mm, contact.x_mm);
  TEST_ASSERT_EQUAL_FLOAT(app.found.fit.y_mm, contact.y_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.4f, 5.0f, app.found.fit.x_mm + app.stages.shapes.report.from_fit_x_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.4f, -13.0f, app.found.fit.y_mm + app.stages.shapes.report.from_fit_y_mm);
  TEST_ASSERT_TRUE(contact.location_sd_mm > 0.7f * off_mm);
  TEST_ASSERT_TRUE(contact.location_sd_mm > hypotf(app.stages.shapes.report.from_fit_x_mm, app.stages.shapes.report.from_fit_y_mm));
}

/* Noise makes one pull of six look like a short line (two.json: round, Q/F 0.3). */
TEST(one_contact_is_one_with_a_load_or_without) {
  for (int pulled = 0; pulled < 2; pulled++) {
    tearDown();
    setUp();
    put(1.5, -4.0, 5.0);
    load_qx_N = pulled ? 1.5 : 0.0;
    const unsigned count = press_for(250000);
    unsigned valid = 0, lines = 0;
    for (unsigned i = 0; i < count; i++) {
      valid += (contacts[i].flags & CONTACT_FLAG_SHAPE_VALID) != 0;
      lines += (contacts[i].flags & CONTACT_FLAG_EDGE) != 0;
      TEST_ASSERT_BITS_LOW(CONTACT_FLAG_TWO_CONTACTS | CONTACT_FLAG_SHAPE_UNKNOWN, contacts[i].flags);
      TEST_ASSERT_EQUAL_FLOAT(0.0f, contacts[i].force1_N);
    }
    TEST_ASSERT_GREATER_THAN(count / 3, valid);
    TEST_ASSERT_LESS_OR_EQUAL(pulled ? valid / 4 : 0, lines);
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_TANGENTIAL_VALID, contacts[count - 1].flags);
  }
  /* A load that is estimated all the same is none of two contacts. */
  app.stages.shapes.job.report.shape = FIT_SHAPE_TWO;
  app.found.frame.t_us += 3700;
  app_process_frame(&app, app.found.frame.t_read_us);
  TEST_ASSERT_TRUE(app.stages.tangential.job.estimate.valid);
  TEST_ASSERT_BITS(SHAPES | CONTACT_FLAG_TANGENTIAL_VALID, CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_TWO_CONTACTS, app.found.contact.flags);
}

TEST(what_is_none_of_these_is_warned_of_all_the_time) {
  put(7.0, -14.0, 4.0);
  put(-7.0, 0.0, 4.0);
  put(7.0, 14.0, 4.0);
  const unsigned count = press_for(250000);
  unsigned first = 0;
  while (first < count && !(contacts[first].flags & CONTACT_FLAG_SHAPE_VALID)) {
    first++;
  }
  TEST_ASSERT_LESS_THAN(count / 2, first);
  for (unsigned i = first; i < count; i++) {
    TEST_ASSERT_BITS(SHAPES, CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_SHAPE_UNKNOWN, contacts[i].flags);
  }
}

/* Frames that come fast keep what a search for an outlier found; slow ones have time for their own. */
TEST(a_search_for_an_outlier_is_of_fast_frames) {
  put(1.5, -4.0, 5.0);
  last_of_press();
  app.stages.location.outliers = (struct fit_outlier_state){.usable = app.found.conditioned.usable,
                                                            .outlier = 1,
                                                            .frames = 9,
                                                            .residual_rms_Pa = app.found.fit.residual_rms_Pa,
                                                            .force_N = app.found.fit.force_N};
  app.found.frame.t_us += 765;
  app_process_frame(&app, app.found.frame.t_read_us);
  TEST_ASSERT_EQUAL(8, app.stages.location.outliers.frames);
  TEST_ASSERT_EQUAL_HEX32(app.found.conditioned.usable & ~UINT32_C(1), app.found.fit.used);
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SENSOR_MASKED, app.found.contact.flags);
  app.found.frame.t_us += 3700;
  app_process_frame(&app, app.found.frame.t_read_us);
  TEST_ASSERT_EQUAL_HEX32(app.found.conditioned.usable, app.found.fit.used);
  TEST_ASSERT_EQUAL(0, app.stages.location.outliers.outlier);
}

/* All of them would keep the load of a frame that comes early waiting for twenty frames. */
TEST(shapes_give_way_to_the_load_after_each_part) {
  put(1.5, -4.0, 5.0);
  last_of_press();
  struct shapes_job *job = &app.stages.shapes.job;
  job->question.begins = true;
  job->question.parts = FIT_SHAPES_FRAMES * FIT_SHAPES_PARTS;
  worker_ask(&app.stages.jobs.worker[JOB_TANGENTIAL]);
  shapes_estimate(job);
  TEST_ASSERT_EQUAL(FIT_SHAPES_UNFINISHED, job->progress);
  TEST_ASSERT_EQUAL(1, job->state.part);
}

/* Here each frame has time for several frames' worth of parts. */
TEST(each_answer_says_how_old_it_is) {
  put(0.0, 8.0, 4.0);
  put(0.0, -8.0, 4.0);
  const unsigned count = press_for(250000);
  const float frame_ms = 0.25f * 1000.0f / (float)count;
  unsigned without = 0;
  for (unsigned i = 0; i < count; i++) {
    const struct wire_contact *contact = &contacts[i];
    if (!(contact->flags & CONTACT_FLAG_SHAPE_VALID)) {
      TEST_ASSERT_EQUAL(i, without);
      TEST_ASSERT_EQUAL_FLOAT(0.0f, contact->shape_age_ms);
      TEST_ASSERT_EQUAL_FLOAT(0.0f, contact->x1_mm);
      without++;
      continue;
    }
    /* Every other frame answers. */
    TEST_ASSERT_FLOAT_WITHIN(1.6f * frame_ms, 2.1f * frame_ms, contact->shape_age_ms);
  }
  const unsigned at_once = shapes_parts((uint64_t)(1000.0f * frame_ms)) / FIT_SHAPES_PARTS;
  TEST_ASSERT_GREATER_THAN(1, at_once);
  TEST_ASSERT_GREATER_OR_EQUAL(FIT_SHAPES_FRAMES / at_once, without);
  TEST_ASSERT_LESS_THAN(2 * FIT_SHAPES_FRAMES / at_once, without);
}

/* The next contact is not called what the one before was. */
TEST(a_contact_that_ends_is_forgotten) {
  put(0.0, 8.0, 4.0);
  put(0.0, -8.0, 4.0);
  ends_us = PRESS_us + 150000;
  const struct pad_profile profile = pad_of_12_mm();
  run_until(ends_us + 20000, &profile);
  take_contacts(contacts);
  TEST_ASSERT_EQUAL(FIT_SHAPE_TWO, app.stages.shapes.job.report.shape);
  object_count = 0;
  put(1.0, 2.0, 5.0);
  run_for(230);
  const unsigned count = take_contacts(contacts);
  for (unsigned i = 0; i < count; i++) {
    TEST_ASSERT_BITS_LOW(CONTACT_FLAG_TWO_CONTACTS, contacts[i].flags);
  }
  TEST_ASSERT_BITS_LOW(SHAPES, contacts[0].flags);
  TEST_ASSERT_BITS(SHAPES, CONTACT_FLAG_SHAPE_VALID, contacts[count - 1].flags);
}

TEST(rubber_that_is_too_thin_has_no_shapes) {
  put(0.0, 8.0, 4.0);
  put(0.0, -8.0, 4.0);
  struct pad_profile thin = pad_of_12_mm();
  thin.thickness_mm *= 0.5f;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    thin.normal[j].sd_mm *= 0.5f;
  }
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    thin.tangential[j].sd_mm *= 0.5f;
    thin.tangential[j].moment_mm *= 0.5f;
  }
  run_until(PRESS_us + 150000, &thin);
  const unsigned count = take_contacts(contacts);
  for (unsigned i = 0; i < count; i++) {
    TEST_ASSERT_BITS_LOW(SHAPES, contacts[i].flags);
  }
}

TEST(a_second_processor_gives_the_same_answers) {
  static struct wire_contact two[FRAMES_MAX];
  const struct pad_profile profile = pad_of_12_mm();
  for (int pulled = 0; pulled < 2; pulled++) {
    unsigned counts[2];
    const uint32_t takes_us = TANGENTIAL_TIMEOUT_us / (pulled ? 2 : 4);
    for (int processors = 1; processors <= 2; processors++) {
      tearDown();
      native_set_worker(processors == 2, takes_us);
      setUp();
      put(1.0, 7.0, 3.0);
      if (!pulled) {
        put(-2.0, -7.0, 6.0);
      }
      load_qx_N = pulled * 1.2;
      run_until(PRESS_us + 250000, &profile);
      counts[processors - 1] = take_contacts(processors == 1 ? contacts : two);
      TEST_ASSERT_EQUAL(processors == 2, app.stages.jobs.has_processor);
    }
    TEST_ASSERT_EQUAL(1, native_worker_starts());
    TEST_ASSERT_EQUAL(counts[0], counts[1]);
    for (unsigned i = 0; i < counts[0]; i++) {
      TEST_ASSERT_TRUE(!pulled || two[i].flags & CONTACT_FLAG_HELD || two[i].stages.fit_us >= takes_us);
      two[i].stages = contacts[i].stages;
      TEST_ASSERT_EQUAL_MEMORY(&contacts[i], &two[i], sizeof two[i]);
    }
    TEST_ASSERT_BITS_HIGH(pulled ? CONTACT_FLAG_TANGENTIAL_VALID : CONTACT_FLAG_TWO_CONTACTS, two[counts[1] - 1].flags);
  }
}

TEST(without_an_answer_frames_go_out_with_the_fit_and_say_so) {
  tearDown();
  native_set_worker(true, UINT64_MAX);
  setUp();
  put(0.0, 8.0, 4.0);
  put(0.0, -8.0, 4.0);
  const unsigned count = press_for(150000);
  for (unsigned i = 0; i < count; i++) {
    TEST_ASSERT_BITS(SHAPES | CONTACT_FLAG_TANGENTIAL_LATE | CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_FIT_VALID,
                     CONTACT_FLAG_TANGENTIAL_LATE | CONTACT_FLAG_FIT_VALID, contacts[i].flags);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, contacts[i].qx_N);
  }
  TEST_ASSERT_EQUAL_FLOAT(app.found.fit.x_mm, contacts[count - 1].x_mm);
  uint8_t detail;
  TEST_ASSERT_EQUAL(CRASH_EVENT_WORKER, native_last_event(&detail));
  TEST_ASSERT_GREATER_OR_EQUAL(count, native_worker_starts());
}
