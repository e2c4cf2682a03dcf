// clamor_bake_calls.h: what all functions of the bake's C interface share: levels, codes and
// sentences.
#pragma once

#include <cstddef>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include "bake/clamor_bake.h"
#include "common/printable.h"

namespace clamor {

class ApplicationLevel;

// The level behind a pointer of the interface that is not null.
const ApplicationLevel& level_of(const clamor_bake_level& level);

// Writes a failure where the caller wants it.
inline clamor_bake_result fail(clamor_bake_error* error, clamor_bake_result code,
                               const std::string& sentence = "") {
  if (error == nullptr) return code;
  std::string text = sentence.empty() ? clamor_bake_result_text(code) : sentence;
  if (text.size() >= sizeof(error->sentence)) {
    text.resize(sizeof(error->sentence) - 1);
    text.resize(text.size() - clamor::incomplete_bytes(text));
  }
  error->code = code;
  std::memcpy(error->sentence, text.c_str(), text.size() + 1);
  return code;
}

// Runs what an interface function does; no exception leaves it.
template <class Act>
clamor_bake_result guarded(clamor_bake_error* error, const Act& act) noexcept {
  try {
    if (error != nullptr) *error = {};
    return act();
  } catch (const std::bad_alloc&) {
    return fail(error, CLAMOR_BAKE_ERROR_MEMORY);
  } catch (const std::exception& thrown) {
    return fail(error, CLAMOR_BAKE_ERROR_INTERNAL, thrown.what());
  } catch (...) {
    return fail(error, CLAMOR_BAKE_ERROR_INTERNAL);
  }
}

inline clamor_bake_result refuse(clamor_bake_error* error, const std::string& sentence) {
  return fail(error, CLAMOR_BAKE_ERROR_ARGUMENT, sentence);
}

inline std::string text_of(const char* text) { return text != nullptr ? text : ""; }

}  // namespace clamor
