/* Sixteen open-drain lines, GPIO0 to 15, moved through a table of steps and sampled on the way, by
 * PIO0 and two DMA channels. The processor is free until the end, which calls rp2040_event().
 *
 * A step is a bitmap of the lines pulled low; the others are released. Four steps make a cell. In each cell all lines
 * are sampled once, at the end of its first step. When a wave is over, the lines stay as its last step has them.
 *
 * The lengths of the steps are those that a bit of fast-mode I2C needs: SCL is high in the first two and low in the others, and SDA may
 * change between those. They keep the times of UM10204 table 10 where a line is back above 0.7 VDD within 430 ns, which is a rise time of
 * 300 ns from 0.3 VDD on, and below 0.3 VDD within 180 ns: tLOW >= 1.3 us, tHIGH, tSU;STA, tSU;STO, tHD;STA >= 0.6 us, SDA held 300 ns
 * beyond the fall of SCL. 2520 ns a bit: 396.8 kHz whatever the rise time, as nothing waits for an edge.
 *
 * One context: the event handler, or main before there is one. Nothing here waits, but for blocks to leave reset, which is bounded. */
#pragma once

#include "common/status.h"

#include <stdbool.h>
#include <stdint.h>

enum {
  WAVE_STEPS_PER_CELL = 4,
  WAVE_STEP0_ns = 760,
  WAVE_STEP1_ns = 280,
  WAVE_STEP2_ns = 320,
  WAVE_STEP3_ns = 1160,
  WAVE_CELL_ns = WAVE_STEP0_ns + WAVE_STEP1_ns + WAVE_STEP2_ns + WAVE_STEP3_ns,
};

/* Abandons whatever is under way, releases all lines and makes PIO and DMA ready. The lines have the pads' pull-ups
 * besides the board's own, which hold an unconnected line high. FT_ERR_TIMEOUT: a block does not leave reset. */
enum ft_status wave_player_open(void);

/* Starts a wave of cell_count cells (even, not 0). The one before must have ended. Both tables are aligned to words and
 * in use until the end: steps[cell * WAVE_STEPS_PER_CELL + step]; samples[cell], bitmap of the lines that were high. */
void wave_player_start(const uint16_t *steps, uint16_t *samples, unsigned cell_count);

/* All samples are there. The last three steps are still to come, before those of the next wave. */
bool wave_player_has_ended(void);

/* How many of this wave's cells have their samples in memory. */
unsigned wave_player_sampled(void);

/* Interrupt vector of the DMA controller. */
void dma0_irq_handler(void);
