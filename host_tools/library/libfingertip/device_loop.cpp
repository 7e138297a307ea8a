#include "libfingertip/device_loop.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

namespace fingertip {

using std::chrono::milliseconds;
using Kind = DeviceUpdate::Kind;

constexpr milliseconds POLL{20};
constexpr milliseconds REOPEN_INTERVAL{200};
/* Without a frame for this time the streams are requested again: the device may have restarted without the port noticing. */
constexpr milliseconds REVIVE_AFTER{3000};
/* Exchanges before the streams begin, when nothing delays them; then one this often. */
constexpr int FIRST_EXCHANGES = 32;
constexpr milliseconds EXCHANGE_INTERVAL{100};
/* How far behind a loop may be with reading, for the others' rows to wait for it. */
constexpr std::int64_t LONGEST_BACKLOG_us = 2000000;
/* Of each fingertip: three seconds of 1308 frames/s of two packets. */
constexpr std::size_t FEED_CAPACITY = 8000;
constexpr Session::Policy LAST_WORD = {milliseconds(500), 2};

std::vector<DeviceUpdate> DeviceFeed::take(milliseconds timeout) {
  std::unique_lock<std::mutex> lock(mutex_);
  for (const HostTime limit = host_now() + timeout; updates_.empty() && host_now() < limit;) {
    lock.unlock();
    filled_.wait(limit);
    lock.lock();
  }
  std::vector<DeviceUpdate> taken(std::make_move_iterator(updates_.begin()), std::make_move_iterator(updates_.end()));
  updates_.clear();
  waiting_.clear();
  drained_.set();
  return taken;
}

void DeviceFeed::put(DeviceUpdate update, const std::atomic<bool> &abandoned) {
  std::unique_lock<std::mutex> lock(mutex_);
  while (waiting_[update.device] >= FEED_CAPACITY && !abandoned) {
    lock.unlock();
    drained_.wait(host_now() + POLL); /* another loop may take what was meant for this one */
    lock.lock();
  }
  if (!abandoned) {
    waiting_[update.device]++;
    updates_.push_back(std::move(update));
    filled_.set();
  }
}

void DeviceFeed::wake() { drained_.set(); }

DeviceLoop::DeviceLoop(std::size_t number, const Endpoint &endpoint, const Options &options, DeviceFeed &feed)
    : number_(number), options_(options), feed_(feed), transport_(open_endpoint(endpoint)),
      session_(*transport_, [this] { return stop_ && !ending_; }), name_(transport_->description()) {
  if (options.follow_clock) {
    session_.on_exchange([this](const ClockExchange &exchange) {
      fit_.add(exchange);
      if (started_) {
        DeviceUpdate update{Kind::clock, number_};
        update.estimate = *fit_.estimate();
        update.jumps = fit_.jumps();
        put(std::move(update));
      }
    });
  }
  if (options.bytes) {
    session_.on_bytes([this](const std::uint8_t *bytes, std::size_t length) {
      DeviceUpdate update{Kind::bytes, number_};
      update.bytes.assign(bytes, bytes + length);
      put(std::move(update));
    });
  }
  session_.on_packet([this](const wire_packet &packet) { take(packet); });
  thread_ = Thread([this] { run(); });
}

DeviceLoop::~DeviceLoop() {
  stop_ = true;
  abandoned_ = true;
  feed_.wake();
  thread_.join();
}

void DeviceLoop::send(const wire_packet &command) {
  std::lock_guard<std::mutex> lock(mutex_);
  wanted_.push_back(command);
}

std::string DeviceLoop::name() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return name_;
}

LineStatistics DeviceLoop::statistics() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return statistics_;
}

double DeviceLoop::read_until_us() const {
  return nothing_expected_ ? std::numeric_limits<double>::infinity() : static_cast<double>(read_until_us_);
}

void DeviceLoop::rethrow() const {
  if (failure_) {
    std::rethrow_exception(failure_);
  }
}

void DeviceLoop::run() {
  try {
    stream();
  } catch (const Interrupted &) {
  } catch (...) {
    failure_ = std::current_exception();
  }
  publish();
  nothing_expected_ = true;
  put(Kind::ended);
}

void DeviceLoop::stream() {
  for (bool again = false;; again = info_.has_value()) {
    try {
      greet(again);
      follow();
      end_streams();
      return;
    } catch (const Gone &) {
      nothing_expected_ = true;
      held_.clear();
      if (!std::exchange(gone_, true)) {
        put(Kind::gone);
      }
    }
    if (!options_.wait_for_back || ending_) {
      return;
    }
    wait_for_port();
  }
}

