#include "tools/program/stage_notice.h"

#include <ostream>
#include <utility>

namespace clamor {

StageNotice::StageNotice(std::ostream& err, std::chrono::milliseconds after)
    : err_(err), after_(after), thread_([this](const std::stop_token& ended) { watch(ended); }) {}

void StageNotice::begin(std::string stage) {
  const std::lock_guard lock(mutex_);
  stage_ = std::move(stage);
  since_ = std::chrono::steady_clock::now();
  changed_.notify_all();
}

void StageNotice::watch(const std::stop_token& ended) {
  std::unique_lock lock(mutex_);
  while (!ended.stop_requested()) {
    if (stage_.empty()) {
      changed_.wait(lock, ended, [this] { return !stage_.empty(); });
      continue;
    }
    const auto due = since_ + after_;
    if (std::chrono::steady_clock::now() < due) {
      changed_.wait_until(lock, ended, due, [&] { return since_ + after_ != due; });
      continue;
    }
    err_ << "  stage    " << std::exchange(stage_, "") << '\n' << std::flush;
  }
}

}  // namespace clamor
