#include "runtime/world/source_mirror.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/engine/auralizer.h"
#include "runtime/engine/replaceable_signals.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

constexpr double kJump_s = 0.1, kSmoothing = 0.01;
constexpr double kFade_s = 0.1;  // of a source that is removed or paused
// The mixer looks this far beyond a keyframe's time, to fade voices out if no other keyframe comes:
// binaural filters, a period, a fade, and what one call reads.
constexpr std::int64_t kReadAhead_frames = 3072;

std::size_t sound_slot(const WorldSources::Committed& source) {
  return HandleTable<WorldSound>::slot_number(source.sound_handle);
}

}  // namespace

SourceMirror::SourceMirror(Auralizer& auralizer, WorldSources& sources, std::uint64_t level,
                           std::optional<double> start_s)
    : auralizer_(auralizer),
      sources_(sources),
      level_(level),
      offline_(start_s.has_value()),
      start_s_(start_s),
      slots_(sources.max_sources()),
      sound_slots_(sources.max_sounds()),
      voice_shares_(kMaxWorldGroups + 1, 1.0) {}

void SourceMirror::update_start(double keyframe_s) {
  if (offline_) return;
  const double measured_s = WorldSources::now_s() - keyframe_s;
  if (!start_s_ || std::abs(measured_s - *start_s_) > kJump_s)
    start_s_ = measured_s;
  else
    *start_s_ += kSmoothing * (measured_s - *start_s_);
}

void SourceMirror::update() {
  const double keyframe_s = auralizer_.next_keyframe_time_s();
  update_start(keyframe_s);
  sources_.visit([&](const WorldSources::Commit& commit) {
    if (commit.number == commits_ && complete_) return;
    complete_ = false;  // an exception leaves it so
    commits_ = commit.number;
    complete_ = take_over(commit, keyframe_s);
    auralizer_.moving()->commit(commit.time.of(offline_) - *start_s_);
  });
  removed_sounds_.clear();
  produce(keyframe_s);
}

// Returns whether all sources could be taken over. Others wait for a slot to become free.
bool SourceMirror::take_over(const WorldSources::Commit& commit, double keyframe_s) {
  MovingSources& moving = *auralizer_.moving();
  bool complete = true;
  take_over_shares(commit.emitters, emitters_version_, &Auralizer::set_emitter_powers);
  take_over_parts(commit.parts);
  take_over_shares(commit.portals, portals_version_, &Auralizer::set_portals);
  for (std::size_t group = 1; group < commit.voice_shares.size(); ++group) {
    if (commit.voice_shares[group] == voice_shares_[group]) continue;
    voice_shares_[group] = commit.voice_shares[group];
    auralizer_.limit_group(static_cast<std::uint16_t>(group), voice_shares_[group]);
  }
  for (SoundSlot& slot : sound_slots_) slot.plays = false;
  for (std::size_t i = 0; i < commit.sources.size(); ++i) {
    const WorldSources::Committed& source = commit.sources[i];
    Slot& slot = slots_[i];
    const bool is_heard = source.identity != 0 && (source.level == 0 || source.level == level_);
    if (slot.identity != 0 && (!is_heard || slot.identity != source.identity)) {
      (void)moving.remove(slot.handle);
      slot = {};
    }
    if (!is_heard) continue;
    complete = has_sound(source, keyframe_s) && add(i, source, keyframe_s) && complete;
  }
  for (std::size_t i = 0; i < sound_slots_.size(); ++i)
    if (sound_slots_[i].handle != commit.sounds[i]) clear_sound(i);
  return complete;
}

void SourceMirror::take_over_shares(
    const std::map<std::uint64_t, WorldSources::PowerShares>& levels, std::uint64_t& version,
    void (Auralizer::*set)(std::vector<float>)) {
  const auto level = levels.find(level_);
  if (level == levels.end() || level->second.version == version) return;
  (auralizer_.*set)(level->second.shares);
  version = level->second.version;
}

// Parts that there is no room for are left out.
void SourceMirror::take_over_parts(std::span<const WorldParts::Committed> committed) {
  MovingParts* const parts = auralizer_.parts();
  if (parts == nullptr) return;
  part_slots_.resize(std::max(part_slots_.size(), committed.size()));
  for (std::size_t i = 0; i < part_slots_.size(); ++i) {
    PartSlot& slot = part_slots_[i];
    const std::uint64_t handle = i < committed.size() ? committed[i].handle : 0;
    if (slot.handle != handle) {
      // A level's part whose level is closed stays as it is.
      if (slot.is_added) (void)parts->remove(slot.part);
      slot = {};
    }
    if (handle != 0 && slot.version != committed[i].version) take_over_part(committed[i], slot);
  }
}

