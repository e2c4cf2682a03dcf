// How long is it from a file on disk, none of which is cached, to the first sound? It should not
// depend on the number of sources.
//
// Sources lie on the walls of a hall of 2000 triangles. Times are of the clock: "open_ms" until the
// root is read, "ready_ms" until signals and first pages are, the whole until there is a
// keyframe to mix. CLAMOR_BAKE=FILE adds that of a bake.
#include <chrono>
#include <memory>
#include <string>

#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <unistd.h>

#include "formats/bake_file.h"
#include "runtime/auralizer.h"
#include "tests/benchmarks/hall_file.h"

namespace clamor {
namespace {

// A file of so many sources, removed in the end.
// As after a start of the machine, as far as a program may say so.
void forget(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::fdatasync(file);
  ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  ::close(file);
}

void hear_first(benchmark::State& state, const std::string& path, const Pose& pose) {
  double open_ms = 0, ready_ms = 0;
  for (auto _ : state) {
    state.PauseTiming();
    forget(path);
    state.ResumeTiming();
    const auto start = std::chrono::steady_clock::now();
    const auto since = [&start] {
      return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
          .count();
    };
    auto opened = BakeFile::open(path);
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
  hear_first(state, file.path, {{10, 1.7, 7}, 0, 0});
}
BENCHMARK(first_sound)
    ->ArgName("sources")
    ->Arg(10'000)
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Arg(10'000'000)
    ->Iterations(10)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void first_sound_of_bake(benchmark::State& state) {
  const char* const path = testing::bake_to_measure();
  if (path == nullptr) return state.SkipWithError("CLAMOR_BAKE names no file");
  const auto file = BakeFile::open(path);
  if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
  if (file->emitters().empty()) return state.SkipWithError("the bake has no emitter");
  hear_first(state, path, {file->emitters().front().position_m + Vec3(0, 0, 2), 0, 0});
}
BENCHMARK(first_sound_of_bake)->Iterations(10)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
