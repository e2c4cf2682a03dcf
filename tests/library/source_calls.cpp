// source_calls.cpp: calls about sources and groups of sources, see call_sequence.h.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "tests/library/call_helpers.h"

namespace clamor::testing {

namespace {

constexpr double kMaxGain = 1e6, kMaxPosition_m = 1e8, kMaxSpeed_mps = 1e4, kMaxAxis = 1e3,
                 kMaxExponent = 1e4, kMaxReverberation = 100, kMaxPlayed_s = 1e6, kMaxTime_s = 5e6;

bool are_within(const double (&numbers)[3], double limit) {
  return std::all_of(std::begin(numbers), std::end(numbers),
                     [=](double number) { return is_within(number, -limit, limit); });
}

bool allows(const clamor_motion& motion) {
  const auto& [x, y, z] = motion.axis;
  const bool is_default = x == 0 && y == 0 && z == 0;
  return are_within(motion.position_m, kMaxPosition_m) &&
         are_within(motion.velocity_mps, kMaxSpeed_mps) && are_within(motion.axis, kMaxAxis) &&
         (is_default || std::hypot(x, y, z) > 1e-3);
}

clamor_motion pick_motion(Draws& draws) {
  clamor_motion motion{{draws.byte() / 43.0, 4, 1.5}, {}, {}};
  if (draws.one_in(4)) motion.velocity_mps[draws.below(3)] = draws.below(64) - 32.0;
  if (draws.one_in(4)) motion.axis[draws.below(3)] = 1;
  if (draws.one_in(16)) {
    double(*const vectors[])[3] = {&motion.position_m, &motion.velocity_mps, &motion.axis};
    (*vectors[draws.below(3)])[draws.below(3)] = draws.odd_number();
  }
  return motion;
}

// Whether clamor.h allows the options in a context.
bool allows(const KnownContext& context, const clamor_source_options& options) {
  const double gain = options.gain == 0 ? 1 : options.gain;
  bool bands_are_valid = true;
  for (int b = 0; b < 8; ++b)
    bands_are_valid = bands_are_valid && options.band_gains[b] >= 0 &&
                      options.band_gains[b] * gain <= kMaxGain &&
                      is_within(options.directivity[b], 0, kMaxExponent);
  return find(context.sounds, options.sound) != nullptr &&
         (options.group == 0 || find(context.groups, options.group) != nullptr) &&
         (options.level == 0 || has_level(context, options.level)) && allows(options.motion) &&
         gain > 0 && gain <= kMaxGain && bands_are_valid &&
         (options.has_reverberation == 0 ||
          is_within(options.reverberation, 0, kMaxReverberation)) &&
         is_within(options.played_s, 0, kMaxPlayed_s);
}

Structure<clamor_source_options> pick_source_options(Sequence& sequence,
                                                     const KnownContext* known) {
  Draws& draws = sequence.draws;
  clamor_source_options options{};
  options.ends_with_sound = draws.below(2);
  options.sound = sequence.pick(known, &KnownContext::sounds).handle;
  if (draws.one_in(2)) options.group = sequence.pick(known, &KnownContext::groups).handle;
  if (draws.one_in(3)) options.level = sequence.pick_level(known).handle;
  options.motion = pick_motion(draws);
  if (draws.one_in(8)) options.gain = draws.odd_number();
  if (draws.one_in(8)) options.band_gains[draws.below(8)] = draws.odd_number();
  if (draws.one_in(8)) options.directivity[draws.below(8)] = draws.odd_number();
  if (draws.one_in(8)) options.played_s = draws.odd_number();
  options.has_reverberation = draws.one_in(2);
  options.reverberation = draws.one_in(8) ? draws.odd_number() : draws.byte() / 64.0;
  return sequence.pick_structure(options, 1, false);
}

CallOutcome add_source(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const auto given = pick_source_options(sequence, known);
  KnownSource source{kUntouched, given.known.sound, given.known.ends_with_sound != 0,
                     given.known.motion};
  clamor_source* const into = sequence.draws.one_in(32) ? nullptr : &source.handle;
  const bool is_valid = known != nullptr && into != nullptr && given.pointer != nullptr &&
                        given.is_valid && allows(*known, given.known);
  const bool is_full = known != nullptr && known->sources.size() == known->max_sources;
  const clamor_result result = clamor_add_source(context, given.pointer, into);
  if (result == CLAMOR_OK && known != nullptr) {
    remember(sequence, source.handle);
    known->sources.push_back(source);
  } else {
    expect_untouched(source.handle);
  }
  if (is_valid && is_full && result != CLAMOR_ERROR_FULL)
    broken("the context holds more sources than its options allow");
  return {result, success_if(is_valid && !is_full)};
}

CallOutcome change_source(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked source = sequence.pick(known, &KnownContext::sources);
  const auto given = pick_source_options(sequence, known);
  const bool is_valid =
      source.is_valid && given.pointer != nullptr && given.is_valid && allows(*known, given.known);
  const clamor_result result = clamor_change_source(context, source.handle, given.pointer);
  if (result == CLAMOR_OK && source.is_valid)
    *find(known->sources, source.handle) = {source.handle, given.known.sound,
                                            given.known.ends_with_sound != 0, given.known.motion};
  return {result, success_if(is_valid)};
}

CallOutcome move_source(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked source = sequence.pick(known, &KnownContext::sources);
  const clamor_motion motion = pick_motion(sequence.draws);
  const bool has_motion = !sequence.draws.one_in(32);
  const clamor_result result =
      clamor_move_source(context, source.handle, has_motion ? &motion : nullptr);
  if (result == CLAMOR_OK && source.is_valid) find(known->sources, source.handle)->motion = motion;
  return {result, success_if(source.is_valid && has_motion && allows(motion))};
}

CallOutcome remove_source(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked source = sequence.pick(known, &KnownContext::sources);
  const clamor_result result = clamor_remove_source(context, source.handle);
  if (result == CLAMOR_OK && source.is_valid)
    std::erase_if(known->sources, [&](const auto& one) { return one.handle == source.handle; });
  return {result, success_if(source.is_valid)};
}

Structure<clamor_group_options> pick_group_options(Sequence& sequence) {
  Draws& draws = sequence.draws;
  clamor_group_options options{};
  options.is_muted = draws.one_in(4);
  options.is_paused = draws.one_in(3);
  options.has_gain = draws.one_in(2);
  options.gain = draws.one_in(8) ? draws.odd_number() : draws.byte() / 64.0;
  options.max_voices = draws.one_in(8) ? draws.odd_number() : draws.byte() / 255.0;
  return sequence.pick_structure(options, 1, false);
}

bool allows(const Structure<clamor_group_options>& given) {
  const clamor_group_options& options = given.known;
  return given.pointer != nullptr && given.is_valid &&
         (options.has_gain == 0 || is_within(options.gain, 0, kMaxGain)) &&
         is_within(options.max_voices, 0, 1);
}

CallOutcome add_group(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const auto given = pick_group_options(sequence);
  clamor_group group = kUntouched;
  clamor_group* const into = sequence.draws.one_in(32) ? nullptr : &group;
  const bool is_valid = known != nullptr && into != nullptr && allows(given);
  const clamor_result result = clamor_add_group(context, given.pointer, into);
  if (result == CLAMOR_OK && known != nullptr) {
    remember(sequence, group);
    known->groups.push_back(group);
  } else {
    expect_untouched(group);
  }
  return {result, success_if(is_valid)};
}

CallOutcome change_group(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked group = sequence.pick(sequence.pick_context(context), &KnownContext::groups);
  const auto given = pick_group_options(sequence);
  return {clamor_change_group(context, group.handle, given.pointer),
          success_if(group.is_valid && allows(given))};
}

CallOutcome remove_group(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked group = sequence.pick(known, &KnownContext::groups);
  const clamor_result result = clamor_remove_group(context, group.handle);
  if (result == CLAMOR_OK && group.is_valid) std::erase(known->groups, group.handle);
  return {result, success_if(group.is_valid)};
}

// A source is asked about by moving it to where it is.
bool exists(const KnownContext& known, const KnownSource& source) {
  const clamor_result moved = clamor_move_source(known.context, source.handle, &source.motion);
  if (moved != CLAMOR_OK && moved != CLAMOR_ERROR_HANDLE) broken("a source cannot be moved");
  return moved == CLAMOR_OK;
}

double pick_time_s(Draws& draws, const KnownContext* known) {
  switch (draws.below(8)) {
    case 0:
      return draws.odd_number();
    case 1:
      return draws.byte() / 128.0;
    case 2:
      return 0;
    default:
      break;
  }
  // Mostly the time that a listener wants.
  if (known == nullptr || known->listeners.empty()) return 0;
  std::uint32_t wanted = 0;
  double time_s = 0;
  const auto count = static_cast<std::uint32_t>(known->listeners.size());
  const clamor_listener listener = known->listeners[draws.below(count)].handle;
  if (clamor_next_keyframe(known->context, listener, &wanted, &time_s) != CLAMOR_OK)
    broken("a listener cannot be asked about");
  return time_s;
}

CallOutcome commit(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const double time_s = pick_time_s(sequence.draws, known);
  const clamor_result result = clamor_commit(context, time_s);
  if (result == CLAMOR_OK && known != nullptr) {
    std::erase_if(known->sources, [&](const KnownSource& source) {
      if (exists(*known, source)) return false;
      if (!source.ends_with_sound) broken("a source has ended by itself");
      return true;
    });
    // A thread of the library's may be making a keyframe.
    if (known->caller_updates)
      for (PulledStream* const stream : known->removed_streams) stream->has_ended = true;
    known->removed_streams.clear();
  }
  return {result, success_if(known != nullptr && is_within(time_s, -kMaxTime_s, kMaxTime_s))};
}

}  // namespace

void remove_all_sources(const KnownContext& known) {
  const auto expect_success = [](clamor_result result, const char* promise) {
    if (result != CLAMOR_OK) broken(promise);
  };
  for (const clamor_group group : known.groups)
    expect_success(clamor_remove_group(known.context, group), "a group has ended by itself");
  for (const KnownSource& source : known.sources)
    if (!exists(known, source)) broken("a source has ended by itself");
  for (const KnownSound& sound : known.sounds)
    expect_success(clamor_remove_sound(known.context, sound.handle), "a sound has ended by itself");
  for (const KnownSource& source : known.sources)
    if (exists(known, source)) broken("a source has outlived its sound");
  expect_success(clamor_commit(known.context, 0), "the last changes cannot be committed");
}

std::vector<Call> source_calls() {
  return {
      {"clamor_add_group", 5, {kArgument, kFull, kMemory}, add_group},
      {"clamor_change_group", 10, {kHandle, kArgument}, change_group},
      {"clamor_remove_group", 2, {kArgument, kHandle}, remove_group},
      {"clamor_add_source", 30, {kHandle, kArgument, kFull, kMemory}, add_source},
      {"clamor_change_source", 15, {kHandle, kArgument}, change_source},
      {"clamor_move_source", 30, {kHandle, kArgument}, move_source},
      {"clamor_remove_source", 6, {kArgument, kHandle}, remove_source},
      {"clamor_commit", 40, {kArgument, kMemory}, commit},
  };
}

}  // namespace clamor::testing
