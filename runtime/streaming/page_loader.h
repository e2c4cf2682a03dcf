// page_loader.h: keeps the pages that the sampler uses in memory, and fetches others meanwhile.
//
// One thread (the sampler's) asks, takes what has arrived and never waits; loader threads fetch
// what was asked last, the most urgent first, and get it ready for the sampler. Pages beyond the
// budget are dropped, the least recently used first. Where not even those of the last sample fit,
// the least urgent go: a page comes in the place of another only if it is twice as urgent, so that
// the two do not take turns. What was under way comes on top. A page that cannot be read is not
// asked for again: the sampler does without, as if it were still on its way.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/result.h"
#include "runtime/streaming/page_statistics.h"
#include "runtime/streaming/resident_page.h"

namespace clamor {

struct WantedPage {
  double bound = 0;
  PageEntry entry;
  bool needed = true;  // by the last sample; otherwise perhaps soon
};

struct PageBudget {
  std::uint64_t bytes = 64'000'000;
  bool strict = true;  // or may pages that one sample needs take more
};

class PageLoader {
 public:
  // Called by any loader thread, several at a time; throws nothing.
  using Content = Result<std::unique_ptr<const ResidentPage>>;
  using Fetch = std::function<Content(const PageEntry& entry)>;

  // Tells the disk what is fetched soon; on a loader thread, so it may take its time.
  using Announce = std::function<void(const PageEntry& entry)>;

  PageLoader(Fetch fetch, const PageBudget& budget, int threads = 1, Announce announce = {});
  ~PageLoader();
  PageLoader(const PageLoader&) = delete;
  PageLoader& operator=(const PageLoader&) = delete;

  // The sampler's thread, all that follow.

  // Fetches it here and now, to stay for good; false if it cannot be read.
  bool load_now(const PageEntry& entry);

  // Takes in what has arrived, drops what is too much, begins a new sample. True if anything came
  // or went.
  bool begin_sample();
  bool has_dropped() const { return has_dropped_; }  // any, when this sample began
  // What has arrived since the last, by offset.
  std::span<const std::uint64_t> arrived() const { return arrived_; }

  // Null if it is not here. Valid until the next begin_sample(). `bound` as in WantedPage.
  const ResidentPage* use(const PageEntry& entry, double bound);

  // The same for who asks again and again, without looking for it: where a page is kept that is
  // here. Valid until a begin_sample() that drops any.
  class Place {
   public:
    const ResidentPage* resident() const { return page.get(); }

   private:
    friend class PageLoader;
    bool is_of(const PageEntry& entry) const;
    std::unique_ptr<const ResidentPage> page;  // null: it failed
    std::uint64_t bytes = 0;                   // of its memory
    std::uint32_t last_use = 0;                // sample
    double bound = 0;                          // in that
    bool stays = false;
  };
  Place* place_of(const PageEntry& entry);
  void use(Place& place, double bound);

  bool is_here(const PageEntry& entry) const { return find(entry) != nullptr; }
  // The same without being counted as used or late.
  const ResidentPage* find(const PageEntry& entry) const;
  bool has_failed(const PageEntry& entry) const;

  // Replaces what was asked before and is not yet under way: what is needed first, then the most
  // urgent, as many as fit the budget beside what the last sample uses and is not half as urgent.
  void ask(std::vector<WantedPage> wanted);

  // Waits until all that was asked for has arrived; false if nothing is on its way.
  bool wait();

  PageStatistics statistics() const;  // any thread

 private:
  struct Shared;
  // Under the mutex, both.
  void take(std::uint64_t offset, double bound, Content content);
  void count_what_is_here();
  void drop_too_much();
  std::size_t how_many_fit(std::span<const WantedPage> most_urgent_first) const;

  const Fetch fetch_;
  const Announce announce_;
  const PageBudget budget_;
  std::unordered_map<std::uint64_t, Place> slots_;  // by offset in the file; here, or failed
  std::size_t here_ = 0;
  bool has_dropped_ = false;
  std::vector<std::uint64_t> arrived_;
  std::uint32_t sample_ = 1;
  std::uint64_t bytes_ = 0;
  std::uint64_t used_bytes_ = 0;       // by this sample
  std::uint64_t most_page_bytes_ = 0;  // so far
  std::uint64_t late_ = 0;
  std::unique_ptr<Shared> shared_;
};

}  // namespace clamor
