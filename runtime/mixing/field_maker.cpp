#include "runtime/mixing/field_maker.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <utility>

#include "runtime/field/late_density.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxPartitions = 3200;  // 64 s, longer than any path of a bake
constexpr double kLeastCorrelation = -0.5;
constexpr double kFastest_mps = 40;  // beyond, the listener was moved, and is not expected to go on
// Reflections of faster sources are renewed no more often.
constexpr double kFastestTap_mps = 2;

}  // namespace

FieldMaker::Input::Input(const RadiationModel& radiation, std::uint32_t of_signal,
                         std::int64_t begins_frames)
    : signal(of_signal),
      start_frames(begins_frames),
      groups{TapGroup(radiation), TapGroup(radiation)},
      density(std::make_unique<LateDensity>()) {}

FieldMaker::Input::~Input() = default;

// Room for delays up to this one, and somewhat more, so that a walk seldom needs another buffer.
void FieldMaker::Input::reserve(double delay_frames) {
  const auto needed = static_cast<std::size_t>(delay_frames / kKeyframeFrames) + 2;
  if (!buffers.empty() && needed <= buffers.back()->blocks.size()) return;
  buffers.push_back(std::make_unique<FieldInput>(
      signal, start_frames, std::min(kMaxPartitions, needed + needed / 8 + 8)));
}

FieldMaker::FieldMaker(const RadiationModel& radiation, PlayableSignals signals, const Ears& ears,
                       bool chooses_taps)
    : radiation_(radiation),
      signals_(signals),
      ears_(ears),
      sparse_(static_cast<std::size_t>(ears.mode.pairs), SparseResponse(ears.mode)),
      high_sums_(kHighField, kSampleRate_hz),
      low_sums_(kLowField, 1.0 * kSampleRate_hz / kLowRate),
      taps_(kEars * sparse_.size()) {
  made_voices_.resize(VoiceTable::kTile);
  // A signal of a few sources that is to be dense is worth a response.
  if (chooses_taps)
    choice_.emplace(radiation, signals, ears.has_dense_late ? 1 : kTapsPerPartition);
  if (ears.head != nullptr)
    for (Part& part : parts_) part.eq = std::make_unique<DiffuseHrtfEq>(*ears.head);
}

bool FieldMaker::suits(std::span<const Emitter> emitters, std::size_t voices) {
  constexpr std::size_t kPartitions = 100;  // of a signal, in most rooms
  std::set<std::pair<std::uint32_t, std::int64_t>> inputs;
  for (const Emitter& emitter : emitters)
    inputs.insert({emitter.signal, field_start_frames(emitter.delay_s * kSampleRate_hz, false)});
  return inputs.size() <= std::min(kMaxFieldInputs, voices / (kTapsPerPartition * kPartitions));
}

FieldMaker::Input& FieldMaker::input_of(const SampledSource& source, double emission_frames) {
  const std::int64_t start_frames = field_start_frames(source, emission_frames, signals_);
  for (const auto& input : inputs_)
    if (input->signal == source.signal && input->start_frames == start_frames) return *input;
  return *inputs_.emplace_back(std::make_unique<Input>(radiation_, source.signal, start_frames));
}

// What has neither taps nor a response that sounds. The signal may have been replaced since.
void FieldMaker::forget_idle_inputs() {
  std::erase_if(inputs_, [this](const std::unique_ptr<Input>& input) {
    for (const TapGroup& group : input->groups)
      if (!group.is_empty()) return false;
    bool sounds = false;
    for_sounding([&](const FieldInput& one) {
      for (const auto& buffer : input->buffers) sounds = sounds || buffer.get() == &one;
    });
    return !sounds;
  });
}

