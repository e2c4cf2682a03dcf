// field_walk_benchmark.cpp: CPU time of a walk that hears all sources as a field, against voices.
//
// Both listeners follow the walk of CLAMOR_WALK through the bake of CLAMOR_BAKE, over headphones
// and with occlusion, and take turns of half a second. Nothing is timed while occlusion settles.
// `field_s` and `voices_s` are CPU time per second of sound, `ratio` is one over the other, and
// `field_mixing_s` and `voices_mixing_s` are what of it mixes. The occlusion of all of the field's
// sources was known from `field_settles_s` of the walk on. Load control is off.
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/cpu_time.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/walk_file.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/mixing/output_format.h"
#include "runtime/voices/keyframe.h"
#include "tests/benchmarks/hall_file.h"

namespace clamor {
namespace {

constexpr int kTurn_keyframes = 25;
constexpr double kSettles_s = 16, kTimed_s = 12;
constexpr int kEverything = 1'000'000;

class FieldWalker {
 public:
  FieldWalker(std::shared_ptr<const BakeFile> file, const Walk& walk, Mixing mixing, int voices)
      : walk_(walk) {
    AuralizerOptions options;
    options.voices = voices;
    options.mixing = mixing;
    options.memory_bytes = std::uint64_t{2} << 30;
    options.output = *OutputFormat::from_options(true, "", false, "");
    auto made = Auralizer::create(std::move(file), options);
    if (made.ok()) auralizer_ = std::move(*made);
  }
  bool is_ok() const { return auralizer_ != nullptr; }

  void go_on(int keyframes) {
    for (int k = 0; k < keyframes; ++k) {
      const double start_s = thread_time_s();
      while (auralizer_->wants_keyframe())
        auralizer_->make_keyframe(walk_.at(auralizer_->next_keyframe_time_s()));
      const double made_s = thread_time_s();
      const std::uint64_t late = auralizer_->statistics().late_sources;
      if (std::exchange(late_, late) != late) settled_s_ = auralizer_->next_keyframe_time_s();
      auralizer_->mix(block_);
      making_s_ += made_s - start_s;
      mixing_s_ += thread_time_s() - made_s;
    }
  }
  void begin_timing() { making_s_ = mixing_s_ = 0; }
  double spent_s() const { return making_s_ + mixing_s_; }
  double mixing_s() const { return mixing_s_; }
  double settled_s() const { return settled_s_; }

 private:
  const Walk& walk_;
  std::unique_ptr<Auralizer> auralizer_;
  std::vector<float> block_ = std::vector<float>(2 * kKeyframeFrames);
  double making_s_ = 0, mixing_s_ = 0, settled_s_ = 0;
  std::uint64_t late_ = 0;
};

void field_walk(benchmark::State& state) {
  const char* const path = std::getenv("CLAMOR_WALK");
  if (path == nullptr || testing::bake_to_measure() == nullptr)
    return state.SkipWithError("CLAMOR_BAKE or CLAMOR_WALK names no file");
  const auto walk = Walk::read(path);
  if (!walk.ok()) return state.SkipWithError(walk.error().message.c_str());
  auto opened = BakeFile::open(testing::bake_to_measure());
  if (!opened.ok()) return state.SkipWithError(opened.error().message.c_str());
  const auto file = std::make_shared<const BakeFile>(std::move(*opened));
  FieldWalker field(file, *walk, Mixing::kField, kEverything);
  FieldWalker voices(file, *walk, Mixing::kVoices, static_cast<int>(state.range(0)));
  if (!field.is_ok() || !voices.is_ok()) return state.SkipWithError("the bake cannot be played");
  const auto take_turns = [&](double seconds) {
    for (double at_s = 0; at_s < seconds; at_s += kTurn_keyframes * kKeyframe_s) {
      field.go_on(kTurn_keyframes);
      voices.go_on(kTurn_keyframes);
    }
  };
  for (auto _ : state) {
    take_turns(kSettles_s);
    field.begin_timing();
    voices.begin_timing();
    take_turns(kTimed_s);
  }
  state.counters["field_s"] = field.spent_s() / kTimed_s;
  state.counters["field_mixing_s"] = field.mixing_s() / kTimed_s;
  state.counters["voices_s"] = voices.spent_s() / kTimed_s;
  state.counters["voices_mixing_s"] = voices.mixing_s() / kTimed_s;
  state.counters["field_settles_s"] = field.settled_s();
  state.counters["ratio"] = field.spent_s() / voices.spent_s();
}
BENCHMARK(field_walk)
    ->ArgName("voices")
    ->Arg(20'000)
    ->Arg(kEverything)
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace clamor
