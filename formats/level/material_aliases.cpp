#include "formats/level/material_aliases.h"

#include <algorithm>

namespace clamor {

namespace {

constexpr int kThing = 0, kSubstance = 1, kTreatment = 2;
constexpr std::size_t kNoEnd = 0;  // no alias ends where a name begins

// The end of an alias's words if they are in the name at `at`, else kNoEnd.
std::size_t end_of(std::string_view words, const NameLetters& name, std::size_t at) {
  const std::size_t space = words.find(' ');
  const bool is_last = space == words.npos;
  std::string_view word = words.substr(0, space);
  const bool any_end = word.ends_with('*');
  if (any_end) word.remove_suffix(1);
  if (name.letters.compare(at, word.size(), word) != 0) return kNoEnd;
  const std::size_t end = at + word.size();
  if (is_last && any_end) return end;
  for (const std::string_view plural : {"", "s", "es"}) {
    const std::size_t next = end + plural.size();
    if (name.letters.compare(end, plural.size(), plural) != 0) continue;
    if (is_last && name.begins[next]) return next;
    if (!is_last)
      if (const std::size_t last = end_of(words.substr(space + 1), name, next); last != kNoEnd)
        return last;
  }
  if (is_last || !any_end) return kNoEnd;
  std::size_t next = end;
  while (!name.begins[next]) ++next;
  return end_of(words.substr(space + 1), name, next);
}

}  // namespace

struct MaterialAliases::Place {
  std::size_t begin, end, preset;
  int rank;
};

void MaterialAliases::add(std::string_view words, std::size_t preset) {
  const auto takes = [&](char mark) {
    const bool is_there = words.starts_with(mark);
    if (is_there) words.remove_prefix(1);
    return is_there;
  };
  const int rank = takes('~') ? kThing : takes('!') ? kTreatment : kSubstance;
  const bool any_beginning = takes('*');
  if (words.empty()) return;
  aliases_[static_cast<unsigned char>(words[0])].push_back({words, preset, rank, any_beginning});
}

std::vector<MaterialAliases::Place> MaterialAliases::places_in(const NameLetters& name) const {
  std::vector<Place> places;
  for (std::size_t at = 0; at < name.letters.size(); ++at)
    for (const Alias& alias : aliases_[static_cast<unsigned char>(name.letters[at])]) {
      if (!name.begins[at] && !alias.any_beginning) continue;
      if (const std::size_t end = end_of(alias.words, name, at); end != kNoEnd)
        places.push_back({at, end, alias.preset, alias.rank});
    }
  // The longest first, then the last.
  std::ranges::stable_sort(places, [](const Place& a, const Place& b) {
    const std::size_t length_a = a.end - a.begin, length_b = b.end - b.begin;
    return length_a != length_b ? length_a > length_b : a.end > b.end;
  });
  std::vector<Place> apart;
  for (const Place& place : places)
    if (std::ranges::none_of(apart, [&](const Place& taken) {
          return place.begin < taken.end && taken.begin < place.end;
        }))
      apart.push_back(place);
  return apart;
}

MaterialAliases::Match MaterialAliases::find(std::string_view name,
                                             const std::vector<bool>& absorbs) const {
  Match match;
  int rank = -1;
  for (const Place& place : places_in(letters_of(name))) {
    if (place.preset == kNothing || place.rank < rank) continue;
    if (place.rank > rank) match = {place.preset, {}};
    rank = place.rank;
    if (!match.doubt && absorbs[place.preset] != absorbs[match.preset]) match.doubt = place.preset;
  }
  return match;
}

}  // namespace clamor
