// signal_maps.h: signals that instances play in place of their prototype's, also in nested
// instances.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/bake_file/instance.h"

namespace clamor {

// A file's signal maps, and compositions of them, which are made on demand. Not thread-safe.
class SignalMaps {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;  // the identity

  explicit SignalMaps(std::span<const std::vector<std::uint32_t>> of_file)
      : file_count_(of_file.size()),
        maps_(of_file.begin(), of_file.end()),
        composed_(of_file.size() + 1) {}

  std::uint32_t signal(std::uint32_t map, std::uint32_t signal) const {
    return map == kNone ? signal : maps_[map][signal];
  }

  // The map of an instance with the map `inner` of the file, nested in one with the map `outer`.
  std::uint32_t composed(std::uint32_t outer, std::uint32_t inner) {
    if (inner == kSameSignals) return outer;
    if (outer == kNone) return inner;
    if (composed_[outer].empty()) composed_[outer].assign(file_count_, kNone);
    if (composed_[outer][inner] == kNone) {
      std::vector<std::uint32_t> map = maps_[inner];
      for (std::uint32_t& signal : map) signal = maps_[outer][signal];
      composed_[outer][inner] = static_cast<std::uint32_t>(maps_.size());
      maps_.push_back(std::move(map));
      composed_.resize(maps_.size() + 1);
    }
    return composed_[outer][inner];
  }

 private:
  std::size_t file_count_;
  std::vector<std::vector<std::uint32_t>> maps_;
  std::vector<std::vector<std::uint32_t>> composed_;  // by outer and inner map; kNone: not made yet
};

}  // namespace clamor
