// diffuse_late_field_test.cpp: late reflections that radiate by the cosine law hold their energy.
#include "bake/probes/diffuse_late_field.h"

#include <gtest/gtest.h>

#include "tests/rooms.h"

namespace clamor {
namespace {

// Two plates of 4 by 4 km, 6 m apart: nothing passes their edges.
Mesh plates() {
  Mesh mesh;
  for (const float y : {0.0f, 6.0f})
    testing::add_quad(mesh, {Vec3f(-2000, y, -2000), Vec3f(-2000, y, 2000), Vec3f(2000, y, 2000),
                             Vec3f(2000, y, -2000)});
  return mesh;
}

// Sources on the lower plate, later and later, of sound that arrived at this angle.
std::vector<Source> on_lower_plate(double cos_i) {
  std::vector<Source> sources(4000);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    sources[i].normal = {0, 1, 0};
    sources[i].mirror = Vec3f(Vec3(std::sqrt(1 - cos_i * cos_i), cos_i, 0));
    sources[i].delay_s = 1e-3f * static_cast<float>(i);
    sources[i].power = same_in_all_bands(1);
  }
  return sources;
}

double mean_power(const std::vector<Source>& sources) {
  double sum = 0;
  for (const Source& source : sources) sum += static_cast<double>(source.power[3]);
  return sum / static_cast<double>(sources.size());
}

// The mean of 1 / cos o by a law, at vertical incidence: the length of paths between plates, up to
// a constant. By the cosine law it is 2.
double mean_inverse_cosine(const ReflectionLaws& laws) {
  constexpr int kSteps = 10000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double mu = (i + 0.5) / kSteps;
    sum += 2 * std::numbers::pi * laws.density(0, 3, 1, mu, mu) / mu / kSteps;
  }
  return sum;
}

TEST(DiffuseLateField, OfPlatesHoldsTheEnergyOfTheirFlutterEcho) {
  const Mesh mesh = plates();
  const Scene scene(mesh);
  const std::vector<Material> materials = {testing::uniform_material(0.1f, 0, kMirrorExponent)};
  const ReflectionLaws laws(materials);
  std::vector<Source> sources = on_lower_plate(1);
  make_diffuse(sources, scene, laws);
  // An echo that goes straight to and fro is in the air half as long as diffuse sound. The lobe
  // through which mirrors are heard makes that 0.56. The noise of 4000 sources is 0.5 %.
  EXPECT_NEAR(mean_power(sources) / (mean_inverse_cosine(laws) / 2), 1, 0.02);
  EXPECT_LT(mean_power(sources), 0.6);
  for (const Source& source : sources) EXPECT_EQ(source.mirror, source.normal);
}

TEST(DiffuseLateField, OfRoughSurfacesHasTheirPower) {
  const Mesh mesh = testing::box({6, 8, 5});
  const Scene scene(mesh);
  const std::vector<Material> materials = {testing::uniform_material(0.1f)};
  std::vector<Source> sources = on_lower_plate(0.5);
  for (Source& source : sources) source.position_m = {3, 0, 4};
  make_diffuse(sources, scene, ReflectionLaws(materials));
  for (const Source& source : sources) EXPECT_NEAR(source.power[3], 1, 1e-5);
}

TEST(DiffuseLateField, OfTheOpenAirKeepsItsPower) {
  const Mesh none;
  const Scene scene(none);
  const std::vector<Material> materials = {testing::uniform_material(0.1f, 0, kMirrorExponent)};
  std::vector<Source> sources = on_lower_plate(1);
  make_diffuse(sources, scene, ReflectionLaws(materials));
  EXPECT_EQ(mean_power(sources), 1);
  std::vector<Source> nothing;
  make_diffuse(nothing, scene, ReflectionLaws(materials));
}

}  // namespace
}  // namespace clamor
