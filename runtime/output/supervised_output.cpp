#include "runtime/output/supervised_output.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "common/platform/thread.h"
#include "runtime/output/output_stream.h"

namespace clamor {

namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::milliseconds;

constexpr auto kLook = Milliseconds(10);
constexpr auto kFirstOpening = std::chrono::seconds(5);  // before the clock starts without a device

// A device that requests no sound for this long is lost. Busy machines have been seen to take 0.2
// s.
constexpr auto kSilence = Milliseconds(500);
constexpr int kSilentBlocks = 4;

// Pause between two attempts to open a device.
constexpr auto kFirstPause = Milliseconds(100), kMaxPause = Milliseconds(500);
// After playing this long, a device is reopened without delay.
constexpr auto kProven = std::chrono::seconds(2);

// If the default device is not back after this time, the new default may play instead.
constexpr auto kFaithful = std::chrono::seconds(5);

double seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

// Takes blocks by the computer's clock, in the place of a device.
struct FallbackClock {
  FallbackClock(const std::shared_ptr<CallbackGate>& gate, std::uint32_t id,
                const OutputRequest& request)
      : feed(gate, id, request.channels),
        output(silent_output(request.channels, request.block_frames, feed.callback())) {}

  DeviceFeed feed;
  const std::unique_ptr<AudioOutput> output;
};

// The device that plays, and when it last asked for sound.
class PlayingStream {
 public:
  explicit PlayingStream(OutputStream stream)
      : stream_(std::move(stream)),
        begun_at_(Clock::now()),
        callbacks_(stream_.feed->callbacks()),
        called_at_(begun_at_) {}

  const OutputStream& stream() const { return stream_; }
  OutputStream take() { return std::move(stream_); }
  bool is_proven() const { return Clock::now() - begun_at_ > kProven; }

  // The problem of the device, or an empty string.
  std::string trouble() {
    if (std::string said = stream_.output->failure(); !said.empty()) return said;
    if (stream_.feed->ran_away()) return "it asks for sound faster than time goes";
    const std::uint64_t callbacks = stream_.feed->callbacks();
    const auto now = Clock::now();
    if (callbacks != callbacks_) {
      callbacks_ = callbacks;
      called_at_ = now;
      return "";
    }
    const double limit_s =
        seconds(kSilence) + kSilentBlocks * static_cast<double>(stream_.feed->block_frames()) /
                                stream_.output->rate_hz();
    return seconds(now - called_at_) > limit_s ? "it asks for no more sound" : "";
  }

 private:
  OutputStream stream_;
  Clock::time_point begun_at_;
  std::uint64_t callbacks_;  // so far
  Clock::time_point called_at_;
};

// The device that is to play next. Attempts to open one are further and further apart.
struct NextDevice {
  std::future<OpenedStream> opening;
  std::optional<OutputStream> candidate;  // opened, and has not called back twice
  Clock::time_point candidate_at, next_attempt;
  Milliseconds pause = kFirstPause;

  void lengthen_pause() { pause = std::min<Milliseconds>(2 * pause, kMaxPause); }
};

// The device that played last.
struct LastDevice {
  std::optional<OutputDevice> device;
  Clock::time_point lost_at;
};

// Statistics, and since when there has been no device.
struct OutputRecord {
  OutputStatistics statistics;
  std::optional<Clock::time_point> without_since;  // while the clock replaces a device

  OutputStatistics now() const {
    OutputStatistics now = statistics;
    if (!without_since) return now;
    now.without_device_now_s = seconds(Clock::now() - *without_since);
    now.without_device_s += now.without_device_now_s;
    now.longest_without_s = std::max(now.longest_without_s, now.without_device_now_s);
    return now;
  }

  // Ends a period without a device and adds its length.
  void end_of_silence() {
    statistics = now();
    statistics.without_device_now_s = 0;
    without_since.reset();
  }
};

}  // namespace

