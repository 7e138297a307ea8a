#include "cli/joint.hpp"

#include "cli/monitor.hpp"
#include "libfingertip/clock_fit.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/recording.hpp"
#include "libfingertip/recording_transport.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>
#include <unistd.h>
#include <utility>

namespace fingertip {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds POLL{20};
constexpr milliseconds REOPEN_INTERVAL{200};
/* Exchanges before the streams begin, when nothing delays them; then one this often. */
constexpr int FIRST_EXCHANGES = 32;
constexpr milliseconds EXCHANGE_INTERVAL{100};
/* How long a row may wait for earlier ones of the others. */
constexpr double SETTLE_us = 250e3;
/* How far behind a fingertip's thread may be with reading, for the others' rows to wait for it. */
constexpr std::int64_t LONGEST_BACKLOG_us = 2000000;
constexpr milliseconds SHOW_INTERVAL{1000};

struct Item {
  enum class Kind { packet, event, clock } kind;
  std::size_t device;
  wire_packet packet;
  double host_us;
  std::string event;
  ClockEstimate clock;
  unsigned jumps;
};

/* From the threads of the fingertips to the one that writes. */
class Queue {
public:
  void put(Item item) {
    std::lock_guard<std::mutex> lock(mutex_);
    items_.push_back(std::move(item));
    changed_.notify_one();
  }
  std::vector<Item> take(milliseconds timeout) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait_for(lock, timeout, [this] { return !items_.empty(); });
    return std::exchange(items_, {});
  }

private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Item> items_;
};

class Fingertip {
public:
  Fingertip(std::size_t number, const Way &way, std::uint8_t streams, Queue &queue,
            const std::atomic<bool> &started, const std::atomic<bool> &stop)
      : number_(number), streams_(streams), queue_(queue), started_(started), stop_(stop),
        transport_(open_way(way)), session_(*transport_, [this] { return stop_.load(); }) {
    session_.on_exchange([this](const ClockExchange &exchange) {
      fit_.add(exchange);
      put_clock();
    });
    session_.on_packet([this](const wire_packet &packet) { take(packet); });
    thread_ = std::thread([this] { run(); });
  }
  ~Fingertip() { thread_.join(); }
  Fingertip(const Fingertip &) = delete;
  Fingertip &operator=(const Fingertip &) = delete;

  bool is_ready() const { return ready_; }
  bool is_gone() const { return gone_; }
  bool has_ended() const { return ended_; }
  bool is_stalled() const {
    return 1e-6 * static_cast<double>(steady_now_us() - last_frame_us_) > STALLED_s;
  }
  /* Until when everything that came was read, on the host's clock; no more is expected of one that
   * is gone. */
  double read_until_us() const {
    return is_gone() || has_ended() ? std::numeric_limits<double>::infinity()
                                    : static_cast<double>(read_until_us_);
  }
  std::string name() const { return transport_->description(); }
  /* Once it is ready. */
  const wire_packet &info_packet() const { return info_; }
  const wire_info &info() const { return info_.body.info; }
  /* Once it has ended. */
  const LineStatistics &statistics() const { return session_.statistics(); }
  void rethrow() const {
    if (failure_) {
      std::rethrow_exception(failure_);
    }
  }

private:
  void run() {
    try {
      stream();
    } catch (const Interrupted &) {
    } catch (...) {
      failure_ = std::current_exception();
    }
    ended_ = true;
  }

  void stream() {
    info_ = greet();
    ready_ = true;
    while (!started_) {
      if (stop_) {
        return;
      }
      std::this_thread::sleep_for(milliseconds(2));
    }
    send_streams();
    while (!stop_) {
      std::int64_t begun_us = steady_now_us();
      Transport::Result result = session_.poll(POLL);
      if (result == Transport::Result::timeout) {
        read_until_us_ = begun_us;
      } else if (result == Transport::Result::gone) {
        come_back();
        continue;
      }
      if (Clock::now() - asked_ >= EXCHANGE_INTERVAL) {
        /* repeating the wish is an exchange, and wakes a device that restarted unnoticed */
        send_streams();
      }
    }
    end_streams();
  }

  wire_packet greet() {
    fit_ = ClockFit();
    wire_packet info = session_.info();
    fit_ = ClockFit(); /* the first answers may have waited for the device to start */
    for (int i = 0; i < FIRST_EXCHANGES; i++) {
      session_.command(command_stream(0));
    }
    return info;
  }

