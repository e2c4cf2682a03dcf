#include "runtime/output/supervised_output.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "runtime/output/output_stream.h"
#include "runtime/realtime/thread_cpu_usage.h"

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

}  // namespace

struct SupervisedOutput::State {
  State(std::shared_ptr<OutputDriver> from, const OutputRequest& wanted, OutputCallback callback)
      : driver(std::move(from)),
        request(wanted),
        gate(std::make_shared<CallbackGate>(callback)),
        clock_feed(gate, ++last_id, wanted.channels),
        clock(silent_output(wanted.channels, wanted.block_frames, clock_feed.callback())) {
    // Cannot fail without a resampler.
    if (!clock_feed.prepare(clock->rate_hz(), clock->block_frames()).ok()) return;
    figures.rate_hz = clock->rate_hz();
    figures.block_frames = clock->block_frames();
    figures.device = clock->name();
  }

  bool wants_device() const { return request.device != "none"; }

  void begin_opening() {
    opening = std::make_unique<StreamOpening>(
        driver, StreamRequest{request, playable_again(), gate, ++last_id});
  }

  // The device to reopen: the lost one, unless it was a default device that has been gone for long.
  std::optional<OutputDevice> playable_again() const {
    if (!known) return {};
    const bool named = !request.device.empty();
    return named || Clock::now() - lost_at < kFaithful ? known : std::nullopt;
  }

  void supervise() {
    name_thread("supervisor");
    std::unique_lock lock(mutex);
    while (!stopping) {
      woken.wait_for(lock, kLook, [this] { return stopping; });
      if (stopping) break;
      lock.unlock();
      if (playing)
        watch();
      else if (wants_device())
        try_again();
      lock.lock();
    }
  }

  // The problem of the device that plays, or an empty string.
  std::string trouble() {
    if (std::string said = playing->output->failure(); !said.empty()) return said;
    if (playing->feed->ran_away()) return "it asks for sound faster than time goes";
    const std::uint64_t callbacks = playing->feed->callbacks();
    const auto now = Clock::now();
    if (callbacks != heard_callbacks) {
      heard_callbacks = callbacks;
      heard_at = now;
      return "";
    }
    const double limit_s =
        seconds(kSilence) +
        kSilentBlocks * static_cast<double>(playing->feed->block_frames()) / figures.rate_hz;
    return seconds(now - heard_at) > limit_s ? "it asks for no more sound" : "";
  }

  void watch() {
    if (const std::string why = trouble(); !why.empty()) {
      lose(why);
      return;
    }
    const std::lock_guard lock(mutex);
    figures.block_frames = static_cast<int>(playing->feed->block_frames());
    if (const double latency_s = playing->output->latency_s(); latency_s > 0)
      figures.latency_s = latency_s;
    figures.hung_closings = closing.hung(kPatience);
  }

  void lose(const std::string& why) {
    play_clock();
    closing.close(std::move(*playing));
    playing.reset();
    const auto now = Clock::now();
    if (now - found_at > kProven) pause = kFirstPause;
    next_attempt = now + pause;
    lost_at = now;
    const std::lock_guard lock(mutex);
    ++figures.losses;
    figures.has_device = false;
    figures.problem = why;
    without_since = now;
  }

  void play_clock() {
    clock_feed.fade_in();
    gate->give_to(clock_feed.id());
    if (!clock->start().ok()) return;  // cannot fail
  }

  void try_again() {
    const auto now = Clock::now();
    {
      const std::lock_guard lock(mutex);
      figures.hung_closings = closing.hung(kPatience);
    }
    if (candidate) {
      // A device must call back twice before it takes over from the clock.
      if (candidate->feed->callbacks() >= 2)
        adopt();
      else if (now - candidate_at > kSilence || !candidate->output->failure().empty())
        reject("it asks for no sound");
      return;
    }
    if (opening) {
      if (!opening->wait_for(Milliseconds(0))) return;
      const auto done = std::move(opening);
      if (done->failure() == StreamOpening::Failure::kNone) {
        candidate = done->take();
        candidate_at = now;
      } else {
        count_failure(done->problem());
      }
      return;
    }
    if (now >= next_attempt) begin_opening();
  }

  void reject(const std::string& why) {
    closing.close(std::move(*candidate));
    candidate.reset();
    count_failure(why);
  }

  void count_failure(const std::string& why) {
    pause = std::min<Milliseconds>(2 * pause, kMaxPause);
    next_attempt = Clock::now() + pause;
    const std::lock_guard lock(mutex);
    ++figures.failed_openings;
    figures.problem = figures.opening_problem = why;
  }

  // Hands over from the clock to the device that has been opened.
  void adopt() {
    candidate->feed->fade_in();
    play(std::move(*candidate));
    candidate.reset();
    clock->stop();
    pause = std::min<Milliseconds>(2 * pause, kMaxPause);  // until it has played for kProven
    const std::lock_guard lock(mutex);
    ++figures.reopenings;
    end_of_silence();
  }

