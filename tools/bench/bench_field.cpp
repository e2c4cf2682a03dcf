#include "tools/bench/bench_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "common/cpu_time.h"
#include "common/random.h"
#include "runtime/mixing/field_maker.h"
#include "runtime/mixing/itd_table.h"
#include "runtime/mixing/mixer.h"
#include "tools/bench/bench_voices.h"

namespace clamor {

namespace {

constexpr double kSpeed_mps = 1.5, kRadius_m = 5, kLongest_s = 1;

std::vector<Emitter> bench_emitters() {
  std::vector<Emitter> emitters(kBenchSignals);
  for (std::uint32_t e = 0; e < kBenchSignals; ++e) emitters[e].signal = e;
  return emitters;
}

// Reflections all round the listener, which decay by 60 dB in a second.
class BenchField {
 public:
  BenchField(const MixMode& mode, std::uint32_t taps)
      : emitters_(bench_emitters()),
        materials_(1),
        sources_(taps),
        radiation_(emitters_, materials_, Air()),
        itd_table_(mode.head ? std::make_unique<const ItdTable>(*bench_head()) : nullptr),
        head_(mode.head ? bench_head() : nullptr),
        maker_(radiation_, bench_signals(mode), {mode, head_.get(), itd_table_.get()}, false),
        mixer_(bench_signals(mode), 1, mode, nullptr, head_.get()) {
    for (std::uint32_t t = 0; t < taps; ++t) {
      const RandomBits a = philox(1, {t, 0, 0, 0}), b = philox(1, {t, 1, 0, 0});
      Source& source = sources_[t];
      const Vec3 place = Vec3(unit(a[0]), unit(a[1]), unit(a[2])) - 0.4999;
      source.position_m = Vec3f(2 * kRadius_m * place);
      source.normal = source.mirror = Vec3f(-place / length(place));
      source.delay_s = static_cast<float>(0.01 + kLongest_s * unit(a[3]));
      source.power = same_in_all_bands(
          static_cast<float>(std::pow(10, -6.0 * static_cast<double>(source.delay_s)) / taps));
      source.patch_radius_m = 1;
      source.polarity = b[0] % 2 == 0 ? 1 : -1;
      source.emitter = static_cast<std::uint32_t>(std::uint64_t{t} * kBenchSignals / taps);
      SampledSource& chosen = sample_.emplace_back();
      chosen.number = t;
      chosen.source = &source;
      chosen.signal = source.emitter;
    }
    make_keyframe();
    mixer_.begin(keyframe_, 1 << 30);
  }

  void make_keyframe() {
    const Vec3 place(0.5 * std::sin(2 * at_m_), 0, 0.5 * std::cos(2 * at_m_));
    const Listener listener = motion_.next(Listener(place));
    maker_.divide(sample_, at_m_ == 0, listener, at_m_ / kSpeed_mps);
    maker_.make(listener, {}, keyframe_);
    at_m_ += kSpeed_mps * kKeyframe_s;
  }

  void mix() {
    mixer_.load(keyframe_);
    for (int done = 0; done < kKeyframeFrames;) {
      const int steps = mixer_.steps_left();
      mixer_.mix(block_.data(), steps);
      done += steps * kStepFrames;
      energy_ += std::abs(static_cast<double>(block_[0]));
    }
  }

  bool heard() const { return energy_ > 0; }

 private:
  const std::vector<Emitter> emitters_;
  const std::vector<Material> materials_;
  std::vector<Source> sources_;
  const RadiationModel radiation_;
  std::vector<SampledSource> sample_;
  const std::unique_ptr<const ItdTable> itd_table_;
  const std::shared_ptr<const Hrtf> head_;
  ListenerMotion motion_{kKeyframe_s};
  double at_m_ = 0;
  FieldMaker maker_;
  Keyframe keyframe_;
  Mixer mixer_;
  std::array<float, kEars * kMaxFrames> block_{};
  double energy_ = 0;
};

}  // namespace

const std::vector<MixMode>& field_modes() {
  static const auto kModes = [] {
    std::vector<MixMode> modes(2);
    for (MixMode& mode : modes) mode.field = true;
    modes[0].head = true;
    return modes;
  }();
  return kModes;
}

bool time_field(FieldTiming& figure, double seconds, int runs) {
  BenchField field(figure.mode, figure.taps);
  // Both parts are renewed within so many keyframes.
  constexpr int kRound = 2 * kTapFade_keyframes;
  double renewing_s = HUGE_VAL, mixing_s = HUGE_VAL;
  for (int run = 0; run <= runs; ++run) {
    double renewing = 0, mixing = 0;
    int keyframes = 0;
    while (keyframes == 0 || (run > 0 && renewing + mixing < seconds)) {
      for (int k = 0; k < kRound; ++k, ++keyframes) {
        const double start = thread_time_s();
        field.make_keyframe();
        const double made = thread_time_s();
        field.mix();
        renewing += made - start;
        mixing += thread_time_s() - made;
      }
    }
    if (run == 0) continue;  // fills the caches
    const double played_s = keyframes * kKeyframe_s;
    renewing_s = std::min(renewing_s, renewing / played_s);
    mixing_s = std::min(mixing_s, mixing / played_s);
  }
  // A late tap is renewed every kTapFade_keyframes; the few early ones, twice as often, count once.
  const double renewals_per_s = 1 / (kTapFade_keyframes * kKeyframe_s);
  figure.renewal_ns = 1e9 * renewing_s / (renewals_per_s * kEars * figure.taps);
  figure.convolution_s = mixing_s / (kEars * kBenchSignals);
  figure.cpu_s = renewing_s + mixing_s;
  return field.heard();
}

}  // namespace clamor
