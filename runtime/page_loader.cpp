#include "runtime/page_loader.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace clamor {

// What the sampler and the loader threads share; all under the mutex.
struct PageLoader::Shared {
  struct Arrival {
    std::uint32_t page = 0;
    Result<std::unique_ptr<const SourcePage>> content;
  };

  std::mutex mutex;
  std::condition_variable work, arrival;
  bool closing = false;
  std::vector<WantedPage> queue;         // the most urgent last
  std::vector<std::uint32_t> under_way;  // being fetched
  std::vector<Arrival> arrived;
  PageStatistics statistics;
  std::vector<std::thread> threads;

  bool is_on_its_way(std::uint32_t page) const {
    return std::find(under_way.begin(), under_way.end(), page) != under_way.end() ||
           std::any_of(arrived.begin(), arrived.end(),
                       [page](const Arrival& a) { return a.page == page; });
  }

  void run(const Fetch& fetch) {
    std::unique_lock lock(mutex);
    for (;;) {
      work.wait(lock, [this] { return closing || !queue.empty(); });
      if (closing) return;
      const std::uint32_t page = queue.back().page;
      queue.pop_back();
      under_way.push_back(page);
      lock.unlock();
      auto content = fetch(page);
      lock.lock();
      std::erase(under_way, page);
      arrived.push_back({page, std::move(content)});
      arrival.notify_all();
    }
  }
};

PageLoader::PageLoader(Fetch fetch, std::size_t pages, const PageBudget& budget, int threads)
    : fetch_(std::move(fetch)),
      budget_(budget),
      pages_(pages),
      failed_(pages, false),
      last_use_(pages, 0),
      shared_(std::make_unique<Shared>()) {
  for (int i = 0; i < threads; ++i) shared_->threads.emplace_back([this] { shared_->run(fetch_); });
}

PageLoader::~PageLoader() {
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->closing = true;
  }
  shared_->work.notify_all();
  for (std::thread& thread : shared_->threads) thread.join();
}

void PageLoader::take(std::uint32_t page, Result<std::unique_ptr<const SourcePage>> content) {
  PageStatistics& statistics = shared_->statistics;
  if (!content.ok()) {
    failed_[page] = true;
    ++statistics.failed;
    if (statistics.failure.empty()) statistics.failure = content.error().message;
    return;
  }
  const std::uint64_t bytes = (*content)->bytes();
  bytes_ += bytes;
  most_page_bytes_ = std::max(most_page_bytes_, bytes);
  pages_[page] = std::move(*content);
  last_use_[page] = sample_ - 1;  // so that it is not dropped before it was looked at
  here_.push_back(page);
  ++statistics.loaded;
}

void PageLoader::count_what_is_here() {
  shared_->statistics.resident = here_.size();
  shared_->statistics.bytes = bytes_;
}

bool PageLoader::load_now(std::uint32_t page) {
  if (pages_[page] != nullptr) return true;
  auto content = fetch_(page);
  const std::lock_guard lock(shared_->mutex);
  ++shared_->statistics.asked;
  take(page, std::move(content));
  count_what_is_here();
  return pages_[page] != nullptr;
}

bool PageLoader::begin_sample() {
  const std::lock_guard lock(shared_->mutex);
  PageStatistics& statistics = shared_->statistics;
  ++sample_;
  used_bytes_ = 0;
  const bool changed = !shared_->arrived.empty();
  for (auto& [page, content] : shared_->arrived) take(page, std::move(content));
  shared_->arrived.clear();
  const std::size_t before = here_.size();
  if (bytes_ > budget_.bytes) drop_too_much();
  statistics.dropped += before - here_.size();
  count_what_is_here();
  statistics.late = late_;
  return changed || before != here_.size();
}

// Children come after their parents in the file, so of pages used alike the later go first.
void PageLoader::drop_too_much() {
  std::sort(here_.begin(), here_.end(), [this](std::uint32_t a, std::uint32_t b) {
    return last_use_[a] != last_use_[b] ? last_use_[a] > last_use_[b] : a < b;
  });
  while (bytes_ > budget_.bytes && here_.size() > 1 && last_use_[here_.back()] + 1 < sample_) {
    bytes_ -= pages_[here_.back()]->bytes();
    pages_[here_.back()].reset();
    here_.pop_back();
  }
}

const SourcePage* PageLoader::use(std::uint32_t page) {
  const SourcePage* const content = pages_[page].get();
  late_ += content == nullptr && !failed_[page];
  if (content != nullptr && last_use_[page] != sample_) {
    last_use_[page] = sample_;
    used_bytes_ += content->bytes();
  }
  return content;
}

void PageLoader::ask(std::vector<WantedPage> wanted) {
  std::uint64_t needed = 0;
  for (const WantedPage& one : wanted) needed += one.needed;
  const std::uint64_t room = budget_.bytes > used_bytes_ ? budget_.bytes - used_bytes_ : 0;
  std::uint64_t fit = most_page_bytes_ > 0 ? room / most_page_bytes_ : wanted.size();
  if (!budget_.strict) fit = std::max(fit, needed);
  std::sort(wanted.begin(), wanted.end(), [](const WantedPage& a, const WantedPage& b) {
    if (a.needed != b.needed) return a.needed;
    return a.urgency != b.urgency ? a.urgency > b.urgency : a.page < b.page;
  });
  if (wanted.size() > fit) wanted.resize(fit);
  std::reverse(wanted.begin(), wanted.end());
  const std::lock_guard lock(shared_->mutex);
  std::erase_if(wanted, [this](const WantedPage& one) { return shared_->is_on_its_way(one.page); });
  for (const WantedPage& one : wanted)
    shared_->statistics.asked +=
        std::none_of(shared_->queue.begin(), shared_->queue.end(),
                     [&](const WantedPage& before) { return before.page == one.page; });
  shared_->queue = std::move(wanted);
  if (!shared_->queue.empty()) shared_->work.notify_all();
}

bool PageLoader::wait() {
  std::unique_lock lock(shared_->mutex);
  const auto nothing = [this] {
    return shared_->queue.empty() && shared_->under_way.empty() && shared_->arrived.empty();
  };
  if (nothing()) return false;
  shared_->arrival.wait(lock, [this] { return !shared_->arrived.empty(); });
  return true;
}

PageStatistics PageLoader::statistics() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->statistics;
}

}  // namespace clamor