  // Ends a period without a device and adds its length. The mutex must be held.
  void end_of_silence() {
    figures = with_silence_until_now();
    figures.without_device_now_s = 0;
    without_since.reset();
  }

  // The mutex must be held.
  OutputStatistics with_silence_until_now() const {
    OutputStatistics now = figures;
    if (!without_since) return now;
    now.without_device_now_s = seconds(Clock::now() - *without_since);
    now.without_device_s += now.without_device_now_s;
    now.longest_without_s = std::max(now.longest_without_s, now.without_device_now_s);
    return now;
  }

  void play(OutputStream stream) {
    known = stream.device;
    found_at = heard_at = Clock::now();
    heard_callbacks = stream.feed->callbacks();
    {
      const std::lock_guard lock(mutex);
      figures.has_device = true;
      figures.device = stream.output->name();
      figures.rate_hz = stream.output->rate_hz();
      figures.block_frames = static_cast<int>(stream.feed->block_frames());
      figures.resamples = stream.feed->resamples();
      figures.latency_s = stream.output->latency_s();
    }
    playing = std::move(stream);
    gate->give_to(playing->feed->id());
  }

  const std::shared_ptr<OutputDriver> driver;
  const OutputRequest request;
  const std::shared_ptr<CallbackGate> gate;
  std::uint32_t last_id = 0;
  StreamClosing closing;
  DeviceFeed clock_feed;
  const std::unique_ptr<AudioOutput> clock;

  // Used by the supervisor thread while it runs.
  std::optional<OutputStream> playing, candidate;
  std::unique_ptr<StreamOpening> opening;
  std::optional<OutputDevice> known;  // the device that played last
  std::uint64_t heard_callbacks = 0;
  Clock::time_point heard_at, found_at, lost_at, candidate_at, next_attempt;
  Milliseconds pause = kFirstPause;

  mutable std::mutex mutex;  // guards everything below
  std::condition_variable woken;
  bool stopping = false;
  OutputStatistics figures;
  std::optional<Clock::time_point> without_since;  // while the clock replaces a device

  std::thread supervisor;
};

SupervisedOutput::SupervisedOutput(std::unique_ptr<State> state) : state_(std::move(state)) {}
SupervisedOutput::~SupervisedOutput() { stop(); }

Result<std::unique_ptr<SupervisedOutput>> SupervisedOutput::open(
    std::shared_ptr<OutputDriver> driver, const OutputRequest& request, OutputCallback callback) {
  auto state = std::make_unique<State>(std::move(driver), request, callback);
  if (state->wants_device()) {
    state->begin_opening();
    if (state->opening->wait_for(kFirstOpening)) {
      const auto done = std::move(state->opening);
      if (done->failure() == StreamOpening::Failure::kNoSuchDevice) return Error(done->problem());
      if (done->failure() == StreamOpening::Failure::kNone) {
        state->candidate = done->take();
        state->figures.device = state->candidate->output->name();
        state->figures.rate_hz = state->candidate->output->rate_hz();
        state->figures.block_frames = state->candidate->output->block_frames();
        state->figures.resamples = state->candidate->feed->resamples();
        state->figures.latency_s = state->candidate->output->latency_s();
      } else {
        state->count_failure(done->problem());
      }
    } else {
      state->figures.problem = "it has not answered";
    }
  }
  return std::unique_ptr<SupervisedOutput>(new SupervisedOutput(std::move(state)));
}

void SupervisedOutput::start() {
  State& state = *state_;
  if (state.supervisor.joinable()) return;
  state.lost_at = Clock::now();
  state.stopping = false;
  if (state.candidate) {
    state.play(std::move(*state.candidate));
    state.candidate.reset();
  } else {
    if (state.wants_device()) state.without_since = state.lost_at;
    state.gate->give_to(state.clock_feed.id());
    if (!state.clock->start().ok()) return;  // cannot fail
  }
  state.supervisor = std::thread([&state] { state.supervise(); });
}

void SupervisedOutput::stop() {
  State& state = *state_;
  {
    const std::lock_guard lock(state.mutex);
    state.stopping = true;
    state.woken.notify_all();
  }
  if (state.supervisor.joinable()) state.supervisor.join();
  state.gate->give_to(0);
  state.clock->stop();
  state.opening.reset();
  for (std::optional<OutputStream>* stream : {&state.playing, &state.candidate})
    if (*stream) {
      state.closing.close(std::move(**stream));
      stream->reset();
    }
  state.closing.wait_for(kPatience);
  const std::lock_guard lock(state.mutex);
  state.figures.hung_closings = state.closing.hung(Milliseconds(0));
  state.end_of_silence();
}

OutputStatistics SupervisedOutput::statistics() const {
  const std::lock_guard lock(state_->mutex);
  OutputStatistics figures = state_->with_silence_until_now();
  figures.callbacks = state_->gate->counters();
  return figures;
}

}  // namespace clamor
