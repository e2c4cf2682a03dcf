#include "voice.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dice.h"

namespace clamor::assets {

namespace {

constexpr std::size_t kFormants = 10;
constexpr std::size_t kControl = 48;  // frames between two settings of the tract: 1 ms

// The upper formants of an average tract, 1 kHz apart.
double formant_hz(const Vowel& vowel, std::size_t index) {
  return index < 3 ? vowel.formants_hz[index] : 3400.0 + 1000.0 * static_cast<double>(index - 3);
}

double bandwidth_hz(std::size_t index) {
  constexpr double kLower[] = {80, 100, 140, 200, 260};
  return index < 5 ? kLower[index] : 300.0 + 80.0 * static_cast<double>(index - 5);
}

double mix(double a, double b, double share) { return a + (b - a) * share; }

Moment between(const Moment& a, const Moment& b, double time_s) {
  const double share = smooth_step(a.time_s, b.time_s, time_s);
  Moment m{time_s, a.f0_hz * std::pow(b.f0_hz / a.f0_hz, share), a.vowel};
  for (std::size_t i = 0; i < 3; ++i)
    m.vowel.formants_hz[i] = mix(a.vowel.formants_hz[i], b.vowel.formants_hz[i], share);
  m.voice = mix(a.voice, b.voice, share);
  m.breath = mix(a.breath, b.breath, share);
  m.hiss = mix(a.hiss, b.hiss, share);
  return m;
}

// The flow through the glottis and its derivative, pulse after pulse.
class Glottis {
 public:
  explicit Glottis(const Throat& throat) : throat_(throat), dice_(throat.seed) {}

  // Mean derivative of the flow over one frame: the difference of flows, so a closing that falls
  // between two frames is spread over both and does not alias audibly.
  double tick(double f0_hz) {
    phase_ += f0_hz * stretch_ / kRate_hz;
    if (phase_ >= 1) {
      phase_ -= 1;
      stretch_ = 1 + throat_.jitter * dice_.normal();
      height_ = 1 + throat_.shimmer * dice_.normal();
    }
    const double before = flow_;
    const double open = phase_ / throat_.open_quotient;
    flow_ = open < 1 ? 6.75 * height_ * open * open * (1 - open) : 0;
    return (flow_ - before) * kRate_hz / f0_hz * throat_.open_quotient / 7;
  }

  double flow() const { return flow_; }

 private:
  const Throat& throat_;
  Dice dice_;
  double phase_ = 0, stretch_ = 1, height_ = 1, flow_ = 0;
};

class Tract {
 public:
  explicit Tract(double scale) : scale_(scale) {}

  void shape(const Vowel& vowel) {
    for (std::size_t i = 0; i < kFormants; ++i)
      formants_[i].tune(formant_hz(vowel, i) * scale_, bandwidth_hz(i) * scale_);
  }

  double tick(double in) {
    for (Resonator& formant : formants_) in = formant.tick(in);
    return in;
  }

 private:
  double scale_;
  std::array<Resonator, kFormants> formants_;
};

}  // namespace

Samples speak(const Throat& throat, std::span<const Moment> moments) {
  Samples samples(frames(moments.back().time_s));
  Glottis glottis(throat);
  Tract tract(throat.tract_scale);
  LowPass tilt(throat.tilt_hz);
  BandPass teeth(6200 * throat.tract_scale, 1.6);
  Dice dice(throat.seed + 1000);
  std::size_t next = 1;
  Moment now = moments.front();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double time_s = static_cast<double>(i) / kRate_hz;
    if (i % kControl == 0) {
      while (next + 1 < moments.size() && moments[next].time_s <= time_s) ++next;
      now = between(moments[next - 1], moments[next], time_s);
      tract.shape(now.vowel);
    }
    const double vibrato =
        throat.vibrato_cents * std::sin(2 * std::numbers::pi * throat.vibrato_hz * time_s);
    const double pulse = tilt.tick(glottis.tick(now.f0_hz * std::exp2(vibrato / 1200)));
    const double noise = dice.normal();
    const double breath = noise * (throat.breath * now.voice * glottis.flow() + 0.25 * now.breath);
    double out = tract.tick(pulse * now.voice + breath) + 0.6 * now.hiss * teeth.tick(noise);
    if (throat.strain > 0) out = std::tanh(throat.strain * out) / throat.strain;
    samples[i] = out;
  }
  return samples;
}

}  // namespace clamor::assets
