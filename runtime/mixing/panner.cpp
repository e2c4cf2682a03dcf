#include "runtime/mixing/panner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "runtime/mixing/spherical_harmonics.h"

namespace clamor {

namespace {

const std::vector<LoudspeakerLayout>& layouts() {
  using enum Speaker;
  static const std::vector<LoudspeakerLayout> kLayouts = {
      {"stereo", {{kFrontLeft, 30, 0}, {kFrontRight, -30, 0}}},
      {"5.1",
       {{kFrontLeft, 30, 0},
        {kFrontRight, -30, 0},
        {kFrontCentre, 0, 0},
        {kLowFrequency, 0, 0},
        {kSideLeft, 110, 0},
        {kSideRight, -110, 0}}},
      {"7.1",
       {{kFrontLeft, 30, 0},
        {kFrontRight, -30, 0},
        {kFrontCentre, 0, 0},
        {kLowFrequency, 0, 0},
        {kBackLeft, 135, 0},
        {kBackRight, -135, 0},
        {kSideLeft, 90, 0},
        {kSideRight, -90, 0}}},
      {"7.1.4",
       {{kFrontLeft, 30, 0},
        {kFrontRight, -30, 0},
        {kFrontCentre, 0, 0},
        {kLowFrequency, 0, 0},
        {kBackLeft, 135, 0},
        {kBackRight, -135, 0},
        {kSideLeft, 90, 0},
        {kSideRight, -90, 0},
        {kTopFrontLeft, 45, 45},
        {kTopFrontRight, -45, 45},
        {kTopBackLeft, 135, 45},
        {kTopBackRight, -135, 45}}},
  };
  return kLayouts;
}

class LoudspeakerPanner final : public Panner {
 public:
  explicit LoudspeakerPanner(const LoudspeakerLayout& layout)
      : channels_(static_cast<int>(layout.speakers.size())) {
    std::vector<Vec3> corners;
    double highest = 0, widest_deg = 0;
    for (std::size_t c = 0; c < layout.speakers.size(); ++c) {
      if (layout.speakers[c].speaker == Speaker::kLowFrequency) continue;
      corners.push_back(Vec3(direction_of(layout.speakers[c])));
      channel_of_.push_back(c);
      highest = std::max(highest, layout.speakers[c].elevation_deg);
      widest_deg = std::max(widest_deg, std::abs(layout.speakers[c].azimuth_deg));
    }
    real_ = corners.size();
    corners.push_back({0, 0, -1});
    if (highest == 0) corners.push_back({0, 0, 1});
    if (widest_deg < 90) corners.push_back({-1, 0, 0});
    find_triangles(corners);
  }

  int channels() const noexcept REALTIME override { return channels_; }

  ChannelGains gains(const Vec3f& from) const noexcept REALTIME override {
    // Weights of the corners of each triangle whose sum is `from`. The smallest is negative unless
    // the direction lies within.
    std::array<float, kMaxTriangles> min_weight;
    min_weight.fill(std::numeric_limits<float>::lowest());
    for (std::size_t t = 0; t < triangles_; ++t) {
      const auto corner = [&](std::size_t k) {
        return inverse_[k][0][t] * from.x + inverse_[k][1][t] * from.y + inverse_[k][2][t] * from.z;
      };
      min_weight[t] = std::min({corner(0), corner(1), corner(2)});
    }
    // If four corners are coplanar, both ways to split them contain the direction; take the mean.
    const float within = std::min(-1e-6f, *std::ranges::max_element(min_weight));
    std::array<float, kMaxChannels + 3> corner_gains{};
    for (std::size_t t = 0; t < triangles_; ++t) {
      if (min_weight[t] < within) continue;
      for (std::size_t k = 0; k < 3; ++k)
        corner_gains[corners_[t][k]] +=
            std::max(0.0f, inverse_[k][0][t] * from.x + inverse_[k][1][t] * from.y +
                               inverse_[k][2][t] * from.z);
    }
    float helped = 0;
    for (std::size_t c = real_; c < corner_gains.size(); ++c) helped += corner_gains[c];
    helped /= std::sqrt(static_cast<float>(real_));
    ChannelGains gains{};
    float power = 0;
    for (std::size_t c = 0; c < real_; ++c) {
      const float gain = corner_gains[c] + helped;
      gains[channel_of_[c]] = gain;
      power += gain * gain;
    }
    if (!(power > 0)) return {};  // not a direction
    const float scale = 1 / std::sqrt(power);
    for (float& gain : gains) gain *= scale;
    return gains;
  }

