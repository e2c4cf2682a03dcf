#include "bake/octree/octree_streaming.h"

#include <algorithm>
#include <array>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

#include "bake/octree/octree_builder.h"
#include "bake/octree/octree_summary.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

constexpr std::uint64_t kBuildBytesPerSource = 140;  // 1.6 times sizeof(Source)
constexpr std::size_t kMaxBuffered = 32768;          // sources per buffer; there are ten buffers

// A finished subtree: its handle in the sink and the summary that its parent needs.
struct Part {
  std::size_t handle = 0;
  NodeSummary top{};
};
using Parts = std::array<std::optional<Part>, 8>;

// Calls work(i) for each i below `count`, on one thread if there are few sources.
template <class Work>
void in_parallel(std::size_t count, std::size_t sources, const Work& work) {
  constexpr std::size_t kWorthIt = 2048;
  const std::size_t grain = std::max<std::size_t>(1, count * kWorthIt / sources);
  team_for(0, count, grain, [&](std::size_t i) { work(i); });
}

class Streamer {
 public:
  Streamer(std::string beside, std::uint64_t memory_bytes, OctreeSink& sink)
      : beside_(std::move(beside)),
        max_in_memory_(std::max<std::uint64_t>(kLeafSources, memory_bytes / kBuildBytesPerSource)),
        buffered_(std::clamp<std::size_t>(max_in_memory_ / 10, 1, kMaxBuffered)),
        sink_(sink) {}

  Result<Part> build(SourceSpill sources, const OctreeCube& cube) {
    if (const auto done = sources.flush(); !done.ok()) return done.error();
    if (sources.count() <= max_in_memory_) return build_in_memory(std::move(sources), cube);
    if (cube.depth >= OctreeCube::kDeepest || sources.bounds().low_m == sources.bounds().high_m)
      return build_chain(std::move(sources), cube);
    std::vector<Source> own;
    auto octants = divide(std::move(sources), cube, own);
    if (!octants.ok()) return octants.error();
    if (const auto done = join_leaves(*octants); !done.ok()) return done.error();
    Parts parts;
    for (std::size_t o = 0; o < 8; ++o) {
      if ((*octants)[o].count() == 0) continue;
      auto part = build(std::move((*octants)[o]), cube.child(o));
      if (!part.ok()) return part;
      parts[o] = std::move(*part);
    }
    return add_node(own, parts);
  }

 private:
  Result<Part> build_in_memory(SourceSpill sources, const OctreeCube& cube) {
    SourceOctree tree;
    {
      auto list = read_all(std::move(sources));
      if (!list.ok()) return list.error();
      tree = build_octree(std::move(*list), cube);
    }
    Part part{0, tree.nodes.front()};
    const auto handle = sink_.add_subtree(std::move(tree));
    if (!handle.ok()) return handle.error();
    part.handle = *handle;
    return part;
  }

  // Reads the whole list and frees its disk space.
  static Result<std::vector<Source>> read_all(SourceSpill sources) {
    std::vector<Source> list(sources.count());
    if (const auto done = sources.read(0, list); !done.ok()) return done.error();
    return list;
  }

  // Stores the highest sources in `own` and returns the others by octant, in list order.
  Result<std::vector<SourceSpill>> divide(SourceSpill sources, const OctreeCube& cube,
                                          std::vector<Source>& own) {
    std::vector<SourceSpill> octants;
    for (std::size_t o = 0; o < 8; ++o) octants.emplace_back(beside_, buffered_);
    std::array<Result<void>, 8> appended;

    const auto ranks = sources.highest_ranks();
    const std::uint64_t least = ranks.back();
    own.resize(ranks.size());
    std::vector<Source> block(std::min<std::uint64_t>(buffered_, sources.count()));
    std::vector<std::uint8_t> goes_to(block.size());
    constexpr std::size_t kStays = 8;
    for (std::uint64_t first = 0; first < sources.count(); first += block.size()) {
      block.resize(std::min<std::uint64_t>(block.size(), sources.count() - first));
      if (const auto done = sources.read(first, block); !done.ok()) return done.error();
      in_parallel(block.size(), block.size(), [&](std::size_t i) {
        const std::uint64_t rank =
            octree_rank(key_bits(octree_key(block[i])), static_cast<std::uint32_t>(first + i));
        goes_to[i] = static_cast<std::uint8_t>(
            rank >= least ? kStays : cube.octant_of(Vec3(block[i].position_m)));
        if (goes_to[i] != kStays) return;
        const auto place = std::lower_bound(ranks.begin(), ranks.end(), rank, std::greater<>());
        own[static_cast<std::size_t>(place - ranks.begin())] = block[i];
      });
      in_parallel(8, block.size(), [&](std::size_t o) {
        for (std::size_t i = 0; i < block.size() && appended[o].ok(); ++i)
          if (goes_to[i] == o) appended[o] = octants[o].append(std::span(&block[i], 1));
      });
      for (const auto& done : appended)
        if (!done.ok()) return done.error();
    }
    for (SourceSpill& octant : octants)
      if (const auto done = octant.flush(); !done.ok()) return done.error();
    return octants;
  }

