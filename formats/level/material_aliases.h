// material_aliases.h: the words by which a material is known from its name
// (assets/material_names.txt).
//
// An alias is a run of words, as in "wood floor*", in the letters of name_match.h. Its words may be
// joined in the name ("WoodFloor", "woodfloor"), the last may have a plural s or es, and * stands
// for the rest of a word, or at the beginning of an alias for its beginning ("*beton*" is in
// "Stahlbetonwand"). Aliases have ranks:
//
//   !perforated   a treatment, which decides whatever it is a treatment of
//   concrete      a substance
//   ~table        a thing, which says little of what it is made of
//
// The longest alias in a name takes its letters, so that "stone wool" leaves no stone, then the
// longest in the rest, and so on. Of those, the best rank counts, and in it the longest alias, the
// last of equals. If others of that rank are of the opposite kind, which absorbs where it reflects
// or the other way round, the name is in doubt.
//
// Programs that start for one level pay for the whole table, so aliases are kept as they are
// written, by their first byte: adding one costs as much as pushing it into a vector.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/level/name_match.h"

namespace clamor {

class MaterialAliases {
 public:
  // A preset without a place in the list: names that mean no material ("ice cream").
  static constexpr std::size_t kNothing = static_cast<std::size_t>(-1);

  // `alias` must outlive this object.
  void add(std::string_view alias, std::size_t preset);

  struct Match {
    std::size_t preset = kNothing;
    std::optional<std::size_t> doubt;  // another preset, of the opposite kind
  };
  // `absorbs` tells the kind of each preset.
  Match find(std::string_view name, const std::vector<bool>& absorbs) const;

 private:
  struct Alias {
    std::string_view words;
    std::size_t preset;
    int rank;
    bool any_beginning;
  };
  struct Place;
  std::vector<Place> places_in(const NameLetters& name) const;

  std::array<std::vector<Alias>, 256> aliases_;  // by first byte
};

}  // namespace clamor
