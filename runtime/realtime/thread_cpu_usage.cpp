#include "runtime/realtime/thread_cpu_usage.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "common/cpu_time.h"

namespace clamor {

namespace {

struct ThreadTime {
  int id = 0;
  std::string name;
  double cpu_s = 0;
};

// Threads may end while they are being listed.
std::vector<ThreadTime> all_threads() {
  std::vector<ThreadTime> threads;
  std::error_code problem;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", problem)) {
    ThreadTime thread;
    thread.id = std::atoi(task.path().filename().string().c_str());
    double cpu_ns = 0;
    if (!std::getline(std::ifstream(task.path() / "comm"), thread.name)) continue;
    if (!(std::ifstream(task.path() / "schedstat") >> cpu_ns)) continue;
    thread.cpu_s = 1e-9 * cpu_ns;
    threads.push_back(std::move(thread));
  }
  return threads;
}

}  // namespace

ThreadCpuMeter::ThreadCpuMeter()
    : start_(std::chrono::steady_clock::now()), process_s_(process_time_s()) {
  for (const ThreadTime& thread : all_threads()) before_s_[thread.id] = thread.cpu_s;
}

std::vector<ThreadCpuUsage> ThreadCpuMeter::now() const {
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start_;
  std::vector<ThreadCpuUsage> shares;
  const auto add = [&](const std::string& name, double cpu_s) {
    auto it = std::find_if(shares.begin(), shares.end(),
                           [&](const ThreadCpuUsage& share) { return share.name == name; });
    if (it == shares.end()) it = shares.insert(it, {name, 0});
    it->share += cpu_s / passed.count();
  };
  double rest_s = process_time_s() - process_s_;
  for (const ThreadTime& thread : all_threads()) {
    const auto before = before_s_.find(thread.id);
    const double cpu_s = thread.cpu_s - (before == before_s_.end() ? 0 : before->second);
    add(thread.name, cpu_s);
    rest_s -= cpu_s;
  }
  if (rest_s > 0) add("ended", rest_s);
  std::stable_sort(
      shares.begin(), shares.end(),
      [](const ThreadCpuUsage& a, const ThreadCpuUsage& b) { return a.share > b.share; });
  return shares;
}

}  // namespace clamor
