#include "runtime/streaming/prepared_signal.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "common/crossover.h"
#include "formats/bake_file/signal_envelope.h"
#include "runtime/propagation/loudness.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/voices/octave_filter_bank.h"

namespace clamor {

namespace {

// Length of the spline prefilter's response: 0.268^64 is below double precision.
constexpr int kSplineTail = 64;

// A piece's window reaches so many frames beyond the piece at its front and at its end.
constexpr int kFramesBefore = kPartingTailFrames + kLowRate * kSplineTail;
constexpr int kFramesAfter = kPartingTailFrames + kBankTailFrames + kLowRate * kSplineTail;
static_assert(kFramesBefore % kLowRate == 0 && kPieceFrames % kLowRate == 0);

// Replaces samples by half the coefficients of the cubic B-spline through them. Applies 3 / (z + 4
// + 1 / z): the stable half forwards, the other half backwards.
void to_spline(std::vector<double>& samples, bool loop) {
  const double pole = std::sqrt(3.0) - 2;
  const std::size_t tail = loop ? std::size_t{kSplineTail} : 0;
  filter_samples({Biquad{1, 0, 0, -pole, 0}}, samples, false, tail);
  filter_samples({Biquad{-3 * pole, 0, 0, -pole, 0}}, samples, true, tail);
}

// `samples` from -guard to size + guard, continued with silence or, for a loop, with the loop.
// `size` is the length of one loop; the guard may cover several.
void write_guarded(const std::vector<double>& samples, std::size_t size, std::size_t guard,
                   bool loop, float* to) {
  const auto period = static_cast<std::int64_t>(samples.size());
  for (std::size_t i = 0; i < size + 2 * guard && period > 0; ++i) {
    const std::int64_t at = static_cast<std::int64_t>(i) - static_cast<std::int64_t>(guard);
    if (loop)
      to[i] =
          static_cast<float>(samples[static_cast<std::size_t>((at % period + period) % period)]);
    else if (at >= 0 && at < period)
      to[i] = static_cast<float>(samples[static_cast<std::size_t>(at)]);
  }
}

// The layers of a window as the mixer reads them.
OctaveFilterBank::Layers layers_of(std::vector<double> window, const MixMode& mode,
                                   bool phase_undone) {
  OctaveFilterBank::Layers layers;
  if (mode.two_layers())
    layers = OctaveFilterBank::part_window(std::move(window), phase_undone);
  else
    layers.high = std::move(window);
  if (mode.interpolation == Interpolation::kCubic) to_spline(layers.high, false);
  to_spline(layers.low, false);
  return layers;
}

}  // namespace

PreparedSignal::PreparedSignal(std::uint64_t frames, bool loop, const MixMode& mode,
                               const Bands& mean_square)
    : mode_(mode), frames_(frames), mean_square_(mean_square) {
  auto high_frames = static_cast<std::int64_t>(frames);
  if (loop && frames > 0) {
    const std::int64_t once = high_frames;
    high_frames *= std::max<std::int64_t>(1, (kReach + once - 1) / once);
    layout_.loop_frames = high_frames;
  } else {  // filters and spline reach beyond the samples on both sides
    layout_.front_frames = mode.two_layers() ? kBankTailFrames : kSplineTail;
    if (frames > 0)
      high_frames += layout_.front_frames + (mode.two_layers() ? kPartingTailFrames : kSplineTail);
  }
  layout_.end_frames = high_frames - layout_.front_frames + 2;
  layout_.buffer_frames = high_frames + 2 * kGuardFrames;
  if (frames > kMaxWholeSignal_frames)
    layout_.pieces =
        (static_cast<std::size_t>(layout_.buffer_frames) + kPieceFrames - 1) / kPieceFrames;
  layout_.high_bytes =
      ReservedMemory::whole_pages(static_cast<std::size_t>(layout_.buffer_frames) * sizeof(float));
  if (mode.two_layers())
    layout_.low_bytes = ReservedMemory::whole_pages(
        static_cast<std::size_t>((layout_.buffer_frames + kLowRate - 1) / kLowRate) *
        sizeof(float));
  resident_ = std::make_unique<std::atomic<Residency>[]>(layout_.pieces);
}

PreparedSignal::PreparedSignal(const Signal& signal, const MixMode& mode)
    : PreparedSignal(signal.samples.size(), signal.loop, mode) {
  resident_ = nullptr;
  use_memory(std::make_shared<ReservedMemory>(memory_bytes()), 0);
  const auto frames = static_cast<std::int64_t>(signal.samples.size());
  for (std::size_t piece = 0; piece < layout_.pieces; ++piece) {
    commit(piece);
    const Window wanted = window(piece);
    std::vector<double> samples(wanted.frames);
    for (std::size_t i = 0; i < wanted.frames; ++i) {
      std::int64_t at = wanted.first + static_cast<std::int64_t>(i);
      if (loops()) at = (at % frames + frames) % frames;
      if (at >= 0 && at < frames) samples[i] = signal.samples[static_cast<std::size_t>(at)];
    }
    make(piece, std::move(samples));
  }
  if (layout_.pieces > 1) mean_square_ = SignalEnvelope(signal).mean_square();
  bad_samples_ = static_cast<std::uint64_t>(
      std::count_if(signal.samples.begin(), signal.samples.end(),
                    [](float sample) { return !std::isfinite(sample); }));
}

PreparedSignal PreparedSignal::live(const MixMode& mode) {
  // A level of -20 dB in each band, by which the mixer ranks the signals of voices.
  PreparedSignal signal(static_cast<std::uint64_t>(kRing_frames), true, mode,
                        same_in_all_bands(0.01f));
  signal.layout_.pieces = 1;
  signal.resident_ = nullptr;
  signal.use_memory(std::make_shared<ReservedMemory>(signal.memory_bytes()), 0);
  signal.commit(0);
  signal.live_ = std::make_unique<LiveRange>();
  return signal;
}

void PreparedSignal::make_live(std::int64_t first, std::size_t frames, std::vector<double> window) {
  assert(first % kLowRate == 0 && frames % kLowRate == 0);
  assert(window.size() == frames + 2 * kLiveWindow_frames);
  const OctaveFilterBank::Layers layers = layers_of(std::move(window), mode_, false);
  // Frames near either end of the ring are repeated in the guard beyond the other.
  const auto write = [&](const std::vector<double>& layer, float* ring, std::int64_t rate) {
    const std::int64_t size = kRing_frames / rate, guard = kGuardFrames / rate;
    const auto count = static_cast<std::int64_t>(frames) / rate;
    const std::size_t behind = kLiveWindow_frames / static_cast<std::size_t>(rate);
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t at = ((first / rate + i) % size + size) % size;
      const auto sample = static_cast<float>(layer[behind + static_cast<std::size_t>(i)]);
      ring[at] = sample;
      if (at < guard) ring[at + size] = sample;
      if (at >= size - guard) ring[at - size] = sample;
    }
  };
  write(layers.high, buffer_.high, 1);
  if (mode_.two_layers()) write(layers.low, buffer_.low, kLowRate);
}

