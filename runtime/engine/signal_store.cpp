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
                                    const MixMode& mode, const AuralizerOptions& options) {
  std::vector<SignalDescription> descriptions;
  for (const TimedEnvelope& signal : input.envelopes)
    descriptions.push_back({signal.frames, signal.loop, signal.envelope.mean_square()});
  for (std::size_t i = 0; i < input.onsets.size(); ++i) {
    SignalDescription& loop = descriptions[input.loop_of_onset[i]];
    loop.onset = static_cast<std::uint32_t>(descriptions.size());
    const Bands mean_square = loop.mean_square;
    descriptions.push_back({input.onsets[i].samples.size(), false, mean_square});
  }
  const std::uint64_t bytes = std::min(SoundLoader::bytes_of(descriptions, mode),
                                       std::max(options.memory_bytes / 2, kMinSoundMemory_bytes));
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
      SoundBudget{bytes, !options.wait_for_pages}, max_keyframes_ahead(options.block_frames),
      options.own_threads
          ? std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / 2, 1, 4)
          : 0,
      options.thread_hooks);
}

}  // namespace

SignalStore::SignalStore(const BakeFile* file, const AuralizerInput& input, const MixMode& mode,
                         const AuralizerOptions& options)
    : wait_for_all_(options.wait_for_pages),
      first_deadline_s_(LoadClock::steady_s(nullptr) + options.first_sounds_s),
      loader_(file == nullptr ? nullptr : stream(*file, input, mode, options)),
      prepared_(file == nullptr ? prepare(input, mode) : std::vector<PreparedSignal>()),
      signals_(file == nullptr ? prepared_ : loader_->signals()) {}

std::uint64_t SignalStore::budget_bytes() const {
  return loader_ == nullptr ? 0 : loader_->budget_bytes();
}

void SignalStore::play(const Keyframe& keyframe) {
  if (loader_ == nullptr) return;
  loader_->play(keyframe.voices);
  if (wait_for_all_)
    loader_->wait(std::numeric_limits<double>::infinity());
  else if (keyframe.number == 0)
    loader_->wait(std::max(0.0, first_deadline_s_ - LoadClock::steady_s(nullptr)));
}

}  // namespace clamor
