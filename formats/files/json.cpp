#include "formats/files/json.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <nlohmann/json.hpp>

#include "common/name_length.h"
#include "common/text.h"
#include "formats/files/file_kind.h"
#include "formats/files/level_folder.h"

namespace clamor {

namespace {

// Builds a Json from parser events. The parser does not recurse; the list of open containers is the
// only stack.
class Builder : public nlohmann::json_sax<nlohmann::json> {
 public:
  bool null() override { return add(Json()); }
  bool boolean(bool value) override { return add(Json(value)); }
  bool number_integer(number_integer_t value) override {
    return add(Json(static_cast<double>(value)));
  }
  bool number_unsigned(number_unsigned_t value) override {
    return add(Json(static_cast<double>(value)));
  }
  bool number_float(number_float_t value, const string_t&) override { return add(Json(value)); }
  bool string(string_t& value) override { return add(Json(std::move(value))); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Json(Json::Object())); }
  bool start_array(std::size_t) override { return open(Json(Json::Array())); }
  bool key(string_t& value) override {
    keys_.back() = std::move(value);
    return true;
  }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool parse_error(std::size_t, const std::string&,
                   const nlohmann::json::exception& exception) override {
    error = exception.what();
    // "[json.exception.parse_error.101] parse error at line 1, ...": drops the number.
    if (const auto end = error.find("] "); end != std::string::npos) error.erase(0, end + 2);
    return false;
  }

  Json root;
  std::string error;

 private:
  bool open(Json container) {
    if (open_.size() >= kMaxJsonDepth) {
      error = "nested deeper than " + std::to_string(kMaxJsonDepth) + " levels";
      return false;
    }
    open_.push_back(std::move(container));
    keys_.emplace_back();
    return true;
  }
  bool close() {
    Json done = std::move(open_.back());
    open_.pop_back();
    keys_.pop_back();
    return add(std::move(done));
  }
  bool add(Json value) {
    if (open_.empty())
      root = std::move(value);
    else if (Json::Array* array = open_.back().array())
      array->push_back(std::move(value));
    else
      open_.back().object()->emplace_back(std::move(keys_.back()), std::move(value));
    return true;
  }

  std::vector<Json> open_;
  std::vector<std::string> keys_;  // name of the current member of each open object
};

void dump_string(const std::string& text, std::string& out) {
  out += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      constexpr char kHex[] = "0123456789abcdef";
      out += "\\u00";
      out += kHex[c >> 4];
      out += kHex[c & 15];
    } else {
      out += c;
    }
  }
  out += '"';
}

// Writes whole numbers without a decimal point, for readers that expect integers.
void dump_number(double value, std::string& out) {
  char text[32];
  const bool whole = value == std::floor(value) && std::fabs(value) < 9e15;
  const auto end = whole ? std::to_chars(text, text + sizeof text, static_cast<long long>(value))
                         : std::to_chars(text, text + sizeof text, value);
  out.append(text, end.ptr);
}

void dump(const Json& value, std::string& out) {
  if (const bool* boolean = value.boolean()) {
    out += *boolean ? "true" : "false";
  } else if (const double* number = value.number()) {
    dump_number(*number, out);
  } else if (const std::string* string = value.string()) {
    dump_string(*string, out);
  } else if (const Json::Array* array = value.array()) {
    out += '[';
    for (std::size_t i = 0; i < array->size(); ++i) {
      if (i > 0) out += ',';
      dump((*array)[i], out);
    }
    out += ']';
  } else if (const Json::Object* object = value.object()) {
    out += '{';
    for (std::size_t i = 0; i < object->size(); ++i) {
      if (i > 0) out += ',';
      dump_string((*object)[i].first, out);
      out += ':';
      dump((*object)[i].second, out);
    }
    out += '}';
  } else {
    out += "null";
  }
}

std::string short_number(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr};
}

}  // namespace

const Json* Json::find(std::string_view key) const {
  const Object* members = object();
  if (members == nullptr) return nullptr;
  const auto it = std::find_if(members->rbegin(), members->rend(),
                               [&](const auto& member) { return member.first == key; });
  return it == members->rend() ? nullptr : &it->second;
}

const Json* Json::find(std::initializer_list<std::string_view> path) const {
  const Json* here = this;
  for (const std::string_view key : path)
    if (here != nullptr) here = here->find(key);
  return here;
}

const double* Json::number(std::string_view key) const {
  const Json* found = find(key);
  return found == nullptr ? nullptr : found->number();
}

std::span<const Json> Json::list(std::string_view key) const {
  const Json* found = find(key);
  return found == nullptr || found->array() == nullptr ? std::span<const Json>() : *found->array();
}

std::span<Json> Json::list(std::string_view key) {
  Json* found = member(key);
  return found == nullptr || found->array() == nullptr ? std::span<Json>() : *found->array();
}

std::string Json::text(std::string_view key) const {
  const Json* found = find(key);
  return found == nullptr || found->string() == nullptr ? "" : *found->string();
}

std::string Json::name_or(std::size_t i) const {
  const Json* name = find("name");
  return name == nullptr || name->string() == nullptr ? std::to_string(i)
                                                      : in_quotes(*name->string());
}

