// output_channels.h: how many channels the output may have.
#pragma once

#include <array>
#include <cstddef>

namespace clamor {

inline constexpr std::size_t kMaxChannels = 16;
using ChannelGains = std::array<float, kMaxChannels>;

}  // namespace clamor
