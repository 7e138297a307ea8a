#include "tool/doctor/judge.hpp"

#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/advice.hpp"
#include "tool/doctor/wiring.hpp"

extern "C" {
#include "common/limits.h"
#include "ms58xx/ms58xx.h"
#include "ms58xx/sensors.h"
}

#include <algorithm>
#include <cmath>

namespace fingertip {

namespace {

/* The model of the rate is right within 3 % (wiring.cpp); what brings sensors up takes at most 5 %
 * of the time, and only while one is missing. */
constexpr double RATE_SHARE_MIN = 0.97;
/* No disturbance that the firmware mends by itself costs a quarter. */
constexpr double RATE_SHARE_BAD = 0.75;
/* Share of frames without a sensor's reading: a NACK a second leaves 1 % of 186 frames a second incomplete (firmware/scan/scan.h). */
constexpr double ABSENT_SHARE_MAX = 0.01;
constexpr double DOUBTFUL_SHARE_MAX = 0.01;
/* Times the data sheet's typical noise. An estimate from 20 steps has a standard deviation of 0.2:
 * twice is five of them. A sensor as far below it does not measure. */
constexpr double NOISE_WARN = 2, NOISE_BAD = 5, NOISE_DEAD = 0.1;
constexpr std::size_t STEPS_MIN = 20;
/* Barometers drift by up to 0.22 Pa/s, and the firmware's zero follows 0.5 (condition.h). */
constexpr double DRIFT_MAX_Pa_per_s = 0.5;
constexpr double DRIFT_SURE_sd = 3;
/* Each temperature moves a sensor's pressures until the next one comes, 2 s later at most (scan.h),
 * by its noise: 240 Pa/degC (readings.h), and rms of the data sheet by OSR. */
constexpr double TEMPERATURE_Pa_per_degC = 240, TEMPERATURE_INTERVAL_MAX_s = 2;
#define ROW(ratio, bits, max_us, noise_Pa, noise_degC)                                                                                     \
  { ratio, noise_degC }
constexpr std::pair<unsigned, double> TEMPERATURE_NOISE_degC[] = {MS58XX_OSR_TABLE(ROW)};
#undef ROW
/* A slope needs at least four temperatures. */
constexpr double DRIFT_SECONDS_MIN = 8;
/* The formulas of the family differ by powers of two and by what a count is (sensors.h). The formula
 * of one sensor turns another's codes into this multiple of the pressure, or this fraction. */
constexpr double OF_ANOTHER_TYPE = 20;
constexpr unsigned BUSY_MAX_permille = 950;

std::string list(const std::vector<unsigned> &sensors) {
  return (sensors.size() == 1 ? "sensor " : "sensors ") + joined(sensors, ", ", [](unsigned sensor) { return std::to_string(sensor); });
}

std::vector<unsigned> sensors_in(sensor_map bitmap) {
  std::vector<unsigned> sensors;
  for (unsigned k = 0; k < FT_MAX_SENSORS; k++) {
    if (bitmap >> k & 1u) {
      sensors.push_back(k);
    }
  }
  return sensors;
}

std::string percent(double share) { return fixed(100 * share, share < 0.1 ? 1 : 0) + " %"; }

std::string count(std::uint64_t number, const std::string &what) { return std::to_string(number) + " " + what + (number == 1 ? "" : "s"); }

constexpr unsigned SYNC_IN = 1; /* of info's field sync: others send the edges */

class Judge {
public:
  explicit Judge(const Facts &facts) : facts_(facts) {
    if (facts.info) {
      wiring_ = Wiring::of_board(text_field(facts.info->board));
      all_ = first_sensors(facts.info->sensor_count);
      missing_ = facts.after ? all_ & ~facts.after->sensors_present : 0;
    }
  }

