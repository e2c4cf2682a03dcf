#include "runtime/player/player.h"

#include <array>
#include <atomic>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>

#include "common/platform/prefault_code.h"
#include "common/platform/thread.h"
#include "common/sample_rate.h"
#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/heard_source.h"
#include "runtime/engine/solo_settings.h"
#include "runtime/output/loudness_meter.h"
#include "runtime/output/supervised_output.h"
#include "runtime/player/audio_callback.h"
#include "runtime/player/player_options.h"
#include "runtime/player/player_statistics.h"
#include "runtime/player/render.h"
#include "runtime/realtime/latest_value.h"
#include "runtime/realtime/sample_ring.h"
#include "runtime/realtime/thread_cpu_usage.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

constexpr std::size_t kRecordFrames = std::size_t{4} * kSampleRate_hz;
constexpr std::size_t kMeterFrames = kSampleRate_hz;
constexpr auto kSamplerNap = std::chrono::milliseconds(1);
constexpr auto kWriterNap = std::chrono::milliseconds(20);
constexpr auto kFadeNap = std::chrono::milliseconds(5);
// How far ahead a fade is ordered, and what must be left of that when it is.
constexpr std::uint64_t kHandOver_frames = kSampleRate_hz / 10,
                        kMinHandOver_frames = kHandOver_frames / 2;
// At most so much is mixed unheard, in steps.
constexpr std::uint64_t kMaxCatchUp_frames = kSampleRate_hz / 2, kCatchUpStep_frames = 256;
constexpr auto kMaxFade = std::chrono::seconds(2);  // unless the output stands still

// The first frame of a keyframe at or after this one.
std::uint64_t keyframe_after(std::uint64_t frame) {
  return (frame + kKeyframeFrames - 1) / kKeyframeFrames * kKeyframeFrames;
}

double seconds(std::uint64_t frames) { return static_cast<double>(frames) / kSampleRate_hz; }

// An auralizer and the player's time at which it began.
struct Playing {
  std::unique_ptr<Auralizer> auralizer;
  double begun_s = 0;
};

// Writes what is played to a file, on a thread of its own.
class Recording {
 public:
  Recording(WavWriter wav, int channels)
      : ring_(kRecordFrames * static_cast<std::size_t>(channels)), wav_(std::move(wav)) {}

  SampleRing& ring() { return ring_; }

  void start() {
    thread_ = std::jthread([this](const std::stop_token& stop) {
      name_thread("recording");
      while (!stop.stop_requested()) {
        drain();
        std::this_thread::sleep_for(kWriterNap);
      }
    });
  }

  // Writes the rest, once nothing more is played. Further calls do nothing.
  Result<void> finish() {
    thread_ = {};
    if (!wav_) return {};
    drain();
    const auto finished = written_.ok() ? wav_->finish() : written_;
    wav_.reset();
    return finished;
  }

 private:
  void drain() {
    std::array<float, 4800> samples;  // whole frames of 2, 6, 8, 12 or 16 channels
    while (const std::size_t count = ring_.read(samples))
      if (written_.ok()) written_ = wav_->write(std::span(samples).first(count));
  }

  SampleRing ring_;
  std::optional<WavWriter> wav_;
  Result<void> written_;  // used by the thread until it has ended
  std::jthread thread_;   // stopped and joined first
};

// Measures the loudness of what is played.
class LoudnessReading {
 public:
  LoudnessReading(int channels, std::span<const Speaker> speakers,
                  std::function<void(std::span<const float>)> listen)
      : ring_(kMeterFrames * static_cast<std::size_t>(channels)),
        meter_(channels, speakers),
        listen_(std::move(listen)) {}

  SampleRing& ring() { return ring_; }

  // Reads what was played since the last call. Allocates.
  void update() {
    std::array<float, 4800> samples;
    while (const std::size_t count = ring_.read(samples)) {
      meter_.add(std::span(samples).first(count));
      if (listen_) listen_(std::span<const float>(samples).first(count));
      momentary_lufs_.store(meter_.momentary_lufs(), std::memory_order_relaxed);
      short_term_lufs_.store(meter_.short_term_lufs(), std::memory_order_relaxed);
    }
  }

