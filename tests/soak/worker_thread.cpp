#include "worker_thread.hpp"

extern "C" {
#include "native/native_port.h"
}

namespace soak {

WorkerThread *WorkerThread::one_;

WorkerThread::WorkerThread(std::uint64_t takes_us) : thread_([this] { run(); }) {
  one_ = this;
  native_set_worker(true, takes_us);
  native_set_worker_thread(begin, end);
}

WorkerThread::~WorkerThread() {
  native_set_worker_thread(nullptr, nullptr);
  native_set_worker(false, 0);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    quits_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::uint64_t WorkerThread::served() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return served_;
}

void WorkerThread::begin(bool (*serve)(void *context), void *context) {
  {
    const std::lock_guard<std::mutex> lock(one_->mutex_);
    one_->serve_ = serve;
    one_->context_ = context;
    one_->woken_ = true;
  }
  one_->changed_.notify_all();
}

void WorkerThread::end() {
  std::unique_lock<std::mutex> lock(one_->mutex_);
  one_->changed_.wait(lock, [] { return !one_->woken_ && !one_->works_; });
}

void WorkerThread::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return woken_ || quits_; });
    if (quits_) {
      return;
    }
    woken_ = false;
    works_ = true;
    lock.unlock();
    std::uint64_t served = 0;
    while (serve_(context_)) {
      served++;
    }
    lock.lock();
    served_ += served;
    works_ = false;
    changed_.notify_all();
  }
}

} // namespace soak
