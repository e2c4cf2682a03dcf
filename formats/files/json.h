// json.h: a JSON document as a value type, with a nesting limit.
//
// All JSON that Clamor reads (glTF, sidecars, presets, walks) goes through parse_json(), so
// nlohmann-json is visible in json.cpp alone. Documents nested deeper than kMaxJsonDepth are an
// Error, so recursive readers cannot overflow the stack.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/result.h"
#include "common/vec.h"

namespace clamor {

inline constexpr std::size_t kMaxJsonDepth = 64;

class Json {
 public:
  using Array = std::vector<Json>;
  using Object = std::vector<std::pair<std::string, Json>>;  // in file order

  Json() = default;
  explicit Json(bool value) : content_(value) {}
  explicit Json(double value) : content_(value) {}
  explicit Json(std::string value) : content_(std::move(value)) {}
  explicit Json(Array value) : content_(std::move(value)) {}
  explicit Json(Object value) : content_(std::move(value)) {}

  // Null if the value has another type.
  const bool* boolean() const { return std::get_if<bool>(&content_); }
  const double* number() const { return std::get_if<double>(&content_); }
  const std::string* string() const { return std::get_if<std::string>(&content_); }
  const Array* array() const { return std::get_if<Array>(&content_); }
  const Object* object() const { return std::get_if<Object>(&content_); }
  std::string* string() { return std::get_if<std::string>(&content_); }
  Array* array() { return std::get_if<Array>(&content_); }
  Object* object() { return std::get_if<Object>(&content_); }

  // The last member with that name; null if there is none or this is no object. Linear in the
  // number of members.
  const Json* find(std::string_view key) const;
  Json* member(std::string_view key) { return const_cast<Json*>(std::as_const(*this).find(key)); }

  // Finds a member of a member, and so on.
  const Json* find(std::initializer_list<std::string_view> path) const;

  // The member `key`: null if there is none of that type; the elements of a list, none of anything
  // else; a text, empty for anything else.
  const double* number(std::string_view key) const;
  std::span<const Json> list(std::string_view key) const;
  std::span<Json> list(std::string_view key);
  std::string text(std::string_view key) const;

  // "'Radio'", or the number `i` of an item without a name, for messages.
  std::string name_or(std::size_t i) const;

  // Adds a member to an object, in place of members with that name.
  void add(std::string_view key, Json value) { object()->emplace_back(key, std::move(value)); }
  // Adds the member `key` of another object, if that has it, by the name `as`.
  void copy(const Json& from, std::string_view key, std::string_view as);

 private:
  std::variant<std::monostate, bool, double, std::string, Array, Object> content_;
};

// A whole number below `count`; nothing if `value` is null or anything else.
std::optional<std::size_t> index_below(const Json* value, std::size_t count);

Result<Json> parse_json(std::string_view text);

// Shortens all texts and names of members as names are (name_length.h), but for URIs.
void shorten_names(Json& json);

// Reads and parses a file. Errors name the file.
Result<Json> read_json(const std::string& path);
std::string dump_json(const Json& value);

// Reads the members of an object and keeps the first error, so a reader lists the members that it
// expects and checks for errors once, at the end.
class JsonFields {
 public:
  // `where` names the object in messages, as in "emitter 2". `json` must outlive this object.
  JsonFields(const Json& json, std::string where);

  std::optional<double> number(std::string_view key, double low, double high);
  std::optional<std::uint64_t> whole_number(std::string_view key, double low, double high);
  std::optional<std::string> string(std::string_view key);
  std::optional<bool> boolean(std::string_view key);
  std::optional<Vec3> vector(std::string_view key, double limit);
  std::optional<std::vector<double>> numbers(
      std::string_view key);  // a single number is a list of one
  const Json* any(std::string_view key);

  void fail(std::string sentence);
  const std::string& where() const { return where_; }

  // The first error, if any.
  Result<void> result() const;

  // Like result(), but members that were never asked for are an Error, which suggests the nearest
  // name.
  Result<void> result_without_unknown() const;

 private:
  const Json& json_;
  std::string where_;
  std::vector<std::string> asked_;
  std::optional<Error> error_;
};

}  // namespace clamor