void PreparedSignal::use_memory(std::shared_ptr<ReservedMemory> memory, std::size_t offset) {
  assert(offset + memory_bytes() <= memory->bytes());
  buffer_.memory = std::move(memory);
  buffer_.offset = offset;
  auto* const high = reinterpret_cast<float*>(buffer_.memory->data() + offset);
  buffer_.high = high + buffer_front();
  buffer_.low = buffer_.high;
  if (mode_.two_layers())
    buffer_.low = high + layout_.high_bytes / sizeof(float) + buffer_front() / kLowRate;
}

std::array<PreparedSignal::Stretch, 2> PreparedSignal::stretches(std::size_t piece) const {
  if (layout_.pieces == 1)
    return {Stretch{0, layout_.high_bytes}, Stretch{layout_.high_bytes, layout_.low_bytes}};
  const auto of = [&](std::size_t first, std::size_t whole, std::size_t each) {
    const std::size_t at = piece * each;
    return at < whole ? Stretch{first + at, std::min(each, whole - at)} : Stretch{};
  };
  constexpr std::size_t kBytes = kPieceFrames * sizeof(float);
  return {of(0, layout_.high_bytes, kBytes),
          of(layout_.high_bytes, layout_.low_bytes, kBytes / kLowRate)};
}

std::size_t PreparedSignal::piece_bytes(std::size_t piece) const {
  const auto both = stretches(piece);
  return both[0].bytes + both[1].bytes;
}

