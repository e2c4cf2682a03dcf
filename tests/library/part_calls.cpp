// part_calls.cpp: calls about movable parts, see call_sequence.h.
#include <algorithm>
#include <cmath>

#include "tests/library/call_helpers.h"

namespace clamor::testing {

namespace {

constexpr std::size_t kMaxParts = 24;  // so that a sequence stays quick

// Draws a pose for a part, whose coordinates are limited more than a listener's.
clamor_pose pick_part_pose(Sequence& sequence, bool& is_valid) {
  const clamor_pose pose = sequence.pick_pose(is_valid);
  for (const double metre : pose.position_m) is_valid = is_valid && is_within(metre, -1e8, 1e8);
  return pose;
}

CallOutcome hand_out(Sequence& sequence, KnownContext* known, clamor_result result,
                     clamor_part part, const KnownPart& made, bool is_valid) {
  if (result == CLAMOR_OK && known != nullptr) {
    if (find(known->parts, part) == nullptr) {
      remember(sequence, part);
      known->parts.push_back(made);
      known->parts.back().handle = part;
    }
  } else {
    expect_untouched(part);
  }
  return {result, success_if(is_valid)};
}

CallOutcome get_level_part(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked level = sequence.pick_level(known);
  static constexpr std::uint32_t kNumbers[] = {0, 0, 1, UINT32_MAX};
  const std::uint32_t number = kNumbers[sequence.draws.below(4)];
  clamor_part part = kUntouched;
  clamor_part* const into = sequence.draws.one_in(16) ? nullptr : &part;
  const clamor_result result = clamor_get_level_part(context, level.handle, number, into);
  return hand_out(sequence, known, result, part, {.level = level.handle},
                  level.is_valid && into != nullptr && number < kLevelParts);
}

CallOutcome find_part(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked level = sequence.pick_level(known);
  static constexpr const char* kNames[] = {"door", "door", "no part's name", nullptr};
  const std::uint32_t name = sequence.draws.below(4);
  clamor_part part = kUntouched;
  clamor_part* const into = sequence.draws.one_in(16) ? nullptr : &part;
  const clamor_result result = clamor_find_part(context, level.handle, kNames[name], into);
  return hand_out(sequence, known, result, part, {.level = level.handle},
                  level.is_valid && into != nullptr && name < 2);
}

CallOutcome get_part_info(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked part = sequence.pick(sequence.pick_context(context), &KnownContext::parts);
  return get_structure<clamor_part_info>(sequence, part, [&](clamor_part handle, auto* info) {
    return clamor_get_part_info(context, handle, info);
  });
}

// A box, or two triangles of which a corner may be missing or no number.
struct PartShapes {
  std::vector<float> vertices_m{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::vector<std::uint32_t> indices{0, 1, 2, 1, 2, 3};
  bool is_valid = true;
};

PartShapes pick_shape(Draws& draws, clamor_part_options& options) {
  PartShapes shapes;
  if (draws.one_in(2)) {
    for (double& extent : options.half_extents_m) {
      extent = draws.one_in(16) ? draws.odd_number() : (1 + draws.byte()) / 64.0;
      shapes.is_valid = shapes.is_valid && is_within(extent, 0.001, 10'000);
    }
    const double(&half)[3] = options.half_extents_m;
    if (half[0] != 0 || half[1] != 0 || half[2] != 0) return shapes;
    shapes.is_valid = true;
  }
  if (draws.one_in(8)) {
    const double odd = draws.odd_number();
    shapes.vertices_m[draws.below(12)] = static_cast<float>(odd);
    shapes.is_valid = std::abs(static_cast<float>(odd)) <= 1e6f;
  }
  if (draws.one_in(8)) {
    shapes.indices[draws.below(6)] = 4;
    shapes.is_valid = false;
  }
  return shapes;
}

CallOutcome add_part(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  Draws& draws = sequence.draws;
  clamor_part_options options{};
  options.is_disabled = draws.one_in(8);
  Picked level{0, true};
  if (draws.one_in(2)) level = sequence.pick_level(known);
  options.level = level.handle;
  bool is_valid = true;
  options.pose = pick_part_pose(sequence, is_valid);
  if (draws.one_in(4)) {
    options.pose = {};
    is_valid = true;
  }
  const PartShapes shapes = pick_shape(draws, options);
  options.vertices_m = shapes.vertices_m.data();
  options.indices = shapes.indices.data();
  options.vertices = 4;
  options.triangles = 2;
  for (double& share : options.transmission) {
    share = draws.one_in(64) ? draws.odd_number() : draws.byte() / 255.0;
    is_valid = is_valid && is_within(share, 0, 1);
  }
  // A shorter structure lacks its shape or some of its bands.
  auto given = sequence.pick_structure(options, 8, false);
  const bool is_whole = given.bytes >= sizeof(options);
  clamor_part part = kUntouched;
  clamor_part* const into = draws.one_in(16) ? nullptr : &part;
  if (known != nullptr && known->parts.size() >= kMaxParts) context = nullptr;
  const clamor_result result = clamor_add_part(context, given.pointer, into, sequence.pick_error());
  CallOutcome outcome = hand_out(
      sequence, known, result, part, {.is_added = true},
      is_valid && shapes.is_valid && context != nullptr && into != nullptr && given.is_valid &&
          given.pointer != nullptr && (level.handle == 0 || level.is_valid));
  if (given.pointer != nullptr && !is_whole) outcome.expected = Expected::kEither;
  return outcome;
}

CallOutcome move_part(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked part = sequence.pick(sequence.pick_context(context), &KnownContext::parts);
  bool is_valid = true;
  const clamor_pose pose = pick_part_pose(sequence, is_valid);
  const clamor_pose* const given = sequence.draws.one_in(32) ? nullptr : &pose;
  return {clamor_move_part(context, part.handle, given),
          success_if(part.is_valid && is_valid && given != nullptr)};
}

CallOutcome enable_part(Sequence& sequence) {
  clamor_context* context = nullptr;
  const Picked part = sequence.pick(sequence.pick_context(context), &KnownContext::parts);
  return {clamor_enable_part(context, part.handle, sequence.draws.below(3)),
          success_if(part.is_valid)};
}

CallOutcome remove_part(Sequence& sequence) {
  clamor_context* context = nullptr;
  KnownContext* const known = sequence.pick_context(context);
  const Picked part = sequence.pick(known, &KnownContext::parts);
  const bool is_added = part.is_valid && find(known->parts, part.handle)->is_added;
  const clamor_result result = clamor_remove_part(context, part.handle);
  if (result == CLAMOR_OK && part.is_valid)
    std::erase_if(known->parts, [&](const KnownPart& one) { return one.handle == part.handle; });
  return {result, success_if(is_added)};
}

}  // namespace

std::vector<Call> part_calls() {
  const std::vector<clamor_result> of_level = {kHandle, kArgument, CLAMOR_ERROR_NOT_FOUND, kFull,
                                               kMemory};
  return {
      {"clamor_get_level_part", 4, of_level, get_level_part},
      {"clamor_find_part", 4, of_level, find_part},
      {"clamor_get_part_info", 6, {kHandle, kArgument}, get_part_info},
      {"clamor_add_part", 8, {kArgument, kHandle, kFull, kMemory}, add_part},
      {"clamor_move_part", 20, {kHandle, kArgument}, move_part},
      {"clamor_enable_part", 4, {kHandle, kArgument}, enable_part},
      {"clamor_remove_part", 4, {kHandle, kArgument, kState}, remove_part},
  };
}

}  // namespace clamor::testing
