#include "runtime/world/world_listener.h"

#include <algorithm>
#include <utility>

#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer.h"
#include "runtime/realtime/prefault_code.h"

namespace clamor {

namespace {

constexpr std::size_t kPart_frames = 256;  // rendered at a time into planes

}  // namespace

WorldListener::WorldListener(std::unique_ptr<Auralizer> first, const Options& options,
                             std::unique_ptr<Resampler> resampler)
    : options_(options.auralizer),
      current_(std::move(first)),
      mixed_(*current_),
      resampler_(std::move(resampler)),
      part_(kPart_frames * mixed_.channels()) {
  moved_.publish(options.listener);
}

WorldListener::~WorldListener() = default;

Result<std::shared_ptr<WorldListener>> WorldListener::create(std::shared_ptr<const BakeFile> level,
                                                             const Options& options) {
  auto auralizer = Auralizer::create(std::move(level), options.auralizer);
  if (!auralizer.ok()) return auralizer.error();
  prefault_library_code();
  std::unique_ptr<Resampler> resampler;
  if (options.rate_hz != kSampleRate_hz) {
    auto made = Resampler::create((*auralizer)->channels(), kSampleRate_hz, options.rate_hz);
    if (!made.ok()) return made.error();
    resampler = std::move(*made);
  }
  std::shared_ptr<WorldListener> listener(
      new WorldListener(std::move(*auralizer), options, std::move(resampler)));
  // In real time, sound begins with the first block. An offline listener's poses come first.
  if (!options.auralizer.wait_for_pages)
    make_first_keyframes(*listener->current_, options.listener);
  return listener;
}

Result<void> WorldListener::enter(std::shared_ptr<const BakeFile> level) {
  auto next = Auralizer::create(std::move(level), options_);
  if (!next.ok()) return next.error();
  const std::lock_guard lock(making_);
  incoming_ = std::move(*next);
  return {};
}

AuralizerStatistics WorldListener::statistics() {
  const std::lock_guard lock(making_);
  return current_->statistics();
}

void WorldListener::make_first_keyframes(Auralizer& auralizer, const Listener& listener) {
  auralizer.turn_head(listener);
  while (auralizer.wants_keyframe()) auralizer.make_keyframe(listener);
}

bool WorldListener::make_keyframes() {
  const std::lock_guard lock(making_);
  const Listener& listener = moved_.latest();
  if (outgoing_ != nullptr && mixed_.has_faded()) outgoing_.reset();
  if (incoming_ != nullptr && outgoing_ == nullptr) {
    make_first_keyframes(*incoming_, listener);
    outgoing_ = std::exchange(current_, std::move(incoming_));
    mixed_.fade_to(*current_);
  }
  bool made = false;
  for (Auralizer* const heard : {current_.get(), outgoing_.get()}) {
    if (heard == nullptr) continue;
    heard->turn_head(listener);
    if (!heard->wants_keyframe()) continue;
    heard->make_keyframe(listener);
    made = true;
  }
  return made;
}

std::optional<double> WorldListener::wanted_keyframe_s() {
  const std::lock_guard lock(making_);
  if (!current_->wants_keyframe()) return {};
  return current_->next_keyframe_time_s();
}

bool WorldListener::load() {
  const std::lock_guard lock(making_);
  for (Auralizer* const heard : {current_.get(), outgoing_.get()})
    if (heard != nullptr && heard->load()) return true;
  return false;
}

void WorldListener::render(std::span<float> interleaved) noexcept {
  if (resampler_ == nullptr) return mixed_.mix(interleaved);
  const auto fill = [](void* mixed, std::span<float> block) noexcept {
    static_cast<AuralizerCrossfade*>(mixed)->mix(block);
  };
  resampler_->read(interleaved, {fill, &mixed_});
}

void WorldListener::render(float* const* planes, std::size_t frames) noexcept {
  const std::size_t count = channels();
  for (std::size_t done = 0; done < frames;) {
    const std::size_t now = std::min(kPart_frames, frames - done);
    render(std::span(part_).first(now * count));
    for (std::size_t c = 0; c < count; ++c)
      for (std::size_t i = 0; i < now; ++i) planes[c][done + i] = part_[i * count + c];
    done += now;
  }
}

}  // namespace clamor
