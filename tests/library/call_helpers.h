// call_helpers.h: what the files *_calls.cpp share.
#pragma once

#include "tests/library/call_sequence.h"

namespace clamor::testing {

inline void expect_untouched(std::uint64_t result) {
  if (result != kUntouched) broken("a failed call wrote its result");
}

// A handle that a successful call gave.
inline void remember(Sequence& sequence, std::uint64_t handle) {
  if (handle == 0) broken("a new handle is 0");
  sequence.handles.push_back(handle);
}

// A number that is within [low, high].
inline bool is_within(double number, double low, double high) {
  return number >= low && number <= high;
}

// Structures that the library writes, as they were if the call failed.
template <class T, class Get>
CallOutcome get_structure(Sequence& sequence, const Picked& object, const Get& get) {
  auto given = sequence.pick_structure(T{}, 1, false);
  if (given.bytes > sizeof(given.known.bytes) && given.is_valid)
    std::memset(given.memory.get() + sizeof(given.known.bytes), 0x5a,
                given.bytes - sizeof(given.known.bytes));
  // Bytes behind the known members do not matter in a structure that is written.
  const bool is_valid = given.pointer != nullptr && given.known.bytes >= sizeof(given.known.bytes);
  const std::vector<unsigned char> before(given.memory.get(), given.memory.get() + given.bytes);
  const clamor_result result = get(object.handle, given.pointer);
  if (result != CLAMOR_OK && !given.equals(before)) broken("a failed call wrote its structure");
  return {result, success_if(object.is_valid && is_valid)};
}

inline constexpr clamor_result kArgument = CLAMOR_ERROR_ARGUMENT, kHandle = CLAMOR_ERROR_HANDLE,
                               kFile = CLAMOR_ERROR_FILE, kMemory = CLAMOR_ERROR_MEMORY,
                               kFull = CLAMOR_ERROR_FULL, kBusy = CLAMOR_ERROR_BUSY,
                               kState = CLAMOR_ERROR_STATE;

// Every level that the calls open has as many sounds, emitters, movable parts and portals.
inline constexpr std::uint32_t kLevelSounds = 3, kLevelEmitters = 3, kLevelParts = 1,
                               kLevelPortals = 1;

// The functions of the interface, by the files that call them.
std::vector<Call> level_calls();
std::vector<Call> listener_calls();
std::vector<Call> sound_calls();
std::vector<Call> source_calls();
std::vector<Call> emitter_calls();
std::vector<Call> part_calls();
std::vector<Call> portal_calls();

// Removes all sounds, sources and groups, which must exist still.
void remove_all_sources(const KnownContext& known);

}  // namespace clamor::testing
