#include "tools/program/progress.h"

#include <algorithm>
#include <ostream>
#include <utility>

#include <fmt/format.h>

#include "tools/program/terminal_output.h"

namespace clamor {

std::optional<double> TimeLeft::seconds(double share, double now_s) {
  constexpr double kWindow_s = 5, kMinShare = 0.01, kMin_s = 1;
  const Point now{share, now_s};
  if (!since_) since_ = {now, now};
  if (now_s - (*since_)[1].time_s > kWindow_s) since_ = {(*since_)[1], now};
  const Point& then = since_->front();
  if (share <= then.share || share < kMinShare || now_s - then.time_s < kMin_s) return std::nullopt;
  return (now_s - then.time_s) * (1 - share) / (share - then.share);
}

Progress::Progress(std::ostream& err, std::string label)
    : err_(err),
      label_(std::move(label)),
      terminal_(is_terminal(err)),
      started_(Clock::now()),
      last_(started_) {}

Progress::~Progress() {
  if (terminal_ && printed_) erase_line(err_);
}

double Progress::seconds() const {
  return std::chrono::duration<double>(Clock::now() - started_).count();
}

void Progress::begin(std::string label) {
  label_ = std::move(label);
  left_ = {};
}

void Progress::update(double share, const std::vector<std::string>& details) {
  share = std::clamp(share, 0.0, 1.0);
  const auto left = seconds_left(share);
  const auto now = Clock::now();
  const auto interval =
      terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000);
  if (now - last_ < interval) return;
  last_ = now;
  printed_ = true;
  std::vector<std::string> fields{fmt::format("{} {:3.0f} %", label_, 100 * share)};
  if (left) fields.push_back(format_duration(*left) + " left");
  fields.insert(fields.end(), details.begin(), details.end());
  show_line(err_, fields);
}

void Progress::update_json(const std::string& line) {
  const auto now = Clock::now();
  if (now - last_ < std::chrono::milliseconds(500)) return;
  last_ = now;
  err_ << line << '\n' << std::flush;
}

std::string with_si_prefix(double value) {
  if (value >= 1e9) return fmt::format("{:.1f} G", value / 1e9);
  if (value >= 1e6) return fmt::format("{:.1f} M", value / 1e6);
  if (value >= 1e4) return fmt::format("{:.1f} k", value / 1e3);
  return fmt::format("{:.0f} ", value);
}

std::string in_real_times(double speed) {
  return speed >= 1 ? fmt::format("{:.1f} times faster than real time", speed)
                    : fmt::format("{:.1f} times slower than real time", 1 / std::max(speed, 1e-6));
}

std::string format_duration(double seconds) {
  if (seconds < 10) return fmt::format("{:.1f} s", seconds);
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  const auto whole = static_cast<long>(seconds + 0.5);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02} h", whole / 3600, whole / 60 % 60);
}

}  // namespace clamor