  // Moves the octants of a shared leaf into the first of them.
  Result<void> join_leaves(std::vector<SourceSpill>& octants) const {
    std::array<std::uint64_t, 8> counts{};
    for (std::size_t o = 0; o < 8; ++o) counts[o] = octants[o].count();
    const auto firsts = first_octants(counts);
    for (std::size_t o = 0; o < 8; ++o) {
      if (firsts[o] == o || counts[o] == 0) continue;
      auto list = read_all(std::exchange(octants[o], SourceSpill(beside_, 1)));
      if (!list.ok()) return list.error();
      if (const auto done = octants[firsts[o]].append(*list); !done.ok()) return done;
    }
    return {};
  }

  // Handles sources at one point or in a cube of minimum size: a chain of nodes, each with the
  // highest remaining keys, built from its end.
  Result<Part> build_chain(SourceSpill sources, OctreeCube cube) {
    std::vector<std::size_t> octants;  // octants along the chain; further nodes use octant 0
    for (; cube.depth < OctreeCube::kDeepest; cube = cube.child(octants.back()))
      octants.push_back(cube.octant_of(Vec3(sources.bounds().low_m)));
    SourceSpill sorted(beside_, 1);
    const auto run_begins = sort_runs(std::move(sources), cube, sorted);
    if (!run_begins.ok()) return run_begins.error();

    // A sorted run, merged from its end; one block of it is in memory.
    struct Run {
      std::uint64_t begin = 0, unread = 0;  // positions in `sorted`
      std::vector<Source> block{};          // sources from `unread` on
    };
    std::vector<Run> runs;
    const std::size_t block_size =
        std::max<std::uint64_t>(1, max_in_memory_ / (2 * run_begins->size()));
    // Lowest key first; of equal keys, the later source, which is in the later run.
    std::priority_queue<std::pair<std::uint32_t, std::size_t>,
                        std::vector<std::pair<std::uint32_t, std::size_t>>, LaterFirst>
        next;
    const auto advance = [&](std::size_t r) -> Result<void> {
      Run& run = runs[r];
      if (run.block.empty() && run.unread > run.begin) {
        run.block.resize(std::min<std::uint64_t>(block_size, run.unread - run.begin));
        run.unread -= run.block.size();
        if (const auto done = sorted.read(run.unread, run.block); !done.ok()) return done;
      }
      if (!run.block.empty()) next.emplace(key_bits(octree_key(run.block.back())), r);
      return {};
    };
    for (std::size_t r = 0; r < run_begins->size(); ++r) {
      const bool last = r + 1 == run_begins->size();
      runs.push_back({(*run_begins)[r], last ? sorted.count() : (*run_begins)[r + 1]});
      if (const auto done = advance(r); !done.ok()) return done.error();
    }

    std::optional<Part> below;
    std::vector<Source> own;
    const std::uint64_t above_end =  // nodes above the last one
        sorted.count() <= kLeafSources ? 0 : (sorted.count() - kLeafSources - 1) / kNodeSources + 1;
    for (std::uint64_t left = sorted.count(); left > 0; --left) {
      const std::size_t r = next.top().second;
      next.pop();
      own.push_back(runs[r].block.back());
      runs[r].block.pop_back();
      if (const auto done = advance(r); !done.ok()) return done.error();
      const std::uint64_t above = (left - 1) / kNodeSources;
      if ((left - 1) % kNodeSources != 0 || above > above_end) continue;
      std::reverse(own.begin(), own.end());
      Parts parts;
      parts[above < octants.size() ? octants[above] : 0] = below;
      const auto part = add_node(own, parts);
      if (!part.ok()) return part;
      below = *part;
      own.clear();
    }
    return *below;
  }

  struct LaterFirst {  // comparison for std::priority_queue: whether a comes after b
    bool operator()(const std::pair<std::uint32_t, std::size_t>& a,
                    const std::pair<std::uint32_t, std::size_t>& b) const {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    }
  };

  // Appends sorted runs (descending keys) and returns the position of each.
  Result<std::vector<std::uint64_t>> sort_runs(SourceSpill sources, const OctreeCube& cube,
                                               SourceSpill& sorted) const {
    std::vector<std::uint64_t> begins;
    for (std::uint64_t first = 0; first < sources.count(); first += max_in_memory_) {
      begins.push_back(first);
      std::vector<Source> list(std::min(max_in_memory_, sources.count() - first));
      if (const auto done = sources.read(first, list); !done.ok()) return done.error();
      const SourceOctree chain = build_octree(std::move(list), cube);
      if (const auto done = sorted.append(chain.sources); !done.ok()) return done.error();
    }
    if (const auto done = sorted.flush(); !done.ok()) return done.error();
    return begins;
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

  std::string beside_;
  std::uint64_t max_in_memory_;
  std::size_t buffered_;
  OctreeSink& sink_;
};

}  // namespace

Result<std::optional<std::size_t>> stream_octree(SourceSpill sources, std::uint64_t memory_bytes,
                                                 OctreeSink& sink) {
  if (sources.count() == 0) return std::optional<std::size_t>();
  const auto cube = OctreeCube::around(Vec3(sources.bounds().low_m), Vec3(sources.bounds().high_m));
  Streamer streamer(sources.beside(), memory_bytes, sink);
  const auto root = streamer.build(std::move(sources), cube);
  if (!root.ok()) return root.error();
  return std::optional<std::size_t>(root->handle);
}

}  // namespace clamor
