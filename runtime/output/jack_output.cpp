#include "runtime/output/jack_output.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include <jack/jack.h>

#include "common/platform/signals.h"
#include "common/platform/thread.h"
#include "runtime/output/audio_thread.h"
#include "runtime/output/device_selection.h"

namespace clamor {

namespace {

// Requested at once; no JACK server has larger blocks.
constexpr std::size_t kMaxPeriod_frames = 8192;

// Serialises the use of libjack. The library maps the memory of one server for the whole process
// and replaces the mapping when a client opens on another server. A client left over from a dead
// server must be closed before that and not during it, or the process crashes.
//
// libjack writes to its server, which may be gone. It blocks the signal of that in the thread that
// opens its first client, but not where another thread opens, uses or closes one: so each of these
// calls block_broken_pipes().
struct Library {
  std::mutex calls;          // serialises opening and closing
  std::atomic<int> dead{0};  // clients to be closed whose server has stopped
};
Library& library() {
  static auto* const one = new Library;  // never destroyed: threads that hang may still use it
  return *one;
}

constexpr auto kPatience = std::chrono::milliseconds(500), kPause = std::chrono::milliseconds(5);

struct Closing {
  void operator()(jack_client_t* client) const {
    block_broken_pipes();
    const std::lock_guard lock(library().calls);
    ::jack_deactivate(client);
    ::jack_client_close(client);
  }
};
using Client = std::unique_ptr<jack_client_t, Closing>;

// Null if no server answers, or if a client of the last server is not closed in time.
Client connect(const char* name) {
  block_broken_pipes();
  // libjack would report to standard error everything that it does not find.
  ::jack_set_error_function([](const char*) {});
  ::jack_set_info_function([](const char*) {});
  const auto end = std::chrono::steady_clock::now() + kPatience;
  do {
    const std::unique_lock lock(library().calls, std::try_to_lock);
    if (lock && library().dead == 0)
      return Client(::jack_client_open(name, JackNoStartServer, nullptr));
    std::this_thread::sleep_for(kPause);
  } while (std::chrono::steady_clock::now() < end);
  return nullptr;
}

// "system" of "system:playback_1".
std::string device_of(const std::string& port) { return port.substr(0, port.find(':')); }

// Input ports, in JACK's order.
std::vector<std::string> ports_of(jack_client_t* client, unsigned long flags) {
  std::vector<std::string> ports;
  const char** const names =
      ::jack_get_ports(client, nullptr, JACK_DEFAULT_AUDIO_TYPE, JackPortIsInput | flags);
  for (const char** name = names; name != nullptr && *name != nullptr; ++name)
    ports.emplace_back(*name);
  ::jack_free(names);
  return ports;
}

std::vector<std::string> channels_of(jack_client_t* client, const std::string& device) {
  std::vector<std::string> ports = ports_of(client, 0);
  std::erase_if(ports, [&](const std::string& port) { return device_of(port) != device; });
  return ports;
}

class JackOutput final : public AudioOutput {
 public:
  JackOutput(Client client, std::string name, std::vector<std::string> channels,
             OutputCallback callback)
      : callback_(callback),
        name_(std::move(name)),
        channels_(std::move(channels)),
        interleaved_(kMaxPeriod_frames * channels_.size()),
        client_(std::move(client)) {
    block_frames_ = ::jack_get_buffer_size(client_.get());
    rate_hz_ = static_cast<int>(::jack_get_sample_rate(client_.get()));
    ::jack_set_process_callback(client_.get(), &JackOutput::on_block, this);
    ::jack_set_xrun_callback(client_.get(), &JackOutput::on_xrun, this);
    ::jack_on_info_shutdown(client_.get(), &JackOutput::on_shutdown, this);
    for (std::size_t i = 0; i < channels_.size(); ++i)
      ports_.push_back(::jack_port_register(client_.get(), ("out_" + std::to_string(i + 1)).c_str(),
                                            JACK_DEFAULT_AUDIO_TYPE, JackPortIsOutput, 0));
  }

  ~JackOutput() override {
    client_.reset();
    if (stopped_) --library().dead;
  }

  Result<void> start() override {
    block_broken_pipes();
    const bool complete = std::ranges::find(ports_, nullptr) == ports_.end();
    if (!complete || ::jack_activate(client_.get()) != 0) return refused("it takes no client");
    for (std::size_t i = 0; i < channels_.size(); ++i)
      if (::jack_connect(client_.get(), ::jack_port_name(ports_[i]), channels_[i].c_str()) != 0)
        return refused(in_quotes(channels_[i]) + " takes no connection");
    connected_.store(true);
    return {};
  }

  void stop() override {
    block_broken_pipes();
    const std::lock_guard lock(library().calls);
    ::jack_deactivate(client_.get());
  }

  std::string name() const override { return name_; }
  int block_frames() const override { return static_cast<int>(block_frames_.load()); }
  int rate_hz() const override { return rate_hz_; }

