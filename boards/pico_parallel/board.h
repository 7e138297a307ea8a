/* The wiring of board pico_parallel: a Raspberry Pi Pico and fifteen MS5840, each with a data line
 * of its own. Sensor k = 5 * strip + position along the strip; its SDA is GPIO k.
 */
#ifndef PICO_PARALLEL_BOARD_H
#define PICO_PARALLEL_BOARD_H

enum {
  BOARD_SENSOR_COUNT = 15,
  BOARD_PIN_SCL = 15, /* of all sensors */
  BOARD_SENSOR_ADDRESS = 0x76,
};
/* Bitmaps of lines */
#define BOARD_SDA_LINES ((1u << BOARD_SENSOR_COUNT) - 1u)
#define BOARD_SCL_LINE (1u << BOARD_PIN_SCL)

#endif
