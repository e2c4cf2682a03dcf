#include "runtime/streaming/sound_loader.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <numeric>
#include <thread>
#include <utility>

#include "runtime/propagation/loudness.h"

namespace clamor {

namespace {

constexpr auto kNap = std::chrono::milliseconds(20);
constexpr std::uint64_t kMaxKeptBlocks = 4;

std::uint64_t key_of(std::uint32_t signal, std::int32_t step) {
  return std::uint64_t{signal} << 32 | static_cast<std::uint32_t>(step);
}
ReadPosition read_position(std::uint64_t key, float power) {
  return {static_cast<std::uint32_t>(key >> 32),
          static_cast<std::int32_t>(static_cast<std::uint32_t>(key)), power};
}

std::int32_t step_of(double delay_frames) {
  return static_cast<std::int32_t>(std::floor(delay_frames / kDelayStep_frames));
}

// Loudness-weighted power, in the unit of a source's weight.
float weighted_power(const Bands& power) {
  static const Bands loudness = loudness_weights();
  float sum = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) sum += loudness[b] * power[b];
  return sum;
}

// The mean of both ears.
float power_of(const Voice& voice, const Bands& mean_square) {
  Bands power{};
  for (const Bands& ear : voice.gain)
    for (std::size_t b = 0; b < kBandCount; ++b)
      power[b] += mean_square[b] * ear[b] * ear[b] / kEars;
  return weighted_power(power);
}

// False for delays beyond six hours, and NaN: sounds of levels begin earlier.
bool is_in_range(double frames) { return std::abs(frames) < 1 << 30; }

// The emitters' signals and delays, whether or not a voice plays them.
std::vector<ReadPosition> emitted_by(std::span<const Emitter> emitters,
                                     const std::vector<SignalDescription>& shapes) {
  std::unordered_map<std::uint64_t, float> powers;
  for (const Emitter& emitter : emitters)
    powers[key_of(emitter.signal, step_of(emitter.delay_s * kSampleRate_hz))] +=
        static_cast<float>(emitter.gain * emitter.gain) *
        weighted_power(shapes[emitter.signal].mean_square);
  std::vector<ReadPosition> emitted;
  for (const auto& [key, power] : powers) emitted.push_back(read_position(key, power));
  return emitted;
}

bool any_is_long(const std::vector<SignalDescription>& shapes) {
  return std::any_of(shapes.begin(), shapes.end(), [](const SignalDescription& shape) {
    return shape.frames > kMaxWholeSignal_frames;
  });
}

// Number of decoded blocks that the budget has room for.
std::uint64_t blocks_kept(const std::vector<SignalDescription>& shapes, const SoundBudget& budget) {
  return any_is_long(shapes)
             ? std::min(kMaxKeptBlocks, budget.bytes / 8 / SignalBlockCache::kBlockBytes)
             : 0;
}

}  // namespace

// State shared by the sampler and the loader threads. The mutex guards everything unless noted.
struct SoundLoader::Shared {
  Shared(std::span<PreparedSignal> signals, SignalBlockCache::Decode decode, std::uint64_t kept,
         const SoundBudget& budget, const std::atomic<std::uint64_t>& quiescent_points)
      : blocks(std::move(decode), static_cast<std::size_t>(kept)),
        pieces(signals, {budget.bytes - kept * SignalBlockCache::kBlockBytes, budget.strict},
               quiescent_points) {}

  SignalBlockCache blocks;                // has its own mutex
  std::atomic<bool> settled{false};       // every piece is resident or has failed
  std::atomic<bool> all_resident{false};  // and none has failed
  std::mutex mutex;
  std::condition_variable work, arrival;
  bool closing = false;
  SoundResidency pieces;
  SoundResidency::Needs needs;
  std::int64_t ahead_frames = 0;
  std::vector<std::thread> threads;
};

std::uint64_t SoundLoader::bytes_of(const std::vector<SignalDescription>& shapes,
                                    const MixMode& mode) {
  std::uint64_t bytes = 0;
  for (const SignalDescription& shape : shapes)
    bytes += PreparedSignal(shape.frames, shape.loop, mode).memory_bytes();
  return bytes + (any_is_long(shapes) ? kMaxKeptBlocks * SignalBlockCache::kBlockBytes : 0);
}

