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
  for (auto* column : {&now_.x_m, &now_.y_m, &now_.z_m, &now_.x_mps, &now_.y_mps, &now_.z_mps})
    column->resize(max_sources);
  now_.settings.resize(max_sources);
  handles_.resize(max_sources);
  free_.resize(max_sources);
}

bool MovingSources::is_present(MovingHandle handle) const {
  return handle.slot < now_.count && handle.generation % 2 == 1 &&
         handles_[handle.slot] == handle.generation;
}

void MovingSources::set_motion(std::size_t slot, const Vec3& position_m, const Vec3& velocity_mps) {
  now_.x_m[slot] = static_cast<float>(position_m.x);
  now_.y_m[slot] = static_cast<float>(position_m.y);
  now_.z_m[slot] = static_cast<float>(position_m.z);
  now_.x_mps[slot] = static_cast<float>(velocity_mps.x);
  now_.y_mps[slot] = static_cast<float>(velocity_mps.y);
  now_.z_mps[slot] = static_cast<float>(velocity_mps.z);
}

void MovingSources::set(std::size_t slot, const MovingSource& source) {
  Settings& settings = now_.settings[slot];
  settings.gain = source.gain;
  settings.axis = Vec3f(normalize(source.axis));
  settings.kind = source.kind;
  settings.start_s = source.start_s;
  settings.group = source.group;
  settings.reverberation = source.reverberation;
  settings.present = true;
  ++settings.version;
  set_motion(slot, source.position_m, source.velocity_mps);
}

std::uint32_t MovingSources::next_slot() const {
  const bool is_unused = free_count_ < kDyingAway && now_.count < max_sources_;
  return is_unused || free_count_ == 0 ? static_cast<std::uint32_t>(now_.count)
                                       : free_[first_free_];
}

std::uint32_t MovingSources::take_slot() {
  const std::uint32_t slot = next_slot();
  if (slot == now_.count) {
    ++now_.count;
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
  ++now_.settings[slot].generation;
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
  const Settings& before = now_.settings[handle.slot];
  // A gain can glide, but another signal must crossfade, as another source does.
  const bool starts_the_same = before.start_s == source.start_s ||
                               (std::isnan(before.start_s) && std::isnan(source.start_s));
  if (before.kind != source.kind || !starts_the_same) ++now_.settings[handle.slot].generation;
  set(handle.slot, source);
  return {};
}

Result<void> MovingSources::remove(MovingHandle handle) {
  if (!is_present(handle)) return gone();
  const std::uint32_t slot = handle.slot;
  now_.settings[slot].present = false;
  ++now_.settings[slot].version;
  now_.x_mps[slot] = now_.y_mps[slot] = now_.z_mps[slot] = 0;
  ++handles_[slot];
  free_[(first_free_ + free_count_++) % max_sources_] = slot;
  --present_;
  return {};
}

void MovingSources::commit(double time_s) {
  now_.time_s = time_s;
  ++now_.commits;
}

}  // namespace clamor
