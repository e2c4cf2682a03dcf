#include "bake/octree/octree_streaming.h"

#include <csignal>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "bake/octree/octree_builder.h"
#include "common/thread_team.h"
#include "tests/octree_reference.h"
#include "tests/peak_memory.h"
#include "tests/sanitized.h"
#include "tests/source_lists.h"

namespace clamor {
namespace {

// Assembles the received nodes into one tree, breadth first.
class CollectingSink : public OctreeSink {
 public:
  Result<std::size_t> add_subtree(SourceOctree&& subtree) override {
    EXPECT_FALSE(subtree.nodes.empty());
    ++subtrees;
    const std::size_t first = pieces_.size();
    for (const OctreeNode& node : subtree.nodes) {
      Piece& piece = pieces_.emplace_back();
      piece.node = node;
      const auto* sources = subtree.sources.data() + node.first_source;
      piece.sources.assign(sources, sources + node.source_count);
      for (std::size_t o = 0; o < 8; ++o)
        if (node.children[o] != kNoNode) piece.children[o] = first + node.children[o];
    }
    return first;
  }

  Result<std::size_t> add_node(const NodeSummary& node, std::span<const Source> sources,
                               const std::array<std::optional<std::size_t>, 8>& children) override {
    ++single_nodes;
    if (refuse_after_nodes > 0 && single_nodes > refuse_after_nodes)
      return Error("out.clamor: the sink is full");
    for (const auto& child : children)
      EXPECT_LT(child.value_or(0), pieces_.size() + (child ? 0 : 1)) << "before its child";
    EXPECT_EQ(node.source_count, sources.size());
    Piece& piece = pieces_.emplace_back();
    static_cast<NodeSummary&>(piece.node) = node;
    piece.sources.assign(sources.begin(), sources.end());
    piece.children = children;
    return pieces_.size() - 1;
  }

  SourceOctree whole(std::size_t root) const {
    SourceOctree tree;
    std::vector<std::size_t> queue{root};
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const Piece& piece = pieces_[queue[i]];
      OctreeNode node = piece.node;
      node.first_source = tree.sources.size();
      for (std::size_t o = 0; o < 8; ++o) {
        node.children[o] = piece.children[o] ? static_cast<std::uint32_t>(queue.size()) : kNoNode;
        if (piece.children[o]) queue.push_back(*piece.children[o]);
      }
      tree.nodes.push_back(node);
      tree.sources.insert(tree.sources.end(), piece.sources.begin(), piece.sources.end());
    }
    EXPECT_EQ(queue.size(), pieces_.size()) << "something was added and named by no parent";
    return tree;
  }

  std::size_t subtrees = 0, single_nodes = 0, refuse_after_nodes = 0;

 private:
  struct Piece {
    OctreeNode node{};
    std::vector<Source> sources{};
    std::array<std::optional<std::size_t>, 8> children{};
  };
  std::vector<Piece> pieces_;
};

// Fixture with a temporary folder.
class OctreeStreaming : public ::testing::Test {
 protected:
  OctreeStreaming() { std::filesystem::create_directories(folder_); }
  ~OctreeStreaming() override { std::filesystem::remove_all(folder_); }

  ScratchList<Source> on_disk(std::span<const Source> sources) const {
    ScratchList<Source> list(output_);
    EXPECT_TRUE(list.append(sources).ok());
    return list;
  }

