// occlusion_upper_bounds.h: upper bound of each source's visibility, in four bits per source.
//
// Behind a wall, twice as many sources may reach a threshold unoccluded as in front of it, and even
// more are partly occluded. A source pool consults these bounds first, so that such a source costs
// a few bits and nothing else. A bound is 1/2^step of the source's power (steps of 3 dB) or zero.
//
// Bounds go stale as the listener walks. Sources are therefore retested in phases: each keyframe
// treats every fourth source as unoccluded. Where that is more than there are rays for (behind the
// stands of a stadium, every source is occluded), the number of phases grows up to 32. Only every
// 32nd source is then treated as unoccluded, and the rest of the usual quarter gets a bound of at
// least 1/512: the loudest sources are retested as often as before.
//
// Threads: the sampler's alone.
// Memory: 544 bytes per 1024 consecutive source numbers that contain an occluded one.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "common/flat_hash_map.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

class OcclusionUpperBounds {
 public:
  static constexpr std::uint32_t kPhases = 4, kMaxPhases = 32;    // powers of two
  static constexpr std::uint8_t kUnoccluded = 0, kOccluded = 15;  // the first and the last step

  // The step whose bound is the lowest that is not below a visibility.
  static std::uint8_t step_for(float visibility) {
    if (!(visibility > 0)) return kOccluded;
    const std::uint32_t exponent = std::bit_cast<std::uint32_t>(visibility) >> 23;
    return static_cast<std::uint8_t>(exponent >= 127 ? 0 : std::min(127 - exponent - 1, 14u));
  }

  // The visibility that a step stands for.
  static float bound_of(std::uint32_t step) {
    static constexpr auto kBounds = [] {
      std::array<float, 16> bounds{};
      for (std::size_t s = 0; s < kOccluded; ++s) bounds[s] = s == 0 ? 1 : bounds[s - 1] / 2;
      return bounds;
    }();
    return kBounds[step];
  }

  // Steps of 1024 consecutive numbers, as many as an octree page holds, eight to a word.
  static constexpr std::uint32_t kRow = 1024, kPerWord = 8;
  using Row = std::array<std::uint32_t, kRow / kPerWord>;

  // View of the bounds of the numbers from one on, within its row and the next, for kernels. Valid
  // until the next set().
  struct Window {
    const std::uint32_t* words = nullptr;        // of all rows; null: all bounds are 1
    std::int32_t first_word = 0, next_word = 0;  // where the row and the next one begin
    std::uint32_t first = 0;                     // offset of the first number in its row
    std::uint32_t phase = 0, phases = kPhases;
    float phase_bound = 1;  // least bound in the current phase

    // Upper bound of the visibility of number first + index, whose stored bound is `known`.
    float upper_bound(std::uint32_t index, float known) const {
      const std::uint32_t since = first + index - phase;
      if (words == nullptr || (since & (phases - 1)) == 0) return 1;
      return (since & (kPhases - 1)) == 0 ? std::max(known, phase_bound) : known;
    }

    // Prefetches the steps of half a row's numbers, as far as they are in this row.
    void prefetch() const {
      const std::uint32_t from = first / kPerWord;
      const std::uint32_t count = std::min(kRow / 2 / kPerWord, kRow / kPerWord - from);
      if (words != nullptr) prefetch_to_read(words + first_word + from, count * sizeof *words);
    }
  };

  OcclusionUpperBounds();

  void set(std::uint64_t number, std::uint8_t step);
  void clear();

  // Moves on to the next phase; `all` retests all sources in this keyframe.
  void begin_keyframe(bool all) {
    phase_ = (phase_ + 1) % phases_;
    all_ = all;
  }
  // Every fourth number shares a phase, whatever the number of phases.
  std::uint32_t phase() const { return phase_ % kPhases; }
  static std::uint32_t phase_of(std::uint64_t number) {
    return static_cast<std::uint32_t>(number % kPhases);
  }
  // Returns whether the keyframe treats a number as unoccluded.
  bool is_retested(std::uint64_t number) const { return all_ || number % phases_ == phase_; }
  std::uint32_t phases() const { return phases_; }

  // Adapts the number of phases to how many sources a keyframe found only because it retested them:
  // twice as many phases if more than `max_retested`, half if half the phases would find fewer.
  void adapt_phases(std::size_t retested, std::size_t max_retested) {
    if (retested > max_retested)
      phases_ = std::min(2 * phases_, kMaxPhases);
    else if (4 * retested < max_retested)
      phases_ = std::max(phases_ / 2, kPhases);
  }

  // The window from a number on, valid for this keyframe.
  Window window(std::uint64_t first) const {
    const std::uint32_t row = row_of(first), next = row_of(first + kRow);
    if (all_ || (row == 0 && next == 0)) return {};
    return {rows_.front().data(),
            static_cast<std::int32_t>(row * std::tuple_size_v<Row>),
            static_cast<std::int32_t>(next * std::tuple_size_v<Row>),
            static_cast<std::uint32_t>(first % kRow),
            phase_,
            phases_,
            phase_bound()};
  }

  // Upper bound of a number's visibility in this keyframe.
  float upper_bound(std::uint64_t number) const {
    const std::uint32_t word = rows_[row_of(number)][number % kRow / kPerWord];
    return upper_bound(number, bound_of(word >> (4 * (number % kPerWord)) & 15));
  }
  // Upper bound of a number whose stored bound is `known`.
  float upper_bound(std::uint64_t number, float known) const {
    if (is_retested(number)) return 1;
    return phase_of(number) == phase() ? std::max(known, phase_bound()) : known;
  }

 private:
  // Least bound of numbers in the current quarter that are not retested: 1/8 for twice the phases.
  float phase_bound() const {
    const float share = static_cast<float>(kPhases) / static_cast<float>(phases_);
    return share * share * share;
  }

  // Index into rows_ of a number's row.
  std::uint32_t row_of(std::uint64_t number) const {
    const std::uint32_t* row = row_of_.find(number / kRow);
    return row != nullptr ? *row : 0;
  }

  FlatHashMap<std::uint32_t> row_of_;  // by number / kRow
  std::vector<Row> rows_;              // row 0 has no occluded number
  std::uint32_t phase_ = 0, phases_ = kPhases;
  bool all_ = true;
};

}  // namespace clamor
