// progress.h: progress of long work: one line that updates itself on a terminal, plain lines every
// few seconds elsewhere.
#pragma once

#include <array>
#include <chrono>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace clamor {

// Estimates the time left from the rate of the last seconds. What came before the first share does
// not count: preparation, and work that was reused.
class TimeLeft {
 public:
  // `share` of the work is done at `now_s`. Returns nothing until the rate is known.
  std::optional<double> seconds(double share, double now_s);

 private:
  struct Point {
    double share = 0, time_s = 0;
  };
  std::optional<std::array<Point, 2>> since_;  // the rate is measured since the first
};

class Progress {
 public:
  // Prints to `err`; the line updates itself only if that is a terminal.
  Progress(std::ostream& err, std::string label);
  ~Progress();  // removes the line

  // Another stage begins, whose share starts at 0.
  void begin(std::string label);

  // Shows the share of the work that is done (0 to 1), the time left, and details ("2.1 M
  // bounces/s"), the most important first. Cheap to call often: prints at most ten times a second.
  void update(double share, const std::vector<std::string>& details);

  // Prints the line unchanged, at most twice a second.
  void update_json(const std::string& line);

  double seconds() const;
  std::optional<double> seconds_left(double share) { return left_.seconds(share, seconds()); }

 private:
  using Clock = std::chrono::steady_clock;

  std::ostream& err_;
  std::string label_;
  const bool terminal_;
  bool printed_ = false;
  Clock::time_point started_, last_;
  TimeLeft left_;
};

// Formats as "3.2 M", "41.0 k", "512 ".
std::string with_si_prefix(double value);

// Formats a speed, in multiples of real time, as "2.0 times faster than real time".
std::string in_real_times(double speed);

// Formats as "1:05 min", "12 s" or "0.8 s".
std::string format_duration(double seconds);

}  // namespace clamor
