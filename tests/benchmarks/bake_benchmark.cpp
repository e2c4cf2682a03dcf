// How close to the machine is the photon tracer? It decides how long a designer waits for a bake.
//
// On each level, in turns within one run, so that the machine's load is the same for all:
//
//   bare_M   rays per second of Embree alone, on the rays that the plain walk casts
//   plain_M  bounces per second of the least a random walk can be: closest hit, random numbers,
//   cosine full_M   bounces per second of the tracer: eight bands with unlike lobes, air, path
//   weights,
//            roulette, deposits written
//   full_of_plain   their ratio          two_of_one   tracer on two threads over one
//
// Medians over the rounds. Two threads must make as many bounces of the same photons as one.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>
#include <vector>

#include <benchmark/benchmark.h>
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "bake/photon_tracer.h"
#include "bake/scene.h"
#include "common/maths.h"
#include "common/random.h"
#include "formats/level_import.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

Material unlike_bands() {
  Material material = testing::uniform_material(0.1f, 0.2f, 20);
  material.absorption = {0.05f, 0.06f, 0.08f, 0.1f, 0.1f, 0.12f, 0.15f, 0.2f};
  material.phong = {1, 2, 4, 8, 16, 32, 64, 128};
  return material;
}

// A 20 x 8 x 15 m hall whose walls are grids with bumps of up to 10 cm: 12 cells^2 triangles.
Level bumpy_hall(std::uint32_t cells) {
  Level level = testing::shoebox({20, 8, 15}, unlike_bands(), {5, 2, 4});
  if (cells == 1) return level;
  const Mesh box = level.mesh;
  Mesh mesh;
  for (std::size_t face = 0; face < 6; ++face) {
    const auto corner = [&](std::size_t triangle, std::size_t k) {
      return box.vertices_m[box.triangles[2 * face + triangle][k]];
    };
    const Vec3f origin = corner(0, 0), across = corner(0, 1) - origin, up = corner(1, 2) - origin;
    const Vec3f normal = normalize(cross(across, up));
    const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
    for (std::uint32_t y = 0; y <= cells; ++y)
      for (std::uint32_t x = 0; x <= cells; ++x) {
        const bool edge = x == 0 || y == 0 || x == cells || y == cells;
        const auto bump = static_cast<float>(
            edge ? 0 : 0.1 * unit(philox(7, {static_cast<std::uint32_t>(face), x, y, 0})[0]));
        mesh.vertices_m.push_back(origin + across * (static_cast<float>(x) / cells) +
                                  up * (static_cast<float>(y) / cells) + normal * bump);
      }
    for (std::uint32_t y = 0; y < cells; ++y)
      for (std::uint32_t x = 0; x < cells; ++x) {
        const std::uint32_t a = first + y * (cells + 1) + x, b = a + cells + 1;
        mesh.triangles.push_back({a, a + 1, b + 1});
        mesh.triangles.push_back({a, b + 1, b});
      }
  }
  mesh.materials.assign(mesh.triangles.size(), 0);
  level.mesh = std::move(mesh);
  return level;
}

Level sponza() {
  ImportOptions options;
  options.emitters = {"name=source,signal=impulse,at=0,2,0"};
  auto imported =
      import_level(std::string(CLAMOR_SOURCE_DIR) + "/../shared/levels/sponza.glb", options);
  if (!imported.ok()) return {};
  imported->level.materials.assign(imported->level.materials.size(), unlike_bands());
  return std::move(imported->level);
}

