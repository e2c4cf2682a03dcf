#include "runtime/occlusion/portal_parts.h"

#include <algorithm>
#include <cmath>

#include "common/sphere.h"

namespace clamor {

namespace {

constexpr int kLines = 128;
constexpr int kMaxBounces = 6;
constexpr double kBefore_m = 0.001;  // from the plane to where lines begin
constexpr double kReachPerSide = 4;  // how far lines are followed, in half sides of the rectangle
constexpr float kLeastThrough = 1e-6f;  // share of the power: -60 dB
constexpr float kBeyondHit = 1e-5f;     // in parts of a line, to leave what it has hit

double fraction_of(double number) { return number - std::floor(number); }

// Evenly spread numbers in [0, 1), four for each line (the R4 sequence: M. Roberts. The
// Unreasonable Effectiveness of Quasirandom Sequences, 2018).
double spread(int line, int axis) {
  constexpr double kRoot = 1.1673039782614187;  // x^5 = x + 1
  return fraction_of(0.5 + (line + 1) * std::pow(kRoot, -(axis + 1)));
}

class LinesThrough {
 public:
  LinesThrough(const Portal& portal, std::span<const std::uint32_t> slots,
               const OcclusionGeometry& geometry, const PartScene& scene)
      : portal_(portal),
        slots_(slots),
        geometry_(geometry),
        scene_(scene),
        normal_(normal_of(portal)),
        reach_m_(kReachPerSide * std::max(length(portal.half_u_m), length(portal.half_v_m))) {}

  double openness() const {
    const Basis basis = basis_around(normal_);
    double sum = 0;
    for (int line = 0; line < kLines; ++line) {
      const Vec3 at_m = portal_.centre_m + (2 * spread(line, 0) - 1) * portal_.half_u_m +
                        (2 * spread(line, 1) - 1) * portal_.half_v_m;
      const Vec3 local = on_sphere(std::sqrt(spread(line, 2)), spread(line, 3));  // the cosine law
      const Vec3 along = local.x * basis.tangent + local.y * basis.bitangent + local.z * normal_;
      sum += gets_away(at_m, along, 1) && gets_away(at_m, -along, -1) ? 1 : through(at_m, along);
    }
    return sum / kLines;
  }

 private:
  bool is_own(std::uint32_t part) const { return std::ranges::find(slots_, part) != slots_.end(); }

  // Whether a line that leaves the portal to a side, 1 or -1, stays there.
  bool gets_away(const Vec3& at_m, Vec3 direction, double side) const {
    Vec3 from_m = at_m - side * kBefore_m * normal_;
    double left_m = reach_m_;
    bool has_met_part = false;
    for (int bounce = 0; bounce < kMaxBounces; ++bounce) {
      const Vec3 to_m = from_m + left_m * direction;
      const auto hit = geometry_.first_hit(Vec3f(from_m), Vec3f(to_m));
      const Vec3 end_m = hit ? from_m + static_cast<double>(hit->fraction) * (to_m - from_m) : to_m;
      has_met_part |= hit && hit->part && is_own(*hit->part);
      if (bounce > 0 && side * dot(end_m - portal_.centre_m, normal_) < 0) return !has_met_part;
      if (!hit) return true;
      Vec3 normal(hit->normal);
      if (dot(normal, direction) > 0) normal = -normal;
      left_m -= length(end_m - from_m);
      from_m = end_m + OcclusionGeometry::kStartOffset_m * normal;
      direction -= 2 * dot(direction, normal) * normal;
    }
    return !has_met_part;
  }

  // Returns the share of the power that the portal's parts on the straight line let through.
  double through(const Vec3& at_m, const Vec3& along) const {
    const Vec3f from_m(at_m - reach_m_ * along), to_m(at_m + reach_m_ * along);
    Bands through = same_in_all_bands(1);
    float near = 0;
    bool is_hidden = false;
    for (int bounce = 0; bounce < kMaxBounces; ++bounce) {
      const auto hit = scene_.first_hit(from_m, to_m, near, 1);
      if (!hit) break;
      near = hit->fraction + kBeyondHit;
      if (!is_own(hit->part)) continue;
      is_hidden = true;
      for (std::size_t b = 0; b < kBandCount; ++b) through[b] *= scene_.transmission(*hit)[b];
    }
    if (!is_hidden) return 0;
    double sum = 0;
    for (const float share : through)
      sum += std::log(static_cast<double>(std::max(share, kLeastThrough)));
    const double mean = std::exp(sum / kBandCount);
    return mean > 1.01 * static_cast<double>(kLeastThrough) ? mean : 0;
  }

  const Portal& portal_;
  std::span<const std::uint32_t> slots_;
  const OcclusionGeometry& geometry_;
  const PartScene& scene_;
  Vec3 normal_;
  double reach_m_;
};

}  // namespace

double openness_of(const Portal& portal, std::span<const std::uint32_t> slots,
                   const OcclusionGeometry& geometry, const PartScene& scene) {
  return LinesThrough(portal, slots, geometry, scene).openness();
}

PortalParts::PortalParts(std::span<const Portal> portals, std::span<const PartHandle> level_parts)
    : openness_(portals.size(), 1.0f) {
  for (std::size_t i = 0; i < portals.size(); ++i) {
    Coupled coupled;
    coupled.portal = portals[i];
    coupled.index = i;
    for (const std::uint16_t part : portals[i].parts)
      if (part < level_parts.size() && level_parts[part].generation != 0)
        coupled.slots.push_back(level_parts[part].slot);
    if (!coupled.slots.empty()) coupled_.push_back(std::move(coupled));
  }
}

bool PortalParts::update(const OcclusionGeometry& geometry, const PartScene& scene) {
  bool has_changed = false;
  for (Coupled& one : coupled_) {
    std::uint64_t version = 0;
    for (const std::uint32_t slot : one.slots) version += scene.version_of(slot);
    if (std::exchange(one.version, version) == version) continue;
    const auto openness = static_cast<float>(openness_of(one.portal, one.slots, geometry, scene));
    has_changed |= std::exchange(openness_[one.index], openness) != openness;
  }
  return has_changed;
}

}  // namespace clamor
