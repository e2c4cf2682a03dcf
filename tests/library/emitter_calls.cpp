// emitter_calls.cpp: calls about the emitters of levels, see call_sequence.h.
#include "tests/library/call_helpers.h"

namespace clamor::testing {

namespace {

std::uint32_t pick_emitter(Draws& draws) {
  static constexpr std::uint32_t kEmitters[] = {0, 1, 2, 3, UINT32_MAX};
  return kEmitters[draws.below(5)];
}

CallOutcome get_emitter_info(Sequence& sequence) {
  clamor_context* context = nullptr;
  Picked level = sequence.pick_level(sequence.pick_context(context));
  const std::uint32_t emitter = pick_emitter(sequence.draws);
  level.is_valid = level.is_valid && emitter < kLevelEmitters;
  return get_structure<clamor_emitter_info>(sequence, level, [&](clamor_level handle, auto* info) {
    const clamor_result result = clamor_get_emitter_info(context, handle, emitter, info);
    if (result == CLAMOR_OK && info->bytes >= sizeof(*info)) {
      std::uint32_t found = kLevelEmitters;
      if (clamor_find_emitter(context, handle, info->name, &found) != CLAMOR_OK || found > emitter)
        broken("an emitter is not found by its name");
    }
    return result;
  });
}

CallOutcome find_emitter(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked level = sequence.pick_level(sequence.pick_context(context));
  Draws& draws = sequence.draws;
  const char* const name = draws.one_in(8) ? nullptr : "no emitter's name";
  std::uint32_t found = 99;
  std::uint32_t* const into = draws.one_in(8) ? nullptr : &found;
  const clamor_result result = clamor_find_emitter(context, level.handle, name, into);
  if (found != 99) broken("a failed call wrote its result");
  return {result, Expected::kError};
}

CallOutcome change_emitter(Sequence& sequence) {
  clamor_context* context = nullptr;
  const KnownContext* const known = sequence.pick_context(context);
  const Picked level = sequence.pick_level(known);
  Draws& draws = sequence.draws;
  const std::uint32_t emitter = pick_emitter(draws);
  clamor_emitter_options options{};
  options.is_muted = draws.one_in(4);
  options.has_gain = draws.below(2);
  if (draws.one_in(2)) options.group = sequence.pick(known, &KnownContext::groups).handle;
  options.gain = draws.one_in(8) ? draws.odd_number() : draws.byte() / 255.0;
  const auto given = sequence.pick_structure(options, 8, false);
  const std::uint64_t group = given.known.group;
  const bool is_valid = level.is_valid && given.pointer != nullptr && given.is_valid &&
                        emitter < kLevelEmitters &&
                        (given.known.has_gain == 0 || is_within(given.known.gain, 0, 1)) &&
                        (group == 0 || (known != nullptr && find(known->groups, group) != nullptr));
  return {clamor_change_emitter(context, level.handle, emitter, given.pointer),
          success_if(is_valid)};
}

}  // namespace

std::vector<Call> emitter_calls() {
  return {
      {"clamor_get_emitter_info", 4, {kHandle, kArgument}, get_emitter_info},
      {"clamor_find_emitter", 2, {kHandle, kArgument, CLAMOR_ERROR_NOT_FOUND}, find_emitter},
      {"clamor_change_emitter", 10, {kHandle, kArgument, kMemory}, change_emitter},
  };
}

}  // namespace clamor::testing
