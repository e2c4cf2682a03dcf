// portal_calls.cpp: calls about the portals of levels, see call_sequence.h.
#include "tests/library/call_helpers.h"

namespace clamor::testing {

namespace {

std::uint32_t pick_portal(Draws& draws) {
  static constexpr std::uint32_t kPortals[] = {0, 0, 1, UINT32_MAX};
  return kPortals[draws.below(4)];
}

CallOutcome get_portal_info(Sequence& sequence) {
  clamor_context* context = nullptr;
  Picked level = sequence.pick_level(sequence.pick_context(context));
  const std::uint32_t portal = pick_portal(sequence.draws);
  level.is_valid = level.is_valid && portal < kLevelPortals;
  return get_structure<clamor_portal_info>(sequence, level, [&](clamor_level handle, auto* info) {
    const clamor_result result = clamor_get_portal_info(context, handle, portal, info);
    if (result == CLAMOR_OK && info->bytes >= sizeof(*info)) {
      std::uint32_t found = kLevelPortals;
      if (clamor_find_portal(context, handle, info->name, &found) != CLAMOR_OK || found > portal)
        broken("a portal is not found by its name");
    }
    return result;
  });
}

CallOutcome find_portal(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked level = sequence.pick_level(sequence.pick_context(context));
  Draws& draws = sequence.draws;
  const char* const name = draws.one_in(8) ? nullptr : "no portal's name";
  std::uint32_t found = 99;
  std::uint32_t* const into = draws.one_in(8) ? nullptr : &found;
  const clamor_result result = clamor_find_portal(context, level.handle, name, into);
  if (found != 99) broken("a failed call wrote its result");
  return {result, Expected::kError};
}

CallOutcome set_portal(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked level = sequence.pick_level(sequence.pick_context(context));
  Draws& draws = sequence.draws;
  const std::uint32_t portal = pick_portal(draws);
  const double openness = draws.one_in(8) ? draws.odd_number() : draws.byte() / 255.0;
  const bool is_valid = level.is_valid && portal < kLevelPortals && is_within(openness, 0, 1);
  return {clamor_set_portal(context, level.handle, portal, openness), success_if(is_valid)};
}

}  // namespace

std::vector<Call> portal_calls() {
  return {
      {"clamor_get_portal_info", 2, {kHandle, kArgument}, get_portal_info},
      {"clamor_find_portal", 2, {kHandle, kArgument, CLAMOR_ERROR_NOT_FOUND}, find_portal},
      {"clamor_set_portal", 6, {kHandle, kArgument, kMemory}, set_portal},
  };
}

}  // namespace clamor::testing
