// world_sources.h: the sounds, sources, groups and movable parts that an application adds to a
// world, how loud it lets the emitters of levels be, and how open their portals.
//
// Changes are collected until commit(), which all listeners then take over together
// (source_mirror.h). There are two clocks: the steady clock, for listeners in real time, and the
// one of offline listeners, which the application tells with each commit.
//
// A source that is given no velocity gets the one between its last two commits, so that Doppler is
// steady although commits and keyframes do not coincide.
//
// Threads: any; calls take turns for microseconds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/world/handle_table.h"
#include "runtime/world/world_parts.h"
#include "runtime/world/world_sound.h"

namespace clamor {

inline constexpr std::size_t kMaxWorldSources = 65'536, kMaxWorldSounds = 4096,
                             kMaxWorldGroups = 256;
inline constexpr double kMaxWorldGain = 1e6;    // 120 dB, of a source with its group
inline constexpr double kMaxWorldTime_s = 5e6;  // on either clock; the mixer's limit is 66 days

// A moment on both clocks, or a duration.
struct WorldTime {
  double real_s = 0, offline_s = 0;

  double of(bool offline) const { return offline ? offline_s : real_s; }
  WorldTime& operator+=(const WorldTime& other) {
    real_s += other.real_s;
    offline_s += other.offline_s;
    return *this;
  }
  friend WorldTime operator-(const WorldTime& a, const WorldTime& b) {
    return {a.real_s - b.real_s, a.offline_s - b.offline_s};
  }
};

struct SourceMotion {
  Vec3 position_m{};
  Vec3 velocity_mps{};  // 0: between the last two commits
  Vec3 axis{0, 0, -1};
};

struct WorldSource {
  std::uint64_t sound = 0, group = 0;  // handles; no group: 0
  std::uint64_t level = 0;             // handle of the only level where it is heard; 0: in all
  SourceMotion motion;
  Bands gain = same_in_all_bands(1);
  Bands directivity{};
  float reverberation = 1;  // amplitude of its reflections
  double played_s = 0;      // of the sound, when the source begins
  bool ends_with_sound = false;
};

// An emitter of a level, with all its reflections.
struct WorldEmitter {
  double gain = 1;          // amplitude, relative to the level's, 0 to 1
  std::uint64_t group = 0;  // handle; no group: 0
};

struct WorldGroup {
  double gain = 1;
  bool paused = false;
  double voice_share = 1;  // of a listener's voices, at most
};

class WorldSources {
 public:
  // `tag` distinguishes handles; it and the three numbers after it must be no other table's.
  WorldSources(std::size_t max_sources, std::size_t max_sounds, std::uint64_t tag);

  std::size_t max_sources() const { return sources_.capacity(); }
  std::size_t max_sounds() const { return sounds_.capacity(); }

  // Handles of new objects, or 0 if there are as many as there can be.
  std::uint64_t add(std::shared_ptr<WorldSound> sound);
  std::uint64_t add(const WorldGroup& group);
  std::uint64_t add(const WorldSource& source);  // whose handles exist

  std::shared_ptr<WorldSound> sound(std::uint64_t handle) const;
  bool has_group(std::uint64_t handle) const;
  std::vector<std::shared_ptr<WorldSound>> all_sounds() const;

  // For the thread that writes a live sound, without a lock.
  HandleTable<WorldSound>& written() noexcept { return sounds_; }

  // False if the handle names nothing. The sources of a sound end with it, and those of a group
  // leave it.
  bool remove_sound(std::uint64_t handle);
  bool remove_group(std::uint64_t handle);
  bool remove_source(std::uint64_t handle);
  bool set_group(std::uint64_t handle, const WorldGroup& group);
  bool change(std::uint64_t handle, const WorldSource& source);  // another sound begins anew
  bool move(std::uint64_t handle, const SourceMotion& motion);

  // Changes one of the `count` emitters of a level, whose handle exists.
  void change_emitter(std::uint64_t level, std::size_t emitter, std::size_t count,
                      const WorldEmitter& changed);
  // Opens or closes one of the `count` portals of a level, whose handle exists: 0 to 1, or
  // kOpenedByParts.
  void set_portal(std::uint64_t level, std::size_t portal, std::size_t count, double openness);
  // Forgets a level that is closed. Listeners who are still there hear its emitters and portals as
  // they are.
  void forget_level(std::uint64_t level);

  // Calls act(parts) while nothing else changes.
  template <class Act>
  auto with_parts(const Act& act) {
    const std::lock_guard lock(mutex_);
    return act(parts_);
  }

  // Publishes all changes since the last commit.
  void commit(const WorldTime& time);

  // A source as of the last commit, by slot.
  struct Committed {
    std::uint64_t identity = 0;  // grows with each beginning; 0: silent
    std::uint64_t version = 0;   // grows with each change
    std::uint64_t sound_handle = 0;
    std::shared_ptr<WorldSound> sound;
    std::uint64_t level = 0;
    MovingSource moving;  // without its kind and its start, which differ between listeners
    Bands directivity{};
    WorldTime begin;  // of the sound
  };
  // Shares of power, 0 to 1, by emitter or by portal.
  struct PowerShares {
    std::vector<float> shares;
    std::uint64_t version = 0;  // grows with each change

    void update(const std::vector<float>& now) {
      if (now == shares) return;
      shares = now;
      ++version;
    }
  };
  struct Commit {
    std::vector<Committed> sources;     // by slot
    std::vector<std::uint64_t> sounds;  // handles, by slot; 0: none
    std::vector<double> voice_shares;   // by number of the group
    // By handle of the level, of those changed.
    std::map<std::uint64_t, PowerShares> emitters, portals;
    std::vector<WorldParts::Committed> parts;  // by slot
    WorldTime time;
    std::uint64_t number = 0;
  };
  // Calls act(commit) while nothing changes. `act` must not call back.
  template <class Act>
  void visit(const Act& act) const {
    const std::lock_guard lock(mutex_);
    act(commit_);
  }

  static double now_s();

 private:
  struct Group {
    WorldGroup now;
    std::uint64_t version = 1;
  };
  struct Source {
    WorldSource now;
    std::uint64_t handle = 0;
    std::uint64_t version = 1;  // of `now`
    bool begins = true;         // its sound begins with the next commit
  };
  // The state of a source at the last commit, by slot.
  struct SlotState {
    std::uint64_t handle = 0;  // 0: none
    std::uint64_t version = 0, group_version = 0;
    std::optional<WorldTime> paused_at;
  };
  static std::uint16_t group_number(std::uint64_t handle) {
    return static_cast<std::uint16_t>(HandleTable<Group>::slot_number(handle) + 1);
  }
  void commit(Source& source, Committed& committed, SlotState& state, const WorldTime& time);
  void commit_emitters();
  double group_gain(std::uint64_t handle) const;  // 0 while it is paused

  mutable std::mutex mutex_;
  HandleTable<WorldSound> sounds_;
  HandleTable<Group> groups_;
  HandleTable<Source> sources_;
  WorldParts parts_;

  std::map<std::uint64_t, std::vector<WorldEmitter>> emitters_;  // by handle of the level
  bool emitters_changed_ = false;                                // or a group, since the commit
  std::map<std::uint64_t, std::vector<float>> portals_;          // by handle of the level
  std::vector<SlotState> states_;
  Commit commit_;
  std::uint64_t identities_ = 0;
};

}  // namespace clamor
