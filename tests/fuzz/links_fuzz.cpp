// links_fuzz.cpp: links of a page: child entries and instances. Input: 120 bytes with the entry of
// an instanced tree, 120 bytes with the entry of the page, and its links.
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
  if (!tree.ok() || !parent.ok()) std::abort();  // any bytes are an entry
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