  std::vector<Finding> findings() {
    if (facts_.knows_computer) {
      rule();
    }
    port();
    if (facts_.info) {
      firmware();
      stored();
    }
    if (facts_.after && facts_.info) {
      sensors();
      calibration_memories();
      bus();
      restarts();
      if (facts_.crash) {
        crash();
      }
      processor();
    }
    if (facts_.baseline && facts_.info) {
      rate();
      packets();
      if (facts_.info->sync == SYNC_IN) {
        sync();
      }
      at_rest();
    }
    return std::move(findings_);
  }

private:
  void add(Verdict verdict, const char *check, const std::string &text, const std::string &advice = "",
           const std::vector<unsigned> &sensors = {}) {
    findings_.push_back({verdict, check, text, advice, sensors});
  }

  /* "sensor 7 (strip 1, ...)" */
  std::string named(unsigned sensor) const {
    std::string text = list({sensor});
    return wiring_ && sensor < wiring_->sensor_count ? text + " (" + wiring_->place_text(sensor) + ")" : text;
  }

  std::string check_of(unsigned sensor) const {
    return wiring_ && sensor < wiring_->sensor_count ? wiring_->check_sensor(sensor) : "check its supply, data line and clock";
  }

  void rule() {
    bool denied = facts_.failure && facts_.failure->code == ErrorCode::permission_denied;
    const bool none = facts_.failure && facts_.failure->code == ErrorCode::not_simulated;
    const bool simulated = none || (facts_.info && is_simulated(*facts_.info));
    if ((simulated || !facts_.is_plugged_in) && !denied) {
      return;
    }
    if (facts_.rule.empty()) {
      add(denied ? Verdict::bad : Verdict::warn, "rule", "no udev rule lets users without privileges open fingertips",
          advice(ErrorCode::permission_denied));
    } else {
      add(Verdict::ok, "rule", facts_.rule + (denied ? "; it applies to devices that are plugged in from now on" : ""));
    }
  }

  std::string holders_text() const {
    return joined(facts_.holders.seen, ", ",
                  [](const Holder &holder) { return holder.name + " (process " + std::to_string(holder.process) + ")"; });
  }

  void port() {
    std::string holders = holders_text();
    if (!facts_.failure) {
      if (facts_.is_shared) {
        add(Verdict::ok, "port", facts_.port + (holders.empty() ? ", shared" : ", shared by " + holders));
      } else if (holders.empty()) {
        add(Verdict::ok, "port", facts_.port + (facts_.knows_computer ? ", no other program has it open" : ""));
      } else {
        add(Verdict::warn, "port", facts_.port + ": also open in " + holders, "end it: it takes bytes away");
      }
      return;
    }
    const Failure &failure = *facts_.failure;
    switch (failure.code) {
    case ErrorCode::port_in_use:
      if (holders.empty()) {
        add(Verdict::bad, "port", failure.text + (facts_.holders.all_seen ? "" : ", one of another user"),
            facts_.holders.all_seen ? advice(failure.code) : "end that one; `sudo fingertip doctor` names it");
      } else {
        add(Verdict::bad, "port", failure.text + ": " + holders, "end that one first");
      }
      break;
    case ErrorCode::permission_denied:
      add(Verdict::bad, "port", failure.text,
          facts_.rule.empty() ? "install the udev rule, see above"
                              : "plug it in again; where you are not logged in at the machine itself, your user must "
                                "be in the group plugdev");
      break;
    case ErrorCode::other_version:
    case ErrorCode::no_answer:
      add(Verdict::ok, "port", facts_.port);
      add(Verdict::bad, "protocol", failure.text, advice(failure.code));
      break;
    default: add(Verdict::bad, "port", failure.text, advice(failure.code));
    }
  }

  void firmware() {
    const wire_info &info = *facts_.info;
    add(Verdict::ok, "protocol", "version " + std::to_string(WIRE_VERSION));
    auto version = [](const auto &parts) {
      return std::to_string(parts[0]) + "." + std::to_string(parts[1]) + "." + std::to_string(parts[2]);
    };
    std::string text = version(info.firmware_version) + " (" + text_field(info.git_hash) + "), board " + text_field(info.board) +
                       ", scene " + text_field(info.scene);
    if (std::equal(facts_.tool_version.begin(), facts_.tool_version.end(), info.firmware_version)) {
      add(Verdict::ok, "firmware", text);
    } else {
      add(Verdict::warn, "firmware", text + "; this tool is of version " + version(facts_.tool_version),
          "install this tool's with `fingertip flash`, or use the other's tool");
    }
    if (is_simulated(info)) {
      add(Verdict::ok, "board", "none: its firmware runs on a computer, with simulated sensors");
    } else if (!wiring_ || wiring_->sensor_count != info.sensor_count) {
      add(Verdict::warn, "board", text_field(info.board) + " with " + count(info.sensor_count, "sensor") + " is unknown to this tool",
          "pins and the rate to expect are those of its own documents");
      wiring_.reset();
    }
  }

