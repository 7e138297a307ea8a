#include "simulation/cell/fingertip_cell_finger.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/random.hpp"
#include "libfingertip/served_port.hpp"
#include "libfingertip/session.hpp"
#include "library/pad/profile.hpp"
#include "simulation/player/native_fingertip.h"
#include "tool/advice.hpp"

extern "C" {
#include "native/native_cdc.h"
#include "native/native_port.h"
}

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <sys/prctl.h>
#include <unistd.h>
#include <vector>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { CALIBRATION = 841 };

constexpr std::uint64_t COMMAND_us = 100'000, SETTLED_us = 1'500'000;

class Fingertip {
public:
  Fingertip(const FingerProcess &finger, SharedPressures &pressures)
      : finger_(finger), pressures_(pressures), pad_(pad::profile_over_own_sensors({LAYER_mm, 0.0, false})), port_(finger.link) {
    power_up();
  }

  // Until this process ends, or the firmware does.
  void run() {
    for (;;) {
      if (pressures_.frozen) {
        wait_until(host_now() + finger_.round);
        continue;
      }
      poll_port();
      const std::int64_t known_us = pressures_.newest_us();
      while (!requests_.empty() && requests_.front().host_us <= known_us) {
        const Request &request = requests_.front();
        run_to(request.host_us);
        if (native_cdc_send(request.bytes.data(), request.bytes.size()) != FT_OK) {
          break; // held off, as by USB
        }
        requests_.pop_front();
      }
      run_to(known_us);
      pressures_.reached_us = known_us;
      answer();
    }
  }

private:
  struct Request { // by the host
    std::int64_t host_us;
    std::vector<std::uint8_t> bytes;
  };

  // With zero, calibration and pad, before anybody asks.
  void power_up() {
    native_set_serial_number(finger_.serial.c_str());
    native_fingertip_settings settings{};
    settings.seed = finger_.seed;
    settings.noise = 1.0;
    settings.prom_spread = 0.03;
    settings.parallel_bus = finger_.parallel_bus;
    settings.world = {
        this,
        [](void *context, unsigned sensor, std::uint64_t t_us) { return static_cast<Fingertip *>(context)->pressure_Pa(sensor, t_us); },
        nullptr};
    if (!native_fingertip_start(&settings)) {
      throw Error("the firmware of this build does not start");
    }
    native_cdc_open();
    run_device_to(SETTLED_us);
    if (finger_.calibrated_sd) {
      Random random(finger_.seed, CALIBRATION, 0);
      order(command_calibrate(calibrated(finger_.gain, *finger_.calibrated_sd, 1.0, pad_, random), geometry.sensor_count));
    }
    order(command_pad(pad_));
    native_cdc_close();
  }

  void order(const wire_packet &command) {
    const std::vector<std::uint8_t> bytes = frame_bytes(command);
    bool is_done = false;
    if (native_cdc_send(bytes.data(), bytes.size()) == FT_OK) {
      run_device_to(device_us_ + COMMAND_us);
      Decoder decoder;
      std::uint8_t came[NATIVE_CDC_TRANSMIT_BYTES];
      for (std::size_t count; (count = native_cdc_receive(came, sizeof came)) > 0;) {
        decoder.feed(came, count, [&](const wire_packet &packet) {
          is_done = is_done || (packet.type == WIRE_ACK && packet.body.ack.result == WIRE_RESULT_DONE);
        });
      }
    }
    if (!is_done) {
      throw Error("the firmware refuses its calibration or its pad");
    }
  }

  double pressure_Pa(unsigned sensor, std::uint64_t t_us) const {
    if (!zero_us_) {
      return AIR_Pa;
    }
    const auto host_us = *zero_us_ + static_cast<std::int64_t>(t_us);
    return AIR_Pa + finger_.gain[sensor] * pressures_.at(host_us, sensor);
  }

  void run_to(std::int64_t host_us) {
    if (host_us == 0) {
      return; // the world has not begun
    }
    if (!zero_us_) {
      zero_us_ = host_us - static_cast<std::int64_t>(device_us_);
      pressures_.zero_us = *zero_us_;
    }
    if (host_us - *zero_us_ > static_cast<std::int64_t>(device_us_)) {
      run_device_to(static_cast<std::uint64_t>(host_us - *zero_us_));
    }
  }

