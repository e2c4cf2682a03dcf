// listened_room.h: a room of the C interface with an offline listener who hears all its sources.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "runtime/clamor.h"
#include "tests/library/library_room.h"

namespace clamor::testing {

struct ListenedRoom {
  explicit ListenedRoom(const std::string& path = room()) : level(open_level(context, path)) {
    clamor_listener_options options = offline();
    options.voices = 100'000;
    options.mixing = CLAMOR_MIXING_VOICES;
    listener = add_listener(context, level, options);
  }

  void commit() const { ASSERT_EQ(clamor_commit(context.get(), 0), CLAMOR_OK); }

  // The next quarter of a second of the first channel.
  std::vector<float> heard() const { return heard(listener); }
  std::vector<float> heard(clamor_listener by) const {
    std::vector<float> left, block(2 * 480);
    while (left.size() < kSampleRate_hz / 4) {
      EXPECT_EQ(clamor_update(context.get(), 0, nullptr), CLAMOR_OK);
      EXPECT_EQ(clamor_render(context.get(), by, block.data(), 480), CLAMOR_OK);
      for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
    }
    return left;
  }

  Context context = make_context();
  clamor_level level = 0;
  clamor_listener listener = 0;
};

// Largest of |a - factor b|.
inline double largest_difference(const std::vector<float>& a, const std::vector<float>& b,
                                 double factor = 1) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, std::abs(1.0 * a[i] - factor * b[i]));
  return largest;
}

inline double peak(const std::vector<float>& samples) {
  return largest_difference(samples, samples, 0);
}

}  // namespace clamor::testing
