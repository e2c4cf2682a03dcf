#include "runtime/world/world_sources.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "formats/bake_file/baked_portals.h"

namespace clamor {

namespace {

// Commits further apart than this, and faster movements, tell no velocity.
constexpr double kMaxInterval_s = 0.25, kMaxSpeed_mps = 150;
// A sound that has ended may still be travelling.
constexpr double kTravel_s = 3;

// The clock of offline listeners stands still where there are none.
double interval_s(const WorldTime& time) {
  return time.offline_s != 0 ? time.offline_s : time.real_s;
}

Vec3 velocity_between(const Vec3& from_m, const Vec3& to_m, double seconds) {
  if (!(seconds > 0 && seconds <= kMaxInterval_s)) return {};
  const Vec3 velocity_mps = (to_m - from_m) / seconds;
  return length(velocity_mps) <= kMaxSpeed_mps ? velocity_mps : Vec3{};
}

}  // namespace

WorldSources::WorldSources(std::size_t max_sources, std::size_t max_sounds, std::uint64_t tag)
    : sounds_(max_sounds, tag),
      groups_(kMaxWorldGroups, tag + 1),
      sources_(max_sources, tag + 2),
      parts_(tag + 3),
      states_(max_sources) {
  commit_.sources.resize(max_sources);
  commit_.sounds.resize(max_sounds);
  commit_.voice_shares.assign(kMaxWorldGroups + 1, 1.0);
}

double WorldSources::now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::uint64_t WorldSources::add(std::shared_ptr<WorldSound> sound) {
  const std::lock_guard lock(mutex_);
  return sounds_.insert(std::move(sound));
}

std::uint64_t WorldSources::add(const WorldGroup& group) {
  const std::lock_guard lock(mutex_);
  return groups_.insert(std::make_shared<Group>(Group{group}));
}

std::uint64_t WorldSources::add(const WorldSource& source) {
  const std::lock_guard lock(mutex_);
  const auto added = std::make_shared<Source>(Source{source});
  added->handle = sources_.insert(added);
  return added->handle;
}

std::shared_ptr<WorldSound> WorldSources::sound(std::uint64_t handle) const {
  const std::lock_guard lock(mutex_);
  return sounds_.find(handle);
}

bool WorldSources::has_group(std::uint64_t handle) const {
  const std::lock_guard lock(mutex_);
  return groups_.find(handle) != nullptr;
}

std::vector<std::shared_ptr<WorldSound>> WorldSources::all_sounds() const {
  std::vector<std::shared_ptr<WorldSound>> sounds;
  const std::lock_guard lock(mutex_);
  sounds_.for_each([&](const auto& sound) { sounds.push_back(sound); });
  return sounds;
}

bool WorldSources::remove_sound(std::uint64_t handle) {
  std::shared_ptr<WorldSound> removed;  // freed after the lock, because the application may be told
  const std::lock_guard lock(mutex_);
  removed = sounds_.remove(handle);
  if (removed == nullptr) return false;
  std::vector<std::uint64_t> ended;
  sources_.for_each([&](const auto& source) {
    if (source->now.sound == handle) ended.push_back(source->handle);
  });
  for (const std::uint64_t source : ended) sources_.remove(source);
  return true;
}

bool WorldSources::remove_group(std::uint64_t handle) {
  const std::lock_guard lock(mutex_);
  if (groups_.remove(handle) == nullptr) return false;
  sources_.for_each([&](const auto& source) {
    if (source->now.group != handle) return;
    source->now.group = 0;
    ++source->version;
  });
  for (auto& [level, emitters] : emitters_)
    for (WorldEmitter& emitter : emitters)
      if (emitter.group == handle) emitter.group = 0;
  emitters_changed_ = true;
  return true;
}

bool WorldSources::remove_source(std::uint64_t handle) {
  const std::lock_guard lock(mutex_);
  return sources_.remove(handle) != nullptr;
}

bool WorldSources::set_group(std::uint64_t handle, const WorldGroup& group) {
  const std::lock_guard lock(mutex_);
  const auto changed = groups_.find(handle);
  if (changed == nullptr) return false;
  changed->now = group;
  ++changed->version;
  emitters_changed_ = true;
  return true;
}

bool WorldSources::change(std::uint64_t handle, const WorldSource& source) {
  const std::lock_guard lock(mutex_);
  const auto changed = sources_.find(handle);
  if (changed == nullptr) return false;
  changed->begins = changed->begins || changed->now.sound != source.sound;
  changed->now = source;
  ++changed->version;
  return true;
}

bool WorldSources::move(std::uint64_t handle, const SourceMotion& motion) {
  const std::lock_guard lock(mutex_);
  const auto moved = sources_.find(handle);
  if (moved == nullptr) return false;
  moved->now.motion = motion;
  return true;
}

void WorldSources::change_emitter(std::uint64_t level, std::size_t emitter, std::size_t count,
                                  const WorldEmitter& changed) {
  const std::lock_guard lock(mutex_);
  std::vector<WorldEmitter>& emitters = emitters_[level];
  emitters.resize(count);
  emitters[emitter] = changed;
  emitters_changed_ = true;
}

void WorldSources::set_portal(std::uint64_t level, std::size_t portal, std::size_t count,
                              double openness) {
  const std::lock_guard lock(mutex_);
  std::vector<float>& portals = portals_[level];
  portals.resize(count, kOpenedByParts);
  portals[portal] = static_cast<float>(openness);
}

void WorldSources::forget_level(std::uint64_t level) {
  const std::lock_guard lock(mutex_);
  parts_.forget_level(level);
  emitters_.erase(level);
  portals_.erase(level);
  commit_.emitters.erase(level);
  commit_.portals.erase(level);
}

double WorldSources::group_gain(std::uint64_t handle) const {
  const auto group = handle == 0 ? nullptr : groups_.find(handle);
  if (group == nullptr) return 1;
  return group->now.paused ? 0 : group->now.gain;
}

void WorldSources::commit_emitters() {
  if (!emitters_changed_) return;
  for (const auto& [level, emitters] : emitters_) {
    std::vector<float> powers;
    for (const WorldEmitter& emitter : emitters) {
      const double gain = std::min(emitter.gain * group_gain(emitter.group), 1.0);
      powers.push_back(static_cast<float>(gain * gain));
    }
    commit_.emitters[level].update(powers);
  }
  emitters_changed_ = false;
}

void WorldSources::commit(const WorldTime& time) {
  std::vector<std::shared_ptr<WorldSound>> removed;  // freed after the lock, as in remove_sound()
  const std::lock_guard lock(mutex_);
  std::vector<bool> is_present(states_.size());
  std::vector<std::uint64_t> ended;
  sources_.for_each([&](const auto& source) {
    const std::size_t slot = HandleTable<Source>::slot_number(source->handle);
    if (source->begins && sounds_.find(source->now.sound) == nullptr) {  // removed meanwhile
      ended.push_back(source->handle);
      return;
    }
    Committed& committed = commit_.sources[slot];
    SlotState& state = states_[slot];
    if (state.handle != source->handle) {
      committed = {};
      state = {};
      state.handle = source->handle;
    }
    commit(*source, committed, state, time);
    // Offline listeners may be rendered faster or slower than in real time.
    const WorldTime age = time - committed.begin;
    const double age_s = age.of(time.offline_s != 0);
    if (source->now.ends_with_sound && !state.paused_at &&
        age_s > committed.sound->duration_s() + kTravel_s)
      ended.push_back(source->handle);
    else
      is_present[slot] = true;
  });
  for (const std::uint64_t handle : ended) sources_.remove(handle);
  for (std::size_t slot = 0; slot < states_.size(); ++slot) {
    if (is_present[slot] || states_[slot].handle == 0) continue;
    removed.push_back(std::move(commit_.sources[slot].sound));
    commit_.sources[slot] = {};
    states_[slot] = {};
  }
  std::fill(commit_.sounds.begin(), commit_.sounds.end(), 0);
  sounds_.for_each_handle([&](std::uint64_t handle) {
    commit_.sounds[HandleTable<WorldSound>::slot_number(handle)] = handle;
  });
  groups_.for_each_handle([&](std::uint64_t handle) {
    commit_.voice_shares[group_number(handle)] = groups_.find(handle)->now.voice_share;
  });
  commit_emitters();
  parts_.commit(commit_.parts);
  for (const auto& [level, openness] : portals_) commit_.portals[level].update(openness);
  commit_.time = time;
  ++commit_.number;
}

void WorldSources::commit(Source& source, Committed& committed, SlotState& state,
                          const WorldTime& time) {
  const SourceMotion& motion = source.now.motion;
  const bool has_moved_before = committed.version != 0;
  MovingSource& moving = committed.moving;
  moving.velocity_mps = motion.velocity_mps;
  if (motion.velocity_mps == Vec3{} && has_moved_before)
    moving.velocity_mps =
        velocity_between(moving.position_m, motion.position_m, interval_s(time - commit_.time));
  moving.position_m = motion.position_m;
  if (moving.axis != motion.axis) ++committed.version;
  moving.axis = motion.axis;

  const auto group = source.now.group == 0 ? nullptr : groups_.find(source.now.group);
  const std::uint64_t group_version = group == nullptr ? 0 : group->version;
  if (!source.begins && source.version == state.version && group_version == state.group_version)
    return;
  state.version = source.version;
  state.group_version = group_version;
  ++committed.version;
  if (source.begins) {
    source.begins = false;
    committed.begin = time - WorldTime{source.now.played_s, source.now.played_s};
    committed.sound = sounds_.find(source.now.sound);
    committed.sound_handle = source.now.sound;
    committed.identity = ++identities_;
  }
  committed.level = source.now.level;
  moving.group = group == nullptr ? std::uint16_t{0} : group_number(source.now.group);
  const auto group_gain = static_cast<float>(group == nullptr ? 1 : group->now.gain);
  for (std::size_t b = 0; b < kBandCount; ++b)
    moving.gain[b] = std::min(group_gain * source.now.gain[b], static_cast<float>(kMaxWorldGain));
  committed.directivity = source.now.directivity;
  moving.reverberation = source.now.reverberation;
  // A paused source is silent, and its sound goes on later from where it was.
  const bool pauses = group != nullptr && group->now.paused;
  if (pauses) {
    if (!state.paused_at) state.paused_at = time;
    committed.identity = 0;
  } else if (state.paused_at) {
    committed.begin += time - *state.paused_at;
    state.paused_at.reset();
    committed.identity = ++identities_;
  }
}

}  // namespace clamor
