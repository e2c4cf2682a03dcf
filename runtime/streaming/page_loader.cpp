#include "runtime/streaming/page_loader.h"

#include <algorithm>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <tuple>

namespace clamor {

namespace {

// Pages that are announced to the disk while one is decoded.
constexpr std::size_t kAnnounced = 8;

}  // namespace

// The state that the sampler and the loader threads share, all under the mutex.
struct PageLoader::Shared {
  struct Arrival {
    std::uint64_t page = 0;  // offset
    double bound = 0;
    Content content;
  };

  std::mutex mutex;
  std::condition_variable work, arrival;
  bool closing = false;
  std::vector<PageRequest> queue;        // the highest bound last
  std::vector<std::uint64_t> under_way;  // offsets of pages being read
  std::vector<Arrival> arrived;
  PageStatistics statistics;
  std::vector<std::thread> threads;

  bool is_on_its_way(std::uint64_t page) const {
    return std::find(under_way.begin(), under_way.end(), page) != under_way.end() ||
           std::any_of(arrived.begin(), arrived.end(),
                       [page](const Arrival& a) { return a.page == page; });
  }

  void run(const Fetch& fetch, const Announce& announce) {
    std::unique_lock lock(mutex);
    for (;;) {
      work.wait(lock, [this] { return closing || !queue.empty(); });
      if (closing) return;
      load_next(lock, fetch, announce);
    }
  }

  // Reads the most urgent page, of which there must be one. Holds no lock meanwhile.
  void load_next(std::unique_lock<std::mutex>& lock, const Fetch& fetch, const Announce& announce) {
    const PageRequest wanted = queue.back();
    const std::uint64_t page = wanted.entry.page.offset;
    queue.pop_back();
    under_way.push_back(page);
    std::vector<PageEntry> soon;
    if (announce)
      for (std::size_t i = 0; i < std::min(kAnnounced, queue.size()); ++i)
        soon.push_back(queue[queue.size() - 1 - i].entry);
    lock.unlock();
    for (const PageEntry& entry : soon) announce(entry);
    auto content = fetch(wanted.entry);
    lock.lock();
    std::erase(under_way, page);
    arrived.push_back({page, wanted.bound, std::move(content)});
    arrival.notify_all();
  }
};

PageLoader::PageLoader(Fetch fetch, const PageBudget& budget, int threads, Announce announce,
                       const ThreadHooks& hooks)
    : fetch_(std::move(fetch)),
      announce_(std::move(announce)),
      budget_(budget),
      shared_(std::make_unique<Shared>()) {
  for (int i = 0; i < threads; ++i)
    shared_->threads.emplace_back([this, hooks] {
      const HookedThread hooked(hooks, "page loader");
      shared_->run(fetch_, announce_);
    });
}

PageLoader::~PageLoader() {
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->closing = true;
  }
  shared_->work.notify_all();
  for (std::thread& thread : shared_->threads) thread.join();
}

void PageLoader::take(std::uint64_t offset, double bound, Content content) {
  PageStatistics& statistics = shared_->statistics;
  CacheEntry& slot = slots_[offset];
  if (!content.ok()) {
    ++statistics.failed;
    if (statistics.failure.empty()) statistics.failure = content.error().message;
    return;
  }
  // load_now() may have been faster than a thread. Those who found that page keep it.
  if (slot.page != nullptr) return;
  const std::uint64_t bytes = (*content)->bytes();
  usage_.bytes += bytes;
  usage_.max_page_bytes = std::max(usage_.max_page_bytes, bytes);
  slot.page = std::move(*content);
  slot.bytes = bytes;
  slot.last_use = sample_ - 1;  // so that it is not evicted before its first use
  slot.bound = bound;
  ++usage_.pages;
  ++statistics.loaded;
}

void PageLoader::count_what_is_here() {
  shared_->statistics.resident = usage_.pages;
  shared_->statistics.bytes = usage_.bytes;
}

// A forged file may name one page twice, with different sources.
bool PageLoader::CacheEntry::is_of(const PageEntry& entry) const {
  return page != nullptr && page->sources.size() == entry.source_count;
}

bool PageLoader::load_now(const PageEntry& entry) {
  if (is_here(entry) || has_failed(entry)) return is_here(entry);
  auto content = fetch_(entry);
  const std::lock_guard lock(shared_->mutex);
  ++shared_->statistics.asked;
  take(entry.page.offset, 0, std::move(content));
  slots_[entry.page.offset].stays = true;
  count_what_is_here();
  return is_here(entry);
}

const ResidentPage* PageLoader::find(const PageEntry& entry) const {
  const auto slot = slots_.find(entry.page.offset);
  return slot == slots_.end() || !slot->second.is_of(entry) ? nullptr : slot->second.page.get();
}

bool PageLoader::has_failed(const PageEntry& entry) const {
  const auto slot = slots_.find(entry.page.offset);
  return slot != slots_.end() && !slot->second.is_of(entry);
}

