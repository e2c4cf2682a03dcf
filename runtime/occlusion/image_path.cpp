#include "runtime/occlusion/image_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "runtime/occlusion/diffraction_paths.h"
#include "runtime/occlusion/image_mirrors.h"
#include "runtime/occlusion/mirror_edges.h"
#include "runtime/occlusion/mirror_path.h"
#include "runtime/occlusion/place_order.h"

namespace clamor {

namespace {

constexpr int kRimPoints = 6, kInnerPoints = 12;

// Points of the disc, as parts of its radius: a hexagon on its rim, and others spread inside it.
std::array<double, 2> disc_point(int i) {
  if (i < kRimPoints) {
    const double turn = 2 * std::numbers::pi * i / kRimPoints;
    return {std::cos(turn), std::sin(turn)};
  }
  const int inner = i - kRimPoints;
  const double radius = std::cos(std::numbers::pi / kRimPoints) *
                        std::sqrt((inner + 0.5) / static_cast<double>(kInnerPoints));
  const double turn = 2 * std::numbers::pi * std::numbers::phi * inner;
  return {radius * std::cos(turn), radius * std::sin(turn)};
}

// A path that a series of mirrors reflects, and what each of these sees of both ends.
class UnfoldedPath {
 public:
  UnfoldedPath(const MirrorSeries& series, const Vec3& from_m, const Vec3& to_m) : series_(series) {
    std::reverse_copy(planes().begin(), planes().end(), back_.begin());
    sources_m_[0] = from_m;
    for (std::size_t k = 0; k < order(); ++k)
      sources_m_[k + 1] = series_.planes[k].image_of(sources_m_[k]);
    listeners_m_[order()] = to_m;
    for (std::size_t k = order(); k-- > 0;) {
      listeners_m_[k] = series_.planes[k].image_of(listeners_m_[k + 1]);
      points_m_[k] = series_.planes[k].crossing_m(sources_m_[k + 1], listeners_m_[k + 1]);
    }
  }

  std::size_t order() const { return series_.order; }
  std::span<const MirrorPlane> planes() const {
    return std::span(series_.planes).first(series_.order);
  }

  // How far all points are before the planes that the path meets before and after; less than zero
  // where it cannot meet them in this order.
  double depth_m() const {
    double depth_m = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < order(); ++k) {
      const MirrorPlane& plane = series_.planes[k];
      depth_m =
          std::min({depth_m, plane.height_m(k == 0 ? sources_m_[0] : points_m_[k - 1]),
                    plane.height_m(k + 1 == order() ? listeners_m_[k + 1] : points_m_[k + 1])});
    }
    return depth_m;
  }

  // Whether the path by all planes is free, as seen from the end that comes_before() the other.
  bool is_free(const OcclusionGeometry& geometry, std::uint64_t& rays) const {
    const Vec3 &source_m = sources_m_[0], &listener_m = listeners_m_[order()];
    const PathEnd source(sources_m_[order()], source_m, std::span(back_).first(order())),
        listener(listeners_m_[0], listener_m, planes());
    return (comes_before(source_m, listener_m) ? mirror_path(geometry, source_m, listener, rays)
                                               : mirror_path(geometry, listener_m, source, rays))
        .has_value();
  }
  Reflection reflection(std::size_t k, bool is_in_part) const {
    const auto before = std::span(back_).first(order()).last(k), after = planes().subspan(k + 1);
    return {series_.planes[k], PathEnd(sources_m_[k], sources_m_[0], before),
            PathEnd(listeners_m_[k + 1], listeners_m_[order()], after), order() == 1, is_in_part};
  }
  const MirrorPlane& plane(std::size_t k) const { return series_.planes[k]; }
  // Where the straight path meets a plane.
  const Vec3& point_m(std::size_t k) const { return points_m_[k]; }

  // A place beside mirror k as the listener sees it.
  Vec3 seen_m(std::size_t k, Vec3 place_m) const {
    for (const MirrorPlane& plane : planes().subspan(k + 1)) place_m = plane.image_of(place_m);
    return place_m;
  }