/* Who is there, and how its clock goes. */
void DeviceLoop::greet(bool again) {
  fit_ = ClockFit();
  wire_packet info = session_.info();
  if (again && std::memcmp(info.body.info.serial, info_->serial, WIRE_TEXT_BYTES) != 0) {
    throw Error(ErrorCode::other_fingertip, name() + ": another fingertip came back there; it had " + text_field(info_->serial) + ", now " +
                                                text_field(info.body.info.serial));
  }
  fit_ = ClockFit(); /* the first answers may have waited for the device to start */
  for (int i = 0; options_.follow_clock && i < FIRST_EXCHANGES; i++) {
    session_.command(command_stream(0));
  }
  DeviceUpdate update{again ? Kind::back : Kind::ready, number_};
  update.health = session_.health().body.health;
  update.packet = session_.info();
  update.relation = session_.clock();
  update.host_us = static_cast<double>(steady_now_us());
  info_ = update.packet.body.info;
  streams_ = possible_streams(*info_, options_.streams);
  publish();
  read_until_us_ = steady_now_us();
  nothing_expected_ = false;
  gone_ = false;
  for (DeviceUpdate &answer : std::exchange(held_, {})) {
    put(std::move(answer));
  }
  put(std::move(update));
  while (!started_) {
    if (stop_) {
      throw Interrupted();
    }
    wait_until(host_now() + milliseconds(2));
  }
  session_.command(command_stream(streams_));
  asked_ = last_frame_ = host_now();
}

void DeviceLoop::follow() {
  while (!stop_) {
    std::int64_t begun_us = steady_now_us();
    Transport::Result result = session_.poll(POLL);
    publish();
    if (result == Transport::Result::gone) {
      throw Gone(name() + ": vanished");
    }
    if (result == Transport::Result::timeout) {
      read_until_us_ = begun_us;
    }
    send_wanted();
    /* Repeating the wish is an exchange, and wakes a device that restarted unnoticed. */
    auto now = host_now();
    if (options_.follow_clock ? now - asked_ >= EXCHANGE_INTERVAL : now - std::max(asked_, last_frame_) > REVIVE_AFTER) {
      session_.send(command_stream(streams_));
      asked_ = now;
    }
  }
}

void DeviceLoop::send_wanted() {
  std::unique_lock<std::mutex> lock(mutex_);
  std::deque<wire_packet> commands = std::exchange(wanted_, {});
  lock.unlock();
  for (const wire_packet &command : commands) {
    session_.send(command);
  }
}

void DeviceLoop::wait_for_port() {
  while (!session_.reopen()) {
    if (stop_) {
      throw Interrupted();
    }
    wait_until(host_now() + REOPEN_INTERVAL);
  }
  publish();
}

void DeviceLoop::end_streams() {
  ending_ = true;
  try {
    session_.command(command_stream(0), LAST_WORD);
  } catch (const Gone &) {
    throw;
  } catch (const Error &) {
    put(Kind::mute);
  }
}

void DeviceLoop::take(const wire_packet &packet) {
  std::int64_t now_us = steady_now_us();
  DeviceUpdate update{Kind::packet, number_};
  update.packet = packet;
  update.host_us = fit_.estimate() ? fit_.estimate()->host_at(packet.t_us) : static_cast<double>(now_us);
  if (is_frame(packet)) {
    last_frame_ = host_now();
  }
  auto until_us = std::clamp(static_cast<std::int64_t>(update.host_us), now_us - LONGEST_BACKLOG_us, now_us);
  put(std::move(update));
  read_until_us_ = until_us;
}

void DeviceLoop::publish() {
  std::lock_guard<std::mutex> lock(mutex_);
  statistics_ = session_.statistics();
  name_ = transport_->description();
}

/* What a fingertip answers before its port vanishes again is as if it never was. */
void DeviceLoop::put(DeviceUpdate update) {
  if (gone_ && (update.kind == Kind::packet || update.kind == Kind::clock)) {
    held_.push_back(std::move(update));
  } else {
    feed_.put(std::move(update), abandoned_);
  }
}

void DeviceLoop::put(Kind kind) { put(DeviceUpdate{kind, number_}); }

} // namespace fingertip
