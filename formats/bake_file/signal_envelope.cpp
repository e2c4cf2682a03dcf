#include "formats/bake_file/signal_envelope.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "common/crossover.h"
#include "common/maths.h"
#include "common/sample_rate.h"
#include "common/thread_team.h"
#include "formats/level/signal.h"

namespace clamor {

namespace {

constexpr double kStep_db = 0.5;
constexpr float kFaintest = 1e-18f;  // mean square; below are rounding errors of other bands
constexpr float kLoudest = 1e14f;    // for samples of at most a million times full scale

// Settling time of the filters: the slowest pole of the lowest edge decays by 200 dB.
constexpr std::int64_t kTailFrames = 8192;
constexpr std::int64_t kPieceFrames = 4 * kSampleRate_hz;

// All eight bands side by side, in as many registers as the instruction set needs.
typedef double Lanes __attribute__((vector_size(8 * kBandCount)));

// A band is the high side of its lower edge and the low side of its upper edge.
class BandPass {
 public:
  BandPass() {
    for (std::size_t b = 0; b < kBandCount; ++b) {
      if (b > 0) set(b, 0, crossover_factors(b - 1, kSampleRate_hz, Side::kHigh));
      if (b < kBandEdges)
        set(b, kButterworthFactors, crossover_factors(b, kSampleRate_hz, Side::kLow));
    }
  }

  // Filters forwards and backwards, in each lane.
  void run(std::vector<Lanes>& samples) {
    memory_ = {};
    for (Lanes& sample : samples) step(sample);
    memory_ = {};
    for (std::size_t i = samples.size(); i-- > 0;) step(samples[i]);
  }

 private:
  static constexpr std::size_t kSections = 2 * kButterworthFactors;

  struct Section {
    Lanes b0 = Lanes{} + 1, b1{}, b2{}, a1{}, a2{};
  };
  struct Memory {
    Lanes s1{}, s2{};
  };

  void set(std::size_t lane, std::size_t first,
           const std::array<Biquad, kButterworthFactors>& factors) {
    for (std::size_t k = 0; k < kButterworthFactors; ++k) {
      Section& section = sections_[first + k];
      section.b0[lane] = factors[k].b0;
      section.b1[lane] = factors[k].b1;
      section.b2[lane] = factors[k].b2;
      section.a1[lane] = factors[k].a1;
      section.a2[lane] = factors[k].a2;
    }
  }

  void step(Lanes& x) {
    for (std::size_t k = 0; k < kSections; ++k) {
      const Section& f = sections_[k];
      Memory& m = memory_[k];
      const Lanes y = f.b0 * x + m.s1;
      m.s1 = f.b1 * x - f.a1 * y + m.s2;
      m.s2 = f.b2 * x - f.a2 * y;
      x = y;
    }
  }

  std::array<Section, kSections> sections_;
  std::array<Memory, kSections> memory_{};
};

// Energies of the moments [first, first + sums.size()), which may extend beyond the signal.
struct Energies {
  std::int64_t first = 0;
  std::vector<Lanes> sums;
};

class Analysis {
 public:
  explicit Analysis(const Signal& signal)
      : signal_(signal),
        size_(static_cast<std::int64_t>(signal.samples.size())),
        moments_(static_cast<std::int64_t>(moments_of(signal.samples.size()))),
        moment_frames_(signal.loop ? static_cast<double>(size_) / static_cast<double>(moments_)
                                   : kMomentFrames) {}

  std::vector<Lanes> energies() const {
    const std::int64_t begin = signal_.loop ? 0 : -kTailFrames;
    const std::int64_t end = signal_.loop ? size_ : size_ + kTailFrames;
    std::vector<Energies> pieces(
        static_cast<std::size_t>((end - begin + kPieceFrames - 1) / kPieceFrames));
    const auto listen = [&](std::size_t p) {
      const std::int64_t from = begin + static_cast<std::int64_t>(p) * kPieceFrames;
      pieces[p] = energies_between(from, std::min(from + kPieceFrames, end));
    };
    if (pieces.size() == 1)
      listen(0);
    else
      team_for(0, pieces.size(), listen);
    std::vector<Lanes> sums(static_cast<std::size_t>(moments_), Lanes{});
    for (const Energies& piece : pieces)
      for (std::size_t i = 0; i < piece.sums.size(); ++i)
        sums[place_of(piece.first + static_cast<std::int64_t>(i))] += piece.sums[i];
    return sums;
  }

  double moment_frames() const { return moment_frames_; }

 private:
  // The samples [from, to), which may extend beyond the signal, in every lane; none if all are 0.
  std::vector<Lanes> samples_between(std::int64_t from, std::int64_t to) const {
    std::vector<Lanes> samples(static_cast<std::size_t>(to - from));
    bool sounds = false;
    std::int64_t at = signal_.loop ? (from % size_ + size_) % size_ : from;
    for (Lanes& sample : samples) {
      if (at >= 0 && at < size_) {
        const float value = signal_.samples[static_cast<std::size_t>(at)];
        if (std::isfinite(value)) sample += value;
        sounds = sounds || sample[0] != 0;
      }
      if (++at == size_ && signal_.loop) at = 0;
    }
    if (!sounds) samples.clear();
    return samples;
  }

