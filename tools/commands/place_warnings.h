// place_warnings.h: warns of a listener who hears nothing of a bake or is outside its level, and of
// moving sources that are outside or without their room, and says why.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>

#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/level_extent.h"
#include "formats/level/mesh.h"
#include "formats/level/walk_file.h"
#include "runtime/engine/auralizer_options.h"

namespace clamor {

class Audibility;
class MovingScript;
class Scene;

// Judges places of a bake, whose geometry it reads once. If that fails, it has no complaint,
// because the caller reports the failure when it reads the geometry itself.
class PlaceCheck {
 public:
  // Without occlusion, only distance makes a listener hear nothing, and nothing is outside. The
  // file must outlive the object.
  PlaceCheck(const BakeFile& file, bool with_occlusion);
  ~PlaceCheck();

  struct Query {
    double seconds = 0;                    // the part of the walk that is checked
    std::optional<std::size_t> emitter{};  // only this emitter sounds; unset: all
    bool with_moving_sources = false;      // which may be heard wherever no emitter is
  };
  // A sentence, or nothing if something is heard all along the walk, which is tested at up to 33
  // positions, and all of it is inside.
  std::optional<std::string> listener_warning(const Walk& walk, const Query& query);

  // A sentence about the first source of a script that is outside in its first `seconds`; 0: all.
  std::optional<std::string> source_warning(const MovingScript& script, double seconds) const;

 private:
  const BakeFile& file_;
  bool is_readable_ = true;
  Mesh mesh_;
  LevelExtent extent_;
  std::unique_ptr<Scene> scene_;  // made when it is first needed
  std::unique_ptr<Audibility> audibility_;
};

// Prints the warnings of a walk, and of the script that moves sources. `seconds` as above.
void print_place_warnings(const BakeFile& file, const Walk& walk, double seconds,
                          const AuralizerOptions& options, std::ostream& err);

}  // namespace clamor