bool PageLoader::begin_sample() {
  const std::lock_guard lock(shared_->mutex);
  PageStatistics& statistics = shared_->statistics;
  ++sample_;
  usage_.used_bytes = 0;
  const bool changed = !shared_->arrived.empty();
  arrived_.clear();
  for (auto& [page, bound, content] : shared_->arrived) {
    arrived_.push_back(page);
    take(page, bound, std::move(content));
  }
  std::sort(arrived_.begin(), arrived_.end());
  shared_->arrived.clear();
  const std::size_t before = usage_.pages;
  if (usage_.bytes > budget_.bytes) drop_too_much();
  has_dropped_ = usage_.pages != before;
  statistics.dropped += before - usage_.pages;
  count_what_is_here();
  statistics.late = late_;
  return changed || before != usage_.pages;
}

// Evicts by last use, then by bound. Children have no higher bounds than their parents and come
// before them in the file, so of pages that were used alike they are evicted first.
void PageLoader::drop_too_much() {
  std::vector<std::tuple<std::uint32_t, double, std::uint64_t>> order;  // use, bound, offset
  for (const auto& [offset, slot] : slots_)
    if (slot.page != nullptr && !slot.stays && (budget_.strict || slot.last_use + 1 < sample_))
      order.emplace_back(slot.last_use, slot.bound, offset);
  // A heap, as few of many are evicted.
  const std::greater<> last_goes_first;
  std::make_heap(order.begin(), order.end(), last_goes_first);
  while (usage_.bytes > budget_.bytes && !order.empty()) {
    std::pop_heap(order.begin(), order.end(), last_goes_first);
    const auto slot = slots_.find(std::get<std::uint64_t>(order.back()));
    order.pop_back();
    usage_.bytes -= slot->second.bytes;
    slots_.erase(slot);
    --usage_.pages;
  }
}

const ResidentPage* PageLoader::use(const PageEntry& entry, double bound) {
  const auto found = slots_.find(entry.page.offset);
  if (found == slots_.end()) {
    ++late_;
    return nullptr;
  }
  if (!found->second.is_of(entry)) return nullptr;
  use(found->second, bound);
  return found->second.page.get();
}

void PageLoader::use(CacheEntry& cached, double bound) {
  if (cached.page != nullptr && cached.last_use < sample_) {
    cached.bound = 0;
    usage_.used_bytes += cached.bytes;
    cached.last_use = sample_;
  }
  cached.bound = std::max(cached.bound, bound);
}

PageLoader::CacheEntry* PageLoader::find_entry(const PageEntry& entry) {
  const auto slot = slots_.find(entry.page.offset);
  return slot == slots_.end() || !slot->second.is_of(entry) ? nullptr : &slot->second;
}

std::size_t PageLoader::count_that_fit(std::span<const PageRequest> by_urgency) const {
  if (usage_.max_page_bytes == 0) return by_urgency.size();
  const std::uint64_t room =
      budget_.bytes > usage_.used_bytes ? budget_.bytes - usage_.used_bytes : 0;
  auto fit = static_cast<std::size_t>(
      std::min<std::uint64_t>(room / usage_.max_page_bytes, by_urgency.size()));
  if (fit == by_urgency.size()) return fit;
  std::vector<double> used;  // bounds of pages that may be evicted
  for (const auto& [offset, slot] : slots_)
    if (slot.page != nullptr && !slot.stays && slot.last_use >= sample_) used.push_back(slot.bound);
  std::sort(used.begin(), used.end());
  for (const double bound : used) {
    if (fit == by_urgency.size() || 2 * bound >= by_urgency[fit].bound) break;
    ++fit;
  }
  return fit;
}

void PageLoader::request(std::vector<PageRequest> wanted) {
  std::sort(wanted.begin(), wanted.end(), [](const PageRequest& a, const PageRequest& b) {
    if (a.needed != b.needed) return a.needed;
    return a.bound != b.bound ? a.bound > b.bound : a.entry.page.offset > b.entry.page.offset;
  });
  std::size_t fit = count_that_fit(wanted);
  if (!budget_.strict)
    fit = std::max<std::size_t>(fit,
                                std::count_if(wanted.begin(), wanted.end(),
                                              [](const PageRequest& one) { return one.needed; }));
  if (wanted.size() > fit) wanted.resize(fit);
  std::reverse(wanted.begin(), wanted.end());
  const std::lock_guard lock(shared_->mutex);
  std::erase_if(wanted, [this](const PageRequest& one) {
    return shared_->is_on_its_way(one.entry.page.offset);
  });
  for (const PageRequest& one : wanted)
    shared_->statistics.asked +=
        std::none_of(shared_->queue.begin(), shared_->queue.end(), [&](const PageRequest& before) {
          return before.entry.page.offset == one.entry.page.offset;
        });
  shared_->queue = std::move(wanted);
  if (!shared_->queue.empty()) shared_->work.notify_all();
}

bool PageLoader::wait() {
  std::unique_lock lock(shared_->mutex);
  const auto nothing = [this] {
    return shared_->queue.empty() && shared_->under_way.empty() && shared_->arrived.empty();
  };
  if (nothing()) return false;
  while (shared_->threads.empty() && !shared_->queue.empty())
    shared_->load_next(lock, fetch_, announce_);
  shared_->arrival.wait(lock,
                        [this] { return shared_->queue.empty() && shared_->under_way.empty(); });
  return true;
}

bool PageLoader::load_next() {
  std::unique_lock lock(shared_->mutex);
  if (shared_->queue.empty()) return false;
  shared_->load_next(lock, fetch_, announce_);
  return true;
}

PageStatistics PageLoader::statistics() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->statistics;
}

}  // namespace clamor
