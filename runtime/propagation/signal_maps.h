// signal_maps.h: what copies play instead, and copies within copies: one map after another.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/bake_file/instance.h"

namespace clamor {

// Those of a file, and those that come of them on the way. Not thread-safe.
class SignalMaps {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;  // every signal is itself

  explicit SignalMaps(std::span<const std::vector<std::uint32_t>> of_file)
      : file_count_(of_file.size()),
        maps_(of_file.begin(), of_file.end()),
        inside_(of_file.size() + 1) {}

  std::uint32_t signal(std::uint32_t map, std::uint32_t signal) const {
    return map == kNone ? signal : maps_[map][signal];
  }

  // Of what a copy plays by `inner`, one of the file's, in one that plays by `outer`.
  std::uint32_t composed(std::uint32_t outer, std::uint32_t inner) {
    if (inner == kSameSignals) return outer;
    if (outer == kNone) return inner;
    if (inside_[outer].empty()) inside_[outer].assign(file_count_, kNone);
    if (inside_[outer][inner] == kNone) {
      std::vector<std::uint32_t> map = maps_[inner];
      for (std::uint32_t& signal : map) signal = maps_[outer][signal];
      inside_[outer][inner] = static_cast<std::uint32_t>(maps_.size());
      maps_.push_back(std::move(map));
      inside_.resize(maps_.size() + 1);
    }
    return inside_[outer][inner];
  }

 private:
  std::size_t file_count_;
  std::vector<std::vector<std::uint32_t>> maps_;
  std::vector<std::vector<std::uint32_t>> inside_;  // by outer and inner, where it was asked for
};

}  // namespace clamor
