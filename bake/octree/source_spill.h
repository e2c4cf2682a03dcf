// source_spill.h: a list of sources on disk, for lists that do not fit into memory.
//
// A temporary file beside the output, where there should be room, and without a name as soon as it
// is open: when this goes, or the process is killed, the room is free again. As sources arrive it
// notes what dividing them will ask first: their bounds, and the ranks of the highest keys.
//
// Threads: one at a time.   Disk: 88 bytes a source.   Memory: a buffer while sources arrive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake/octree/highest_ranks.h"
#include "common/result.h"
#include "formats/bake_file/source.h"

namespace clamor {

class SourceSpill {
 public:
  // The file is made when the buffer is full for the first time, beside the file at `beside`.
  explicit SourceSpill(std::string beside, std::size_t buffered_sources = 16384);
  SourceSpill(SourceSpill&& other) noexcept;
  SourceSpill& operator=(SourceSpill&& other) noexcept;
  SourceSpill(const SourceSpill&) = delete;
  SourceSpill& operator=(const SourceSpill&) = delete;
  ~SourceSpill();

  // At the end of the list, which holds fewer than 2^32.
  Result<void> append(std::span<const Source> sources);

  // Writes what is buffered and lets go of the buffer. Call before read().
  Result<void> flush();

  // Fills `sources` with those from `first` on, which must be there.
  Result<void> read(std::uint64_t first, std::span<Source> sources) const;

  const std::string& beside() const { return beside_; }
  std::uint64_t count() const { return count_; }
  const Vec3f& low_m() const { return low_m_; }
  const Vec3f& high_m() const { return high_m_; }

  // Ranks as octree_rank() makes them of places in the list, kNodeSources at most.
  std::span<const std::uint64_t> highest_ranks() { return highest_.descending(); }

 private:
  Result<void> open();
  Result<void> write(std::span<const Source> sources);
  Error failed(const char* doing) const;

  std::string beside_;
  std::size_t buffered_sources_;
  std::vector<Source> buffer_;
  std::uint64_t count_ = 0;
  Vec3f low_m_{}, high_m_{};
  HighestRanks highest_;
  int descriptor_ = -1;
};

}  // namespace clamor
