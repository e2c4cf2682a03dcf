#include "tools/analysis/sound_comparison.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "common/sample_rate.h"
#include "tools/analysis/time_varying_part.h"

namespace clamor {

namespace {

constexpr double kSpectrumFloor_db = 60, kMomentaryFloor_db = 40, kDecayDepth_db = -35;
constexpr double kItdPhase_rad = 0.05, kMinItd_us = 10;
constexpr std::size_t kFirstIsoBand = 1, kLastIsoBand = 6;  // 125 Hz to 4 kHz
constexpr std::size_t kLastItdBand = 4;                     // 1 kHz

std::optional<double> minus(const std::optional<double>& b, const std::optional<double>& a) {
  if (!a || !b) return std::nullopt;
  return *b - *a;
}

// Collects the differences of compare(), measure by measure.
class Comparison {
 public:
  Comparison(const SoundAnalysis& a, const SoundAnalysis& b) : a_(a), b_(b) {
    for (const MeasureInfo& info : kMeasures) differences_.push_back({&info, {}});
  }

  std::vector<Difference> take() {
    const bool mono = a_.ears.size() == 1;
    std::erase_if(differences_, [&](const Difference& difference) {
      const MeasureInfo& info = *difference.info;
      const bool binaural = info.measure >= Measure::kIld && info.measure <= Measure::kEarlyIacc;
      return (info.only_in && info.only_in != a_.kind) || (mono && binaural) ||
             info.measure == Measure::kTimeVaryingPart;
    });
    return std::move(differences_);
  }

  void loudness() {
    const double a = a_.loudness.integrated_lufs, b = b_.loudness.integrated_lufs;
    if (std::max(a, b) > kSilence_lufs)
      add(Measure::kIntegratedLoudness, {.a = a, .b = b, .difference = b - a});

    const auto &as = a_.loudness.momentary_lufs, &bs = b_.loudness.momentary_lufs;
    const double silence = -std::numeric_limits<double>::infinity();
    double loudest = silence;
    for (const double lufs : as) loudest = std::max(loudest, lufs);
    for (const double lufs : bs) loudest = std::max(loudest, lufs);
    if (loudest == silence) return;
    for (std::size_t i = 0; i < std::max(as.size(), bs.size()); ++i) {
      const double floor = loudest - kMomentaryFloor_db;
      const double at_a = std::max(floor, i < as.size() ? as[i] : silence);
      const double at_b = std::max(floor, i < bs.size() ? bs[i] : silence);
      add(Measure::kMomentaryLoudness,
          {.at = static_cast<double>(i) * kMomentaryHop_s + kMomentaryWindow_s / 2,
           .a = at_a,
           .b = at_b,
           .difference = at_b - at_a});
    }
  }

  void spectrum() {
    const auto loudest = [](const ErbBands& bands) {
      return *std::max_element(bands.begin(), bands.end());
    };
    const double top = std::max(loudest(a_.spectrum), loudest(b_.spectrum));
    if (!(top > 0)) return;
    const double floor = top * std::pow(10, -kSpectrumFloor_db / 10);
    for (std::size_t b = 0; b < kErbBandCount; ++b) {
      const double at_a = 10 * std::log10(std::max(floor, a_.spectrum[b]));
      const double at_b = 10 * std::log10(std::max(floor, b_.spectrum[b]));
      add(Measure::kSpectrum,
          {.at = erb_band_centre_hz(b), .a = at_a, .b = at_b, .difference = at_b - at_a});
    }
  }

  void binaural() {
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const auto cue = [&](Measure measure, const BinauralCues::Value& of_a,
                           const BinauralCues::Value& of_b, double scale, double jnd, bool judged) {
        DifferencePoint point{.at = kBandCentres_hz[b], .jnd = jnd, .judged = judged};
        if (of_a[b]) point.a = *of_a[b] * scale;
        if (of_b[b]) point.b = *of_b[b] * scale;
        point.difference = minus(point.b, point.a);
        add(measure, point);
      };
      const double phase_us = kItdPhase_rad / (2 * std::numbers::pi * kBandCentres_hz[b]) * 1e6;
      cue(Measure::kIld, a_.binaural.ild_db, b_.binaural.ild_db, 1, 0, true);
      cue(Measure::kItd, a_.binaural.itd_s, b_.binaural.itd_s, 1e6, std::max(kMinItd_us, phase_us),
          b <= kLastItdBand);
      cue(Measure::kIacc, a_.binaural.iacc, b_.binaural.iacc, 1, 0, iso(b));
      cue(Measure::kEarlyIacc, a_.early_binaural.iacc, b_.early_binaural.iacc, 1, 0, iso(b));
    }
  }

