/* The bus of a sensor array: the unit of work is the array, not the sensor.
 *
 * All sensors share one address, so every operation goes to all of them. Behind multiplexers they get it one after the other, on parallel
 * data lines at the same moment. An implementation fills this struct. Everything above works with any of them.
 *
 * One operation runs at a time. start_* begins one and returns at once. poll advances it and reports its end. No call
 * ever waits. All calls come from the same context (the board's event interrupt, or a test), never two at once. */
#pragma once

#include "common/limits.h"
#include "common/status.h"

#include <stdbool.h>
#include <stdint.h>

enum { ARRAY_BUS_MAX_READ_BYTES = 3 };

struct array_bus_result {
  sensor_map acknowledged;                                 /* bitmap of the sensors that acknowledged every byte; after a command sent
                                                            as a broadcast, all sensors of a branch that acknowledged as one */
  uint32_t nacks;                                          /* transfers without an acknowledgement, multiplexers included */
  uint8_t bytes[FT_MAX_SENSORS][ARRAY_BUS_MAX_READ_BYTES]; /* [sensor][byte as received]; after
                            start_read, for acknowledged sensors only */
};

struct array_bus {
  void *context;

  /* Between start_read and the moment at which the first sensor has its command, at the least: a
   * read may start that much before what it asks for is ready. */
  uint8_t read_lead_us;

  /* Each sensor answers a command for itself, so that acknowledged shows who heard it. */
  bool answers_are_single;

  /* Sends a one-byte command to every sensor. FT_ERR_BUSY: an operation is under way. */
  enum ft_status (*start_command)(void *context, uint8_t command, uint64_t now_us);

  /* Sends a one-byte command to every sensor and reads byte_count (1..ARRAY_BUS_MAX_READ_BYTES)
   * bytes back from each. FT_ERR_BUSY, FT_ERR_ARGUMENT. */
  enum ft_status (*start_read)(void *context, uint8_t command, uint8_t byte_count, uint64_t now_us);

  /* Abandons whatever is under way and frees the bus: nine clocks and a STOP, multiplexer resets,
   * controller re-initialised. Always accepted. */
  enum ft_status (*start_recovery)(void *context, uint64_t now_us);

  /* Advances the operation. Every poll of one operation takes the same *result, which is written to while FT_PENDING
   * too. FT_PENDING: call again at *wake_us at the latest, or as soon as the board signals an event. FT_OK: finished,
   * *result is filled (a sensor that did not acknowledge is no error of the bus). FT_ERR_TIMEOUT: the hardware did not
   * finish in time; recover. FT_ERR_STUCK: recovery did not free the bus; recover again later; a recovery fails in no other way. An
   * operation ends with its first answer other than FT_PENDING; without one, poll answers FT_ERR_ARGUMENT. */
  enum ft_status (*poll)(void *context, uint64_t now_us, struct array_bus_result *result, uint64_t *wake_us);
};