  // Any thread.
  double momentary_lufs() const { return momentary_lufs_.load(std::memory_order_relaxed); }
  double short_term_lufs() const { return short_term_lufs_.load(std::memory_order_relaxed); }

 private:
  SampleRing ring_;
  LoudnessMeter meter_;
  const std::function<void(std::span<const float>)> listen_;  // or empty
  std::atomic<double> momentary_lufs_{-std::numeric_limits<double>::infinity()};
  std::atomic<double> short_term_lufs_{-std::numeric_limits<double>::infinity()};
};

// The positions on a walk are known in advance; the rotations of a listener who moves freely are
// not.
AuralizerOptions tracking_head(AuralizerOptions options, bool on_walk) {
  options.tracks_head = !on_walk;
  return options;
}

}  // namespace

struct Player::State {
  State(std::unique_ptr<Auralizer> from, const PlayerOptions& wanted,
        std::unique_ptr<Recording> made, std::uint64_t frames)
      : options(wanted),
        auralizers(std::move(from)),
        recording(std::move(made)),
        loudness(channels(), wanted.auralizer.output.speakers(), wanted.listen),
        callback(*auralizers.current.auralizer, recording ? &recording->ring() : nullptr, frames,
                 &loudness.ring()),
        moved_to(wanted.listener) {
    auralizers.current.auralizer->stop_when(&stopping);
    listeners.publish(options.listener);
    auralizers.current.auralizer->turn_head(options.listener);
  }

  int channels() const { return auralizers.current.auralizer->channels(); }

  // Makes the keyframe that the auralizer wants now, if any. Returns whether it did.
  bool make_wanted_keyframe(Playing& playing, const Listener& listener) const {
    if (playing.auralizer == nullptr || !playing.auralizer->wants_keyframe()) return false;
    const double time_s = playing.begun_s + playing.auralizer->next_keyframe_time_s();
    playing.auralizer->make_keyframe(options.walk ? options.walk->at(time_s) : listener);
    return true;
  }

  void run_sampler(const std::stop_token& stop) {
    name_thread("sampler");
    while (!stop.stop_requested()) {
      bool was_busy = false;
      {
        const std::lock_guard lock(auralizers.exchange);
        const Listener& listener = listeners.latest();
        const SoloSettings& focus = focuses.latest();
        for (const Playing* const playing : {&auralizers.current, &auralizers.outgoing})
          if (playing->auralizer != nullptr) playing->auralizer->set_focus(focus);
        was_busy = make_wanted_keyframe(auralizers.current, listener);
        was_busy = make_wanted_keyframe(auralizers.outgoing, listener) || was_busy;
      }
      loudness.update();  // even if keyframes are late
      if (!was_busy) std::this_thread::sleep_for(kSamplerNap);
    }
  }

  // Waits for the end of a fade and frees the old auralizer. False if the output stands still and
  // may still mix it.
  bool end_fade() {
    const auto start = std::chrono::steady_clock::now();
    while (!callback.has_faded() && !callback.counters().finished) {
      if (std::chrono::steady_clock::now() - start > kMaxFade) return false;
      std::this_thread::sleep_for(kFadeNap);
    }
    if (!callback.has_faded()) return false;
    const std::lock_guard lock(auralizers.exchange);
    auralizers.outgoing = {};
    return true;
  }

  struct Auralizers {
    explicit Auralizers(std::unique_ptr<Auralizer> first) : current{std::move(first)} {}

    // Held by the sampler while it makes a keyframe, and by the caller while it replaces the
    // auralizer.
    mutable std::mutex exchange;
    Playing current, outgoing;  // outgoing: during a fade
  };