  void run_device_to(std::uint64_t t_us) {
    if (!native_fingertip_run_until(t_us)) {
      throw Error("the firmware ended itself");
    }
    device_us_ = t_us;
  }

  void poll_port() {
    port_.wait(host_now() + finger_.round);
    if (port_.is_open() != is_open_) {
      is_open_ = port_.is_open();
      if (is_open_) {
        native_cdc_open();
      } else {
        native_cdc_stall(false);
        native_cdc_close();
        requests_.clear();
        unsent_.clear();
      }
    }
    std::uint8_t bytes[NATIVE_CDC_RECEIVE_BYTES];
    if (const std::size_t count = port_.read(bytes, sizeof bytes)) {
      decoder_.feed(bytes, count, [this](const wire_packet &packet) { pressures_.rates_set += packet.type == WIRE_CMD_RATE; });
      requests_.push_back({steady_now_us(), {bytes, bytes + count}});
    }
  }

  // A host that does not read holds the firmware off.
  void answer() {
    std::uint8_t bytes[NATIVE_CDC_TRANSMIT_BYTES];
    for (;;) {
      if (unsent_.empty()) {
        native_cdc_stall(false);
        const std::size_t count = native_cdc_receive(bytes, sizeof bytes);
        unsent_.assign(bytes, bytes + count);
      }
      if (unsent_.empty() || !is_open_) {
        return;
      }
      const std::size_t taken = port_.write(unsent_.data(), unsent_.size());
      unsent_.erase(unsent_.begin(), unsent_.begin() + static_cast<std::ptrdiff_t>(taken));
      if (!unsent_.empty()) {
        native_cdc_stall(true);
        return;
      }
    }
  }

  const FingerProcess &finger_;
  SharedPressures &pressures_;
  const pad_profile pad_;
  ServedPort port_;
  bool is_open_ = false;
  std::deque<Request> requests_;
  Decoder decoder_;
  std::vector<std::uint8_t> unsent_; // of what the firmware has sent
  std::uint64_t device_us_ = 0;
  std::optional<std::int64_t> zero_us_; // host's time of the fingertip's 0
};

} // namespace

void SharedPressures::put(std::int64_t host_us, const Pressures &pressures) {
  const std::uint64_t count = count_.load(std::memory_order_relaxed);
  Sample &next = samples_[count % KEPT];
  next.host_us.store(host_us, std::memory_order_relaxed);
  for (std::size_t k = 0; k < SENSORS; k++) {
    next.pressure_Pa[k].store(static_cast<float>(pressures[k]), std::memory_order_relaxed);
  }
  count_.store(count + 1, std::memory_order_release);
}

double SharedPressures::at(std::int64_t host_us, std::size_t sensor) const {
  const std::uint64_t count = count_.load(std::memory_order_acquire);
  if (count == 0) {
    return 0.0;
  }
  // Only half of them, so that none is overwritten while it is read.
  const std::uint64_t oldest = count > KEPT / 2 ? count - KEPT / 2 : 0;
  std::uint64_t i = count - 1;
  const auto time_us = [&](std::uint64_t number) { return sample(number).host_us.load(std::memory_order_relaxed); };
  const auto pressure_Pa = [&](std::uint64_t number) {
    return static_cast<double>(sample(number).pressure_Pa[sensor].load(std::memory_order_relaxed));
  };
  while (i > oldest && time_us(i) > host_us) {
    i--;
  }
  if (i + 1 == count || time_us(i) >= host_us) {
    return pressure_Pa(i);
  }
  const double share = static_cast<double>(host_us - time_us(i)) / static_cast<double>(time_us(i + 1) - time_us(i));
  return (1.0 - share) * pressure_Pa(i) + share * pressure_Pa(i + 1);
}

pid_t start_finger(const FingerProcess &finger, SharedPressures &pressures) {
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    throw Error(std::string("no process to be had for a fingertip (") + std::strerror(errno) + ")");
  }
  if (child > 0) {
    clock_expects(child);
    return child;
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) {
    std::_Exit(1);
  }
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_DFL);
  try {
    Fingertip(finger, pressures).run();
  } catch (const Error &error) {
    print_error("fingertip", error);
  } catch (const std::exception &error) {
    print_error("fingertip", Error(error.what()));
  }
  std::_Exit(1);
}

} // namespace fingertip::cell
