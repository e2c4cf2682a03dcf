// open_benchmark.cpp: time from a file on disk to the first keyframe, which should not depend on
// the number of sources; and reading against mapping the file (random_access_file.h has the
// results).
//
// The sources lie on the walls of a hall of 2000 triangles. Times are by the clock: "open_ms" until
// the root is read, "ready_ms" until signals and first pages are loaded, and the whole until there
// is a keyframe to mix. CLAMOR_BAKE=FILE adds those of a bake. `cold`: nothing of the file is
// cached.
//
// pages_of_file opens the file and decodes every page, in the order of the file or shuffled, each
// prefetched eight pages ahead as by the page loader. Counters: pages per second by the clock, CPU
// time per page, megabytes read from the disk, and growth of resident memory (private, and shared
// with the page cache).
#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "common/cpu_time.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/page.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "tests/benchmarks/hall_file.h"

namespace clamor {
namespace {

// Drops the file from the page cache as far as an unprivileged program can, like a restart of the
// machine.
void forget(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::fdatasync(file);
  ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  ::close(file);
}

void hear_first(benchmark::State& state, const std::string& path, const Listener& pose,
                FileAccess access = FileAccess::kMap, bool cold = true) {
  double open_ms = 0, ready_ms = 0;
  for (auto _ : state) {
    state.PauseTiming();
    if (cold) forget(path);
    state.ResumeTiming();
    const auto start = std::chrono::steady_clock::now();
    const auto since = [&start] {
      return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
          .count();
    };
    auto opened = BakeFile::open(path, access);
    if (!opened.ok()) return state.SkipWithError(opened.error().message.c_str());
    open_ms += since();
    AuralizerOptions options;
    options.first_sounds_s = kFirstSoundsOfPlayer_s;
    auto auralizer =
        Auralizer::create(std::make_shared<const BakeFile>(std::move(*opened)), options);
    if (!auralizer.ok()) return state.SkipWithError(auralizer.error().message.c_str());
    ready_ms += since();
    (*auralizer)->make_keyframe(pose);
    state.PauseTiming();
    auralizer->reset();
    state.ResumeTiming();
  }
  const auto mean = [&state](double sum_ms) {
    return sum_ms / static_cast<double>(state.iterations());
  };
  state.counters["open_ms"] = mean(open_ms);
  state.counters["ready_ms"] = mean(ready_ms);
}
void first_sound(benchmark::State& state) {
  const testing::HallFile file(static_cast<std::uint32_t>(state.range(0)));
  if (!file.error.empty()) return state.SkipWithError(file.error.c_str());
  hear_first(state, file.path, {{10, 1.7, 7}, 0, 0},
             state.range(1) != 0 ? FileAccess::kMap : FileAccess::kRead, state.range(2) != 0);
}
BENCHMARK(first_sound)
    ->ArgNames({"sources", "mapped", "cold"})
    ->ArgsProduct({{10'000, 100'000, 1'000'000, 10'000'000}, {0, 1}, {1}})
    ->Args({1'000'000, 0, 0})
    ->Args({1'000'000, 1, 0})
    ->Iterations(10)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void first_sound_of_bake(benchmark::State& state) {
  const char* const path = testing::bake_to_measure();
  if (path == nullptr) return state.SkipWithError("CLAMOR_BAKE names no file");
  const auto file = BakeFile::open(path);
  if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
  if (file->emitters().empty()) return state.SkipWithError("the bake has no emitter");
  hear_first(state, path, {file->emitters().front().position_m + Vec3(0, 0, 2), 0, 0},
             state.range(0) != 0 ? FileAccess::kMap : FileAccess::kRead, state.range(1) != 0);
}
BENCHMARK(first_sound_of_bake)
    ->ArgNames({"mapped", "cold"})
    ->ArgsProduct({{0, 1}, {0, 1}})
    ->Iterations(10)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// A value of this process in /proc/self/status, in megabytes.
double resident_mb(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (double kilobytes = 0; word == name && status >> kilobytes) return kilobytes / 1024;
  return 0;
}

// Megabytes read from the disk so far.
double read_mb() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_inblock) * 512 / (1 << 20);
}

void pages_of_file(benchmark::State& state) {
  static const char* const bake = testing::bake_to_measure();
  static const testing::HallFile hall(bake != nullptr ? 1000 : 4'000'000);
  if (!hall.error.empty()) return state.SkipWithError(hall.error.c_str());
  const std::string path = bake != nullptr ? bake : hall.path;
  const FileAccess access = state.range(0) != 0 ? FileAccess::kMap : FileAccess::kRead;
  const bool cold = state.range(1) != 0, shuffled = state.range(2) != 0;
  std::vector<PageEntry> entries;
  {
    const auto file = BakeFile::open(path);
    if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
    const auto add = [&](const PageEntry& entry, const OctreePage&, std::size_t,
                         std::size_t) -> Result<void> {
      entries.push_back(entry);
      return {};
    };
    if (const auto done = file->for_each_page(add); !done.ok())
      return state.SkipWithError(done.error().message.c_str());
  }
  std::sort(entries.begin(), entries.end(), [&](const PageEntry& a, const PageEntry& b) {
    const auto order = [&](const PageEntry& e) { return shuffled ? e.page.hash : e.page.offset; };
    return order(a) < order(b);
  });
  const auto reader = std::make_unique<PageReader>();
  PageLinks links;
  double took_s = 0, from_disk_mb = 0, private_mb = 0, shared_mb = 0;
  for (auto _ : state) {
    state.PauseTiming();
    if (cold) forget(path);
    const double private_before = resident_mb("RssAnon:"), shared_before = resident_mb("RssFile:");
    const double start_s = process_time_s(), read_before = read_mb();
    state.ResumeTiming();
    const auto file = BakeFile::open(path, access);
    for (std::size_t i = 0; i < entries.size(); ++i) {
      constexpr std::size_t kAhead = 8;
      if (i + kAhead < entries.size()) file->will_need(entries[i + kAhead]);
      if (!file->read_page(entries[i], *reader, links).ok())
        return state.SkipWithError("a page cannot be read");
    }
    state.PauseTiming();
    took_s += process_time_s() - start_s;
    from_disk_mb += read_mb() - read_before;
    private_mb = resident_mb("RssAnon:") - private_before;
    shared_mb = resident_mb("RssFile:") - shared_before;
    state.ResumeTiming();
  }
  const double pages =
      static_cast<double>(entries.size()) * static_cast<double>(state.iterations());
  state.counters["pages_per_s"] = benchmark::Counter(pages, benchmark::Counter::kIsRate);
  state.counters["cpu_us_per_page"] = 1e6 * took_s / pages;
  state.counters["disk_mb"] = from_disk_mb / static_cast<double>(state.iterations());
  state.counters["private_mb"] = private_mb;
  state.counters["shared_mb"] = shared_mb;
}
BENCHMARK(pages_of_file)
    ->ArgNames({"mapped", "cold", "shuffled"})
    ->ArgsProduct({{0, 1}, {0, 1}, {0, 1}})
    ->Iterations(10)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