bool PreparedSignal::commit(std::size_t piece) {
  bool locked = true;
  for (const Stretch& stretch : stretches(piece))
    if (stretch.bytes > 0)
      locked = buffer_.memory->commit(buffer_.offset + stretch.first, stretch.bytes) && locked;
  return locked;
}

void PreparedSignal::decommit(std::size_t piece) {
  for (const Stretch& stretch : stretches(piece))
    if (stretch.bytes > 0) buffer_.memory->decommit(buffer_.offset + stretch.first, stretch.bytes);
}

PreparedSignal::Window PreparedSignal::window(std::size_t piece) const {
  if (layout_.pieces == 1) return {0, static_cast<std::size_t>(frames_)};
  const std::size_t first = piece * kPieceFrames;
  const std::size_t frames =
      std::min(kPieceFrames, static_cast<std::size_t>(layout_.buffer_frames) - first);
  return {static_cast<std::int64_t>(first) - buffer_front() - kFramesBefore,
          frames + kFramesBefore + kFramesAfter};
}

void PreparedSignal::make(std::size_t piece, std::vector<double> samples) {
  assert(samples.size() == window(piece).frames);
  for (double& sample : samples)
    if (!std::isfinite(sample)) sample = 0;
  if (layout_.pieces == 1)
    make_whole(std::move(samples));
  else
    make_part(piece, std::move(samples));
}

void PreparedSignal::make_whole(std::vector<double> samples) {
  const bool loop = loops();
  const std::size_t once = samples.size();
  while (loop && samples.size() < static_cast<std::size_t>(layout_.loop_frames))
    samples.insert(samples.end(), samples.end() - static_cast<std::ptrdiff_t>(once), samples.end());
  OctaveFilterBank::Layers layers;
  if (mode_.two_layers() || resident_ == nullptr) {
    const bool knows_power = resident_ != nullptr;
    layers = OctaveFilterBank::part(samples, loop, !mode_.head, !knows_power);
    if (!knows_power) mean_square_ = layers.mean_square;
  }
  if (!mode_.two_layers()) {
    layers.low.clear();
    layers.high = std::move(samples);
    if (!loop && once > 0) {
      layers.high.insert(layers.high.begin(), kSplineTail, 0.0);
      layers.high.resize(layers.high.size() + kSplineTail);
    }
  }
  if (mode_.interpolation == Interpolation::kCubic) to_spline(layers.high, loop);
  to_spline(layers.low, loop);

  write_guarded(layers.high, layers.high.size(), kGuardFrames, loop, buffer_.high - buffer_front());
  const std::size_t low_size =
      loop ? (layers.high.size() + kLowRate - 1) / kLowRate : layers.low.size();
  if (mode_.two_layers())
    write_guarded(layers.low, low_size, kGuardFrames / kLowRate, loop,
                  buffer_.low - buffer_front() / kLowRate);
}

