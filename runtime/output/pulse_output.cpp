#include "runtime/output/pulse_output.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

#include <pulse/pulseaudio.h>

#include "runtime/output/audio_thread.h"
#include "runtime/output/buffer_growth.h"
#include "runtime/output/device_selection.h"

namespace clamor {

namespace {

using Clock = std::chrono::steady_clock;

// Time limit for the server's answers, and for playing the rest of the buffer at the end.
constexpr auto kServerPatience = std::chrono::seconds(2);
constexpr auto kFirstLatency = std::chrono::milliseconds(100);
constexpr auto kDrainPatience = std::chrono::milliseconds(500);
constexpr int kPoll_us = 50'000;

constexpr const char* kServerIsGone = "the PulseAudio server has stopped";

// PulseAudio resamples any rate to the sink's; these are the rates worth listing.
constexpr std::array<unsigned, 7> kRates_hz = {8000, 16000, 22050, 32000, 44100, 48000, 96000};

// Up to this many channels use the WAV channel order, whatever the sink's order is.
constexpr int kMaxInWavOrder = 8;

struct Sink {
  std::string name;  // PulseAudio's internal name
  OutputDevice device;
  pa_channel_map map{};
};

struct MainLoopDeleter {
  void operator()(pa_mainloop* loop) const { ::pa_mainloop_free(loop); }
};
struct ContextDeleter {
  void operator()(pa_context* context) const {
    ::pa_context_disconnect(context);
    ::pa_context_unref(context);
  }
};
struct StreamDeleter {
  void operator()(pa_stream* stream) const {
    ::pa_stream_disconnect(stream);
    ::pa_stream_unref(stream);
  }
};

// A client of the server. Its work happens inside wait_until() and iterate().
class Connection {
 public:
  // Null if no server answers in time.
  static std::unique_ptr<Connection> open() {
    std::unique_ptr<Connection> connection(new Connection);
    pa_context* const context = connection->context_.get();
    if (context == nullptr) return nullptr;
    if (::pa_context_connect(context, nullptr, PA_CONTEXT_NOFLAGS, nullptr) < 0) return nullptr;
    const bool ready = connection->wait_until(
        [&] { return ::pa_context_get_state(context) == PA_CONTEXT_READY; }, kServerPatience);
    return ready ? std::move(connection) : nullptr;
  }

  pa_context* context() const { return context_.get(); }
  bool is_good() const { return PA_CONTEXT_IS_GOOD(::pa_context_get_state(context_.get())) != 0; }
  std::string error() const { return ::pa_strerror(::pa_context_errno(context_.get())); }

  // False if the condition does not become true in time or the server is lost.
  template <class Condition>
  bool wait_until(Condition condition, Clock::duration patience) {
    const auto end = Clock::now() + patience;
    while (!condition()) {
      if (Clock::now() > end || !is_good()) return false;
      if (::pa_mainloop_prepare(loop_.get(), kPoll_us) < 0 || ::pa_mainloop_poll(loop_.get()) < 0 ||
          ::pa_mainloop_dispatch(loop_.get()) < 0)
        return false;
    }
    return true;
  }

  // Waits for the server's next message or for wake(). False if the server is lost.
  bool iterate() { return ::pa_mainloop_iterate(loop_.get(), 1, nullptr) >= 0 && is_good(); }
  void wake() { ::pa_mainloop_wakeup(loop_.get()); }

  // The server's sinks with the default marked; empty if it does not answer.
  std::vector<Sink> sinks() {
    struct Answer {
      std::vector<Sink> sinks;
      std::string default_name;
      int pending = 2;
    } answer;
    const auto on_server = [](pa_context*, const pa_server_info* info, void* to) {
      auto& answered = *static_cast<Answer*>(to);
      if (info != nullptr && info->default_sink_name != nullptr)
        answered.default_name = info->default_sink_name;
      --answered.pending;
    };
    const auto on_sink = [](pa_context*, const pa_sink_info* info, int end, void* to) {
      auto& answered = *static_cast<Answer*>(to);
      if (end != 0) {
        --answered.pending;
        return;
      }
      answered.sinks.push_back({info->name,
                                {"pulse",
                                 info->description == nullptr ? info->name : info->description,
                                 info->sample_spec.channels,
                                 {kRates_hz.begin(), kRates_hz.end()},
                                 false},
                                info->channel_map});
    };
    pa_operation* const server = ::pa_context_get_server_info(context_.get(), +on_server, &answer);
    pa_operation* const list = ::pa_context_get_sink_info_list(context_.get(), +on_sink, &answer);
    const bool answered = wait_until([&] { return answer.pending <= 0; }, kServerPatience);
    for (pa_operation* const operation : {server, list}) {
      if (operation == nullptr) continue;
      if (!answered) ::pa_operation_cancel(operation);  // `answer` is about to be destroyed
      ::pa_operation_unref(operation);
    }
    if (!answered) return {};
    std::vector<Sink>& sinks = answer.sinks;
    std::erase_if(sinks, [](const Sink& sink) {
      return sink.device.output_channels < static_cast<int>(kMinChannels);
    });
    for (std::size_t i = 0; i < sinks.size(); ++i) {
      sinks[i].device.is_default = sinks[i].name == answer.default_name;
      const std::string name = sinks[i].device.name;
      int alike = 1;
      for (std::size_t j = i + 1; j < sinks.size(); ++j)
        if (sinks[j].device.name == name) sinks[j].device.name += " #" + std::to_string(++alike);
    }
    return std::move(sinks);
  }

