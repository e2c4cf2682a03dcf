#include "formats/bake_file/page_links.h"

#include <array>
#include <functional>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_layout.h"
#include "tests/formats/forged_root.h"

namespace clamor::testing {
namespace {

// The page of the root of the only tree.
PageLink top_page(const Bytes& bytes) {
  PageLink page;
  with_root(bytes, [&page](BakeRoot::Builder root) {
    const auto top = root.getTrees()[0].getTop();
    page = read_entry(std::as_bytes(std::span(top.begin(), top.size())))->page;
  });
  return page;
}

// Returns the file with a modified entry in the page of the root, and valid checksums.
template <class T>
Bytes with_child(Bytes bytes, std::size_t at, T value) {
  const PageLink page = top_page(bytes);
  std::memcpy(bytes.data() + page.offset + page.packed_bytes + at, &value, sizeof(T));
  const auto changed = std::as_bytes(std::span(bytes)).subspan(page.offset, page.bytes());
  const std::uint64_t hash = hash_of(changed);
  return with_root(bytes, top_with(kHashAt, hash));
}

TEST(HostileBakeFile, WithInvalidChildEntriesIsRejected) {
  const Bytes whole = written(contents());
  ASSERT_TRUE(read_whole(with_child<std::uint8_t>(whole, kOctantAt, 3)).ok());
  constexpr std::uint64_t kHuge = 1ull << 63;
  const auto refused = [&](const char* what, std::size_t at, auto value) {
    EXPECT_FALSE(read_whole(with_child(whole, at, value)).ok()) << what;
  };
  refused("child that is in the midst of another page", kOffsetAt, std::uint64_t{65});
  refused("child before the file", kOffsetAt, std::uint64_t{0});
  refused("child beyond the file", kOffsetAt, kHuge);
  refused("child whose end wraps round", kOffsetAt, ~std::uint64_t{0} - 3);
  refused("child of 4 GB", kPackedAt, 0xffffffffu);
  refused("child of nothing", kPackedAt, 0u);
  refused("child without sources", kSourcesAt, 0u);
  refused("child of 2^31 sources", kSourcesAt, 1u << 31);
  refused("child with children of its own", kChildrenAt, std::uint8_t{1});
  refused("child with copies", kInstancesAt, std::uint16_t{1});
  refused("child of more below than its parent has", kBelowAt, std::uint64_t{42});
  refused("child with a wrong checksum", kHashAt, std::uint64_t{7});
  refused("child beyond the eighth", kOctantAt, std::uint8_t{9});
  refused("child beyond its parent's box", 0, -1.0f);
  refused("child inside out", 0, 1000.0f);
  refused("child nowhere", 12, kNaN);
  refused("child of a higher key", 24, 2.0f);
  refused("child of infinite power", 28, INFINITY);
  refused("child of a cone that is no number", 72, kNaN);
  refused("child of a negative delay", 76, -1.0f);
}

TEST(HostileBakeFile, WithSiblingsThatShareAPageIsRejected) {
  BakeContents bake = contents(99);
  OctreeNode& child = bake.octree.nodes[1];
  ASSERT_EQ(child.source_count, 40u);
  child.source_count = 20;
  OctreeNode other = child;
  other.first_source += 20;
  bake.octree.nodes[0].children[5] = 2;
  bake.octree.nodes.push_back(other);
  const Bytes whole = written(bake);
  ASSERT_TRUE(read_whole(whole).ok());
  // Copies one entry over the other, except for its octant.
  const PageLink page = top_page(whole);
  ASSERT_EQ(page.children, 2);
  std::array<char, kOctantAt> before{};
  std::array<char, kEntryBytes - kChildrenAt> after{};
  const char* const first = whole.data() + page.offset + page.packed_bytes;
  std::memcpy(before.data(), first, before.size());
  std::memcpy(after.data(), first + kChildrenAt, after.size());
  const Bytes shared =
      with_child(with_child(whole, kEntryBytes, before), kEntryBytes + kChildrenAt, after);
  const auto read = read_whole(shared);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("has two children on one page"), std::string::npos)
      << read.error().message;
}

// Adds pages above those of a tree.
class Pages {
 public:
  explicit Pages(const PageEntry& top) : first_(top.page.end()) {}

  // A node without sources and with these children, with unlimited bounds.
  PageEntry above(std::vector<PageEntry> children) {
    PageEntry node = children.front();
    node.source_count = 0;
    node.sources_below = 0;
    node.octant = kNoOctant;
    node.page = {first_ + bytes_.size(), 0, 0, static_cast<std::uint8_t>(children.size()), 0};
    std::vector<std::byte> page;
    for (PageEntry& child : children) {
      child.octant = kNoOctant;
      put_entry(child, page);
      node.sources_below += child.sources_below;
    }
    node.page.hash = hash_of(page);
    bytes_.append(reinterpret_cast<const char*>(page.data()), page.size());
    return node;
  }

  std::uint64_t first() const { return first_; }
  const Bytes& bytes() const { return bytes_; }

 private:
  std::uint64_t first_;
  Bytes bytes_;
};

// Returns the file with pages added above its only tree; `build` returns the new root.
Bytes with_pages_above(const Bytes& whole,
                       const std::function<PageEntry(Pages&, const PageEntry& top)>& build) {
  PageEntry top;
  with_root(whole, [&](BakeRoot::Builder root) {
    const auto stored = root.getTrees()[0].getTop();
    top = *read_entry(std::as_bytes(std::span(stored.begin(), stored.size())));
  });
  Pages pages(top);
  const PageEntry new_top = build(pages, top);
  const Bytes bytes = with_root(whole, [&](BakeRoot::Builder root) {
    std::vector<std::byte> stored;
    put_entry(new_top, stored);
    const auto* const from = reinterpret_cast<const kj::byte*>(stored.data());
    root.getTrees()[0].setTop(kj::arrayPtr(from, stored.size()));
    auto offsets = root.getSignals()[0].getBlockOffset();
    offsets.set(0, offsets[0] + pages.bytes().size());
    move_what_follows(root, pages.bytes().size());
  });
  return with_bytes(bytes, pages.first(), 0, pages.bytes());
}

// A long chain of pages would have to be read one by one.
TEST(HostileBakeFile, WithATooDeepTreeIsRejected) {
  const Bytes whole = written(contents());  // with two levels
  const auto with_levels_above = [&](std::size_t levels) {
    return with_pages_above(whole, [&](Pages& pages, PageEntry top) {
      for (std::size_t i = 0; i < levels; ++i) top = pages.above({top});
      return top;
    });
  };
  const auto deepest = read_whole(with_levels_above(kMaxTreeLevels - 2));
  EXPECT_TRUE(deepest.ok()) << deepest.error().message;
  const auto deeper = read_whole(with_levels_above(kMaxTreeLevels - 1));
  ASSERT_FALSE(deeper.ok());
  EXPECT_NE(deeper.error().message.find("deeper than 4096 levels"), std::string::npos)
      << deeper.error().message;
}

// Cousins that share a page: every level would double the number of paths to it.
TEST(HostileBakeFile, WithCousinsThatShareAPageIsRejected) {
  const Bytes whole = written(contents());
  const auto read = read_whole(with_pages_above(whole, [](Pages& pages, const PageEntry& top) {
    const PageEntry first = pages.above({top}), second = pages.above({top});
    return pages.above({first, second});
  }));
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("is another node's as well"), std::string::npos)
      << read.error().message;
}

}  // namespace
}  // namespace clamor::testing
