#include "formats/level/material_aliases.h"

#include <algorithm>
#include <sstream>

namespace clamor {

namespace {

constexpr int kThing = 0, kSubstance = 1, kTreatment = 2;
constexpr std::size_t kNoEnd = 0;  // no alias ends where a name begins

}  // namespace

struct MaterialAliases::Place {
  std::size_t begin, end, preset;
  int rank;
};

void MaterialAliases::add(std::string_view text, std::size_t preset) {
  Alias alias{{}, preset, kSubstance};
  if (text.starts_with('~')) alias.rank = kThing;
  if (text.starts_with('!')) alias.rank = kTreatment;
  if (alias.rank != kSubstance) text.remove_prefix(1);
  std::istringstream words{std::string(text)};
  for (std::string word; words >> word;)
    if (std::string letters = letters_of(word).letters; !letters.empty())
      alias.words.push_back({std::move(letters), word.starts_with('*'), word.ends_with('*')});
  if (!alias.words.empty()) aliases_.push_back(std::move(alias));
}

// The end of the alias's words from `word` on if they are in the name at `at`, else kNoEnd.
std::size_t MaterialAliases::end_of(const Alias& alias, std::size_t word, const NameLetters& name,
                                    std::size_t at) {
  const Word& wanted = alias.words[word];
  if (name.letters.compare(at, wanted.letters.size(), wanted.letters) != 0) return kNoEnd;
  const std::size_t end = at + wanted.letters.size();
  const bool is_last = word + 1 == alias.words.size();
  if (is_last && wanted.any_end) return end;
  for (const std::string_view plural : {"", "s", "es"}) {
    const std::size_t next = end + plural.size();
    if (name.letters.compare(end, plural.size(), plural) != 0) continue;
    if (is_last && name.begins[next]) return next;
    if (!is_last)
      if (const std::size_t last = end_of(alias, word + 1, name, next); last != kNoEnd) return last;
  }
  if (is_last || !wanted.any_end) return kNoEnd;
  std::size_t next = end;
  while (!name.begins[next]) ++next;
  return end_of(alias, word + 1, name, next);
}

std::vector<MaterialAliases::Place> MaterialAliases::places_in(const NameLetters& name) const {
  std::vector<Place> places;
  for (const Alias& alias : aliases_)
    for (std::size_t at = 0; at < name.letters.size(); ++at) {
      if (!name.begins[at] && !alias.words[0].any_beginning) continue;
      if (const std::size_t end = end_of(alias, 0, name, at); end != kNoEnd)
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
