// level_extent.h: tells places outside of a bake's level. A listener or a source there is usually a
// mistake: other units, other axes, or the coordinates of another level.
//
// The level extends to the bounds of its surfaces and emitters, if no sound leaves it. Otherwise
// one may well be above it or in front of it: it extends further by the diagonal of the bounds.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/bounds.h"
#include "common/vec.h"

namespace clamor {

class BakeFile;
struct Mesh;

class LevelExtent {
 public:
  LevelExtent() = default;  // nothing is outside
  // `mesh` has the file's surfaces; without any, nothing is outside.
  LevelExtent(const BakeFile& file, const Mesh& mesh);

  // A sentence "THING at X,Y,Z is outside the level, ...", without full stop, if that place of the
  // world is outside.
  std::optional<std::string> complaint(std::string_view thing, const Vec3& place_m) const;

 private:
  Bounds bounds_{};      // in the world
  double margin_m_ = 0;  // beyond them, that still counts as inside
};

}  // namespace clamor
