// progress.h: progress of long work: one line that updates itself on a terminal, plain lines every
// few seconds elsewhere.
#pragma once

#include <chrono>
#include <iosfwd>
#include <string>

namespace clamor {

class Progress {
 public:
  // Prints to `err`; the line updates itself only if that is a terminal.
  Progress(std::ostream& err, std::string label);
  ~Progress();  // ends the line

  // Shows the share of the work that is done (0 to 1), the rate as text ("2.1 M bounces/s") and the
  // time left. Cheap to call often: prints at most ten times a second.
  void update(double share, const std::string& rate);

  // Prints the line unchanged, at most twice a second.
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

// Formats as "3.2 M", "41.0 k", "512 ".
std::string with_si_prefix(double value);

// Formats as "1:05 min", "12 s" or "0.8 s".
std::string format_duration(double seconds);

}  // namespace clamor
