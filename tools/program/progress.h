// progress.h: how far long work has got: one line that updates itself on a terminal, plain lines
// every few seconds elsewhere.
#pragma once

#include <chrono>
#include <iosfwd>
#include <string>

namespace clamor {

class Progress {
 public:
  // Prints to `err`; updates itself only where that is a terminal's standard error.
  Progress(std::ostream& err, std::string label);
  ~Progress();  // ends the line

  // `share` of the work is done, 0 to 1; `rate` says how fast, in words ("2.1 M bounces/s").
  // Shows the time left. Cheap to call often: prints ten times a second at most.
  void update(double share, const std::string& rate);

  // The line as it is, at most twice a second.
  void update_json(const std::string& line);

  double seconds() const;

 private:
  using Clock = std::chrono::steady_clock;

  std::ostream& err_;
  std::string label_;
  bool terminal_;
  bool printed_ = false;
  Clock::time_point started_, last_;
};

// "3.2 M", "41.0 k", "512".
std::string with_si_prefix(double value);

// "1:05", "12 s", "0.8 s".
std::string format_duration(double seconds);

}  // namespace clamor
