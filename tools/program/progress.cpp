#include "tools/program/progress.h"

#include <algorithm>
#include <iostream>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "tools/program/printable_stream.h"

namespace clamor {

Progress::Progress(std::ostream& err, std::string label)
    : err_(err),
      label_(std::move(label)),
      terminal_(&err == &std::cerr && isatty(STDERR_FILENO) != 0),
      started_(Clock::now()),
      last_(started_) {}

Progress::~Progress() {
  if (terminal_ && printed_) err_ << to_line_start << clear_rest_of_line << std::flush;
}

double Progress::seconds() const {
  return std::chrono::duration<double>(Clock::now() - started_).count();
}

void Progress::update(double share, const std::string& rate) {
  const auto now = Clock::now();
  const auto interval =
      terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000);
  if (now - last_ < interval) return;
  last_ = now;
  printed_ = true;
  share = std::clamp(share, 0.0, 1.0);
  const std::string left =
      share > 0.01 ? format_duration(seconds() * (1 - share) / share) + " left" : "";
  if (terminal_) err_ << to_line_start;
  err_ << fmt::format("{} {:3.0f} %  {}  {}", label_, 100 * share, rate, left);
  if (terminal_)
    err_ << clear_rest_of_line;
  else
    err_ << '\n';
  err_ << std::flush;
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

std::string format_duration(double seconds) {
  if (seconds < 10) return fmt::format("{:.1f} s", seconds);
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  const auto whole = static_cast<long>(seconds + 0.5);
  if (whole < 3600) return fmt::format("{}:{:02} min", whole / 60, whole % 60);
  return fmt::format("{}:{:02} h", whole / 3600, whole / 60 % 60);
}

}  // namespace clamor
