// thread_cpu_usage.h: what share of a core each of the program's threads takes, by name.
//
// From the kernel's own books (/proc/self/task), so that threads of libraries are there too and
// nobody has to keep count, least of all the audio thread.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace clamor {

// Of the calling thread, for debuggers and for what follows; 15 letters at most.
void name_thread(const char* name);

struct ThreadCpuUsage {
  std::string name;  // several of one name are added up
  double share = 0;  // of one core
};

class ThreadCpuMeter {
 public:
  // Counts from now on.
  ThreadCpuMeter();

  // The largest first. Threads that have ended since are together one, called "ended".
  std::vector<ThreadCpuUsage> now() const;

 private:
  std::chrono::steady_clock::time_point start_;
  double process_s_ = 0;
  std::map<int, double> before_s_;  // by thread
};

}  // namespace clamor