// The loudest are voices. A voice stays one until it is clearly below the others.
void FieldMaker::choose_voices(std::span<const SampledSource> sample, const Listener& listener,
                               double time_s) {
  std::span<const std::uint64_t> others;
  if (choice_) others = choice_->voices(sample, listener, time_s * kSampleRate_hz, next_numbers_);
  ranked_.clear();
  auto voice = next_numbers_.begin();
  for (const SampledSource& one : sample) {
    while (voice != next_numbers_.end() && *voice < one.number) ++voice;
    const bool is_voice = voice != next_numbers_.end() && *voice == one.number;
    ranked_.push_back({one.weight * static_cast<double>(is_voice ? kKeepsVoice : 1), one.number});
  }
  if (ranked_.size() > ears_.voices) {
    std::nth_element(ranked_.begin(), ranked_.begin() + static_cast<std::ptrdiff_t>(ears_.voices),
                     ranked_.end(), std::greater<>());
    ranked_.resize(ears_.voices);
  }
  next_numbers_.clear();
  for (const auto& [weight, number] : ranked_) next_numbers_.push_back(number);
  next_numbers_.insert(next_numbers_.end(), others.begin(), others.end());
  std::ranges::sort(next_numbers_);
  next_numbers_.erase(std::unique(next_numbers_.begin(), next_numbers_.end()), next_numbers_.end());
}

void FieldMaker::take_taps(std::span<const SampledSource> sample, const Listener& listener) {
  if (choice_) forget_idle_inputs();
  tap_numbers_.clear();
  for (const auto& input : inputs_) {
    input->longest_frames = 0;
    input->first_start_frames = kFieldStart_frames;
    for (auto& chosen : input->chosen) chosen.clear();
  }
  const double frames_per_m = kSampleRate_hz / radiation_.speed_of_sound_mps();
  auto voice = next_numbers_.begin();
  for (const SampledSource& one : sample) {
    while (voice != next_numbers_.end() && *voice < one.number) ++voice;
    if (voice != next_numbers_.end() && *voice == one.number) continue;
    if (choice_) tap_numbers_.push_back(one.number);
    const double emission_frames =
        (one.start_s + radiation_.emission_time_s(*one.source)) * kSampleRate_hz;
    Input& input = input_of(one, emission_frames);
    const double on_air_frames =
        frames_per_m * length(listener.position_m - Vec3(one.source->position_m));
    const double delay_frames =
        emission_frames - static_cast<double>(input.start_frames) + on_air_frames;
    const double since_emitter_frames =
        static_cast<double>(one.source->delay_s) * kSampleRate_hz + on_air_frames;
    if (!(delay_frames < (kMaxPartitions - 2) * kKeyframeFrames)) continue;
    input.longest_frames = std::max(input.longest_frames, delay_frames);
    input.first_start_frames =
        std::min(input.first_start_frames, delay_frames - since_emitter_frames);
    input.chosen[since_emitter_frames < kEarly_frames ? kEarlyField : kLateField].push_back(&one);
  }
  reads_.clear();
  tap_count_ = 0;
  for (const auto& input : inputs_) {
    for (std::size_t part = 0; part < kFieldParts; ++part) {
      input->groups[part].take(input->chosen[part]);
      tap_count_ += input->chosen[part].size();
    }
    if (input->longest_frames == 0) continue;
    input->reserve(input->longest_frames);
    for (SparseResponse& pair : sparse_) pair.reserve(input->buffers.back()->blocks.size());
    Voice read;
    read.signal = input->signal;
    read.gain.fill(same_in_all_bands(1));
    constexpr double kAhead_frames = 2 * kKeyframeFrames, kStep_frames = 0.5 * kSampleRate_hz;
    for (double at = -kAhead_frames; at < input->longest_frames + kStep_frames;
         at += kStep_frames) {
      read.delay_frames.fill(static_cast<double>(input->start_frames) + at);
      reads_.push_back(read);
    }
  }
}

std::span<const SampledSource> FieldMaker::divide(std::span<const SampledSource> sample,
                                                  bool is_new, const Listener& listener,
                                                  double time_s) {
  voice_numbers_ = next_numbers_;
  const bool is_first = made_ == 0;
  has_new_sample_ = has_new_sample_ || is_new;
  if (left_[kLateField] == 0) {
    if (std::exchange(has_new_sample_, false)) {
      choose_voices(sample, listener, time_s);
      take_taps(sample, listener);
    }
    if (is_first) voice_numbers_ = next_numbers_;
    // A power of two keyframes, so that both parts meet again. The first sample serves one.
    const double speed_mps = std::max(length(listener.velocity_mps), taps_speed_mps());
    for (std::size_t part = 0; part < kFieldParts; ++part) {
      every_[part] = is_first ? 1 : coarseness_ * kMostKeyframes[part];
      while (every_[part] > coarseness_ &&
             every_[part] * kKeyframe_s * speed_mps > coarseness_ * kStep_m[part])
        every_[part] /= 2;
      left_[part] = 0;
    }
  }
  find_voices(sample);
  return voices_;
}

