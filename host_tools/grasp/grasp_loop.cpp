#include "grasp/grasp_loop.hpp"

#include "grasp/words.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <utility>

namespace fingertip {

using std::chrono::milliseconds;
using Kind = GraspNews::Kind;

constexpr milliseconds STEP{5};
// At the end: for the gripper to have heard the last command.
constexpr std::int64_t LAST_WORD_us = 500000;
// News that wait: ten seconds of two fingertips at 1308 frames a second, and the steps.
constexpr std::size_t MOST_NEWS = 80000;

GraspLoop::GraspLoop(const std::array<Endpoint, FINGERS> &ways, Options options) : options_(std::move(options)) {
  DeviceLoop::Options wanted;
  wanted.streams = options_.streams;
  wanted.follow_clock = true;
  for (std::size_t i = 0; i < FINGERS; i++) {
    loops_[i] = std::make_unique<DeviceLoop>(i, ways[i], wanted, feed_);
  }
}

GraspLoop::~GraspLoop() {
  abandoned_ = true;
  end();
  if (thread_.joinable()) {
    thread_.join();
  }
}

std::array<DeviceUpdate, GraspLoop::FINGERS> GraspLoop::meet(const std::function<bool()> &stop) {
  std::array<std::optional<DeviceUpdate>, FINGERS> ready;
  while (!ready[0] || !ready[1]) {
    if (stop()) {
      throw Interrupted();
    }
    for (DeviceUpdate &news : feed_.take(milliseconds(20))) {
      if (news.kind == DeviceUpdate::Kind::ready) {
        ready[news.device] = std::move(news);
      } else if (news.kind == DeviceUpdate::Kind::ended) {
        loops_[news.device]->rethrow();
        throw Interrupted();
      }
    }
  }
  return {std::move(*ready[0]), std::move(*ready[1])};
}

void GraspLoop::begin(std::unique_ptr<Gripper> gripper, OpenGripper reopen, const GripSettings &settings) {
  status_ = gripper->poll();
  core_.emplace(settings, gripper->traits());
  core_->take(*status_);
  gripper_ = std::make_unique<GripperThread>(std::move(gripper), std::move(reopen));
  for (const auto &loop : loops_) {
    loop->start();
  }
  thread_ = Thread([this] { run(); });
}

std::vector<GraspNews> GraspLoop::take(milliseconds timeout) {
  std::unique_lock lock(news_mutex_);
  for (const HostTime limit = host_now() + timeout; news_.empty() && host_now() < limit;) {
    lock.unlock();
    filled_.wait(limit);
    lock.lock();
  }
  std::vector<GraspNews> taken = std::exchange(news_, {});
  if (const std::uint64_t count = std::exchange(dropped_, 0)) {
    GraspNews dropped{Kind::dropped, steady_now_us()};
    dropped.count = count;
    taken.push_back(std::move(dropped));
  }
  return taken;
}

void GraspLoop::put(GraspNews news) {
  std::lock_guard lock(news_mutex_);
  if (news_.size() >= MOST_NEWS && news.kind != Kind::ended) {
    dropped_++;
    return;
  }
  news_.push_back(std::move(news));
  filled_.set();
}

void GraspLoop::run() {
  while (!end_) {
    take_devices();
    take_gripper();
    obey_interrupts();
    step();
  }
  if (report_.state != GRIP_IDLE && !is_end_state(report_.state)) {
    request(GRIP_REQUEST_HOLD);
  }
  const std::int64_t patience_us = steady_now_us() + LAST_WORD_us;
  do {
    take_devices();
    take_gripper();
    step();
  } while (!abandoned_ && !gripper_->is_done() && steady_now_us() < patience_us);
  gripper_.reset();
  for (const auto &loop : loops_) {
    loop->stop();
  }
  while (running_ > 0 && !abandoned_) {
    take_devices();
  }
  put({Kind::ended, steady_now_us()});
}

void GraspLoop::take_devices() {
  for (DeviceUpdate &news : feed_.take(STEP)) {
    if (news.kind == DeviceUpdate::Kind::packet && news.packet.type == WIRE_CONTACT) {
      const double now_us = static_cast<double>(steady_now_us());
      const GripTouch touch = touch_from_packet(news.packet, std::min(news.host_us, now_us));
      std::lock_guard lock(core_mutex_);
      core_->take(news.device, touch);
    }
    running_ -= news.kind == DeviceUpdate::Kind::ended;
    put({Kind::device, steady_now_us(), std::move(news)});
  }
}

void GraspLoop::take_gripper() {
  for (GripperThread::News &news : gripper_->take()) {
    if (news.status) {
      status_ = news.status;
      fault_text_ = status_->fault != 0 ? news.trouble : fault_text_;
      std::lock_guard lock(core_mutex_);
      core_->take(*status_);
    }
    if (news.trouble != gripper_trouble_) {
      gripper_trouble_ = news.trouble;
      GraspNews change{Kind::gripper, steady_now_us()};
      change.text = std::move(news.trouble);
      put(std::move(change));
    }
  }
}

void GraspLoop::obey_interrupts() {
  for (const unsigned wanted = options_.interrupts(); interrupts_ < wanted; interrupts_++) {
    request(interrupts_ == 0 ? GRIP_REQUEST_HOLD : GRIP_REQUEST_RELEASE);
  }
}

void GraspLoop::step() {
  GraspNews news{Kind::step, steady_now_us()};
  {
    std::lock_guard lock(core_mutex_);
    news.report = core_->step(1e-6 * static_cast<double>(news.host_us), news.command);
  }
  /* Begun once it goes on, whatever the fingers touch on their way. */
  is_activating_ = news.report.state == GRIP_ACTIVATING && options_.activate && (is_activating_ || news.command.motion == GRIP_ACTIVATE);
  if (is_activating_ || news.command.motion == GRIP_ACTIVATE) {
    news.command.motion = is_activating_ ? GRIP_ACTIVATE : GRIP_STAY;
  }
  const bool has_failed = news.report.state == GRIP_FAULT && report_.state != GRIP_FAULT;
  report_ = news.report;
  gripper_->command(news.command);
  news.status = status_;
  put(std::move(news));
  if (has_failed) {
    report_fault(report_);
  }
}

void GraspLoop::report_fault(const GripReport &report) {
  std::vector<std::string> causes;
  if ((report.trouble & GRIP_GRIPPER_FAULT) != 0) {
    causes.push_back(fault_text_);
  }
  if ((report.trouble & GRIP_GRIPPER_INACTIVE) != 0) {
    causes.push_back("it is not active any more: it lost its power, or was reset");
  }
  GraspNews news{Kind::fault, steady_now_us()};
  news.text = causes.empty() ? "no grip: " : "the gripper failed: ";
  news.text += joined(causes.empty() ? trouble_texts(report) : causes, "; ");
  put(std::move(news));
}

} // namespace fingertip