 private:
  static constexpr std::size_t kMaxTriangles = 64;

  // Triangles of three corners that have all others on one side of their plane or in it.
  void find_triangles(const std::vector<Vec3>& corners) {
    for (std::size_t a = 0; a < corners.size(); ++a)
      for (std::size_t b = a + 1; b < corners.size(); ++b)
        for (std::size_t c = b + 1; c < corners.size(); ++c) {
          const Vec3 normal = cross(corners[b] - corners[a], corners[c] - corners[a]);
          if (length(normal) < 1e-6) continue;
          double low = 0, high = 0;
          for (const Vec3& corner : corners) {
            const double side = dot(normalize(normal), corner - corners[a]);
            low = std::min(low, side);
            high = std::max(high, side);
          }
          if (low < -1e-6 && high > 1e-6) continue;
          const double volume = dot(corners[a], cross(corners[b], corners[c]));
          // Coplanar with the listener: the two halves of a ring, which has no face there.
          if (std::abs(volume) < 1e-6 || triangles_ == kMaxTriangles) continue;
          const std::array<Vec3, 3> rows = {cross(corners[b], corners[c]) / volume,
                                            cross(corners[c], corners[a]) / volume,
                                            cross(corners[a], corners[b]) / volume};
          for (std::size_t k = 0; k < 3; ++k)
            for (int axis = 0; axis < 3; ++axis)
              inverse_[k][static_cast<std::size_t>(axis)][triangles_] =
                  static_cast<float>(rows[k][axis]);
          corners_[triangles_++] = {a, b, c};
        }
  }

  const int channels_;
  std::size_t real_ = 0, triangles_ = 0;
  std::vector<std::size_t> channel_of_;  // by corner; real loudspeakers only
  std::array<std::array<std::size_t, 3>, kMaxTriangles> corners_{};
  // [corner][axis][triangle]: contiguous over triangles for vectors.
  std::array<std::array<std::array<float, kMaxTriangles>, 3>, 3> inverse_{};
};

class AmbisonicPanner final : public Panner {
 public:
  int channels() const noexcept REALTIME override { return kAmbisonicChannels; }
  ChannelGains gains(const Vec3f& from) const noexcept REALTIME override {
    return spherical_harmonics(from);
  }
};

}  // namespace

std::vector<Speaker> LoudspeakerLayout::order() const {
  std::vector<Speaker> order;
  for (const Loudspeaker& speaker : speakers) order.push_back(speaker.speaker);
  return order;
}

Result<LoudspeakerLayout> find_layout(std::string_view name) {
  std::string names;
  for (const LoudspeakerLayout& layout : layouts()) {
    if (layout.name == name) return layout;
    names += std::string(names.empty() ? "" : ", ").append(layout.name);
  }
  return Error("no loudspeaker layout is called " + in_quotes(name) + "; there are " + names);
}

Vec3f direction_of(const Loudspeaker& speaker) {
  const double azimuth = speaker.azimuth_deg * std::numbers::pi / 180;
  const double elevation = speaker.elevation_deg * std::numbers::pi / 180;
  return Vec3f(Vec3(std::cos(azimuth) * std::cos(elevation),
                    std::sin(azimuth) * std::cos(elevation), std::sin(elevation)));
}

std::unique_ptr<Panner> make_loudspeaker_panner(const LoudspeakerLayout& layout) {
  return std::make_unique<LoudspeakerPanner>(layout);
}

std::unique_ptr<Panner> make_ambisonic_panner() { return std::make_unique<AmbisonicPanner>(); }

}  // namespace clamor