  const PlayerOptions options;
  Auralizers auralizers;
  const std::unique_ptr<Recording> recording;  // or null
  LoudnessReading loudness;                    // updated by the sampler, because it allocates
  AudioCallback callback;
  LatestValue<Listener> listeners;
  LatestValue<SoloSettings> focuses;
  Listener moved_to;   // the last one, for the caller's thread
  SoloSettings focus;  // likewise
  ThreadCpuMeter shares;
  std::atomic<bool> stopping{false};
  std::jthread sampler;
  std::unique_ptr<SupervisedOutput> output;  // destroyed first: its threads use all the others
};

Player::Player(std::unique_ptr<State> state) : state_(std::move(state)) {}

Player::~Player() {
  if (!stop().ok()) return;  // errors of the recording are reported by stop() only
}

Result<std::unique_ptr<Player>> Player::create(std::shared_ptr<const BakeFile> file,
                                               const PlayerOptions& options) {
  return create(Auralizer::create(std::move(file),
                                  tracking_head(options.auralizer, options.walk.has_value())),
                options);
}

Result<std::unique_ptr<Player>> Player::create(AuralizerInput input, const PlayerOptions& options) {
  return create(Auralizer::create(std::move(input),
                                  tracking_head(options.auralizer, options.walk.has_value())),
                options);
}

Result<std::unique_ptr<Player>> Player::create(Result<std::unique_ptr<Auralizer>> auralizer,
                                               const PlayerOptions& options) {
  if (!auralizer.ok()) return auralizer.error();
  const auto frames = static_cast<std::uint64_t>(std::llround(options.seconds * kSampleRate_hz));
  const int channels = (*auralizer)->channels();
  std::unique_ptr<Recording> recording;
  if (!options.record.empty()) {
    auto wav = WavWriter::create(options.record, channels, kSampleRate_hz, options.record_format,
                                 options.auralizer.output.speakers(), Appearance::kAtOnce);
    if (!wav.ok()) return wav.error();
    recording = std::make_unique<Recording>(std::move(*wav), channels);
  }
  auto state =
      std::make_unique<State>(std::move(*auralizer), options, std::move(recording), frames);
  const OutputCallback callback{
      [](void* context, float* output, std::uint32_t block_frames, bool) noexcept {
        auto& audio = *static_cast<AudioCallback*>(context);
        audio.fill({output, block_frames * audio.channels()});
      },
      &state->callback};
  const OutputRequest request{options.device, channels, options.block_frames,
                              options.device_rate_hz, options.buffer_may_grow};
  auto output =
      SupervisedOutput::open(options.driver ? options.driver : sound_devices(), request, callback);
  if (!output.ok()) return output.error();
  state->output = std::move(*output);
  return std::unique_ptr<Player>(new Player(std::move(state)));
}

Result<void> Player::start() {
  prefault_code();
  // The first block finds all keyframes that it needs.
  while (state_->make_wanted_keyframe(state_->auralizers.current, state_->moved_to)) {
  }
  state_->shares = ThreadCpuMeter();
  state_->sampler =
      std::jthread([this](const std::stop_token& stop) { state_->run_sampler(stop); });
  if (state_->recording) state_->recording->start();
  state_->output->start();
  return {};
}

std::vector<ThreadCpuUsage> Player::thread_shares() const { return state_->shares.now(); }

void Player::move(const Listener& listener) {
  state_->moved_to = listener;
  state_->listeners.publish(listener);
  state_->auralizers.current.auralizer->turn_head(listener);
}

Player::Prepared::Prepared(std::unique_ptr<Auralizer> made, std::uint64_t frame)
    : auralizer(std::move(made)), begins_at_frame(frame) {}
Player::Prepared::~Prepared() = default;

