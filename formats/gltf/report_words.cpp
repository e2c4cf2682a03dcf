#include "formats/gltf/report_words.h"

#include <algorithm>

#include <fmt/format.h>

#include "common/result.h"

namespace clamor {

namespace {

constexpr std::size_t kShownNames = 3;

}  // namespace

std::string plural_of(std::string_view thing) {
  for (const char* link : {" of ", " to ", " for "})
    if (const std::size_t at = thing.find(link); at != std::string_view::npos)
      return plural_of(thing.substr(0, at)) + std::string(thing.substr(at));
  if (thing == "sky") return "skies";
  return fmt::format("{}{}", thing, thing.ends_with("sh") || thing.ends_with("x") ? "es" : "s");
}

std::string number_of(std::size_t count, std::string_view thing) {
  return fmt::format("{} {}", count, count == 1 ? std::string(thing) : plural_of(thing));
}

std::string first_names(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kShownNames); ++i)
    text += (i > 0 ? ", " : "") + in_quotes(names[i]);
  return text + and_more(names.size() - std::min(names.size(), kShownNames));
}

std::string and_more(std::size_t count) {
  return count == 0 ? "" : fmt::format(" and {} more", count);
}

}  // namespace clamor