  void stored() {
    std::uint32_t stored = facts_.info->stored;
    if (stored & WIRE_STORED_DAMAGED) {
      add(Verdict::bad, "stored", "what it had stored cannot be read and is not used", "calibrate again, or set --keep");
    } else {
      add(Verdict::ok, "stored",
          std::string(stored & WIRE_STORED_CALIBRATION ? "a calibration" : "no calibration") +
              (stored & WIRE_STORED_SETTINGS ? " and settings" : ""));
    }
  }

  void missing_sensors() {
    if (missing_ == all_) {
      add(Verdict::bad, "sensors", "none of the " + std::to_string(facts_.info->sensor_count) + " sensors answers",
          wiring_ ? wiring_->check_all() : "check supply and clock", sensors_in(missing_));
      return;
    }
    sensor_map left = missing_;
    if (wiring_ && wiring_->has_multiplexers()) {
      for (unsigned strip = 0; strip * wiring_->sensors_of_strip < wiring_->sensor_count; strip++) {
        sensor_map of_strip = wiring_->sensors_of(strip);
        if ((left & of_strip) == of_strip) {
          left &= ~of_strip;
          missing_strip(strip, of_strip);
        }
      }
    }
    for (unsigned k : sensors_in(left)) {
      add(Verdict::bad, "sensors", named(k) + " does not answer", check_of(k), {k});
    }
  }

  /* A multiplexer that is silent costs NACKs. A line behind it that is held low stops the bus, and
   * the firmware tries it ever more rarely: so since start. */
  void missing_strip(unsigned strip, sensor_map sensors) {
    char address[8];
    std::snprintf(address, sizeof address, "0x%02x", *wiring_->place(strip * wiring_->sensors_of_strip).multiplexer);
    const bool held = facts_.after->bus_timeouts > 0;
    add(Verdict::bad, "sensors",
        "strip " + std::to_string(strip) + ", " + list(sensors_in(sensors)) + ": " +
            (held ? std::string("a line behind multiplexer ") + address + " is held low, it is kept shut"
                  : std::string("multiplexer ") + address + " does not answer"),
        held ? "take the sensors of that strip off one by one, or measure its SDn and SCn: 3.3 V at rest"
             : wiring_->check_multiplexer(strip),
        sensors_in(sensors));
  }

  void sensors() {
    std::size_t before = findings_.size();
    missing_sensors();
    if (facts_.baseline && are_of_another_type()) {
      add(Verdict::bad, "sensors",
          "they read " + fixed(middle_Pa() / 1000, 0) + " kPa at rest, as sensors do that are not those of the firmware",
          "install firmware that was built for them (cmake -DFINGERTIP_PAD=FILE.json), or the sensors that this one is "
          "for");
    } else if (facts_.baseline) {
      for (unsigned k = 0; k < facts_.baseline->sensors.size(); k++) {
        if (!(missing_ >> k & 1u)) {
          doubtful_sensor(k, facts_.baseline->sensors[k]);
        }
      }
    }
    if (findings_.size() == before) {
      add(Verdict::ok, "sensors", "all " + std::to_string(facts_.info->sensor_count) + " answer");
    }
  }

