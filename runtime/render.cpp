#include "runtime/render.h"

#include <algorithm>
#include <vector>

namespace clamor {

void make_keyframes(Auralizer& auralizer, const Walk& walk) {
  while (auralizer.wants_keyframe())
    auralizer.make_keyframe(walk.at(auralizer.next_keyframe_time_s()));
}

Result<void> render(Auralizer& auralizer, const Walk& walk, std::uint64_t frames,
                    const BlockSink& sink) {
  constexpr std::uint64_t kBlock_frames = kKeyframeFrames;
  const auto channels = static_cast<std::size_t>(auralizer.channels());
  std::vector<float> block(kBlock_frames * channels);
  for (std::uint64_t done = 0; done < frames;) {
    make_keyframes(auralizer, walk);
    const std::uint64_t count = std::min(kBlock_frames, frames - done);
    const std::span<float> part(block.data(), count * channels);
    auralizer.mix(part);
    if (const auto taken = sink(part); !taken.ok()) return taken;
    done += count;
  }
  return {};
}

}  // namespace clamor
