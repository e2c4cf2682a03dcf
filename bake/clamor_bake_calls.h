// clamor_bake_calls.h: what all functions of the bake's C interface share: levels, codes and
// sentences.
#pragma once

#include <string>

#include "bake/clamor_bake.h"
#include "common/c_structures.h"

namespace clamor {

class ApplicationLevel;

// The level behind a pointer of the interface that is not null.
const ApplicationLevel& level_of(const clamor_bake_level& level);

// Writes a failure where the caller wants it.
inline clamor_bake_result fail(clamor_bake_error* error, clamor_bake_result code,
                               const std::string& sentence = "") {
  return write_failure(error, code, sentence.empty() ? clamor_bake_result_text(code) : sentence);
}

// Runs what an interface function does; no exception leaves it.
template <class Act>
clamor_bake_result guarded(clamor_bake_error* error, const Act& act) noexcept {
  if (error != nullptr) *error = {};
  return without_exceptions(act, [error](bool is_memory, const char* sentence) {
    return fail(error, is_memory ? CLAMOR_BAKE_ERROR_MEMORY : CLAMOR_BAKE_ERROR_INTERNAL, sentence);
  });
}

inline clamor_bake_result refuse(clamor_bake_error* error, const std::string& sentence) {
  return fail(error, CLAMOR_BAKE_ERROR_ARGUMENT, sentence);
}

inline std::string text_of(const char* text) { return text != nullptr ? text : ""; }

}  // namespace clamor
