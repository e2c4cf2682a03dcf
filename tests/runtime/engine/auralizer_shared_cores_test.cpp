// auralizer_shared_cores_test.cpp: the whole engine on a simulated machine whose cores are shared
// with other programs, without sleeping: both threads' clocks and CPU meters are simulated.
//
// The sampler's thread and the audio thread have a core each. Another program takes every second
// slice of both, as an endless loop does under a fair scheduler. Blocks are due in real time, also
// while a keyframe is in progress.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/mixing/keyframe_lead.h"
#include "runtime/mixing/load_control.h"
#include "runtime/voices/keyframe.h"
#include "tests/baked_room.h"

namespace clamor {
namespace {

constexpr std::uint32_t kMost = 200;
constexpr double kBlock_s = 256.0 / kSampleRate_hz;
constexpr double kSlice_s = 0.004, kNap_s = 0.001;

class SharedCores {
 public:
  // Shares of the time that there is, with all voices.
  double sampling = 0, mixing = 0;
  bool shared = false;  // another program takes every second slice

  explicit SharedCores(bool tracks_head) {
    AuralizerOptions options;
    options.voices = kMost;
    options.block_frames = 256;
    options.adapt = true;
    options.moving.max_sources = 1;  // so that each keyframe has a sample of its own
    options.tracks_head = tracks_head;
    options.sampler_clock = sampler_.clock();
    options.audio_clock = audio_.clock();
    sampler_.cores = audio_.cores = this;
    auto made = Auralizer::create(testing::baked_room(1000), options);
    EXPECT_TRUE(made.ok());
    auralizer_ = std::move(*made);
  }

  void run(double seconds) {
    for (const double end_s = now_s_ + seconds; now_s_ < end_s;) {
      now_s_ = passes(now_s_, 0);
      if (auralizer_->wants_keyframe()) {
        sampler_.work_share = sampling * kKeyframe_s;
        auralizer_->make_keyframe({{3, 4, 1.5}, 0.3, 0});
        sampler_.work_share = 0;
      } else {
        now_s_ += kNap_s;
        mix_until(now_s_);
      }
    }
  }

  AuralizerStatistics now() { return auralizer_->statistics(); }

 private:
  // A thread that works between two readings of its clock.
  struct Thread {
    SharedCores* cores = nullptr;
    double now_s = 0, cpu_s = 0;
    double work_share = 0;  // seconds of work with all voices, until the next reading but one
    bool works = false;

    LoadClock clock() {
      return {[](void* self) noexcept { return static_cast<Thread*>(self)->read(); }, this,
              [](void* self, clockid_t) noexcept { return static_cast<Thread*>(self)->cpu_s; }};
    }
    double read() noexcept {
      if (cores == nullptr || cores->auralizer_ == nullptr) return 0;
      return cores->read(*this);
    }
  };

  // The time at which work that begins at `start_s` ends; without work, when the thread runs.
  double passes(double start_s, double work_s) const {
    if (!shared) return start_s + work_s;
    const double turn_s = 2 * kSlice_s;
    double turn = std::floor(start_s / turn_s);
    const double used_s = std::min(start_s - turn * turn_s, kSlice_s);
    const double own_s = used_s + work_s;  // from the start of the turn's own slice on
    const double slices = std::floor(own_s / kSlice_s);
    turn += slices;
    return std::max(start_s, turn * turn_s + own_s - slices * kSlice_s);
  }

  double read(Thread& thread) noexcept {
    if (&thread == &audio_) return read_audio();
    thread.works = !thread.works;
    if (thread.works) return now_s_;
    const AuralizerStatistics made = auralizer_->statistics();
    const double work_s = thread.work_share * made.k / kMost;
    thread.cpu_s += work_s;
    const double end_s = passes(now_s_, work_s);
    mix_until(end_s);
    return now_s_ = end_s;
  }

  double read_audio() noexcept {
    audio_.works = !audio_.works;
    if (audio_.works) return audio_.now_s;
    const AuralizerStatistics made = auralizer_->statistics();
    const double sounding = made.voices - std::min(made.voices, made.shed_voices);
    const double work_s = mixing * kBlock_s * sounding / kMost;
    audio_.cpu_s += work_s;
    return audio_.now_s = passes(audio_.now_s, work_s);
  }

  // Mixes the blocks that are due by then, each when the audio thread has a core.
  void mix_until(double until_s) noexcept {
    for (; due_s_ <= until_s; due_s_ += kBlock_s) {
      audio_.now_s = passes(std::max(audio_.now_s, due_s_), 0);
      auralizer_->mix(block_);
    }
  }

  Thread sampler_, audio_;
  double now_s_ = 0, due_s_ = 0;
  std::vector<float> block_ = std::vector<float>(512);
  std::unique_ptr<Auralizer> auralizer_;
};

class Shared : public ::testing::TestWithParam<bool> {};

// Own work of 30 % needs 60 % of the time where another program takes every second slice.
TEST_P(Shared, HalfOfEachCoreCostsLeadAndNoVoices) {
  SharedCores machine(GetParam());
  machine.sampling = machine.mixing = 0.3;
  machine.run(2);
  const AuralizerStatistics alone = machine.now();
  EXPECT_LT(alone.waiting_share, 0.01);
  machine.shared = true;
  machine.run(2);
  const std::uint64_t held = machine.now().held_blocks;
  machine.run(20);
  const AuralizerStatistics shared = machine.now();
  EXPECT_EQ(shared.min_k, kMost);
  EXPECT_EQ(shared.shedding_blocks, 0u);
  EXPECT_EQ(shared.held_blocks, held);
  EXPECT_NEAR(shared.waiting_share, 0.5, 0.1);
  EXPECT_GT(shared.lead_s, alone.lead_s + 0.15 * kKeyframe_s);
  EXPECT_LE(shared.max_lead_s, KeyframeLead::kMax_s);
  machine.shared = false;
  machine.run(20);
  EXPECT_LT(machine.now().lead_s, alone.lead_s + 0.001);
  EXPECT_LT(machine.now().waiting_share, 0.01);
}

// The work of 90 % needs 180 % of the time, so that half of the voices are too many.
TEST_P(Shared, HalfOfEachCoreCostsTheVoicesThatDoNotFitAndTheyReturn_NoAsan) {
  for (const double own : {0.9, 1.5}) {
    SharedCores machine(GetParam());
    machine.sampling = 0.5;
    machine.mixing = 0.2;
    machine.run(2);
    machine.shared = true;
    machine.sampling = own;
    machine.run(5);
    const std::uint64_t held = machine.now().held_blocks;
    machine.run(10);
    const AuralizerStatistics shared = machine.now();
    const double passes = 2 * own * shared.k / kMost;
    EXPECT_GT(passes, kLowShare * 0.95) << own;
    EXPECT_LT(passes, kHighShare * 1.05) << own;
    EXPECT_EQ(shared.held_blocks, held) << own;
    machine.shared = false;
    machine.sampling = 0.5;
    machine.run(4);
    EXPECT_EQ(machine.now().k, kMost) << own;
  }
}

INSTANTIATE_TEST_SUITE_P(AuralizerLoad, Shared, ::testing::Bool(), [](const auto& moves) {
  return std::string(moves.param ? "WhileTheListenerMoves" : "OnAWalk");
});

}  // namespace
}  // namespace clamor