// The rays of another scene object, so that nothing of ours is timed with Embree.
class BareEmbree {
 public:
  explicit BareEmbree(const Mesh& mesh) {
    device_ = rtcNewDevice(embree_device());
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.vertices_m.size()));
    std::copy(mesh.vertices_m.begin(), mesh.vertices_m.end(), vertices);
    auto* indices = static_cast<std::array<std::uint32_t, 3>*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()));
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), indices);
    rtcSetGeometryMask(geometry, 0xffffffff);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~BareEmbree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }

  double seconds(const std::vector<Ray>& rays) const {
    const auto start = Clock::now();
    std::uint64_t hits = 0;
    for (const Ray& from : rays) {
      RTCRayHit ray;
      ray.ray.org_x = from.origin_m.x;
      ray.ray.org_y = from.origin_m.y;
      ray.ray.org_z = from.origin_m.z;
      ray.ray.tnear = 0;
      ray.ray.dir_x = from.direction.x;
      ray.ray.dir_y = from.direction.y;
      ray.ray.dir_z = from.direction.z;
      ray.ray.time = 0;
      ray.ray.tfar = std::numeric_limits<float>::infinity();
      ray.ray.mask = 0xffffffff;
      ray.ray.flags = 0;
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
      rtcIntersect1(scene_, &ray);
#else
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      rtcIntersect1(scene_, &context, &ray);
#endif
      hits += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
    }
    const double spent = seconds_since(start);
    if (hits == 0) std::abort();
    return spent;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

struct Walk {
  std::uint64_t bounces = 0;
  double length_m = 0;
};

// Photons in step, one surface after the other, Lambertian, nothing else.
Walk plain_walk(const Scene& scene, const Vec3f& start, std::uint32_t photons,
                std::uint32_t bounces, std::vector<Ray>* record) {
  Walk walk;
  std::vector<Ray> rays(photons);
  std::vector<SurfaceHit> hits(photons);
  const auto direction = [](const Vec3f& axis, const RandomBits& bits, bool sphere) {
    const float u = static_cast<float>(bits[0] >> 8) * 0x1p-24f;
    const SinCos turn = sin_cos_of_turn(static_cast<float>(bits[1] >> 8) * 0x1p-24f);
    const float cos_a = sphere ? 1 - 2 * u : std::sqrt(1 - u);
    const float sin_a = std::sqrt(std::max(0.0f, 1 - cos_a * cos_a));
    const float sign = axis.z < 0 ? -1.0f : 1.0f, a = -1 / (sign + axis.z), b = axis.x * axis.y * a;
    const float p = sin_a * turn.cos, q = sin_a * turn.sin;
    return Vec3f(axis.x * cos_a + (1 + sign * axis.x * axis.x * a) * p + b * q,
                 axis.y * cos_a + sign * b * p + (sign + axis.y * axis.y * a) * q,
                 axis.z * cos_a - sign * axis.x * p - axis.y * q);
  };
  for (std::uint32_t i = 0; i < photons; ++i)
    rays[i] = {start, direction({0, 1, 0}, philox(11, {i, 0, 0, 0}), true)};
  const auto offset_m = static_cast<float>(scene.offset_m());
  for (std::uint32_t bounce = 1; bounce <= bounces; ++bounce) {
    if (record != nullptr) record->insert(record->end(), rays.begin(), rays.end());
    scene.first_hits(rays, hits);
    for (std::uint32_t i = 0; i < photons; ++i) {
      const RandomBits bits = philox(11, {i, 0, bounce, 0});
      if (hits[i].material == SurfaceHit::kNone) {
        rays[i] = {start, direction({0, 1, 0}, bits, true)};
        continue;
      }
      ++walk.bounces;
      walk.length_m += static_cast<double>(hits[i].distance_m);
      rays[i].origin_m += rays[i].direction * hits[i].distance_m + hits[i].normal * offset_m;
      rays[i].direction = direction(hits[i].normal, bits, false);
    }
  }
  return walk;
}

void tracing(benchmark::State& state, const Level& level) {
  if (level.mesh.triangles.empty()) {
    state.SkipWithError("the level is not here");
    return;
  }
  const Scene scene(level.mesh);
  const BareEmbree bare(level.mesh);
  TraceSettings settings;
  settings.roulette_kappa = 0.15;
  settings.air_loss_per_m = air_loss_per_m(level.air);
  const PhotonTracer tracer(scene, level, settings);
  const Vec3f start(level.emitters[0].position_m);
  std::vector<Ray> rays;
  plain_walk(scene, start, 1024, 20, &rays);

  // As a bake does it: results go into memory that is kept from run to run.
  std::array<TracedRuns, 2> kept;
  const auto full = [&](std::uint64_t first, std::uint32_t runs, TracedRuns& traced) {
    Walk walk;
    for (std::uint32_t i = 0; i < runs; ++i) {
      const PhotonRun run{0, first + std::uint64_t{i} * kRunPhotons, kRunPhotons};
      tracer.trace({&run, 1}, traced);
      walk.bounces += traced.runs()[0].tally.bounces;
      benchmark::DoNotOptimize(traced.deposits().data());
      traced.clear();
    }
    return walk;
  };

  constexpr std::uint32_t kRuns = 6;
  full(0, kRuns, kept[0]);  // first pages
  full(0, kRuns, kept[1]);
  std::vector<double> bare_M, plain_M, full_M, ratio, two;
  std::uint64_t first = 0;
  for (auto _ : state) {
    bare_M.push_back(static_cast<double>(rays.size()) / bare.seconds(rays) / 1e6);
    auto from = Clock::now();
    const Walk plain = plain_walk(scene, start, 1024, 60, nullptr);
    plain_M.push_back(static_cast<double>(plain.bounces) / seconds_since(from) / 1e6);
    from = Clock::now();
    const Walk one = full(first, kRuns, kept[0]);
    full_M.push_back(static_cast<double>(one.bounces) / seconds_since(from) / 1e6);
    ratio.push_back(full_M.back() / plain_M.back());

    from = Clock::now();
    Walk left, right;
    std::thread other([&] { left = full(first, kRuns, kept[0]); });
    right = full(first + std::uint64_t{kRuns} * kRunPhotons, kRuns, kept[1]);
    other.join();
    const double both = static_cast<double>(left.bounces + right.bounces) / seconds_since(from);
    two.push_back(both / 1e6 / full_M.back());
    if (left.bounces != one.bounces) state.SkipWithError("two threads trace other paths than one");
    first += 2 * std::uint64_t{kRuns} * kRunPhotons;
  }
  state.counters["triangles"] = static_cast<double>(level.mesh.triangles.size());
  state.counters["bare_M"] = median(bare_M);
  state.counters["plain_M"] = median(plain_M);
  state.counters["full_M"] = median(full_M);
  state.counters["full_of_plain"] = median(ratio);
  state.counters["two_of_one"] = median(two);
}

BENCHMARK_CAPTURE(tracing, box, bumpy_hall(1))->Iterations(15)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tracing, hall_70k, bumpy_hall(76))->Iterations(9)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tracing, sponza, sponza())->Iterations(9)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tracing, hall_1M, bumpy_hall(300))->Iterations(7)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