  std::size_t files() const {
    const auto all = std::filesystem::directory_iterator(folder_);
    return static_cast<std::size_t>(std::distance(begin(all), end(all)));
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("clamor_streaming_" + std::to_string(::getpid()));
  const std::string output_ = (folder_ / "out.clamor").string();
};

TEST_F(OctreeStreaming, EqualsTheTreeBuiltInMemoryForAnyMemoryLimit) {
  const std::vector<testing::DegenerateList> lists = {
      {},                                          // sources on walls
      {.keys = 5},                                 // equal keys: the list order decides
      {.places = 1},                               // a chain, sorted by merging
      {.keys = 3, .places = 1},                    // a chain with equal keys in all runs
      {.keys = 40, .places = 4, .emitters = 300},  // a few crowded places
      {.spread_m = 1e-6, .far_m = 1000},           // most sources in one cube of minimum size
      {.spread_m = 1e-6}};                         // positions with few distinct floats
  for (std::size_t i = 0; i < lists.size(); ++i)
    for (const std::uint32_t count : {1u, 600u, 1200u, 12'000u, 100'000u}) {
      if (count > 12'000 && i > 3) continue;                         // twenty passes over the disk
      if (count > 12'000 && i > 0 && testing::kSanitized) continue;  // slow
      const auto sources = testing::degenerate_sources(count, 10 + i, lists[i]);
      const SourceOctree expected = build_octree(sources);
      for (const std::uint64_t memory_bytes :
           {1'000ull, 500'000ull, 8'000'000ull, 1'000'000'000ull})
        for (const int threads : {1, 8}) {
          CollectingSink sink;
          with_team(threads, [&] {
            const auto root = stream_octree(on_disk(sources), memory_bytes, sink);
            ASSERT_TRUE(root.ok() && root->has_value());
            ASSERT_TRUE(testing::same_octree(sink.whole(**root), expected))
                << count << " sources of list " << i << " in " << memory_bytes << " bytes";
          });
          const bool fits =
              count * 140ull <= std::max<std::uint64_t>(memory_bytes, kLeafSources * 140);
          EXPECT_EQ(sink.single_nodes == 0, fits);  // otherwise the tree was not built on disk
        }
    }
  EXPECT_EQ(files(), 0u);
}

TEST_F(OctreeStreaming, AcceptsAnEmptyList) {
  CollectingSink sink;
  const auto root = stream_octree(ScratchList<Source>(output_), 1000, sink);
  ASSERT_TRUE(root.ok());
  EXPECT_FALSE(root->has_value());
  EXPECT_EQ(sink.subtrees + sink.single_nodes, 0u);
}

// Only counts, so that at most one subtree is in memory.
class CountingSink : public OctreeSink {
 public:
  Result<std::size_t> add_subtree(SourceOctree&& subtree) override {
    sources += subtree.sources.size();
    largest = std::max(largest, subtree.sources.size());
    return 0;
  }
  Result<std::size_t> add_node(const NodeSummary&, std::span<const Source> own,
                               const std::array<std::optional<std::size_t>, 8>&) override {
    sources += own.size();
    return 0;
  }
  std::size_t sources = 0, largest = 0;
};

TEST_F(OctreeStreaming, KeepsTheMemoryLimitForAListTenTimesAsLarge) {
  if (testing::kSanitized) GTEST_SKIP() << "a sanitizer keeps what is freed";
  constexpr std::uint32_t kCount = 1'000'000;
  constexpr std::uint64_t kMemory_bytes = 8'800'000;  // a tenth of the list
  ScratchList<Source> list(output_);
  for (std::uint32_t part = 0; part < 100; ++part)
    ASSERT_TRUE(list.append(testing::wall_sources(kCount / 100, part)).ok());
  const testing::PeakMemory peak;
  if (!peak.known()) GTEST_SKIP() << "this system does not tell how much memory was used at most";
  CountingSink sink;
  ASSERT_TRUE(stream_octree(std::move(list), kMemory_bytes, sink).ok());
  EXPECT_EQ(sink.sources, kCount);
  EXPECT_GT(sink.largest, 10'000u);  // uses the allowed memory
  // The allocator may retain freed memory of about one subtree.
  EXPECT_LE(peak.more_bytes(), 2 * kMemory_bytes);
}

TEST_F(OctreeStreaming, ReportsAFullDiskAndLeavesNoFileBehind) {
  const auto sources = testing::wall_sources(6000);
  const auto build = [&](std::uint64_t limit_bytes) -> Result<void> {
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    // A limit on file sizes acts like a full disk.
    const rlimit small{limit_bytes, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    ScratchList<Source> list(output_);
    auto done = list.append(sources);
    if (done.ok()) {
      CountingSink sink;
      const auto root = stream_octree(std::move(list), 1000, sink);
      if (!root.ok()) done = root.error();
    }
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    return done;
  };
  const std::uint64_t whole_bytes = sources.size() * sizeof(Source);
  for (std::uint64_t limit = 0; limit < whole_bytes; limit += 9999) {
    const auto done = build(limit);
    ASSERT_FALSE(done.ok()) << limit;
    EXPECT_TRUE(done.error().message.starts_with(output_ + ": cannot write")) << limit;
    EXPECT_NE(done.error().message.find("free some space"), std::string::npos);
    EXPECT_EQ(files(), 0u);
  }
  EXPECT_TRUE(build(whole_bytes).ok());
}

TEST_F(OctreeStreaming, ExplainsWhyItCannotWrite) {
  const std::string path = (folder_ / "missing" / "out.clamor").string();
  ScratchList<Source> list(path);
  const auto done = list.append(testing::wall_sources(20));
  ASSERT_FALSE(done.ok());
  EXPECT_TRUE(done.error().message.starts_with(path + ": cannot make")) << done.error().message;
}

TEST_F(OctreeStreaming, ReturnsTheErrorOfTheSink) {
  const auto sources = testing::wall_sources(30'000);
  for (const std::size_t nodes : {1u, 5u, 20u}) {
    CollectingSink sink;
    sink.refuse_after_nodes = nodes;
    const auto root = stream_octree(on_disk(sources), 1000, sink);
    ASSERT_FALSE(root.ok());
    EXPECT_EQ(root.error().message, "out.clamor: the sink is full");
    EXPECT_EQ(sink.single_nodes, nodes + 1);  // no further calls after the error
    EXPECT_EQ(files(), 0u);
  }
}

}  // namespace
}  // namespace clamor