  void send_streams() {
    session_.send(command_stream(streams_));
    asked_ = Clock::now();
  }

  void come_back() {
    gone_ = true;
    put_event(EVENT_GONE);
    for (;;) {
      while (!session_.reopen()) {
        if (stop_) {
          throw Interrupted();
        }
        std::this_thread::sleep_for(REOPEN_INTERVAL);
      }
      try {
        wire_packet info = greet();
        if (std::memcmp(info.body.info.serial, this->info().serial, WIRE_TEXT_BYTES) != 0) {
          throw Error(name() + ": another fingertip came back there; start a new recording");
        }
        break;
      } catch (const Gone &) {
      }
    }
    put_event("back");
    read_until_us_ = steady_now_us();
    gone_ = false;
    send_streams();
  }

  void end_streams() {
    Session last(*transport_);
    try {
      last.command(command_stream(0), {milliseconds(500), 2});
    } catch (const Error &) {
    }
  }

  void take(const wire_packet &packet) {
    if (!started_ || !fit_.estimate()) {
      return;
    }
    if (packet.type == WIRE_CONTACT || packet.type == WIRE_RAW) {
      last_frame_us_ = steady_now_us();
    }
    Item item{};
    item.kind = Item::Kind::packet;
    item.device = number_;
    item.packet = packet;
    item.host_us = fit_.estimate()->host_at(packet.t_us);
    std::int64_t now_us = steady_now_us();
    auto until_us =
        std::clamp(static_cast<std::int64_t>(item.host_us), now_us - LONGEST_BACKLOG_us, now_us);
    queue_.put(std::move(item));
    read_until_us_ = until_us;
  }

  void put_clock() {
    if (started_) {
      Item item{};
      item.kind = Item::Kind::clock;
      item.device = number_;
      item.clock = *fit_.estimate();
      item.jumps = fit_.jumps();
      queue_.put(std::move(item));
    }
  }

  void put_event(const std::string &text) {
    Item item{};
    item.kind = Item::Kind::event;
    item.device = number_;
    item.event = text;
    queue_.put(std::move(item));
  }

  std::size_t number_;
  std::uint8_t streams_;
  Queue &queue_;
  const std::atomic<bool> &started_;
  const std::atomic<bool> &stop_;
  std::unique_ptr<Transport> transport_;
  Session session_;
  ClockFit fit_;
  Clock::time_point asked_{};
  wire_packet info_{};
  std::atomic<bool> ready_{false};
  std::atomic<bool> gone_{false};
  std::atomic<bool> ended_{false};
  std::atomic<std::int64_t> last_frame_us_{0};
  std::atomic<std::int64_t> read_until_us_{0};
  std::exception_ptr failure_;
  std::thread thread_;
};

class Joint {
public:
  Joint(const LiveOptions &options, const std::vector<Way> &ways) : options_(options) {
    try {
      for (std::size_t i = 0; i < ways.size(); i++) {
        fingertips_.push_back(
            std::make_unique<Fingertip>(i, ways[i], options.streams, queue_, started_, stop_));
      }
    } catch (...) {
      stop_ = true;
      throw;
    }
  }
  ~Joint() { stop_ = true; }

  int run() {
    while (!is_everyone([](const Fingertip &each) { return each.is_ready(); })) {
      stop_if_one_failed();
      if (stop_requested()) {
        throw Interrupted();
      }
      std::this_thread::sleep_for(milliseconds(10));
    }
    begin();
    std::string reason;
    while (reason.empty()) {
      write_news(POLL);
      stop_if_one_failed();
      show();
      reason = reason_to_end();
    }
    stop_ = true;
    while (!is_everyone([](const Fingertip &each) { return each.has_ended(); })) {
      write_news(POLL);
    }
    write_news(milliseconds(0));
    std::vector<LineStatistics> statistics;
    LineStatistics sum;
    for (const auto &each : fingertips_) {
      statistics.push_back(each->statistics());
      sum += each->statistics();
    }
    recording_->finish(statistics, reason);
    std::fprintf(stderr,
                 "%s%s: %llu frames of %zu fingertips, aligned to %s us or better, %llu packets "
                 "dropped, %llu CRC errors\n",
                 isatty(STDERR_FILENO) ? "\r\x1b[K" : "", printable(recording_->path()).c_str(),
                 static_cast<unsigned long long>(recording_->frames()), fingertips_.size(),
                 fixed(recording_->alignment_us(), 0).c_str(),
                 static_cast<unsigned long long>(sum.dropped_packets),
                 static_cast<unsigned long long>(sum.crc_errors));
    return 0;
  }

private:
  template <typename Question> bool is_everyone(Question question) const {
    for (const auto &each : fingertips_) {
      if (!question(*each)) {
        return false;
      }
    }
    return true;
  }