struct SupervisedOutput::State {
  State(std::shared_ptr<OutputDriver> from, const OutputRequest& wanted, OutputCallback callback)
      : driver(std::move(from)),
        request(wanted),
        gate(std::make_shared<CallbackGate>(callback)),
        clock(gate, ++last_id, wanted) {
    const AudioOutput& output = *clock.output;
    // Cannot fail without a resampler.
    if (!clock.feed.prepare(output.rate_hz(), output.block_frames()).ok()) return;
    record.statistics.rate_hz = output.rate_hz();
    record.statistics.block_frames = output.block_frames();
    record.statistics.device = output.name();
  }

  bool wants_device() const { return request.device != "none"; }

  void begin_opening() {
    next.opening = clamor::begin_opening(driver, {request, playable_again(), gate, ++last_id});
  }

  // The device to reopen: the lost one, unless it was a default device that has been gone for long.
  std::optional<OutputDevice> playable_again() const {
    if (!last.device) return {};
    const bool named = !request.device.empty();
    return named || Clock::now() - last.lost_at < kFaithful ? last.device : std::nullopt;
  }

  void supervise(const std::stop_token& stop) {
    name_thread("supervisor");
    std::mutex nothing;
    std::condition_variable_any woken;
    std::unique_lock lock(nothing);
    for (;;) {
      woken.wait_for(lock, stop, kLook, [] { return false; });
      if (stop.stop_requested()) break;
      if (playing)
        watch();
      else if (wants_device())
        try_again();
    }
  }

  void watch() {
    if (const std::string why = playing->trouble(); !why.empty()) {
      lose(why);
      return;
    }
    const OutputStream& stream = playing->stream();
    const std::lock_guard lock(mutex);
    record.statistics.block_frames = static_cast<int>(stream.feed->block_frames());
    if (const double latency_s = stream.output->latency_s(); latency_s > 0)
      record.statistics.latency_s = latency_s;
    record.statistics.hung_closings = closing.hung(kPatience);
  }

  void lose(const std::string& why) {
    clock.feed.fade_in();
    play_clock();
    if (playing->is_proven()) next.pause = kFirstPause;
    closing.close(playing->take());
    playing.reset();
    const auto now = Clock::now();
    next.next_attempt = now + next.pause;
    last.lost_at = now;
    const std::lock_guard lock(mutex);
    ++record.statistics.losses;
    record.statistics.has_device = false;
    record.statistics.problem = why;
    record.without_since = now;
  }

  void play_clock() {
    gate->give_to(clock.feed.id());
    (void)clock.output->start();  // cannot fail
  }

  void try_again() {
    const auto now = Clock::now();
    {
      const std::lock_guard lock(mutex);
      record.statistics.hung_closings = closing.hung(kPatience);
    }
    if (next.candidate) {
      // A device must call back twice before it takes over from the clock.
      if (next.candidate->feed->callbacks() >= 2)
        adopt();
      else if (now - next.candidate_at > kSilence || !next.candidate->output->failure().empty())
        reject("it asks for no sound");
      return;
    }
    if (next.opening.valid()) {
      if (next.opening.wait_for(Milliseconds(0)) != std::future_status::ready) return;
      receive(next.opening.get());
      return;
    }
    if (now >= next.next_attempt) begin_opening();
  }

  void receive(OpenedStream opened) {
    if (opened.failure != OpenedStream::Failure::kNone) return count_failure(opened.problem);
    next.candidate = std::move(opened.stream);
    next.candidate_at = Clock::now();
  }

  void reject(const std::string& why) {
    closing.close(std::move(*next.candidate));
    next.candidate.reset();
    count_failure(why);
  }

  void count_failure(const std::string& why) {
    next.lengthen_pause();
    next.next_attempt = Clock::now() + next.pause;
    const std::lock_guard lock(mutex);
    ++record.statistics.failed_openings;
    record.statistics.problem = record.statistics.opening_problem = why;
  }

