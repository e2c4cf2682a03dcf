#include "bake/octree/octree_streaming.h"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>
#include <vector>

#include "bake/octree/highest_ranks.h"
#include "bake/octree/octree_builder.h"
#include "bake/octree/octree_summary.h"
#include "common/bounds.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

constexpr std::uint64_t kBuildBytesPerSource = 140;  // 1.6 times sizeof(Source)

// A finished subtree: its handle in the sink and the summary that its parent needs.
struct Part {
  std::size_t handle = 0;
  NodeSummary top{};
};
using Parts = std::array<std::optional<Part>, 8>;

class Streamer {
 public:
  Streamer(ScratchList<Source> sources, std::uint64_t memory_bytes, OctreeSink& sink)
      : lists_(with_room(std::move(sources))),
        max_in_memory_(std::max<std::uint64_t>(kLeafSources, memory_bytes / kBuildBytesPerSource)),
        sink_(sink) {}

  Result<Part> build() {
    Boundsf bounds;
    for_blocks(all(), [&](std::span<const Source> block, std::size_t) {
      bounds.add(bounds_of(block, &Source::position_m));
    });
    if (all().count > max_in_memory_)
      if (const auto room = lists_[1].resize(all().count); !room.ok()) return room.error();
    return build(all(), OctreeCube::around(Vec3(bounds.low_m), Vec3(bounds.high_m)));
  }

 private:
  // Sources in one of the two lists, in the order of the list that the octree is built from. The
  // same range of the other list is free.
  struct Range {
    std::size_t first = 0, count = 0;
    unsigned list = 0;
  };
  static std::array<ScratchList<Source>, 2> with_room(ScratchList<Source> sources) {
    ScratchList<Source> room(sources.beside());
    return {std::move(sources), std::move(room)};
  }

  Range all() const { return {0, lists_[0].size(), 0}; }

  // What dividing a range needs to know.
  struct Survey {
    Boundsf bounds;
    HighestRanks highest;
    std::array<std::uint64_t, 8> counts{};  // by octant
  };

  // Calls visit(sources, place of the first in the range), block by block.
  template <class Visit>
  void for_blocks(const Range& range, const Visit& visit) {
    for (std::size_t done = 0; done < range.count; done += ScratchList<Source>::kBlock) {
      const std::size_t count = std::min(ScratchList<Source>::kBlock, range.count - done);
      visit(std::span<const Source>(lists_[range.list].all().subspan(range.first + done, count)),
            done);
      lists_[range.list].release(range.first + done, count);
    }
  }

  // Calls visit(source, its rank, its octant) for the sources in order, whose ranks are computed in
  // parallel.
  template <class Visit>
  void for_ranks(const Range& range, const OctreeCube& cube, const Visit& visit) {
    struct Ranked {
      std::uint64_t rank;
      std::size_t octant;
    };
    std::vector<Ranked> ranked(ScratchList<Source>::kBlock);
    for_blocks(range, [&](std::span<const Source> block, std::size_t place) {
      team_for(0, block.size(), 2048, [&](std::size_t i) {
        ranked[i] = {
            octree_rank(key_bits(octree_key(block[i])), static_cast<std::uint32_t>(place + i)),
            cube.octant_of(Vec3(block[i].position_m))};
      });
      for (std::size_t i = 0; i < block.size(); ++i)
        visit(block[i], ranked[i].rank, ranked[i].octant);
    });
  }

  // Copies of the sources with these ranks.
  std::vector<Source> gather(const Range& range, std::span<const std::uint64_t> ranks) {
    constexpr std::size_t kAtOnce = 64;  // each may bring 16 pages into memory
    std::vector<Source> gathered;
    gathered.reserve(ranks.size());
    for (const std::uint64_t rank : ranks) {
      gathered.push_back(lists_[range.list].all()[range.first + place_of_rank(rank)]);
      if (gathered.size() % kAtOnce == 0) lists_[range.list].release(range.first, range.count);
    }
    return gathered;
  }

  Result<Part> build(const Range& range, const OctreeCube& cube) {
    if (range.count <= max_in_memory_) return build_in_memory(range, cube);
    Survey survey;
    for_ranks(range, cube, [&](const Source& source, std::uint64_t rank, std::size_t octant) {
      survey.bounds.add(source.position_m);
      survey.highest.offer(rank);
      ++survey.counts[octant];
    });
    if (cube.depth >= OctreeCube::kDeepest || survey.bounds.low_m == survey.bounds.high_m)
      return build_chain(range, cube, survey.bounds.low_m);
    const auto ranks = survey.highest.descending();
    const std::vector<Source> own = gather(range, ranks);
    for (const Source& source : own) --survey.counts[cube.octant_of(Vec3(source.position_m))];
    divide(range, cube, ranks.back(), survey.counts);

    const auto firsts = first_octants(survey.counts);
    Range below{range.first + own.size(), 0, 1 - range.list};
    Parts parts;
    for (std::size_t o = 0; o < 8; ++o) {
      below.count += survey.counts[o];
      if (below.count == 0 || (o + 1 < 8 && firsts[o + 1] == firsts[o])) continue;
      auto part = build(below, cube.child(firsts[o]));
      if (!part.ok()) return part;
      parts[firsts[o]] = std::move(*part);
      below = {below.first + below.count, 0, below.list};
    }
    return add_node(own, parts);
  }

