// thinning_on_disk.h: keeps n of the deposits as SourceThinning does, where they exceed the memory.
//
// All deposits are written to a temporary file, and their keys to another. The (n + 1)-th key
// follows from a histogram of the keys, made while they arrive, and the keys of one of its bins.
// The kept deposits are a view of the files: each reading selects and scales them again.
//
// Disk: 96 bytes per deposit. Memory: 12 MB. Threads: one at a time; the caller's team
// compute the keys.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bake/octree/scratch_file.h"
#include "common/result.h"
#include "formats/bake_file/source.h"

namespace clamor {

class ThinningOnDisk {
 public:
  ThinningOnDisk(std::uint64_t max_sources, const std::string& beside);

  // Adds deposits in the order that they are read in.
  Result<void> add(std::span<const Source> deposits);

  // Finds out which deposits are kept. Call once, after the last add().
  Result<void> finish();

  std::uint64_t added() const { return added_; }
  std::uint64_t kept() const { return kept_; }

  // Passes the kept sources in order, in blocks, which the function may change.
  using Visit = std::function<Result<void>(std::span<Source>)>;
  Result<void> for_each(const Visit& visit) const;

  // Passes a tenth of the kept sources, or all if they are few: blocks from all over the list.
  Result<void> for_some(const Visit& visit) const;

 private:
  Result<void> flush();
  Result<void> for_each_kept(std::uint64_t every, const Visit& visit) const;

  std::uint64_t max_sources_;
  ScratchFile file_, key_file_;
  std::vector<Source> buffer_;
  std::vector<std::uint64_t> histogram_;  // of the keys, by their upper bits
  std::uint64_t added_ = 0, kept_ = 0;
  double threshold_ = 0;             // the (n + 1)-th key; 0 if all are kept
  std::uint64_t kept_of_equal_ = 0;  // number of deposits with this key that are kept, the first
};

}  // namespace clamor
