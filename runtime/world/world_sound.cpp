#include "runtime/world/world_sound.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "formats/bake_file/signal_envelope.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/propagation/loudness.h"

namespace clamor {

namespace {

constexpr std::int64_t kFeedPart_frames = 960;  // of a feed, read at a time
constexpr double kLevelFall = 0.985;            // per part: -13 dB in two seconds
// Feeds never count as silent, so that voices are there when they begin to speak: -60 dB.
constexpr double kMinMeanSquare = 1e-6;

bool is_prepared_for(const MixMode& one, const MixMode& other) {
  return one.two_layers() == other.two_layers() && one.head == other.head &&
         one.interpolation == other.interpolation;
}

}  // namespace

WorldSound::WorldSound(Signal signal)
    : signal_(std::move(signal)),
      weights_(
          make_loudness_track({SignalEnvelope(signal_), signal_.samples.size(), signal_.loop})) {}

WorldSound::WorldSound(std::unique_ptr<LiveFeed> feed) : weights_({}, {}), feed_(std::move(feed)) {}

double WorldSound::duration_s() const {
  if (is_live() || signal_.loop) return std::numeric_limits<double>::infinity();
  return static_cast<double>(signal_.samples.size()) / kSampleRate_hz;
}

SlotSignal WorldSound::for_mode(const MixMode& mode) {
  const std::lock_guard lock(mutex_);
  auto found = std::find_if(prepared_.begin(), prepared_.end(),
                            [&](const Prepared& one) { return is_prepared_for(one.mode, mode); });
  if (found == prepared_.end()) {
    Prepared made{mode, nullptr, nullptr, nullptr};
    if (is_live()) {
      made.live = std::make_shared<LiveSignal>(mode, arrived_ / kLowRate * kLowRate);
      made.signal = std::shared_ptr<const PreparedSignal>(made.live, &made.live->signal());
    } else {
      made.signal = std::make_shared<const PreparedSignal>(signal_, mode);
      if (signal_.loop)
        made.onset = std::make_shared<const PreparedSignal>(onset_of(signal_.samples), mode);
    }
    found = prepared_.insert(prepared_.end(), std::move(made));
  }
  return {found->signal, found->onset, is_live() ? weights_now() : weights_};
}

void WorldSound::produce(std::int64_t end) {
  const std::lock_guard lock(mutex_);
  while (arrived_ < end + LiveSignal::kLatency_frames) {
    std::array<float, kFeedPart_frames> part;
    feed_->read(part);
    double sum = 0;
    for (const float sample : part) sum += static_cast<double>(sample) * sample;
    mean_square_ = std::max(kLevelFall * mean_square_, sum / kFeedPart_frames);
    for (const Prepared& one : prepared_) one.live->append(part);
    arrived_ += kFeedPart_frames;
  }
}

std::int64_t WorldSound::produced() const {
  const std::lock_guard lock(mutex_);
  return arrived_;
}

LoudnessTrack WorldSound::live_weights() const {
  const std::lock_guard lock(mutex_);
  return weights_now();
}

// The level counts for all bands alike, and full scale in each is the maximum.
LoudnessTrack WorldSound::weights_now() const {
  const Bands max = loudness_weights();
  Bands weights = max;
  const double share = std::clamp(mean_square_ / kBandCount, kMinMeanSquare, 1.0);
  for (float& weight : weights) weight *= static_cast<float>(share);
  return {weights, max};
}

}  // namespace clamor
