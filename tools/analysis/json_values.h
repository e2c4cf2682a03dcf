// json_values.h: vectors and columns of numbers in the JSON of files and pages.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <nlohmann/json.hpp>

#include "common/printable.h"
#include "common/vec.h"

namespace clamor {

using OrderedJson = nlohmann::ordered_json;

inline OrderedJson as_json(const Vec3& v) { return {v.x, v.y, v.z}; }
inline OrderedJson as_json(const std::optional<double>& value) {
  return value ? OrderedJson(*value) : OrderedJson();
}

// Names may be invalid UTF-8 or control a terminal, which JSON that is printed may not.
template <class AnyJson>
std::string json_text(const AnyJson& json, int indent = 2) {
  return printable_json(json.dump(indent, ' ', false, AnyJson::error_handler_t::replace));
}

static_assert(std::endian::native == std::endian::little);

// A large column as base64 of little-endian numbers, read by page/data.js.
template <class T>
std::string column(const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto bytes = std::as_bytes(std::span(values));
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three =
          three << 8 | (i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kLetters[three >> (18 - 6 * k) & 63];
  }
  return text;
}

}  // namespace clamor