  void doubtful_sensor(unsigned k, const SensorBaseline &sensor) {
    bool memory_bad = facts_.after->sensors_prom_bad >> k & 1u;
    if (sensor.valid_share < 1 - ABSENT_SHARE_MAX && !memory_bad) {
      add(Verdict::warn, "sensors", named(k) + " has readings in " + percent(sensor.valid_share) + " of the frames only", check_of(k), {k});
    }
    if (sensor.saturated_share > 0) {
      add(Verdict::warn, "sensors", named(k) + " reads beyond its range, 1980 mbar", "release the pad; if it stays, replace it", {k});
    } else if (sensor.doubtful_share > DOUBTFUL_SHARE_MAX && !memory_bad) {
      add(Verdict::warn, "sensors",
          named(k) + " differs from the others: its pressure at rest, or a temperature that fits neither its own "
                     "before nor theirs",
          check_of(k) + "; if it stays, replace it", {k});
    }
    double apart_Pa = sensor.mean_Pa - middle_Pa();
    if (sensor.readings > 0 && std::abs(apart_Pa) > FT_APART_MAX_Pa) {
      add(Verdict::warn, "sensors", named(k) + " reads " + fixed(apart_Pa / 1000, 0) + " kPa apart from the others",
          "release the pad; if it stays, rubber presses on it or it is damaged", {k});
    }
  }

  bool are_of_another_type() const {
    const double middle = middle_Pa();
    auto is_air = [](double pressure_Pa) { return pressure_Pa >= FT_AIR_MIN_Pa && pressure_Pa <= FT_AIR_MAX_Pa; };
    return is_air(middle * OF_ANOTHER_TYPE) || is_air(middle / OF_ANOTHER_TYPE);
  }

  double middle_Pa() const {
    std::vector<double> means_Pa;
    for (const SensorBaseline &sensor : facts_.baseline->sensors) {
      if (sensor.readings > 0) {
        means_Pa.push_back(sensor.mean_Pa);
      }
    }
    std::sort(means_Pa.begin(), means_Pa.end());
    return means_Pa.empty() ? 0 : means_Pa[means_Pa.size() / 2];
  }

  void calibration_memories() {
    auto bad = sensors_in(facts_.after->sensors_prom_bad & all_);
    for (unsigned k : bad) {
      bool used = !(missing_ >> k & 1u);
      add(Verdict::bad, "prom",
          named(k) + (used ? " has a calibration memory (PROM) whose check sum is wrong: its pressures are doubtful"
                           : " has a calibration memory (PROM) that is blank: it is not used"),
          "power it off and on; if it stays, replace the sensor", {k});
    }
    if (bad.empty()) {
      add(Verdict::ok, "prom", "the calibration memories of all that answer are undamaged");
    }
  }

  double seconds() const { return facts_.baseline ? std::max(facts_.baseline->seconds, 1e-3) : 1; }

  void bus() {
    const wire_health &now = *facts_.after;
    const wire_health &then = facts_.before ? *facts_.before : now;
    std::uint32_t nacks = now.bus_nacks - then.bus_nacks, timeouts = now.bus_timeouts - then.bus_timeouts;
    std::uint32_t recoveries = now.bus_recoveries - then.bus_recoveries;
    std::uint32_t odd = now.implausible_readings - then.implausible_readings + now.zero_readings - then.zero_readings;
    std::string text = fixed(nacks / seconds(), 1) + " NACKs/s, " + std::to_string(recoveries) +
                       (recoveries == 1 ? " recovery, " : " recoveries, ") + count(timeouts, "timeout") + ", " + count(odd, "reading") +
                       " left out";
    if (nacks + timeouts + recoveries + odd == 0) {
      add(Verdict::ok, "bus", text + "; since its start " + count(now.bus_nacks, "NACK") + " and " + count(now.bus_timeouts, "timeout"));
    } else {
      add(Verdict::warn, "bus", text,
          missing_ ? "see to the missing sensors first" : "check wires, pull-ups and supply; keep motor cables away from them");
    }
  }

  void restarts() {
    const wire_health &now = *facts_.after;
    std::string up = "up for " + std::to_string(now.uptime_s) + " s";
    if (facts_.before && now.uptime_s < facts_.before->uptime_s) {
      add(Verdict::bad, "restarts", "it restarted while it was examined", "check its supply");
    } else if (now.watchdog_resets) {
      add(Verdict::warn, "restarts", up + ", " + count(now.watchdog_resets, "reset") + " by the watchdog since power-on",
          facts_.crash ? "see the crash below" : "if it does so again, check its supply and report it with the firmware's version");
    } else {
      add(Verdict::ok, "restarts", up + ", started by power or command");
    }
  }

