// links_fuzz.cpp: the index in a page: entries of its children, copies of trees. The first 120
// bytes are the entry of a tree that may be copied, the next 120 the page's own, then its links
// follow.
#include <vector>

#include "formats/bake_file/page_links.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint64_t kEnd = 1 << 20;
  if (size < 2 * kEntryBytes) return 0;
  auto bytes = std::as_bytes(std::span(data, size));
  const auto tree = read_entry(bytes.first(kEntryBytes));
  const auto parent = read_entry(bytes.subspan(kEntryBytes, kEntryBytes));
  if (!tree.ok() || !parent.ok()) std::abort();  // of any bytes
  if (!check_entry(*tree, kFirstPageOffset, kEnd).ok() ||
      !check_entry(*parent, kFirstPageOffset, kEnd).ok())
    return 0;
  const std::vector<PageEntry> trees = {*tree};
  PageLinks links;
  const auto read = read_links(bytes.subspan(2 * kEntryBytes), *parent, {trees, 3, 5}, links);
  if (!read.ok()) {
    if (read.error().message.empty()) std::abort();
    return 0;
  }
  std::uint64_t below = parent->source_count;
  for (const PageEntry& child : links.children) {
    if (child.page.end() > parent->page.offset || child.highest_key > parent->highest_key)
      std::abort();
    below += child.sources_below;
  }
  for (const Instance& instance : links.instances) {
    if (instance.tree != 0 || !(instance.u > 0)) std::abort();
    below += trees[0].sources_below;
  }
  if (below != parent->sources_below) std::abort();
  NodeSummary summary = *parent;
  include_instances(links.instances, trees, summary);
  return 0;
}
