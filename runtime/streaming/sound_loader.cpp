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

// The emitters' signals and delays, whether or not a voice plays them.
std::vector<ReadPosition> emitted_by(std::span<const Emitter> emitters) {
  std::unordered_map<std::uint64_t, float> powers;
  for (const Emitter& emitter : emitters)
    powers[key_of(emitter.signal, step_of(emitter.delay_s * kSampleRate_hz))] +=
        static_cast<float>(emitter.gain * emitter.gain);
  std::vector<ReadPosition> emitted;
  for (const auto& [key, power] : powers) emitted.push_back(read_position(key, power));
  return emitted;
}

float power_of(const Voice& voice) {
  float power = 0;
  for (const Bands& ear : voice.gain)
    for (const float gain : ear) power += gain * gain;
  return power;
}

// Number of decoded blocks that the budget has room for.
std::uint64_t blocks_kept(const std::vector<SignalDescription>& shapes, const SoundBudget& budget) {
  const bool any_long = std::any_of(
      shapes.begin(), shapes.end(),
      [](const SignalDescription& shape) { return shape.frames > kMaxWholeSignal_frames; });
  return any_long ? std::min(kMaxKeptBlocks, budget.bytes / 8 / SignalBlockCache::kBlockBytes) : 0;
}

}  // namespace

// State shared by the sampler and the loader threads. The mutex guards everything unless noted.
struct SoundLoader::Shared {
  Shared(std::span<PreparedSignal> signals, SignalBlockCache::Decode decode, std::uint64_t kept,
         const SoundBudget& budget, const std::atomic<std::uint64_t>& quiescent_points)
      : blocks(std::move(decode), static_cast<std::size_t>(kept)),
        pieces(signals, {budget.bytes - kept * SignalBlockCache::kBlockBytes, budget.strict},
               quiescent_points) {}

  SignalBlockCache blocks;           // has its own mutex
  std::atomic<bool> settled{false};  // every piece is resident or has failed
  std::mutex mutex;
  std::condition_variable work, arrival;
  bool closing = false;
  SoundResidency pieces;
  std::vector<ReadPosition> read, emitted;
  std::int64_t ahead_frames = 0;
  std::vector<std::thread> threads;
};

std::uint64_t SoundLoader::bytes_of(const std::vector<SignalDescription>& shapes,
                                    const MixMode& mode) {
  std::uint64_t bytes = 0;
  for (const SignalDescription& shape : shapes)
    bytes += PreparedSignal(shape.frames, shape.loop, mode).memory_bytes();
  return bytes;
}

SoundLoader::SoundLoader(const std::vector<SignalDescription>& shapes,
                         std::span<const Emitter> emitters, const MixMode& mode,
                         SignalBlockCache::Decode decode, const SoundBudget& budget,
                         std::size_t keyframes, int threads, const ThreadHooks& hooks)
    : keyframes_(keyframes), budget_bytes_(budget.bytes) {
  std::size_t bytes = 0;
  continuation_.resize(shapes.size());
  std::iota(continuation_.begin(), continuation_.end(), 0u);
  for (std::uint32_t s = 0; s < shapes.size(); ++s)
    if (shapes[s].onset < shapes.size()) continuation_[shapes[s].onset] = s;
  for (const SignalDescription& shape : shapes) {
    signals_.emplace_back(shape.frames, shape.loop, mode, shape.mean_square);
    bytes += signals_.back().memory_bytes();
  }
  memory_ = std::make_shared<SoundMemory>(bytes);
  bytes = 0;
  for (PreparedSignal& signal : signals_) {
    signal.use_memory(memory_, bytes);
    bytes += signal.memory_bytes();
  }
  shared_ = std::make_unique<Shared>(signals_, std::move(decode), blocks_kept(shapes, budget),
                                     budget, quiescent_points_);
  shared_->emitted = emitted_by(emitters);
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

bool SoundLoader::load_next() {
  std::unique_lock lock(shared_->mutex);
  return load_next(lock);
}

bool SoundLoader::load_next(std::unique_lock<std::mutex>& lock) {
  Shared& shared = *shared_;
  shared.pieces.free_evicted();
  shared.pieces.update_needs(shared.read, shared.emitted, clock_.load(std::memory_order_relaxed),
                             shared.ahead_frames);
  SoundResidency::Piece* const piece = shared.pieces.next_to_load();
  if (piece == nullptr) {
    shared.settled = shared.pieces.all_settled();
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

void SoundLoader::play(std::span<const Voice> voices) {
  ++played_;
  if (shared_->settled.load(std::memory_order_relaxed)) return;
  constexpr double kMaxSignal_frames = 1 << 30;  // six hours: sounds of levels begin earlier
  for (const Voice& voice : voices) {
    if (voice.signal >= signals_.size()) continue;  // in a slot, and in memory
    double min_frames = std::min(voice.delay_frames[0], voice.delay_frames[1]);
    double max_frames = std::max(voice.delay_frames[0], voice.delay_frames[1]);
    if (voice.starts) {
      min_frames = std::min({min_frames, voice.start_delay_frames[0], voice.start_delay_frames[1]});
      max_frames = std::max({max_frames, voice.start_delay_frames[0], voice.start_delay_frames[1]});
    }
    if (!(min_frames > -kMaxSignal_frames && max_frames < kMaxSignal_frames)) continue;
    const float power = power_of(voice);
    const auto reads = [&](std::uint32_t signal) {
      for (std::int32_t step = step_of(min_frames); step <= step_of(max_frames); ++step) {
        RecentRead& recent = recent_reads_[key_of(signal, step)];
        recent.power = recent.keyframe == played_ ? recent.power + power : power;
        recent.keyframe = played_;
      }
    };
    reads(voice.signal);
    if (const std::uint32_t loop = continuation_[voice.signal]; loop != voice.signal) reads(loop);
  }
  std::vector<ReadPosition> read;
  std::erase_if(recent_reads_,
                [this](const auto& one) { return one.second.keyframe + keyframes_ + 2 < played_; });
  for (const auto& [key, recent] : recent_reads_) read.push_back(read_position(key, recent.power));
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->read = std::move(read);
  }
  shared_->work.notify_all();
}

bool SoundLoader::wait(double longest_s) {
  Shared& shared = *shared_;
  if (shared.settled.load(std::memory_order_relaxed)) return true;
  std::unique_lock lock(shared.mutex);
  const auto complete = [&] {
    shared.pieces.update_needs(shared.read, shared.emitted, clock_.load(std::memory_order_relaxed),
                               shared.ahead_frames);
    return !shared.pieces.lacks_needed_now();
  };
  while (shared.threads.empty() && !complete())
    if (!load_next(lock)) return false;
  if (longest_s < std::numeric_limits<double>::infinity())
    return shared.arrival.wait_for(lock, std::chrono::duration<double>(longest_s), complete);
  shared.arrival.wait(lock, complete);
  return true;
}

SoundStatistics SoundLoader::statistics() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->pieces.statistics();
}

}  // namespace clamor
