// How long is it from a file on disk, none of which is cached, to the first sound? It should not
// depend on the number of sources.
//
// Sources lie on the walls of a hall of 2000 triangles. Times are of the clock: "open_ms" until the
// root is read, "ready_ms" until signals and first pages are, the whole until there is a
// keyframe to mix.
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <unistd.h>

#include "bake/octree_builder.h"
#include "common/random.h"
#include "formats/bake_file.h"
#include "runtime/auralizer.h"
#include "tests/source_lists.h"

namespace clamor {
namespace {

// A file of so many sources, removed in the end.
struct HallFile {
  explicit HallFile(std::uint32_t sources)
      : path((std::filesystem::temp_directory_path() /
              ("clamor_open_" + std::to_string(getpid()) + ".clamor"))
                 .string()) {
    BakeContents bake;
    bake.provenance.tool = "clamor benchmark";
    Signal& noise = bake.signals.emplace_back();
    noise.name = "noise";
    for (std::uint32_t i = 0; i < 5 * kSampleRate_hz; ++i)
      noise.samples.push_back(static_cast<float>(unit(philox(1, {i, 0, 0, 0})[0]) - 0.5));
    bake.emitters = {Emitter{.name = "source", .position_m = {10, 1.7, 12}}};
    bake.materials.resize(1);
    bake.materials[0].name = "wall";
    bake.materials[0].scattering = same_in_all_bands(0.5f);
    for (std::uint32_t i = 0; i < 2000; ++i) {  // a floor in strips
      for (const Vec3f& at :
           {Vec3f(0.01f * i, 0, 0), Vec3f(0.01f * i, 0, 15), Vec3f(0.01f * (i + 1), 0, 15)})
        bake.mesh.vertices_m.push_back(at);
      bake.mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
      bake.mesh.materials.push_back(0);
    }
    bake.octree = build_octree(testing::wall_sources(sources));
    const auto written = write_bake(path, bake, 2);
    if (!written.ok()) error = written.error().message;
  }
  ~HallFile() { std::filesystem::remove(path); }

  // As after a start of the machine, as far as a program may say so.
  void forget() const {
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) return;
    ::fdatasync(file);
    ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
    ::close(file);
  }

  const std::string path;
  std::string error;
};

void first_sound(benchmark::State& state) {
  const HallFile file(static_cast<std::uint32_t>(state.range(0)));
  if (!file.error.empty()) return state.SkipWithError(file.error.c_str());

  double open_ms = 0, ready_ms = 0;
  for (auto _ : state) {
    state.PauseTiming();
    file.forget();
    state.ResumeTiming();
    const auto start = std::chrono::steady_clock::now();
    const auto since = [&start] {
      return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
          .count();
    };
    auto opened = BakeFile::open(file.path);
    if (!opened.ok()) return state.SkipWithError(opened.error().message.c_str());
    open_ms += since();
    auto auralizer =
        Auralizer::create(std::make_shared<const BakeFile>(std::move(*opened)), AuralizerOptions{});
    if (!auralizer.ok()) return state.SkipWithError(auralizer.error().message.c_str());
    ready_ms += since();
    const Pose pose{{10, 1.7, 7}, 0, 0};
    (*auralizer)->make_keyframe(pose);
  }
  const auto mean = [&state](double sum_ms) {
    return sum_ms / static_cast<double>(state.iterations());
  };
  state.counters["open_ms"] = mean(open_ms);
  state.counters["ready_ms"] = mean(ready_ms);
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

}  // namespace
}  // namespace clamor
