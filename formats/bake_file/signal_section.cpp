#include "formats/bake_file/signal_section.h"

#include <cmath>
#include <utility>

#include "common/thread_team.h"
#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/level/signal.h"

namespace clamor {

float signal_scale(const Signal& signal) {
  float peak = 1;
  for (const float sample : signal.samples) peak = std::max(peak, std::abs(sample));
  return peak;
}

Result<std::vector<std::vector<std::byte>>> pack_signal_blocks(const Signal& signal, float scale) {
  const std::uint64_t frames = signal.samples.size();
  std::vector<Result<std::vector<std::byte>>> packed_blocks(signal_blocks(frames),
                                                            Error("is not packed"));
  const auto pack = [&](std::size_t i) {
    const SignalBlock block = signal_block(frames, i);
    const auto first = signal.samples.begin() + static_cast<std::ptrdiff_t>(block.first);
    std::vector<float> scaled(first, first + static_cast<std::ptrdiff_t>(block.frames));
    if (scale != 1)
      for (float& sample : scaled) sample /= scale;
    packed_blocks[i] = encode_flac(scaled);
  };
  team_for(0, packed_blocks.size(), pack);
  std::vector<std::vector<std::byte>> blocks;
  for (auto& block : packed_blocks) {
    if (!block.ok()) return block.error();
    blocks.push_back(std::move(*block));
  }
  return blocks;
}

Result<std::vector<float>> unpack_signal_block(std::span<const std::byte> flac,
                                               std::uint64_t frames, float scale) {
  auto samples = decode_flac(flac, frames);
  if (!samples.ok()) return samples.error();
  if (samples->size() != frames) return Error("has the wrong length");
  if (scale != 1)
    for (float& sample : *samples) sample *= scale;
  return samples;
}

std::vector<std::byte> pack_envelope(const SignalEnvelope& envelope) {
  const auto steps = envelope.steps();
  std::vector<std::byte> differences(steps.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::uint8_t before = i % envelope.moments() == 0 ? 0 : steps[i - 1];
    differences[i] = static_cast<std::byte>(static_cast<std::uint8_t>(steps[i] - before));
  }
  return packed(differences);
}

Result<SignalEnvelope> unpack_envelope(std::span<const std::byte> section, std::uint64_t frames,
                                       const Bands& mean_square) {
  const auto moments = static_cast<std::size_t>(moments_of(frames));
  const auto differences = unpacked(section, kBandCount * moments);
  if (!differences.ok()) return differences.error();
  std::vector<std::uint8_t> steps(differences->size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::uint8_t before = i % moments == 0 ? 0 : steps[i - 1];
    steps[i] = static_cast<std::uint8_t>(before + static_cast<std::uint8_t>((*differences)[i]));
  }
  return SignalEnvelope::from_steps(mean_square, std::move(steps));
}

}  // namespace clamor
