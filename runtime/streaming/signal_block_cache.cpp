#include "runtime/streaming/signal_block_cache.h"

#include <algorithm>

namespace clamor {

Result<SignalBlockCache::Block> SignalBlockCache::block(std::size_t signal, std::size_t block,
                                                        bool keep) {
  const auto find = [&] {
    return std::find_if(kept_.begin(), kept_.end(), [&](const Kept& one) {
      return one.signal == signal && one.block == block;
    });
  };
  {
    const std::lock_guard lock(mutex_);
    if (const auto it = find(); it != kept_.end()) {
      std::rotate(it, it + 1, kept_.end());
      return kept_.back().samples;
    }
  }
  auto decoded = decode_(signal, block);
  if (!decoded.ok()) return decoded.error();
  Block samples = std::make_shared<const std::vector<float>>(std::move(*decoded));
  if (!keep || max_kept_ == 0) return samples;
  const std::lock_guard lock(mutex_);
  if (find() != kept_.end()) return samples;  // another thread has read it meanwhile
  if (kept_.size() == max_kept_) kept_.erase(kept_.begin());
  kept_.push_back({signal, block, samples});
  return samples;
}

Result<std::vector<double>> SignalBlockCache::read(std::size_t signal,
                                                   const SignalDescription& shape,
                                                   std::int64_t first, std::size_t frames) {
  std::vector<double> samples(frames);
  const auto size = static_cast<std::int64_t>(shape.frames);
  const bool cut = signal_blocks(shape.frames) > 1;
  for (std::size_t done = 0; done < frames && size > 0;) {
    std::int64_t at = first + static_cast<std::int64_t>(done);
    if (shape.loop) at = (at % size + size) % size;
    if (at >= size) break;
    if (at < 0) {
      done += static_cast<std::size_t>(-at);
      continue;
    }
    const std::size_t number = cut ? static_cast<std::size_t>(at) / kSignalBlockFrames : 0;
    const SignalBlock where = signal_block(shape.frames, number);
    const auto part = block(signal, number, cut);
    if (!part.ok()) return part.error();
    const auto skipped = static_cast<std::size_t>(at - where.first);
    const std::size_t count = std::min((*part)->size() - skipped, frames - done);
    std::copy_n((*part)->begin() + static_cast<std::ptrdiff_t>(skipped), count,
                samples.begin() + static_cast<std::ptrdiff_t>(done));
    done += count;
  }
  return samples;
}

}  // namespace clamor
