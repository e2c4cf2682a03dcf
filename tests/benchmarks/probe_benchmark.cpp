// probe_benchmark.cpp: cost of a keyframe in which n moving sources are heard with reflections,
// against one without moving sources, in the same run. It decides how many a game may have.
//
// The bake is that of CLAMOR_BAKE, which needs probes, or the violin room. Sources walk at 1.5 m/s
// between probes and play noise; k = 2000. Real time is kept, so that pages arrive as in a player.
// `reverberates` 0: the sources are heard directly only. `bounded` is the share of keyframes whose
// search ended with its budget of work, perhaps with fewer voices; `ratio` is that of the medians
// of the sampler thread's CPU time.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <benchmark/benchmark.h>

#include "bake/level_bake.h"
#include "common/cpu_time.h"
#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_file.h"
#include "formats/files/random_access_file.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/voices/keyframe.h"
#include "tests/benchmarks/hall_file.h"
#include "tests/build_paths.h"

namespace clamor {
namespace {

std::shared_ptr<const BakeFile> bake_with_probes() {
  static const std::shared_ptr<const BakeFile> file = []() -> std::shared_ptr<const BakeFile> {
    std::string path;
    if (const char* const given = testing::bake_to_measure(); given != nullptr) {
      path = given;
    } else {
      path = std::filesystem::temp_directory_path() / "clamor_probe_benchmark.clamor";
      BakeRequest request;
      request.probes = "auto";
      request.level_path = std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb";
      LevelBakeOptions options;
      options.output = path;
      options.journal = "";
      BakeObserver silent;
      LevelBake bake(request, options, silent);
      if (!bake.read().ok() || !bake.prepare().ok() || !bake.write().ok()) return nullptr;
    }
    auto opened = BakeFile::open(path);
    // The open file stays readable.
    if (testing::bake_to_measure() == nullptr) std::filesystem::remove(path);
    return opened.ok() ? std::make_shared<const BakeFile>(std::move(*opened)) : nullptr;
  }();
  return file;
}

// An auralizer with walking sources, timed keyframe by keyframe.
class Walkers {
 public:
  Walkers(std::shared_ptr<const BakeFile> file, std::uint32_t count, bool reverberates)
      : file_(std::move(file)) {
    AuralizerOptions options;
    options.mixes_voices = false;
    options.moving.max_sources = count;
    options.moving.reverberates = reverberates;
    Signal noise{"noise", {}, true};
    for (std::uint32_t i = 0; i < 5 * kSampleRate_hz; ++i)
      noise.samples.push_back(static_cast<float>(unit(philox(1, {i, 0, 0, 0})[0]) - 0.5));
    const auto signals = static_cast<std::uint32_t>(file_->signal_count());
    if (count > 0) {
      options.moving.signals = {noise};
      options.moving.kinds = {{"walker", signals, Bands{}}};
    }
    auralizer_ = *Auralizer::create(file_, options);
    for (std::uint32_t i = 0; i < count; ++i) {
      MovingSource source;
      source.gain = same_in_all_bands(0.1f);
      source.position_m = place(i, 0);
      handles_.push_back(*auralizer_->moving()->add(source));
    }
  }

  void make_keyframes(const Listener& listener) {
    while (auralizer_->wants_keyframe()) {
      const double time_s = auralizer_->next_keyframe_time_s();
      for (std::uint32_t i = 0; i < handles_.size(); ++i)
        (void)auralizer_->moving()->move(handles_[i], place(i, time_s),
                                         (place(i, time_s + 0.01) - place(i, time_s)) / 0.01);
      if (auralizer_->moving() != nullptr) auralizer_->moving()->commit(time_s);
      const double start_s = thread_time_s();
      auralizer_->make_keyframe(listener);
      took_ms_.push_back(1e3 * (thread_time_s() - start_s));
      voices_ += auralizer_->statistics().voices;
    }
    std::vector<float> block(2 * kKeyframeFrames);
    auralizer_->mix(block);
  }

  double bounded_share() {
    return static_cast<double>(auralizer_->statistics().bounded_keyframes) /
           static_cast<double>(took_ms_.size());
  }

  double mean_voices() const {
    return static_cast<double>(voices_) / static_cast<double>(took_ms_.size());
  }

  double quantile_ms(double share) {
    std::sort(took_ms_.begin(), took_ms_.end());
    return took_ms_[static_cast<std::size_t>(share * static_cast<double>(took_ms_.size() - 1))];
  }

 private:
  // On a line between two probes, there and back at 1.5 m/s.
  Vec3 place(std::uint32_t i, double time_s) const {
    const auto& places = file_->probes().places;
    const RandomBits bits = philox(9, {i, 0, 0, 0});
    const Vec3 from_m = places[bits[0] % places.size()].position_m;
    const Vec3 to_m = places[bits[1] % places.size()].position_m;
    const double there_s = std::max(length(to_m - from_m), 1.0) / 1.5;
    const double turns = (time_s + there_s * unit(bits[2])) / there_s;
    const double share = std::abs(turns - 2 * std::round(turns / 2));
    return from_m + share * (to_m - from_m);
  }

  std::shared_ptr<const BakeFile> file_;
  std::unique_ptr<Auralizer> auralizer_;
  std::vector<MovingHandle> handles_;
  std::vector<double> took_ms_;
  std::uint64_t voices_ = 0;  // of all keyframes
};

void reverberant_keyframe(benchmark::State& state) {
  const auto file = bake_with_probes();
  if (file == nullptr || file->probes().places.empty())
    return state.SkipWithError("the bake has no probes");
  Walkers none(file, 0, false);
  Walkers many(file, static_cast<std::uint32_t>(state.range(0)), state.range(1) != 0);
  const Vec3 middle_m = file->probes().places[file->probes().places.size() / 2].position_m;
  auto due = std::chrono::steady_clock::now();
  double time_s = 0;
  for (auto _ : state) {
    std::this_thread::sleep_until(due);
    due += std::chrono::milliseconds(20);
    const Listener listener{middle_m + 0.2 * Vec3(std::sin(5 * time_s), 0, std::cos(5 * time_s)), 0,
                            0};
    none.make_keyframes(listener);
    many.make_keyframes(listener);
    time_s += 0.02;
  }
  state.counters["none_ms"] = none.quantile_ms(0.5);
  state.counters["many_ms"] = many.quantile_ms(0.5);
  state.counters["many_p95_ms"] = many.quantile_ms(0.95);
  state.counters["bounded"] = many.bounded_share();
  state.counters["voices"] = many.mean_voices();
  state.counters["ratio"] = many.quantile_ms(0.5) / none.quantile_ms(0.5);
}
BENCHMARK(reverberant_keyframe)
    ->ArgNames({"sources", "reverberates"})
    ->ArgsProduct({{1, 100, 1000}, {0, 1}})
    ->Iterations(250)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
