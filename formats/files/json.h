// json.h: a JSON document as a plain value, read safely.
//
// Everything Clamor reads as JSON (glTF, sidecars, presets, walks) goes through parse_json(), so
// nlohmann-json is visible in json.cpp alone and one depth limit holds for all: a document nested
// deeper than kMaxJsonDepth is an Error, so no reader of it can run out of stack.
#pragma once

#include <cstddef>
#include <optional>
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
  using Object = std::vector<std::pair<std::string, Json>>;  // in the order of the file

  Json() = default;
  explicit Json(bool value) : content_(value) {}
  explicit Json(double value) : content_(value) {}
  explicit Json(std::string value) : content_(std::move(value)) {}
  explicit Json(Array value) : content_(std::move(value)) {}
  explicit Json(Object value) : content_(std::move(value)) {}

  // Null when the value is of another kind.
  const bool* boolean() const { return std::get_if<bool>(&content_); }
  const double* number() const { return std::get_if<double>(&content_); }
  const std::string* string() const { return std::get_if<std::string>(&content_); }
  const Array* array() const { return std::get_if<Array>(&content_); }
  const Object* object() const { return std::get_if<Object>(&content_); }
  Array* array() { return std::get_if<Array>(&content_); }
  Object* object() { return std::get_if<Object>(&content_); }

  // The member of that name, the last where there are several; null when there is none or this is
  // no object. Takes time in proportion to the number of members.
  const Json* find(std::string_view key) const;

  // find() along a path of names.
  const Json* find(std::initializer_list<std::string_view> path) const;

  // Element i of the array that is the member `key`; null when there is none.
  const Json* element(std::string_view key, std::size_t i) const;

 private:
  std::variant<std::monostate, bool, double, std::string, Array, Object> content_;
};

Result<Json> parse_json(std::string_view text);

// Of a file. Errors name it: cannot be read, is not JSON.
Result<Json> read_json(const std::string& path);
std::string dump_json(const Json& value);

// Reads the members of one object and remembers the first thing that is wrong with them, so that a
// reader states what it wants in plain lines and asks once, at the end, whether all was well.
class JsonFields {
 public:
  // `where` names the object in messages, as in "emitter 2". `json` must outlive this.
  JsonFields(const Json& json, std::string where);

  std::optional<double> number(std::string_view key, double low, double high);
  std::optional<std::string> string(std::string_view key);
  std::optional<bool> boolean(std::string_view key);
  std::optional<Vec3> vector(std::string_view key, double limit);
  std::optional<std::vector<double>> numbers(std::string_view key);  // one number is a list of one
  const Json* any(std::string_view key);

  void fail(std::string sentence);
  const std::string& where() const { return where_; }

  // What went wrong first, if anything.
  Result<void> result() const;

  // Also an Error where a member was never asked for: it names the nearest that was.
  Result<void> result_without_unknown() const;

 private:
  const Json& json_;
  std::string where_;
  std::vector<std::string> asked_;
  std::optional<Error> error_;
};

}  // namespace clamor