  /* The last; the one before is not known any more. */
  void crash() {
    const Crash &crash = *facts_.crash;
    const std::string events = events_text(crash.record);
    const std::string text = joined(
        std::vector{crash_text(crash), events.empty() ? "" : "before that: " + events, registers_text(crash.record), crash.symbols_note},
        "; ");
    bool is_start = crash.record.kind == CRASH_START;
    add(is_start ? Verdict::warn : Verdict::bad, "crash", text,
        is_start ? "check its supply; if it stays, the board's crystal"
                 : "report this line with the firmware's version; power-off forgets it");
  }

  void processor() {
    const wire_health &now = *facts_.after;
    std::uint32_t skipped = facts_.before ? now.frames_skipped - facts_.before->frames_skipped : 0;
    std::string text = fixed(now.cpu_busy_permille / 10.0, 1) + " % busy, " + count(skipped, "frame") + " skipped";
    bool busy = now.cpu_busy_permille > BUSY_MAX_permille || skipped > 0;
    add(busy ? Verdict::warn : Verdict::ok, "processor", text,
        busy ? "choose a larger osr or a lower rate; missing sensors make the fit slower" : "");
    bool is_known = wiring_.has_value();
    if (is_known && (now.capabilities & WIRE_CAPABILITY_TANGENTIAL) && !(now.capabilities & WIRE_CAPABILITY_SECOND)) {
      add(Verdict::bad, "processor", "the second one does not run: the first does its work, at fewer frames a second",
          "power it off and on; if it stays, replace the Pico");
    }
    const unsigned free_min_bytes = is_known ? FT_STACK_RESERVED_bytes - FT_STACK_USED_MAX_bytes(wiring_->sensor_count) : 1;
    bool deep = now.stack_free_bytes < free_min_bytes;
    add(now.stack_free_bytes == 0 ? Verdict::bad
        : deep                    ? Verdict::warn
                                  : Verdict::ok,
        "stack", std::to_string(now.stack_free_bytes) + " bytes never used",
        deep ? "this is a fault of the firmware; report it with its version" : "");
  }

  void rate() {
    const Baseline &baseline = *facts_.baseline;
    const wire_info &info = *facts_.info;
    if (baseline.frames_made == 0) {
      add(Verdict::bad, "rate", "no frames came", missing_ == all_ ? "see to the sensors first" : "unplug it and plug it in again");
      return;
    }
    double rate_Hz = baseline.frames_made / seconds();
    std::string text = fixed(rate_Hz, 1) + " frames/s";
    auto expected_Hz = expected_rate_Hz(info);
    if (!expected_Hz) {
      add(Verdict::ok, "rate", text);
      return;
    }
    text += ", " + fixed(*expected_Hz, 1) + " expected (" +
            (info.rate_mHz ? fixed(info.rate_mHz / 1000.0, 1) + " asked for" : "as fast as it can") + ", OSR " + std::to_string(info.osr) +
            ")";
    double share = rate_Hz / *expected_Hz;
    Verdict verdict = share < RATE_SHARE_BAD ? Verdict::bad : share < RATE_SHARE_MIN ? Verdict::warn : Verdict::ok;
    add(verdict, "rate", text,
        verdict == Verdict::ok ? ""
        : missing_             ? "see to the missing sensors first"
                               : "see the bus: disturbed operations are done again");
  }

  void packets() {
    const LineStatistics &line = facts_.line;
    std::uint64_t damaged = line.crc_errors + line.format_errors;
    std::uint32_t dropped = facts_.before && facts_.after ? facts_.after->packets_dropped - facts_.before->packets_dropped : 0;
    std::string text =
        count(line.packets, "packet") + ", " + std::to_string(line.dropped_packets) + " lost, " + std::to_string(damaged) + " damaged";
    const bool ok = line.dropped_packets + damaged == 0;
    text += !ok && dropped > 0 ? ", " + std::to_string(dropped) + " of them dropped by the fingertip" : "";
    add(ok ? Verdict::ok : Verdict::warn, "packets", text,
        ok            ? ""
        : dropped > 0 ? "this computer or its hub does not take them fast enough"
                      : "try another cable, and no hub");
  }

