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
      density(std::make_unique<LateDensity>()),
      parts{Taps(radiation), Taps(radiation)} {}

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
      receivers_(ears.head != nullptr || ears.panner != nullptr ? Receivers::kOne
                                                                : Receivers::kPair),
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

// Null if there is none and none is made.
FieldMaker::Input* FieldMaker::input_of(const SampledSource& source, double emission_frames,
                                        bool makes) {
  const std::int64_t start_frames = field_start_frames(source, emission_frames, signals_);
  for (const auto& input : inputs_)
    if (input->signal == source.signal && input->start_frames == start_frames) return input.get();
  if (!makes) return nullptr;
  inputs_.push_back(std::make_unique<Input>(radiation_, source.signal, start_frames));
  return inputs_.back().get();
}

// What has neither taps nor a response that sounds. The signal may have been replaced since.
void FieldMaker::forget_idle_inputs() {
  std::erase_if(inputs_, [this](const std::unique_ptr<Input>& input) {
    for (const Taps& taps : input->parts)
      if (!taps.group.is_empty()) return false;
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
    for (Taps& taps : input->parts) {
      taps.chosen.clear();
      taps.weight = 0;
    }
  }
  weight_ = 0;
  const double frames_per_m = kSampleRate_hz / radiation_.speed_of_sound_mps();
  const auto is_in = [](auto& at, const std::vector<std::uint64_t>& numbers, std::uint64_t number) {
    while (at != numbers.end() && *at < number) ++at;
    return at != numbers.end() && *at == number;
  };
  auto voice = next_numbers_.begin(), voice_before = voice_numbers_.begin();
  for (const SampledSource& one : sample) {
    weight_ += one.weight;
    const bool is_voice = is_in(voice, next_numbers_, one.number);
    const bool was_voice = is_in(voice_before, voice_numbers_, one.number);
    if (is_voice && was_voice) continue;
    if (choice_ && !is_voice) tap_numbers_.push_back(one.number);
    const double emission_frames =
        (one.start_s + radiation_.emission_time_s(*one.source)) * kSampleRate_hz;
    Input* const input = input_of(one, emission_frames, !is_voice);
    if (input == nullptr) continue;
    const double on_air_frames =
        frames_per_m * length(listener.position_m - Vec3(one.source->position_m));
    const double delay_frames =
        emission_frames - static_cast<double>(input->start_frames) + on_air_frames;
    const double since_emitter_frames =
        static_cast<double>(one.source->delay_s) * kSampleRate_hz + on_air_frames;
    if (!(delay_frames < (kMaxPartitions - 2) * kKeyframeFrames)) continue;
    Taps& taps = input->parts[since_emitter_frames < kEarly_frames ? kEarlyField : kLateField];
    if (is_voice || was_voice) taps.swapped_weight += one.weight;
    if (is_voice) continue;
    taps.weight += one.weight;
    taps.chosen.push_back(&one);
    input->longest_frames = std::max(input->longest_frames, delay_frames);
    input->first_start_frames =
        std::min(input->first_start_frames, delay_frames - since_emitter_frames);
  }
  take_chosen();
}

void FieldMaker::take_chosen() {
  reads_.clear();
  tap_count_ = 0;
  for (const auto& input : inputs_) {
    for (Taps& taps : input->parts) {
      taps.group.take(taps.chosen);
      tap_count_ += taps.chosen.size();
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
    for (const Taps& taps : input->parts) moved_m = std::max(moved_m, taps.group.moved_m());
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

// Renewals for which a response is kept. Its error grows as the square root of that, and what the
// signals differ by adds up as powers do, so a share of the weight of all sources may be kept for
// the longer the smaller it is.
int FieldMaker::kept_for(const Taps& taps) const {
  if (!(weight_ > 0)) return 1;
  const double most = kKeptShare * weight_ / std::max(taps.weight, 1e-9 * weight_);
  return static_cast<int>(
      std::bit_floor(static_cast<unsigned>(std::clamp(most, 1.0, 1.0 * kMostKept))));
}

// Whether a response is renewed that is kept for so many renewals.
bool FieldMaker::is_due(const Input& input, std::size_t part, const ListenerFrame& frame, int kept,
                        std::size_t index) const {
  const Taps& taps = input.parts[part];
  const auto turn = [](const Vec3& a, const Vec3& b) { return length(a - b); };
  return (parts_[part].renewals + index) % static_cast<std::size_t>(kept) == 0 ||
         taps.last == nullptr || taps.group.is_empty() ||
         taps.swapped_weight > kKeptSwap * weight_ ||
         turn(frame.ahead, taps.frame.ahead) > kKeptTurn_rad ||
         turn(frame.up, taps.frame.up) > kKeptTurn_rad || lacks_passes(input, part);
}

// Whether the density of late sound is not yet right.
bool FieldMaker::lacks_passes(const Input& input, std::size_t part) const {
  return ears_.has_dense_late && part == kLateField && input.density->lacks_passes() > 0;
}

void FieldMaker::renew(std::size_t part_index, const Listener& listener, const Reception& reception,
                       Keyframe& keyframe) {
  Part& part = parts_[part_index];
  const bool is_first = part.last == nullptr;
  const int every = every_[part_index];
  const Vec3 velocity_mps =
      !is_first && length(listener.velocity_mps) < kFastest_mps ? listener.velocity_mps : Vec3(0);
  const auto frame_in = [&](double seconds) {
    Listener then = listener;
    then.position_m += seconds * velocity_mps;
    return listener_frame(then, receivers_);
  };
  const double fade_s = every * kKeyframe_s;
  bool makes_gains = part.reception != reception || needs_gains(part_index, frame_in(fade_s));
  for (const auto& input : inputs_)
    makes_gains = makes_gains || input->parts[part_index].group.has_other_taps();
  for (const auto& input : inputs_) {
    Taps& taps = input->parts[part_index];
    const float step = is_first ? 1 : static_cast<float>(every) / kTapFade_keyframes;
    taps.has_changed = taps.group.advance(step) || taps.has_changed || makes_gains ||
                       lacks_passes(*input, part_index);
  }
  if (makes_gains) {
    const double speed_mps = std::max(length(velocity_mps), 1e-9);
    part.reception = reception;
    part.gain_frame =
        frame_in(fade_s + std::min(kGainAhead_s, kGainReach_m[part_index] / speed_mps));
    renew_gains(part_index);
  }
  renewed_.clear();
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    Taps& taps = inputs_[i]->parts[part_index];
    if (taps.group.used() == 0) continue;
    const int kept = is_first ? 1 : kept_for(taps);
    const ListenerFrame frame = frame_in(fade_s * 0.5 * (1 + kept));
    if (!is_due(*inputs_[i], part_index, frame, kept, i)) continue;
    if (!taps.has_changed && taps.frame == frame) continue;
    taps.frame = frame;
    taps.has_changed = false;
    taps.swapped_weight = 0;
    renewed_.push_back(inputs_[i].get());
  }
  ++part.renewals;
  if (!renewed_.empty() || is_first) assemble(part_index, keyframe);
}

// A response with what has been renewed and what is kept.
void FieldMaker::assemble(std::size_t part_index, Keyframe& keyframe) {
  Part& part = parts_[part_index];
  FieldResponse& response = free_response(part);
  response.is_free.store(false, std::memory_order_relaxed);
  const auto append = [](std::vector<FieldPartition>& to, const FieldSignalResponse& all) {
    to.insert(to.end(), all.partitions.begin(), all.partitions.end());
  };
  for (auto* const list : {&response.partitions, &response.replaced}) list->clear();
  for (LayerSums* const sums : {&high_sums_, &low_sums_}) sums->clear();
  for (Input* const input : renewed_) {
    std::shared_ptr<const FieldSignalResponse>& last = input->parts[part_index].last;
    const auto now = make_response(*input, part_index);
    correlate_with(last.get(), *now);
    if (last != nullptr) append(response.replaced, *last);
    append(response.partitions, *now);
    last = now;
  }
  response.new_partitions = response.partitions.size();
  for (const auto& input : inputs_) {
    const auto& last = input->parts[part_index].last;
    if (last == nullptr) continue;
    response.signals.push_back(last);
    if (std::ranges::find(renewed_, input.get()) == renewed_.end())
      append(response.partitions, *last);
  }
  high_sums_.correct(response.correction_high);
  low_sums_.correct(response.correction_low);
  if (part.eq != nullptr) response.powers = part.eq->powers();
  response.number = part.last == nullptr ? 0 : part.last->number + 1;
  response.fade_blocks = part.last == nullptr ? 0 : every_[part_index];
  part.last = &response;
  keyframe.field[part_index] = &response;
}

std::shared_ptr<const FieldSignalResponse> FieldMaker::make_response(Input& input,
                                                                     std::size_t part) {
  Taps& taps = input.parts[part];
  auto free =
      std::ranges::find(taps.responses, 1, &std::shared_ptr<FieldSignalResponse>::use_count);
  if (free == taps.responses.end())
    free = taps.responses.insert(free, std::make_shared<FieldSignalResponse>());
  FieldSignalResponse& made = **free;
  made.partitions.clear();
  add_taps_of(input, part);
  for (std::uint32_t pair = 0; pair < sparse_.size(); ++pair)
    sparse_[pair].transform([&](std::size_t delay) -> FieldSpectrum& {
      const std::size_t index = made.partitions.size();
      if (index == made.spectra.size()) made.spectra.emplace_back();
      FieldSpectrum& spectrum = made.spectra[index];
      made.partitions.push_back(
          {input.buffers.back().get(), &spectrum, static_cast<std::uint32_t>(delay), pair});
      return spectrum;
    });
  return *free;
}

// Also lets go of what only responses that have ended refer to.
FieldResponse& FieldMaker::free_response(Part& part) {
  FieldResponse* found = nullptr;
  for (const auto& response : part.responses)
    if (response.get() != part.last && response->is_free.load(std::memory_order_acquire)) {
      response->signals.clear();
      found = response.get();
    }
  return found != nullptr ? *found
                          : *part.responses.emplace_back(std::make_unique<FieldResponse>());
}

// The response before fades out linearly while this one fades in, which is right where both are
// alike. Where they are not, power would fall in between, and the mixer corrects it by as much as
// this says. Correlation is measured in quarters of an octave: within an octave it may fall from
// 0.8 to 0.
void FieldMaker::correlate_with(const FieldSignalResponse* last, const FieldSignalResponse& now) {
  static const FieldSpectrum kNothing{};
  static const FieldSignalResponse kEmpty;
  const std::vector<FieldPartition>& all_before = (last != nullptr ? *last : kEmpty).partitions;
  const auto place = [](const FieldPartition& one) { return std::pair(one.pair, one.delay); };
  auto before = all_before.begin();
  for (const FieldPartition& one : now.partitions) {
    while (before != all_before.end() && place(*before) < place(one)) ++before;
    const bool has_last = before != all_before.end() && place(*before) == place(one);
    const FieldSpectrum& from = has_last ? *before->spectrum : kNothing;
    correlate(*one.spectrum, from, high_sums_.all(), low_sums_.all());
  }
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