// Sources that have come since the last division are voices at once, if taps were chosen.
void FieldMaker::find_voices(std::span<const SampledSource> sample) {
  voices_.clear();
  if (!choice_) {
    auto at = sample.begin();
    for (const std::uint64_t number : voice_numbers_) {
      at = std::ranges::lower_bound(at, sample.end(), number, {}, &SampledSource::number);
      if (at != sample.end() && at->number == number) voices_.push_back(*at);
    }
    return;
  }
  auto voice = voice_numbers_.begin();
  auto tap = tap_numbers_.begin();
  for (const SampledSource& one : sample) {
    while (voice != voice_numbers_.end() && *voice < one.number) ++voice;
    while (tap != tap_numbers_.end() && *tap < one.number) ++tap;
    const bool is_voice = voice != voice_numbers_.end() && *voice == one.number;
    const bool is_tap = tap != tap_numbers_.end() && *tap == one.number;
    if (is_voice || !is_tap) voices_.push_back(one);
  }
}

// How fast moving sources have changed the paths of taps.
double FieldMaker::taps_speed_mps() const {
  double moved_m = 0;
  for (const auto& input : inputs_)
    for (const TapGroup& group : input->groups) moved_m = std::max(moved_m, group.moved_m());
  return std::min(moved_m / (std::max(every_[kLateField], 1) * kKeyframe_s), kFastestTap_mps);
}

void FieldMaker::make(const Listener& listener, const Reception& reception, Keyframe& keyframe) {
  keyframe.field = {};
  for (std::size_t part = 0; part < kFieldParts; ++part)
    if (left_[part]-- == 0) {
      renew(part, listener, reception, keyframe);
      left_[part] = every_[part] - 1;
    }
  ++made_;
}

void FieldMaker::renew(std::size_t part_index, const Listener& listener, const Reception& reception,
                       Keyframe& keyframe) {
  Part& part = parts_[part_index];
  const bool is_first = part.last == nullptr;
  const int every = every_[part_index];
  Listener then = listener;
  if (!is_first && length(listener.velocity_mps) < kFastest_mps)
    then.position_m += every * kKeyframe_s * listener.velocity_mps;
  const Receivers receivers =
      ears_.head != nullptr || ears_.panner != nullptr ? Receivers::kOne : Receivers::kPair;
  const ListenerFrame frame = listener_frame(then, receivers);
  bool makes_gains = part.reception != reception || needs_gains(part_index, frame);
  bool has_changed = makes_gains || part.frame != frame;
  if (ears_.has_dense_late && part_index == kLateField)
    for (const auto& input : inputs_)
      has_changed = has_changed || input->density->lacks_passes() > 0;
  for (const auto& input : inputs_) {
    TapGroup& group = input->groups[part_index];
    makes_gains = makes_gains || group.has_other_taps();
    has_changed =
        group.advance(is_first ? 1 : static_cast<float>(every) / kTapFade_keyframes) || has_changed;
  }
  if (!has_changed) return;
  part.frame = frame;
  part.reception = reception;
  if (makes_gains) {
    const double speed_mps = length(then.velocity_mps);
    if (!is_first && speed_mps > 0)
      then.position_m +=
          std::min(kGainAhead_s, kGainReach_m[part_index] / speed_mps) * then.velocity_mps;
    part.gain_frame = listener_frame(then, receivers);
  }
  if (makes_gains && part.eq != nullptr) part.eq->begin();
  if (makes_gains)
    for (const auto& input : inputs_) input->groups[part_index].begin_gains();
  FieldResponse& response = free_response(part);
  response.is_free.store(false, std::memory_order_relaxed);
  response.partitions.clear();
  for (const auto& input : inputs_) {
    if (input->groups[part_index].used() == 0) continue;
    add_taps_of(*input, part_index, makes_gains);
    for (std::uint32_t pair = 0; pair < sparse_.size(); ++pair)
      sparse_[pair].transform([&](std::size_t delay) -> FieldSpectrum& {
        response.partitions.push_back(
            {input->buffers.back().get(), static_cast<std::uint32_t>(delay), pair});
        const std::size_t count = response.partitions.size();
        if (response.spectra.size() < count) response.spectra.resize(count + count / 4);
        return response.spectra[count - 1];
      });
  }
  if (part.eq != nullptr) response.powers = part.eq->powers();
  response.fade_blocks = is_first ? 0 : every;
  if (!is_first) correct(response, *part.last);
  part.last = &response;
  keyframe.field[part_index] = &response;
}

