#include "bake/bake_watch.h"

#include <algorithm>
#include <exception>
#include <string_view>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "bake/report/level_report.h"
#include "formats/gltf/import_report.h"

namespace clamor {

namespace {

constexpr auto kReportInterval = std::chrono::milliseconds(100);

double seconds_between(std::chrono::steady_clock::time_point from,
                       std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

double BakeWatch::seconds() const { return seconds_between(begun_, Clock::now()); }

void BakeWatch::run(const std::function<void()>& work) {
  std::exception_ptr thrown;
  std::jthread worker([&] {
    try {
      work();
    } catch (...) {
      thrown = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  });
  try {
    for (bool ended = false; !ended;) {
      {
        std::unique_lock lock(mutex_);
        ended = changed_.wait_for(lock, kReportInterval, [&] { return ended_; });
      }
      report();
    }
  } catch (...) {
    stop_ = true;
    throw;
  }
  worker.join();
  if (thrown != nullptr) std::rethrow_exception(thrown);
}

// Calls the callbacks without holding the lock.
void BakeWatch::report() {
  std::unique_lock lock(mutex_);
  const std::vector<BakeMessage> messages = std::exchange(messages_, {});
  const BakePhase phase = phase_;
  const BakeProgress progress = progress_;
  const double tracing_s = tracing_s_;
  lock.unlock();
  if (callbacks_.message)
    for (const BakeMessage& message : messages) callbacks_.message(message);
  if (callbacks_.progress && !stop_ && !callbacks_.progress(phase, progress, seconds(), tracing_s))
    stop_ = true;
}

void BakeWatch::tell(bool is_warning, const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (is_warning && first_warning_.empty()) first_warning_ = text;
  messages_.push_back({is_warning, text});
}

void BakeWatch::on_import(const std::string&, const ImportReport& report) {
  for (const std::string& line : report.found) tell(false, line);
  for (const MaterialAssignment& material : report.materials)
    tell(false, fmt::format("material {}: {}, {:.1f} m2 ({})", in_quotes(material.material),
                            material.preset.empty() ? "own values" : printable(material.preset),
                            material.area_m2, printable(material.how)));
  for (const std::string& line : report.ignored) tell(false, "ignored: " + line);
}

void BakeWatch::on_prepared(const LevelReport& report) {
  for (const std::string& line : report_lines(report)) tell(false, line);
  const std::lock_guard lock(mutex_);
  tracing_begun_ = Clock::now();
}

void BakeWatch::on_warning(const std::string& text) { tell(true, text); }

void BakeWatch::on_progress(const BakeProgress& progress) {
  const std::lock_guard lock(mutex_);
  phase_ =
      std::string_view(progress.stage) == "sorting" ? BakePhase::kSorting : BakePhase::kTracing;
  progress_ = progress;
  tracing_s_ = seconds_between(tracing_begun_, Clock::now());
}

void BakeWatch::on_writing() {
  const std::lock_guard lock(mutex_);
  phase_ = BakePhase::kWriting;
}

}  // namespace clamor