  std::size_t place_of(std::int64_t moment) const {
    return static_cast<std::size_t>(signal_.loop
                                        ? (moment % moments_ + moments_) % moments_
                                        : std::clamp<std::int64_t>(moment, 0, moments_ - 1));
  }

  Energies energies_between(std::int64_t from, std::int64_t to) const {
    std::vector<Lanes> samples = samples_between(from - kTailFrames, to + kTailFrames);
    if (samples.empty()) return {};
    BandPass().run(samples);

    const auto moment_of = [&](std::int64_t at) {
      return (static_cast<double>(at) + 0.5) / moment_frames_ - 0.5;
    };
    Energies energies;
    energies.first = static_cast<std::int64_t>(std::floor(moment_of(from)));
    const auto last = static_cast<std::int64_t>(std::floor(moment_of(to - 1))) + 1;
    energies.sums.resize(static_cast<std::size_t>(last - energies.first + 1), Lanes{});
    for (std::int64_t at = from; at < to; ++at) {
      const double moment = moment_of(at), before = std::floor(moment);
      const double later = 0.5 - 0.5 * cos_of(std::numbers::pi * (moment - before));
      const auto i = static_cast<std::size_t>(static_cast<std::int64_t>(before) - energies.first);
      const Lanes& y = samples[static_cast<std::size_t>(at - from + kTailFrames)];
      energies.sums[i] += (1 - later) * y * y;
      energies.sums[i + 1] += later * y * y;
    }
    return energies;
  }

  const Signal& signal_;
  const std::int64_t size_, moments_;
  const double moment_frames_;
};

// Step 255 - k is k half decibels below the maximum.
std::uint8_t step_of(double level, double loudest) {
  if (!(level > 0)) return 0;
  const double decibels = 10 * log2_of(level / loudest) / log2_of(10.0);
  return static_cast<std::uint8_t>(std::max(0.0, std::round(255 + decibels / kStep_db)));
}

const std::array<double, 256>& levels_of_steps() {
  static const auto kLevels = [] {
    std::array<double, 256> levels{};
    for (std::size_t step = 1; step < levels.size(); ++step)
      levels[step] = power(10, (static_cast<double>(step) - 255) * kStep_db / 10);
    return levels;
  }();
  return kLevels;
}

}  // namespace

SignalEnvelope::SignalEnvelope(const Signal& signal) {
  if (signal.samples.empty()) return;
  const Analysis analysis(signal);
  const std::vector<Lanes> energies = analysis.energies();
  Bands mean_square{};
  std::vector<std::uint8_t> steps(kBandCount * energies.size(), 0);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double sum = 0, loudest = 0;
    for (const Lanes& energy : energies) {
      sum += energy[b];
      loudest = std::max(loudest, energy[b]);
    }
    const double mean = sum / (analysis.moment_frames() * static_cast<double>(energies.size()));
    if (!(mean > kFaintest)) continue;
    mean_square[b] = std::min(static_cast<float>(mean), kLoudest);
    for (std::size_t m = 0; m < energies.size(); ++m)
      steps[b * energies.size() + m] = step_of(energies[m][b], loudest);
  }
  auto made = from_steps(mean_square, std::move(steps));
  assert(made.ok());
  *this = std::move(*made);
}

Result<SignalEnvelope> SignalEnvelope::from_steps(const Bands& mean_square,
                                                  std::vector<std::uint8_t> steps) {
  SignalEnvelope envelope;
  const std::size_t moments = steps.size() / kBandCount;
  if (moments == 0 || steps.size() % kBandCount != 0) return Error("has an empty envelope");
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double sum = 0;
    std::uint8_t highest = 0;
    for (std::size_t m = 0; m < moments; ++m) {
      sum += levels_of_steps()[steps[b * moments + m]];
      highest = std::max(highest, steps[b * moments + m]);
    }
    if (!(mean_square[b] == 0 || (mean_square[b] >= kFaintest && mean_square[b] <= kLoudest)) ||
        highest != (mean_square[b] > 0 ? 255 : 0))
      return Error("has an invalid envelope");
    if (mean_square[b] > 0)
      envelope.loudest_[b] =
          static_cast<float>(mean_square[b] * static_cast<double>(moments) / sum);
  }
  envelope.mean_square_ = mean_square;
  envelope.steps_ = std::move(steps);
  return envelope;
}

bool SignalEnvelope::silent() const {
  return std::all_of(mean_square_.begin(), mean_square_.end(),
                     [](float band) { return band == 0; });
}

Bands SignalEnvelope::at(std::size_t moment) const {
  Bands levels{};
  for (std::size_t b = 0; b < kBandCount; ++b)
    levels[b] = loudest_[b] * static_cast<float>(levels_of_steps()[steps_[b * moments() + moment]]);
  return levels;
}

}  // namespace clamor
