// Error of quantising sources: the same room, rendered from its sources as traced and as stored.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "bake/octree/patch_radius.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/random.h"
#include "formats/bake_file/source_quantization.h"
#include "formats/gltf/level_import.h"
#include "runtime/response/energy_response.h"
#include "runtime/response/impulse_response.h"
#include "tests/build_paths.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

constexpr std::uint32_t kPhotons = 16000;
constexpr std::size_t kListeners = 24;
constexpr std::size_t kFrames = 1 << 16;  // 1.37 s; the room's T30 is 0.9 s at most

// The violin room and its sources before and after quantisation.
struct Violin {
  Level level;
  std::vector<Source> traced, quantised;
};

Violin traced_violin() {
  Violin room;
  auto imported =
      import_level(std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb", {});
  EXPECT_TRUE(imported.ok());
  room.level = std::move(imported->level);
  // Photons that mirrors reflect meet in fewer places, and the interference of few hides what is
  // compared here.
  for (Material& material : room.level.materials) material.phong = same_in_all_bands(kMirrorLobe);
  const Scene scene(room.level.mesh);
  TraceSettings settings;
  settings.speed_mps = speed_of_sound_mps(room.level.air);
  settings.air_loss_per_m = air_loss_per_m(room.level.air);
  settings.roulette_exponent = 0.5;  // more alike in power than bakes have them, for the same reason
  const PhotonTracer tracer(scene, room.level, settings);
  TracedRuns traced;
  std::vector<PhotonRun> runs;
  for (std::uint32_t first = 0; first < kPhotons; first += 500) runs.push_back({0, first, 500});
  tracer.trace(runs, traced);
  std::vector<std::uint32_t> bounces(kPhotons, 0);
  for (const TracedRun& run : traced.runs())
    for (const Deposit& deposit : traced.deposits_of(run)) {
      Source& source = room.traced.emplace_back(secondary_source(deposit, 1.0 / kPhotons));
      const auto photon = static_cast<std::uint32_t>(run.run.first) + deposit.photon;
      const RandomBits bits =
          philox(tracer.emitter_key(0),
                 {photon, 0, ++bounces[photon], static_cast<std::uint32_t>(Use::kPolarity)});
      source.polarity = (bits[0] & 1) != 0 ? 1 : -1;
    }
  set_patch_radii(room.traced);
  room.quantised = room.traced;
  quantize_sources(room.quantised, room.level.materials);
  // Polarities must be equal, because other ones would add up to another waveform.
  for (std::size_t i = 0; i < room.traced.size(); ++i)
    room.quantised[i].polarity = room.traced[i].polarity;
  return room;
}

// Places 1.2 m above the floor of the room; some near walls, one near the violin.
Vec3 listener(std::size_t i) {
  const auto n = static_cast<double>(i);
  return {-3.9 + 7.8 * std::fmod(0.5 + 0.7548776662 * n, 1), 1.2,
          -5 + 10 * std::fmod(0.5 + 0.5698402910 * n, 1)};
}

std::vector<Arrival> heard(const Violin& room, const std::vector<Source>& sources, std::size_t i) {
  return energy_response(sources, room.level.emitters, room.level.materials, room.level.air,
                         listener(i), std::nullopt);
}

double decibels(double ratio) { return 10 * std::log10(ratio); }

// Backward-integrated energy as a function of time.
class Decay {
 public:
  Decay(const std::vector<Arrival>& arrivals, std::size_t band) : left_(arrivals.size() + 1, 0) {
    for (const Arrival& arrival : arrivals) times_s_.push_back(arrival.time_s);  // ascending
    for (std::size_t i = arrivals.size(); i-- > 0;)
      left_[i] = left_[i + 1] + static_cast<double>(arrivals[i].energy[band]);
  }
  double whole() const { return left_[0]; }
  double at(double time_s) const {
    const auto next = std::lower_bound(times_s_.begin(), times_s_.end(), time_s);
    return left_[static_cast<std::size_t>(next - times_s_.begin())];
  }

 private:
  std::vector<double> times_s_, left_;
};

// Radix-2 FFT, in place.
void transform(std::vector<std::complex<double>>& x) {
  const std::size_t n = x.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; (j & bit) != 0; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(x[i], x[j]);
  }
  for (std::size_t half = 1; half < n; half *= 2)
    for (std::size_t k = 0; k < half; ++k) {
      const auto turn =
          std::polar(1.0, -std::numbers::pi * static_cast<double>(k) / static_cast<double>(half));
      for (std::size_t i = k; i < n; i += 2 * half) {
        const auto odd = x[i + half] * turn;
        x[i + half] = x[i] - odd;
        x[i] += odd;
      }
    }
}

