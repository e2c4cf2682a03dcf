// sight_cells.h: what looks at sources say of their neighbours.
//
// Sources that lie side by side on one wall are heard much alike, so a look at one tells something
// of the others, which may be a thousand. Space is divided into cubes, finer near the listener, and
// each cube by the side its walls face: then what is behind a thin wall is never taken for what is
// before it. A cell keeps two means of what looks found, newer ones counting more: of sources whose
// straight line to the listener was free, and of those where it was not. Which of them a source is
// takes one ray to know.
//
// What was seen from elsewhere fades as the listener walks on.
//
// Threads: the sampler's alone.   Memory: 96 bytes per cell, of which there are some thousands.
#pragma once

#include <cstdint>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/source.h"

namespace clamor {

class SightCells {
 public:
  SightCells();

  // A look at a source from `place` found that much.
  void add(const Source& source, const Vec3& place, bool straight, const Bands& visibility,
           std::uint32_t keyframe);

  // The mean of a source's neighbours of its kind; false if not enough is known.
  struct Mean {
    Bands visibility{};
    std::uint32_t keyframe = 0;  // of the newest look
  };
  bool mean(const Source& source, const Vec3& place, bool straight, Mean& mean) const;

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
    Kind kinds[2];
  };

  Cell& find_or_add(std::uint64_t key, std::uint32_t keyframe);
  const Cell* find(std::uint64_t key) const;
  void grow(std::uint32_t keyframe);

  std::vector<Cell> table_;  // open addressing, a power of two
  std::size_t cells_ = 0;
};

}  // namespace clamor
