#include "formats/level/emitter_spec.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/maths.h"
#include "common/name_length.h"
#include "common/text.h"
#include "formats/level/acoustic_values.h"
#include "formats/level/level_origin.h"

namespace clamor {

namespace {

constexpr const char* kExample = "as in \"signal=violin.flac,at=1,1.2,-3\"";

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

std::optional<double> number(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::optional<std::vector<double>> numbers(std::string_view text) {
  std::vector<double> values;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto value = number(text.substr(begin, end - begin));
    if (!value) return std::nullopt;
    values.push_back(*value);
    begin = end + 1;
  }
  return values;
}

struct Field {
  std::string key, value;
};

bool begins_field(std::string_view piece) {
  const auto equals = piece.find('=');
  if (equals == std::string_view::npos) return false;
  const auto key = trimmed(piece.substr(0, equals));
  return !key.empty() && std::all_of(key.begin(), key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  });
}

std::vector<Field> split(std::string_view text) {
  std::vector<Field> fields;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto piece = text.substr(begin, end - begin);
    if (begins_field(piece)) {
      const auto equals = piece.find('=');
      fields.push_back(
          {std::string(trimmed(piece.substr(0, equals))), std::string(piece.substr(equals + 1))});
    } else if (fields.empty()) {
      fields.push_back({"", std::string(piece)});
    } else {
      fields.back().value += "," + std::string(piece);
    }
    begin = end + 1;
  }
  for (Field& field : fields) field.value = trimmed(field.value);
  return fields;
}

Result<Vec3> parse_vector(const Field& field) {
  const auto values = numbers(field.value);
  const bool ok = values && values->size() == 3 &&
                  std::all_of(values->begin(), values->end(),
                              [](double v) { return std::fabs(v) <= kMaxWorldCoordinate_m; });
  if (!ok)
    return Error(fmt::format("{}={} must be three numbers of at most 1e8, {}=X,Y,Z.", field.key,
                             field.value, field.key));
  return Vec3((*values)[0], (*values)[1], (*values)[2]);
}

Result<double> parse_seconds(const Field& field) {
  const auto value = number(field.value);
  if (!value || *value < 0 || *value > kMaxDelay_s)
    return Error(
        fmt::format("{}={} must be seconds from 0 to {}.", field.key, field.value, kMaxDelay_s));
  return *value;
}

constexpr std::array<const char*, 9> kKeys = {
    "name", "signal", "at", "facing", "gain", "directivity", "delay", "random_delay", "loop"};

// Words of other programs for these fields.
constexpr std::array<std::pair<std::string_view, const char*>, 13> kSynonyms = {
    {{"position", "at"},
     {"pos", "at"},
     {"place", "at"},
     {"location", "at"},
     {"direction", "facing"},
     {"orientation", "facing"},
     {"volume", "gain"},
     {"level", "gain"},
     {"sound", "signal"},
     {"file", "signal"},
     {"source", "signal"},
     {"wav", "signal"},
     {"id", "name"}}};

// The field that was meant.
std::string meant_by(const std::string& word) {
  for (const auto& [synonym, key] : kSynonyms)
    if (equal_ignoring_case(word, synonym)) return key;
  static const std::vector<std::string> keys(kKeys.begin(), kKeys.end());
  return nearest_name(word, keys);
}

Result<void> set(EmitterSpec& spec, const Field& field) {
  const auto& [key, value] = field;
  if (key == "name" || key == "signal") {
    if (value.empty()) return Error(key + "= is empty; write " + key + "=violin or the like.");
    if (key == "name" && value.size() > kMaxNameBytes)
      return Error(
          fmt::format("name= has {} bytes; give at most {}.", value.size(), kMaxNameBytes));
    (key == "name" ? spec.name : spec.signal) = value;
  } else if (key == "at" || key == "facing") {
    const auto vector = parse_vector(field);
    if (!vector.ok()) return vector.error();
    if (key == "at") {
      spec.at_m = *vector;
    } else {
      if (!(length(*vector) > 0))
        return Error("facing=0,0,0 is no direction; write facing=0,0,-1 or the like.");
      spec.facing = normalize(*vector);
    }
  } else if (key == "gain") {
    const auto gain = parse_gain(value);
    if (!gain.ok()) return gain.error();
    spec.gain = *gain;
  } else if (key == "directivity") {
    const auto values = numbers(value);
    if (!values)
      return Error("directivity=" + value + " must be one exponent or eight, one per band.");
    const auto bands = bands_from_values(*values, {}, 0, kMaxDirectivity);
    if (!bands.ok()) return Error("directivity=" + value + " " + bands.error().message + ".");
    spec.directivity = *bands;
  } else if (key == "delay" || key == "random_delay") {
    const auto seconds = parse_seconds(field);
    if (!seconds.ok()) return seconds.error();
    (key == "delay" ? spec.delay_s : spec.random_delay_s) = *seconds;
  } else if (key == "loop") {
    if (value != "yes" && value != "no")
      return Error("loop=" + value + " must be loop=yes or loop=no.");
    spec.loop = value == "yes";
  } else {
    const std::string& word = key.empty() ? value : key;
    return Error(in_quotes(word) + " is no field of an emitter; the nearest is " +
                 in_quotes(meant_by(word)) + ", " + kExample + ".");
  }
  return {};
}

}  // namespace

Result<double> parse_gain(std::string_view text, double greatest) {
  std::string_view digits = trimmed(text);
  const bool in_db =
      digits.size() > 2 && equal_ignoring_case(digits.substr(digits.size() - 2), "dB");
  const bool is_factor = digits.starts_with('x') || digits.starts_with('X');
  if (in_db) digits.remove_suffix(2);
  if (is_factor) digits.remove_prefix(1);
  const auto value = number(digits);
  const std::string what = "gain " + in_quotes(text);
  if (value && in_db == is_factor) {
    if (*value < 0)
      return Error(fmt::format("{} could only be decibels; write {}dB.", what, digits));
    return Error(
        fmt::format("{} could be decibels or a factor; write {}dB or x{}.", what, digits, digits));
  }
  const double gain = !value ? -1 : in_db ? power(10, *value / 20) : *value;
  if (!(gain >= 0 && gain <= greatest * (1 + 1e-9)))  // 200 dB may be rounded to more than 1e10
    return Error(
        fmt::format("{} must be decibels of at most {:.0f}, as in -6dB, or a factor from 0 to "
                    "{:.0f}, as in x0.5.",
                    what, 20 * log2_of(greatest) / log2_of(10.0), greatest));
  return std::min(gain, greatest);
}

Result<EmitterSpec> parse_emitter(std::string_view text) {
  const auto failed = [&](const std::string& what) {
    return Error("emitter \"" + std::string(text.substr(0, 300)) + "\": " + what);
  };
  EmitterSpec spec;
  std::vector<std::string> seen;
  for (const Field& field : split(text)) {
    if (std::find(seen.begin(), seen.end(), field.key) != seen.end())
      return failed(field.key + "= is given twice; give it once.");
    if (const auto ok = set(spec, field); !ok.ok()) return failed(ok.error().message);
    seen.push_back(field.key);
  }
  for (const char* needed : {"signal", "at"})
    if (std::find(seen.begin(), seen.end(), needed) == seen.end())
      return failed(std::string(needed) +
                    "= is missing; give signal= (a sound file, impulse or "
                    "noise) and at= (x, y, z in metres), " +
                    kExample + ".");
  return spec;
}

}  // namespace clamor