void Json::copy(const Json& from, std::string_view key, std::string_view as) {
  if (const Json* value = from.find(key)) add(as, *value);
}

std::optional<std::size_t> index_below(const Json* value, std::size_t count) {
  const double* number = value == nullptr ? nullptr : value->number();
  if (number == nullptr || !(*number >= 0 && *number < static_cast<double>(count)) ||
      std::floor(*number) != *number)
    return std::nullopt;
  return static_cast<std::size_t>(*number);
}

Result<Json> parse_json(std::string_view text) {
  Builder builder;
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &builder)) {
    const std::string other = other_kind(std::as_bytes(std::span(text)), FileKind::kLevel);
    if (!other.empty()) return Error(other);
    return Error("is no valid JSON (" + builder.error + "); correct it or export it again");
  }
  return std::move(builder.root);
}

void shorten_names(Json& json) {
  if (std::string* const name = json.string()) shorten(*name);
  if (json.array() != nullptr)
    for (Json& element : *json.array()) shorten_names(element);
  if (json.object() == nullptr) return;
  for (auto& [key, value] : *json.object()) {
    if (key != "uri") shorten_names(value);
    shorten(key);
  }
}

std::string dump_json(const Json& value) {
  std::string out;
  dump(value, out);
  return out;
}

JsonFields::JsonFields(const Json& json, std::string where)
    : json_(json), where_(std::move(where)) {
  if (json.object() == nullptr) fail("must be an object, { ... }");
}

const Json* JsonFields::any(std::string_view key) {
  asked_.emplace_back(key);
  return json_.find(key);
}

std::optional<double> JsonFields::number(std::string_view key, double low, double high) {
  const Json* member = any(key);
  if (member == nullptr) return std::nullopt;
  const double* value = member->number();
  if (value == nullptr) {
    fail(in_quotes(key) + " must be a number");
    return std::nullopt;
  }
  if (!(*value >= low && *value <= high)) {
    fail(in_quotes(key) + " is " + short_number(*value) + " but must be from " + short_number(low) +
         " to " + short_number(high));
    return std::nullopt;
  }
  return *value;
}

std::optional<std::uint64_t> JsonFields::whole_number(std::string_view key, double low,
                                                      double high) {
  const auto value = number(key, low, high);
  if (!value) return std::nullopt;
  if (std::floor(*value) != *value) fail(in_quotes(key) + " must be a whole number");
  return static_cast<std::uint64_t>(*value);
}

std::optional<std::string> JsonFields::string(std::string_view key) {
  const Json* member = any(key);
  if (member == nullptr) return std::nullopt;
  if (member->string() == nullptr) {
    fail(in_quotes(key) + " must be a text in quotes");
    return std::nullopt;
  }
  return *member->string();
}

std::optional<bool> JsonFields::boolean(std::string_view key) {
  const Json* member = any(key);
  if (member == nullptr) return std::nullopt;
  if (member->boolean() == nullptr) {
    fail(in_quotes(key) + " must be true or false");
    return std::nullopt;
  }
  return *member->boolean();
}

std::optional<std::vector<double>> JsonFields::numbers(std::string_view key) {
  const Json* member = any(key);
  if (member == nullptr) return std::nullopt;
  if (const double* one = member->number()) return std::vector<double>{*one};
  std::vector<double> values;
  if (const Json::Array* list = member->array())
    for (const Json& value : *list)
      if (value.number() != nullptr) values.push_back(*value.number());
  if (values.empty() || values.size() != member->array()->size()) {
    fail(in_quotes(key) + " must be a number or a list of numbers");
    return std::nullopt;
  }
  return values;
}

std::optional<Vec3> JsonFields::vector(std::string_view key, double limit) {
  const auto values = numbers(key);
  if (!values) return std::nullopt;
  const bool in_range = std::all_of(values->begin(), values->end(),
                                    [&](double value) { return std::fabs(value) <= limit; });
  if (values->size() != 3 || !in_range) {
    fail(in_quotes(key) + " must be three numbers, [x, y, z], of at most " + short_number(limit));
    return std::nullopt;
  }
  return Vec3((*values)[0], (*values)[1], (*values)[2]);
}

void JsonFields::fail(std::string sentence) {
  if (!sentence.ends_with('.')) sentence += '.';
  if (!error_) error_ = Error(where_ + ": " + std::move(sentence));
}

Result<void> JsonFields::result() const {
  if (error_) return *error_;
  return {};
}

Result<void> JsonFields::result_without_unknown() const {
  if (error_) return *error_;
  for (const auto& [key, value] : *json_.object())
    if (std::find(asked_.begin(), asked_.end(), key) == asked_.end())
      return Error(where_ + ": " + in_quotes(key) + " is not known here; the nearest name is " +
                   in_quotes(nearest_name(key, asked_)) + ".");
  return {};
}

Result<Json> read_json(const std::string& path) {
  const auto bytes = read_whole_file(path);
  if (!bytes.ok()) return bytes.error();
  auto json = parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!json.ok()) return Error(path + ": " + json.error().message + ".");
  return json;
}

}  // namespace clamor
