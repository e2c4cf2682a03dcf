// Energy conservation per photon: emitted power is absorbed, transmitted, escaped, unfinished or
// accounted for by roulette.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bake/early/image_search.h"
#include "bake/trace/photon_tracer.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

using Power = std::array<double, kBandCount>;

constexpr std::uint16_t kThin = 1;

// A box without a ceiling, divided by a thin wall of material kThin.
Level two_rooms(const Material& outer, const Material& thin) {
  Level level = testing::shoebox({6, 4, 3}, outer, {1.5, 2, 1.2});
  level.mesh.triangles.resize(10);
  level.mesh.materials.resize(10);
  testing::add_wall_across(level.mesh, 3, {6, 4, 3}, kThin);
  level.materials.push_back(thin);
  return level;
}

// The power balance of one photon, relative to its initial power.
struct Account {
  Power absorbed{}, transmitted{}, escaped{}, unfinished{};
  Power gained{}, killed{};  // by roulette: for survivors, and for the others
};

// Traces every photon as a run of its own, so that it has a tally of its own, and follows its power
// from deposit to deposit.
std::vector<Account> accounts(const Level& level, const TraceSettings& settings,
                              std::uint32_t photons) {
  const Scene scene(level.mesh);
  const PhotonTracer tracer(scene, level, settings);
  std::vector<PhotonRun> runs;
  for (std::uint32_t i = 0; i < photons; ++i) runs.push_back({0, i, 1});
  TracedRuns traced;
  tracer.trace(runs, traced);
  std::vector<Account> result;
  for (const TracedRun& run : traced.runs()) {
    Account account;
    Power before{}, launched{};  // power on the way to the next surface
    for (std::size_t b = 0; b < kBandCount; ++b)
      launched[b] = before[b] = emitted_power(level.emitters[0], b);
    const auto share = [&](std::size_t b, double power) { return power / launched[b]; };
    const auto deposits = traced.deposits().subspan(run.first_deposit, run.deposits);
    double odds = 1;  // survival probability at the last surface
    for (std::size_t i = 0; i < deposits.size();) {
      const Material& material = level.materials[deposits[i].material];
      const bool thin = deposits[i].material == kThin;
      Power hit{}, kept{};
      for (std::size_t b = 0; b < kBandCount; ++b) {
        const double reflected = deposits[i].power[b];
        const double through = thin ? deposits[i + 1].power[b] : 0;
        hit[b] = reflected / (1 - material.absorption[b]);
        kept[b] = reflected + through;
        EXPECT_NEAR(hit[b] * odds / before[b], 1, 1e-4);
        EXPECT_NEAR(through, hit[b] * material.transmission[b], 1e-5 * hit[b]);
        account.gained[b] += share(b, hit[b] - before[b]);
        account.absorbed[b] += share(b, hit[b] - kept[b]);
        account.transmitted[b] += share(b, through);
      }
      odds = std::pow(
          *std::max_element(kept.begin(), kept.end()) / *std::max_element(hit.begin(), hit.end()),
          settings.roulette_exponent);
      before = kept;
      i += thin ? 2 : 1;
    }
    for (std::size_t b = 0; b < kBandCount; ++b) {
      account.escaped[b] = share(b, run.tally.power_escaped[b]);
      account.unfinished[b] = share(b, run.tally.power_unfinished[b]);
      const double left = account.escaped[b] + account.unfinished[b];
      // A photon that neither escaped nor is unfinished was ended by roulette. Otherwise its
      // remaining power grew by 1 / probability.
      account.killed[b] = left > 0 ? 0 : share(b, before[b]);
      if (left > 0) account.gained[b] += left - share(b, before[b]);
    }
    result.push_back(account);
  }
  return result;
}

// Rooms with unlike absorption in the bands but the same BRDF.
Level alike_rooms() {
  Material outer = testing::uniform_material(0, 0.4f, 10);
  outer.absorption = {0.02f, 0.05f, 0.1f, 0.15f, 0.2f, 0.3f, 0.4f, 0.5f};
  Material thin = testing::uniform_material(0.5f, 0.2f, 20);
  thin.transmission = same_in_all_bands(0.2f);
  return two_rooms(outer, thin);
}

