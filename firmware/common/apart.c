#include "common/apart.h"

#include "common/limits.h"

int32_t apart_median(int32_t values[], int count) {
  for (int i = 1; i < count; i++) {
    int32_t value = values[i];
    int at = i;
    for (; at > 0 && values[at - 1] > value; at--) {
      values[at] = values[at - 1];
    }
    values[at] = value;
  }
  return values[count / 2];
}

static int32_t size_of(int32_t value) { return value < 0 ? -value : value; }

sensor_map apart_find(const int32_t value[], sensor_map which, uint8_t sensor_count, int32_t floor) {
  int32_t sorted[FT_MAX_SENSORS];
  int count = 0;
  for (uint8_t k = 0; k < sensor_count; k++) {
    if (which >> k & 1u) {
      sorted[count++] = value[k];
    }
  }
  if (count < APART_VOTERS_MIN) {
    return 0;
  }
  const int32_t middle = apart_median(sorted, count);
  for (int i = 0; i < count; i++) {
    sorted[i] = size_of(sorted[i] - middle);
  }
  const int32_t limit = floor + APART_SPREADS * apart_median(sorted, count);
  sensor_map apart = 0;
  for (uint8_t k = 0; k < sensor_count; k++) {
    if ((which >> k & 1u) && size_of(value[k] - middle) > limit) {
      apart |= sensor_bit(k);
    }
  }
  return apart;
}
