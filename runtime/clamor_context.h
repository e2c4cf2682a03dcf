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

// Hands out the handle of a new object; 0 means that there are as many as there can be.
inline clamor_result hand_out(std::uint64_t handle, std::uint64_t* into,
                              clamor_error* error = nullptr) {
  if (handle == 0) return fail(error, CLAMOR_ERROR_FULL);
  *into = handle;
  return CLAMOR_OK;
}

}  // namespace clamor::interface
