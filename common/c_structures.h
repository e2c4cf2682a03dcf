// c_structures.h: what C interfaces share: structures that begin with their size, `bytes`, as the
// caller knows it, so that later versions can append members; failures; exceptions that stay
// inside.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include "common/printable.h"
#include "common/system_reason.h"

namespace clamor {

// A size above it was never set. Believing it would read or write far beyond the structure.
inline constexpr std::uint32_t kMaxStructure_bytes = 4096;

// Copies a structure of the caller's, which may be of an older version and shorter, or of a newer
// one whose further members are all 0. False if it is neither. Null is a structure of zeros.
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

// Writes a failure where the caller wants it, with as much of the sentence as there is room for.
// Returns the code.
template <class Failure, class Code>
Code write_failure(Failure* failure, Code code, std::string sentence) {
  if (failure == nullptr) return code;
  if (sentence.size() >= sizeof(failure->sentence)) {
    sentence.resize(sizeof(failure->sentence) - 1);
    sentence.resize(sentence.size() - incomplete_bytes(sentence));
  }
  failure->code = code;
  std::memcpy(failure->sentence, sentence.c_str(), sentence.size() + 1);
  return code;
}

// Runs what an interface function does. An exception becomes fail(is_memory, sentence), where an
// empty sentence means that none is known.
template <class Act, class Fail>
auto without_exceptions(const Act& act, const Fail& fail) noexcept -> decltype(fail(true, "")) {
  try {
    return act();
  } catch (const std::bad_alloc&) {
    return fail(true, "");
  } catch (const std::exception& thrown) {
    return fail(false, system_reason(thrown).c_str());
  } catch (...) {
    return fail(false, "");
  }
}

}  // namespace clamor
