// How many voices can one core mix in real time, and what stands in the way? It decides how many a
// player is given.
//
// 48 kHz, 256 frames a block, a new keyframe every 960. Voices read 13 looping signals of 2 s at
// random delays; most delays slide by less than 0.1 % of real time, 3 % of them by up to 10 %, as
// in a hall with a few fast things in it. By CPU time of the thread.
//
//   mixer    the whole of Mixer: keyframes loaded, voices placed and mixed, bands filtered
//   kernel   mix_voices() alone and the voices' advance, with each instruction set
//   others   in turns within one run: the kernel, the mixer, the double-precision reference, OpenAL
//            Soft (linear, one delay, stereo, no HRTF) on as many voices at the same pitches.
//            Still: the kernel against OpenAL Soft's rendering alone; moving: the mixer against
//            OpenAL Soft with its sources moved at every keyframe. Medians over the rounds, and
//            _best the best of them, which a busy machine disturbs least
//
// "voices" is how many are mixed in real time; "of_peak" the share of this core's multiply-adds per
// second (a kernel's own count of them per voice and frame over what registers alone can do), and
// "of_loads" the share of its unaligned loads from L1.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <time.h>

#include "common/random.h"
#include "runtime/mix_reference.h"
#include "runtime/mixer.h"
#include "tests/benchmarks/machine_peak.h"
#include "tests/benchmarks/openal_voices.h"

namespace clamor {
namespace {

constexpr int kBlockFrames = 256;
constexpr std::uint32_t kSignals = 13, kSignalFrames = 2 * kSampleRate_hz;

double random_unit(std::uint32_t voice, std::uint32_t use) {
  return unit(philox(11, {voice, use, 0, 0})[0]);
}

double drift_of(std::uint32_t voice, int ear) {
  const double most = random_unit(voice, 1) < 0.03 ? 0.1 : 0.001;
  return most * (2 * random_unit(voice, 2 + static_cast<std::uint32_t>(ear)) - 1);
}

const std::vector<Signal>& noises() {
  static const auto kNoises = [] {
    std::vector<Signal> signals(kSignals);
    for (std::uint32_t s = 0; s < kSignals; ++s)
      for (std::uint32_t i = 0; i < kSignalFrames; ++i)
        signals[s].samples.push_back(static_cast<float>(unit(philox(s, {i, 0, 0, 0})[0]) - 0.5));
    return signals;
  }();
  return kNoises;
}

const std::vector<PreparedSignal>& prepared(const MixMode& mode) {
  static std::vector<std::pair<MixMode, std::vector<PreparedSignal>>> kept;
  for (const auto& [kept_mode, signals] : kept)
    if (kept_mode.interpolation == mode.interpolation &&
        kept_mode.eight_bands == mode.eight_bands && kept_mode.head == mode.head)
      return signals;
  return kept.emplace_back(mode, prepare_signals(noises(), mode)).second;
}

// What a kernel call needs, and the advance from call to call.
struct KernelVoices {
  KernelVoices(const MixMode& mode_, std::uint32_t count)
      : mode(mode_), signals(prepared(mode_)), buses(std::make_unique<MixBuses>()) {
    const auto lanes = static_cast<std::size_t>(mode.gain_lanes());
    for (std::uint32_t v = 0; v < count; ++v) {
      active.push_back(v);
      for (int e = 0; e < kEars; ++e) {
        VoicePath& path = paths.emplace_back();
        path.step = static_cast<std::int64_t>((1 + drift_of(v, e)) * 0x1p32);
        const double at = random_unit(v, 4) * kSignalFrames + 20 * random_unit(v, 5 + e);
        signals[v * kSignals / count].place(static_cast<std::int64_t>(at * 0x1p32), path);
      }
      for (std::uint32_t lane = 0; lane < 2 * lanes; ++lane)
        gains.push_back(static_cast<float>((random_unit(v, 10 + lane) - 0.5) / count *
                                           (lane < lanes ? 1 : 1.0 / 60)));
    }
  }
  MixJob job() const {
    return {paths.data(), gains.data(), active.data(), active.size(), 0,
            kBlockFrames, buses->high,  buses->low};
  }
  void mix() {
    mix_voices(mode, job());
    for (std::size_t at = 0; at < paths.size(); at += mode.delays == 1 ? kEars : 1) {
      paths[at].position = paths[at].position_at(kBlockFrames);
      paths[at].position -= paths[at].position >= wrap ? wrap : 0;
    }
  }

