#include "bake/trace/portal_crossings.h"

#include <cmath>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {
namespace {

Vec3 random_vector(std::uint32_t i, std::uint32_t use) {
  const RandomBits bits = philox(5, {i, use, 0, 0});
  return {2 * unit(bits[0]) - 1, 2 * unit(bits[1]) - 1, 2 * unit(bits[2]) - 1};
}

std::vector<Portal> random_portals(std::uint32_t count) {
  std::vector<Portal> portals(count);
  for (std::uint32_t p = 0; p < count; ++p) {
    portals[p].centre_m = 10.0 * random_vector(p, 0);
    portals[p].half_u_m = random_vector(p, 1);
    portals[p].half_v_m = 2.0 * normalize(cross(portals[p].half_u_m, random_vector(p, 2)));
  }
  return portals;
}

// Where the leg meets the rectangle: its sides are at 1; above that it passes beside it.
double place_of(const Portal& portal, const Vec3& from_m, const Vec3& to_m) {
  const Vec3 normal = cross(portal.half_u_m, portal.half_v_m);
  const double d0 = dot(from_m - portal.centre_m, normal), d1 = dot(to_m - portal.centre_m, normal);
  if ((d0 < 0) == (d1 < 0)) return 1e9;
  const Vec3 at = from_m + (to_m - from_m) * (d0 / (d0 - d1)) - portal.centre_m;
  const Vec3 &u = portal.half_u_m, &v = portal.half_v_m;
  return std::max(std::abs(dot(at, u)) / dot(u, u), std::abs(dot(at, v)) / dot(v, v));
}

TEST(PortalCrossings, AreThoseOfTheRectanglesOneByOne) {
  for (const std::uint32_t count : {1u, 8u, 9u, 100u, 1024u}) {
    const auto portals = random_portals(count);
    const PortalCrossings crossings(portals, 0);
    std::vector<KernelPhoton> photons(500);
    std::vector<std::uint16_t> alive;
    std::vector<Ray> rays;
    std::vector<SurfaceHit> hits;
    for (std::uint32_t i = 0; i < photons.size(); ++i) {
      const Vec3 from_m = 10.0 * random_vector(i, 3), to_m = from_m + 3.0 * random_vector(i, 4);
      alive.push_back(static_cast<std::uint16_t>(i));
      rays.push_back({Vec3f(from_m), Vec3f(normalize(to_m - from_m))});
      hits.push_back(
          {{}, 1, static_cast<float>(length(to_m - from_m)), i % 50 == 7 ? SurfaceHit::kNone : 0u});
    }
    crossings.add(photons, alive, rays, hits);
    std::size_t found = 0;
    for (std::size_t i = 0; i < photons.size(); ++i) {
      const Vec3 from_m(rays[i].origin_m),
          to_m = from_m + Vec3(rays[i].direction) * static_cast<double>(hits[i].distance_m);
      PortalSet expected;
      bool is_close = false;  // to an edge: rounding decides
      std::size_t passed = 0;
      for (std::size_t p = 0; p < portals.size(); ++p) {
        const double place = place_of(portals[p], from_m, to_m);
        is_close |= std::abs(place - 1) < 1e-4;
        if (place > 1) continue;
        expected.add(p);
        ++passed;
      }
      if (hits[i].material == SurfaceHit::kNone) expected = {};
      if (!is_close && passed <= 4) {
        EXPECT_EQ(photons[i].portals.numbers, expected.numbers) << i;
      }
      found += photons[i].portals.size();
    }
    EXPECT_GE(found, count >= 100 ? 20u : 0u);
  }
}

TEST(PortalCrossings, AreNoneOfALegThatEndsInThePlane) {
  const std::vector<Portal> portals = {{"", {0, 0, 5}, {1, 0, 0}, {0, 1, 0}}};
  const PortalCrossings crossings(portals, 1e-4);
  std::vector<KernelPhoton> photons(3);
  const std::vector<std::uint16_t> alive = {0, 1, 2};
  const std::vector<Ray> rays = {
      {{0, 0, 0}, {0, 0, 1}}, {{0, 0, 9}, {0, 0, -1}}, {{0, 0, 9}, {0, 0, -1}}};
  const std::vector<SurfaceHit> hits = {{{}, 1, 5, 0}, {{}, 1, 4, 0}, {{}, 1, 4.1f, 0}};
  crossings.add(photons, alive, rays, hits);
  EXPECT_TRUE(photons[0].portals.is_empty());
  EXPECT_TRUE(photons[1].portals.is_empty());
  EXPECT_FALSE(photons[2].portals.is_empty());
}

}  // namespace
}  // namespace clamor