FieldResponse& FieldMaker::free_response(Part& part) {
  for (const auto& response : part.responses)
    if (response.get() != part.last && response->is_free.load(std::memory_order_acquire))
      return *response;
  return *part.responses.emplace_back(std::make_unique<FieldResponse>());
}

// The response before fades out linearly while this one fades in, which is right where both are
// alike. Where they are not, power would fall in between, and the mixer corrects it by as much as
// this says. Correlation is measured in quarters of an octave: within an octave it may fall from
// 0.8 to 0.
void FieldMaker::correct(FieldResponse& response, const FieldResponse& last) {
  static const FieldSpectrum kNothing{};
  for (LayerSums* const sums : {&high_sums_, &low_sums_}) sums->clear();
  std::size_t hint = 0;
  for (std::size_t p = 0; p < response.partitions.size(); ++p) {
    const auto is_same = [&here = response.partitions[p]](const FieldResponse::Partition& one) {
      return one.delay == here.delay && one.pair == here.pair &&
             one.input->signal == here.input->signal &&
             one.input->start_frames == here.input->start_frames;
    };
    const auto begin = last.partitions.begin(), end = last.partitions.end(),
               from = begin + static_cast<std::ptrdiff_t>(std::min(hint, last.partitions.size()));
    auto found = std::find_if(from, end, is_same);
    if (found == end) found = std::find_if(begin, from, is_same);
    const bool has_last = found != end && is_same(*found);
    if (has_last) hint = static_cast<std::size_t>(found - begin) + 1;
    const FieldSpectrum& before = has_last ? last.spectra[hint - 1] : kNothing;
    const FieldSpectrum& now = response.spectra[p];
    correlate(now.high.data(), before.high.data(), kHighField.transform, high_sums_.all());
    correlate(now.low.data(), before.low.data(), kLowField.transform, low_sums_.all());
  }
  high_sums_.correct(response.correction_high);
  low_sums_.correct(response.correction_low);
}

FieldMaker::LayerSums::LayerSums(const FieldLayer& layer, double rate_hz)
    : power(layer.transform),
      last_power(layer.transform),
      correlation(layer.transform),
      group(layer.transform) {
  constexpr double kLeast_hz = 20;
  const LaneFourier fourier(layer.transform, 4);
  for (std::size_t i = 0; i < layer.transform; ++i) {
    const std::size_t bin = fourier.bin(i);
    const double frequency_hz = static_cast<double>(std::min(bin, layer.transform - bin)) *
                                rate_hz / static_cast<double>(layer.transform);
    group[i] = static_cast<std::uint8_t>(4 * std::log2(std::max(frequency_hz / kLeast_hz, 1.0)));
    assert(group[i] < kGroups);
  }
}

void FieldMaker::LayerSums::correct(std::span<float> correction) const {
  std::array<double, kGroups> powers{}, last_powers{}, correlations{};
  for (std::size_t i = 0; i < group.size(); ++i) {
    powers[group[i]] += static_cast<double>(power[i]);
    last_powers[group[i]] += static_cast<double>(last_power[i]);
    correlations[group[i]] += static_cast<double>(correlation[i]);
  }
  std::array<float, kGroups> of_group{};
  for (std::size_t g = 0; g < kGroups; ++g) {
    const double scale = std::sqrt(powers[g] * last_powers[g]);
    const double rho = scale > 0 ? std::clamp(correlations[g] / scale, kLeastCorrelation, 1.0) : 1;
    // Exact in the middle of the fade.
    of_group[g] = static_cast<float>((0.5 / std::sqrt(0.5 * (1 + rho)) - 0.5) /
                                     (std::numbers::sqrt2 / 2 - 0.5));
  }
  for (std::size_t i = 0; i < group.size(); ++i) correction[i] = of_group[group[i]];
}

}  // namespace clamor
