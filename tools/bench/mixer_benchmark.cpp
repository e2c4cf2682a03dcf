#include "tools/bench/mixer_benchmark.h"

#include <algorithm>
#include <map>

#include "common/cpu_time.h"
#include "tools/bench/bench_voices.h"
#include "tools/bench/machine_peak.h"

namespace clamor {

const std::vector<MixMode>& bench_modes() {
  static const auto kModes = [] {
    std::vector<MixMode> modes;
    for (const bool eight_bands : {false, true})
      for (const Interpolation curve : {Interpolation::kLinear, Interpolation::kCubic})
        for (const int delays : {1, 2}) modes.push_back({curve, delays, eight_bands});
    for (const Interpolation curve : {Interpolation::kLinear, Interpolation::kCubic}) {
      modes.push_back({curve});
      modes.back().head = true;
    }
    return modes;
  }();
  return kModes;
}

MixMode mode_like_openal(const std::string& resampler, OpenalOutput output) {
  const bool is_linear = resampler == "Linear" || resampler == "Nearest";
  MixMode mode{is_linear ? Interpolation::kLinear : Interpolation::kCubic};
  if (output == OpenalOutput::kBinaural) {
    mode.head = true;
  } else {
    mode.delays = 1;
    mode.eight_bands = false;
  }
  return mode;
}

VoiceCost cost_of(const MixMode& mode, std::uint32_t voices) {
  const bool cubic = mode.interpolation == Interpolation::kCubic;
  VoiceCost work{mode.delays * (cubic ? 5.0 : 1.0), mode.delays * (cubic ? 4.0 : 2.0), 0};
  double buses = 1;
  if (mode.two_layers()) {
    work.multiply_adds += mode.delays * 5.0 / kLowRate;
    work.loads += mode.delays * 4.0 / kLowRate;
    buses = kHighBands + 1.0 * kLowBands / kLowRate;
  }
  if (mode.head) {
    const double fine = std::min(1.0, 1.0 * mode.narrowband_voices / voices);
    buses += fine * (kHrtfHighBands + 1.0 * kHrtfLowRows / kLowRate - buses);
  }
  work.reading = work.multiply_adds;
  work.multiply_adds += 2 * kEars * mode.pairs * buses;
  return work;
}

// Per frame, a call of n frames takes a + b / n; this returns b / kBenchFrames.
double KernelProfile::taking_ns() const {
  constexpr double kCalls = 1.0 * kBenchFrames / kStepFrames;
  return (in_steps_ns - still_and_near_ns) / (kCalls - 1);
}

namespace {

constexpr std::uint32_t kVoicesOfOtherKernels = 2000, kMaxOpenalVoices = 2000;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Seconds per block of several runs, each of at least `seconds` of CPU time. Voices are kept from
// run to run: making 100 000 of them takes longer than timing them.
template <class Once>
std::vector<double> seconds_of_runs(double seconds, int runs, const Once& once) {
  once();  // fills the caches
  std::vector<double> of_runs;
  for (double blocks = 1; std::ssize(of_runs) < runs;) {
    const double start = thread_time_s();
    for (int i = 0; i < static_cast<int>(blocks); ++i) once();
    const double took = thread_time_s() - start;
    if (took >= seconds)
      of_runs.push_back(took / static_cast<int>(blocks));
    else
      blocks = std::clamp(1.2 * seconds / std::max(took, 1e-9) * blocks, 2 * blocks, 10 * blocks);
  }
  return of_runs;
}

// None if nothing was heard.
std::vector<double> time_figure(const MixerTiming& figure, const BenchRequest& request) {
  using What = MixerTiming::What;
  if (figure.what == What::kMixer) {
    MixerVoices voices(figure.mode, figure.voices);
    const auto seconds = seconds_of_runs(request.seconds, request.runs, [&] { voices.mix(); });
    return voices.heard() ? seconds : std::vector<double>();
  }
  KernelVoices voices(figure.mode, figure.voices);
  if (figure.what == What::kReference)
    return seconds_of_runs(0.2 * request.seconds, 1, [&] { voices.mix_with_reference(); });
  force_mix_kernel(figure.instructions);
  const auto seconds = seconds_of_runs(request.seconds, request.runs, [&] { voices.mix(); });
  force_mix_kernel("");
  return voices.heard() ? seconds : std::vector<double>();
}

// Seconds per block, over whole keyframes (15 blocks are four of them). A warm-up of as many
// blocks, at most one signal, fills the caches first.
template <class Once>
double seconds_of(double blocks, const Once& once) {
  const int whole = 15 * std::max(1, static_cast<int>(blocks / 15));
  for (int i = 0; i < std::min(whole, kBenchSignalFrames / kBenchFrames); ++i) once(i);
  const double start = thread_time_s();
  for (int i = 0; i < whole; ++i) once(i);
  return (thread_time_s() - start) / whole;
}

// Kinds of voices alternate, and the best of each over all rounds counts, so that differences come
// from the voices.
void time_profile(KernelProfile& profile, double seconds) {
  const MixMode& mode = profile.mode;
  const std::uint32_t count = profile.voices;
  KernelVoices in_steps(mode, count, BenchVoiceKind::kStaticInL1, kStepFrames);
  KernelVoices near(mode, count, BenchVoiceKind::kStaticInL1),
      still(mode, count, BenchVoiceKind::kStill);
  KernelVoices usual(mode, count);
  MixerVoices mixer(mode, count);
  constexpr int kTurns = 5;
  const auto time = [&](double& best_ns, int frames, auto& voices) {
    const double block_s = seconds_of(seconds / kTurns * 2e7 / count, [&](int) {
      for (int at = 0; at < kBenchFrames; at += frames) voices.mix();
    });
    const double ns = 1e9 * block_s / count / kBenchFrames;
    if (best_ns == 0 || ns < best_ns) best_ns = ns;
  };
  for (int turn = 0; turn < kTurns; ++turn) {
    time(profile.in_steps_ns, kStepFrames, in_steps);
    time(profile.still_and_near_ns, kBenchFrames, near);
    time(profile.still_ns, kBenchFrames, still);
    time(profile.usual_ns, kBenchFrames, usual);
    time(profile.mixer_ns, kBenchFrames, mixer);
  }
}

// Each round times everything in turn, so that a disturbance affects all figures alike.
// Returns false if OpenAL Soft was silent.
bool time_openal(OpenalTiming& figure, const MixMode& mode, const BenchRequest& request) {
  const std::uint32_t count = figure.voices;
  KernelVoices kernel(mode, count);
  MixerVoices mixer(mode, count);
  const std::array places = {openal_voices_at(0, count), openal_voices_at(1, count)};
  const auto openal = OpenalVoices::create(bench_samples(), places[0], figure.output);
  if (!openal) return true;
  std::vector<float> block(kEars * kBenchFrames);
  std::vector<double> still, moving, times_still, times_moving;
  double energy = 0;
  for (int round = 0; round < 3 * request.runs; ++round) {
    const double ours_blocks = request.seconds * 5e6 / count,
                 blocks = request.seconds * 5e5 / count;
    const double ours = seconds_of(ours_blocks, [&](int) { kernel.mix(); });
    const double ours_moving = seconds_of(ours_blocks, [&](int) { mixer.mix(); });
    still.push_back(seconds_of(blocks, [&](int) { openal->render(block); }));
    moving.push_back(seconds_of(blocks, [&](int i) {
      if (i * 4 / 15 != (i + 1) * 4 / 15) openal->move(places[static_cast<std::size_t>(i % 2)]);
      openal->render(block);
    }));
    times_still.push_back(still.back() / ours);
    times_moving.push_back(moving.back() / ours_moving);
    for (const float x : block) energy += static_cast<double>(x) * static_cast<double>(x);
  }
  const double real_time = static_cast<double>(count) * kBenchFrames / kSampleRate_hz;
  figure.still = real_time / median(still);
  figure.moving = real_time / median(moving);
  figure.times_still = median(times_still);
  figure.times_moving = median(times_moving);
  return energy > 0;
}

std::vector<MixerTiming> wanted(const BenchRequest& request, const std::string& best) {
  using What = MixerTiming::What;
  std::vector<MixerTiming> figures;
  for (const MixMode& mode : bench_modes())
    for (const What what : {What::kMixer, What::kKernel, What::kReference})
      for (const std::uint32_t voices : request.voices) {
        if (what == What::kReference && mode.head) continue;
        figures.push_back({what, mode, what == What::kReference ? "double" : best, voices});
      }
  for (const MixMode& mode : bench_modes())
    for (const std::string& target : mix_kernel_targets())
      if (target != best)
        figures.push_back(
            {What::kKernel, mode, target,
             std::min(kVoicesOfOtherKernels,
                      *std::max_element(request.voices.begin(), request.voices.end()))});
  return figures;
}

// Relates the measured voices to the core's peak.
void evaluate(MixerBenchmark& result) {
  std::map<std::string, std::pair<double, double> > peaks;
  for (MixerTiming& figure : result.figures) {
    if (figure.what != MixerTiming::What::kKernel) continue;
    if (!peaks.contains(figure.instructions)) {
      force_mix_kernel(figure.instructions);
      peaks[figure.instructions] = {peak_multiply_adds_per_s(), peak_loads_per_s()};
      force_mix_kernel("");
    }
    figure.work = cost_of(figure.mode, figure.voices);
    const auto [multiply_adds, loads] = peaks[figure.instructions];
    const double frames_per_s = figure.real_time.best * kSampleRate_hz;
    figure.of_multiply_adds = frames_per_s * figure.work.multiply_adds / multiply_adds;
    figure.of_loads = frames_per_s * figure.work.loads / loads;
  }
  std::tie(result.peak_multiply_adds_per_s, result.peak_loads_per_s) = peaks[result.instructions];
  for (KernelProfile& profile : result.profiles) {
    const VoiceCost work = cost_of(profile.mode, profile.voices);
    profile.reading_ns = 1e9 * work.reading / result.peak_multiply_adds_per_s;
    profile.ceiling_ns = 1e9 * work.multiply_adds / result.peak_multiply_adds_per_s;
  }
}

}  // namespace

Result<MixerBenchmark> measure_mixer(const BenchRequest& request,
                                     const std::function<void(double)>& progress) {
  MixerBenchmark result;
  result.instructions = mix_kernel_target();
  result.figures = wanted(request, result.instructions);
  result.openal = openal_library();
  const auto like_openal = [&](OpenalOutput output) {
    return mode_like_openal(result.openal.resampler, output);
  };
  for (const OpenalOutput output : {OpenalOutput::kStereo, OpenalOutput::kBinaural})
    if (const auto one = OpenalVoices::create(bench_samples(), openal_voices_at(0, 1), output)) {
      if (output == OpenalOutput::kBinaural) result.openal_head = one->head();
      for (const std::uint32_t voices : request.voices)
        if (voices <= kMaxOpenalVoices) result.against_openal.push_back({output, voices});
    }

  const std::uint32_t profiled =
      std::min(kVoicesOfOtherKernels, *std::ranges::max_element(request.voices));
  for (const OpenalTiming& figure : result.against_openal)
    if (figure.output == OpenalOutput::kStereo && figure.voices != profiled)
      result.profiles.push_back({like_openal(figure.output), figure.voices});
  for (const MixMode& mode : bench_modes()) result.profiles.push_back({mode, profiled});

  const auto runs = static_cast<std::size_t>(request.runs);
  for (const MixMode& mode : field_modes())
    for (const std::uint32_t taps : request.voices) result.fields.push_back({mode, taps});
  const std::size_t all = result.figures.size() + runs * result.profiles.size() +
                          result.fields.size() + result.against_openal.size();
  std::size_t done = 0;
  const auto step = [&] { progress(static_cast<double>(++done) / static_cast<double>(all)); };
  for (MixerTiming& figure : result.figures) {
    const auto seconds = time_figure(figure, request);
    if (seconds.empty()) return Error("while timing, nothing was heard.");
    const double real_time = static_cast<double>(figure.voices) * kBenchFrames / kSampleRate_hz;
    figure.real_time = {real_time / median(seconds), real_time / std::ranges::min(seconds)};
    step();
  }
  // Rounds follow each other, so that a disturbance affects one run of each figure at most.
  for (std::size_t round = 0; round < runs; ++round)
    for (KernelProfile& profile : result.profiles) {
      time_profile(profile, request.seconds);
      step();
    }
  for (FieldTiming& figure : result.fields) {
    if (!time_field(figure, request.seconds, request.runs))
      return Error("while timing, no tap was heard.");
    step();
  }
  for (OpenalTiming& figure : result.against_openal) {
    if (!time_openal(figure, like_openal(figure.output), request))
      return Error("while timing, OpenAL Soft was silent.");
    step();
  }

  evaluate(result);
  std::erase_if(result.against_openal, [](const OpenalTiming& one) { return one.still == 0; });
  return result;
}

}  // namespace clamor