 private:
  MirrorSeries series_;
  std::array<MirrorPlane, kMaxImageOrder> back_{};  // the planes from the last on
  std::array<Vec3, kMaxImageOrder + 1> sources_m_{}, listeners_m_{};
  std::array<Vec3, kMaxImageOrder> points_m_{};  // where the straight path meets the planes
};

// An image that is not known in the level has one mirror, if any.
UnfoldedPath unfolded(const OcclusionGeometry& geometry, const Source& image, const PathEnd& end,
                      const Vec3& place_m) {
  const Vec3 normal = normalize(end.real_m - end.seen_m);
  const MirrorSeries half_way{{{{normal, 0.5 * dot(normal, end.real_m + end.seen_m)}}}, 1};
  auto known = image.is_in_part ? std::span<const MirrorSeries>()
                                : geometry.mirrors_of(image.position_m, image.original_m);
  if (known.empty()) known = {&half_way, 1};
  UnfoldedPath best(known[0], end.real_m, place_m);
  for (const MirrorSeries& series : known.subspan(1))
    if (const UnfoldedPath path(series, end.real_m, place_m); path.depth_m() > best.depth_m())
      best = path;
  return best;
}

// The share of the amplitude that arrives where the ends of the straight path are moved across it,
// together and as far, and by the straight path itself.
class DiscView {
 public:
  // `planes` reflect the path, from the source on.
  DiscView(const OcclusionGeometry& geometry, const PathEnd& image, const Vec3& place,
           std::span<const MirrorPlane> planes, const std::optional<MirrorPath>& straight,
           std::uint64_t& rays)
      : geometry_(geometry), image_(image), place_(place), planes_(planes), rays_(rays) {
    add(straight);
    straight_ = sum_;
  }

  const Bands& straight() const { return straight_; }

  // The mean, with a share of the straight path's.
  Bands amplitude(const Bands& straight, double straight_share) {
    if (straight_share >= 1) return straight;
    look_around();
    Bands amplitude{};
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float mean = sum_[b] / static_cast<float>(counted_);
      amplitude[b] = mean + static_cast<float>(straight_share) * (straight[b] - mean);
    }
    return amplitude;
  }

 private:
  void add(const std::optional<MirrorPath>& path) {
    ++counted_;
    if (!path) return;
    for (std::size_t b = 0; b < kBandCount; ++b) sum_[b] += std::sqrt(path->reflected[b]);
    ++heard_;
  }

  Vec3 by_mirrors(Vec3 direction) const {
    for (const MirrorPlane& plane : planes_) direction = plane.mirrored(direction);
    return direction;
  }
  Vec3 back_by_mirrors(Vec3 direction) const {
    for (std::size_t k = planes_.size(); k-- > 0;) direction = planes_[k].mirrored(direction);
    return direction;
  }

  // The disc is the same from either end.
  void look_around() {
    if (counted_ > 1) return;
    const Vec3 to_image = normalize(image_.seen_m - place_);
    const bool is_first = comes_before(place_, image_.real_m);
    const Basis basis = basis_around(is_first ? to_image : back_by_mirrors(-to_image));
    for (int i = 0; i < kRimPoints + kInnerPoints; ++i) {
      if (i == kRimPoints && (heard_ == 0 || heard_ == counted_)) break;
      const auto [u, v] = disc_point(i);
      const Vec3 offset_m = (basis.tangent * u + basis.bitangent * v) * kDiscRadius_m;
      const Vec3 here_m = is_first ? offset_m : by_mirrors(offset_m);
      const Vec3 point_m = place_ + here_m;
      const Vec3 source_m = image_.real_m + back_by_mirrors(here_m);
      rays_ += 2;
      if (geometry_.is_free(Vec3f(place_), Vec3f(point_m)) &&
          geometry_.is_free(Vec3f(image_.real_m), Vec3f(source_m)))
        add(mirror_path(geometry_, point_m,
                        PathEnd(image_.seen_m + here_m, source_m, image_.is_in_part), rays_));
    }
  }

  const OcclusionGeometry& geometry_;
  const PathEnd& image_;
  const Vec3 place_;
  const std::span<const MirrorPlane> planes_;
  std::uint64_t& rays_;
  Bands sum_{}, straight_{};
  int counted_ = 0, heard_ = 0;
};

// The sound of a path after its mirrors: the product of what each makes of it, as if the others had
// no borders.
class ReflectedSound {
 public:
  ReflectedSound(const OcclusionGeometry& geometry, const UnfoldedPath& path, bool is_in_part,
                 bool is_hidden, double speed_of_sound_mps, std::uint64_t& rays)
      : path_(path) {
    for (std::size_t k = 0; k < path.order(); ++k) {
      edges_[k] = sound_over_mirror_edges(geometry, path.reflection(k, is_in_part), is_hidden,
                                          speed_of_sound_mps, rays);
      nearness_ = std::max(nearness_, edges_[k].nearness);
      is_over_edges_ |= !edges_[k].sounds.empty();
    }
    if (path.order() == 1 || !is_over_edges_) return;
    for (std::size_t k = 0; k < path.order(); ++k) {
      const Bands power = reflected_at(geometry, path.plane(k), path.point_m(k), false, rays);
      for (std::size_t b = 0; b < kBandCount; ++b) {
        straight_[k][b] = std::sqrt(power[b]);
        whole_[b] *= straight_[k][b];
      }
    }
  }