  // Copies the sources with ranks below `least` to the other list, by octant.
  void divide(const Range& range, const OctreeCube& cube, std::uint64_t least,
              const std::array<std::uint64_t, 8>& counts) {
    ScratchList<Source>& others = lists_[1 - range.list];
    constexpr std::size_t kReleased = 4096;
    std::array<std::size_t, 8> next{};
    std::size_t begin = range.first + kNodeSources;
    for (std::size_t o = 0; o < 8; ++o) {
      next[o] = begin;
      begin += counts[o];
    }
    for_ranks(range, cube, [&](const Source& source, std::uint64_t rank, std::size_t octant) {
      if (rank >= least) return;
      const std::size_t to = next[octant]++;
      others.all()[to] = source;
      if (to % kReleased == 0 && to >= kReleased) others.release(to - kReleased, kReleased);
    });
    others.release(range.first, range.count);
  }

  Result<Part> build_in_memory(const Range& range, const OctreeCube& cube) {
    std::vector<Source> list;
    list.reserve(range.count);
    for_blocks(range, [&](std::span<const Source> block, std::size_t) {
      list.insert(list.end(), block.begin(), block.end());
    });
    SourceOctree tree = build_octree(std::move(list), cube);
    Part part{0, tree.nodes.front()};
    const auto handle = sink_.add_subtree(std::move(tree));
    if (!handle.ok()) return handle.error();
    part.handle = *handle;
    return part;
  }

  // Handles sources at one point or in a cube of minimum size: a chain of nodes, each with the
  // highest remaining keys, built from its end. Their ranks are sorted in the free range.
  Result<Part> build_chain(const Range& range, OctreeCube cube, const Vec3f& place_m) {
    std::vector<std::size_t> octants;  // octants along the chain; further nodes use octant 0
    for (; cube.depth < OctreeCube::kDeepest; cube = cube.child(octants.back()))
      octants.push_back(cube.octant_of(Vec3(place_m)));
    const auto room = lists_[1 - range.list].all().subspan(range.first, range.count);
    static_assert(sizeof(Source) % sizeof(std::uint64_t) == 0);
    const std::span<std::uint64_t> ranks(reinterpret_cast<std::uint64_t*>(room.data()),
                                         range.count);
    std::size_t next = 0;
    for_ranks(range, cube,
              [&](const Source&, std::uint64_t rank, std::size_t) { ranks[next++] = rank; });
    team_sort(ranks.begin(), ranks.end(), std::greater<>());
    std::size_t node =
        range.count <= kLeafSources ? 0 : (range.count - kLeafSources - 1) / kNodeSources + 1;
    std::optional<Part> below;
    for (std::size_t last = range.count; last > 0; last = kNodeSources * node--) {
      const std::size_t first = kNodeSources * node;
      Parts parts;
      parts[node < octants.size() ? octants[node] : 0] = below;
      const auto part = add_node(gather(range, ranks.subspan(first, last - first)), parts);
      if (!part.ok()) return part;
      below = *part;
    }
    return *below;
  }

  Result<Part> add_node(const std::vector<Source>& own, const Parts& parts) {
    std::array<std::optional<std::size_t>, 8> handles;
    std::array<const NodeSummary*, 8> tops{};
    std::size_t count = 0;
    for (std::size_t o = 0; o < 8; ++o) {
      if (!parts[o]) continue;
      handles[o] = parts[o]->handle;
      tops[count++] = &parts[o]->top;
    }
    Part part;
    part.top.source_count = static_cast<std::uint32_t>(own.size());
    summarise(part.top, own, std::span(tops).first(count));
    const auto handle = sink_.add_node(part.top, own, handles);
    if (!handle.ok()) return handle.error();
    part.handle = *handle;
    return part;
  }

  std::array<ScratchList<Source>, 2> lists_;
  std::uint64_t max_in_memory_;
  OctreeSink& sink_;
};

}  // namespace

Result<std::optional<std::size_t>> stream_octree(ScratchList<Source> sources,
                                                 std::uint64_t memory_bytes, OctreeSink& sink) {
  if (sources.size() == 0) return std::optional<std::size_t>();
  const auto root = Streamer(std::move(sources), memory_bytes, sink).build();
  if (!root.ok()) return root.error();
  return std::optional<std::size_t>(root->handle);
}

}  // namespace clamor