  void room() {
    constexpr struct {
      Measure measure;
      RoomParameters::Value RoomParameters::*value;
      bool percent;
      double scale;
    } kParameters[] = {
        {Measure::kEdt, &RoomParameters::edt_s, true, 1},
        {Measure::kT20, &RoomParameters::t20_s, true, 1},
        {Measure::kT30, &RoomParameters::t30_s, true, 1},
        {Measure::kC80, &RoomParameters::c80_db, false, 1},
        {Measure::kD50, &RoomParameters::d50, false, 1},
        {Measure::kTs, &RoomParameters::ts_s, false, 1e3},
        {Measure::kG, &RoomParameters::g_db, false, 1},
    };
    each_ear_and_band([&](int ear, std::size_t b) {
      for (const auto& [measure, value, percent, scale] : kParameters) {
        DifferencePoint point = place(ear, b);
        point.judged = iso(b);
        if (const auto& of_a = (a_.ears[ear].room.*value)[b]) point.a = *of_a * scale;
        if (const auto& of_b = (b_.ears[ear].room.*value)[b]) point.b = *of_b * scale;
        point.difference = minus(point.b, point.a);
        if (percent && point.difference) *point.difference *= 100 / *point.a;
        add(measure, point);
      }
    });
  }

  void decay() {
    each_ear_and_band([&](int ear, std::size_t b) {
      const auto &a = a_.ears[ear].decay_db[b], &other = b_.ears[ear].decay_db[b];
      const std::size_t steps = std::min(a.size(), other.size());
      DifferencePoint curve = place(ear, b), echo = place(ear, b);
      curve.judged = iso(b);
      std::size_t end = 0;
      for (; end < steps && a[end] > kDecayDepth_db; ++end) {
        const double difference = std::max(other[end], 2 * kDecayDepth_db) - a[end];
        if (curve.difference && std::abs(difference) <= std::abs(*curve.difference)) continue;
        curve.a = a[end];
        curve.b = a[end] + difference;
        curve.difference = difference;
      }
      add(Measure::kDecayCurve, curve);
      if (a_.ears[ear].echo_density[b].empty()) return;
      const auto mean = [&](const std::vector<double>& density) -> std::optional<double> {
        if (end == 0 || density.size() < end) return std::nullopt;
        double sum = 0;
        for (std::size_t i = 0; i < end; ++i) sum += density[i];
        return sum / static_cast<double>(end);
      };
      echo.a = mean(a_.ears[ear].echo_density[b]);
      echo.b = mean(b_.ears[ear].echo_density[b]);
      echo.difference = minus(echo.b, echo.a);
      add(Measure::kEchoDensity, echo);
    });
  }

  void clicks() {
    for (std::size_t ear = 0; ear < a_.ears.size(); ++ear) {
      const auto &of_a = a_.ears[ear].clicks, &of_b = b_.ears[ear].clicks;
      const std::vector<Click> unknown = new_clicks(of_b, of_a);
      DifferencePoint point{.a = static_cast<double>(of_a.size()),
                            .b = static_cast<double>(of_b.size()),
                            .difference = static_cast<double>(unknown.size())};
      if (a_.ears.size() > 1) point.channel = static_cast<int>(ear);
      const auto loudest = std::max_element(
          unknown.begin(), unknown.end(),
          [](const Click& one, const Click& other) { return one.sigmas < other.sigmas; });
      if (loudest != unknown.end()) point.at = static_cast<double>(loudest->frame) / kSampleRate_hz;
      add(Measure::kClicks, point);
    }
  }

  void texture() {
    constexpr struct {
      Measure measure;
      std::vector<double> TextureStatistics::*values;
    } kStatistics[] = {
        {Measure::kEnvelopeVariation, &TextureStatistics::variation},
        {Measure::kEnvelopeSkewness, &TextureStatistics::skewness},
        {Measure::kEnvelopeKurtosis, &TextureStatistics::kurtosis},
        {Measure::kModulation, &TextureStatistics::modulation_db},
        {Measure::kBandCorrelation, &TextureStatistics::correlation},
    };
    for (std::size_t ear = 0; ear < a_.ears.size(); ++ear)
      for (const auto& [measure, values] : kStatistics) {
        const auto &of_a = a_.ears[ear].texture.*values, &of_b = b_.ears[ear].texture.*values;
        if (of_a.empty() || of_b.empty()) continue;
        const auto count = static_cast<double>(of_a.size());
        double mean_a = 0, mean_b = 0, square = 0;
        for (std::size_t i = 0; i < of_a.size(); ++i) {
          mean_a += of_a[i] / count;
          mean_b += of_b[i] / count;
          square += (of_b[i] - of_a[i]) * (of_b[i] - of_a[i]) / count;
        }
        DifferencePoint point{.a = mean_a, .b = mean_b, .difference = std::sqrt(square)};
        if (a_.ears.size() > 1) point.channel = static_cast<int>(ear);
        add(measure, point);
      }
  }