void SourceMirror::take_over_part(const WorldParts::Committed& committed, PartSlot& slot) {
  MovingParts& parts = *auralizer_.parts();
  const WorldPart& part = committed.part;
  const bool is_new = slot.handle == 0, is_here = part.level == 0 || part.level == level_;
  if (is_new && is_here && part.is_added()) {
    const auto added = parts.add(part.shape, part.pose);
    slot.is_added = added.ok();
    if (added.ok()) slot.part = *added;
  } else if (is_new && is_here && part.index < auralizer_.level_parts().size()) {
    slot.part = auralizer_.level_parts()[part.index];
  }
  if (slot.part.generation != 0) {
    (void)parts.move(slot.part, part.pose);
    (void)parts.enable(slot.part, part.enabled);
  }
  // Last, so that an exception does not lose the change.
  slot.handle = committed.handle;
  slot.version = committed.version;
}

// Brings the sound of a source into its slot; false if the slot is not free yet.
bool SourceMirror::has_sound(const WorldSources::Committed& source, double keyframe_s) {
  const std::size_t i = sound_slot(source);
  SoundSlot& slot = sound_slots_[i];
  if (slot.handle != source.sound_handle) {
    clear_sound(i);
    if (!auralizer_.signal_slots().is_free(i)) return false;
    slot.handle = slot.last_handle = source.sound_handle;
    slot.sound = source.sound;
    auralizer_.set_signal(i, source.sound->for_mode(auralizer_.mode()));
  }
  slot.plays = true;
  if (slot.is_read) return true;
  slot.is_read = source.sound->is_live();
  // The newest samples of a live sound leave its sources with this keyframe.
  const double arrived_s = static_cast<double>(source.sound->produced()) / kSampleRate_hz;
  slot.live_start_s = keyframe_s - arrived_s;
  return true;
}

bool SourceMirror::add(std::size_t i, const WorldSources::Committed& source, double keyframe_s) {
  MovingSources& moving = *auralizer_.moving();
  Slot& slot = slots_[i];
  const MovingSource& now = source.moving;
  const bool is_new = slot.identity == 0;
  if (!is_new && slot.version == source.version) {
    if (slot.position_m == now.position_m && slot.velocity_mps == now.velocity_mps) return true;
    slot.position_m = now.position_m;
    slot.velocity_mps = now.velocity_mps;
    auralizer_.check_place(Auralizer::PlaceOf::kSource, now.position_m);
    return moving.move(slot.handle, now.position_m, now.velocity_mps).ok();
  }
  auralizer_.check_place(Auralizer::PlaceOf::kSource, now.position_m);
  if (is_new && moving.size() == moving.max_sources()) return false;
  MovingSource moved = now;
  // Each slot of the auralizer has a kind, so that a source that was removed dies away with its
  // own.
  moved.kind = is_new ? moving.next_slot() : slot.handle.slot;
  if (is_new) slot.start_s = start_of(source, keyframe_s);
  moved.start_s = slot.start_s;
  auralizer_.set_kind(moved.kind, sound_slot(source), source.directivity);
  if (is_new) {
    const auto added = moving.add(moved);
    if (!added.ok()) return false;
    slot.handle = *added;
  } else if (!moving.change(slot.handle, moved).ok()) {
    return false;
  }
  slot.identity = source.identity;
  slot.version = source.version;
  slot.position_m = now.position_m;
  slot.velocity_mps = now.velocity_mps;
  return true;
}

// When a sound begins on the auralizer's clock.
double SourceMirror::start_of(const WorldSources::Committed& source, double keyframe_s) const {
  if (source.sound->is_live()) return sound_slots_[sound_slot(source)].live_start_s;
  const double start_s =
      std::clamp(source.begin.of(offline_) - *start_s_, -kMaxWorldTime_s, kMaxWorldTime_s);
  // A sound that begins now has its first sample with the next keyframe, whatever the clocks say.
  return !offline_ && std::abs(start_s - keyframe_s) < kJump_s ? kStartsWhenHeard : start_s;
}

void SourceMirror::clear_sound(std::size_t i) {
  SoundSlot& slot = sound_slots_[i];
  if (slot.handle == 0) return;
  removed_sounds_.push_back(std::move(slot.sound));
  slot = {.last_handle = slot.last_handle};
  auralizer_.clear_signal(i);
}

// A live sound that no source plays stands still once the last one has faded out.
void SourceMirror::produce(double keyframe_s) {
  for (std::size_t i = 0; i < sound_slots_.size(); ++i) {
    SoundSlot& slot = sound_slots_[i];
    if (slot.plays)
      slot.last_played_s = keyframe_s;
    else if (keyframe_s > slot.last_played_s + kFade_s)
      slot.is_read = false;
    if (!slot.is_read) continue;
    const double read_s = keyframe_s - slot.live_start_s;
    slot.sound->produce(std::llround(read_s * kSampleRate_hz) + kReadAhead_frames);
    auralizer_.signal_slots().set_weights(i, slot.sound->live_weights());
  }
}

}  // namespace clamor