  void sync() {
    const Baseline &baseline = *facts_.baseline;
    std::string text = count(baseline.edges, "edge") + " at the sync pin in " + fixed(baseline.seconds, 1) + " s";
    if (baseline.edges_missing > 0) {
      add(Verdict::warn, "sync", text + ", " + std::to_string(baseline.edges_missing) + " missing",
          "slower pulses; a ringing wire gives edges too: join the grounds, keep it short");
    } else if (baseline.edges > 0) {
      add(Verdict::ok, "sync", text);
    } else {
      add(Verdict::warn, "sync", text,
          "join the pin and ground with the other side's, 3.3 V at most, and let that pulse; or `fingertip set "
          "sync=off`");
    }
  }

  void at_rest() {
    const Baseline &baseline = *facts_.baseline;
    bool touched = baseline.frames_touched > 0;
    std::size_t readings = 0;
    for (const SensorBaseline &sensor : baseline.sensors) {
      readings = std::max(readings, sensor.readings);
    }
    bool noisy = false;
    if (baseline.sensors.empty() || readings <= STEPS_MIN) {
      add(Verdict::warn, "noise",
          baseline.sensors.empty() ? "not measured: no readings came" : "not measured: " + count(readings, "reading") + " are too few",
          !(facts_.info->capabilities & WIRE_CAPABILITY_RAW_STREAM) ? "this firmware streams none; use scene grasp or raw"
                                                                    : "measure longer, with --seconds");
    } else {
      noisy = noise();
    }
    zero(noisy);
    if (!touched && readings > STEPS_MIN) {
      drift();
    }
  }

  /* Whether there is any. */
  bool noise() {
    auto typical_Pa = expected_noise_Pa(facts_.info->osr);
    if (!typical_Pa) {
      return false;
    }
    std::string sheet = fixed(*typical_Pa, 1) + " Pa in the data sheet at OSR " + std::to_string(facts_.info->osr);
    double most_Pa = 0;
    bool any = false, dead = false;
    for (unsigned k = 0; k < facts_.baseline->sensors.size(); k++) {
      const SensorBaseline &sensor = facts_.baseline->sensors[k];
      if (!sensor.noise_Pa || sensor.readings <= STEPS_MIN) {
        continue;
      }
      double times = *sensor.noise_Pa / *typical_Pa;
      std::string text = named(k) + " has a noise of " + fixed(*sensor.noise_Pa, 1) + " Pa rms, " + sheet;
      if (times < NOISE_DEAD) {
        dead = true;
        add(Verdict::bad, "noise", text + ": its readings do not change", "replace the sensor", {k});
      } else if (times > NOISE_WARN) {
        any = true;
        add(times > NOISE_BAD ? Verdict::bad : Verdict::warn, "noise", text,
            "check the capacitor at its supply, and its joints; else replace it", {k});
      }
      most_Pa = std::max(most_Pa, *sensor.noise_Pa);
    }
    if (!any && !dead) {
      add(Verdict::ok, "noise", "at most " + fixed(most_Pa, 1) + " Pa rms, " + sheet);
    }
    return any;
  }

  void zero(bool noisy) {
    const Baseline &baseline = *facts_.baseline;
    if (baseline.frames_received == 0) {
      return;
    }
    if (baseline.frames_touched > 0) {
      double share = static_cast<double>(baseline.frames_touched) / static_cast<double>(baseline.frames_received);
      add(Verdict::warn, "zero",
          std::string(noisy ? "contact is reported in " : "something touches the pad in ") + percent(share) +
              " of the frames: drift was not measured",
          noisy ? "see to the noise first; else let go of the pad and run this again"
                : "let go of the pad and run this again; where nothing touches it, `fingertip tare --force`");
    } else if (!(baseline.last_flags & CONTACT_FLAG_TARED)) {
      add(Verdict::warn, "zero", "not every sensor has one", "let go of the pad, then `fingertip tare`");
    } else if (baseline.last_flags & CONTACT_FLAG_ZERO_DOUBTFUL) {
      add(Verdict::warn, "zero", "the pressure may be a zero that has moved", "`fingertip tare` where nothing touches the pad");
    } else {
      add(Verdict::ok, "zero", "tared, and nothing touches the pad");
    }
  }