SoundLoader::SoundLoader(const std::vector<SignalDescription>& shapes,
                         std::span<const Emitter> emitters, const MixMode& mode,
                         SignalBlockCache::Decode decode, const SoundBudget& budget,
                         std::size_t keyframes, int threads, const ThreadHooks& hooks)
    : keyframes_(keyframes), budget_bytes_(budget.bytes), all_bytes_(bytes_of(shapes, mode)) {
  std::size_t bytes = 0;
  continuation_.resize(shapes.size());
  std::iota(continuation_.begin(), continuation_.end(), 0u);
  onset_ = continuation_;
  for (std::uint32_t s = 0; s < shapes.size(); ++s) {
    if (shapes[s].onset >= shapes.size()) continue;
    onset_[s] = shapes[s].onset;
    continuation_[shapes[s].onset] = s;
  }
  for (const SignalDescription& shape : shapes) {
    signals_.emplace_back(shape.frames, shape.loop, mode, shape.mean_square);
    bytes += signals_.back().memory_bytes();
  }
  memory_ = std::make_shared<ReservedMemory>(bytes);
  bytes = 0;
  for (PreparedSignal& signal : signals_) {
    signal.use_memory(memory_, bytes);
    bytes += signal.memory_bytes();
  }
  shared_ = std::make_unique<Shared>(signals_, std::move(decode), blocks_kept(shapes, budget),
                                     budget, quiescent_points_);
  shared_->needs.emitted = emitted_by(emitters, shapes);
  // One segment is being mixed, `keyframes` wait in the queue, and one is being made.
  shared_->ahead_frames = static_cast<std::int64_t>(keyframes + 2) * kKeyframeFrames;
  for (int i = 0; i < threads; ++i)
    shared_->threads.emplace_back([this, hooks] {
      const HookedThread hooked(hooks, "sound loader");
      run();
    });
}

SoundLoader::~SoundLoader() {
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->closing = true;
  }
  shared_->work.notify_all();
  for (std::thread& thread : shared_->threads) thread.join();
}

void SoundLoader::run() {
  Shared& shared = *shared_;
  std::unique_lock lock(shared.mutex);
  while (!shared.closing) {
    if (load_next(lock)) continue;
    if (shared.settled)
      shared.work.wait(lock);
    else
      shared.work.wait_for(lock, kNap);
  }
}

void SoundLoader::update_needs() {
  shared_->pieces.update_needs(shared_->needs, clock_.load(std::memory_order_relaxed),
                               shared_->ahead_frames);
}

bool SoundLoader::load_next() {
  std::unique_lock lock(shared_->mutex);
  return load_next(lock);
}

bool SoundLoader::load_next(std::unique_lock<std::mutex>& lock) {
  Shared& shared = *shared_;
  shared.pieces.free_evicted();
  update_needs();
  SoundResidency::Piece* const piece = shared.pieces.next_to_load();
  if (piece == nullptr) {
    shared.settled = shared.pieces.all_settled();
    shared.all_resident = shared.pieces.all_resident();
    shared.arrival.notify_all();
    return false;
  }
  lock.unlock();
  PreparedSignal& signal = signals_[piece->signal];
  const PreparedSignal::Window window = signal.window(piece->piece);
  auto samples = shared.blocks.read(piece->signal, {signal.frames(), signal.loops()}, window.first,
                                    window.frames);
  bool locked = false;
  if (samples.ok()) {
    locked = signal.commit(piece->piece);
    signal.make(piece->piece, std::move(*samples));
  }
  lock.lock();
  if (samples.ok())
    shared.pieces.loaded(*piece, locked);
  else
    shared.pieces.failed(*piece, samples.error().message);
  shared.arrival.notify_all();
  return true;
}

void SoundLoader::play(std::span<const Voice> voices, std::span<const WantedSound> wanted,
                       std::span<const Voice> also) {
  ++played_;
  if (!wanted.empty()) handed_over_.fetch_add(1, std::memory_order_relaxed);
  if (shared_->settled.load(std::memory_order_relaxed)) return;
  auto played = read_by(voices, also);
  auto would_be_played = read_by(wanted);
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->needs.played = std::move(played);
    shared_->needs.wanted = std::move(would_be_played);
  }
  shared_->work.notify_all();
}

