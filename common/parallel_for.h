// parallel_for.h: work on many things that do not depend on each other, on all cores.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace clamor {

// Calls act(first, end) for parts of 0 to `count`, of `together` each, every one once, on that many
// threads, this one included; 0: on as many as there are cores. Returns when all are done.
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