  MixMode mode;
  const std::vector<PreparedSignal>& signals;
  std::vector<VoicePath> paths;
  std::vector<float> gains;
  std::vector<std::uint32_t> active;
  std::int64_t wrap = signals[0].wrap();
  std::unique_ptr<MixBuses> buses;
};

// Multiply-adds and loads of signals per voice and frame, by the sums of mix_kernel.h: a line is 1
// of 2 loads, a spline 5 of 4; then one per bus, and one for the bus's gain.
struct Work {
  double multiply_adds, loads;
};
Work work_of(const MixMode& mode) {
  const bool cubic = mode.interpolation == Interpolation::kCubic;
  Work work{mode.delays * (cubic ? 5.0 : 1.0), mode.delays * (cubic ? 4.0 : 2.0)};
  double buses = kEars;
  if (mode.eight_bands) {
    work.multiply_adds += mode.delays * 5.0 / kLowRate;
    work.loads += mode.delays * 4.0 / kLowRate;
    buses *= kHighBands + 1.0 * kLowBands / kLowRate;
  }
  work.multiply_adds += 2 * buses;
  return work;
}

void count_voices(benchmark::State& state, const MixMode& mode, double voices_per_iteration) {
  using benchmark::Counter;
  const double real_time = voices_per_iteration * kBlockFrames / kSampleRate_hz;
  static std::string measured;
  static double multiply_adds = 0, loads = 0;
  if (measured != mix_kernel_target()) {
    measured = mix_kernel_target();
    multiply_adds = peak_multiply_adds_per_s();
    loads = peak_loads_per_s();
  }
  const Work work = work_of(mode);
  state.counters["voices"] = Counter(real_time, Counter::kIsIterationInvariantRate);
  state.counters["of_peak"] =
      Counter(voices_per_iteration * kBlockFrames * work.multiply_adds / multiply_adds,
              Counter::kIsIterationInvariantRate);
  state.counters["of_loads"] = Counter(voices_per_iteration * kBlockFrames * work.loads / loads,
                                       Counter::kIsIterationInvariantRate);
}

void kernel(benchmark::State& state, const std::string& target, const MixMode& mode) {
  force_mix_kernel(target);
  const auto voices = static_cast<std::uint32_t>(state.range(0));
  KernelVoices work(mode, voices);
  for (auto _ : state) work.mix();
  if (!(std::abs(work.buses->high[0]) > 0)) state.SkipWithError("nothing was heard");
  count_voices(state, mode, voices);
  force_mix_kernel("");
}

// A mixer and two keyframes by turns, so that every gain and delay goes on sliding to and fro.
struct MixedVoices {
  MixedVoices(const MixMode& mode, std::uint32_t voices)
      : panner(mode.pairs == 8 ? make_ambisonic_panner()
               : mode.pairs == 1
                   ? nullptr
                   : make_loudspeaker_panner(*find_layout(mode.pairs == 3 ? "5.1" : "7.1.4"))),
        head(mode.head ? *Head::read("") : nullptr),
        mixer(prepared(mode), voices, mode, panner.get(), head.get()),
        block(static_cast<std::size_t>(mixer.channels()) * kBlockFrames) {
    for (std::uint32_t k = 0; k < 2; ++k)
      for (std::uint32_t v = 0; v < voices; ++v) {
        Voice& voice = keyframes[k].voices.emplace_back();
        voice.slot = v;
        voice.signal = v * kSignals / voices;
        const double turn = 6.2832 * random_unit(v, 30) + 0.03 * k, up = 2 * random_unit(v, 31) - 1;
        voice.from = Vec3f(Vec3(std::sqrt(1 - up * up) * std::cos(turn),
                                std::sqrt(1 - up * up) * std::sin(turn), up));
        for (int e = 0; e < kEars; ++e) {
          voice.delay_frames[e] =
              1000 + random_unit(v, 4) * kSignalFrames + k * drift_of(v, e) * kKeyframeFrames;
          for (std::uint32_t b = 0; b < kBandCount; ++b)
            voice.gain[e][b] = static_cast<float>(
                (random_unit(v, 10 + 16 * k + 8 * static_cast<std::uint32_t>(e) + b) - 0.5) /
                voices);
        }
      }
    mixer.begin(keyframes[0], 1 << 30);
  }
  void mix() {
    for (int step = 0; step < kBlockFrames / kStepFrames;) {
      if (mixer.wants_keyframe()) mixer.load(keyframes[next++ % 2]);
      const int steps = std::min(kBlockFrames / kStepFrames - step, mixer.steps_left());
      mixer.mix(block.data() + mixer.channels() * kStepFrames * step, steps);
      step += steps;
    }
    for (const float sample : block) energy += static_cast<double>(sample) * sample;
  }

