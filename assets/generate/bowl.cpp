#include "bowl.h"

#include <cmath>
#include <numbers>

namespace clamor::assets {

namespace {

constexpr double kHalfLength_m = 60.5, kHalfWidth_m = 42.5;  // of the front edge, along x and z
constexpr double kCornerRadius_m = 14;
constexpr double kAisleWidth_m = 1.2;
constexpr int kCornerParts = 8;  // on each side of a corner's aisle

}  // namespace

// Counter-clockwise from above (from +X to -Z), so outward is to the right of the way round.
Bowl::Bowl() {
  const double x = kHalfLength_m, z = kHalfWidth_m, r = kCornerRadius_m;
  const double quarter = std::numbers::pi / 2;
  add_side({x, 0, z - r}, {x, 0, -(z - r)}, 5, false);
  add_corner({x - r, 0, -(z - r)}, 0);
  add_side({x - r, 0, -z}, {-(x - r), 0, -z}, 7, true);
  add_corner({-(x - r), 0, -(z - r)}, quarter);
  add_side({-x, 0, -(z - r)}, {-x, 0, z - r}, 5, false);
  add_corner({-(x - r), 0, z - r}, 2 * quarter);
  add_side({-(x - r), 0, z}, {x - r, 0, z}, 7, true);
  add_corner({x - r, 0, z - r}, 3 * quarter);
  for (std::size_t i = 0; i < stations_.size(); ++i)
    if (stations_[i].aisle_follows) aisles_.push_back(i);
}

// Aisles at both ends and evenly between; the gate, if there is one, in the middle.
void Bowl::add_side(const Vec3& from_m, const Vec3& to_m, int aisle_count, bool has_gate) {
  const double length_m = length(to_m - from_m);
  const Vec3 along = normalize(to_m - from_m);
  const Vec3 outward(-along.z, 0, along.x);
  for (int i = 0; i < aisle_count; ++i) {
    const double start_m = (length_m - kAisleWidth_m) * i / (aisle_count - 1);
    stations_.push_back(
        {from_m + along * start_m, outward, true, has_gate && 2 * i + 1 == aisle_count});
    // The last aisle ends where the corner's arc begins; the arc adds that station.
    if (i + 1 < aisle_count)
      stations_.push_back({from_m + along * (start_m + kAisleWidth_m), outward, false});
  }
}

// A quarter circle with an aisle in its middle.
void Bowl::add_corner(const Vec3& centre_m, double from_rad) {
  const double quarter = std::numbers::pi / 2;
  const double aisle_rad = kAisleWidth_m / (kCornerRadius_m + 6);
  const double block_rad = (quarter - aisle_rad) / 2;
  const auto add = [&](double angle_rad, bool aisle_follows) {
    const double angle = from_rad + angle_rad;
    const Vec3 outward(std::cos(angle), 0, -std::sin(angle));
    stations_.push_back({centre_m + outward * kCornerRadius_m, outward, aisle_follows});
  };
  for (int i = 0; i <= kCornerParts; ++i) add(block_rad * i / kCornerParts, i == kCornerParts);
  for (int i = 0; i < kCornerParts; ++i)
    add(block_rad + aisle_rad + block_rad * i / kCornerParts, false);
}

std::size_t Bowl::north_gate() const {
  for (const std::size_t aisle : aisles_)
    if (is_gate(aisle) && stations_[aisle].outward.z < 0) return aisle;
  return 0;
}

Vec3 Bowl::at(double station, double out_m, double up_m) const {
  const double floor = std::floor(station);
  const double share = station - floor;
  const Station& a = stations_[static_cast<std::size_t>(floor) % stations_.size()];
  const Station& b = stations_[(static_cast<std::size_t>(floor) + 1) % stations_.size()];
  const Vec3 at_a = a.front_m + a.outward * out_m, at_b = b.front_m + b.outward * out_m;
  return at_a * (1 - share) + at_b * share + Vec3(0, up_m, 0);
}

Vec3 Bowl::outward(double station) const {
  const double floor = std::floor(station);
  const double share = station - floor;
  const Station& a = stations_[static_cast<std::size_t>(floor) % stations_.size()];
  const Station& b = stations_[(static_cast<std::size_t>(floor) + 1) % stations_.size()];
  return normalize(a.outward * (1 - share) + b.outward * share);
}

}  // namespace clamor::assets
