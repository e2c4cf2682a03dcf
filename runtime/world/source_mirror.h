// source_mirror.h: carries the sources and movable parts of a world, the powers of a level's
// emitters and the openness of its portals over to one auralizer, which has its own clock.
//
// The clock of the world runs on while an auralizer holds, and is read when keyframes are made,
// which is not regular. Their difference is therefore smoothed, and jumps only where it is wrong by
// more than a tenth of a second. An offline auralizer has the world's clock, from when it was made.
//
// Threads: the sampler's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/occlusion/moving_parts.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/world/world_sources.h"

namespace clamor {

class Auralizer;

class SourceMirror {
 public:
  // `auralizer` and `sources` must outlive this. The auralizer hears the sources of `level`.
  // `start_s` is the world's time at the auralizer's time 0 if it is offline; otherwise empty.
  SourceMirror(Auralizer& auralizer, WorldSources& sources, std::uint64_t level,
               std::optional<double> start_s);

  // Call before each keyframe: takes over the last commit, and reads live sounds as far as the
  // keyframe plays them.
  void update();

  // The handle of the sound in a slot of the auralizer, which may have been removed while its
  // voices fade out.
  std::uint64_t sound_of(std::size_t slot) const { return sound_slots_[slot].last_handle; }

 private:
  struct Slot {
    std::uint64_t identity = 0, version = 0;
    MovingHandle handle;
    double start_s = 0;  // on the auralizer's clock, or kStartsWhenHeard
    Vec3 position_m{}, velocity_mps{};
  };
  struct PartSlot {
    std::uint64_t handle = 0, version = 0;  // of the world
    PartHandle part{};                      // of the auralizer; generation 0: none
    bool is_added = false;
  };
  struct SoundSlot {
    std::uint64_t handle = 0;       // 0: none
    std::uint64_t last_handle = 0;  // stays when the sound is removed
    std::shared_ptr<WorldSound> sound{};
    bool plays = false;    // a source plays it
    bool is_read = false;  // a live sound that plays, or fades out
    double last_played_s = 0;
    double live_start_s = 0;  // when frame 0 of a live sound is emitted, while it is read
  };

  void update_start(double keyframe_s);
  bool take_over(const WorldSources::Commit& commit, double keyframe_s);
  void take_over_shares(const std::map<std::uint64_t, WorldSources::PowerShares>& levels,
                        std::uint64_t& version, void (Auralizer::*set)(std::vector<float>));
  void take_over_parts(std::span<const WorldParts::Committed> committed);
  void take_over_part(const WorldParts::Committed& committed, PartSlot& slot);
  bool has_sound(const WorldSources::Committed& source, double keyframe_s);
  bool add(std::size_t slot, const WorldSources::Committed& source, double keyframe_s);
  double start_of(const WorldSources::Committed& source, double keyframe_s) const;
  void clear_sound(std::size_t slot);
  void produce(double keyframe_s);

  Auralizer& auralizer_;
  WorldSources& sources_;
  const std::uint64_t level_;
  const bool offline_;
  std::optional<double> start_s_;
  std::uint64_t commits_ = 0;
  std::uint64_t emitters_version_ = 0, portals_version_ = 0;
  bool complete_ = true;  // every source of the last commit has been taken over
  std::vector<Slot> slots_;
  std::vector<PartSlot> part_slots_;
  std::vector<SoundSlot> sound_slots_;
  // They are freed outside of the world's lock, because the application may be told.
  std::vector<std::shared_ptr<WorldSound>> removed_sounds_;
  std::vector<double> voice_shares_;  // that are set, by number of the group
};

}  // namespace clamor
