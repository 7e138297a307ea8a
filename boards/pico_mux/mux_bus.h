/* array_bus over TCA9548A multiplexers on I2C0.
 *
 * A command goes to all sensors at once: every used channel of every multiplexer is switched on and
 * one write reaches them all. A read goes from sensor to sensor, with one channel open at a time.
 * A channel opens at the STOP of its selection, so selections are transactions of their own; one is
 * sent only where a multiplexer is not in the needed state already. In steady state a frame takes
 *   command  3 selections, 1 write                             200 us
 *   between  2 off, 1 selection, during the conversion         150 us
 *   read     14 selections, 2 off, 15 reads of 3 bytes        2940 us
 * on the bus at 400 kHz (sources: TCA9548A datasheet SCPS207; array_bus.h).
 *
 * A multiplexer that does not acknowledge is held in reset, which closes its channels whatever
 * state it is in, until the next operation asks it again; its sensors do not acknowledge and the
 * others are not disturbed.
 */
#ifndef PICO_MUX_MUX_BUS_H
#define PICO_MUX_MUX_BUS_H

#include "array_bus/array_bus.h"
#include "pico_mux/board.h"
#include "rp2040/i2c.h"

#include <stdbool.h>
#include <stdint.h>

/* Private, but caller-owned. */
struct mux_bus {
  enum mux_bus_operation {
    MUX_BUS_IDLE,
    MUX_BUS_COMMAND,
    MUX_BUS_READ,
    MUX_BUS_RECOVERY
  } operation;
  uint8_t command;
  uint8_t read_count;
  uint8_t sensor; /* during a read: the one whose turn it is; after it, BOARD_SENSOR_COUNT */

  uint8_t open[BOARD_MUX_COUNT]; /* [mux] channels that are on, by what it acknowledged last */
  uint8_t absent;                /* bitmap of multiplexers: did not acknowledge in this operation */

  enum { MUX_BUS_NOTHING, MUX_BUS_SELECT, MUX_BUS_WRITE, MUX_BUS_FETCH } under_way;
  uint8_t select_mux;
  uint8_t select_channels;
  uint64_t deadline_us;
  uint64_t wake_us;
  bool failed; /* until a recovery succeeds, every operation ends with FT_ERR_TIMEOUT */

  enum {
    MUX_BUS_CLOCK_LOW,
    MUX_BUS_CLOCK_HIGH,
    MUX_BUS_STOP_LOW,
    MUX_BUS_STOP_RISE,
    MUX_BUS_STOP_DONE,
    MUX_BUS_MUX_RESET,
    MUX_BUS_REOPEN,
  } recovery_step;
  uint8_t recovery_clocks;
  uint64_t recovery_due_us;

  struct array_bus_result result;
};

/* Resets the multiplexers and opens the controller. FT_ERR_TIMEOUT: a block of the chip does not
 * start. Fills *array_bus, which refers to *bus. */
enum ft_status mux_bus_init(struct mux_bus *bus, struct array_bus *array_bus);

/* Goes on with the switching that a finished command leaves for the time of the conversion. Call at
 * every event, before what uses the array bus; without it, the next operation does it. */
void mux_bus_service(struct mux_bus *bus, uint64_t now_us);

#endif
