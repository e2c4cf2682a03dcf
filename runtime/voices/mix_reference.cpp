#include "runtime/voices/mix_reference.h"

namespace clamor {

namespace {

double read_linear(const float* x, double f) {
  return (1 - f) * static_cast<double>(x[0]) + f * static_cast<double>(x[1]);
}

// The uniform cubic B-spline by its weights, over samples that are half its coefficients.
double read_cubic(const float* x, double f) {
  const double g = 1 - f;
  const double w0 = g * g * g, w3 = f * f * f;
  const double w1 = 4 - 6 * f * f + 3 * w3, w2 = 4 - 6 * g * g + 3 * w0;
  return (w0 * static_cast<double>(x[-1]) + w1 * static_cast<double>(x[0]) +
          w2 * static_cast<double>(x[1]) + w3 * static_cast<double>(x[2])) /
         3;
}

double read(const float* signal, std::int64_t position, bool cubic) {
  const float* x = signal + (position >> 32);
  const double f = static_cast<double>(position & 0xffffffff) * 0x1p-32;
  return cubic ? read_cubic(x, f) : read_linear(x, f);
}

}  // namespace

void mix_reference(const MixMode& mode, const MixJob& job, ReferenceBuses& buses) {
  const bool cubic = mode.interpolation == Interpolation::kCubic;
  const int lanes = mode.gain_lanes();
  for (std::size_t v = 0; v < job.count; ++v) {
    const VoicePath* paths = job.paths + std::size_t{kEars} * job.active[v];
    const float* gains = job.gains + 2 * static_cast<std::size_t>(lanes) * job.active[v];
    const auto gain = [&](int lane, int frame) {
      return static_cast<double>(gains[lane]) +
             static_cast<double>(gains[lanes + lane]) * (job.first_frame + frame) / kGainFrames;
    };
    for (int ear = 0; ear < kEars; ++ear) {
      const VoicePath& path = paths[mode.delays == 2 ? ear : 0];
      for (int f = 0; f < job.frames; ++f) {
        const std::int64_t position = path.position_at(f);
        const double x = read(path.high, position, cubic);
        for (int b = 0; b < (mode.eight_bands ? kHighBands : 1); ++b)
          buses.high[(b * kEars + ear) * kMaxFrames + f] +=
              x *
              gain(mode.eight_bands ? band_lane(kLowBands + static_cast<std::size_t>(b), ear) : ear,
                   f);
        if (!mode.eight_bands || f % kLowRate != 0) continue;
        const LayerOffset gap = job.gaps == nullptr ? LayerOffset{} : job.gaps[job.active[v]];
        const std::int64_t ahead = gap.ahead + f * gap.step;
        const double y = read(path.low, (position + (ear == 0 ? ahead : -ahead)) >> 2, true);
        for (int b = 0; b < kLowBands; ++b)
          buses.low[(b * kEars + ear) * (kMaxFrames / kLowRate) + f / kLowRate] +=
              y * gain(band_lane(static_cast<std::size_t>(b), ear), f);
      }
    }
  }
}

}  // namespace clamor
