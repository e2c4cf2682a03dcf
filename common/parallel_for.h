// parallel_for.h: a loop whose iterations run on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace clamor {

// Calls act(first, end) for consecutive parts of [0, count), each of at most `grain` indices, on
// `threads` threads including the calling one (0: one per core). Returns when all calls have
// returned. act() must not throw.
template <class Act>
void parallel_for(std::size_t count, std::size_t together, unsigned threads, const Act& act) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t first; (first = next.fetch_add(together)) < count;)
      act(first, std::min(first + together, count));
  };
  if (threads == 0) threads = std::max(std::thread::hardware_concurrency(), 1u);
  const auto useful = static_cast<unsigned>((count + together - 1) / together);
  std::vector<std::jthread> others(std::max(std::min(threads, useful), 1u) - 1);
  for (std::jthread& other : others) other = std::jthread(work);
  work();
}

}  // namespace clamor
