/* The job that the main loop and a worker on a processor of its own hand to each other. Each in turn is the one that is
 * interrupted, at every access to what both know, by whole steps of the other. */
#include "explore.h"
#include "support/unit.h"
#include "worker/worker.h"

#include <string.h>

enum { WORDS = 12, QUESTIONS = 3 };

static struct { uint32_t question[WORDS], answer[WORDS]; } job;
static struct worker worker;
static uint32_t asked, answered; /* as the main loop counts them */
static uint32_t worked;

/* In pieces, with a point before each (explore.c). */
static void copy(uint32_t to[WORDS], const uint32_t from[WORDS]) {
  void *(*volatile copy_words)(void *, const void *, size_t) = memcpy;
  copy_words(to, from, WORDS * sizeof *to);
}

static void work(void *context) {
  TEST_ASSERT_EQUAL_PTR(&job, context);
  copy(job.answer, job.question);
  worked++;
}

static void set_up(void) {
  worker_init(&worker, work, &job);
  memset(&job, 0, sizeof job);
  asked = answered = worked = 0;
}

static void judge_answer(void) {
  uint32_t answer[WORDS];
  copy(answer, job.answer);
  for (int i = 1; i < WORDS; i++) {
    TEST_ASSERT_EQUAL_MESSAGE(answer[0], answer[i], "a torn answer");
  }
  TEST_ASSERT_EQUAL_MESSAGE(asked, answer[0], "an answer is lost, or to another question");
  answered++;
}

static void ask_next(void) {
  uint32_t question[WORDS];
  asked++;
  for (int i = 0; i < WORDS; i++) {
    question[i] = asked;
  }
  copy(job.question, question);
  worker_ask(&worker);
}

static void take_answer(void) {
  if (asked != answered && worker_is_free(&worker)) {
    judge_answer();
  }
}

static void main_step(void) {
  take_answer();
  if (asked == answered && asked < QUESTIONS) {
    ask_next();
  }
}

static void serve(void) { worker_serve(&worker); }

static void judge_end(void) {
  for (int i = 0; i < 2 * QUESTIONS; i++) {
    serve();
    main_step();
  }
  TEST_ASSERT_EQUAL_MESSAGE(QUESTIONS, answered, "a question is lost");
  TEST_ASSERT_EQUAL_MESSAGE(QUESTIONS, worked, "a question was answered twice, or lost");
}

static void main_goes_on(void) {
  explore_begin();
  for (int i = 0; i < 4; i++) {
    main_step();
  }
  explore_end();
  judge_end();
}

static void worker_goes_on(void) {
  explore_begin();
  for (int i = 0; i < 4; i++) {
    serve();
  }
  explore_end();
  judge_end();
}

static void explore_and_tell(const char *who, void (*run)(void), void (*other)(void)) {
  const struct explore_interrupt interrupts[] = {{other, 1, 4}};
  unsigned long points;
  set_up();
  unsigned long runs = explore(run, interrupts, 1, 4, &points);
  printf("%s interrupted: %lu runs, %lu points\n", who, runs, points);
  TEST_ASSERT_GREATER_THAN(1000, runs);
}

TEST(test_answers_are_whole_wherever_the_worker_comes) { explore_and_tell("main loop", main_goes_on, serve); }

TEST(test_answers_are_whole_wherever_the_main_loop_comes) { explore_and_tell("worker", worker_goes_on, main_step); }