  double nearness() const { return nearness_; }
  bool is_over_edges() const { return is_over_edges_; }
  const Bands& whole() const { return whole_; }

  // Sets pressure and visibility. `amplitude` is that of the path itself.
  void multiply(const Bands& amplitude, const LineOfSight& line, DirectSound& sound) {
    const double straight_m = length(Vec3(line.from_m) - Vec3(line.to_m));
    if (path_.order() == 1) straight_[0] = whole_ = amplitude;
    sound.pressure.fill(1);
    sound.visibility = same_in_all_bands(1);
    for (std::size_t k = 0; k < path_.order(); ++k) {
      Tones& factor = factors_[k] = edges_[k].across;
      for (std::size_t i = 0; i < kTones; ++i)
        factor[i] += static_cast<double>(straight_[k][i / kTonesPerBand]);
      const Bands power = power_of(factor, straight_m, edges_[k].sounds, line.speed_of_sound_mps);
      for (std::size_t b = 0; b < kBandCount; ++b) sound.visibility[b] *= power[b];
      for (std::size_t i = 0; i < kTones; ++i) {
        for (const EdgeSound& one : edges_[k].sounds) factor[i] += one.pressure[i];
        sound.pressure[i] *= factor[i];
      }
    }
    // Around the listener, part of the path may be hidden, or end where the material changes.
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const bool is_whole = whole_[b] > 0;
      const float factor = is_whole ? amplitude[b] / whole_[b] : 1,
                  more = is_whole ? 0 : amplitude[b];
      sound.visibility[b] = factor * factor * sound.visibility[b] + more * more;
      for (std::size_t i = kTonesPerBand * b; i < kTonesPerBand * (b + 1); ++i)
        sound.pressure[i] =
            static_cast<double>(factor) * sound.pressure[i] + static_cast<double>(more);
    }
  }

  // All sounds over edges, as the listener sees them, after multiply().
  std::vector<EdgeSound> sounds() const {
    std::vector<EdgeSound> all;
    for (std::size_t k = 0; k < path_.order(); ++k)
      for (EdgeSound sound : edges_[k].sounds) {
        for (std::size_t other = 0; other < path_.order(); ++other)
          for (std::size_t i = 0; i < kTones && other != k; ++i)
            sound.pressure[i] *= factors_[other][i];
        sound.first_m = path_.seen_m(k, sound.first_m);
        sound.last_m = path_.seen_m(k, sound.last_m);
        all.push_back(sound);
      }
    return all;
  }

 private:
  const UnfoldedPath& path_;
  std::array<MirrorEdges, kMaxImageOrder> edges_{};  // by mirror
  // The amplitude that each mirror reflects where the straight path meets it, and their product.
  std::array<Bands, kMaxImageOrder> straight_{};
  Bands whole_ = same_in_all_bands(1);
  std::array<Tones, kMaxImageOrder> factors_{};
  double nearness_ = 0;
  bool is_over_edges_ = false;
};

}  // namespace

DirectSound image_sound(const OcclusionGeometry& geometry, const Source& image,
                        const LineOfSight& line, std::uint64_t& rays) {
  DirectSound sound;
  const Vec3 place(line.to_m);
  const PathEnd end(Vec3(line.from_m), Vec3(image.original_m), image.is_in_part);
  if (!end.is_image() || end.seen_m == place) return sound;
  MirrorSeries met;
  const auto straight = mirror_path(geometry, place, end, rays, &met);
  const UnfoldedPath path =
      straight ? UnfoldedPath(met, end.real_m, place) : unfolded(geometry, image, end, place);
  DiscView disc(geometry, end, place, path.planes(), straight, rays);
  ReflectedSound reflected(geometry, path, image.is_in_part, !straight, line.speed_of_sound_mps,
                           rays);
  if (reflected.is_over_edges()) {
    // Rays may miss one of several mirrors at its border.
    const bool is_free = path.order() == 1 ? straight.has_value() : path.is_free(geometry, rays);
    const Bands amplitude =
        path.order() == 1 ? disc.amplitude(disc.straight(), reflected.nearness())
                          : disc.amplitude(reflected.whole(), is_free ? reflected.nearness() : 0);
    reflected.multiply(amplitude, line, sound);
    sound.is_over_edges = true;
    if (!straight) sound.bent = mean_path(line, reflected.sounds());
    return sound;
  }
  const Bands amplitude = disc.amplitude({}, 0);
  for (std::size_t i = 0; i < kTones; ++i)
    sound.pressure[i] = static_cast<double>(amplitude[i / kTonesPerBand]);
  sound.visibility = power_of(sound.pressure);
  return sound;
}

}  // namespace clamor
