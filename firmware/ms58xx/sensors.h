/* The sensors of the MS58xx family: one section each. The build chooses that of the pad
 * (boards/pads/README.md), so that an image holds nothing of the others.
 *
 * All of them have the same commands and the same PROM (W0: CRC-4 in its top four bits, then the product type; W1..W6:
 * C1..C6). All have the same temperature, 2000 + dT * C6 / 2^23. They differ in:
 *
 *   MAX_PRESSURE_Pa   readings above are flagged: beyond the range, or near it
 *   APART_Pa          more than two sound parts differ by in the same air (condition/plausibility.h)
 *   STEP_Pa           no press moves one sensor alone by this (scan/readings.h)
 *   SENS_T1, TCS      SENS = C1 * 2^SENS_T1 + C3 * dT / 2^TCS
 *   OFF_T1, TCO       OFF = C2 * 2^OFF_T1 + C4 * dT / 2^TCO
 *   Q10_TIMES, _SHIFT pressure in 1/1024 Pa = (D1 * SENS / 2^21 - OFF) * Q10_TIMES / 2^Q10_SHIFT
 *   VERY_COLD_cC      edge of the third branch of the second order
 *   WARM, COLD, VERY_COLD   second order in each branch: a TERM(T, 12, DT, 35) subtracts
 *                     12 * dT^2 / 2^35 from TEMP; the others from OFF and SENS. X is TEMP - 2000 of
 *                     the first-order TEMP, and Y is TEMP - VERY_COLD_cC
 *   NOISE_MAX_Pa      the largest noise of the table
 *   OSR_TABLE         ratio, its bits in the convert commands, longest conversion in us, noise of a
 *                     pressure in Pa rms and of a temperature in degC rms
 *
 * To add a sensor, add a section here, its name in firmware/CMakeLists.txt, and its data in boards/native/sim_ms5840.c and
 * in the emulator's board/ms5840.mjs. If its CRC is elsewhere (MS5611: in an eighth word), change ms58xx_prom_crc4 too. */
#pragma once

#define MS58XX_MS5840 1
#define MS58XX_MS5837_30BA 2

#if MS58XX_SENSOR == MS58XX_MS5840
/* MS5840-02BA data sheet: conversion times, noise, compensation. The first order was checked with the worked example of the MS5837-02BA
 * data sheet, page 7. The extended range ends at 2 bar. Beyond it a reading is biased low. Readings count as beyond it from 1 % before, so
 * that a part whose readings end right there does not pass by its noise. 8 kPa: a code with bit 18 wrong is 11 kPa off. */
#define MS58XX_MAX_PRESSURE_Pa 198000
#define MS58XX_APART_Pa 1000 /* recalled: a part is off by up to 4 mbar */
#define MS58XX_STEP_Pa 8192
#define MS58XX_SENS_T1 16
#define MS58XX_TCS 7
#define MS58XX_OFF_T1 17
#define MS58XX_TCO 6
#define MS58XX_Q10_TIMES 1
#define MS58XX_Q10_SHIFT 5
#define MS58XX_VERY_COLD_cC 1000
#define MS58XX_WARM(TERM)
#define MS58XX_COLD(TERM) TERM(T, 12, DT, 35) TERM(OFF, 30, X, 8)
#define MS58XX_VERY_COLD(TERM) TERM(T, 14, DT, 35) TERM(OFF, 35, X, 3) TERM(SENS, 63, X, 5)
#define MS58XX_NOISE_MAX_Pa 11
#define MS58XX_OSR_TABLE(ROW)                                                                                                              \
  ROW(256, 0x0, 560, 11.0f, 0.012f), ROW(512, 0x2, 1100, 6.2f, 0.009f), ROW(1024, 0x4, 2170, 3.9f, 0.006f),                                \
      ROW(2048, 0x6, 4320, 2.8f, 0.004f), ROW(4096, 0x8, 8610, 2.1f, 0.003f), ROW(8192, 0xA, 17200, 1.6f, 0.002f)

#elif MS58XX_SENSOR == MS58XX_MS5837_30BA
/* MS5837-30BA data sheet of 10/2015, pages 7 and 9, and rev. C2 of 12/2019, pages 9 and 11: PROM, commands, first order. Rev. C2 no longer
 * lists OSR 8192. Second order: as public drivers have it (BlueRobotics, libdriver). Conversion times: those of the MS5611, which has the
 * same converter; that of OSR 8192 is twice the one before. Noise: 20 Pa at OSR 8192 by the data sheet, the others are recalled. The sensor
 * ends at 30 bar; a pressure in 1/1024 Pa ends at 20.97 bar in 32 bits. */
#define MS58XX_MAX_PRESSURE_Pa 2000000
#define MS58XX_APART_Pa 20000 /* recalled: up to 50 mbar below 6 bar */
#define MS58XX_STEP_Pa 32768
#define MS58XX_SENS_T1 15
#define MS58XX_TCS 8
#define MS58XX_OFF_T1 16
#define MS58XX_TCO 7
/* P counts 10 Pa and ends in a division by 2^13. */
#define MS58XX_Q10_TIMES 5
#define MS58XX_Q10_SHIFT 2
#define MS58XX_VERY_COLD_cC (-1500)
#define MS58XX_WARM(TERM) TERM(OFF, 1, X, 4) TERM(T, 2, DT, 37)
#define MS58XX_COLD(TERM) TERM(OFF, 3, X, 1) TERM(SENS, 5, X, 3) TERM(T, 3, DT, 33)
#define MS58XX_VERY_COLD(TERM) TERM(OFF, 7, Y, 0) TERM(SENS, 4, Y, 0) MS58XX_COLD(TERM)
#define MS58XX_NOISE_MAX_Pa 157
#define MS58XX_OSR_TABLE(ROW)                                                                                                              \
  ROW(256, 0x0, 600, 157.0f, 0.012f), ROW(512, 0x2, 1170, 84.0f, 0.009f), ROW(1024, 0x4, 2280, 54.0f, 0.006f),                             \
      ROW(2048, 0x6, 4540, 38.0f, 0.004f), ROW(4096, 0x8, 9040, 28.0f, 0.003f), ROW(8192, 0xA, 18080, 20.0f, 0.002f)

#else
#error "MS58XX_SENSOR must be one of the sensors above; the pad's file sets it"
#endif
