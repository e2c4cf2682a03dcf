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
#include <string_view>
#include <typeinfo>

#include "common/printable.h"
#include "common/system_reason.h"

namespace clamor {

// A size above it was never set. Believing it would read or write far beyond the structure.
inline constexpr std::uint32_t kMaxStructure_bytes = 4096;

inline bool is_structure_size(std::size_t bytes) {
  return bytes >= sizeof(std::uint32_t) && bytes <= kMaxStructure_bytes;
}

// Whether a member is set that only a newer version has.
template <class T>
bool sets_unknown_members(const T& given) {
  const auto* const all = reinterpret_cast<const unsigned char*>(&given);
  return std::any_of(all + sizeof(T), all + std::max<std::size_t>(given.bytes, sizeof(T)),
                     [](unsigned char byte) { return byte != 0; });
}

// Copies a structure of the caller's, which may be of an older version and shorter, or of a newer
// one whose further members are all 0. False if it is neither. Null is a structure of zeros.
template <class T>
bool copy_from_caller(const T* given, T& copy) {
  copy = {};
  if (given == nullptr) return true;
  if (!is_structure_size(given->bytes) || sets_unknown_members(*given)) return false;
  std::memcpy(&copy, given, std::min<std::size_t>(given->bytes, sizeof(T)));
  return true;
}

// The reason why a structure's size is refused, with the remedy; empty if it is not, and for null.
// The name is that of C: compilers mangle the name of a type outside of namespaces as its length
// and the name.
template <class T>
std::string size_refusal(const T* given) {
  if (given == nullptr) return "";
  std::string_view mangled = typeid(T).name();
  mangled.remove_prefix(mangled.find_first_not_of("0123456789"));
  const std::string name(mangled), bytes = std::to_string(given->bytes);
  const std::string remedy = "set it to sizeof(" + name + ") before the call";
  if (!is_structure_size(given->bytes))
    return name + ".bytes is " + bytes + ", but must be the structure's size: " + remedy;
  if (!sets_unknown_members(*given)) return "";
  return name + ".bytes is " + bytes + ", but this library knows " + std::to_string(sizeof(T)) +
         " bytes of it, and some beyond them are not 0: install the library of the program's "
         "header, or leave its new members 0; if there are none, " +
         remedy;
}

// Writes a result into a structure of the caller's, as much of it as it has room for.
template <class T>
bool copy_to_caller(T filled, T* into) {
  if (into == nullptr || !is_structure_size(into->bytes)) return false;
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
