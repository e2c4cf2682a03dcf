#include "runtime/hrtf/hrtf_filter_bank.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/crossover.h"
#include "common/fourier.h"
#include "common/sample_rate.h"
#include "formats/level/level.h"
#include "runtime/hrtf/erb_bands.h"
#include "runtime/voices/mix_fir.h"

namespace clamor {

namespace {

constexpr double kFirstHigh_erb = 17.5;  // 1.27 kHz

// 40 to 1200 Hz by hand, no closer than the filters' length can tell apart; then the middles of ERB
// bands.
std::array<double, kHrtfBands> nodes_hz() {
  std::array<double, kHrtfBands> nodes = {40,  75,  125, 250, 360, 460,
                                          560, 660, 760, 860, 980, 1200};
  for (std::size_t j = 0; j < kHrtfHighBands; ++j)
    nodes[kHrtfLowBands + j] = erb_frequency_hz(kFirstHigh_erb + static_cast<double>(j));
  return nodes;
}

// The modified Bessel function of order 0, by its series.
double bessel_i0(double x) {
  double sum = 1, term = 1;
  for (int k = 1; k < 40; ++k) sum += term *= x * x / (4.0 * k * k);
  return sum;
}
constexpr double kKaiserBeta = 4;  // narrow rather than clean: hats have no edges

struct Layer {
  std::size_t first, bands;
  int reach;
  double rate_hz;
};
constexpr Layer kLowLayer{0, kHrtfLowBands, 186, 1.0 * kSampleRate_hz / kLowRate};
constexpr Layer kHighLayer{kHrtfLowBands, kHrtfHighBands, 192, kSampleRate_hz};

// The hat at a node among others, in Hz; the first and the last go on.
double hat(std::span<const double> nodes_hz, std::size_t node, double frequency_hz) {
  const auto number = [&](std::size_t j) { return erb_number(nodes_hz[j]); };
  const double at = erb_number(frequency_hz), peak = number(node);
  if (at < peak) return node == 0 ? 1 : std::max(0.0, 1 - (peak - at) / (peak - number(node - 1)));
  return node + 1 == nodes_hz.size() ? 1
                                     : std::max(0.0, 1 - (at - peak) / (number(node + 1) - peak));
}

// Taps of filters of a layer, [filter][tap]: the inverse transform of response(filter, frequency)
// under a Kaiser window. At negative frequencies the response is the conjugate.
template <class Response>
std::vector<float> windowed(const Layer& layer, std::size_t count, const Response& response) {
  constexpr std::size_t kSize = 8192;
  const Fourier fourier(kSize);
  std::vector<float> filters;
  for (std::size_t filter = 0; filter < count; ++filter) {
    std::vector<std::complex<double>> spectrum(kSize);
    for (std::size_t k = 0; k < kSize; ++k) {
      const std::complex<double> at =
          response(filter, static_cast<double>(std::min(k, kSize - k)) * layer.rate_hz / kSize);
      spectrum[k] = 2 * k > kSize ? std::conj(at) : at;
    }
    fourier.inverse(spectrum);
    for (int k = -layer.reach; k <= layer.reach; ++k) {
      const double r = static_cast<double>(k) / (layer.reach + 1);
      const double window = bessel_i0(kKaiserBeta * std::sqrt(1 - r * r)) / bessel_i0(kKaiserBeta);
      filters.push_back(static_cast<float>(
          window * spectrum[static_cast<std::size_t>(k + static_cast<int>(kSize)) % kSize].real()));
    }
  }
  return filters;
}

// Symmetric.
std::vector<float> filters_of(const Layer& layer) {
  return windowed(layer, layer.bands, [&](std::size_t band, double frequency_hz) {
    return std::complex<double>(
        hat(std::span(kHrtfNodes_hz).subspan(layer.first, layer.bands), band, frequency_hz));
  });
}

// Antisymmetric: a quarter of a period ahead, where the last tap meets the newest sample.
std::vector<float> quadrature_filters() {
  return windowed(kLowLayer, kHrtfQuadratures, [](std::size_t k, double frequency_hz) {
    const double node_hz = kQuadratureNodes_hz[k];
    return std::complex<double>(
        0, -std::min(1.0, frequency_hz / node_hz) * hat(kQuadratureNodes_hz, k, frequency_hz));
  });
}

// The response of a symmetric filter, which has no phase: a sum of cosines, by Clenshaw.
double response(const std::vector<float>& filters, const Layer& layer, std::size_t band,
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

// What is left of an antisymmetric one without the quarter of a period: a sum of sines.
double quadrature_response(const std::vector<float>& filters, std::size_t filter,
                           double frequency_hz) {
  const auto reach = static_cast<std::size_t>(kLowLayer.reach);
  const float* middle = filters.data() + filter * (2 * reach + 1) + reach;
  const double angle = 2 * std::numbers::pi * frequency_hz / kLowLayer.rate_hz;
  double sum = 0;
  for (int k = 1; k <= kLowLayer.reach; ++k)
    sum += 2 * static_cast<double>(middle[k]) * std::sin(angle * k);
  return sum;
}

// Octaves as levels at the nodes: linear between the centres, of gains that are corrected first, so
// that a tone at a centre comes out with its octave's gain although the hats are wide. Either
// across both layers, or with the layers' octaves parted as voices' buses of octaves are.
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
    // Gauss and Jordan; the diagonal dominates.
    HrtfFilterBank::OctaveMatrix m{};
    for (std::size_t c = 0; c < kBandCount; ++c) {
      correction_[c][c] = 1;
      for (std::size_t j = 0; j < kHrtfBands; ++j) {
        const double heard = HrtfFilterBank::magnitude(j, kBandCentres_hz[c]);
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

  const HrtfFilterBank::OctaveMatrix& correction() const { return correction_; }

 private:
  struct Place {
    std::size_t below = 0;
    float above = 0;  // share of the octave above
  };
  std::array<Place, kHrtfBands> places_;
  HrtfFilterBank::OctaveMatrix correction_{};
  std::array<Bands, kBandCount> columns_;  // of it
};

// QuadratureGains' nodes between those of bands of the low layer.
struct NodePlace {
  std::size_t below = 0;
  float share = 0;  // of the node above
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

const std::vector<float>& HrtfFilterBank::high_filters() {
  static const std::vector<float> kFilters = filters_of(kHighLayer);
  return kFilters;
}
const std::vector<float>& HrtfFilterBank::low_filters() {
  static const std::vector<float> kFilters = [] {
    std::vector<float> filters = filters_of(kLowLayer);
    const std::vector<float> quadratures = quadrature_filters();
    filters.insert(filters.end(), quadratures.begin(), quadratures.end());
    return filters;
  }();
  return kFilters;
}

const std::vector<float>& HrtfFilterBank::high_spectra() {
  static const std::vector<float> kSpectra = spectra_of(high_filters(), kHighTaps);
  return kSpectra;
}

HrtfFilterBank::HrtfFilterBank()
    : high_(kEars * kHrtfHighBands * kHighWindow), low_(kEars * kHrtfLowRows * kLowRow) {
  static_assert(kHighLayer.reach == kHighReach && kLowLayer.reach == kLowReach);
  // What the audio thread shall find made.
  high_spectra();
  low_filters();
  across_layers();
  within_layers();
  quadrature_places();
  for (int k = 0; k < kUpTaps; ++k)
    up_[static_cast<std::size_t>(k)] = static_cast<float>(OctaveFilterBank::up_tap(k));
}

void HrtfFilterBank::clear() noexcept REALTIME {
  std::fill(std::begin(buses_.high), std::end(buses_.high), 0.0f);
  std::fill(std::begin(buses_.low), std::end(buses_.low), 0.0f);
  std::fill(std::begin(octaves_.high), std::end(octaves_.high), 0.0f);
  std::fill(std::begin(octaves_.low), std::end(octaves_.low), 0.0f);
}

namespace {

struct BandRows {
  const Layer& layer;
  const float* buses;
  const float* octaves;
  std::size_t first_octave, end_octave;
  int stride, frames;
};

// The frames of a band's bus and, each times its level, its shares of octaves' buses.
template <class Level>
void sum_band(const BandRows& rows, std::size_t band, int ear, const Level& level,
              float* out) noexcept REALTIME {
  const auto row = [&](std::size_t k) { return (kEars * static_cast<int>(k) + ear) * rows.stride; };
  std::copy_n(rows.buses + row(band), rows.frames, out);
  for (std::size_t octave = rows.first_octave; octave < rows.end_octave; ++octave) {
    const float share = HrtfFilterBank::octave_share(octave, rows.layer.first + band);
    if (share == 0) continue;
    const float* const add = rows.octaves + row(octave - rows.first_octave);
    for (int f = 0; f < rows.frames; ++f) out[f] += share * level(f) * add[f];
  }
}

}  // namespace

void HrtfFilterBank::slide_octaves(const std::array<HrtfGains, kEars>& levels,
                                   int frames) noexcept REALTIME {
  for (std::size_t e = 0; e < kEars; ++e)
    for (std::size_t j = 0; j < kHrtfBands; ++j) {
      const float from = frames == 0 ? levels[e][j] : slid(static_cast<int>(e), j, 0);
      slides_[e][j] = {from, frames == 0 ? 0 : (levels[e][j] - from) / static_cast<float>(frames)};
    }
  slide_frame_ = 0;
  slide_frames_ = frames;
}

// In the frame that is so many from now. Calls never go beyond a slide's end.
float HrtfFilterBank::slid(int ear, std::size_t band, int frame) const noexcept REALTIME {
  const Slide& slide = slides_[static_cast<std::size_t>(ear)][band];
  const int at = std::min(slide_frame_ + frame, slide_frames_);
  return slide.level + slide.per_frame * static_cast<float>(at);
}

// The call's frames from `first_frame` on, behind those of the block.
void HrtfFilterBank::take_high(int first_frame, int frames) noexcept REALTIME {
  float row[kMaxFrames];
  const BandRows rows{kHighLayer,
                      buses_.high + first_frame,
                      octaves_.high + first_frame,
                      kLowBands,
                      kBandCount,
                      kMaxFrames,
                      frames};
  for (std::size_t b = 0; b < kHrtfHighBands; ++b)
    for (int ear = 0; ear < kEars; ++ear) {
      const auto level = [&](int f) { return slid(ear, kHrtfLowBands + b, first_frame + f); };
      sum_band(rows, b, ear, level, row);
      const std::size_t group = b / kSpectrumLanes;
      const std::size_t first = (group * kEars + static_cast<std::size_t>(ear)) * kHighWindow +
                                static_cast<std::size_t>(kHighHistory + high_frames_);
      float* const out = high_.data() + first * kSpectrumLanes + b % kSpectrumLanes;
      for (int f = 0; f < frames; ++f) out[f * kSpectrumLanes] = row[f];
    }
  high_frames_ += frames;
}

void HrtfFilterBank::filter_high_block() noexcept REALTIME {
  filter_pairs({high_spectra().data(), kHighGroups, high_.data(), kHighWindow, &work_, &sum_});
  for (int ear = 0; ear < kEars; ++ear) {
    const float* lanes = (ear == 0 ? sum_.left : sum_.right) + kHighReach * kSpectrumLanes;
    for (int f = 0; f < kBlockFrames; ++f, lanes += kSpectrumLanes) {
      float sum = 0;
      for (int lane = 0; lane < kSpectrumLanes; ++lane) sum += lanes[lane];
      high_sum_[ear][high_due_ + f] = sum;
    }
  }
  high_due_ += kBlockFrames;
  high_frames_ = 0;
  for (int part = 0; part < kHighGroups * kEars; ++part) {
    float* const window = high_.data() + std::size_t{kHighWindow} * kSpectrumLanes * part;
    std::copy_n(window + kBlockFrames * kSpectrumLanes, kHighHistory * kSpectrumLanes, window);
  }
}

void HrtfFilterBank::process(int frames, float* interleaved) noexcept REALTIME {
  assert(frames % kStepFrames == 0 && frames <= kMaxFrames);
  const int low_frames = frames / kLowRate;
  for (int first = 0; first < frames;) {
    const int count = std::min(frames - first, kBlockFrames - high_frames_);
    take_high(first, count);
    first += count;
    if (high_frames_ == kBlockFrames) filter_high_block();
  }
  const BandRows low_rows{kLowLayer, buses_.low, octaves_.low, 0, kLowBands, kMaxFrames / kLowRate,
                          low_frames};
  for (int ear = 0; ear < kEars; ++ear) {
    float* const rows = low_.data() + ear * kHrtfLowRows * kLowRow;
    for (std::size_t b = 0; b < kHrtfLowBands; ++b) {
      const auto level = [&](int f) { return slid(ear, b, kLowRate * f); };
      sum_band(low_rows, b, ear, level, rows + b * kLowRow + kLowHistory);
    }
    for (std::size_t row = kHrtfLowBands; row < kHrtfLowRows; ++row)
      std::copy_n(buses_.low + (kEars * row + ear) * (kMaxFrames / kLowRate), low_frames,
                  rows + row * kLowRow + kLowHistory);
    float* const low = low_sum_[ear];
    sum_filtered({low_filters().data(), rows, kLowRow, kHrtfLowRows, kLowTaps, low_frames,
                  low + kUpHistory});
    float* const high = high_sum_[ear];
    for (int f = 0; f < frames; ++f) {
      float sum = high[f];
      for (int k = f % kLowRate, at = kUpHistory + f / kLowRate; k < kUpTaps; k += kLowRate, --at)
        sum += up_[static_cast<std::size_t>(k)] * low[at];
      interleaved[f * kEars + ear] = sum;
    }
    std::copy(high + frames, high + high_due_, high);
    std::copy_n(low + low_frames, kUpHistory, low);
    for (std::size_t b = 0; b < kHrtfLowRows; ++b)
      std::copy_n(rows + b * kLowRow + low_frames, kLowHistory, rows + b * kLowRow);
  }
  high_due_ -= frames;
  slide_frame_ = std::min(slide_frame_ + frames, slide_frames_);
}

double HrtfFilterBank::magnitude(std::size_t band, double frequency_hz) {
  const bool low = band < kHrtfLowBands;
  const double parting = crossover_magnitude(kLowBands - 1, kSampleRate_hz,
                                             low ? Side::kLow : Side::kHigh, frequency_hz);
  if (low && frequency_hz >= kLowLayer.rate_hz / 2) return 0;
  return parting * (low ? response(low_filters(), kLowLayer, band, frequency_hz)
                        : response(high_filters(), kHighLayer, band - kHrtfLowBands, frequency_hz));
}

double HrtfFilterBank::quadrature_magnitude(std::size_t quadrature, double frequency_hz) {
  if (frequency_hz >= kLowLayer.rate_hz / 2) return 0;
  return crossover_magnitude(kLowBands - 1, kSampleRate_hz, Side::kLow, frequency_hz) *
         quadrature_response(low_filters(), kHrtfLowBands + quadrature, frequency_hz);
}

QuadratureGains HrtfFilterBank::at_quadratures(const HrtfGains& levels) noexcept REALTIME {
  QuadratureGains at;
  for (std::size_t k = 0; k < kHrtfQuadratures; ++k) {
    const auto [below, share] = quadrature_places()[k];
    at[k] = levels[below] + share * (levels[below + 1] - levels[below]);
  }
  return at;
}

HrtfGains HrtfFilterBank::levels_of(const Bands& gains) noexcept REALTIME {
  return across_layers().at_nodes(gains);
}

const HrtfFilterBank::OctaveMatrix& HrtfFilterBank::bus_gains() {
  return within_layers().correction();
}

float HrtfFilterBank::octave_share(std::size_t octave, std::size_t band) noexcept REALTIME {
  return within_layers().share(octave, band);
}

}  // namespace clamor
