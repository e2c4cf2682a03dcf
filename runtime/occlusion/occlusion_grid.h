// occlusion_grid.h: what looks at sources say of their neighbours.
//
// Sources that lie side by side on one wall are heard much alike, so a look at one tells something
// of the others, which may be a thousand. Space is divided into cubes, finer near the listener, and
// each cube by the side its walls face: then what is behind a thin wall is never taken for what is
// before it. A cell keeps two means of what looks found, newer ones counting more: of sources whose
// straight line to the listener was free, and of those where it was not. Which of them a source is
// takes one ray to know.
//
// What was seen from elsewhere fades as the listener walks on; and at once when looks find what was
// not expected, as they do when the listener steps through a door: then everything is different in
// the same moment, and the few looks since then speak for many, in cells of up to eight times the
// size.
//
// Threads: the sampler's alone.   Memory: 96 bytes per cell, of which there are some thousands.
#pragma once

#include <cstdint>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"

namespace clamor {

class OcclusionGrid {
 public:
  OcclusionGrid();

  // A look at a source from `place` found that much.
  void add(const Source& source, const Vec3& place, bool straight, const Bands& visibility,
           std::uint32_t keyframe);

  // The mean of a source's neighbours of its kind, the nearer ones or, if need be, those from afar;
  // false if not enough is known.
  struct Mean {
    Bands visibility{};
    std::uint32_t keyframe = 0;  // of the newest look
  };
  bool mean(const Source& source, const Vec3& place, bool straight, bool from_afar,
            Mean& mean) const;

  // Looks found visibilities that differ by that much, on average, from what was believed.
  void invalidate_on_change(double by);

  // A clock that change_clock turn: what was seen more than one tick ago is of another world.
  double change_clock() const { return surprises_; }

  // Was a neighbour looked at in this keyframe?
  bool is_of(std::uint32_t keyframe, const Source& source, const Vec3& place) const;

 private:
  struct Kind {
    float weight = 0;  // looks, as far as they still count
    Bands sum{};
  };
  struct Cell {
    std::uint64_t key = 0;  // 0: free
    Vec3f from_m{};         // where the listener was
    std::uint32_t keyframe = 0;
    float change_clock = 0;
    Kind kinds[2];
  };

  Cell& find_or_add(std::uint64_t key, std::uint32_t keyframe);
  const Cell* find(std::uint64_t key) const;
  float kept(const Cell& cell, const Source& source, const Vec3& place) const;
  void grow(std::uint32_t keyframe);

  std::vector<Cell> table_;  // open addressing, a power of two
  std::size_t cells_ = 0;
  double surprises_ = 0, expected_ = 0;
};

}  // namespace clamor
