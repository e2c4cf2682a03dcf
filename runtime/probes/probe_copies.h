// probe_copies.h: the copies of probes' trees that a keyframe's moving sources are heard through.
//
// Each moving source is heard through up to eight probes (probe_neighbours.h) and their zones. Each
// of these copies holds the secondary sources of a tree, moved to the source's place
// (probe_sources.h), with its signal, gain and directivity.
//
// Copies must not choose alike, or a crowd near one probe would be heard from one wall. As in
// instance.h, each copy has one representative, drawn with a probability in proportion to its
// power, whose permanent number is v P_i / P, with v the copy's own number and P the power of the
// tree; every other source has P_i / P + (1 - P_i / P) u. Each number is uniform by itself, keys of
// other sources only fall, and a crowd far away is sampled by its representatives, which are
// independent.
//
// Where many sources share a tree, that is not enough: of 150 sources with two voices each, those
// reflections that are near the listener would still be chosen by all or by none. A copy that is
// one of a crowd therefore holds only one in 2^n of the tree's sources, each with 2^n times its
// power; which ones, hashes of the copy's and the source's numbers decide. The powers of all copies
// of a crowd become much alike by that, too.
//
// Threads: the sampler's alone.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/vec.h"
#include "formats/bake_file/page_links.h"
#include "runtime/probes/probe_neighbours.h"
#include "runtime/streaming/resident_page.h"

namespace clamor {

// A moving source heard through a tree.
struct ProbeCopy {
  std::uint32_t tree = 0, slot = 0;
  float factor = 0;                  // of upper bounds, now
  float loudness = 0;                // of the signal at any time, with the weight
  float weight = 0;                  // of the tree
  float u = 1;                       // v
  std::uint32_t level = 0;           // it holds one in 2^level sources
  std::uint32_t hash = 0;            // decides which: those whose first `level` bits agree
  std::uint32_t representative = 0;  // index in the top page
  double draw = 0;                   // decides the representative, in [0, 1)

  float scale() const { return static_cast<float>(std::uint32_t{1} << level); }  // of powers
};

class ProbeCopies {
 public:
  // Copies of a tree that have one level, by hash.
  struct Crowd {
    std::uint32_t level = 0, first_copy = 0, copy_count = 0;
    float factor = 0;  // the highest
  };
  struct Tree {
    const PageEntry* entry = nullptr;  // of the top
    std::optional<Vec3> probe_m;       // none: the late reflections of a zone
    std::uint64_t first_source = 0;    // its number
    double power = 0;                  // of the tree
    std::uint32_t first_copy = 0, copy_count = 0, first_crowd = 0, crowd_count = 0;
    float factor = 0;                   // the highest of a copy
    double loudness = 0;                // of all copies
    double missing_key = 0;             // of the last query
    const ResidentPage* top = nullptr;  // the page; null: it is missing
    // The page's sources divide the tree's power among them; these are the ends of their shares, in
    // the order of their hashes.
    std::vector<std::uint32_t> order;
    std::vector<double> share_ends;
  };

  // The trees of places, then those of zones. `probes` must outlive the object.
  explicit ProbeCopies(const StoredProbes& probes);

  // Begins a keyframe, without copies.
  void begin();
  // Adds the copies of a moving source through the trees round it. The factor of upper bounds is
  // `factor` now, and `at_any_time` times as high at any time.
  void add(std::size_t slot, std::uint32_t generation, std::span<const ProbeWeight> probes,
           float factor, float at_any_time);
  // Thins crowds, after all copies were added, and sorts the copies.
  void finish();
  // Draws the representatives of a tree's copies from its top page; null: it is missing.
  void draw_representatives(Tree& tree, const ResidentPage* top);

  const std::vector<Tree>& trees() const { return trees_; }
  Tree& tree(std::uint32_t index) { return trees_[index]; }
  std::span<const std::uint32_t> active() const { return active_; }  // trees with copies
  std::span<const ProbeCopy> of(const Tree& tree) const {
    return std::span(copies_).subspan(tree.first_copy, tree.copy_count);
  }
  std::span<const Crowd> crowds(const Tree& tree) const {
    return std::span(crowds_).subspan(tree.first_crowd, tree.crowd_count);
  }
  // The copies of a crowd that hold the source with this number.
  std::span<const ProbeCopy> holders(const Crowd& crowd, std::uint64_t source) const;

 private:
  void add(std::size_t slot, std::uint32_t generation, const ProbeWeight& tree, float factor,
           float at_any_time);

  std::vector<Tree> trees_;
  std::vector<std::uint32_t> zone_trees_;  // by place: index into trees_
  std::vector<std::uint32_t> active_;
  std::vector<ProbeCopy> copies_;
  std::vector<Crowd> crowds_;
};

}  // namespace clamor
