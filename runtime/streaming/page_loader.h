// page_loader.h: keeps the pages that the sampler uses in memory, and loads others meanwhile.
//
// The sampler's thread requests pages, takes in those that have arrived and never waits. Loader
// threads read what was requested last, the highest bound of priorities first. Pages beyond the
// memory budget are evicted, the least recently used first. Where not even the pages of the last
// sample fit, those of the lowest bound are evicted: a page replaces another only if its bound is
// twice as high, so that the two do not alternate. Pages that were being read come on top of the
// budget. A page that cannot be read is not requested again: the sampler does without, as if it had
// not arrived.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/result.h"
#include "runtime/realtime/thread_hooks.h"
#include "runtime/streaming/page_statistics.h"
#include "runtime/streaming/resident_page.h"

namespace clamor {

struct PageRequest {
  double bound = 0;  // upper bound of the priorities in the page and below
  PageEntry entry;
  bool needed = true;  // by the last sample; false: soon, perhaps
};

struct PageBudget {
  std::uint64_t bytes = 64'000'000;
  bool strict = true;  // false: pages that one sample needs may take more
};

class PageLoader {
 public:
  // Reads a page. Called by several loader threads at a time; throws nothing.
  using Content = Result<std::unique_ptr<const ResidentPage>>;
  using Fetch = std::function<Content(const PageEntry& entry)>;

  // Tells the disk which page is read soon. Called by a loader thread, so it may take its time.
  using Announce = std::function<void(const PageEntry& entry)>;

  PageLoader(Fetch fetch, const PageBudget& budget, int threads = 1, Announce announce = {},
             const ThreadHooks& hooks = {});
  ~PageLoader();
  PageLoader(const PageLoader&) = delete;
  PageLoader& operator=(const PageLoader&) = delete;

  // All that follow are for the sampler's thread.

  // Reads a page at once, to stay in memory for good; false if it cannot be read.
  bool load_now(const PageEntry& entry);

  // Begins a sample: takes in the pages that have arrived and evicts those beyond the budget. True
  // if there were any.
  bool begin_sample();
  // Were pages evicted when this sample began, and which ones arrived? By ascending offset.
  bool has_dropped() const { return has_dropped_; }
  std::span<const std::uint64_t> arrived() const { return arrived_; }

  // Marks a page as used. Null if it is not in memory. Valid until the next begin_sample(). `bound`
  // as in PageRequest.
  const ResidentPage* use(const PageEntry& entry, double bound);

  // The entry of a page in memory, to use it again without a search. Valid until a begin_sample()
  // that evicts any.
  class CacheEntry {
   public:
    const ResidentPage* resident() const { return page.get(); }

   private:
    friend class PageLoader;
    bool is_of(const PageEntry& entry) const;
    std::unique_ptr<const ResidentPage> page;  // null: it cannot be read
    std::uint64_t bytes = 0;
    std::uint32_t last_use = 0;  // number of the sample
    double bound = 0;            // in that sample
    bool stays = false;
  };
  CacheEntry* find_entry(const PageEntry& entry);
  void use(CacheEntry& cached, double bound);

  bool is_here(const PageEntry& entry) const { return find(entry) != nullptr; }
  // Without marking it as used or late.
  const ResidentPage* find(const PageEntry& entry) const;
  bool has_failed(const PageEntry& entry) const;

  // Replaces all requests that are not being read yet: needed pages first, then those of the
  // highest bounds, as many as fit the budget beside the pages that the last sample used and whose
  // bounds are more than half as high.
  void request(std::vector<PageRequest> wanted);

  // Waits until all requested pages have arrived; false if there are none.
  bool wait();

  // For a loader without threads: reads the most urgent page now; false if none is requested. On
  // any one thread.
  bool load_next();

  PageStatistics statistics() const;  // any thread

 private:
  struct Shared;
  // Both under the mutex.
  void take(std::uint64_t offset, double bound, Content content);
  void count_what_is_here();
  void drop_too_much();
  std::size_t count_that_fit(std::span<const PageRequest> by_urgency) const;

  // Pages in memory, and their bytes.
  struct Usage {
    std::size_t pages = 0;
    std::uint64_t bytes = 0;
    std::uint64_t used_bytes = 0;      // by this sample
    std::uint64_t max_page_bytes = 0;  // so far
  };

  const Fetch fetch_;
  const Announce announce_;
  const PageBudget budget_;
  // By offset in the file: those in memory, and those that cannot be read.
  std::unordered_map<std::uint64_t, CacheEntry> slots_;
  Usage usage_;
  bool has_dropped_ = false;
  std::vector<std::uint64_t> arrived_;
  std::uint32_t sample_ = 1;
  std::uint64_t late_ = 0;
  std::unique_ptr<Shared> shared_;
};

}  // namespace clamor
