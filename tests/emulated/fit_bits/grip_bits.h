/* Grasps of firmware/grip whose commands and reports are compared bit by bit between machines,
 * drawn from their number with integers alone. Even ones are plausible: an object on two springs, a
 * gripper that goes where it is told, now and then a fault. Odd ones are none: every setting that
 * grip_init takes, touches, status and requests of any values, times that leap.
 */
#ifndef FIT_BITS_GRIP_BITS_H
#define FIT_BITS_GRIP_BITS_H

#include <stdbool.h>
#include <stdint.h>

#define GRIP_BITS_STEPS 200 /* of each grasp */

/* CRC-32 of every command and report of a grasp. */
uint32_t grip_bits_of(uint32_t grasp);

/* The program's own: called on either side of grip_step, to count its cycles. */
void grip_bits_count(bool on);

#endif
