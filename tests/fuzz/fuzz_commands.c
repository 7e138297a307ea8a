/* The firmware's command receiver, with the firmware around it: bytes and commands in, packets out. */
#include "app/app.h"
#include "config/geometry.h"
#include "flash_record.h"
#include "fuzz.h"
#include "native/native_cdc.h"
#include "native/native_port.h"
#include "native/native_sync.h"
#include "native/sim_array.h"
#include "port/port.h"
#include "unit/wire/wire_samples.h"

static struct app app;
static struct sim_array array;
static struct wire_receiver receiver;
static struct wire_packet heard;

/* Commands since start that can be told apart by what they were asked with, and answers. */
static uint32_t sent, acknowledged, informed;

static double pressure_Pa(void *context, unsigned sensor, uint64_t t_us) {
  (void)context;
  return 101325.0 + (sensor == 7 && t_us > 30000 ? 4000.0 : 0.0);
}

static uint64_t next_event_us(const void *context) { return sim_array_next_event_us(context); }

static void on_event(void *context) { app_on_event(context); }

static void main_round(void *context) { app_run(context); }

static void power_up(void) {
  native_flash_power_up();
  native_start(false);
  native_cdc_reset();
  native_sync_reset();
  sim_array_init(&array, geometry.sensor_count, 1);
  array.world = (struct sim_world){.pressure_Pa = pressure_Pa};
  array.noise = 1.0;
  native_set_event_source(next_event_us, &array);
  port_set_event_handler(on_event, &app);
  app_start(&app, sim_array_bus(&array));
  wire_receiver_init(&receiver, wire_all_layouts);
  sent = acknowledged = informed = 0;
  native_cdc_open();
}

static void check_info(const struct wire_info *info) {
  FUZZ_CHECK(info->sensor_count == geometry.sensor_count);
  FUZZ_CHECK(info->rate_mHz == 0 || (info->rate_mHz >= WIRE_RATE_MIN_mHz && info->rate_mHz <= WIRE_RATE_MAX_mHz));
  FUZZ_CHECK(info->osr >= 256 && info->osr <= 8192 && (info->osr & (info->osr - 1)) == 0);
  FUZZ_CHECK(info->slip_threshold_mm >= WIRE_SLIP_THRESHOLD_MIN_mm && info->slip_threshold_mm <= WIRE_SLIP_THRESHOLD_MAX_mm);
  FUZZ_CHECK(info->slip_window_ms >= WIRE_SLIP_WINDOW_MIN_ms && info->slip_window_ms <= WIRE_SLIP_WINDOW_MAX_ms);
  FUZZ_CHECK(info->location_limit_mm >= WIRE_LOCATION_LIMIT_MIN_mm && info->location_limit_mm <= WIRE_LOCATION_LIMIT_MAX_mm);
  FUZZ_CHECK(info->prior_width_mm == 0.0f ||
             (info->prior_sigma_mm >= WIRE_PRIOR_SIGMA_MIN_mm && info->prior_sigma_mm <= WIRE_PRIOR_SIGMA_MAX_mm));
  FUZZ_CHECK((info->streams & ~WIRE_STREAM_ALL) == 0);
  FUZZ_CHECK(info->sync <= PORT_SYNC_SECOND);
  if (info->stored & WIRE_STORED_CALIBRATION) {
    FUZZ_CHECK(calibration_is_valid(&info->calibration, info->sensor_count));
  }
  if (info->stored & WIRE_STORED_PAD) {
    FUZZ_CHECK(pad_profile_is_valid(&info->pad));
  }
}

/* The host reads all there is: undamaged packets, and no more answers than questions. */
static void listen(void) {
  uint8_t bytes[512];
  for (size_t count; (count = native_cdc_receive(bytes, sizeof bytes)) > 0;) {
    for (size_t i = 0; i < count; i++) {
      enum ft_status status = wire_receive(&receiver, bytes[i], &heard);
      FUZZ_CHECK(status == FT_OK || status == FT_PENDING);
      if (status == FT_OK && heard.type == WIRE_ACK) {
        acknowledged++;
        FUZZ_CHECK(heard.body.ack.result <= WIRE_RESULT_NOT_NOW);
      } else if (status == FT_OK && heard.type == WIRE_INFO) {
        informed++;
        check_info(&heard.body.info);
      }
    }
  }
  FUZZ_CHECK(acknowledged <= sent);
}

