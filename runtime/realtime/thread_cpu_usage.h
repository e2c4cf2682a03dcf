// thread_cpu_usage.h: CPU time of each of the program's threads, by name.
//
// The kernel keeps the figures (/proc/self/task), so threads of third-party libraries are included
// and the audio thread does no extra work.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace clamor {

struct ThreadCpuUsage {
  std::string name;  // threads with the same name are added up
  double share = 0;  // of one core
};

class ThreadCpuMeter {
 public:
  // Measures from now on.
  ThreadCpuMeter();

  // Usage since construction, largest first. Threads that have ended are added up under the name
  // "ended".
  std::vector<ThreadCpuUsage> now() const;

 private:
  std::chrono::steady_clock::time_point start_;
  double process_s_ = 0;
  std::map<int, double> before_s_;  // by thread id
};

}  // namespace clamor
