/* A scan and what takes its frames, for the tests of hand-overs. Every frame is of one conversion:
 * codes, number and times; frames come in their order, and each is taken or counted as skipped; a
 * temperature is never overtaken by a frame after it: else the test fails. */
#pragma once

/* After some frames; nothing waits. */
void scan_start(void);

/* Interrupts: until one more conversion has been read; the same, and the next is of the
 * temperature. They end 0.7 ms apart at the least, and to take a frame takes less than half of
 * that: in one call of scan_take only one ends. */
void scan_finish_conversion(void);
void scan_finish_before_temperature(void);

/* Main context: takes a frame if there is one, and judges it. */
void scan_take_frame(void);

/* At the end. */
void scan_judge(void);
