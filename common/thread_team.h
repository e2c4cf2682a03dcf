// thread_team.h: loops, sorting and pipelines on the threads of a team.
//
// with_team() makes a team for the time of a call. The loops in that call share its threads, also
// loops within loops: a thread that has nothing to do helps the loop that began last. A loop
// outside of a team gets one for itself, of all cores. Results must not depend on who runs an
// iteration. An exception of one iteration ends the loop, which throws it when all threads have
// left it.
//
// Threads: any. Cost: a team starts its threads (20 us each) and ends them.
#pragma once

#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <iterator>
#include <mutex>
#include <utility>
#include <vector>

namespace clamor {

// Calls `work` with a team of `threads` threads, the calling one included (0: one per core).
void with_team(int threads, const std::function<void()>& work);

// Threads of the team that the calling thread is in, or would get.
int team_size();

// Calls act(first, end) for consecutive parts of [0, count), each of at least `grain` indices but
// for the last.
void team_for_parts(std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t, std::size_t)>& act);

// Calls act(i) for each i of [begin, end), at least `grain` of them on one thread.
template <class Act>
void team_for(std::size_t begin, std::size_t end, std::size_t grain, const Act& act) {
  if (begin >= end) return;
  const auto part = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = begin + first; i < begin + last; ++i) act(i);
  };
  team_for_parts(end - begin, grain, std::cref(part));
}

template <class Act>
void team_for(std::size_t begin, std::size_t end, const Act& act) {
  team_for(begin, end, 1, act);
}

// Sorts in place, not stably. Equal elements may lie in any order: `less` should leave none.
template <class Iterator, class Less>
void team_sort(Iterator begin, Iterator end, const Less& less) {
  constexpr std::ptrdiff_t kWorthIt = 10'000;
  using Range = std::pair<Iterator, Iterator>;
  std::vector<Range> ranges{{begin, end}};
  const std::size_t wanted = team_size() > 1 ? 8 * static_cast<std::size_t>(team_size()) : 1;
  // Each round divides all ranges at a median of nine elements.
  for (std::size_t before = 0; ranges.size() < wanted && ranges.size() > before;) {
    before = ranges.size();
    std::vector<std::array<Range, 2>> halves(before);
    team_for(0, before, [&](std::size_t i) {
      const auto [first, last] = ranges[i];
      halves[i] = {ranges[i], Range{last, last}};
      const std::ptrdiff_t size = last - first;
      if (size < kWorthIt) return;
      std::array<typename std::iterator_traits<Iterator>::value_type, 9> sample;
      for (std::size_t k = 0; k < sample.size(); ++k)
        sample[k] = first[(size - 1) * static_cast<std::ptrdiff_t>(k) / 8];
      std::nth_element(sample.begin(), sample.begin() + 4, sample.end(), less);
      const auto middle =
          std::partition(first, last, [&](const auto& x) { return less(x, sample[4]); });
      halves[i] = {Range{first, middle}, Range{middle, last}};
    });
    ranges.clear();
    for (const auto& both : halves)
      for (const Range& range : both)
        if (range.first != range.second) ranges.push_back(range);
  }
  team_for(0, ranges.size(),
           [&](std::size_t i) { std::sort(ranges[i].first, ranges[i].second, less); });
}

// Takes items through three stages until begin() returns null: begin() and end(item) handle one
// item at a time and in order, work(item) several at once. At most `at_once` items are under way.
template <class Item, class Begin, class Work, class End>
void team_pipeline(std::size_t at_once, const Begin& begin, const Work& work, const End& end) {
  struct UnderWay {
    Item* item;
    bool done = false;
  };
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<UnderWay> items;
  bool beginning = false, ending = false, all_begun = false, failed = false;
  team_for(0, static_cast<std::size_t>(team_size()), [&](std::size_t) {
    std::unique_lock lock(mutex);
    try {
      while (!failed && !(all_begun && items.empty())) {
        if (!ending && !items.empty() && items.front().done) {
          ending = true;
          Item* const item = items.front().item;
          lock.unlock();
          end(item);
          lock.lock();
          items.pop_front();
          ending = false;
        } else if (!beginning && !all_begun && items.size() < at_once) {
          beginning = true;
          lock.unlock();
          Item* const item = begin();
          lock.lock();
          beginning = false;
          all_begun = item == nullptr;
          if (!all_begun) {
            UnderWay& here = items.emplace_back(UnderWay{item});
            changed.notify_all();
            lock.unlock();
            work(item);
            lock.lock();
            here.done = true;
          }
        } else {
          changed.wait(lock);
          continue;
        }
        changed.notify_all();
      }
    } catch (...) {
      if (!lock.owns_lock()) lock.lock();
      failed = true;
      changed.notify_all();
      throw;
    }
  });
}

}  // namespace clamor
