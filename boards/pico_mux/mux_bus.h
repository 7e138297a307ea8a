/* array_bus over TCA9548A multiplexers on I2C0.
 *
 * What can go to all sensors at once does: with every used channel of every multiplexer switched on, one write reaches them all, a
 * conversion command and the command that makes ready what is read alike. Only the bytes are fetched from sensor to sensor, with one
 * channel open at a time. A channel opens at the STOP of its selection, so selections are transactions of their own; a multiplexer is shut
 * by its RESET line, which takes none. In steady state a frame takes 200 us on the bus at 400 kHz for the command (3 selections, 1 write)
 * and 2250 us for the reading (1 write, 15 selections, 15 fetches), and 3 us between two transactions. Sources: TCA9548A datasheet SCPS207;
 * MS5840-02BA datasheet, whose command and answer are transactions of their own; array_bus.h. All sensors sample together; the reading
 * skews nothing. A part that acknowledged the last time and does not now is asked once more, which repairs a disturbed transaction for
 * 110 us at most: one that disappears costs this in its first frame only.
 *
 * A multiplexer that still does not acknowledge is held in reset, which closes its channels whatever state it is in,
 * until the next operation asks it again; its sensors do not acknowledge and the others are not disturbed. So is one
 * whose opening stalls the bus, twice in a row, for a line behind it is then held; it is opened again after 1 s, and
 * after twice as long each time, up to 16 s, that it still does. */
#pragma once

#include "array_bus/array_bus.h"
#include "pico_mux/board.h"
#include "rp2040/i2c.h"

#include <stdbool.h>
#include <stdint.h>

enum { BOARD_MUX_COUNT = BOARD_SENSOR_COUNT / BOARD_SENSORS_OF_STRIP }; /* one for each strip */

/* Private, but caller-owned. */
struct mux_bus {
  enum mux_bus_operation { MUX_BUS_IDLE, MUX_BUS_COMMAND, MUX_BUS_READ, MUX_BUS_RECOVERY } operation;
  uint8_t command;
  uint8_t read_count;
  bool command_sent;
  uint8_t sensor; /* during a read: the one whose turn it is; after it, BOARD_SENSOR_COUNT */

  sensor_map answers;  /* bitmap of sensors: acknowledged the last fetch */
  uint8_t mux_answers; /* bitmap of multiplexers: acknowledged the last selection */

  uint8_t open[BOARD_MUX_COUNT]; /* [mux] channels that are on, by what it acknowledged last */
  uint8_t absent;                /* bitmap of multiplexers: shut, or did not acknowledge in this operation */
  uint8_t just_opened;           /* multiplexer, if the last transaction that ended selected its channels */
  uint8_t suspect;               /* the one just opened when the bus last stalled, until all goes well */
  uint8_t shut;                  /* bitmap: held in reset until shut_until_us */
  uint64_t shut_until_us;
  uint32_t shut_us; /* how long the next one is */

  enum mux_bus_transaction { MUX_BUS_NOTHING, MUX_BUS_SELECT, MUX_BUS_WRITE, MUX_BUS_FETCH } under_way;
  uint8_t select_mux;
  uint8_t select_channels;
  bool controller_busy; /* the transaction under way could not be loaded yet */
  bool ended;           /* the operation has no more to do */
  bool failed;          /* until a recovery succeeds, every operation ends with FT_ERR_TIMEOUT */
  uint32_t moves;       /* transactions ended since start */
  uint32_t moves_seen;  /* when last polled; more must have ended by deadline_us */
  uint64_t deadline_us;

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