 private:
  Connection()
      : loop_(::pa_mainloop_new()),
        context_(::pa_context_new(::pa_mainloop_get_api(loop_.get()), "clamor")) {}

  std::unique_ptr<pa_mainloop, MainLoopDeleter> loop_;
  std::unique_ptr<pa_context, ContextDeleter> context_;  // destroyed before the loop
};

pa_channel_map map_for(int channels, const pa_channel_map& of_sink) {
  if (channels > kMaxInWavOrder && channels == of_sink.channels) return of_sink;
  pa_channel_map map;
  ::pa_channel_map_init_extend(&map, static_cast<unsigned>(channels), PA_CHANNEL_MAP_WAVEEX);
  if (channels == 8) {  // 7.1; PulseAudio takes the last two for loudspeakers beside the centre
    map.map[6] = PA_CHANNEL_POSITION_SIDE_LEFT;
    map.map[7] = PA_CHANNEL_POSITION_SIDE_RIGHT;
  }
  return map;
}

class PulseOutput final : public AudioOutput {
 public:
  PulseOutput(std::unique_ptr<Connection> connection, Sink sink, const OutputRequest& request,
              int rate_hz, OutputCallback callback)
      : callback_(callback),
        sink_(std::move(sink)),
        format_{request.channels, request.block_frames, rate_hz},
        growth_(request.block_frames, rate_hz, request.buffer_may_grow),
        block_(static_cast<std::size_t>(request.channels) *
               static_cast<std::size_t>(request.block_frames)),
        connection_(std::move(connection)) {}

  ~PulseOutput() override { stop(); }

  Result<void> start() override {
    pa_sample_spec spec{};
    spec.format = PA_SAMPLE_FLOAT32NE;
    spec.rate = static_cast<std::uint32_t>(format_.rate_hz);
    spec.channels = static_cast<std::uint8_t>(format_.channels);
    const pa_channel_map map = map_for(format_.channels, sink_.map);
    stream_.reset(::pa_stream_new(connection_->context(), "clamor", &spec, &map));
    if (stream_ == nullptr) return refused();
    ::pa_stream_set_underflow_callback(
        stream_.get(),
        [](pa_stream*, void* self) { static_cast<PulseOutput*>(self)->on_underflow(); }, this);
    const pa_buffer_attr attributes = buffer_attributes();
    const auto flags = static_cast<pa_stream_flags_t>(
        PA_STREAM_ADJUST_LATENCY | PA_STREAM_INTERPOLATE_TIMING | PA_STREAM_AUTO_TIMING_UPDATE);
    if (::pa_stream_connect_playback(stream_.get(), sink_.name.c_str(), &attributes, flags, nullptr,
                                     nullptr) < 0)
      return refused();
    if (!connection_->wait_until([this] { return is_ready() || !stream_is_good(); },
                                 kServerPatience) ||
        !is_ready())
      return refused();
    write();  // fills the buffer, so that the reported latency is complete
    connection_->wait_until([this] { return tell_latency(); }, kFirstLatency);
    ::pa_stream_set_write_callback(
        stream_.get(),
        [](pa_stream*, std::size_t, void* self) { static_cast<PulseOutput*>(self)->write(); },
        this);
    thread_ = std::thread([this] { run(); });
    return {};
  }

  void stop() override {
    stopping_.store(true);
    connection_->wake();
    if (thread_.joinable()) thread_.join();
    stream_.reset();
  }

  std::string name() const override { return sink_.device.full_name(); }
  int block_frames() const override { return format_.frames; }
  int rate_hz() const override { return format_.rate_hz; }
  double latency_s() const override { return latency_s_.load(std::memory_order_relaxed); }
  std::string failure() const override {
    return failure_.is_set.load(std::memory_order_acquire) ? failure_.text : "";
  }

 private:
  struct Format {
    int channels, frames, rate_hz;  // frames of a block
  };
  // Why the stream ended by itself. Written once, by the stream's thread.
  struct Failure {
    std::string text;
    std::atomic<bool> is_set{false};  // after the text
  };

