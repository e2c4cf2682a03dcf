#include "tools/commands/places_file.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "common/printable.h"
#include "common/system_reason.h"
#include "common/text.h"
#include "common/utf8_path.h"
#include "formats/level/level_origin.h"
#include "tools/program/arguments.h"

namespace clamor {

namespace {

constexpr std::size_t kLongestName = 200;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const auto begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) + 1 - begin);
}

// The comma before the name, or the end.
std::size_t end_of_numbers(std::string_view line) {
  std::size_t comma = line.find(',');
  for (int i = 0; i < 2 && comma != std::string_view::npos; ++i) comma = line.find(',', comma + 1);
  return std::min(comma, line.size());
}

// Names become file names.
bool is_name(std::string_view name) {
  return !name.empty() && name.size() <= kLongestName && name.front() != '.' &&
         name.find_first_of("/\\,\"") == std::string_view::npos && printable(name) == name;
}

Result<NamedPlace> read_place(std::string_view line) {
  const std::size_t end = end_of_numbers(line);
  std::string numbers(line.substr(0, end));
  std::erase_if(numbers, [](char letter) { return letter == ' ' || letter == '\t'; });
  const auto listener = parse_listener(numbers);
  if (!listener.ok())
    return Error(in_quotes(line) + " is not X,Y,Z or X,Y,Z,NAME in metres, as in 0,1.7,3");
  NamedPlace place{listener->position_m,
                   std::string(trimmed(line.substr(std::min(end + 1, line.size()))))};
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::abs(place.at_m[axis]) <= kMaxWorldCoordinate_m))
      return Error(in_quotes(line) + " is more than 100 000 km from the origin");
  if (end < line.size() && !is_name(place.name))
    return Error(
        fmt::format("{} cannot be a name: it names a file, so it has 1 to {} letters, "
                    "neither / \\ , \" nor control characters, and no dot in front",
                    in_quotes(place.name), kLongestName));
  return place;
}

bool is_header(std::string_view line) {
  return equal_ignoring_case(trimmed(line.substr(0, line.find(','))), "x");
}

}  // namespace

Result<std::vector<NamedPlace>> read_places(const std::string& path) {
  std::ifstream file(path_of(path), std::ios::binary);
  std::vector<NamedPlace> places;
  std::string text;
  for (std::size_t number = 1; std::getline(file, text); ++number) {
    std::string_view line = text;
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
    line = trimmed(line);
    if (line.empty() || line.front() == '#' || (places.empty() && is_header(line))) continue;
    auto place = read_place(line);
    if (!place.ok()) return place.error().in(fmt::format("{}: line {}", path, number));
    places.push_back(std::move(*place));
  }
  if (!file.eof()) return Error(path + ": cannot be read: " + system_reason(errno));
  if (places.empty()) return Error(path + ": has no place; write a line X,Y,Z for each");
  return places;
}

Result<void> complete_names(std::vector<NamedPlace>& places) {
  const std::size_t digits = std::to_string(places.size()).size();
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < places.size(); ++i) {
    NamedPlace& place = places[i];
    if (place.name.empty()) place.name = fmt::format("{:0{}}", i + 1, digits);
    if (!names.insert(place.name).second)
      return Error("two places have the name " + in_quotes(place.name) +
                   "; give each its own, or none");
  }
  return {};
}

}  // namespace clamor
