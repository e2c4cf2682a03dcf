#include "tools/bench/bench_voices.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/random.h"

namespace clamor {

namespace {

constexpr std::uint32_t kSignals = kBenchSignals, kSignalFrames = kBenchSignalFrames;

double random_unit(std::uint32_t voice, std::uint32_t use) {
  return unit(philox(11, {voice, use, 0, 0})[0]);
}

double drift_of(std::uint32_t voice, int ear) {
  const double most = random_unit(voice, 1) < 0.03 ? 0.1 : 0.001;
  return most * (2 * random_unit(voice, 2 + static_cast<std::uint32_t>(ear)) - 1);
}

std::uint32_t signal_of(std::uint32_t voice, std::uint32_t count) {
  return static_cast<std::uint32_t>(std::uint64_t{voice} * kSignals / count);
}

}  // namespace

const std::vector<PreparedSignal>& bench_signals(const MixMode& mode) {
  static std::vector<std::pair<MixMode, std::vector<PreparedSignal>>> kept;
  for (const auto& [kept_mode, signals] : kept)
    if (kept_mode.interpolation == mode.interpolation &&
        kept_mode.eight_bands == mode.eight_bands && kept_mode.head == mode.head)
      return signals;
  std::vector<Signal> noises(kSignals);
  for (std::uint32_t s = 0; s < kSignals; ++s) noises[s].samples = bench_samples()[s];
  return kept.emplace_back(mode, prepare_signals(noises, mode)).second;
}

// Loading the HRTF takes half a second, so it is done once.
const std::shared_ptr<const Hrtf>& bench_head() {
  static const std::shared_ptr<const Hrtf> kHead = *Hrtf::read("");
  return kHead;
}

const std::vector<std::vector<float>>& bench_samples() {
  static const auto kSamples = [] {
    std::vector<std::vector<float>> signals(kSignals);
    for (std::uint32_t s = 0; s < kSignals; ++s)
      for (std::uint32_t i = 0; i < kSignalFrames; ++i)
        signals[s].push_back(static_cast<float>(unit(philox(s, {i, 0, 0, 0})[0]) - 0.5));
    return signals;
  }();
  return kSamples;
}

KernelVoices::KernelVoices(const MixMode& mode, std::uint32_t count, BenchVoiceKind are, int frames)
    : mode_(mode),
      frames_(frames),
      wrap_(bench_signals(mode)[0].wrap()),
      reference_(std::make_unique<ReferenceBuses>()) {
  paths_.reserve(std::size_t{kEars} * count);
  for (std::uint32_t v = 0; v < count; ++v)
    for (int e = 0; e < kEars; ++e) {
      VoicePath& path = paths_.emplace_back();
      const double drift = are == BenchVoiceKind::kTypical ? drift_of(v, e) : 0;
      path.step = static_cast<std::int64_t>((1 + drift) * 0x1p32);
      const double range = are == BenchVoiceKind::kStaticInL1 ? 1000 : kSignalFrames;
      const double at =
          random_unit(v, 4) * range + 20 * random_unit(v, 5 + static_cast<std::uint32_t>(e));
      bench_signals(mode)[signal_of(v, count)].place(static_cast<std::int64_t>(at * 0x1p32), path);
    }
  const std::uint32_t fine =
      mode.head ? std::min(count, static_cast<std::uint32_t>(mode.narrowband_voices)) : 0;
  parts_.resize(mode.head ? 2 : 1);
  for (Part& part : parts_) part.mode = mode;
  parts_[0].mode.head = false;
  for (std::uint32_t v = 0; v < count; ++v) parts_[v < fine ? 1 : 0].active.push_back(v);
  for (Part& part : parts_) {
    const auto lanes = static_cast<std::uint32_t>(part.mode.gain_lanes());
    const std::uint32_t end = part.active.empty() ? 0 : part.active.back() + 1;
    part.gains.reserve(std::size_t{2} * lanes * end);
    for (std::uint32_t v = 0; v < end; ++v)
      for (std::uint32_t lane = 0; lane < 2 * lanes; ++lane)
        part.gains.push_back(static_cast<float>((random_unit(v, 10 + lane) - 0.5) / count *
                                                (lane < lanes ? 1 : 1.0 / 60)));
  }
}

MixJob KernelVoices::job(Part& part) const {
  return {paths_.data(), part.gains.data(), part.active.data(), part.active.size(), 0,
          frames_,       part.buses->high,  part.buses->low};
}

void KernelVoices::mix() {
  for (Part& part : parts_) mix_voices(part.mode, job(part));
  for (std::size_t at = 0; at < paths_.size(); at += mode_.delays == 1 ? kEars : 1) {
    paths_[at].position = paths_[at].position_at(frames_);
    paths_[at].position -= paths_[at].position >= wrap_ ? wrap_ : 0;
  }
}

void KernelVoices::mix_with_reference() { mix_reference(mode_, job(parts_[0]), *reference_); }

bool KernelVoices::heard() const {
  return std::ranges::any_of(parts_, [](const Part& part) {
    return std::ranges::any_of(part.buses->high, [](float x) { return std::abs(x) > 0; });
  });
}

MixerVoices::MixerVoices(const MixMode& mode, std::uint32_t count)
    : panner_(mode.pairs == 8 ? make_ambisonic_panner()
              : mode.pairs == 1
                  ? nullptr
                  : make_loudspeaker_panner(*find_layout(mode.pairs == 3 ? "5.1" : "7.1.4"))),
      head_(mode.head ? bench_head() : nullptr),
      mixer_(bench_signals(mode), count, mode, panner_.get(), head_.get()),
      block_(static_cast<std::size_t>(mixer_.channels()) * kBenchFrames) {
  for (std::uint32_t k = 0; k < 2; ++k) {
    keyframes_[k].voices.reserve(count);
    for (std::uint32_t v = 0; v < count; ++v) {
      Voice& voice = keyframes_[k].voices.emplace_back();
      voice.slot = v;
      voice.signal = signal_of(v, count);
      const double turn = 2 * std::numbers::pi * random_unit(v, 30) + 0.03 * k;
      const double up = 2 * random_unit(v, 31) - 1, r = std::sqrt(1 - up * up);
      voice.from = Vec3f(Vec3(r * std::cos(turn), r * std::sin(turn), up));
      for (int e = 0; e < kEars; ++e) {
        voice.delay_frames[e] =
            1000 + random_unit(v, 4) * kSignalFrames + k * drift_of(v, e) * kKeyframeFrames;
        for (std::uint32_t b = 0; b < kBandCount; ++b)
          voice.gain[e][b] = static_cast<float>(
              (random_unit(v, 40 + 16 * k + 8 * static_cast<std::uint32_t>(e) + b) - 0.5) / count);
      }
    }
  }
  mixer_.begin(keyframes_[0], 1 << 30);
}

void MixerVoices::mix() {
  for (int step = 0; step < kBenchFrames / kStepFrames;) {
    if (mixer_.wants_keyframe()) mixer_.load(keyframes_[next_++ % 2]);
    const int steps = std::min(kBenchFrames / kStepFrames - step, mixer_.steps_left());
    mixer_.mix(block_.data() + mixer_.channels() * kStepFrames * step, steps);
    step += steps;
  }
  energy_ += std::abs(static_cast<double>(block_[0]));  // checks little, because this is timed
}

std::vector<OpenalVoices::Voice> openal_voices_at(std::uint32_t moment, std::uint32_t count) {
  std::vector<OpenalVoices::Voice> voices;
  for (std::uint32_t v = 0; v < count; ++v)
    voices.push_back({signal_of(v, count),
                      static_cast<int>(random_unit(v, 4) * (kSignalFrames - 1)),
                      static_cast<float>(1 + drift_of(v, static_cast<int>(moment))),
                      static_cast<float>(2 * random_unit(v, 10 + moment) - 1)});
  return voices;
}

}  // namespace clamor
