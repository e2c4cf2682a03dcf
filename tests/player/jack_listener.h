// jack_listener.h: a JACK client that records what others play.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include <jack/jack.h>

namespace clamor::testing {

// A client with two inputs. Another client's output may be connected to them, or play to it as a
// device.
class JackListener {
 public:
  static constexpr std::size_t kMaxFrames = 1 << 21;

  explicit JackListener(const std::string& name)
      : client_(::jack_client_open(name.c_str(), JackNoStartServer, nullptr)),
        left_(kMaxFrames),
        right_(kMaxFrames) {
    if (client_ == nullptr) return;
    for (jack_port_t*& port : inputs_)
      port = ::jack_port_register(client_, &port == inputs_ ? "left" : "right",
                                  JACK_DEFAULT_AUDIO_TYPE, JackPortIsInput, 0);
    ::jack_set_process_callback(client_, &JackListener::on_block, this);
    ::jack_activate(client_);
  }
  ~JackListener() {
    if (client_ != nullptr) ::jack_client_close(client_);
  }
  JackListener(const JackListener&) = delete;
  JackListener& operator=(const JackListener&) = delete;

  bool connected() const { return client_ != nullptr; }

  // Connects to all outputs of clients whose names begin with `client`.
  void listen_to(const std::string& client) {
    const char** const outputs = ::jack_get_ports(client_, ("^" + client + ".*:").c_str(),
                                                  JACK_DEFAULT_AUDIO_TYPE, JackPortIsOutput);
    for (std::size_t i = 0; outputs != nullptr && outputs[i] != nullptr; ++i)
      ::jack_connect(client_, outputs[i], ::jack_port_name(inputs_[i % 2]));
    ::jack_free(outputs);
  }

  // Changes the server's block size.
  void set_block_frames(unsigned frames) { ::jack_set_buffer_size(client_, frames); }

  std::size_t frames() const { return heard_.load(std::memory_order_acquire); }
  float left(std::size_t frame) const { return left_[frame]; }
  float right(std::size_t frame) const { return right_[frame]; }

 private:
  static int on_block(jack_nframes_t frames, void* self) {
    auto& listener = *static_cast<JackListener*>(self);
    const auto* const left =
        static_cast<const float*>(::jack_port_get_buffer(listener.inputs_[0], frames));
    const auto* const right =
        static_cast<const float*>(::jack_port_get_buffer(listener.inputs_[1], frames));
    std::size_t heard = listener.heard_.load(std::memory_order_relaxed);
    for (std::size_t i = 0; i < frames && heard < kMaxFrames; ++i, ++heard) {
      listener.left_[heard] = left[i];
      listener.right_[heard] = right[i];
    }
    listener.heard_.store(heard, std::memory_order_release);
    return 0;
  }

  jack_client_t* client_;
  jack_port_t* inputs_[2] = {nullptr, nullptr};
  std::vector<float> left_, right_;
  std::atomic<std::size_t> heard_{0};
};

}  // namespace clamor::testing