  Error refused() const {
    return device_error(name(), "does not start (" + connection_->error() + ")");
  }

  // The server requests at least one block at a time.
  pa_buffer_attr buffer_attributes() const {
    const auto bytes = [this](int frames) {
      return static_cast<std::uint32_t>(frames * format_.channels) *
             static_cast<std::uint32_t>(sizeof(float));
    };
    constexpr std::uint32_t kServersChoice = ~std::uint32_t{0};
    return {kServersChoice, bytes(growth_.frames()), kServersChoice, bytes(format_.frames),
            kServersChoice};
  }

  void run() {
    begin_audio_thread();
    write();  // for requests from before the callback was set
    while (!stopping_.load())
      if (!connection_->iterate() || !stream_is_good()) {
        failure_.text = connection_->is_good() ? "the server has closed the stream" : kServerIsGone;
        failure_.is_set.store(true, std::memory_order_release);
        return;
      }
    drain();
  }

  bool is_ready() const { return ::pa_stream_get_state(stream_.get()) == PA_STREAM_READY; }
  bool stream_is_good() const {
    return PA_STREAM_IS_GOOD(::pa_stream_get_state(stream_.get())) != 0;
  }

  // Writes whole blocks, as many as the server has room for.
  void write() noexcept {
    const std::size_t bytes = block_.size() * sizeof(float);
    while (!stopping_.load(std::memory_order_relaxed)) {
      const std::size_t room = ::pa_stream_writable_size(stream_.get());
      if (room == static_cast<std::size_t>(-1) || room < bytes) break;
      callback_.fill(callback_.context, block_.data(), static_cast<std::uint32_t>(format_.frames),
                     std::exchange(ran_dry_, false));
      if (::pa_stream_write(stream_.get(), block_.data(), bytes, nullptr, 0, PA_SEEK_RELATIVE) < 0)
        break;
    }
    tell_latency();
  }

  // False if the server has not reported a latency yet.
  bool tell_latency() noexcept {
    pa_usec_t latency_us = 0;
    int negative = 0;
    if (::pa_stream_get_latency(stream_.get(), &latency_us, &negative) != 0) return false;
    if (negative == 0)
      latency_s_.store(1e-6 * static_cast<double>(latency_us), std::memory_order_relaxed);
    return true;
  }

  void on_underflow() {
    ran_dry_ = true;
    const double now_s = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
    if (!growth_.underflow(now_s)) return;
    const pa_buffer_attr attributes = buffer_attributes();
    if (pa_operation* const operation =
            ::pa_stream_set_buffer_attr(stream_.get(), &attributes, nullptr, nullptr))
      ::pa_operation_unref(operation);
  }

  // Lets the server play what was written, unless it hangs.
  void drain() {
    bool drained = false;
    pa_operation* const operation = ::pa_stream_drain(
        stream_.get(), [](pa_stream*, int, void* to) { *static_cast<bool*>(to) = true; }, &drained);
    if (operation == nullptr) return;
    const auto buffer = std::chrono::milliseconds(1000LL * growth_.frames() / format_.rate_hz);
    connection_->wait_until([&] { return drained; }, buffer + kDrainPatience);
    if (!drained) ::pa_operation_cancel(operation);
    ::pa_operation_unref(operation);
  }

  const OutputCallback callback_;
  const Sink sink_;
  const Format format_;
  std::atomic<bool> stopping_{false};
  Failure failure_;
  std::atomic<double> latency_s_{0};

  // Used by the stream's thread once it runs.
  BufferGrowth growth_;
  bool ran_dry_ = false;
  std::vector<float> block_;
  const std::unique_ptr<Connection> connection_;
  std::unique_ptr<pa_stream, StreamDeleter> stream_;  // destroyed before the connection
  std::thread thread_;
};

}  // namespace

std::vector<OutputDevice> pulse_devices() {
  const auto connection = Connection::open();
  if (connection == nullptr) return {};
  std::vector<OutputDevice> devices;
  for (Sink& sink : connection->sinks()) devices.push_back(std::move(sink.device));
  return devices;
}

std::unique_ptr<AudioOutput> open_pulse(const OutputDevice& device, const OutputRequest& request,
                                        OutputCallback callback, std::string& problem) {
  auto connection = Connection::open();
  if (connection == nullptr) {
    problem = "no PulseAudio server answers";
    return nullptr;
  }
  std::vector<Sink> sinks = connection->sinks();
  const auto found = std::ranges::find_if(
      sinks, [&](const Sink& sink) { return sink.device.name == device.name; });
  if (found == sinks.end()) {
    problem = "it is gone";
    return nullptr;
  }
  const int rate_hz = rates_to_try(device, request.rate_hz).front();
  return std::make_unique<PulseOutput>(std::move(connection), std::move(*found), request, rate_hz,
                                       callback);
}

}  // namespace clamor