  void waveform() {
    double aa = 0, bb = 0, ab = 0;
    each_sample([&](double a, double b) {
      aa += a * a;
      bb += b * b;
      ab += a * b;
    });
    if (!(aa > 0)) return;
    const auto relative_l2 = [&](double gain) {
      double sum = 0;
      each_sample([&](double a, double b) { sum += (gain * b - a) * (gain * b - a); });
      return std::sqrt(sum / aa);
    };
    add(Measure::kL2, {.difference = relative_l2(1)});
    if (!(bb > 0)) return;
    add(Measure::kRenormalisedL2, {.difference = relative_l2(std::sqrt(aa / bb))});
    add(Measure::kCorrelation, {.difference = std::clamp(ab / std::sqrt(aa * bb), -1.0, 1.0)});
  }

 private:
  // A point has the JND of its measure unless it brings its own.
  void add(Measure measure, DifferencePoint point) {
    Difference& difference = differences_[static_cast<std::size_t>(measure)];
    if (point.jnd == 0) point.jnd = difference.info->jnd.value_or(0);
    difference.points.push_back(point);
  }

  DifferencePoint place(int ear, std::size_t band) const {
    DifferencePoint point{.at = kBandCentres_hz[band]};
    if (a_.ears.size() > 1) point.channel = ear;
    return point;
  }

  template <class Function>
  void each_ear_and_band(const Function& function) const {
    for (std::size_t ear = 0; ear < a_.ears.size(); ++ear)
      for (std::size_t b = 0; b < kBandCount; ++b) function(static_cast<int>(ear), b);
  }

  template <class Function>
  void each_sample(const Function& function) const {
    for (std::size_t c = 0; c < a_.sound.channels.size(); ++c) {
      const auto &a = a_.sound.channels[c], &b = b_.sound.channels[c];
      for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i)
        function(i < a.size() ? static_cast<double>(a[i]) : 0.0,
                 i < b.size() ? static_cast<double>(b[i]) : 0.0);
    }
  }

  static bool iso(std::size_t band) { return band >= kFirstIsoBand && band <= kLastIsoBand; }

  const SoundAnalysis &a_, &b_;
  std::vector<Difference> differences_;
};

}  // namespace

const DifferencePoint* Difference::worst() const {
  const DifferencePoint* worst = nullptr;
  double most = -1;
  for (const DifferencePoint& point : points) {
    if (!point.judged || !point.difference) continue;
    const double size = std::abs(*point.difference) / (point.jnd > 0 ? point.jnd : 1);
    if (size > most) {
      most = size;
      worst = &point;
    }
  }
  return worst;
}

double Difference::size() const {
  const DifferencePoint* const point = worst();
  if (point == nullptr) return 0;
  return std::abs(*point->difference) / (point->jnd > 0 ? point->jnd : 1);
}

bool Difference::audible(double null_size) const {
  if (!info->jnd) return false;
  return size() > std::max(*info->jnd > 0 ? 1.0 : 0.0, null_size);
}

bool Difference::beyond_chance(double null_size) const {
  return info->by_chance && size() > null_size;
}

std::vector<Difference> compare(const SoundAnalysis& a, const SoundAnalysis& b) {
  assert(a.kind == b.kind && a.ears.size() == b.ears.size());
  Comparison comparison(a, b);
  comparison.spectrum();
  if (a.ears.size() == 2) comparison.binaural();
  if (a.kind == SoundKind::kProgramme) {
    comparison.loudness();
    comparison.clicks();
    comparison.texture();
  } else {
    comparison.room();
    comparison.decay();
  }
  comparison.waveform();
  return comparison.take();
}

Difference compare_time_varying_parts(std::span<const float> dry, const Sound& a, const Sound& b) {
  assert(a.channels.size() == b.channels.size());
  Difference difference{&kMeasures[static_cast<std::size_t>(Measure::kTimeVaryingPart)], {}};
  const auto of_a = time_varying_part_db(dry, a), of_b = time_varying_part_db(dry, b);
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    DifferencePoint point{.a = of_a[c], .b = of_b[c], .difference = minus(of_b[c], of_a[c])};
    if (a.channels.size() > 1) point.channel = static_cast<int>(c);
    difference.points.push_back(point);
  }
  return difference;
}

}  // namespace clamor
