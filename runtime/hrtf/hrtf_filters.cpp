#include "runtime/hrtf/hrtf_filters.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "common/crossover.h"
#include "runtime/hrtf/erb_bands.h"

namespace clamor {

namespace {

constexpr double kFirstHigh_erb = 17.5;  // 1.27 kHz

// Nodes from 40 to 1200 Hz are chosen by hand, as close as the filter length resolves; above, they
// are centres of ERB bands.
std::array<double, kHrtfBands> nodes_hz() {
  std::array<double, kHrtfBands> nodes = {40,  75,  125, 250, 360, 460,
                                          560, 660, 760, 860, 980, 1200};
  for (std::size_t j = 0; j < kHrtfHighBands; ++j)
    nodes[kHrtfLowBands + j] = erb_frequency_hz(kFirstHigh_erb + static_cast<double>(j));
  return nodes;
}

// The modified Bessel function of order 0, by its power series.
double bessel_i0(double x) {
  double sum = 1, term = 1;
  for (int k = 1; k < 40; ++k) sum += term *= x * x / (4.0 * k * k);
  return sum;
}
// Low, for narrow main lobes: triangular bands have no edges to protect.
constexpr double kKaiserBeta = 4;

// The triangular band at a node, over ERB numbers. The first and the last extend to the ends.
double hat(std::span<const double> nodes, std::size_t node, double at) {
  const double peak = nodes[node];
  if (at < peak) return node == 0 ? 1 : std::max(0.0, 1 - (peak - at) / (peak - nodes[node - 1]));
  return node + 1 == nodes.size() ? 1 : std::max(0.0, 1 - (at - peak) / (nodes[node + 1] - peak));
}

// Filters of a layer, one for each node, [filter][tap]: the inverse transform of the bands at the
// nodes times factor(filter, frequency), under a Kaiser window. They are symmetric, sums of
// cosines, or antisymmetric, sums of sines, and then a quarter of a period ahead. At most two bands
// are heard at a frequency, and few taps are needed, so that the sums take less than fast
// transforms.
template <class Factor>
std::vector<float> windowed(const HrtfLayer& layer, std::span<const double> nodes_hz,
                            bool is_symmetric, const Factor& factor) {
  constexpr std::size_t kSize = 8192;
  const auto reach = static_cast<std::size_t>(layer.reach);
  std::vector<double> nodes, cosine, wave(reach + 1), sums(nodes_hz.size() * (reach + 1));
  for (const double node_hz : nodes_hz) nodes.push_back(erb_number(node_hz));
  for (std::size_t k = 0; k < kSize; ++k)
    cosine.push_back(std::cos(2 * std::numbers::pi * static_cast<double>(k) / kSize));
  cosine[kSize / 4] = cosine[3 * kSize / 4] = 0;
  for (std::size_t k = 0; k <= kSize / 2; ++k) {
    const double frequency_hz = static_cast<double>(k) * layer.rate_hz / kSize;
    const double place = erb_number(frequency_hz), share = k % (kSize / 2) == 0 ? 1 : 2;
    for (std::size_t tap = 0, at = is_symmetric ? 0 : 3 * kSize / 4; tap <= reach; ++tap) {
      wave[tap] = cosine[at];
      at = (at + k) % kSize;
    }
    for (std::size_t filter = 0; filter < nodes.size(); ++filter) {
      const double response =
          share / kSize * factor(filter, frequency_hz) * hat(nodes, filter, place);
      if (response == 0) continue;
      double* const sum = &sums[filter * (reach + 1)];
      for (std::size_t tap = 0; tap <= reach; ++tap) sum[tap] += response * wave[tap];
    }
  }
  std::vector<double> window;
  for (std::size_t tap = 0; tap <= reach; ++tap) {
    const double r = static_cast<double>(tap) / static_cast<double>(reach + 1);
    window.push_back(bessel_i0(kKaiserBeta * std::sqrt(1 - r * r)) / bessel_i0(kKaiserBeta));
  }
  std::vector<float> filters;
  for (std::size_t filter = 0; filter < nodes.size(); ++filter)
    for (int tap = -layer.reach; tap <= layer.reach; ++tap) {
      const auto from = static_cast<std::size_t>(std::abs(tap));
      const double sum = window[from] * sums[filter * (reach + 1) + from];
      filters.push_back(static_cast<float>(tap < 0 && !is_symmetric ? -sum : sum));
    }
  return filters;
}

std::vector<float> filters_of(const HrtfLayer& layer) {
  return windowed(layer, std::span(kHrtfNodes_hz).subspan(layer.first, layer.bands), true,
                  [](std::size_t, double) { return 1.0; });
}

// The last tap multiplies the newest sample.
std::vector<float> quadrature_filters() {
  return windowed(kHrtfLowLayer, kQuadratureNodes_hz, false,
                  [](std::size_t k, double frequency_hz) {
                    return std::min(1.0, frequency_hz / kQuadratureNodes_hz[k]);
                  });
}

// Frequency response of a symmetric filter, which has zero phase: a sum of cosines, by Clenshaw's
// recurrence.
double response(const std::vector<float>& filters, const HrtfLayer& layer, std::size_t band,
                double frequency_hz) {
  const float* middle =
      filters.data() + band * static_cast<std::size_t>(2 * layer.reach + 1) + layer.reach;
  const double cosine = std::cos(2 * std::numbers::pi * frequency_hz / layer.rate_hz);
  double next = 0, after = 0;
  for (int k = layer.reach; k > 0; --k) {
    const double sum = static_cast<double>(middle[k]) + 2 * cosine * next - after;
    after = next;
    next = sum;
  }
  return static_cast<double>(middle[0]) + 2 * (cosine * next - after);
}

// Magnitude response of an antisymmetric filter: a sum of sines.
double quadrature_response(const std::vector<float>& filters, std::size_t filter,
                           double frequency_hz) {
  const auto reach = static_cast<std::size_t>(kHrtfLowLayer.reach);
  const float* middle = filters.data() + filter * (2 * reach + 1) + reach;
  const double angle = 2 * std::numbers::pi * frequency_hz / kHrtfLowLayer.rate_hz;
  double sum = 0;
  for (int k = 1; k <= kHrtfLowLayer.reach; ++k)
    sum += 2 * static_cast<double>(middle[k]) * std::sin(angle * k);
  return sum;
}

// Maps octave gains to gains at the nodes: linear interpolation between the octave centres, after a
// correction that makes a tone at a centre come out with exactly its octave's gain although the
// bands overlap. Works either across both layers or within each layer, as the octave buses are
// split.
class OctaveLevels {
 public:
  explicit OctaveLevels(bool parted) {
    for (std::size_t j = 0; j < kHrtfBands; ++j) {
      const bool low = j < kHrtfLowBands;
      const double first = parted && !low ? kLowBands : 0;
      const double last = parted && low ? kLowBands - 1 : kBandCount - 1;
      const double octave = std::clamp(std::log2(kHrtfNodes_hz[j] / 1000) + 4, first, last);
      const double below = std::min(std::floor(octave), last - 1);
      places_[j] = {static_cast<std::size_t>(below), static_cast<float>(octave - below)};
    }
    // Gauss-Jordan elimination without pivoting; the diagonal dominates.
    HrtfFilters::OctaveMatrix m{};
    for (std::size_t c = 0; c < kBandCount; ++c) {
      correction_[c][c] = 1;
      for (std::size_t j = 0; j < kHrtfBands; ++j) {
        const double heard = HrtfFilters::magnitude(j, kBandCentres_hz[c]);
        for (std::size_t b = 0; b < kBandCount; ++b)
          m[c][b] += heard * static_cast<double>(share(b, j));
      }
    }
    for (std::size_t i = 0; i < kBandCount; ++i) {
      const double pivot = m[i][i];
      for (std::size_t k = 0; k < kBandCount; ++k) m[i][k] /= pivot, correction_[i][k] /= pivot;
      for (std::size_t row = 0; row < kBandCount; ++row) {
        if (row == i) continue;
        const double times = m[row][i];
        for (std::size_t k = 0; k < kBandCount; ++k) {
          m[row][k] -= times * m[i][k];
          correction_[row][k] -= times * correction_[i][k];
        }
      }
    }
    for (std::size_t b = 0; b < kBandCount; ++b)
      for (std::size_t c = 0; c < kBandCount; ++c)
        columns_[c][b] = static_cast<float>(correction_[b][c]);
  }

