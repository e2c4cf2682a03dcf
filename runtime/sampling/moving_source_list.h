// moving_source_list.h: moving sources as a pool that the sampler ranks together with the octree's.
//
// A flat list in which each source has a permanent u. Each keyframe moves all sources to their
// positions at its time. A source's weight, occlusion and direction are those of its position when
// the sound that arrives now left it (position_history.h), which is computed only for sources that
// may reach the threshold. A vectorised cull by distance and maximum weight finds these, since no
// distance has shrunk by much since the emission. With 100 000 sources that all move, a keyframe
// that chooses 2000 of them takes 2.1 ms of one core; with 10 000 sources, 0.5 ms
// (tests/benchmarks/moving_sources_benchmark.cpp).
//
// Occlusion is cached per position (visibility_cache.h): a source's number in that cache changes
// with the grid cell it is in, an eighth of its distance to the listener wide, and within a cell it
// is retested as it moves. Unlike static sources, which have baked counterparts behind walls,
// moving ones are also heard through walls that transmit sound.
//
// Threads: the sampler's alone.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/propagation/source_number.h"
#include "runtime/query/source_pool.h"
#include "runtime/sampling/group_limits.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/sampling/position_history.h"

namespace clamor {

class MovingSourceList final : public SourcePool {
 public:
  // The last `kinds` emitters are the kinds of moving sources. All arguments must outlive the list.
  MovingSourceList(MovingSources& sources, const RadiationModel& radiation,
                   const SignalWeights& weights, std::span<const Emitter> emitters,
                   std::size_t kinds);

  bool refresh() override;  // takes the newest commit
  void begin(const QueryKeyframe& keyframe) override;
  bool find_above(double threshold, std::size_t max_count,
                  std::vector<FoundSource>& found) override;
  double upper_bound() override;
  std::uint64_t size() const override { return moving_.max_sources(); }

  // Limits how many sources of a group are found (group_limits.h).
  void limit_group(std::uint16_t group, std::size_t max_voices) { limits_.set(group, max_voices); }

  // For the reflections of moving sources, by slot, after begin(). A source that was removed is
  // heard for `longest_s` more, with what it sounded until `end_s`. A slot without a source has no
  // reverberation.
  void set_longest_reflection(double longest_s) { longest_s_ = longest_s; }
  std::size_t slots() const { return moving_.now().count; }
  float reverberation(std::size_t slot) const {
    return *time_s_ > columns_.ends_s[slot] + longest_s_ ? 0 : settings(slot).reverberation;
  }
  // A signal is replaced: from the next sample on, sources that played it and were removed are
  // heard no more.
  void forget_removed(std::uint32_t signal) { forgotten_.push_back(signal); }
  double end_s(std::size_t slot) const { return columns_.ends_s[slot]; }
  const MovingSources::Settings& settings(std::size_t slot) const {
    return moving_.now().settings[slot];
  }
  Vec3 place_m(std::size_t slot) const {
    return {columns_.x_m[slot], columns_.y_m[slot], columns_.z_m[slot]};
  }
  std::uint32_t generation(std::size_t slot) const { return columns_.generations[slot]; }
  std::uint64_t number(std::size_t slot) const;
  std::uint32_t emitter(std::size_t slot) const { return columns_.sources[slot].emitter; }
  std::uint32_t signal(std::size_t slot) const { return radiation_.signal(columns_.sources[slot]); }
  const Bands& directivity(std::size_t slot) const {
    return kinds_[settings(slot).kind].directivity;
  }
  double start_s(std::size_t slot) const { return columns_.starts_s[slot]; }

  // The sound of one source at a place, without occlusion. The listener's mirror image hears the
  // source as the listener hears the source's image. Call it after begin().
  struct Heard {
    Source source;           // where the sound left it
    Vec3f velocity_mps{};    // and how fast it was
    std::uint64_t cell = 0;  // of its place, for numbers under which visibilities are cached
  };
  Heard heard_at(std::size_t slot, const Vec3& place) const;
  // Upper bound of its priority at 1 m from where it is now, times u; 0 without a source.
  double upper_bound_at_1m(std::size_t slot) const;
  // Upper bound of its priority there, times u; 0 without a source.
  double upper_bound_times_u(std::size_t slot, const Vec3& place) const;

 private:
  static constexpr double kNeverEnds = std::numeric_limits<double>::infinity();

  // State of each source, by slot.
  struct Columns {
    explicit Columns(std::size_t slots);

    std::vector<Source> sources;   // where sound left them
    std::vector<double> starts_s;  // of the sounds: a source's own delay is a float
    std::vector<double> ends_s;    // infinite: the source is present; -infinite: it never was
    std::vector<std::uint32_t> versions, generations;
    std::vector<float> x_m, y_m, z_m;        // now
    std::vector<float> max_priority;         // at 1 m on the axis; -1: the slot is free
    std::vector<Vec3f> velocity_mps;         // where sound left them,
    std::vector<std::uint32_t> emission_of;  // in the sample of this number
  };

  // The newest commit.
  struct Newest {
    std::uint64_t number = 0;
    double time_s = 0;       // that its positions are of
    bool is_unused = false;  // by samples
  };

  void set(std::size_t slot, double time_s);
  void end_forgotten();
  void move_all(double time_s);
  void find_emission(std::size_t slot, const Vec3& listener_m);
  double upper_bound(std::size_t slot, const Vec3& place) const;
  void apply_limits(const Vec3& place, std::size_t first, std::vector<FoundSource>& found);

  MovingSources& moving_;
  const RadiationModel& radiation_;
  const SignalWeights& weights_;
  const std::span<const Emitter> kinds_;
  const std::uint32_t first_emitter_;
  Newest newest_;
  std::optional<double> time_s_;  // of the last sample
  bool in_motion_ = false;
  double longest_s_ = 0;             // of reflections
  double last_end_s_ = -kNeverEnds;  // of all sources that were removed
  std::uint32_t sample_ = 0;         // counts samples
  Columns columns_;
  PositionHistory history_;
  GroupLimits limits_;
  std::vector<std::uint32_t> added_;      // slots, since the last sample
  std::vector<std::uint32_t> forgotten_;  // signals, since the last sample
};

}  // namespace clamor
