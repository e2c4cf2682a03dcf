// worker.h: a thread that does jobs in order, so that those who ask for them need not wait.
//
// Threads: run() may be called by any; begin() and end() by one.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace clamor::godot {

class Worker {
 public:
  void begin() {
    ends_ = false;
    thread_ = std::thread([this] { work(); });
  }

  // Does the jobs that wait, too.
  void end() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard lock(queueing_);
      ends_ = true;
    }
    queued_.notify_one();
    thread_.join();
  }

  // Does the job at once where begin() has not been called.
  void run(std::function<void()> job) {
    if (!thread_.joinable()) return job();
    {
      const std::lock_guard lock(queueing_);
      jobs_.push_back(std::move(job));
    }
    queued_.notify_one();
  }

 private:
  void work() {
    std::unique_lock lock(queueing_);
    for (;;) {
      queued_.wait(lock, [this] { return ends_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      const auto job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      job();
      lock.lock();
    }
  }

  std::thread thread_;
  std::mutex queueing_;
  std::condition_variable queued_;
  std::deque<std::function<void()>> jobs_;
  bool ends_ = false;
};

}  // namespace clamor::godot
