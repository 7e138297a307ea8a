#include "grasp/fingertip_grip.h"

#include "grasp/control/grip.hpp"
#include "grasp/settings.hpp"
#include "libfingertip/fingertip_values.hpp"

#include <algorithm>
#include <cmath>

using namespace fingertip;
using namespace fingertip::values;

static GripperTraits traits_of(const fingertip_grip_traits &given) {
  const double all[] = {given.stroke_mm,   given.step_mm,     given.speed_min_mm_s, given.speed_max_mm_s, given.deadband_mm,
                        given.force_min_N, given.force_max_N, given.latency_s,      given.poll_s};
  for (const double &value : all) {
    if (!(std::isfinite(value) && value >= 0.0 && (value > 0.0 || &value - all >= 4))) {
      throw Error(ErrorCode::bad_value, "a gripper's traits are numbers of at least 0; stroke, step and speeds above 0");
    }
  }
  if (given.speed_min_mm_s > given.speed_max_mm_s || given.force_min_N > given.force_max_N) {
    throw Error(ErrorCode::bad_value, "a gripper's traits have a least speed or force above the largest");
  }
  return {given, "gripper"};
}

using Values = std::map<std::string, double>; // by the name of the option, in its unit

// These, and those before that they leave.
static Values merged(Values wanted, const char *const *names, const double *values, size_t count) {
  for (std::size_t i = 0; i < count; i++) {
    const GraspSetting &setting = setting_of_field(names[i]);
    wanted[setting.name] = values[i] / setting.scale;
  }
  return wanted;
}

static bool has_null(const char *const *names, const double *values, size_t count) {
  return count > 0 && (!names || !values || std::find(names, names + count, nullptr) != names + count);
}

static bool is_time(double t_s) { return std::isfinite(t_s) && t_s >= 0.0; }

static fingertip_status null() { return failed(FINGERTIP_ERR_ARGUMENT, "a pointer is NULL"); }

struct fingertip_grip {
  GripperTraits traits;
  Values wanted;
  Grip grip;
};

struct fingertip_grip *fingertip_grip_new(const struct fingertip_grip_traits *traits, const char *const *names, const double *values,
                                          size_t count) {
  fingertip_grip *made = nullptr;
  guarded([&] {
    if (!traits || has_null(names, values, count)) {
      return null();
    }
    const GripperTraits own = traits_of(*traits);
    const Values wanted = merged({}, names, values, count);
    made = new fingertip_grip{own, wanted, Grip(settings_for(own, wanted, SettingName::field), own)};
    return FINGERTIP_OK;
  });
  return made;
}

void fingertip_grip_free(struct fingertip_grip *grip) { delete grip; }

enum fingertip_status fingertip_grip_set(struct fingertip_grip *grip, const char *const *names, const double *values, size_t count) {
  return guarded([&] {
    if (!grip || has_null(names, values, count)) {
      return null();
    }
    Values wanted = merged(grip->wanted, names, values, count);
    if (!grip->grip.change(settings_for(grip->traits, wanted, SettingName::field))) {
      return failed(FINGERTIP_ERR_VALUE, "the mode cannot change: set_N chooses it at the beginning");
    }
    grip->wanted = std::move(wanted);
    return FINGERTIP_OK;
  });
}

enum fingertip_status fingertip_grip_setting(const struct fingertip_grip *grip, const char *name, double *value) {
  return guarded([&] {
    if (!grip || !name || !value) {
      return null();
    }
    *value = grip->grip.settings().*setting_of_field(name).field;
    return FINGERTIP_OK;
  });
}

enum fingertip_status fingertip_grip_take_contact(struct fingertip_grip *grip, size_t finger, double t_s, const double *values,
                                                  size_t count) {
  return guarded([&] {
    if (!grip || !values || finger >= GRIP_FINGERS || count != count_of(WIRE_CONTACT) || !is_time(t_s)) {
      return failed(FINGERTIP_ERR_ARGUMENT, "give a contact packet's numbers, finger 0 or 1, and a time");
    }
    double numbers[FINGERTIP_VALUES_MOST];
    std::replace_copy_if(
        values, values + count, numbers, [](double value) { return !std::isfinite(value); }, 0.0);
    grip->grip.take(finger, touch_from_packet(packet_of(WIRE_CONTACT, numbers, count), 1e6 * t_s));
    return FINGERTIP_OK;
  });
}

enum fingertip_status fingertip_grip_take_answer(struct fingertip_grip *grip, const struct fingertip_grip_answer *answer) {
  if (!grip || !answer || !is_time(answer->t_s) || !std::isfinite(answer->width_mm)) {
    return failed(FINGERTIP_ERR_ARGUMENT, "an answer has a time and a width");
  }
  GripperStatus status;
  status.host_us = std::llround(1e6 * answer->t_s);
  status.active = answer->active != 0;
  status.moving = answer->moving != 0;
  status.width_mm = answer->width_mm;
  status.fault = answer->fault;
  grip->grip.take(status);
  return FINGERTIP_OK;
}

enum fingertip_status fingertip_grip_ask(struct fingertip_grip *grip, enum fingertip_grip_request request) {
  return !grip ? null() : grip->grip.request(request) ? FINGERTIP_OK : FINGERTIP_END;
}

enum fingertip_status fingertip_grip_step(struct fingertip_grip *grip, double now_s, struct fingertip_grip_command *command,
                                          struct fingertip_grip_report *report) {
  if (!grip || !command || !report || !is_time(now_s)) {
    return failed(FINGERTIP_ERR_ARGUMENT, "give a time, and where to write command and report");
  }
  GripCommand out;
  *report = grip->grip.step(now_s, out);
  *command = {out.width_mm, out.speed_mm_s, out.force_N, out.motion};
  return FINGERTIP_OK;
}
