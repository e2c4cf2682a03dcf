#include "tools/view/progressive_bake.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "bake/bake_cache.h"
#include "bake/bake_observer.h"
#include "bake/level_bake.h"
#include "common/platform/process.h"
#include "common/platform/thread.h"
#include "common/utf8_path.h"
#include "formats/bake_file/bake_contents.h"

namespace clamor {

namespace {

// Of the first stages: a second or two, and a few.
constexpr std::uint64_t kQuickPhotons = 1'000, kQuickSources = 15'000;
constexpr std::uint64_t kBetterPhotons = 12'000, kBetterSources = 80'000;

BakeStage smaller(const BakeRequest& request, const char* name, std::uint64_t photons,
                  std::uint64_t sources) {
  BakeStage stage{name, request, false};
  stage.request.photons = std::to_string(photons);
  if (!request.sources || *whole_number(*request.sources) > sources)
    stage.request.sources = std::to_string(sources);
  return stage;
}

}  // namespace

std::vector<BakeStage> stages_of(const BakeRequest& request) {
  std::vector<BakeStage> stages;
  const auto is_smaller = [&](std::uint64_t photons) {
    return !request.photons || *whole_number(*request.photons) > 2 * photons;
  };
  if (is_smaller(kQuickPhotons))
    stages.push_back(smaller(request, "quick", kQuickPhotons, kQuickSources));
  if (is_smaller(kBetterPhotons))
    stages.push_back(smaller(request, "better", kBetterPhotons, kBetterSources));
  if (!stages.empty()) stages.back().keeps_paths = true;
  stages.push_back({"final", request});
  return stages;
}

class ProgressiveBake::Observer final : public BakeObserver {
 public:
  explicit Observer(ProgressiveBake& owner) : owner_(owner) {}
  void on_warning(const std::string& text) override { warnings.push_back(text); }
  void on_progress(const BakeProgress& done) override {
    const std::lock_guard lock(owner_.mutex_);
    if (done.photons_total > 0)
      owner_.status_.share =
          static_cast<double>(done.photons_done) / static_cast<double>(done.photons_total);
  }

  std::vector<std::string> warnings;

 private:
  ProgressiveBake& owner_;
};

ProgressiveBake::ProgressiveBake(int threads)
    : threads_(threads), cache_(std::make_unique<BakeCache>()) {}

ProgressiveBake::~ProgressiveBake() {
  cancel();
  thread_ = {};
  std::error_code none;
  if (!folder_.empty()) std::filesystem::remove_all(path_of(folder_), none);
}

Result<void> ProgressiveBake::start() {
  const auto pattern = (std::filesystem::temp_directory_path() / "clamor-view-XXXXXX").string();
  const auto folder = make_temporary_folder(pattern);
  if (!folder)
    return Error(pattern + ": this folder for bakes cannot be made; set TMPDIR to another place");
  folder_ = *folder;
  thread_ = std::jthread([this](const std::stop_token& ended) { run(ended); });
  return {};
}

std::uint64_t ProgressiveBake::request(BakeRequest wanted, std::string output, bool only_last) {
  const std::lock_guard lock(mutex_);
  stop_ = true;
  requested_ = Clock::now();
  next_ = {++requests_, std::move(wanted), std::move(output), only_last, requested_};
  std::erase_if(events_, [](const Event& event) { return !event.is_final; });
  status_ = {true, "", 0, 0};
  asked_.notify_all();
  return requests_;
}

void ProgressiveBake::cancel() {
  const std::lock_guard lock(mutex_);
  stop_ = true;
  next_.reset();
  status_ = {};
}

std::optional<ProgressiveBake::Event> ProgressiveBake::poll() {
  const std::lock_guard lock(mutex_);
  if (events_.empty()) return std::nullopt;
  Event first = std::move(events_.front());
  events_.erase(events_.begin());
  return first;
}

ProgressiveBake::Status ProgressiveBake::status() const {
  const std::lock_guard lock(mutex_);
  Status status = status_;
  if (status.is_busy)
    status.seconds = std::chrono::duration<double>(Clock::now() - requested_).count();
  return status;
}

void ProgressiveBake::run(const std::stop_token& ended) {
  name_thread("bake");
  while (!ended.stop_requested()) {
    std::optional<Job> job;
    {
      std::unique_lock lock(mutex_);
      asked_.wait(lock, ended, [this] { return next_.has_value(); });
      if (ended.stop_requested()) return;
      job = std::exchange(next_, std::nullopt);
      stop_ = false;
    }
    serve(*job);
  }
}

void ProgressiveBake::serve(const Job& job) {
  std::vector<BakeStage> stages = stages_of(job.request);
  if (job.only_last) stages.erase(stages.begin(), stages.end() - 1);
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const bool is_last = i + 1 == stages.size();
    {
      const std::lock_guard lock(mutex_);
      if (next_ || stop_) return;
      status_ = {true, stages[i].name, 0, 0};
    }
    Event event = bake(job, stages[i], i == 0, is_last);
    const std::lock_guard lock(mutex_);
    if (next_ || stop_) return;
    const bool failed = !event.error.empty(), is_reweighed = event.is_reweighed;
    events_.push_back(std::move(event));
    if (is_last || failed) status_ = {};
    if (failed) return;
    // Re-weighed photons are as many as those of the stages before the last.
    if (is_reweighed) i = stages.size() - 2;
  }
}

ProgressiveBake::Event ProgressiveBake::bake(const Job& job, const BakeStage& stage, bool is_first,
                                             bool is_last) {
  Event event;
  event.request = job.number;
  event.stage = stage.name;
  event.is_final = is_last;
  LevelBakeOptions options;
  options.output =
      is_last && !job.output.empty() ? job.output : fmt::format("{}/{}.clamor", folder_, ++files_);
  options.bake.threads = threads_;
  // Sound and picture need a core, too, while somebody waits for the first stage alone.
  if (threads_ == 0 && !is_first)
    options.bake.threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()) - 1);
  options.journal = fmt::format("{}/{}.journal", folder_, stage.name);
  options.cache = cache_.get();
  if (is_first && !is_last) options.bake.reweighs = &cache_->paths;
  if (stage.keeps_paths) options.bake.keeps_paths = &cache_->paths;
  options.bake.stop = &stop_;
  Observer observer(*this);
  LevelBake level_bake(stage.request, options, observer);
  auto done = level_bake.read();
  if (done.ok()) done = level_bake.prepare();
  if (done.ok()) done = level_bake.write();
  event.seconds = std::chrono::duration<double>(Clock::now() - job.at).count();
  if (!done.ok()) {
    event.error = done.error().message;
    return event;
  }
  event.path = options.output;
  event.is_reweighed = level_bake.report().is_reweighed;
  event.why_traced = level_bake.report().why_traced;
  if (event.is_reweighed) event.stage = "re-weighed";
  event.sources = level_bake.contents().source_count() + level_bake.report().instanced_sources;
  event.decay_error_db = static_cast<double>(level_bake.contents().statistics.decay.error_db);
  event.warnings = std::move(observer.warnings);
  return event;
}

}  // namespace clamor
