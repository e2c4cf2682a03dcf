#include "formats/bake_file/level_extent.h"

#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/enclosure.h"
#include "formats/level/emitter.h"
#include "formats/level/level_origin.h"
#include "formats/level/mesh.h"

namespace clamor {

LevelExtent::LevelExtent(const BakeFile& file, const Mesh& mesh) {
  if (mesh.triangles.empty()) return;
  constexpr double kRounding_m = 0.01;  // of corners in the file
  const Boundsf surfaces = bounds_of(mesh);
  bounds_.add(Vec3(surfaces.low_m) + file.origin_m());
  bounds_.add(Vec3(surfaces.high_m) + file.origin_m());
  for (const Emitter& emitter : file.emitters()) bounds_.add(emitter.position_m + file.origin_m());
  margin_m_ = kRounding_m;
  if (enclosure_of(file.statistics().findings) != Enclosure::kClosed)
    margin_m_ += bounds_.diagonal_m();
}

std::optional<std::string> LevelExtent::complaint(std::string_view thing,
                                                  const Vec3& place_m) const {
  if (bounds_.is_empty() || bounds_.distance2_m2(place_m) <= margin_m_ * margin_m_)
    return std::nullopt;
  return std::string(thing) + " at " + place_in_words(place_m) +
         " is outside the level, which lies between " + place_in_words(bounds_.low_m) + " and " +
         place_in_words(bounds_.high_m) + "; positions are metres with +Y up";
}

}  // namespace clamor