TEST(EnergyBalance, BalancesPerPhotonAndBandWithoutRoulette_NoAsan) {
  const auto books = accounts(alike_rooms(), {.roulette_exponent = 0, .max_bounces = 40}, 3000);
  Power transmitted{}, escaped{};
  for (const Account& a : books)
    for (std::size_t b = 0; b < kBandCount; ++b) {
      EXPECT_NEAR(a.absorbed[b] + a.escaped[b] + a.unfinished[b] + a.killed[b], 1, 1e-4);
      EXPECT_NEAR(a.gained[b], 0, 1e-4);
      transmitted[b] += a.transmitted[b] / 3000;
      escaped[b] += a.escaped[b] / 3000;
    }
  EXPECT_GT(transmitted[0], 0.05);
  EXPECT_GT(escaped[0], 0.3);
}

TEST(EnergyBalance, BalancesWithRouletteIncludingItsGainsAndLosses_NoAsan) {
  for (const double exponent : {0.15, 0.5, 1.0}) {
    const auto books =
        accounts(alike_rooms(), {.roulette_exponent = exponent, .max_bounces = 40}, 8000);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      double sum = 0, squares = 0, given = 0;
      for (const Account& a : books) {
        EXPECT_NEAR(a.absorbed[b] + a.escaped[b] + a.unfinished[b] + a.killed[b], 1 + a.gained[b],
                    2e-4 * (1 + a.gained[b]));
        const double difference = a.gained[b] - a.killed[b];
        sum += difference;
        squares += difference * difference;
        given += a.gained[b];
      }
      // On average roulette gives survivors what it takes from the others.
      EXPECT_LT(std::abs(sum), 4 * std::sqrt(squares)) << "exponent " << exponent << ", band " << b;
      EXPECT_GT(given, 10 * std::sqrt(squares)) << "exponent " << exponent << ", band " << b;
    }
  }
}

TEST(EnergyBalance, BalancesOnAverageForBandsWithDifferentBrdfs_NoAsan) {
  Material outer = testing::uniform_material(0.1f, 0.2f);
  outer.phong = {0, 1, 3, 10, 30, 100, 300, 1000};
  Material thin = testing::uniform_material(0.7f, 0.1f);
  thin.phong = {1000, 100, 50, 20, 10, 5, 2, 1};
  thin.transmission = {0.6f, 0.4f, 0.3f, 0.2f, 0.1f, 0.05f, 0.02f, 0.01f};
  const Level level = two_rooms(outer, thin);
  const Scene scene(level.mesh);
  const PhotonTracer tracer(scene, level, {.roulette_exponent = 0.15, .max_bounces = 30});
  constexpr std::uint32_t kRuns = 200;
  Power sum{}, squares{};
  for (std::uint32_t r = 0; r < kRuns; ++r) {
    const PhotonRun run{0, std::uint64_t{r} * kRunPhotons, kRunPhotons};
    TracedRuns traced;
    tracer.trace({&run, 1}, traced);
    Power spent{};
    for (std::size_t b = 0; b < kBandCount; ++b)
      spent[b] =
          traced.runs()[0].tally.power_escaped[b] + traced.runs()[0].tally.power_unfinished[b];
    for (std::size_t i = 0; i < traced.deposits().size(); ++i) {
      const Deposit& deposit = traced.deposits()[i];
      const Material& material = level.materials[deposit.material];
      for (std::size_t b = 0; b < kBandCount; ++b)
        spent[b] += deposit.power[b] / (1 - material.absorption[b]) *
                    (material.absorption[b] - material.transmission[b]);
      if (deposit.material == kThin) ++i;  // the deposit of the same hit on the far side
    }
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double ratio = spent[b] / kRunPhotons / emitted_power(level.emitters[0], b);
      sum[b] += ratio / kRuns;
      squares[b] += ratio * ratio / kRuns;
    }
  }
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double error = std::sqrt((squares[b] - sum[b] * sum[b]) / (kRuns - 1));
    EXPECT_NEAR(sum[b], 1, 4 * error) << "band " << b;
    EXPECT_LT(error, 0.005) << "band " << b;
  }
}

