// bench_voices.h: the voices with which mixing is timed.
//
// The mix runs at 48 kHz with blocks of 256 frames and a keyframe every 960. Voices read 13 looping
// signals of 2 s at random delays; most delays slide by less than 0.1 % of real time, 3 % of them
// by up to 10 %, as in a hall with a few fast sources.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "runtime/hrtf/hrtf.h"
#include "runtime/mixing/mixer.h"
#include "runtime/mixing/panner.h"
#include "runtime/voices/mix_reference.h"
#include "tools/bench/openal_voices.h"

namespace clamor {

inline constexpr std::uint32_t kBenchSignals = 13;
inline constexpr int kBenchFrames = 256;
inline constexpr int kBenchSignalFrames = 2 * kSampleRate_hz;

// kTypical: as described above. The other kinds take away one cost each: kStill has constant
// delays, kStaticInL1 also reads within a few kilobytes, which stay in the L1 cache.
enum class BenchVoiceKind : std::uint8_t { kTypical, kStill, kStaticInL1 };

// Voices that are mixed by the kernel alone, and their advance from call to call.
class KernelVoices {
 public:
  // Each call of mix() mixes `frames` frames.
  KernelVoices(const MixMode& mode, std::uint32_t count,
               BenchVoiceKind are = BenchVoiceKind::kTypical, int frames = kBenchFrames);

  void mix();
  void mix_with_reference();  // not for binaural modes
  bool heard() const;

 private:
  struct Buses {
    alignas(64) float high[kHrtfHighBands * kEars * kMaxFrames] = {};
    alignas(64) float low[kHrtfLowRows * kEars * kMaxFrames / kLowRate] = {};
  };
  // One part holds all voices; binaural modes have a second part for the narrowband voices.
  struct Part {
    MixMode mode;
    std::vector<std::uint32_t> active = {};
    std::vector<float> gains = {};
    std::unique_ptr<Buses> buses = std::make_unique<Buses>();
  };
  MixJob job(Part& part) const;

  MixMode mode_;
  int frames_;
  std::vector<VoicePath> paths_;
  std::vector<Part> parts_;
  std::int64_t wrap_;
  std::unique_ptr<ReferenceBuses> reference_;
};

// A whole mixer that gets two keyframes in alternation, so that all gains, delays and directions
// keep changing.
class MixerVoices {
 public:
  MixerVoices(const MixMode& mode, std::uint32_t count);

  void mix();  // one block
  bool heard() const { return energy_ > 0; }

 private:
  std::array<Keyframe, 2> keyframes_;
  std::unique_ptr<const Panner> panner_;
  std::shared_ptr<const Hrtf> head_;
  Mixer mixer_;
  std::vector<float> block_;
  std::size_t next_ = 1;
  double energy_ = 0;
};

// The signals, prepared for a mode, and the head of binaural ones.
const std::vector<PreparedSignal>& bench_signals(const MixMode& mode);
const std::shared_ptr<const Hrtf>& bench_head();

// Voices for OpenAL Soft, equal to those above, at one of two moments.
const std::vector<std::vector<float>>& bench_samples();
std::vector<OpenalVoices::Voice> openal_voices_at(std::uint32_t moment, std::uint32_t count);

}  // namespace clamor