  HrtfGains at_nodes(const Bands& gains) const noexcept REALTIME {
    Bands right{};
    for (std::size_t c = 0; c < kBandCount; ++c)
      for (std::size_t b = 0; b < kBandCount; ++b) right[b] += columns_[c][b] * gains[c];
    HrtfGains levels;
    for (std::size_t j = 0; j < kHrtfBands; ++j) {
      const auto [below, above] = places_[j];
      levels[j] = right[below] + above * (right[below + 1] - right[below]);
    }
    return levels;
  }

  float share(std::size_t octave, std::size_t node) const noexcept REALTIME {
    const auto [below, above] = places_[node];
    return octave == below ? 1 - above : octave == below + 1 ? above : 0;
  }

  const HrtfFilters::OctaveMatrix& correction() const { return correction_; }

 private:
  struct Place {
    std::size_t below = 0;
    float above = 0;  // weight of the upper octave
  };
  std::array<Place, kHrtfBands> places_;
  HrtfFilters::OctaveMatrix correction_{};
  std::array<Bands, kBandCount> columns_;  // of the matrix
};

// Position of a quadrature node between the band nodes of the low layer.
struct NodePlace {
  std::size_t below = 0;
  float share = 0;  // weight of the upper node
};
const std::array<NodePlace, kHrtfQuadratures>& quadrature_places() noexcept REALTIME {
  static const auto kPlaces = [] {
    std::array<NodePlace, kHrtfQuadratures> places;
    for (std::size_t k = 0; k < kHrtfQuadratures; ++k) {
      std::size_t above = 1;
      while (above + 1 < kHrtfLowBands && kHrtfNodes_hz[above] < kQuadratureNodes_hz[k]) ++above;
      const double from = kHrtfNodes_hz[above - 1], to = kHrtfNodes_hz[above];
      places[k] = {above - 1, static_cast<float>(std::clamp(
                                  (kQuadratureNodes_hz[k] - from) / (to - from), 0.0, 1.0))};
    }
    return places;
  }();
  return kPlaces;
}

const OctaveLevels& across_layers() noexcept REALTIME {
  static const OctaveLevels kLevels(false);
  return kLevels;
}
const OctaveLevels& within_layers() noexcept REALTIME {
  static const OctaveLevels kLevels(true);
  return kLevels;
}

}  // namespace

const std::array<double, kHrtfBands> kHrtfNodes_hz = nodes_hz();
const std::array<double, kHrtfQuadratures> kQuadratureNodes_hz = {
    75, 125, 185, 235, 295, 370, 460, 560, 660, 760, 870, 990, 1120, 1275};

const std::vector<float>& HrtfFilters::high() {
  static const std::vector<float> kFilters = filters_of(kHrtfHighLayer);
  return kFilters;
}
const std::vector<float>& HrtfFilters::low() {
  static const std::vector<float> kFilters = [] {
    std::vector<float> filters = filters_of(kHrtfLowLayer);
    const std::vector<float> quadratures = quadrature_filters();
    filters.insert(filters.end(), quadratures.begin(), quadratures.end());
    return filters;
  }();
  return kFilters;
}

void HrtfFilters::prepare() {
  high();
  low();
  across_layers();
  within_layers();
  quadrature_places();
}

double HrtfFilters::magnitude(std::size_t band, double frequency_hz) {
  const bool is_low = band < kHrtfLowBands;
  const double parting = crossover_magnitude(kLowBands - 1, kSampleRate_hz,
                                             is_low ? Side::kLow : Side::kHigh, frequency_hz);
  if (is_low && frequency_hz >= kHrtfLowLayer.rate_hz / 2) return 0;
  return parting * (is_low ? response(low(), kHrtfLowLayer, band, frequency_hz)
                           : response(high(), kHrtfHighLayer, band - kHrtfLowBands, frequency_hz));
}

double HrtfFilters::quadrature_magnitude(std::size_t quadrature, double frequency_hz) {
  if (frequency_hz >= kHrtfLowLayer.rate_hz / 2) return 0;
  return crossover_magnitude(kLowBands - 1, kSampleRate_hz, Side::kLow, frequency_hz) *
         quadrature_response(low(), kHrtfLowBands + quadrature, frequency_hz);
}

QuadratureGains HrtfFilters::at_quadratures(const HrtfGains& levels) noexcept REALTIME {
  QuadratureGains at;
  for (std::size_t k = 0; k < kHrtfQuadratures; ++k) {
    const auto [below, share] = quadrature_places()[k];
    at[k] = levels[below] + share * (levels[below + 1] - levels[below]);
  }
  return at;
}

HrtfGains HrtfFilters::levels_of(const Bands& gains) noexcept REALTIME {
  return across_layers().at_nodes(gains);
}

const HrtfFilters::OctaveMatrix& HrtfFilters::bus_gains() { return within_layers().correction(); }

float HrtfFilters::octave_share(std::size_t octave, std::size_t band) noexcept REALTIME {
  return within_layers().share(octave, band);
}

}  // namespace clamor
