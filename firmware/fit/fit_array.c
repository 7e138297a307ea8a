/* The array as the fit needs it: positions in pitches, and whether they are a rectangle or a line. */
#include "common/bytes.h"
#include "fit/fit.h"
#include "fit/fit_limits.h"

#include <math.h>
#include <stdbool.h>

#ifdef FIT_GRID_ANY
_Thread_local int fit_grid_columns, fit_grid_rows; /* fit_grid_parts.h */
#endif

#define POSITION_MAX_mm 10000.0f
#define MARGIN 1.5f   /* pitches around the array in which a contact may lie */
#define ON_NODE 1e-4f /* pitches; the same off a line */
/* Limit of a location, with a pitch of 2^23 to 2^24: the array and its margin beside it fit into 2^30. */
#define ORIGIN_MAX 1073741824.0f

/* value > 0 as mantissa * 2^exponent with a mantissa of 2^29 .. 2^30. */
static int32_t split(float value, int32_t *exponent) {
  uint32_t bits = bytes_from_f32(value);
  *exponent = (int32_t)(bits >> 23) - 127 - 29;
  return (int32_t)((bits & 0x7FFFFFu) | 0x800000u) << 6;
}

/* Number of the node at this coordinate, or -1 off the grid. */
static int node_at(float position, float first) {
  float steps = position - first; /* not negative but for rounding */
  int nearest = (int)(steps + 0.5f);
  bool on_node = fabsf(steps - (float)nearest) <= ON_NODE && nearest < FIT_GRID_MAX_SIDE;
  return on_node ? nearest : -1;
}

/* Fills made->grid if the sensors occupy every node of a rectangle. */
static void find_grid(struct fit_array *made, const float *x_mm, const float *y_mm) {
  struct fit_grid_shape *grid = &made->grid;
  float x_first = made->x_min + MARGIN, y_first = made->y_min + MARGIN;
  int columns = node_at(made->x_max - MARGIN, x_first) + 1;
  int rows = node_at(made->y_max - MARGIN, y_first) + 1;
  if (columns < 2 || rows < 2 || columns * rows != made->sensor_count) {
    return;
  }
  sensor_map seen = 0;
  for (uint8_t k = 0; k < made->sensor_count; k++) {
    int column = node_at(made->x[k], x_first);
    int row = node_at(made->y[k], y_first);
    if (column < 0 || row < 0) {
      return;
    }
    grid->sensor[column * rows + row] = k;
    seen |= sensor_bit((unsigned)(column * rows + row));
  }
  if (seen != first_sensors(made->sensor_count)) {
    return;
  }
  const int32_t half_q26 = 1 << 25;
  grid->x_min = -(2 * (columns / 2) + 3) * half_q26;
  grid->x_max = (2 * (columns - 1 - columns / 2) + 3) * half_q26;
  grid->y_min = -(2 * (rows / 2) + 3) * half_q26;
  grid->y_max = (2 * (rows - 1 - rows / 2) + 3) * half_q26;
  int32_t exponent;
  grid->pitch = split(made->pitch_mm, &exponent);
  grid->pitch_exponent = exponent + 6;
  uint8_t origin = grid->sensor[(columns / 2) * rows + rows / 2];
  float unit = bytes_to_f32((uint32_t)(127 - grid->pitch_exponent) << 23); /* a power of 2 */
  float x_origin = x_mm[origin] * unit, y_origin = y_mm[origin] * unit;
  if (fabsf(x_origin) > ORIGIN_MAX || fabsf(y_origin) > ORIGIN_MAX) {
    return;
  }
  grid->x_origin = (int32_t)x_origin;
  grid->y_origin = (int32_t)y_origin;
  grid->force_scale = split(6.28318531e-6f * made->pitch_mm * made->pitch_mm, &grid->force_exponent);
  float settled = FIT_SETTLED_mm / made->pitch_mm * 4194304.0f;
  settled = settled * settled * 0.5f;
  grid->settled_square = settled < 5e8f ? (int32_t)settled : 500000000;
  grid->columns = (uint8_t)columns;
  grid->rows = (uint8_t)rows;
}

/* Fills the line that the sensors lie on, if they do and not all in one place. */
static void find_line(struct fit_array *made) {
  float along_x = 0.0f, along_y = 0.0f, longest = 0.0f;
  for (uint8_t k = 1; k < made->sensor_count; k++) {
    float x = made->x[k] - made->x[0], y = made->y[k] - made->y[0];
    float length = sqrtf(x * x + y * y);
    if (length > longest) {
      longest = length;
      along_x = x;
      along_y = y;
    }
  }
  if (longest <= ON_NODE) {
    return;
  }
  made->line_x = -along_y / longest;
  made->line_y = along_x / longest;
  made->line_offset = made->x[0] * made->line_x + made->y[0] * made->line_y;
  made->is_line = true;
  for (uint8_t k = 1; k < made->sensor_count; k++) {
    float x = made->x[k] - made->x[0], y = made->y[k] - made->y[0];
    float across = x * made->line_x + y * made->line_y;
    made->is_line = made->is_line && fabsf(across) <= ON_NODE;
  }
}

/* Everything but the line. */
static enum ft_status make_array(struct fit_array *array, uint8_t sensor_count, const float *x_mm, const float *y_mm, float pitch_mm) {
  if (sensor_count < 1 || sensor_count > FT_MAX_SENSORS || !(pitch_mm >= 0.01f && pitch_mm <= POSITION_MAX_mm)) {
    return FT_ERR_ARGUMENT;
  }
  struct fit_array made = {.sensor_count = sensor_count, .pitch_mm = pitch_mm};
  for (uint8_t k = 0; k < sensor_count; k++) {
    if (!(fabsf(x_mm[k]) <= POSITION_MAX_mm && fabsf(y_mm[k]) <= POSITION_MAX_mm)) {
      return FT_ERR_ARGUMENT;
    }
    float x = x_mm[k] / pitch_mm;
    float y = y_mm[k] / pitch_mm;
    made.x[k] = x;
    made.y[k] = y;
    made.x_min = k == 0 || x - MARGIN < made.x_min ? x - MARGIN : made.x_min;
    made.x_max = k == 0 || x + MARGIN > made.x_max ? x + MARGIN : made.x_max;
    made.y_min = k == 0 || y - MARGIN < made.y_min ? y - MARGIN : made.y_min;
    made.y_max = k == 0 || y + MARGIN > made.y_max ? y + MARGIN : made.y_max;
  }
  find_grid(&made, x_mm, y_mm);
  *array = made;
  return FT_OK;
}

enum ft_status fit_array_init(struct fit_array *array, uint8_t sensor_count, const float *x_mm, const float *y_mm, float pitch_mm) {
  enum ft_status status = make_array(array, sensor_count, x_mm, y_mm, pitch_mm);
  if (status == FT_OK) {
    find_line(array);
  }
  return status;
}

enum ft_status fit_array_init_grid(struct fit_array *array, uint8_t sensor_count, const float *x_mm, const float *y_mm, float pitch_mm) {
  enum ft_status status = make_array(array, sensor_count, x_mm, y_mm, pitch_mm);
  return status == FT_OK && !fit_is_rectangle(array) ? FT_ERR_ARGUMENT : status;
}

void fit_set_errors(struct fit_settings *settings, float gain_sd, float model_sd) {
  for (int k = 0; k < FT_MAX_SENSORS; k++) {
    settings->gain_sd_q16[k] = (uint16_t)(gain_sd * 65536.0f);
  }
  settings->model_sd_q16 = (uint16_t)(model_sd * 65536.0f);
}
