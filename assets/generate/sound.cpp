#include "sound.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <sndfile.h>

namespace clamor::assets {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLevel_db = -20, kPeak_db = -1.5;
constexpr std::size_t kFrame = 960;  // 20 ms

double amplitude(double db) { return std::pow(10, db / 20); }

double active_rms(const Samples& samples) {
  std::vector<double> powers;
  for (std::size_t begin = 0; begin < samples.size(); begin += kFrame) {
    const std::size_t end = std::min(begin + kFrame, samples.size());
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += samples[i] * samples[i];
    powers.push_back(sum / static_cast<double>(end - begin));
  }
  const double loudest = *std::max_element(powers.begin(), powers.end());
  double sum = 0, count = 0;
  for (const double power : powers) {
    if (power < loudest * std::pow(10, kSilent_db / 10)) continue;
    sum += power;
    count += 1;
  }
  return std::sqrt(sum / count);
}

// Once round to settle, once more to keep: the filter's memory joins end and beginning.
void high_pass_round(Samples& loop, double cutoff_hz) {
  LowPass low(cutoff_hz);
  for (const double sample : loop) low.tick(sample);
  for (double& sample : loop) sample -= low.tick(sample);
}

struct CloseSound {
  void operator()(SNDFILE* file) const { sf_close(file); }
};

}  // namespace

void Resonator::tune(double frequency_hz, double bandwidth_hz) {
  const double radius = std::exp(-kPi * bandwidth_hz / kRate_hz);
  c_ = -radius * radius;
  b_ = 2 * radius * std::cos(2 * kPi * frequency_hz / kRate_hz);
  a_ = 1 - b_ - c_;
}

BandPass::BandPass(double frequency_hz, double quality) {
  const double omega = 2 * kPi * frequency_hz / kRate_hz;
  const double alpha = std::sin(omega) / (2 * quality);
  gain_ = alpha / (1 + alpha);
  a1_ = -2 * std::cos(omega) / (1 + alpha);
  a2_ = (1 - alpha) / (1 + alpha);
}

LowPass::LowPass(double cutoff_hz) : share_(1 - std::exp(-2 * kPi * cutoff_hz / kRate_hz)) {}

double smooth_step(double from, double to, double at) {
  if (at <= from) return 0;
  if (at >= to) return 1;
  return 0.5 - 0.5 * std::cos(kPi * (at - from) / (to - from));
}

void add_at(double at_s, const Samples& sound, Samples& track) {
  const std::size_t begin = frames(at_s);
  if (track.size() < begin + sound.size()) track.resize(begin + sound.size(), 0.0);
  for (std::size_t i = 0; i < sound.size(); ++i) track[begin + i] += sound[i];
}

void Loop::add(double at_s, const Samples& sound, double gain) {
  const std::size_t begin = frames(at_s);
  for (std::size_t i = 0; i < sound.size(); ++i)
    samples_[(begin + i) % samples_.size()] += gain * sound[i];
}

std::vector<std::int16_t> mastered(Samples loop) {
  high_pass_round(loop, 25);
  double peak = 0;
  for (const double sample : loop) peak = std::max(peak, std::abs(sample));
  const double gain = std::min(amplitude(kLevel_db) / active_rms(loop), amplitude(kPeak_db) / peak);
  std::vector<std::int16_t> master;
  for (const double sample : loop)
    master.push_back(static_cast<std::int16_t>(std::lround(32767 * gain * sample)));
  return master;
}

Result<void> write_flac(const std::string& path, const std::vector<std::int16_t>& samples) {
  SF_INFO info{};
  info.samplerate = kRate_hz;
  info.channels = 1;
  info.format = SF_FORMAT_FLAC | SF_FORMAT_PCM_16;
  const std::unique_ptr<SNDFILE, CloseSound> file(sf_open(path.c_str(), SFM_WRITE, &info));
  if (!file)
    return Error(path + " cannot be created: " + sf_strerror(nullptr) +
                 " Make its folder, or choose another.");
  double level = 1;  // the smallest files
  sf_command(file.get(), SFC_SET_COMPRESSION_LEVEL, &level, sizeof level);
  const auto count = static_cast<sf_count_t>(samples.size());
  if (sf_write_short(file.get(), samples.data(), count) != count)
    return Error(path + " cannot be written whole: " + sf_strerror(file.get()) +
                 " Is the disk full?");
  return {};
}

Result<std::vector<std::int16_t>> read_flac(const std::string& path) {
  SF_INFO info{};
  const std::unique_ptr<SNDFILE, CloseSound> file(sf_open(path.c_str(), SFM_READ, &info));
  if (!file)
    return Error(path + " cannot be read: " + sf_strerror(nullptr) +
                 " Run make_assets without --check to make it.");
  if (info.channels != 1 || info.samplerate != kRate_hz)
    return Error(path + " is not mono at 48000 Hz. Run make_assets to make it anew.");
  std::vector<std::int16_t> samples(static_cast<std::size_t>(info.frames));
  if (sf_read_short(file.get(), samples.data(), info.frames) != info.frames)
    return Error(path + " ends early. Run make_assets to make it anew.");
  return samples;
}

}  // namespace clamor::assets
