// occlusion_grid.h: mean visibility of neighbouring sources, from the estimates made so far.
//
// Sources side by side on one wall have similar visibilities, so an estimate for one predicts those
// of up to a thousand neighbours. The grid divides space into cubes, finer near the listener, and
// each cube by the side its walls face: sources behind a thin wall never stand for those in front.
// A cell keeps two running means, of sources whose straight line to the listener is free and of
// those where it is blocked. One ray tells which mean applies to a source.
//
// Estimates lose weight as the listener walks on, and all at once when new estimates differ from
// predictions, as they do when the listener steps through a door. The few estimates made since then
// predict for many sources, in cells of up to eight times the size.
//
// Threads: the sampler's alone.   Memory: 96 bytes per cell, a few thousand cells.
#pragma once

#include <cstdint>

#include "common/bands.h"
#include "common/flat_hash_map.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"

namespace clamor {

class OcclusionGrid {
 public:
  OcclusionGrid();

  // Adds an estimate for a source, made from `place`. Estimates of its neighbours from before the
  // keyframe `valid_from` count no more.
  void add(std::uint64_t number, const Source& source, const Vec3& place, bool line_is_free,
           const Bands& visibility, std::uint32_t keyframe, std::uint32_t valid_from = 0);

  // How far from a source its neighbours may be: in its own cell, in the next larger one as well,
  // or in all four sizes of cells.
  enum class Reach { kCell, kNear, kAfar };

  struct Mean {
    Bands visibility{};
    std::uint32_t keyframe = 0;  // of the newest estimate,
    std::uint64_t number = 0;    // and its source
  };
  // Finds the mean of a source's neighbours with the same `line_is_free`. Returns false where too
  // little is known.
  bool mean(const Source& source, const Vec3& place, bool line_is_free, Reach reach,
            Mean& mean) const;

  // Takes the mean error of a keyframe's predictions, and invalidates the grid where it is far
  // above the usual one.
  void invalidate_on_change(double mean_error);

  // Counts changes of the whole scene: what was stored more than one unit ago is invalid.
  double change_clock() const { return change_clock_; }

 private:
  struct RunningMean {
    float weight = 0;  // number of estimates, each reduced by age
    Bands sum{};
    std::uint64_t newest = 0;  // source of the newest estimate
  };
  struct Cell {
    Vec3f from_m{};  // the listener, at the last estimate
    std::uint32_t keyframe = 0;
    float change_clock = 0;
    RunningMean means[2];  // line blocked, line free
  };

  Cell& find_or_add(std::uint64_t key, std::uint32_t keyframe);
  float remaining_weight(const Cell& cell, const Source& source, const Vec3& place) const;

  FlatHashMap<Cell> cells_;
  double change_clock_ = 0, usual_error_ = 0;
};

}  // namespace clamor
