/* The wiring of board pico_mux: a Raspberry Pi Pico, three strips of five MS5840, each strip behind
 * a TCA9548A of its own. Sensor k = 5 * strip + channel.
 */
#ifndef PICO_MUX_BOARD_H
#define PICO_MUX_BOARD_H

enum {
  BOARD_PIN_SDA = 4, /* I2C0; external pull-ups, the pads' own only hold an unconnected bus high */
  BOARD_PIN_SCL = 5,
  BOARD_PIN_MUX_RESET_0 = 6, /* active low, push-pull; one for each strip: 6, 7, 8 */

  BOARD_MUX_COUNT = 3,
  BOARD_MUX_ADDRESS_0 = 0x70, /* 0x70, 0x71, 0x72 */
  BOARD_CHANNELS_PER_MUX = 5, /* channels 0..4 */
  BOARD_SENSOR_ADDRESS = 0x76,
  BOARD_SENSOR_COUNT = BOARD_MUX_COUNT * BOARD_CHANNELS_PER_MUX,
};

#endif