  std::array<Keyframe, 2> keyframes;
  std::unique_ptr<const Panner> panner;
  std::shared_ptr<const Head> head;
  Mixer mixer;
  std::vector<float> block;
  std::size_t next = 1;
  double energy = 0;
};

void mixer(benchmark::State& state, const MixMode& mode) {
  const auto voices = static_cast<std::uint32_t>(state.range(0));
  const auto mixed = std::make_unique<MixedVoices>(mode, voices);
  for (auto _ : state) mixed->mix();
  if (!(mixed->energy > 0)) state.SkipWithError("nothing was heard");
  count_voices(state, mode, voices);
}

double cpu_s() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

void others(benchmark::State& state) {
  const MixMode mode{Interpolation::kLinear, 1, false};
  const auto voices = static_cast<std::uint32_t>(state.range(0));
  KernelVoices work(mode, voices);
  const auto mixed = std::make_unique<MixedVoices>(mode, voices);
  const auto reference = std::make_unique<ReferenceBuses>();
  std::vector<std::vector<float>> samples;
  for (const Signal& noise : noises()) samples.push_back(noise.samples);
  std::array<std::vector<OpenalVoices::Voice>, 2> places;
  for (std::uint32_t k = 0; k < 2; ++k)
    for (std::uint32_t v = 0; v < voices; ++v)
      places[k].push_back({v * kSignals / voices,
                           static_cast<int>(random_unit(v, 4) * (kSignalFrames - 1)),
                           static_cast<float>(1 + drift_of(v, static_cast<int>(k))),
                           static_cast<float>(2 * random_unit(v, 10 + k) - 1)});
  const auto openal = OpenalVoices::create(samples, places[0]);
  std::vector<float> block(kEars * kBlockFrames);

  // Blocks enough to time: a few milliseconds of each, whole keyframes.
  const auto timed = [](std::uint32_t blocks, auto&& once) {
    blocks = (blocks + 14) / 15 * 15;
    const double start = cpu_s();
    for (std::uint32_t i = 0; i < blocks; ++i) once(i);
    return (cpu_s() - start) / blocks;
  };
  std::vector<double> ours, ours_moving, slow, theirs, theirs_moving, ratio, ratio_moving;
  for (auto _ : state) {
    ours.push_back(timed(40000 / voices, [&](std::uint32_t) { work.mix(); }));
    ours_moving.push_back(timed(40000 / voices, [&](std::uint32_t) { mixed->mix(); }));
    const double start = cpu_s();
    mix_reference(mode, work.job(), *reference);
    slow.push_back(cpu_s() - start);
    if (!openal) continue;
    theirs.push_back(timed(4000 / voices, [&](std::uint32_t) { openal->render(block); }));
    theirs_moving.push_back(timed(4000 / voices, [&](std::uint32_t i) {
      // Four keyframes in fifteen blocks.
      if (i * 4 / 15 != (i + 1) * 4 / 15) openal->move(places[i % 2]);
      openal->render(block);
    }));
    ratio.push_back(theirs.back() / ours.back());
    ratio_moving.push_back(theirs_moving.back() / ours_moving.back());
  }
  const double real_time = static_cast<double>(voices) * kBlockFrames / kSampleRate_hz;
  const auto best = [](const std::vector<double>& times) { return std::ranges::min(times); };
  state.counters["kernel"] = real_time / median(ours);
  state.counters["kernel_best"] = real_time / best(ours);
  state.counters["mixer"] = real_time / median(ours_moving);
  state.counters["reference"] = real_time / median(slow);
  if (!openal) return;
  double energy = 0;
  for (const float sample : block) energy += static_cast<double>(sample) * sample;
  if (!(energy > 0)) state.SkipWithError("OpenAL Soft was silent");
  state.counters["openal"] = real_time / median(theirs);
  state.counters["openal_moving"] = real_time / median(theirs_moving);
  state.counters["times_openal"] = median(ratio);
  state.counters["times_openal_best"] = best(theirs) / best(ours);
  state.counters["times_openal_moving"] = median(ratio_moving);
}

std::string name_of(const MixMode& mode) {
  return std::string(mode.interpolation == Interpolation::kCubic ? "cubic" : "linear") +
         (mode.delays == 2 ? "/two_delays" : "/one_delay") +
         (mode.head          ? "/binaural"
          : mode.eight_bands ? "/eight_bands"
                             : "/full_band") +
         (mode.pairs > 1 ? "/" + std::to_string(kEars * mode.pairs) + "_channels" : "");
}

const bool kRegistered = [] {
  for (const bool bands : {false, true})
    for (const Interpolation curve : {Interpolation::kLinear, Interpolation::kCubic})
      for (const int delays : {1, 2}) {
        const MixMode mode{curve, delays, bands};
        benchmark::RegisterBenchmark(("mixer/" + name_of(mode)).c_str(), mixer, mode)
            ->Arg(150)
            ->Arg(2000)
            ->Arg(20000)
            ->Arg(100000)
            ->MinTime(0.2);
        for (const std::string& target : mix_kernel_targets())
          benchmark::RegisterBenchmark(("kernel/" + target + "/" + name_of(mode)).c_str(), kernel,
                                       target, mode)
              ->Arg(2000)
              ->MinTime(0.1);
      }
  for (const int pairs : {1, 3, 6, 8}) {
    MixMode mode;
    mode.head = pairs == 1;
    mode.delays = pairs == 1 ? 2 : 1;
    mode.pairs = pairs;
    benchmark::RegisterBenchmark(("mixer/" + name_of(mode)).c_str(), mixer, mode)
        ->Arg(150)
        ->Arg(2000)
        ->Arg(20000)
        ->MinTime(0.2);
  }
  benchmark::RegisterBenchmark("others", others)->Arg(150)->Arg(2000)->Iterations(25);
  return true;
}();

}  // namespace
}  // namespace clamor