  /* The sd of a slope through steps of the temperature, as long as they may last. */
  double temperature_sd_Pa_per_s() const {
    for (auto [osr, noise_degC] : TEMPERATURE_NOISE_degC) {
      if (osr == facts_.info->osr) {
        return TEMPERATURE_Pa_per_degC * noise_degC * std::sqrt(12 * TEMPERATURE_INTERVAL_MAX_s / seconds()) / seconds();
      }
    }
    return 0;
  }

  bool is_steep(const Slope &slope) const {
    double sd_Pa_per_s = std::hypot(slope.sd_Pa_per_s, temperature_sd_Pa_per_s());
    return std::abs(slope.Pa_per_s) - DRIFT_SURE_sd * sd_Pa_per_s > DRIFT_MAX_Pa_per_s;
  }

  void drift() {
    const Baseline &baseline = *facts_.baseline;
    if (baseline.seconds < DRIFT_SECONDS_MIN) {
      add(Verdict::ok, "drift", "not measured: it takes " + fixed(DRIFT_SECONDS_MIN, 0) + " s at least");
      return;
    }
    std::string followed = "; the zero follows " + fixed(DRIFT_MAX_Pa_per_s, 1);
    double most_Pa_per_s = 0;
    bool any = false;
    for (unsigned k = 0; k < baseline.sensors.size(); k++) {
      if (!baseline.sensors[k].drift) {
        continue;
      }
      const Slope &slope = *baseline.sensors[k].drift;
      most_Pa_per_s = std::max(most_Pa_per_s, std::abs(slope.Pa_per_s));
      if (is_steep(slope)) {
        any = true;
        add(Verdict::warn, "drift", named(k) + " drifts by " + fixed(slope.Pa_per_s, 1) + " Pa/s" + followed,
            "let it rest and warm up for some minutes; if it stays, check the joints under it", {k});
      }
    }
    if (baseline.common_drift && is_steep(*baseline.common_drift)) {
      any = true;
      add(Verdict::warn, "drift", "all sensors together drift by " + fixed(baseline.common_drift->Pa_per_s, 1) + " Pa/s" + followed,
          "let it warm up for some minutes; the air of the room may move too");
    }
    if (!any) {
      add(Verdict::ok, "drift", "at most " + fixed(most_Pa_per_s, 2) + " Pa/s, known to " + fixed(temperature_sd_Pa_per_s(), 2) + followed);
    }
  }

  const Facts &facts_;
  std::optional<Wiring> wiring_;
  sensor_map all_ = 0, missing_ = 0; /* bitmaps */
  std::vector<Finding> findings_;
};

} // namespace

std::vector<Finding> judge(const Facts &facts) { return Judge(facts).findings(); }

Verdict worst_of(const std::vector<Finding> &findings) {
  Verdict worst = Verdict::ok;
  for (const Finding &finding : findings) {
    worst = std::max(worst, finding.verdict);
  }
  return worst;
}

std::string verdict_text(Verdict verdict) { return verdict == Verdict::ok ? "ok" : verdict == Verdict::warn ? "warn" : "bad"; }

std::optional<double> expected_rate_Hz(const wire_info &info) {
  double asked_Hz = info.rate_mHz / 1000.0;
  auto wiring = Wiring::of_board(text_field(info.board));
  const ms58xx_osr *osr = ms58xx_find_osr(info.osr);
  if (!wiring || !osr || wiring->sensor_count != info.sensor_count) {
    return std::nullopt;
  }
  double most_Hz = 1e6 / (osr->conversion_us + wiring->overhead_us);
  return info.rate_mHz == 0 ? most_Hz : std::min(asked_Hz, most_Hz);
}

std::optional<double> expected_noise_Pa(unsigned osr) {
  const ms58xx_osr *row = ms58xx_find_osr(static_cast<std::uint16_t>(osr));
  return row ? std::optional(row->noise_Pa_q10 / 1024.0) : std::nullopt;
}

} // namespace fingertip
