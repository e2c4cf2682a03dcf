// source_thinning.h: keeps the n deposits that matter most, without bias.
//
// Priority sampling (N. Duffield, C. Lund, M. Thorup, J. ACM 54(6), 2007): deposit i, of power P_i
// summed over bands, has the weight w_i = P_i^(1/4), a random number v_i in (0, 1] and the key w_i
// / v_i. The n highest keys are kept, each with its power times max(1, tau / w_i), tau the (n +
// 1)-th key. Any sum over the deposits is right on average; none with a weight above tau is let go.
//
// Why the fourth root: weights in proportion to power would leave the late decay, 30 dB down, a
// thousandth of the sources. In a 5 x 4 x 3 m room, 200 000 sources of 30 000 photons, over 24
// seeds, the spread of T30 at one place and of its level is
//
//   P: 2.0 %, 0.014 dB    P^(1/2): 1.1 %, 0.015 dB    P^(1/4): 0.4 %, 0.014 dB
//
// and 0.5 %, 0.029 dB for the 150 000 deposits of 5 000 photons, unthinned.
//
// v is a hash of the deposit and has nothing to do with its u, which the sampler will draw with.
// The result depends neither on the order of add() nor on how the deposits were shared out.
//
// Memory: 1.6 times the n that are kept, however many are added, and 22 MB.   Threads: one at a
// time; take() uses those of the TBB arena it is called in.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/bake_file/source.h"

namespace clamor {

class SourceThinning {
 public:
  explicit SourceThinning(std::uint64_t most_sources);

  // Deposits in the order in which they shall come out; `order` grows from call to call, or says
  // where among others' they belong.
  void add(std::span<const Source> deposits, std::uint64_t order);

  // Those that are kept, by order of arrival, and empties this. The list has room for more.
  std::vector<Source> take();

  std::uint64_t added() const { return added_; }

 private:
  // Of a source, what decides about it; sources stay in their slots.
  struct Entry {
    double key;
    std::uint64_t order;  // of the add()
    std::uint32_t rank;   // within it
    std::uint32_t slot;   // in sources_
  };
  static bool before(const Entry& a, const Entry& b);
  void prune();

  std::uint64_t most_;
  std::uint64_t added_ = 0;
  double threshold_ = 0;         // the highest key ever let go
  std::vector<Entry> entries_;   // the first live_; the slots of the others are free
  std::vector<Source> sources_;  // as many as entries
  std::size_t live_ = 0;
};

}  // namespace clamor
