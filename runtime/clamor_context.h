// clamor_context.h: the context behind the C interface, and what its functions share. Not
// installed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include "runtime/clamor.h"
#include "runtime/world/world.h"

struct clamor_context {
  explicit clamor_context(const clamor_options& options)
      : caller_updates(options.caller_updates != 0),
        update_period_s(caller_updates ? options.update_period_s : 0),
        world(!caller_updates, options.max_sources, options.max_sounds) {}

  const bool caller_updates;
  const double update_period_s;
  clamor::World world;
};

namespace clamor::interface {

constexpr double kMaxPosition_m = 1e9;
constexpr double kMaxGain = 1e6;  // 120 dB
// A size above it was never set. Believing it would read or write far beyond the structure.
constexpr std::uint32_t kMaxStructure_bytes = 4096;

// Writes a failure where the caller wants it.
inline clamor_result fail(clamor_error* error, clamor_result code,
                          const std::string& sentence = "") {
  if (error == nullptr) return code;
  const std::string text = sentence.empty() ? clamor_result_text(code) : sentence;
  error->code = code;
  const std::size_t length = std::min(text.size(), sizeof(error->sentence) - 1);
  std::memcpy(error->sentence, text.data(), length);
  error->sentence[length] = 0;
  return code;
}

// Runs what an interface function does; no exception leaves it.
template <class Act>
clamor_result guarded(clamor_error* error, const Act& act) noexcept {
  try {
    if (error != nullptr) *error = {};
    return act();
  } catch (const std::bad_alloc&) {
    return fail(error, CLAMOR_ERROR_MEMORY);
  } catch (const std::exception& thrown) {
    return fail(error, CLAMOR_ERROR_INTERNAL, thrown.what());
  } catch (...) {
    return fail(error, CLAMOR_ERROR_INTERNAL);
  }
}

// Copies a structure of the caller's, which may be of an older version and shorter, or of a newer
// one whose further members are all 0. False if it is neither.
template <class T>
bool copy_from_caller(const T* given, T& copy) {
  copy = {};
  if (given == nullptr) return true;
  const std::size_t bytes = given->bytes;
  if (bytes < sizeof(given->bytes) || bytes > kMaxStructure_bytes) return false;
  std::memcpy(&copy, given, std::min(bytes, sizeof(T)));
  const auto* const all = reinterpret_cast<const unsigned char*>(given);
  for (std::size_t i = sizeof(T); i < bytes; ++i)
    if (all[i] != 0) return false;
  return true;
}

// Writes a result into a structure of the caller's, as much of it as it has room for.
template <class T>
bool copy_to_caller(T filled, T* into) {
  if (into == nullptr || into->bytes < sizeof(into->bytes) || into->bytes > kMaxStructure_bytes)
    return false;
  filled.bytes = into->bytes;
  const std::size_t room = into->bytes;
  if (room > sizeof(T))
    std::memset(reinterpret_cast<unsigned char*>(into) + sizeof(T), 0, room - sizeof(T));
  std::memcpy(into, &filled, std::min(room, sizeof(T)));
  return true;
}

// Hands out the handle of a new object; 0 means that there are as many as there can be.
inline clamor_result hand_out(std::uint64_t handle, std::uint64_t* into,
                              clamor_error* error = nullptr) {
  if (handle == 0) return fail(error, CLAMOR_ERROR_FULL);
  *into = handle;
  return CLAMOR_OK;
}

}  // namespace clamor::interface