static bool run_ms(uint32_t ms) {
  enum native_end end = native_run_until(port_now_us() + 1000u * ms, main_round, &app);
  FUZZ_CHECK(end != NATIVE_PANIC);
  FUZZ_CHECK(!native_watchdog_expired());
  listen();
  if (end == NATIVE_LOADER) {
    power_up();
  }
  return end == NATIVE_TIME_UP;
}

/* By the line's pace: what finds no room waits a while. */
static void send(const uint8_t *bytes, size_t length) {
  while (length > 0) {
    size_t part = length < 64 ? length : 64;
    while (native_cdc_send(bytes, part) != FT_OK) {
      if (!run_ms(1)) {
        return; /* it left for the loader, and what was on its way is lost */
      }
    }
    bytes += part;
    length -= part;
  }
}

/* With a CRC that is right. */
static void send_packet(const uint8_t *packet, size_t length) {
  uint8_t whole[WIRE_MAX_PACKET_BYTES + 16], frame[2 * sizeof whole];
  memcpy(whole, packet, length);
  size_t at = seal(whole, length, frame);
  frame[at++] = 0;
  sent++;
  send(frame, at);
}

/* Whatever came before, it still answers. */
static void check_is_alive(void) {
  static const uint8_t delimiter = 0;
  static const uint8_t info[WIRE_HEADER_BYTES] = {WIRE_VERSION, WIRE_CMD_INFO, 0x34, 0x12};
  native_cdc_stall(false);
  native_cdc_open();
  run_ms(600); /* what is being stored, and a loader that was asked for */
  native_cdc_open();
  send(&delimiter, 1);
  send_packet(info, sizeof info);
  const uint32_t before = acknowledged + informed;
  for (int i = 0; i < 100 && acknowledged + informed == before; i++) {
    run_ms(1);
  }
  FUZZ_CHECK(acknowledged + informed != before);
}

enum operation { RAW, PACKET, PACKET_2, WAIT, PORT, STALL, POWER, STORED, OPERATIONS };

static void send_raw(struct fuzz_input *input) {
  size_t length = fuzz_u8(input);
  const uint8_t *bytes = fuzz_bytes(input, &length);
  for (size_t i = 0; i < length; i++) {
    sent += bytes[i] == 0;
  }
  send(bytes, length);
}

static void send_command(struct fuzz_input *input) {
  static const uint8_t body_bytes[] = {1, 1, 4, 2, 6, 0, 0, 4, 15 + 8 * 15, 0, 1, 8, 4, 4 * PAD_PROFILE_FLOATS + 1, 0, 3};
  const uint8_t type = fuzz_u8(input);
  const bool is_sync = (type & 0x0F) == (WIRE_CMD_SYNC & 0x0F) && type & 0x40;
  uint8_t packet[WIRE_HEADER_BYTES + 256] = {WIRE_VERSION, is_sync ? (uint8_t)WIRE_CMD_SYNC : (uint8_t)(0x80 | (type & 0x0F))};
  size_t length = type & 0x10 ? fuzz_u8(input) : body_bytes[type & 0x0F];
  if (type & 0x20) { /* some other version or type */
    packet[0] = fuzz_u8(input);
    packet[1] = fuzz_u8(input);
  }
  bytes_put_u16(packet + 2, fuzz_u16(input));
  size_t given = length;
  const uint8_t *body = fuzz_bytes(input, &given);
  memcpy(packet + WIRE_HEADER_BYTES, body, given);
  if (type == (WIRE_CMD_CALIBRATE & 0x0F)) {
    packet[WIRE_HEADER_BYTES] = geometry.sensor_count;
  }
  send_packet(packet, WIRE_HEADER_BYTES + length);
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  struct fuzz_input input = {bytes, bytes + length};
  native_flash_reset(1);
  power_up();
  while (fuzz_left(&input) > 0) {
    switch (fuzz_u8(&input) % OPERATIONS) {
    case RAW: send_raw(&input); break;
    case WAIT: run_ms(fuzz_u8(&input)); break;
    case PORT:
      native_cdc_close();
      run_ms(1);
      native_cdc_open();
      break;
    case STALL: native_cdc_stall(fuzz_u8(&input) & 1); break;
    case POWER: power_up(); break;
    case STORED:
      native_flash_power_up();
      fuzz_put_record(&input, 1, geometry.sensor_count);
      power_up();
      break;
    default: send_command(&input);
    }
    listen();
  }
  check_is_alive();
}