  // Hands over from the clock to the device that has been opened.
  void adopt() {
    next.candidate->feed->fade_in();
    play_candidate();
    clock.output->stop();
    next.lengthen_pause();  // until it has played for kProven
    const std::lock_guard lock(mutex);
    ++record.statistics.reopenings;
    record.end_of_silence();
  }

  void play_candidate() {
    playing.emplace(std::move(*next.candidate));
    next.candidate.reset();
    const OutputStream& stream = playing->stream();
    last.device = stream.device;
    {
      const std::lock_guard lock(mutex);
      record.statistics.has_device = true;
      describe(stream);
      record.statistics.block_frames = static_cast<int>(stream.feed->block_frames());
    }
    gate->give_to(stream.feed->id());
  }

  // The mutex must be held, or no thread run.
  void describe(const OutputStream& stream) {
    OutputStatistics& statistics = record.statistics;
    statistics.device = stream.output->name();
    statistics.rate_hz = stream.output->rate_hz();
    statistics.block_frames = stream.output->block_frames();
    statistics.resamples = stream.feed->resamples();
    statistics.latency_s = stream.output->latency_s();
  }

  const std::shared_ptr<OutputDriver> driver;
  const OutputRequest request;
  const std::shared_ptr<CallbackGate> gate;
  std::uint32_t last_id = 0;  // of a feed
  StreamClosing closing;
  FallbackClock clock;

  // Used by the supervisor thread while it runs.
  std::optional<PlayingStream> playing;
  NextDevice next;
  LastDevice last;

  mutable std::mutex mutex;  // guards the record
  OutputRecord record;

  std::jthread supervisor;
};

SupervisedOutput::SupervisedOutput(std::unique_ptr<State> state) : state_(std::move(state)) {}
SupervisedOutput::~SupervisedOutput() { stop(); }

Result<std::unique_ptr<SupervisedOutput>> SupervisedOutput::open(
    std::shared_ptr<OutputDriver> driver, const OutputRequest& request, OutputCallback callback) {
  auto state = std::make_unique<State>(std::move(driver), request, callback);
  if (state->wants_device()) {
    state->begin_opening();
    NextDevice& next = state->next;
    if (next.opening.wait_for(kFirstOpening) == std::future_status::ready) {
      OpenedStream done = next.opening.get();
      if (done.failure == OpenedStream::Failure::kNoSuchDevice) return Error(done.problem);
      state->receive(std::move(done));
      if (next.candidate) state->describe(*next.candidate);
    } else {
      state->record.statistics.problem = "it has not answered";
    }
  }
  return std::unique_ptr<SupervisedOutput>(new SupervisedOutput(std::move(state)));
}

void SupervisedOutput::start() {
  State& state = *state_;
  if (state.supervisor.joinable()) return;
  state.last.lost_at = Clock::now();
  if (state.next.candidate) {
    state.play_candidate();
  } else {
    if (state.wants_device()) state.record.without_since = state.last.lost_at;
    state.play_clock();
  }
  state.supervisor = std::jthread([&state](const std::stop_token& stop) { state.supervise(stop); });
}

void SupervisedOutput::stop() {
  State& state = *state_;
  state.supervisor.request_stop();
  if (state.supervisor.joinable()) state.supervisor.join();
  state.gate->give_to(0);
  state.clock.output->stop();
  state.next.opening = {};
  if (state.playing) state.closing.close(state.playing->take());
  state.playing.reset();
  if (state.next.candidate) state.closing.close(std::move(*state.next.candidate));
  state.next.candidate.reset();
  state.closing.wait_for(kPatience);
  const std::lock_guard lock(state.mutex);
  state.record.statistics.hung_closings = state.closing.hung(Milliseconds(0));
  state.record.end_of_silence();
}

OutputStatistics SupervisedOutput::statistics() const {
  const std::lock_guard lock(state_->mutex);
  OutputStatistics statistics = state_->record.now();
  statistics.callbacks = state_->gate->counters();
  return statistics;
}

}  // namespace clamor
