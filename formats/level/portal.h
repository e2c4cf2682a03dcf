// portal.h: a rectangle in an opening, such as a doorway, that sound passes through.
//
// The game sets how open a portal is at run time. The bake therefore records which portals the path
// of each secondary source has passed, in either direction.
#pragma once

#include <algorithm>
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/vec.h"

namespace clamor {

inline constexpr std::size_t kMaxPortals = 1024;

// The points centre + a half_u + b half_v, a and b in [-1, 1].
struct Portal {
  std::string name;
  Vec3 centre_m{};
  Vec3 half_u_m{}, half_v_m{};  // neither zero nor parallel
  // The bake also traces the level with its rectangle as a surface.
  bool is_baked_closed = false;
  // The movable parts that open and close it, by their index in the level (portal_coupling.h).
  std::vector<std::uint16_t> parts{};

  bool operator==(const Portal&) const = default;
};

// The portals that a path has passed. A path that passes more than four counts as having passed the
// first four.
//
// Where portals are baked closed, too, there are two states of the level: with all of these open,
// and with all of them closed. The set then also holds the state that its path belongs to, in place
// of a portal.
struct PortalSet {
  static constexpr std::size_t kMaxPortalsOfPath = 4;
  static constexpr std::uint16_t kStateOpen = 0x4000, kStateClosed = 0x8000;  // above all numbers

  // Indices + 1 of portals, then the state, ascending; then zeros.
  std::array<std::uint16_t, kMaxPortalsOfPath> numbers{};

  bool is_empty() const { return numbers[0] == 0; }
  std::size_t size() const {
    std::size_t count = 0;
    while (count < numbers.size() && numbers[count] != 0) ++count;
    return count;
  }
  bool has_state(std::uint16_t state) const {
    return std::find(numbers.begin(), numbers.end(), state) != numbers.end();
  }
  // Calls visit(index) for each portal.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const std::uint16_t number : numbers)
      if (number != 0 && number < kStateOpen) visit(static_cast<std::size_t>(number - 1));
  }

  static PortalSet of_state(std::uint16_t state) { return {{state, 0, 0, 0}}; }

  void add(std::size_t portal) { add_number(static_cast<std::uint16_t>(portal + 1)); }
  void add_number(std::uint16_t number) {
    const std::size_t count = size();
    for (std::size_t i = 0; i < count; ++i)
      if (numbers[i] == number) return;
    if (count == numbers.size()) return;
    std::size_t place = count;
    for (; place > 0 && numbers[place - 1] > number; --place) numbers[place] = numbers[place - 1];
    numbers[place] = number;
  }

  // Whether the numbers are ascending and name portals below `count`.
  bool is_valid(std::size_t count) const {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const bool is_state = numbers[i] == kStateOpen || numbers[i] == kStateClosed;
      if (numbers[i] > count && !is_state) return false;
      if (i > 0 && numbers[i] != 0 && numbers[i] <= numbers[i - 1]) return false;
      if (i > 0 && numbers[i] != 0 && numbers[i - 1] == 0) return false;
    }
    return true;
  }

  auto operator<=>(const PortalSet&) const = default;
};
static_assert(sizeof(PortalSet) == 8);

// Whether the half vectors span a rectangle of a size that sound can pass: 1 cm to 1000 km, and not
// much skewed.
bool is_rectangle(const Portal& portal);

// The rectangle of this size that faces a direction, which must have a length. A side of it is
// horizontal, unless it faces up or down: then that is along x.
Portal facing_portal(const Vec3& centre_m, const Vec3& facing, double width_m, double height_m);

// The direction that a rectangle faces, of unit length.
Vec3 normal_of(const Portal& portal);

// Whether the straight line between two places passes the rectangle.
bool passes(const Portal& portal, const Vec3& from_m, const Vec3& to_m);

}  // namespace clamor