  /* The others end too; what was written stays. */
  void stop_if_one_failed() {
    for (const auto &each : fingertips_) {
      if (each->has_ended()) {
        stop_ = true;
        each->rethrow();
      }
    }
  }

  void begin() {
    std::vector<wire_info> infos;
    for (const auto &each : fingertips_) {
      for (const wire_info &other : infos) {
        if (std::memcmp(other.serial, each->info().serial, sizeof other.serial) == 0) {
          throw Error(each->name() + ": is the same fingertip as another; name each once");
        }
      }
      infos.push_back(each->info());
    }
    zero_us_ = steady_now_us();
    recording_ = std::make_unique<JointRecordingWriter>(
        options_.recording, options_.overwrite, infos,
        Metadata{{"recorded_by", "fingertip " FINGERTIP_VERSION}, {"started_utc", utc_now()}},
        zero_us_, options_.streams & WIRE_STREAM_RAW, OutputFile::Appears::at_once);
    for (std::size_t i = 0; i < fingertips_.size(); i++) {
      recording_->packet(i, fingertips_[i]->info_packet(), static_cast<double>(zero_us_));
    }
    started_ = true;
  }

  void write_news(milliseconds timeout) {
    /* Asked first: what was read until then is in the queue. A row waits for those of a fingertip
     * whose thread got no time to read them. */
    double settled_us = static_cast<double>(steady_now_us());
    for (const auto &each : fingertips_) {
      settled_us = std::min(settled_us, each->read_until_us());
    }
    for (const Item &item : queue_.take(timeout)) {
      switch (item.kind) {
      case Item::Kind::packet:
        recording_->packet(item.device, item.packet, item.host_us);
        break;
      case Item::Kind::clock:
        recording_->clock(item.device, item.clock, item.jumps);
        break;
      case Item::Kind::event:
        recording_->event(item.device, item.event + " " + utc_now());
        break;
      }
    }
    recording_->settle(settled_us - SETTLE_us);
  }

  std::string reason_to_end() const {
    if (stop_requested()) {
      return "interrupted";
    }
    if (options_.seconds &&
        static_cast<double>(steady_now_us() - zero_us_) / 1e6 >= *options_.seconds) {
      return "seconds";
    }
    for (const auto &each : fingertips_) {
      if (options_.until_gone && each->is_gone()) {
        return "gone";
      }
    }
    return "";
  }

  void show() {
    if (Clock::now() < show_next_) {
      return;
    }
    show_next_ = Clock::now() + SHOW_INTERVAL;
    std::string text = fixed(static_cast<double>(steady_now_us() - zero_us_) / 1e6, 1) + " s";
    for (std::size_t i = 0; i < fingertips_.size(); i++) {
      const Fingertip &each = *fingertips_[i];
      text += "  " + std::string(each.info().serial, strnlen(each.info().serial, WIRE_TEXT_BYTES)) +
              " " + std::to_string(recording_->frames(i)) + " frames" +
              (each.is_gone()      ? std::string(" ") + GONE_ADVICE
               : each.is_stalled() ? " STALLED"
                                   : "");
    }
    text += "  aligned to " + fixed(recording_->alignment_us(), 0) + " us";
    std::fprintf(stderr, isatty(STDERR_FILENO) ? "\r\x1b[K%s" : "%s\n", printable(text).c_str());
    std::fflush(stderr);
  }

  const LiveOptions &options_;
  Queue queue_;
  std::atomic<bool> started_{false};
  std::atomic<bool> stop_{false};
  std::unique_ptr<JointRecordingWriter> recording_;
  std::int64_t zero_us_ = 0;
  Clock::time_point show_next_ = Clock::now() + SHOW_INTERVAL;
  std::vector<std::unique_ptr<Fingertip>> fingertips_; /* ends first: its threads use the others */
};

} // namespace

int run_joint(const LiveOptions &options, const std::vector<Way> &ways) {
  if (!options.raw_bytes.empty()) {
    throw Error("--raw-bytes keeps one fingertip's line; leave it out, or record one fingertip");
  }
  check_output(options.recording, options.overwrite);
  return Joint(options, ways).run();
}

} // namespace fingertip