Result<std::unique_ptr<Player::Prepared>> Player::prepare(std::shared_ptr<const BakeFile> file,
                                                          AuralizerOptions options,
                                                          const Listener& listener) const {
  const auto& walk = state_->options.walk;
  const std::uint64_t begin = keyframe_after(state_->callback.counters().frames);
  options.begins_s = seconds(begin);
  auto next = Auralizer::create(std::move(file), tracking_head(options, walk.has_value()));
  if (!next.ok()) return next.error();
  assert((*next)->channels() == state_->channels());
  (*next)->warm_up(walk ? walk->at(options.begins_s) : listener);
  return std::make_unique<Prepared>(std::move(*next), begin);
}

Result<void> Player::replace(std::unique_ptr<Prepared> prepared) {
  State& state = *state_;
  if (!state.end_fade())
    return Error("the sound output stands still, so another bake cannot be faded in. Try again.");
  Playing incoming{std::move(prepared->auralizer), seconds(prepared->begins_at_frame)};
  incoming.auralizer->turn_head(state.moved_to);
  incoming.auralizer->stop_when(&state.stopping);
  incoming.auralizer->set_focus(state.focus);
  const auto played = [&] { return state.callback.counters().frames; };
  std::uint64_t from_frame = keyframe_after(played() + kHandOver_frames);
  incoming.auralizer->skip(from_frame - prepared->begins_at_frame);
  const auto make_keyframes = [&] {
    while (state.make_wanted_keyframe(incoming, state.moved_to)) {
    }
  };
  make_keyframes();
  // Where that took too long, it mixes what was played meanwhile, which nobody hears. A machine
  // that mixes slower than it plays would never be done.
  std::vector<float> passed(kCatchUpStep_frames * static_cast<std::size_t>(state.channels()));
  const std::uint64_t last_frame = from_frame + kMaxCatchUp_frames;
  while (from_frame < std::min(played() + kMinHandOver_frames, last_frame)) {
    incoming.auralizer->mix(passed);
    from_frame += kCatchUpStep_frames;
    make_keyframes();
  }
  {
    const std::lock_guard lock(state.auralizers.exchange);
    state.auralizers.outgoing = std::exchange(state.auralizers.current, std::move(incoming));
  }
  state.callback.fade_to(*state.auralizers.current.auralizer, from_frame);
  return {};
}

Result<void> Player::replace(std::shared_ptr<const BakeFile> file,
                             const AuralizerOptions& options) {
  auto prepared = prepare(std::move(file), options, state_->moved_to);
  if (!prepared.ok()) return prepared.error();
  if (auto replaced = replace(std::move(*prepared)); !replaced.ok()) return replaced;
  (void)state_->end_fade();  // if the output stands still, the next call frees the old auralizer
  return {};
}

void Player::set_focus(const SoloSettings& focus) {
  state_->focus = focus;
  state_->focuses.publish(focus);
}

void Player::copy_heard(std::vector<HeardSource>& heard) const {
  const std::lock_guard lock(state_->auralizers.exchange);
  const auto newest = state_->auralizers.current.auralizer->newest_sample();
  heard.assign(newest.begin(), newest.end());
}

void Player::change(const std::function<void(Auralizer& playing)>& act) {
  const std::lock_guard lock(state_->auralizers.exchange);
  act(*state_->auralizers.current.auralizer);
}

bool Player::finished() const { return state_->callback.counters().finished; }

PlayerStatistics Player::statistics() {
  const auto counters = state_->callback.counters();
  PlayerStatistics statistics;
  statistics.auralizer = state_->auralizers.current.auralizer->statistics();
  statistics.output = state_->output->statistics();
  statistics.time_s = static_cast<double>(counters.frames) / kSampleRate_hz;
  statistics.dropped_samples = state_->recording ? state_->recording->ring().dropped() : 0;
  statistics.momentary_lufs = state_->loudness.momentary_lufs();
  statistics.short_term_lufs = state_->loudness.short_term_lufs();
  return statistics;
}

Result<void> Player::stop() {
  state_->output->stop();
  state_->sampler.request_stop();
  state_->stopping = true;
  if (state_->sampler.joinable()) state_->sampler.join();
  return state_->recording ? state_->recording->finish() : Result<void>();
}

}  // namespace clamor