// Adds the energies of a waveform in the third-octave bands 50 Hz, 63 Hz, ... 16 kHz.
void add_third_octaves(const std::vector<float>& waveform, std::vector<double>& energies) {
  std::vector<std::complex<double>> x(waveform.begin(), waveform.end());
  x.resize(kFrames);
  transform(x);
  energies.resize(26);
  for (std::size_t i = 1; i < kFrames / 2; ++i) {
    const double hz = static_cast<double>(i) * kSampleRate_hz / static_cast<double>(kFrames);
    const double third = std::round(3 * std::log2(hz / 1000)) + 13;
    if (third >= 0 && third < 26) energies[static_cast<std::size_t>(third)] += std::norm(x[i]);
  }
}

TEST(Quantisation, KeepsLevelsDecayAndThirdOctavesOfARoom) {
  if (testing::kSanitized) GTEST_SKIP() << "only numbers, which a sanitizer does not judge";
  const Violin room = traced_violin();
  ASSERT_GT(room.traced.size(), 150'000u);
  double level = 0;
  std::array<std::vector<Arrival>, 2> all;  // of all places, normalised to equal levels
  std::array<std::vector<double>, 2> thirds;
  for (std::size_t i = 0; i < kListeners; ++i) {
    std::array<Bands, 2> energy{};
    for (std::size_t k = 0; k < 2; ++k) {
      const auto arrivals = heard(room, k == 0 ? room.traced : room.quantised, i);
      for (const Arrival& arrival : arrivals) {
        for (std::size_t b = 0; b < kBandCount; ++b) energy[k][b] += arrival.energy[b];
        all[k].push_back(arrival);
      }
      add_third_octaves(impulse_response(arrivals, kFrames), thirds[k]);
    }
    for (std::size_t b = 0; b < kBandCount; ++b)
      level = std::max(level, std::abs(decibels(static_cast<double>(energy[1][b]) / energy[0][b])));
  }
  EXPECT_LT(level, 0.1);

  // Averaged over places, as in measurements of decay times: at a single place one strong source
  // may dominate after 0.4 s and show its own rounding of half a decibel.
  double curve = 0;
  for (auto& arrivals : all)
    std::stable_sort(arrivals.begin(), arrivals.end(),
                     [](const Arrival& x, const Arrival& y) { return x.time_s < y.time_s; });
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const Decay before(all[0], b), after(all[1], b);
    for (double t = 0; decibels(before.at(t) / before.whole()) > -35; t += 1e-3)
      curve = std::max(curve, std::abs(decibels(after.at(t) / before.at(t))));
  }
  EXPECT_LT(curve, 0.1);

  double third_octave = 0;
  for (std::size_t third = 0; third < thirds[0].size(); ++third) {
    const double change = decibels(thirds[1][third] / thirds[0][third]);
    third_octave = std::max(third_octave, std::abs(change));
    EXPECT_LT(std::abs(change), 0.1)
        << 1000 * std::exp2((static_cast<double>(third) - 13) / 3) << " Hz";
  }
  RecordProperty("third_octave_db", std::to_string(third_octave));
  RecordProperty("level_db", std::to_string(level));
  RecordProperty("decay_db", std::to_string(curve));
}

}  // namespace
}  // namespace clamor
