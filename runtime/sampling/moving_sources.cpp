#include "runtime/sampling/moving_sources.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "formats/level/level_origin.h"

namespace clamor {

namespace {

// So many slots are kept for the reverberation of removed sources, if there are as many.
constexpr std::size_t kDyingAway = 256;
constexpr double kMaxCoordinate_m = 1e6, kMaxSpeed_mps = 1e4, kMaxStart_s = 1e7;

bool is_within(const Vec3& v, double limit) {
  return std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;
}

Result<void> check_place(const Vec3& position_m, const Vec3& velocity_mps) {
  if (is_within(position_m, kMaxCoordinate_m) && is_within(velocity_mps, kMaxSpeed_mps)) return {};
  return Error(
      "a moving source must be within 100 000 km of the origin and slower than 10 km/s; its place "
      "or velocity is not. Give metres and metres per second.");
}

Result<void> check(const MovingSource& source, std::size_t kinds) {
  if (const auto ok = check_place(source.position_m, source.velocity_mps); !ok.ok()) return ok;
  if (source.kind >= kinds)
    return Error("a moving source is of kind " + std::to_string(source.kind) + ", but there are " +
                 std::to_string(kinds) + ". Name all kinds when the player is made.");
  for (const float gain : source.gain)
    if (!(gain >= 0 && gain <= 1e6f))
      return Error("a moving source's gains must lie between 0 and 1000000, amplitudes at 1 m.");
  if (!(source.reverberation >= 0 && source.reverberation <= kMaxReverberation))
    return Error("a moving source's reverberation must lie between 0 and 100, an amplitude.");
  if (!std::isnan(source.start_s) && !(std::abs(source.start_s) <= kMaxStart_s))
    return Error(
        "a moving source's start must be a number of seconds between -10000000 and 10000000, or "
        "kStartsWhenHeard.");
  const double axis = length(source.axis);
  if (!(axis > 1e-6 && axis < 1e6))
    return Error("a moving source's axis must have a length and a direction.");
  return {};
}

Error gone() { return Error("there is no such moving source; it was removed, or never added."); }

}  // namespace

MovingSources::MovingSources(std::size_t max_sources, std::size_t kinds, const Vec3& origin_m)
    : max_sources_(max_sources), kinds_(kinds), origin_m_(origin_m) {
  const auto resize = [max_sources](Snapshot& snapshot) {
    for (auto* column : {&snapshot.x_m, &snapshot.y_m, &snapshot.z_m, &snapshot.x_mps,
                         &snapshot.y_mps, &snapshot.z_mps})
      column->resize(max_sources);
    snapshot.settings.resize(max_sources);
  };
  resize(own_);
  for (Snapshot& copy : copies_) resize(copy);
  for (auto& stale : stale_) stale.reserve(max_sources);
  stale_in_.resize(max_sources);
  handles_.resize(max_sources);
  free_.resize(max_sources);
}

bool MovingSources::is_present(MovingHandle handle) const {
  return handle.slot < own_.count && handle.generation % 2 == 1 &&
         handles_[handle.slot] == handle.generation;
}

void MovingSources::set_motion(std::size_t slot, const Vec3& position_m, const Vec3& velocity_mps) {
  own_.x_m[slot] = static_cast<float>(position_m.x);
  own_.y_m[slot] = static_cast<float>(position_m.y);
  own_.z_m[slot] = static_cast<float>(position_m.z);
  own_.x_mps[slot] = static_cast<float>(velocity_mps.x);
  own_.y_mps[slot] = static_cast<float>(velocity_mps.y);
  own_.z_mps[slot] = static_cast<float>(velocity_mps.z);
}

// Notes that all copies need the slot's settings before they are read again.
void MovingSources::mark_changed(std::size_t slot) {
  ++own_.settings[slot].version;
  for (unsigned copy = 0; copy < copies_.size(); ++copy) {
    if ((stale_in_[slot] & (1u << copy)) != 0) continue;
    stale_in_[slot] = static_cast<std::uint8_t>(stale_in_[slot] | (1u << copy));
    stale_[copy].push_back(static_cast<std::uint32_t>(slot));
  }
}

void MovingSources::set(std::size_t slot, const MovingSource& source) {
  Settings& settings = own_.settings[slot];
  settings.gain = source.gain;
  settings.axis = Vec3f(normalize(source.axis));
  settings.kind = source.kind;
  settings.start_s = source.start_s;
  settings.group = source.group;
  settings.reverberation = source.reverberation;
  settings.present = true;
  mark_changed(slot);
  set_motion(slot, source.position_m, source.velocity_mps);
}

std::uint32_t MovingSources::next_slot() const {
  const bool is_unused = free_count_ < kDyingAway && own_.count < max_sources_;
  return is_unused || free_count_ == 0 ? static_cast<std::uint32_t>(own_.count)
                                       : free_[first_free_];
}

std::uint32_t MovingSources::take_slot() {
  const std::uint32_t slot = next_slot();
  if (slot == own_.count) {
    ++own_.count;
    return slot;
  }
  first_free_ = (first_free_ + 1) % max_sources_;
  --free_count_;
  return slot;
}

Result<MovingHandle> MovingSources::add(const MovingSource& given) {
  MovingSource source = given;
  source.position_m = in_level(given.position_m, origin_m_);
  if (const auto ok = check(source, kinds_); !ok.ok()) return ok.error();
  if (present_ == max_sources_)
    return Error("there are " + std::to_string(max_sources_) +
                 " moving sources already, as many as were asked for when the player was made. "
                 "Remove some, or ask for more.");
  const std::uint32_t slot = take_slot();
  ++present_;
  ++own_.settings[slot].generation;
  set(slot, source);
  return MovingHandle{slot, ++handles_[slot]};
}

Result<void> MovingSources::move(MovingHandle handle, const Vec3& given_m,
                                 const Vec3& velocity_mps) {
  if (!is_present(handle)) return gone();
  const Vec3 position_m = in_level(given_m, origin_m_);
  if (const auto ok = check_place(position_m, velocity_mps); !ok.ok()) return ok;
  set_motion(handle.slot, position_m, velocity_mps);
  return {};
}

Result<void> MovingSources::change(MovingHandle handle, const MovingSource& given) {
  if (!is_present(handle)) return gone();
  MovingSource source = given;
  source.position_m = in_level(given.position_m, origin_m_);
  if (const auto ok = check(source, kinds_); !ok.ok()) return ok;
  const Settings& before = own_.settings[handle.slot];
  // A gain can glide, but another signal must crossfade, as another source does.
  const bool starts_the_same = before.start_s == source.start_s ||
                               (std::isnan(before.start_s) && std::isnan(source.start_s));
  if (before.kind != source.kind || !starts_the_same) ++own_.settings[handle.slot].generation;
  set(handle.slot, source);
  return {};
}

Result<void> MovingSources::remove(MovingHandle handle) {
  if (!is_present(handle)) return gone();
  const std::uint32_t slot = handle.slot;
  own_.settings[slot].present = false;
  own_.x_mps[slot] = own_.y_mps[slot] = own_.z_mps[slot] = 0;
  mark_changed(slot);
  ++handles_[slot];
  free_[(first_free_ + free_count_++) % max_sources_] = slot;
  --present_;
  return {};
}

void MovingSources::commit(double time_s) {
  own_.time_s = time_s;
  ++own_.commits;
  Snapshot& copy = copies_[writing_];
  const auto positions = [&](std::vector<float> Snapshot::*column) {
    std::copy_n((own_.*column).begin(), own_.count, (copy.*column).begin());
  };
  for (auto column : {&Snapshot::x_m, &Snapshot::y_m, &Snapshot::z_m, &Snapshot::x_mps,
                      &Snapshot::y_mps, &Snapshot::z_mps})
    positions(column);
  for (const std::uint32_t slot : stale_[writing_]) {
    copy.settings[slot] = own_.settings[slot];
    stale_in_[slot] = static_cast<std::uint8_t>(stale_in_[slot] & ~(1u << writing_));
  }
  stale_[writing_].clear();
  copy.count = own_.count;
  copy.time_s = own_.time_s;
  copy.commits = own_.commits;
  writing_ = middle_.exchange(writing_ | kFresh, std::memory_order_acq_rel) & kCopy;
}

const MovingSources::Snapshot& MovingSources::latest() noexcept {
  if ((middle_.load(std::memory_order_relaxed) & kFresh) != 0)
    reading_ = middle_.exchange(reading_, std::memory_order_acq_rel) & kCopy;
  return copies_[reading_];
}

}  // namespace clamor
