#include "runtime/sampling/moving_sources.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace clamor {

namespace {

constexpr double kFarthest_m = 1e6, kFastest_mps = 1e4, kLatest_s = 1e7;

bool is_within(const Vec3& v, double most) {
  return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most;
}

Result<void> check_place(const Vec3& position_m, const Vec3& velocity_mps) {
  if (is_within(position_m, kFarthest_m) && is_within(velocity_mps, kFastest_mps)) return {};
  return Error(
      "a moving source must be within 1000 km of the origin and slower than 10 km/s; its position "
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
  if (!std::isnan(source.start_s) && !(std::abs(source.start_s) <= kLatest_s))
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

MovingSources::MovingSources(std::size_t most, std::size_t kinds) : most_(most), kinds_(kinds) {
  const auto resize = [most](Snapshot& snapshot) {
    for (auto* column : {&snapshot.x_m, &snapshot.y_m, &snapshot.z_m, &snapshot.x_mps,
                         &snapshot.y_mps, &snapshot.z_mps})
      column->resize(most);
    snapshot.tunes.resize(most);
  };
  resize(own_);
  for (Snapshot& copy : copies_) resize(copy);
  for (auto& stale : stale_) stale.reserve(most);
  stale_in_.resize(most);
  handles_.resize(most);
  free_.reserve(most);
}

bool MovingSources::is_present(MovingHandle handle) const {
  return handle.place < own_.count && handle.generation % 2 == 1 &&
         handles_[handle.place] == handle.generation;
}

void MovingSources::put(std::size_t place, const Vec3& position_m, const Vec3& velocity_mps) {
  own_.x_m[place] = static_cast<float>(position_m.x);
  own_.y_m[place] = static_cast<float>(position_m.y);
  own_.z_m[place] = static_cast<float>(position_m.z);
  own_.x_mps[place] = static_cast<float>(velocity_mps.x);
  own_.y_mps[place] = static_cast<float>(velocity_mps.y);
  own_.z_mps[place] = static_cast<float>(velocity_mps.z);
}

// All copies must take over the place's tune before they are read again.
void MovingSources::touch(std::size_t place) {
  ++own_.tunes[place].version;
  for (unsigned copy = 0; copy < copies_.size(); ++copy) {
    if ((stale_in_[place] & (1u << copy)) != 0) continue;
    stale_in_[place] = static_cast<std::uint8_t>(stale_in_[place] | (1u << copy));
    stale_[copy].push_back(static_cast<std::uint32_t>(place));
  }
}

void MovingSources::tune(std::size_t place, const MovingSource& source) {
  Tune& tune = own_.tunes[place];
  tune.gain = source.gain;
  tune.axis = Vec3f(normalize(source.axis));
  tune.kind = source.kind;
  tune.start_s = source.start_s;
  tune.present = true;
  touch(place);
  put(place, source.position_m, source.velocity_mps);
}

Result<MovingHandle> MovingSources::add(const MovingSource& source) {
  if (const auto ok = check(source, kinds_); !ok.ok()) return ok.error();
  if (present_ == most_)
    return Error("there are " + std::to_string(most_) +
                 " moving sources already, as many as were asked for when the player was made. "
                 "Remove some, or ask for more.");
  std::uint32_t place = static_cast<std::uint32_t>(own_.count);
  if (free_.empty()) {
    ++own_.count;
  } else {
    place = free_.back();
    free_.pop_back();
  }
  ++present_;
  ++own_.tunes[place].generation;
  tune(place, source);
  return MovingHandle{place, ++handles_[place]};
}

Result<void> MovingSources::move(MovingHandle handle, const Vec3& position_m,
                                 const Vec3& velocity_mps) {
  if (!is_present(handle)) return gone();
  if (const auto ok = check_place(position_m, velocity_mps); !ok.ok()) return ok;
  put(handle.place, position_m, velocity_mps);
  return {};
}

Result<void> MovingSources::retune(MovingHandle handle, const MovingSource& source) {
  if (!is_present(handle)) return gone();
  if (const auto ok = check(source, kinds_); !ok.ok()) return ok;
  const Tune& before = own_.tunes[handle.place];
  // Another signal cannot be slid to: it is heard as another source.
  const bool starts_the_same = before.start_s == source.start_s ||
                               (std::isnan(before.start_s) && std::isnan(source.start_s));
  if (before.kind != source.kind || !starts_the_same) ++own_.tunes[handle.place].generation;
  tune(handle.place, source);
  return {};
}

Result<void> MovingSources::remove(MovingHandle handle) {
  if (!is_present(handle)) return gone();
  own_.tunes[handle.place].present = false;
  touch(handle.place);
  ++handles_[handle.place];
  free_.push_back(handle.place);
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
  for (const std::uint32_t place : stale_[writing_]) {
    copy.tunes[place] = own_.tunes[place];
    stale_in_[place] = static_cast<std::uint8_t>(stale_in_[place] & ~(1u << writing_));
  }
  stale_[writing_].clear();
  copy.count = own_.count;
  copy.time_s = own_.time_s;
  copy.commits = own_.commits;
  writing_ = middle_.exchange(writing_ | kFresh, std::memory_order_acq_rel) & kSlot;
}

const MovingSources::Snapshot& MovingSources::latest() noexcept {
  if ((middle_.load(std::memory_order_relaxed) & kFresh) != 0)
    reading_ = middle_.exchange(reading_, std::memory_order_acq_rel) & kSlot;
  return copies_[reading_];
}

}  // namespace clamor