// Power of paths that image sources stand for is that which mirrors reflect on them; all the rest
// is in deposits.
TEST(EnergyBalance, CountsThePowerOfImagesOnce_NoAsan) {
  Material mirror = testing::uniform_material(0, 0, kMirrorExponent);
  mirror.absorption = {0.02f, 0.05f, 0.1f, 0.15f, 0.2f, 0.3f, 0.4f, 0.5f};
  mirror.scattering = {0.5f, 0.4f, 0.3f, 0.2f, 0.1f, 0.05f, 0.02f, 0};
  const Level level = testing::shoebox({6, 4, 3}, mirror, {1.5, 2, 1.2});
  const Scene scene(level.mesh);
  const auto traced = [&](int order) {
    TraceSettings settings{.roulette_exponent = 0, .max_bounces = 3};
    if (order > 0)
      settings.images = std::make_shared<const ImageIndex>(find_images(scene, level, order));
    const PhotonTracer tracer(scene, level, settings);
    TracedRuns runs;
    const PhotonRun run{0, 0, 1000};
    tracer.trace({&run, 1}, runs);
    Power all{}, of_images = runs.runs()[0].tally.power_of_images;
    for (const Deposit& deposit : runs.deposits())
      for (std::size_t b = 0; b < kBandCount; ++b) all[b] += deposit.power[b];
    for (std::size_t b = 0; b < kBandCount; ++b) all[b] += of_images[b];
    return std::pair(all, of_images);
  };
  const auto [without, none] = traced(0);
  EXPECT_EQ(none, Power{});
  // One photon in 300 leads to an image that too few rays have found.
  for (int order = 1; order <= 3; ++order) {
    const auto [with, of_images] = traced(order);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      EXPECT_NEAR(with[b] / without[b], 1, 1e-5) << "order " << order << ", band " << b;
      double expected = 0, left = 1000 * emitted_power(level.emitters[0], b);
      for (int bounce = 0; bounce < order; ++bounce)
        expected += left *=
            static_cast<double>((1 - mirror.absorption[b]) * (1 - mirror.scattering[b]));
      EXPECT_NEAR(of_images[b] / expected, 1, 0.03) << "order " << order << ", band " << b;
    }
  }
}

// With image sources, mirrors reflect power that leaves no deposit.
TEST(PhotonTracer, CountsThePowerThatArrivesAtEachMaterial) {
  Material mirror = testing::uniform_material(0.2f, 0.3f, kMirrorExponent);
  Material thin = testing::uniform_material(0.5f);
  thin.transmission = testing::uniform_material(0.2f).absorption;
  const Level level = two_rooms(mirror, thin);
  const Scene scene(level.mesh);
  TraceSettings settings{.roulette_exponent = 0, .max_bounces = 40};
  settings.images = std::make_shared<const ImageIndex>(find_images(scene, level, 3));
  const PhotonTracer tracer(scene, level, settings);
  const std::vector<PhotonRun> photons = {{0, 0, 500}, {0, 500, 300}};
  TracedRuns together;
  tracer.trace(photons, together);
  for (std::size_t r = 0; r < photons.size(); ++r) {
    TracedRuns alone;
    tracer.trace({&photons[r], 1}, alone);
    const TracedRun& run = together.runs()[r];
    ASSERT_EQ(run.arrived.size(), 2u);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      double went = run.tally.power_escaped[b] + run.tally.power_unfinished[b];
      for (const ArrivedPower& arrived : run.arrived) {
        const Material& material = level.materials[arrived.material];
        went += static_cast<double>(arrived.power[b]) *
                static_cast<double>(material.absorption[b] - material.transmission[b]);
      }
      // Without roulette, and with surfaces that are alike in all bands, the balance holds for each
      // path, but for the rounding of single precision.
      EXPECT_NEAR(went / (photons[r].count * emitted_power(level.emitters[0], b)), 1, 1e-4)
          << "band " << b;
      for (std::size_t m = 0; m < 2; ++m)
        EXPECT_EQ(run.arrived[m].power[b], alone.runs()[0].arrived[m].power[b]);
    }
  }
}

}  // namespace
}  // namespace clamor
