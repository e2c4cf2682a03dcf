// listener_calls.cpp: calls about listeners, see call_sequence.h.
#include <algorithm>
#include <cmath>

#include "tests/library/call_helpers.h"

namespace clamor::testing {

namespace {

constexpr std::size_t kMaxListeners = 4;  // so that a sequence stays quick

CallOutcome get_listener_statistics(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked listener = sequence.pick_listener(sequence.pick_context(context));
  return get_structure<clamor_listener_statistics>(
      sequence, listener, [&](clamor_listener handle, auto* statistics) {
        return clamor_get_listener_statistics(context, handle, statistics);
      });
}

clamor_listener_options pick_listener_options(Draws& draws) {
  static constexpr std::uint32_t kVoices[] = {12, 1, 100, 100'001, UINT32_MAX, 0};
  static constexpr std::uint32_t kRates_hz[] = {7999, 192'001, UINT32_MAX, 8000, 44'100};
  static constexpr std::uint32_t kBlocks_frames[] = {1, 16, 4096, 65'536, 65'537, UINT32_MAX};
  static constexpr std::uint64_t kMemory_bytes[] = {1, 1'000'000, 1u << 30, UINT64_MAX};
  static const char* const kLayouts[] = {nullptr, "stereo", "5.1", "7.1.4", "", "no such layout"};
  clamor_listener_options options{};
  options.output = CLAMOR_OUTPUT_RECEIVERS;
  options.voices = 12;
  options.offline = draws.one_in(2);
  options.limits = draws.one_in(4);
  options.reports_voices = draws.below(2);
  if (draws.one_in(4)) options.output = 1 + draws.below(5);
  if (draws.one_in(4)) options.layout = kLayouts[draws.below(6)];
  // Slow options are rare.
  const bool is_slow = draws.one_in(64) && draws.one_in(4);
  if (draws.one_in(16)) options.voices = kVoices[draws.below(is_slow ? 6 : 5)];
  if (is_slow || draws.one_in(64)) options.rate_hz = kRates_hz[draws.below(is_slow ? 5 : 3)];
  if (draws.one_in(16)) options.max_block_frames = kBlocks_frames[draws.below(6)];
  if (draws.one_in(16)) options.memory_bytes = kMemory_bytes[draws.below(4)];
  if (draws.one_in(16)) options.gain = draws.odd_number();
  if (draws.one_in(4)) options.mixing = draws.below(4);
  if (draws.one_in(4)) options.late = draws.below(3);
  if (is_slow && draws.one_in(2)) {
    options.output = CLAMOR_OUTPUT_BINAURAL;
    options.sofa = draws.one_in(4) ? bake_path().c_str() : head_path().c_str();
  }
  return options;
}

// Whether clamor.h allows the options in a context that is `caller_updates`.
bool allows(const clamor_listener_options& options, bool pose_is_valid, bool caller_updates) {
  const auto is_in = [](double number, double low, double high) {
    return number == 0 || (number >= low && number <= high);
  };
  return options.output <= CLAMOR_OUTPUT_NONE && is_in(options.rate_hz, 8000, 192'000) &&
         is_in(options.max_block_frames, 1, 65'536) && is_in(options.voices, 1, 100'000) &&
         is_in(options.gain, 0, 1e10) && options.mixing <= CLAMOR_MIXING_VOICES && pose_is_valid &&
         options.late <=
             (options.mixing == CLAMOR_MIXING_VOICES ? CLAMOR_LATE_STORED : CLAMOR_LATE_DENSE) &&
         (options.offline == 0 || caller_updates);
}

CallOutcome create_listener(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  if (known != nullptr && known->listeners.size() >= kMaxListeners) context = nullptr;
  const Picked level = sequence.pick_level(known);
  clamor_listener_options options = pick_listener_options(sequence.draws);
  if (known != nullptr && !known->caller_updates && !sequence.draws.one_in(8)) options.offline = 0;
  bool pose_is_valid = true;
  options.pose = sequence.pick_pose(pose_is_valid);
  const double* const orientation = options.pose.orientation;
  if (std::all_of(orientation, orientation + 4, [](double part) { return part == 0; }))
    options.pose = {{2, 4, 1.6}, {}}, pose_is_valid = true;  // the identity
  const auto given = sequence.pick_structure(options, 8, true);
  const clamor_listener_options& known_options = given.known;
  // A size that is not the whole one may cut the pose; the default head is too slow to read here.
  const bool is_whole = given.pointer != nullptr && given.bytes >= sizeof(options);
  if (known_options.output == CLAMOR_OUTPUT_BINAURAL && known_options.sofa == nullptr)
    context = nullptr;
  clamor_listener listener = kUntouched;
  clamor_listener* const into = sequence.draws.one_in(32) ? nullptr : &listener;
  const bool is_valid = context != nullptr && into != nullptr && level.is_valid && given.is_valid &&
                        allows(known_options, pose_is_valid || !is_whole, known->caller_updates);
  const clamor_result result =
      clamor_create_listener(context, level.handle, given.pointer, into, sequence.pick_error());
  if (result != CLAMOR_OK) expect_untouched(listener);
  if (result == CLAMOR_OK) {
    remember(sequence, listener);
    std::uint32_t channels = 0;
    if (clamor_get_channels(context, listener, &channels) != CLAMOR_OK || channels < 1)
      broken("a new listener has no channels");
    known->listeners.push_back({listener, channels, known_options.reports_voices != 0,
                                known_options.output == CLAMOR_OUTPUT_NONE});
  }
  const auto& damaged = context == nullptr ? std::vector<clamor_level>{} : known->damaged_levels;
  const bool may_fail = std::find(damaged.begin(), damaged.end(), level.handle) != damaged.end() ||
                        known_options.layout != nullptr || known_options.sofa != nullptr ||
                        !is_whole || known_options.memory_bytes > 1u << 20;
  return {result, is_valid && may_fail ? Expected::kEither : success_if(is_valid)};
}

CallOutcome destroy_listener(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked listener = sequence.pick_listener(known);
  const clamor_result result = clamor_destroy_listener(context, listener.handle);
  if (result == CLAMOR_OK && known != nullptr)
    std::erase_if(known->listeners,
                  [&](const KnownListener& one) { return one.handle == listener.handle; });
  return {result, success_if(listener.is_valid)};
}

CallOutcome enter_level(Sequence& sequence) {
  clamor_context* context = nullptr;
  const KnownContext* const known = sequence.pick_context(context);
  const Picked listener = sequence.pick_listener(known), level = sequence.pick_level(known);
  const clamor_result result =
      clamor_enter_level(context, listener.handle, level.handle, sequence.pick_error());
  const bool is_valid = listener.is_valid && level.is_valid;
  const bool is_whole = known != nullptr && std::find(known->levels.begin(), known->levels.end(),
                                                      level.handle) != known->levels.end();
  return {result, is_valid && !is_whole ? Expected::kEither : success_if(is_valid)};
}

CallOutcome move_listener(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked listener = sequence.pick_listener(sequence.pick_context(context));
  bool is_valid = true;
  const clamor_pose pose = sequence.pick_pose(is_valid);
  const bool has_pose = !sequence.draws.one_in(32);
  return {clamor_move_listener(context, listener.handle, has_pose ? &pose : nullptr),
          success_if(listener.is_valid && is_valid && has_pose)};
}

CallOutcome next_keyframe(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked listener = sequence.pick_listener(sequence.pick_context(context));
  std::uint32_t wanted = 99;
  double time_s = -1;
  const bool has_wanted = !sequence.draws.one_in(16), has_time = !sequence.draws.one_in(16);
  const clamor_result result = clamor_next_keyframe(
      context, listener.handle, has_wanted ? &wanted : nullptr, has_time ? &time_s : nullptr);
  if (result != CLAMOR_OK && (wanted != 99 || time_s != -1)) broken("a failed call wrote");
  if (result == CLAMOR_OK && (wanted > 1 || !(time_s >= 0))) broken("no time of a keyframe");
  return {result, success_if(listener.is_valid && has_wanted && has_time)};
}

CallOutcome get_channels(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked listener = sequence.pick_listener(sequence.pick_context(context));
  std::uint32_t channels = 99;
  const bool has_room = !sequence.draws.one_in(16);
  const clamor_result result =
      clamor_get_channels(context, listener.handle, has_room ? &channels : nullptr);
  if (result != CLAMOR_OK && channels != 99) broken("a failed call wrote");
  return {result, success_if(listener.is_valid && has_room)};
}

// The voices that a call wrote, of sounds that the test's levels or the application have.
void check_voices(const Sequence& sequence, std::span<const clamor_voice> voices) {
  for (const clamor_voice& voice : voices) {
    const auto& [x, y, z] = voice.direction;
    if (!(std::abs(std::hypot(x, y, z) - 1) < 1e-3))
      broken("a voice's direction is no unit vector");
    if (!std::isfinite(voice.delay_s) || voice.starts > 1) broken("a voice has an odd member");
    for (const float gain : voice.band_gains)
      if (!std::isfinite(gain)) broken("a voice's gain is not finite");
    const auto& all = sequence.handles;
    if (voice.sound == 0 ? voice.level_sound >= kLevelSounds
                         : std::find(all.begin(), all.end(), voice.sound) == all.end())
      broken("a voice is of no sound");
  }
}

CallOutcome get_voices(Sequence& sequence) {
  clamor_context* context = nullptr;
  const KnownContext* const known = sequence.pick_context(context);
  const Picked picked = sequence.pick_listener(known);
  static constexpr std::uint32_t kCapacities[] = {100, 0, 1, 7};
  clamor_voices voices{};
  voices.capacity = kCapacities[sequence.draws.below(4)];
  const auto room = std::make_unique<clamor_voice[]>(voices.capacity);
  std::memset(room.get(), 0x5a, voices.capacity * sizeof(clamor_voice));
  voices.voices = sequence.draws.one_in(16) ? nullptr : room.get();
  voices.count = 99;
  const auto given = sequence.pick_structure(voices, 8, false);
  const bool is_valid = given.pointer != nullptr && given.is_valid &&
                        (given.known.capacity == 0 || given.known.voices != nullptr);
  const std::vector<unsigned char> before(given.memory.get(), given.memory.get() + given.bytes);
  const clamor_result result = clamor_get_voices(context, picked.handle, given.pointer);
  if (result != CLAMOR_OK && !given.equals(before)) broken("a failed call wrote its structure");
  std::uint32_t written = 0;
  if (result == CLAMOR_OK && given.bytes >= sizeof(voices)) {
    std::memcpy(&voices, given.memory.get(), sizeof(voices));
    if (!std::isfinite(voices.time_s)) broken("a keyframe has no time");
    written = std::min(voices.count, voices.capacity);
    check_voices(sequence, std::span(room.get(), written));
  } else if (result == CLAMOR_OK) {
    written = voices.capacity;  // the count is not known
  }
  const auto* const bytes = reinterpret_cast<const unsigned char*>(room.get() + written);
  if (!std::all_of(bytes, bytes + (voices.capacity - written) * sizeof(clamor_voice),
                   [](unsigned char byte) { return byte == 0x5a; }))
    broken("voices are written beyond their count");
  const KnownListener* const listener =
      known == nullptr ? nullptr : find(known->listeners, picked.handle);
  return {result, success_if(is_valid && listener != nullptr && listener->reports_voices)};
}

struct Block {
  bool is_silent = false;  // if the call succeeds
  std::uint32_t frames = 0, channels = 2;
  std::vector<float> samples;
};

constexpr float kSample = 77;  // what no call writes

Block pick_block(Sequence& sequence, const KnownContext* known, clamor_listener listener) {
  static constexpr std::uint32_t kFrames[] = {960, 0, 1, 17, 64, 441, 960, 4096};
  Block block;
  block.frames = kFrames[sequence.draws.below(8)];
  if (known != nullptr)
    if (const KnownListener* const one = find(known->listeners, listener)) {
      block.channels = one->channels;
      block.is_silent = one->is_silent;
    }
  block.samples.assign(std::size_t{block.frames} * block.channels, kSample);
  return block;
}

void check_block(const Block& block, clamor_result result) {
  const std::size_t rendered = result == CLAMOR_OK ? std::size_t{block.frames} * block.channels : 0;
  for (std::size_t i = 0; i < block.samples.size(); ++i) {
    const float sample = block.samples[i];
    if (i >= rendered && sample != kSample) broken("samples are written that should not be");
    if (i < rendered && !std::isfinite(sample)) broken("a sample is not finite");
    if (i < rendered && block.is_silent && sample != 0) broken("CLAMOR_OUTPUT_NONE is not silent");
  }
}

CallOutcome render(Sequence& sequence) {
  clamor_context* context = nullptr;
  const KnownContext* const known = sequence.pick_context(context);
  const Picked listener = sequence.pick_listener(known);
  Block block = pick_block(sequence, known, listener.handle);
  if (block.samples.empty()) block.samples.push_back(kSample);
  const bool has_room = !sequence.draws.one_in(32);
  const clamor_result result = clamor_render(
      context, listener.handle, has_room ? block.samples.data() : nullptr, block.frames);
  check_block(block, result);
  return {result, success_if(listener.is_valid && has_room)};
}

CallOutcome render_planar(Sequence& sequence) {
  clamor_context* context = nullptr;
  const KnownContext* const known = sequence.pick_context(context);
  const Picked listener = sequence.pick_listener(known);
  Block block = pick_block(sequence, known, listener.handle);
  if (block.samples.empty()) block.samples.push_back(kSample);
  std::vector<float*> planes;
  for (std::size_t c = 0; c < block.channels; ++c)
    planes.push_back(block.samples.data() + c * block.frames);
  const bool has_null = sequence.draws.one_in(16), has_planes = !sequence.draws.one_in(16);
  if (has_null) planes.back() = nullptr;
  const clamor_result result = clamor_render_planar(
      context, listener.handle, has_planes ? planes.data() : nullptr, block.frames);
  check_block(block, result);
  return {result, success_if(listener.is_valid && has_planes && !has_null)};
}

}  // namespace

std::vector<Call> listener_calls() {
  return {
      {"clamor_create_listener",
       5,
       {kArgument, kHandle, kFile, kFull, kMemory, kState},
       create_listener},
      {"clamor_destroy_listener", 2, {kArgument, kHandle}, destroy_listener},
      {"clamor_enter_level", 3, {kArgument, kHandle, kFile, kMemory}, enter_level},
      {"clamor_move_listener", 30, {kArgument, kHandle}, move_listener},
      {"clamor_next_keyframe", 20, {kArgument, kHandle}, next_keyframe},
      {"clamor_get_channels", 8, {kArgument, kHandle}, get_channels},
      {"clamor_get_listener_statistics", 15, {kArgument, kHandle}, get_listener_statistics},
      {"clamor_get_voices", 20, {kHandle, kArgument, kState}, get_voices},
      {"clamor_render", 60, {kArgument, kHandle, kBusy}, render},
      {"clamor_render_planar", 40, {kArgument, kHandle, kBusy}, render_planar},
  };
}

}  // namespace clamor::testing
