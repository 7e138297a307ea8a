/* The whole firmware on the host: simulated sensors below, a USB host above. For one test program. */
#pragma once

#include "app/app.h"
#include "config/geometry.h"
#include "native/native_cdc.h"
#include "native/native_flash.h"
#include "native/native_port.h"
#include "native/native_sync.h"
#include "native/sim_array.h"
#include "port/port.h"
#include "support/unit.h"

#include <math.h>
#include <string.h>

#define AMBIENT_Pa 101325.0
#define PI 3.14159265358979

static struct sim_array array;
static struct array_bus bus;
static bool rig_is_parallel; /* a data line for each sensor; else behind multiplexers */
static struct app app;
static struct wire_receiver receiver;
static uint16_t host_sequence;
static unsigned rig_events;

/* The press that the world applies. */
static struct {
  double force_N, x_mm, y_mm, speed_y_mm_s;
  uint64_t from_us;
} press;

/* Of a sensor, relative to the mean; NULL: all are alike. */
static double (*world_gain)(unsigned sensor);

/* Pressure on the pad, Pa, so far from the contact's centre; NULL: the Gaussian of the press. */
static double (*world_field_Pa)(double dx_mm, double dy_mm, uint64_t t_us);

static inline double world_pressure_Pa(void *context, unsigned sensor, uint64_t t_us) {
  (void)context;
  if (press.force_N == 0.0 || t_us < press.from_us) {
    return AMBIENT_Pa;
  }
  double y_mm = press.y_mm + press.speed_y_mm_s * (double)(t_us - press.from_us) * 1e-6;
  double dx = (double)geometry.x_mm[sensor] - press.x_mm;
  double dy = (double)geometry.y_mm[sensor] - y_mm;
  const double sigma_mm = 5.7;
  double p0_Pa = press.force_N / (2.0 * PI * sigma_mm * sigma_mm * 1e-6);
  double pressure_Pa = world_field_Pa ? world_field_Pa(dx, dy, t_us) : p0_Pa * exp(-(dx * dx + dy * dy) / (2.0 * sigma_mm * sigma_mm));
  return AMBIENT_Pa + (world_gain ? world_gain(sensor) : 1.0) * pressure_Pa;
}

static inline uint64_t next_event_us(const void *context) { return sim_array_next_event_us(context); }

static inline void on_event(void *context) {
  rig_events++;
  app_on_event(context);
}

static inline void main_round(void *context) { app_run(context); }

/* Power goes and comes back, when the clock shows this; what the flash holds stays, and so does the world. */
static inline void rig_power_up_at(uint64_t t_us, bool watchdog_struck) {
  native_flash_power_up();
  native_start(watchdog_struck);
  native_set_time(t_us);
  native_cdc_reset();
  native_sync_reset();
  sim_array_init(&array, geometry.sensor_count, 1);
  array.world = (struct sim_world){.pressure_Pa = world_pressure_Pa};
  array.noise = 1.0;
  native_set_event_source(next_event_us, &array);
  port_set_event_handler(on_event, &app);
  array.parallel = rig_is_parallel;
  bus = *sim_array_bus(&array);
  bus.answers_are_single = rig_is_parallel;
  app_start(&app, &bus);
  wire_receiver_init(&receiver, wire_all_layouts);
  host_sequence = 0;
}

static inline void rig_power_up(void) { rig_power_up_at(0, false); }

static inline void rig_start(void) {
  memset(&press, 0, sizeof press);
  world_gain = NULL;
  world_field_Pa = NULL;
  native_flash_reset(1);
  rig_power_up();
}

static inline void rig_end(void) { TEST_ASSERT_FALSE_MESSAGE(native_watchdog_expired(), "the watchdog would have struck"); }

static inline enum native_end run_for(uint32_t ms) { return native_run_until(port_now_us() + 1000u * ms, main_round, &app); }

static inline void send_packet(struct wire_packet *packet) {
  uint8_t frame[WIRE_MAX_FRAME_BYTES];
  size_t length;
  packet->sequence = host_sequence++;
  packet->t_us = 123456789;
  TEST_ASSERT_EQUAL(FT_OK, wire_encode(wire_find_layout(wire_commands, packet->type), packet, frame, &length));
  TEST_ASSERT_EQUAL(FT_OK, native_cdc_send(frame, length));
}

/* The next packet that the host has received; false when there is none. */
static inline bool next_packet(struct wire_packet *packet) {
  uint8_t byte;
  while (native_cdc_receive(&byte, 1) == 1) {
    enum ft_status status = wire_receive(&receiver, byte, packet);
    if (status == FT_OK) {
      return true;
    }
    TEST_ASSERT_EQUAL_MESSAGE(FT_PENDING, status, "the device sent a damaged frame");
  }
  return false;
}

static inline void drop_packets(void) {
  for (struct wire_packet packet; next_packet(&packet);) {
  }
}

static inline bool next_of_type(uint8_t type, struct wire_packet *packet) {
  while (next_packet(packet)) {
    if (packet->type == type) {
      return true;
    }
  }
  return false;
}

static inline struct wire_contact newest_contact(void) {
  struct wire_packet packet;
  struct wire_contact newest = {0};
  while (next_of_type(WIRE_CONTACT, &packet)) {
    newest = packet.body.contact;
  }
  return newest;
}

/* Sends a command and returns the result of its acknowledgement; storing takes longer than others. */
static inline uint8_t ask(struct wire_packet command) {
  struct wire_packet packet;
  bool stores = (command.type >= WIRE_CMD_CALIBRATE && command.type <= WIRE_CMD_KEEP) || command.type == WIRE_CMD_PAD ||
                command.type == WIRE_CMD_ERASE_PAD;
  send_packet(&command);
  run_for(stores ? 100 : 30);
  TEST_ASSERT_TRUE_MESSAGE(next_of_type(WIRE_ACK, &packet), "no acknowledgement");
  TEST_ASSERT_EQUAL_HEX8(command.type, packet.body.ack.command);
  TEST_ASSERT_EQUAL_UINT16(host_sequence - 1, packet.body.ack.sequence);
  TEST_ASSERT_EQUAL_UINT64(123456789, packet.body.ack.host_time_us);
  return packet.body.ack.result;
}

#define COMMAND(NAME, name, ...) ((struct wire_packet){.type = WIRE_CMD_##NAME, .body.cmd_##name = {__VA_ARGS__}})

static inline void obey(struct wire_packet command) { TEST_ASSERT_EQUAL(WIRE_RESULT_DONE, ask(command)); }

/* The host opens the port, and time passes. */
static inline void connect_for(uint32_t ms) {
  native_cdc_open();
  run_for(ms);
}

static inline void start_streams(uint8_t streams) { obey(COMMAND(STREAM, stream, streams)); }

/* A calibration of this array: all sensors are alike. */
static inline struct wire_packet calibrate_command(struct calibration calibration) {
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    calibration.sensors[k] = (struct sensor_calibration){.gain = 1.0f, .gain_sd = 0.01f};
  }
  return COMMAND(CALIBRATE, calibrate, .sensor_count = geometry.sensor_count, .calibration = calibration);
}

static inline struct wire_info get_info(void) {
  struct wire_packet packet;
  obey((struct wire_packet){.type = WIRE_CMD_INFO});
  TEST_ASSERT_TRUE(next_of_type(WIRE_INFO, &packet));
  return packet.body.info;
}

static inline struct wire_health get_health(void) {
  struct wire_packet packet;
  obey((struct wire_packet){.type = WIRE_CMD_HEALTH});
  TEST_ASSERT_TRUE(next_of_type(WIRE_HEALTH, &packet));
  return packet.body.health;
}
