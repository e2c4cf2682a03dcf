// tap_choice.h: which sources of a sample may be taps, where sources move or signals come and go.
//
// Sources that play a signal from about the same time on share a response, whose partitions cost as
// much as some voices each. A signal is worth a response if enough sources play it: most of a crowd
// that begins at thousands of times is not. Of the others, these are voices too:
//
//   * what moves, because only voices glide: direct sounds and images of moving sources;
//   * what is about to begin, because a tap fades in, and a loop has no silence before it;
//   * what a live signal plays at once: the mixer reads taps' signals some blocks ahead.
//
// Threads: the sampler's. Cost: some 50 ns per source.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/listener.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/sampling/sampler.h"
#include "runtime/streaming/playable_signals.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

// A partition of a response costs as much as so many voices: transforming it takes 24 us every four
// keyframes and multiplying it 1 to 2 us in each, a voice 0.3 us more than a tap.
inline constexpr std::size_t kTapsPerPartition = 24;
inline constexpr std::size_t kMaxFieldInputs = 64;
// Taps of a live signal are at least so much later than what it sounds.
inline constexpr std::int64_t kLiveLead_frames = 4 * kKeyframeFrames;

// Sources that begin to play a signal within one step of this grid share a response, in which the
// later ones have longer delays. Taps of a live signal cannot: it is not known ahead.
inline constexpr std::int64_t kFieldStart_frames = 32 * kKeyframeFrames;

// From when on taps play a signal that begins at this time.
std::int64_t field_start_frames(double begins_frames, bool is_live);
std::int64_t field_start_frames(const SampledSource& source, double emission_frames,
                                const PlayableSignals& signals);

class TapChoice {
 public:
  // References and `signals` must outlive this. A response is worth its cost from so many taps per
  // partition on.
  TapChoice(const RadiationModel& radiation, PlayableSignals signals, std::size_t min_taps)
      : radiation_(radiation), signals_(signals), min_taps_(min_taps) {}

  // The numbers of those sources of a sample that must be voices, ascending. `voices` are those of
  // the sample before that were voices.
  std::span<const std::uint64_t> voices(std::span<const SampledSource> sample,
                                        const Listener& listener, double now_frames,
                                        std::span<const std::uint64_t> voices_before);

 private:
  static constexpr double kBegins_frames = 0.25 * kSampleRate_hz;  // before the sound arrives
  static constexpr double kBegan_frames = 0.1 * kSampleRate_hz;    // after it has arrived

  struct Group {
    std::uint32_t signal;
    std::int64_t start_frames;
    bool operator==(const Group&) const = default;
  };
  struct Hash {
    std::size_t operator()(const Group& group) const {
      return std::hash<std::int64_t>()(group.start_frames * 4099 + group.signal);
    }
  };
  struct Members {
    std::size_t count = 0;
    double first_frames = 0, last_frames = 0;  // delays
    bool is_worth_it = false, was_worth_it = false;
  };

  bool may_be_tap(const SampledSource& one, double arrival_frames, double now_frames,
                  bool was_tap) const;
  void choose_groups();

  const RadiationModel& radiation_;
  const PlayableSignals signals_;
  const std::size_t min_taps_;  // per partition
  std::unordered_map<Group, Members, Hash> groups_;
  std::vector<std::uint64_t> last_sample_, numbers_, voices_;  // ascending
  std::vector<const Members*> members_;                        // by source; null: a voice
  std::vector<std::size_t> counts_;                            // scratch memory
};

}  // namespace clamor
