// source_spill.h: a list of sources in a temporary file, for lists larger than memory.
//
// While sources are appended, the list records what dividing it will need: the bounds and the
// highest ranks.
//
// Threads: one at a time. Disk: 88 bytes per source. Memory: one write buffer while appending.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake/octree/highest_ranks.h"
#include "bake/octree/scratch_file.h"
#include "common/bounds.h"
#include "common/result.h"
#include "formats/bake_file/source.h"

namespace clamor {

class SourceSpill {
 public:
  // Creates the file beside `beside` when the buffer first overflows.
  explicit SourceSpill(std::string beside, std::size_t buffered_sources = 16384);
  SourceSpill(SourceSpill&& other) noexcept;
  SourceSpill& operator=(SourceSpill&& other) noexcept;

  // Appends to the list, which holds fewer than 2^32 sources.
  Result<void> append(std::span<const Source> sources);

  // Writes and frees the buffer. Must be called before read().
  Result<void> flush();

  // Reads sources.size() existing sources, starting at `first`.
  Result<void> read(std::uint64_t first, std::span<Source> sources) const;

  const std::string& beside() const { return file_.beside(); }
  std::uint64_t count() const { return count_; }
  const Boundsf& bounds() const { return bounds_; }

  // The highest octree_rank() values of the list, at most kNodeSources, in descending order.
  std::span<const std::uint64_t> highest_ranks() { return highest_.descending(); }

 private:
  ScratchFile file_;
  std::size_t buffered_sources_;
  std::vector<Source> buffer_;
  std::uint64_t count_ = 0;
  Boundsf bounds_;
  HighestRanks highest_;
};

}  // namespace clamor
