#include "scan_bench.h"

#include <string.h>

/* It is used once it has been seen to read like the others, and doubtful. */
TEST(test_prom_with_differing_crc_is_used_and_reported) {
  fake.prom[DISTURBED].word[0] ^= 0x3000;
  skip_frames(2);
  assert_entry(assert_admission(0, 3), FAKE_COMMAND, 0x54);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, scan_read_map(&scan.prom_bad));
  TEST_ASSERT_EQUAL_HEX32(ALL, scan_read_map(&scan.admitted));
  assert_good_frame(ALL & ~DISTURBED_BIT);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
  run_until(1700000);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, frame.doubtful);
  TEST_ASSERT_EQUAL_HEX32(0, frame.renewed);
  run_until(60000000);
  TEST_ASSERT_EQUAL_INT(1 + BRING_UP_RECHECKS, count_entries(0x1E, FAKE_COMMAND)); /* no more */
}

/* It may not be what it was to be cured of. */
TEST(test_who_did_not_hear_the_reset_is_not_admitted) {
  fake.answering = ALL & ~DISTURBED_BIT;
  while (count_entries(0x1E, FAKE_COMMAND) == 0 || fake.running) {
    step();
    if (count_entries(0xA0, FAKE_READ) > 0) {
      break;
    }
  }
  fake.answering = ALL;
  skip_frames(2);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, scan_read_map(&scan.admitted));
  run_until(2000000);
  TEST_ASSERT_EQUAL_HEX32(ALL, scan_read_map(&scan.admitted));
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
}

/* As where the line was disturbed in all of the first admission. */
TEST(test_prom_misread_in_a_whole_admission_is_read_again) {
  fake.misread_prom = DISTURBED_BIT;
  fake.misread_passes = 3;
  skip_frames(2);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, scan_read_map(&scan.prom_bad));
  run_until(3000000);
  TEST_ASSERT_EQUAL_HEX32(0, scan_read_map(&scan.prom_bad));
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
}

TEST(test_blank_prom_is_not_admitted_and_asked_ever_more_rarely) {
  memset(&fake.prom[DISTURBED], 0, sizeof fake.prom[DISTURBED]);
  run_until(32000000);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, scan_read_map(&scan.prom_bad));
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, scan_read_map(&scan.admitted));
  assert_good_frame(ALL & ~DISTURBED_BIT);
  static const uint64_t intervals_s[] = {1, 2, 4, 8, 8};
  int at = 0;
  assert_admission(at, 3);
  for (size_t i = 0; i < 5; i++) {
    int next = find_entry(at + 1, 0x1E, FAKE_COMMAND);
    assert_admission(next, 3);
    /* At the end of the frame during which the time came. */
    TEST_ASSERT_UINT64_WITHIN(10000, intervals_s[i] * 1000000 + 5000, fake.log[next].start_us - fake.log[at].start_us);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(intervals_s[i] * 1000000, fake.log[next].start_us - fake.log[at].start_us);
    at = next;
  }
  /* Once all are admitted, the next loss is answered after a second again. */
  fake.prom[DISTURBED] = fake.prom[DISTURBED + 1];
  run_until(45000000);
  TEST_ASSERT_EQUAL_HEX32(ALL, scan_read_map(&scan.admitted));
  TEST_ASSERT_EQUAL_HEX32(0, scan_read_map(&scan.prom_bad));
  assert_good_frame(ALL);
  fake.answering = ALL & ~DISTURBED_BIT;
  skip_frames(2);
  fake.answering = ALL;
  uint64_t back_us = now_us;
  run_until(back_us + 1100000);
  assert_good_frame(ALL);
}

TEST(test_nobody_answers) {
  fake.answering = 0;
  run_until(25000000);
  TEST_ASSERT_EQUAL_HEX32(0, scan_read_map(&scan.present));
  TEST_ASSERT_EQUAL_HEX32(0, frame.valid);
  TEST_ASSERT_EQUAL_INT16(0, frame.temperature_cC);
  TEST_ASSERT_GREATER_THAN_UINT32(0, value_of(&scan.counters.bus_nacks));
  TEST_ASSERT_EQUAL_UINT32(value_of(&scan.counters.frames), value_of(&scan.counters.frames_incomplete));
  TEST_ASSERT_EQUAL_INT(6, count_entries(0x1E, FAKE_COMMAND)); /* at 0, 1, 3, 7, 15, 23 s */
  fake.answering = ALL;
  run_until(34000000);
  assert_good_frame(ALL);
}