  double latency_s() const override {
    return static_cast<double>(latency_frames_.load(std::memory_order_relaxed)) / rate_hz_;
  }

  std::string failure() const override {
    return stopped_.load() ? "the JACK server has stopped" : "";
  }

 private:
  Error refused(const std::string& why) const {
    return device_error(name_, "does not start (" + why + ")");
  }

  // Runs on JACK's thread, which JACK may cancel at any instruction; cancellation is disabled in
  // the mixer.
  static int on_block(jack_nframes_t frames, void* self) {
    const CancellationDelay in_mixer;
    static_cast<JackOutput*>(self)->fill(frames);
    return 0;
  }

  void fill(std::size_t frames) noexcept {
    if (!begun_) begin_audio_thread(::jack_is_realtime(client_.get()) == 0);
    begun_ = true;
    block_frames_.store(static_cast<unsigned>(frames), std::memory_order_relaxed);
    // A block that is filled now plays when the next one begins; the server's latency is added to
    // that.
    jack_latency_range_t latency{};
    ::jack_port_get_latency_range(ports_.front(), JackPlaybackLatency, &latency);
    latency_frames_.store(static_cast<unsigned>(frames) + latency.max, std::memory_order_relaxed);
    if (!is_heard_) {
      // New connections take effect with the next block: the server may not know of them in this
      // one.
      is_heard_ = connected_.load();
      for (jack_port_t* const port : ports_) std::fill_n(buffer_of(port, frames), frames, 0.0f);
      return;
    }
    const bool underflow = xrun_.exchange(false, std::memory_order_relaxed);
    const std::size_t channels = ports_.size();
    for (std::size_t done = 0; done < frames;) {
      const std::size_t count = std::min(frames - done, kMaxPeriod_frames);
      callback_.fill(callback_.context, interleaved_.data(), static_cast<std::uint32_t>(count),
                     underflow && done == 0);
      for (std::size_t c = 0; c < channels; ++c) {
        float* const port = buffer_of(ports_[c], frames);
        for (std::size_t i = 0; i < count; ++i) port[done + i] = interleaved_[i * channels + c];
      }
      done += count;
    }
  }

  static float* buffer_of(jack_port_t* port, std::size_t frames) noexcept {
    return static_cast<float*>(::jack_port_get_buffer(port, static_cast<jack_nframes_t>(frames)));
  }

  static int on_xrun(void* self) {
    static_cast<JackOutput*>(self)->xrun_.store(true, std::memory_order_relaxed);
    return 0;
  }

  static void on_shutdown(jack_status_t, const char*, void* self) {
    if (!static_cast<JackOutput*>(self)->stopped_.exchange(true)) ++library().dead;
  }

  const OutputCallback callback_;
  const std::string name_;
  const std::vector<std::string> channels_;  // JACK ports that ours are connected to
  int rate_hz_ = 0;
  std::vector<jack_port_t*> ports_;

  // Used by JACK's thread.
  bool begun_ = false, is_heard_ = false;
  std::vector<float> interleaved_;

  std::atomic<unsigned> block_frames_{0}, latency_frames_{0};
  std::atomic<bool> connected_{false}, xrun_{false}, stopped_{false};
  Client client_;
};

}  // namespace

std::vector<OutputDevice> jack_devices() {
  const Client client = connect("clamor_devices");
  if (client == nullptr) return {};
  std::vector<OutputDevice> devices;
  for (const unsigned long flags : {static_cast<unsigned long>(JackPortIsPhysical), 0ul})
    for (const std::string& port : ports_of(client.get(), flags)) {
      const std::string name = device_of(port);
      if (std::ranges::find(devices, name, &OutputDevice::name) != devices.end()) continue;
      const std::size_t channels = channels_of(client.get(), name).size();
      if (channels < kMinChannels) continue;
      devices.push_back({"jack",
                         name,
                         static_cast<int>(channels),
                         {::jack_get_sample_rate(client.get())},
                         devices.empty()});
    }
  return devices;
}

std::unique_ptr<AudioOutput> open_jack(const OutputDevice& device, const OutputRequest& request,
                                       OutputCallback callback, std::string& problem) {
  Client client = connect("clamor");
  std::vector<std::string> channels;
  if (client != nullptr) channels = channels_of(client.get(), device.name);
  if (channels.empty()) {
    problem = "it is gone";
    return nullptr;
  }
  const auto rate_hz = static_cast<int>(::jack_get_sample_rate(client.get()));
  if (request.rate_hz > 0 && request.rate_hz != rate_hz) {
    problem = "its server runs at " + std::to_string(rate_hz) + " Hz";
    return nullptr;
  }
  if (channels.size() < static_cast<std::size_t>(request.channels)) {
    problem = "it has " + std::to_string(channels.size());
    return nullptr;
  }
  channels.resize(static_cast<std::size_t>(request.channels));
  return std::make_unique<JackOutput>(std::move(client), device.full_name(), std::move(channels),
                                      callback);
}

}  // namespace clamor
