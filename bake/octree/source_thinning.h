// source_thinning.h: keeps n of the deposits by unbiased priority sampling.
//
// Priority sampling (N. Duffield, C. Lund, M. Thorup, J. ACM 54(6), 2007): deposit i of weight w_i
// (deposit_weight.h) has a random number v_i in (0, 1] and the key w_i^(3/4) / v_i. The n highest
// keys are kept, and each kept power is multiplied by max(1, tau / w_i^(3/4)), with tau the
// (n + 1)-th key. The estimate of any sum over deposits is unbiased, and no deposit with
// w_i^(3/4) above tau is dropped.
//
// Deposits below the tracer's threshold T have been thinned before, with probabilities that differ
// as their weights did, and count as if they had the weight T. So the probability of being kept by
// both is proportional to w^(3/4), too.
//
// v is a hash of the deposit and independent of u, which the runtime's sampler uses. The result
// does not depend on how deposits were grouped.
//
// Memory: 1.23 times the n kept sources plus 1 MB, for any number of deposits; with use_file(), as
// much space on the disk, and 3 MB. Threads: one at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "bake/octree/scratch_list.h"
#include "bake/trace/deposit_weight.h"
#include "common/result.h"
#include "formats/bake_file/source.h"

namespace clamor {

class SourceThinning {
 public:
  // Without a `weight`, that of a deposit is its power: for deposits of much the same time.
  explicit SourceThinning(std::uint64_t max_sources, const DepositWeight& weight = {},
                          double speed_mps = 0);

  // Keeps the deposits in a file beside `beside`. Call before add().
  Result<void> use_file(const std::string& beside);

  // Deposits with a weight below `threshold` have been thinned before. Of those with equal keys,
  // the first are kept.
  void add(std::span<const Source> deposits, double threshold = 0);

  // Returns the kept sources in the order of add() and clears the object. The list has spare room.
  ScratchList<Source> take();

  std::uint64_t added() const { return added_; }

 private:
  void prune();

  std::size_t max_sources_, room_;
  DepositWeight weight_;
  double speed_mps_;
  std::uint64_t added_ = 0;
  double dropped_ = 0;  // highest key of these
  ScratchList<Source> sources_;
  ScratchList<double> keys_;  // of the sources
};

}  // namespace clamor
