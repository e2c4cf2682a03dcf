#include "runtime/world/world_listener.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/platform/prefault_code.h"
#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer.h"

namespace clamor {

namespace {

constexpr std::size_t kPart_frames = 256;  // rendered at a time into planes

std::uint64_t frames_of(double time_s) {
  return static_cast<std::uint64_t>(std::llround(time_s * kSampleRate_hz));
}

}  // namespace

WorldListener::WorldListener(Ears first, const Options& options,
                             std::unique_ptr<Resampler> resampler)
    : options_(options),
      mode_(first.auralizer->mode()),
      current_(std::move(first)),
      mixed_(*current_.auralizer),
      resampler_(std::move(resampler)),
      part_(kPart_frames * mixed_.channels()) {
  moved_.publish(options.listener);
}

WorldListener::~WorldListener() = default;

Result<WorldListener::Ears> WorldListener::listen(const Place& place, const Options& options,
                                                  double begins_s) {
  auto auralizer = Auralizer::create(place.level, options.auralizer);
  if (!auralizer.ok()) return auralizer.error();
  Ears ears{std::move(*auralizer), nullptr, begins_s};
  if (options.sources == nullptr) return ears;
  const bool offline = options.auralizer.wait_for_pages;
  ears.sources = std::make_unique<SourceMirror>(*ears.auralizer, *options.sources, place.handle,
                                                offline ? std::optional(begins_s) : std::nullopt);
  // Prepared here, so that the sampler does not have to.
  for (const auto& sound : options.sources->all_sounds())
    (void)sound->for_mode(ears.auralizer->mode());
  return ears;
}

Result<std::shared_ptr<WorldListener>> WorldListener::create(const Place& place,
                                                             const Options& options) {
  auto ears = listen(place, options, 0);
  if (!ears.ok()) return ears.error();
  prefault_library_code();
  std::unique_ptr<Resampler> resampler;
  if (options.rate_hz != kSampleRate_hz) {
    auto made = Resampler::create(ears->auralizer->channels(), kSampleRate_hz, options.rate_hz);
    if (!made.ok()) return made.error();
    resampler = std::move(*made);
  }
  std::shared_ptr<WorldListener> listener(
      new WorldListener(std::move(*ears), options, std::move(resampler)));
  // In real time, sound begins with the first block. An offline listener's poses come first.
  if (!options.auralizer.wait_for_pages) make_first_keyframes(listener->current_, options.listener);
  return listener;
}

Result<void> WorldListener::enter(const Place& place) {
  Options options = options_;
  {
    const std::lock_guard lock(making_);
    options.auralizer.begins_s = time_s();
  }
  auto next = listen(place, options, options.auralizer.begins_s);
  if (!next.ok()) return next.error();
  const std::lock_guard lock(making_);
  incoming_ = std::move(*next);
  return {};
}

double WorldListener::time_s() const {
  return current_.begins_s + current_.auralizer->next_keyframe_time_s();
}

AuralizerStatistics WorldListener::statistics() {
  const std::lock_guard lock(making_);
  return current_.auralizer->statistics();
}

bool WorldListener::make_keyframe(Ears& ears, const Listener& listener) {
  Auralizer& auralizer = *ears.auralizer;
  auralizer.turn_head(listener);
  if (!auralizer.wants_keyframe()) return false;
  if (ears.sources != nullptr) ears.sources->update();
  auralizer.make_keyframe(listener);
  return true;
}

void WorldListener::make_first_keyframes(Ears& ears, const Listener& listener) {
  while (make_keyframe(ears, listener)) {
  }
}

bool WorldListener::make_keyframes() {
  const std::lock_guard lock(making_);
  const Listener& listener = moved_.latest();
  if (outgoing_.auralizer != nullptr && mixed_.has_faded()) outgoing_ = {};
  if (incoming_.auralizer != nullptr && outgoing_.auralizer == nullptr) {
    const double now_s = time_s();
    incoming_.auralizer->skip(frames_of(now_s - incoming_.begins_s));
    make_first_keyframes(incoming_, listener);
    outgoing_ = std::exchange(current_, std::move(incoming_));
    incoming_ = {};
    mixed_.fade_to(*current_.auralizer, frames_of(now_s));
  }
  bool made = false;
  for (Ears* const heard : {&current_, &outgoing_})
    made = (heard->auralizer != nullptr && make_keyframe(*heard, listener)) || made;
  // The first keyframes are made before the application may have moved its listener into the level.
  if (made) current_.auralizer->check_place(Auralizer::PlaceOf::kListener, listener.position_m);
  return made;
}

std::optional<double> WorldListener::wanted_keyframe_s() {
  const std::lock_guard lock(making_);
  if (!current_.auralizer->wants_keyframe()) return {};
  return options_.auralizer.wait_for_pages ? time_s() : current_.auralizer->next_keyframe_time_s();
}

bool WorldListener::load() {
  const std::lock_guard lock(making_);
  for (const Ears* const heard : {&current_, &outgoing_})
    if (heard->auralizer != nullptr && heard->auralizer->load()) return true;
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
