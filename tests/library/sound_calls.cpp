// sound_calls.cpp: calls about sounds and streams, see call_sequence.h.
#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/audio/audio_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/library/call_helpers.h"

namespace clamor::testing {

namespace {

using Floats = std::numeric_limits<float>;

constexpr float kMaxSample = 1e6f;  // 120 dB above full scale

// Few frames of a ramp, with an odd sample at times.
std::vector<float> pick_samples(Draws& draws) {
  static constexpr std::size_t kFrames[] = {480, 0, 1, 2, 47, 480, 481, 480};
  static constexpr float kOdd[] = {Floats::quiet_NaN(),
                                   Floats::infinity(),
                                   -Floats::infinity(),
                                   Floats::max(),
                                   Floats::denorm_min(),
                                   -1e30f,
                                   -0.0f,
                                   kMaxSample};
  std::vector<float> samples(kFrames[draws.below(8)]);
  const float step = draws.byte() / 255.0f;
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = step * static_cast<float>(i % 48) / 48;
  if (!samples.empty() && draws.one_in(16)) samples[samples.size() / 2] = kOdd[draws.below(8)];
  return samples;
}

// What all functions do that add a sound. `add` takes where the handle goes and the clamor_error.
template <class Add>
CallOutcome add_any_sound(Sequence& sequence, KnownContext* known, bool is_valid, bool may_fail,
                          KnownSound sound, const Add& add) {
  sound.handle = kUntouched;
  clamor_sound* const into = sequence.draws.one_in(32) ? nullptr : &sound.handle;
  is_valid = is_valid && known != nullptr && into != nullptr;
  const bool is_full = known != nullptr && known->sounds.size() == known->max_sounds;
  const clamor_result result = add(into, sequence.pick_error());
  if (result == CLAMOR_OK && known != nullptr) {
    remember(sequence, sound.handle);
    known->sounds.push_back(sound);
  } else {
    expect_untouched(sound.handle);
  }
  if (is_valid && is_full && !may_fail && result != CLAMOR_ERROR_FULL)
    broken("the context holds more sounds than its options allow");
  is_valid = is_valid && !is_full;
  return {result, is_valid && may_fail ? Expected::kEither : success_if(is_valid)};
}

Structure<clamor_sound_options> pick_sound_options(Sequence& sequence) {
  static constexpr std::uint32_t kRates_hz[] = {1000,    768'000,   44'100,    999,
                                                768'001, 1'000'000, 1'000'001, UINT32_MAX};
  clamor_sound_options options{};
  if (sequence.draws.one_in(8)) options.rate_hz = kRates_hz[sequence.draws.below(8)];
  options.loops = !sequence.draws.one_in(4);
  return sequence.pick_structure(options, 1, true);
}

CallOutcome add_sound(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const std::vector<float> samples = pick_samples(sequence.draws);
  const auto given = pick_sound_options(sequence);
  const bool has_samples = !sequence.draws.one_in(32);
  const std::uint64_t frames = sequence.draws.one_in(64) && !has_samples ? UINT64_MAX  // unread
                                                                         : samples.size();
  const std::uint32_t rate_hz = given.known.rate_hz;
  const bool is_valid = has_samples && frames > 0 && given.is_valid &&
                        (rate_hz == 0 || is_within(rate_hz, 1000, 768'000)) &&
                        std::all_of(samples.begin(), samples.end(),
                                    [](float one) { return std::abs(one) <= kMaxSample; });
  return add_any_sound(sequence, known, is_valid, false, {}, [&](auto* into, clamor_error* error) {
    return clamor_add_sound(context, has_samples ? samples.data() : nullptr, frames, given.pointer,
                            into, error);
  });
}

const std::string& sound_path() {
  static const std::string path = [] {
    const auto flac = encode_flac(std::vector<float>(480, 0.5f));
    if (!flac.ok()) broken("a sound cannot be encoded");
    return fuzz::file_with({reinterpret_cast<const char*>(flac->data()), flac->size()}, ".flac");
  }();
  return path;
}

CallOutcome read_sound(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  static const std::string folder = "/", none, missing = "/no/such/\xff sound.wav";
  const std::string* const paths[] = {&sound_path(), &sound_path(), &sound_path(), &bake_path(),
                                      &folder,       &none,         &missing,      nullptr};
  const std::string* const path = paths[sequence.draws.below(8)];
  const auto given = pick_sound_options(sequence);  // the file tells the rate
  const bool is_valid = path == &sound_path() && given.is_valid;
  return add_any_sound(sequence, known, is_valid, false, {}, [&](auto* into, clamor_error* error) {
    return clamor_read_sound(context, path == nullptr ? nullptr : path->c_str(), given.pointer,
                             into, error);
  });
}

CallOutcome read_level_sound(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked level = sequence.pick_level(known);
  const std::uint32_t index = sequence.draws.one_in(8)
                                  ? static_cast<std::uint32_t>(sequence.draws.word())
                                  : sequence.draws.below(kLevelSounds + 1);
  const bool may_fail = known != nullptr && find(known->damaged_levels, level.handle) != nullptr;
  const bool is_valid = level.is_valid && index < kLevelSounds;
  return add_any_sound(sequence, known, is_valid, may_fail, {},
                       [&](auto* into, clamor_error* error) {
                         return clamor_read_level_sound(context, level.handle, index, into, error);
                       });
}

uint32_t pull_stream(void* user, float* samples, uint32_t frames) {
  const PulledStream& stream = *static_cast<const PulledStream*>(user);
  if (stream.has_ended || stream.releases > 0) broken("a stream that was removed is pulled");
  if (stream.caller_updates && !makes_keyframes()) broken("a stream is pulled by another call");
  const bool is_odd = stream.kind == PullKind::kOddSamples;
  const std::uint32_t written = stream.kind == PullKind::kHalf   ? frames / 2
                                : stream.kind == PullKind::kNone ? 0
                                                                 : frames;
  static constexpr float kOdd[] = {Floats::quiet_NaN(), Floats::infinity(), -Floats::max(), 1e30f};
  for (std::uint32_t i = 0; i < written; ++i)
    samples[i] = is_odd ? kOdd[i % 4] : static_cast<float>(i % 48) / 48;
  return stream.kind == PullKind::kMoreThanAsked ? UINT32_MAX : written;
}

void release_stream(void* user) { ++static_cast<PulledStream*>(user)->releases; }

CallOutcome add_stream(Sequence& sequence) {
  static constexpr std::uint32_t kRates_hz[] = {8000, 192'000, 44'100,    7999,
                                                1,    192'001, 1'000'000, UINT32_MAX};
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  Draws& draws = sequence.draws;
  clamor_stream stream{};
  if (draws.one_in(16)) stream.rate_hz = kRates_hz[draws.below(8)];
  PulledStream& pulled = sequence.pulled_streams.emplace_back();
  pulled.kind = static_cast<PullKind>(draws.below(5));
  pulled.caller_updates = known == nullptr || known->caller_updates;
  stream.user = &pulled;
  stream.pull = draws.one_in(2) ? nullptr : pull_stream;
  if (draws.one_in(16) || (stream.pull != nullptr && draws.one_in(2)))
    stream.release = release_stream;
  const auto given = sequence.pick_structure(stream, 8, false);
  const bool is_written = given.known.pull == nullptr;
  const std::uint32_t rate_hz = given.known.rate_hz;
  const bool is_valid = given.pointer != nullptr && given.is_valid &&
                        (rate_hz == 0 || is_within(rate_hz, 8000, 192'000)) &&
                        (!is_written || given.known.release == nullptr);
  const KnownSound sound{0, is_written, is_written ? nullptr : &pulled};
  const CallOutcome outcome =
      add_any_sound(sequence, known, is_valid, false, sound, [&](auto* into, clamor_error* error) {
        return clamor_add_stream(context, given.pointer, into, error);
      });
  pulled.expects_release =
      outcome.result == CLAMOR_OK && !is_written && given.known.release != nullptr;
  return outcome;
}

CallOutcome write_stream(Sequence& sequence) {
  clamor_context* context = nullptr;
  const KnownContext* const known = sequence.pick_context(context);
  const Picked sound = sequence.pick(known, &KnownContext::sounds);
  const std::vector<float> samples = pick_samples(sequence.draws);
  const auto frames = static_cast<std::uint32_t>(samples.size());
  const bool has_samples = !samples.empty() && !sequence.draws.one_in(32);
  std::uint32_t taken = 0xabcdef;
  const bool has_taken = !sequence.draws.one_in(8);
  const clamor_result result =
      clamor_write_stream(context, sound.handle, has_samples ? samples.data() : nullptr, frames,
                          has_taken ? &taken : nullptr);
  if (result == CLAMOR_OK && has_taken ? taken > frames : taken != 0xabcdef)
    broken("clamor_write_stream() tells another count than that of samples taken");
  const KnownSound* const written = known == nullptr ? nullptr : find(known->sounds, sound.handle);
  return {result, success_if(has_samples && written != nullptr && written->is_written)};
}

CallOutcome remove_sound(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked sound = sequence.pick(known, &KnownContext::sounds);
  const clamor_result result = clamor_remove_sound(context, sound.handle);
  if (result == CLAMOR_OK && sound.is_valid) {
    PulledStream* const pulled = find(known->sounds, sound.handle)->pulled;
    if (pulled != nullptr) known->removed_streams.push_back(pulled);
    std::erase_if(known->sounds, [&](const auto& one) { return one.handle == sound.handle; });
    std::erase_if(known->sources, [&](const auto& one) { return one.sound == sound.handle; });
  }
  return {result, success_if(sound.is_valid)};
}

}  // namespace

std::vector<Call> sound_calls() {
  return {
      {"clamor_add_sound", 2, {kArgument, kFull, kMemory}, add_sound},
      {"clamor_read_sound", 1, {kArgument, kFull, kMemory, kFile}, read_sound},
      {"clamor_read_level_sound", 1, {kHandle, kArgument, kFull, kMemory, kFile}, read_level_sound},
      {"clamor_add_stream", 2, {kArgument, kFull, kMemory}, add_stream},
      {"clamor_write_stream", 15, {kHandle, kArgument, kState, kBusy}, write_stream},
      {"clamor_remove_sound", 2, {kArgument, kHandle}, remove_sound},
  };
}

}  // namespace clamor::testing
