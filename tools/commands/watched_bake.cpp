#include "tools/commands/watched_bake.h"

#include <chrono>
#include <filesystem>
#include <mutex>
#include <ostream>
#include <thread>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "bake/bake_cache.h"
#include "common/utf8_path.h"
#include "formats/bake_file/bake_contents.h"
#include "tools/commands/commands.h"
#include "tools/program/interrupt.h"
#include "tools/program/terminal_output.h"
#include "tools/program/text_format.h"
#include "tools/report/level_findings.h"
#include "tools/view/progressive_bake.h"

namespace clamor {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kCheck = std::chrono::milliseconds(100);

// Looks at the files on a thread of its own, and stops the bake in progress when they change.
class ChangeStop {
 public:
  explicit ChangeStop(std::span<const std::string> paths) {
    watcher_.add(paths);
    thread_ = std::jthread([this](const std::stop_token& ended) {
      while (!ended.stop_requested()) {
        std::this_thread::sleep_for(kCheck);
        if (Interrupt::requested()) stop_ = true;
        const std::lock_guard lock(mutex_);
        if (!watcher_.check()) continue;
        changed_ = true;
        stop_ = true;
      }
    });
  }

  const std::atomic<bool>& stop() const { return stop_; }
  void add(std::span<const std::string> paths) {
    const std::lock_guard lock(mutex_);
    watcher_.add(paths);
  }

  // Waits for a change or an interrupt, and begins anew.
  void wait() {
    while (!changed_ && !Interrupt::requested()) std::this_thread::sleep_for(kCheck / 2);
    changed_ = false;
    stop_ = Interrupt::requested().load();
  }

 private:
  std::atomic<bool> stop_{false}, changed_{false};
  std::mutex mutex_;
  FilesWatcher watcher_;
  std::jthread thread_;
};

class WarningPrinter final : public BakeObserver {
 public:
  WarningPrinter(const std::string& level_path, bool prints, std::ostream& err)
      : level_path_(level_path), prints_(prints), err_(err) {}
  void on_warning(const std::string& text) override {
    if (!prints_) return;
    print_listed_warning(err_, text);
    if (const auto place_m = place_in(text))
      fmt::print(err_, "           {}\n", printable(view_command(level_path_, *place_m)));
  }

 private:
  const std::string& level_path_;
  const bool prints_;
  std::ostream& err_;
};

// Bakes all stages, as far as nothing stops it.
Result<void> bake_stages(const BakeRequest& request, const BakeRunOptions& run, BakeCache& cache,
                         ChangeStop& change, std::ostream& err) {
  const auto began = Clock::now();
  const std::vector<BakeStage> stages = stages_of(request);
  for (const BakeStage& stage : stages) {
    LevelBakeOptions options = run.bake;
    options.cache = &cache;
    options.bake.stop = &change.stop();
    options.reports_progress = false;
    const bool is_last = &stage == &stages.back();
    if (!is_last) options.journal = "";
    options.keeps_journal = true;
    WarningPrinter printer(request.level_path, is_last, err);
    LevelBake bake(stage.request, options, printer);
    if (auto read = bake.read(); !read.ok()) return read;
    change.add(bake.input_paths());
    if (auto prepared = bake.prepare(); !prepared.ok()) return prepared;
    if (auto written = bake.write(); !written.ok()) return written;
    if (run.quiet) continue;
    const BakeContents& contents = bake.contents();
    const double seconds = std::chrono::duration<double>(Clock::now() - began).count();
    fmt::print(err, "  {:<8} {}: {} sources{}, after {:.1f} s\n", stage.name, options.output,
               contents.source_count() + bake.report().instanced_sources,
               contents.statistics.decay.error_db > 0
                   ? fmt::format(", decay known to {:.2f} dB", contents.statistics.decay.error_db)
                   : "",
               seconds);
    err << std::flush;
  }
  return {};
}

}  // namespace

FilesWatcher::Versions FilesWatcher::now() const {
  Versions versions;
  for (const auto& [path, version] : known_) versions[path] = file_version(path);
  return versions;
}

void FilesWatcher::add(std::span<const std::string> paths) {
  for (const std::string& path : paths)
    if (known_.try_emplace(path, file_version(path)).second) seen_[path] = known_[path];
}

bool FilesWatcher::check() {
  Versions versions = now();
  const bool is_settled = versions == seen_;
  seen_ = std::move(versions);
  if (!is_settled || seen_ == known_) return false;
  known_ = seen_;
  return true;
}

int run_watched_bake(const BakeRequest& request, const BakeRunOptions& run, std::ostream& err) {
  const Interrupt interrupt;
  const std::string beside =
      path_of(request.level_path).replace_extension(".acoustics.json").string();
  const std::vector<std::string> first{request.level_path, request.import.sidecar.value_or(beside)};
  ChangeStop change(first);
  BakeCache cache;
  while (!Interrupt::requested()) {
    if (!run.quiet) fmt::print(err, "{}\n", printable(request.level_path));
    const auto baked = bake_stages(request, run, cache, change, err);
    if (!baked.ok() && !change.stop())
      fmt::print(err, "  waiting  {}\n", printable(baked.error().message));
    else if (baked.ok() && !run.quiet)
      fmt::print(err, "  waiting  for a change; Ctrl-C ends\n");
    err << std::flush;
    change.wait();
  }
  return kSuccess;
}

}  // namespace clamor
