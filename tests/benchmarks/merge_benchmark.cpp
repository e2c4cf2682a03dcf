// merge_benchmark.cpp: time, memory and disk space of merging the shards of a large bake, which
// decide how large a bake may be that a farm traces.
//
// The shards are synthetic (synthetic_shards.h). `clamor merge` runs as a process of its own with a
// memory limit. Writing alone is measured in the same run: the sources of the merged file, which
// are ready on the disk in no order, are sorted and written to another file, with the same memory
// limit and number of threads.
//
//   sources_M                     millions of sources
//   merge_s, writing_s            by the clock
//   merge_core_s, writing_core_s  CPU time
//   ratio, core_ratio             merge to writing, by the clock and by CPU time
//   peak_MB                       peak memory of the merge
//   scratch_MB                    temporary files of the merge at their largest, sampled
//   shards_MB, file_MB            its inputs and its output
//
// CLAMOR_MERGE="100000000 2000" in the environment measures that many sources with that many
// megabytes of memory instead. The benchmark fails unless both files have all sources.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bake/octree/octree_streaming.h"
#include "common/cpu_time.h"
#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_writer.h"
#include "tests/benchmarks/synthetic_shards.h"
#include "tests/benchmarks/wall_times.h"

namespace clamor {
namespace {

using testing::Clock;
using testing::seconds_since;

double core_seconds_of(const rusage& usage) {
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Bytes on the disk of the files that a process has open and that have no name any more.
std::uint64_t unnamed_bytes(pid_t process) {
  const std::string folder = "/proc/" + std::to_string(process) + "/fd";
  std::uint64_t bytes = 0;
  std::error_code gone;
  for (const auto& entry : std::filesystem::directory_iterator(folder, gone)) {
    struct stat file {};
    if (::stat(entry.path().c_str(), &file) == 0 && S_ISREG(file.st_mode) && file.st_nlink == 0)
      bytes += static_cast<std::uint64_t>(file.st_blocks) * 512;
  }
  return bytes;
}

struct MergeCost {
  bool done = false;
  double wall_s = 0, core_s = 0, peak_MB = 0, scratch_MB = 0;
};

MergeCost run_merge_of(const std::vector<std::string>& shards, const std::string& output,
                       std::uint64_t memory_MB) {
  std::vector<std::string> words{testing::kProgram, "merge"};
  words.insert(words.end(), shards.begin(), shards.end());
  words.insert(words.end(),
               {"-o", output, "--quiet", "--memory", std::to_string(memory_MB) + "MB"});
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  MergeCost cost;
  const auto start = Clock::now();
  const pid_t process = ::fork();
  if (process == 0) {
    ::execv(pointers[0], pointers.data());
    ::_exit(127);
  }
  rusage usage{};
  int status = 0;
  while (::wait4(process, &status, WNOHANG, &usage) == 0) {
    cost.scratch_MB = std::max(cost.scratch_MB, 1e-6 * static_cast<double>(unnamed_bytes(process)));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  cost.wall_s = seconds_since(start);
  cost.core_s = core_seconds_of(usage);
  cost.peak_MB = 1024e-6 * static_cast<double>(usage.ru_maxrss);
  cost.done = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  return cost;
}

// Copies the sources of a file's pages to a list, in an order that does not depend on places.
Result<ScratchList<Source>> sources_of(const BakeFile& file, const std::string& beside) {
  constexpr std::size_t kParts = 64;
  std::vector<ScratchList<Source>> parts;
  for (std::size_t i = 0; i < kParts; ++i) parts.emplace_back(beside);
  const auto read = file.for_each_page(
      [&](const PageEntry&, const OctreePage& page, std::size_t, std::size_t) -> Result<void> {
        for (const Source& source : page.sources) {
          const auto part = static_cast<std::size_t>(source.u * (kParts - 1e-3f));
          if (auto added = parts[part].append(std::span(&source, 1)); !added.ok()) return added;
        }
        return {};
      });
  if (!read.ok()) return read.error();
  ScratchList<Source> list(beside);
  for (ScratchList<Source>& part : parts) {
    std::vector<Source> some(part.all().begin(), part.all().end());
    std::shuffle(some.begin(), some.end(), std::minstd_rand(1));
    if (auto added = list.append(some); !added.ok()) return added.error();
    part = ScratchList<Source>();
  }
  return list;
}

struct WritingCost {
  double wall_s = 0, core_s = 0;
};

// Sorts and writes the sources of a file to another.
Result<WritingCost> write_again(const BakeFile& file, const std::string& output,
                                std::uint64_t memory_MB) {
  auto list = sources_of(file, output);
  if (!list.ok()) return list.error();
  BakeContents contents;
  contents.settings = file.settings();
  contents.provenance = file.provenance();
  contents.materials = file.materials();
  contents.emitters = file.emitters();
  for (std::size_t i = 0; i < file.signal_count(); ++i) {
    auto signal = file.read_signal(i);
    if (!signal.ok()) return signal.error();
    contents.signals.push_back(std::move(*signal));
  }
  contents.streamed_sources = list->size();
  // About as much memory as bake.cpp gives to sorting.
  contents.stream_octree = [&](OctreeSink& sink) {
    return stream_octree(std::move(*list), (memory_MB - 60) * 600'000, sink);
  };
  const double before_s = process_time_s();
  const auto start = Clock::now();
  if (auto written = write_bake(output, contents, 0); !written.ok()) return written.error();
  const double wall_s = seconds_since(start);
  return WritingCost{wall_s, process_time_s() - before_s};
}

void merge(benchmark::State& state) {
  auto sources = static_cast<std::uint64_t>(state.range(0)),
       memory_MB = static_cast<std::uint64_t>(state.range(1));
  if (const char* const wanted = std::getenv("CLAMOR_MERGE"))
    std::sscanf(wanted, "%lu %lu", &sources, &memory_MB);
  for (auto _ : state) {
    const testing::Folder folder;
    testing::SyntheticShards shards(folder, sources, 8);
    if (auto made = shards.write(); !made.ok())
      return state.SkipWithError(made.error().message.c_str());
    const MergeCost cost = run_merge_of(shards.paths(), folder / "merged.clamor", memory_MB);
    if (!cost.done) return state.SkipWithError("clamor merge failed");
    for (const std::string& path : shards.paths()) std::filesystem::remove(path);
    const auto merged = BakeFile::open(folder / "merged.clamor");
    if (!merged.ok()) return state.SkipWithError(merged.error().message.c_str());
    const auto writing = write_again(*merged, folder / "again.clamor", memory_MB);
    if (!writing.ok()) return state.SkipWithError(writing.error().message.c_str());
    const auto again = BakeFile::open(folder / "again.clamor");
    if (!again.ok() || again->source_count() != merged->source_count() ||
        merged->source_count() != sources + 1)
      return state.SkipWithError("sources are missing");
    state.counters["sources_M"] = 1e-6 * static_cast<double>(sources);
    state.counters["merge_s"] = cost.wall_s;
    state.counters["writing_s"] = writing->wall_s;
    state.counters["ratio"] = cost.wall_s / writing->wall_s;
    state.counters["merge_core_s"] = cost.core_s;
    state.counters["writing_core_s"] = writing->core_s;
    state.counters["core_ratio"] = cost.core_s / writing->core_s;
    state.counters["peak_MB"] = cost.peak_MB;
    state.counters["scratch_MB"] = cost.scratch_MB;
    state.counters["shards_MB"] = 1e-6 * static_cast<double>(shards.bytes());
    state.counters["file_MB"] =
        1e-6 * static_cast<double>(std::filesystem::file_size(folder / "merged.clamor"));
  }
}
BENCHMARK(merge)
    ->ArgNames({"sources", "memory_MB"})
    ->Args({3'000'000, 500})
    ->Args({10'000'000, 500})
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace clamor
