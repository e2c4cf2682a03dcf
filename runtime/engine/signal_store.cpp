#include "runtime/engine/signal_store.h"

#include <algorithm>
#include <limits>
#include <thread>

#include "formats/bake_file/bake_file.h"
#include "runtime/mixing/block_mixer.h"

namespace clamor {

namespace {

// All signals, followed by onsets.
std::vector<PreparedSignal> prepare(const AuralizerInput& input, const MixMode& mode) {
  std::vector<PreparedSignal> prepared = prepare_signals(input.signals, mode);
  for (const Signal& onset : input.onsets) prepared.emplace_back(onset, mode);
  return prepared;
}

// One block of a signal in memory, divided as in a file.
std::vector<float> block_of(const Signal& signal, std::size_t block) {
  const SignalBlock where = signal_block(signal.samples.size(), block);
  const auto first = signal.samples.begin() + static_cast<std::ptrdiff_t>(where.first);
  return {first, first + static_cast<std::ptrdiff_t>(where.frames)};
}

// The file's signals come first, then the input's own, then onsets.
std::unique_ptr<SoundLoader> stream(const BakeFile& file, const AuralizerInput& input,
                                    const MixMode& mode, const AuralizerOptions& options,
                                    MemoryBudget& budget) {
  std::vector<SignalDescription> descriptions;
  for (const TimedEnvelope& signal : input.envelopes)
    descriptions.push_back({signal.frames, signal.loop, signal.envelope.mean_square()});
  for (std::size_t i = 0; i < input.onsets.size(); ++i) {
    SignalDescription& loop = descriptions[input.loop_of_onset[i]];
    loop.onset = static_cast<std::uint32_t>(descriptions.size());
    const Bands mean_square = loop.mean_square;
    descriptions.push_back({input.onsets[i].samples.size(), false, mean_square});
  }
  budget = MemoryBudget::of(options.memory_bytes, SoundLoader::bytes_of(descriptions, mode));
  return std::make_unique<SoundLoader>(
      descriptions, std::span(input.emitters).first(file.emitters().size()), mode,
      [&file, &input, report = options.report](std::size_t signal,
                                               std::size_t block) -> Result<std::vector<float>> {
        if (signal < file.signal_count()) {
          auto read = file.read_signal_block(signal, block);
          if (!read.ok() && report) report(read.error().message.c_str());
          return read;
        }
        if (signal < input.envelopes.size())
          return block_of(input.signals[signal - file.signal_count()], block);
        return block_of(input.onsets[signal - input.envelopes.size()], block);
      },
      SoundBudget{budget.sounds, !options.wait_for_pages},
      max_keyframes_ahead(options.block_frames),
      options.own_threads
          ? std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / 2, 1, 4)
          : 0,
      options.thread_hooks);
}

}  // namespace

std::uint64_t decoded_sounds_bytes(const BakeFile& file) {
  std::vector<SignalDescription> descriptions;
  for (std::size_t i = 0; i < file.signal_count(); ++i)
    descriptions.push_back({file.signal(i).frames, file.signal(i).loop});
  return SoundLoader::bytes_of(descriptions, MixMode{});
}

SignalStore::SignalStore(const BakeFile* file, const AuralizerInput& input, const MixMode& mode,
                         const AuralizerOptions& options)
    : wait_for_all_(options.wait_for_pages),
      created_s_(LoadClock::steady_s(nullptr)),
      first_sounds_s_(options.first_sounds_s),
      loader_(file == nullptr ? nullptr : stream(*file, input, mode, options, budget_)),
      prepared_(file == nullptr ? prepare(input, mode) : std::vector<PreparedSignal>()),
      signals_(file == nullptr ? prepared_ : loader_->signals()) {}

void SignalStore::play(const Keyframe& keyframe, std::span<const WantedSound> wanted,
                       std::span<const Voice> also) {
  if (loader_ == nullptr) return;
  loader_->play(keyframe.voices, wanted, also);
  if (wait_for_all_) loader_->wait(std::numeric_limits<double>::infinity());
}

bool SignalStore::load_first(std::span<const WantedSound> wanted, double longest_s) {
  if (loader_ == nullptr || wanted.empty()) return false;
  loader_->play({}, wanted);
  loader_->wait(std::max(0.0, created_s_ + longest_s - LoadClock::steady_s(nullptr)));
  return true;
}

}  // namespace clamor