void PreparedSignal::make_part(std::size_t piece, std::vector<double> window) {
  const OctaveFilterBank::Layers layers = layers_of(std::move(window), mode_, !mode_.head);
  const auto write = [&](const std::vector<double>& layer, float* buffer, int rate) {
    const std::size_t first = piece * kPieceFrames;
    const std::size_t end =
        std::min(first + kPieceFrames, static_cast<std::size_t>(layout_.buffer_frames));
    const auto step = static_cast<std::size_t>(rate);
    const std::size_t behind = kFramesBefore / step;
    for (std::size_t i = first / step; i < (end + step - 1) / step; ++i)
      buffer[i] = static_cast<float>(layer[behind + i - first / step]);
  };
  write(layers.high, buffer_.high - buffer_front(), 1);
  if (mode_.two_layers()) write(layers.low, buffer_.low - buffer_front() / kLowRate, kLowRate);
}

std::int64_t PreparedSignal::near(std::int64_t frame) const noexcept REALTIME {
  // Three hours, longer than any voice is held.
  constexpr std::int64_t kFar = std::int64_t{1} << 29;
  if (layout_.loop_frames > 0) return frame % layout_.loop_frames;
  return std::clamp(frame, -kFar, layout_.end_frames + kFar);
}

void PreparedSignal::read_high(std::int64_t first,
                               std::span<float> stored) const noexcept REALTIME {
  const std::int64_t from = loops() ? 0 : -layout_.front_frames - kGuardFrames;
  const std::int64_t to = loops() ? layout_.loop_frames : layout_.end_frames;
  if (loops()) first = (first % to + to) % to;
  for (std::size_t done = 0; done < stored.size();) {
    const auto left = static_cast<std::int64_t>(stored.size() - done);
    const bool silent = first < from || first >= to;
    const std::int64_t count = std::min(left, first < from ? from - first
                                              : silent     ? left
                                                           : to - first);
    if (silent)
      std::fill_n(&stored[done], count, 0.0f);
    else
      std::copy_n(buffer_.high + first, count, &stored[done]);
    done += static_cast<std::size_t>(count);
    first += count;
    if (loops() && first == to) first = 0;
  }
}

void PreparedSignal::read_low(std::int64_t first,
                              std::span<float> samples) const noexcept REALTIME {
  const std::int64_t period = layout_.loop_frames;
  if (loops()) first = (first % period + period) % period;
  for (float& sample : samples) {
    sample = 0;
    if (loops() || (first >= -layout_.front_frames - kGuardFrames / 2 &&
                    first < layout_.end_frames + kGuardFrames / 2)) {
      const float* const at = buffer_.low + (first >> 2);
      const float f = static_cast<float>(first & 3) / kLowRate, g = 1 - f;
      // The stored coefficients are halved, so a third stands for a sixth.
      sample = (g * g * g * at[-1] + (4 - 6 * f * f + 3 * f * f * f) * at[0] +
                (4 - 6 * g * g + 3 * g * g * g) * at[1] + f * f * f * at[2]) /
               3;
    }
    first += kLowRate;
    if (loops() && first >= period) first -= period;
  }
}

const float* PreparedSignal::silence() noexcept REALTIME {
  static constexpr std::array<float, 2 * kGuardFrames> kSilence{};
  return kSilence.data() + kGuardFrames / 4;
}

std::vector<PreparedSignal> prepare_signals(std::span<const Signal> signals, const MixMode& mode) {
  std::vector<PreparedSignal> prepared;
  prepared.reserve(signals.size());
  for (const Signal& signal : signals) prepared.emplace_back(signal, mode);
  return prepared;
}

SignalWeights mean_weights(std::span<const PreparedSignal> signals) {
  const Bands loudness = loudness_weights();
  SignalWeights weights;
  for (const PreparedSignal& signal : signals) {
    Bands& weight = weights.by_signal.emplace_back();
    for (std::size_t b = 0; b < kBandCount; ++b) weight[b] = loudness[b] * signal.mean_square()[b];
  }
  return weights;
}

}  // namespace clamor