// What the voices of this keyframe and of those that the mixer may still read play.
std::vector<ReadPosition> SoundLoader::read_by(std::span<const Voice> voices,
                                               std::span<const Voice> also) {
  const auto add = [this](const Voice& voice) {
    if (voice.signal >= signals_.size()) return;  // in a slot, and in memory
    double min_frames = std::min(voice.delay_frames[0], voice.delay_frames[1]);
    double max_frames = std::max(voice.delay_frames[0], voice.delay_frames[1]);
    if (voice.starts) {
      min_frames = std::min({min_frames, voice.start_delay_frames[0], voice.start_delay_frames[1]});
      max_frames = std::max({max_frames, voice.start_delay_frames[0], voice.start_delay_frames[1]});
    }
    if (!is_in_range(min_frames) || !is_in_range(max_frames)) return;
    const float power = power_of(voice, signals_[voice.signal].mean_square());
    const auto reads = [&](std::uint32_t signal) {
      for (std::int32_t step = step_of(min_frames); step <= step_of(max_frames); ++step) {
        RecentRead& recent = recent_reads_[key_of(signal, step)];
        recent.power = recent.keyframe == played_ ? recent.power + power : power;
        recent.keyframe = played_;
      }
    };
    reads(voice.signal);
    if (const std::uint32_t loop = continuation_[voice.signal]; loop != voice.signal) reads(loop);
  };
  std::ranges::for_each(voices, add);
  std::ranges::for_each(also, add);
  std::erase_if(recent_reads_,
                [this](const auto& one) { return one.second.keyframe + keyframes_ + 2 < played_; });
  std::vector<ReadPosition> read;
  for (const auto& [key, recent] : recent_reads_) read.push_back(read_position(key, recent.power));
  return read;
}

std::vector<ReadPosition> SoundLoader::read_by(std::span<const WantedSound> wanted) const {
  std::unordered_map<std::uint64_t, float> powers;
  for (const WantedSound& one : wanted) {
    const std::int32_t step = step_of(one.delay_s * kSampleRate_hz);
    powers[key_of(one.signal, step)] += one.power;
    if (onset_[one.signal] != one.signal) powers[key_of(onset_[one.signal], step)] += one.power;
  }
  std::vector<ReadPosition> read;
  for (const auto& [key, power] : powers) read.push_back(read_position(key, power));
  return read;
}

bool SoundLoader::is_ready(std::uint32_t signal, double signal_s) const {
  const double frame = signal_s * kSampleRate_hz;
  if (signal >= signals_.size() || !is_in_range(frame)) return true;
  const std::int64_t at = std::llround(frame);
  const auto is_there = [&](std::uint32_t one) {
    return signals_[one].stays_resident(at - kBehind_frames, at + kNow_frames);
  };
  return is_there(signal) && (onset_[signal] == signal || is_there(onset_[signal]));
}

bool SoundLoader::all_ready() const {
  return shared_->all_resident.load(std::memory_order_relaxed);
}

bool SoundLoader::wait(double longest_s) {
  Shared& shared = *shared_;
  if (shared.settled.load(std::memory_order_relaxed)) return true;
  std::unique_lock lock(shared.mutex);
  const auto complete = [&] {
    update_needs();
    return !shared.pieces.lacks_needed_now();
  };
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begun = Clock::now();
  while (shared.threads.empty() && !complete())
    if (!load_next(lock) || Clock::now() - begun > std::chrono::duration<double>(longest_s))
      return complete();
  if (longest_s < std::numeric_limits<double>::infinity())
    return shared.arrival.wait_for(lock, std::chrono::duration<double>(longest_s), complete);
  shared.arrival.wait(lock, complete);
  return true;
}

SoundStatistics SoundLoader::statistics() const {
  const std::lock_guard lock(shared_->mutex);
  SoundStatistics statistics = shared_->pieces.statistics();
  statistics.all_bytes = all_bytes_;
  statistics.budget_bytes = budget_bytes_;
  statistics.handed_over = handed_over_.load(std::memory_order_relaxed);
  return statistics;
}

}  // namespace clamor
