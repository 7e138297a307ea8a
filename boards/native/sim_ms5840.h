/* One simulated MS5840-02BA, or MS5837-30BA by the pad, as seen from its two wires: what it acknowledges, answers and forgets, and
 * when. Written from the datasheet, apart from the driver in firmware/ms58xx, so that the two can be tested against each other.
 *
 * Behaviour: after power-up nothing but the reset command works; it takes 2.8 ms, during which the sensor acknowledges
 * nothing. A conversion takes the datasheet's maximum. Its result can be read once; without one the sensor answers 0.
 * Reading during a conversion answers 0 and spoils the result, and so does a second conversion command: the spoiled
 * result is 1/8 too small, so that it resembles a measurement. Word 7 of the PROM is not acknowledged. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum { SIM_MS5840_PROM_WORDS = 7, SIM_MS5840_MAX_READ_BYTES = 3 };

#define SIM_MS5840_RESET_us 2800u

/* C1..C6 of a part: of a public dump of an MS5840, of the example of the MS5837-30BA's datasheet. */
#if SIM_SENSOR_MS5837_30BA
#define SIM_MS5840_TYPICAL                                                                                                                 \
  { 34982, 36352, 20328, 22354, 26646, 26146 }
#define SIM_MS5840_EXAMPLE SIM_MS5840_TYPICAL
#else
#define SIM_MS5840_TYPICAL                                                                                                                 \
  { 41335, 41466, 26840, 27317, 31225, 28780 }
/* Of the datasheet of the MS5837-02BA. */
#define SIM_MS5840_EXAMPLE                                                                                                                 \
  { 46372, 43981, 29059, 27842, 31553, 28165 }
#endif

struct sim_ms5840 {
  uint16_t prom[SIM_MS5840_PROM_WORDS]; /* W0 with its CRC, C1..C6 */

  /* Private */
  bool loaded;    /* has been reset since power-up */
  bool untrimmed; /* has not been reset since a brown-out */
  double share;   /* of the true codes, that an untrimmed one has */
  bool converting;
  bool spoiled;
  uint64_t busy_until_us; /* end of a reset or a conversion */
  uint32_t converted;     /* code of the conversion under way */
  uint32_t result;        /* 0 = none */
};

/* What a conversion finds: type 1 (pressure, D1) or 2 (temperature, D2), oversampling ratio, and
 * the middle of the conversion. Returns the 24-bit code. */
typedef uint32_t sim_ms5840_measure(void *context, int type, unsigned osr, uint64_t t_us);

/* Gives the sensor c[0..5] = C1..C6 with a valid CRC, and powers it up. */
void sim_ms5840_init(struct sim_ms5840 *sensor, const uint16_t c[6]);

/* Supply off and on: the sensor needs a reset, a conversion is lost. */
void sim_ms5840_power_cycle(struct sim_ms5840 *sensor);

/* Supply down and up, not as far as that: the sensor goes on converting, but until a reset its codes are 1/16 too
 * small, or as the caller sets .share. A conversion is lost. That there are such sensors is assumed. */
void sim_ms5840_brown_out(struct sim_ms5840 *sensor);

/* A command byte that ends at t_us, alone in its transfer or before a read. False: not acknowledged. */
bool sim_ms5840_command(struct sim_ms5840 *sensor, uint8_t command, uint64_t t_us, sim_ms5840_measure *measure, void *context);

/* The bytes that a read after command answers. False: not acknowledged. */
bool sim_ms5840_read(struct sim_ms5840 *sensor, uint8_t command, uint8_t *bytes, unsigned count, uint64_t t_us);

/* CRC-4 over the words with the CRC nibble as 0 (Application Note AN520). */
uint8_t sim_ms5840_crc4(const uint16_t prom[SIM_MS5840_PROM_WORDS]);

/* Datasheet compensation with its second order, in Pa and degC, and its inverse: the codes at which
 * a sensor with this PROM shows temperature and pressure. Codes end at 1 and 2^24 - 1. */
double sim_ms5840_temperature_degC(const uint16_t *prom, uint32_t d2);
double sim_ms5840_pressure_Pa(const uint16_t *prom, uint32_t d1, uint32_t d2);
uint32_t sim_ms5840_d2(const uint16_t *prom, double temperature_degC);
uint32_t sim_ms5840_d1(const uint16_t *prom, double pressure_Pa, uint32_t d2);

/* Datasheet rows: longest conversion, and noise of one reading. osr: 256, 512, 1024, 2048, 4096 or 8192. */
uint32_t sim_ms5840_conversion_us(unsigned osr);
double sim_ms5840_noise_Pa(unsigned osr);
double sim_ms5840_noise_degC(unsigned osr);
