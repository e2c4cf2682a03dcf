// pulse.h: a private PulseAudio server with a null sink, and its monitor's output; also an ALSA
// whose only card is that server.
//
// Needs no sound card, root or session: it has its own folder and socket. Bit-exact at the sink's
// rate.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "tests/player/program.h"
#include "tests/shell.h"

namespace clamor::testing {

class Pulse {
 public:
  static constexpr const char* kDevice = "pulse: clamor";

  // Returns what must be installed to run a server; empty if everything is.
  static std::string missing() {
    const bool there = has("pulseaudio") && has("parec");
    return there ? "" : "pulseaudio and pulseaudio-utils are not installed";
  }

  // The sink has 2, 6 or 8 channels, in the order of WAV files.
  explicit Pulse(int channels = 2)
      : channels_(std::to_string(channels)),
        map_(order_of(channels)),
        folder_(std::filesystem::temp_directory_path() /
                ("clamor_pulse_" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    for (const char* name : {"HOME", "XDG_RUNTIME_DIR", "XDG_CONFIG_HOME"})
      ::setenv(name, folder_.c_str(), 1);
    ::setenv("PULSE_RUNTIME_PATH", (folder_ / "pulse").c_str(), 1);
    ::setenv("PULSE_STATE_PATH", (folder_ / "state").c_str(), 1);
    ::setenv("DBUS_SESSION_BUS_ADDRESS", "", 1);
    ::setenv("PULSE_SERVER", ("unix:" + (folder_ / "native").string()).c_str(), 1);
    start();
  }

  void start() {
    const std::string socket = (folder_ / "native").string();
    std::filesystem::remove(socket);  // left over from a killed server
    daemon_ = std::make_unique<Program>(
        std::vector<std::string>{
            "pulseaudio", "-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1",
            "--disallow-exit", "--realtime=no", "--high-priority=no", "--disable-shm=yes", "-L",
            "module-native-protocol-unix socket=" + socket + " auth-anonymous=1", "-L",
            "module-null-sink sink_name=clamor norewinds=1 format=float32le rate=48000 "
            "sink_properties=device.description=clamor channels=" +
                channels_ + " channel_map=" + map_},
        (folder_ / "daemon").string());
    for (int i = 0; i < 500 && !answers(socket); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ready_ = answers(socket);
  }
  ~Pulse() {
    daemon_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  bool ready() const { return ready_; }

  // Stops the server, as if it hung; thaw() continues it.
  void freeze() { daemon_->signal(SIGSTOP); }
  void thaw() { daemon_->signal(SIGCONT); }

  // Like a crash: clients get no message.
  void kill() {
    daemon_->stop(SIGKILL);
    ready_ = false;
  }

  // Waits for sound at the monitor, with a time limit.
  bool sounds() {
    const std::string path = (folder_ / "sounds.raw").string();
    std::filesystem::remove(path);  // the previous recording
    Program recorder(recording(), path);
    for (int i = 0; i < 2000; ++i) {
      const auto samples = samples_of(path);
      if (std::any_of(samples.begin(), samples.end(), [](float x) { return x != 0; })) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  // Runs `play` while the sink's monitor is recorded; returns the recording, interleaved.
  template <class Play>
  std::vector<float> heard(Play play) {
    const std::string path = (folder_ / "heard.raw").string();
    {
      Program recorder(recording(), path);
      for (int i = 0; i < 100 && size_of(path) == 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      play();
      std::this_thread::sleep_for(std::chrono::milliseconds(400));  // latency of the monitor
    }
    return samples_of(path);
  }

 protected:
  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::vector<std::string> recording() const {
    return {"parec",
            "-d",
            "clamor.monitor",
            "--format=float32le",
            "--rate=48000",
            "--raw",
            "--latency-msec=20",
            "--channels=" + channels_,
            "--channel-map=" + map_};
  }

  static std::string order_of(int channels) {
    std::string order = "front-left,front-right";
    if (channels > 2) order += ",front-center,lfe,rear-left,rear-right";
    return channels > 6 ? order + ",side-left,side-right" : order;
  }

  // The socket's file exists slightly earlier.
  static bool answers(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof(address.sun_path)) return false;
    std::copy(path.begin(), path.end(), address.sun_path);
    const int client = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const bool connected =
        ::connect(client, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    ::close(client);
    return connected;
  }

  static std::vector<float> samples_of(const std::string& path) {
    std::vector<float> samples(size_of(path) / sizeof(float));
    std::ifstream(path, std::ios::binary)
        .read(reinterpret_cast<char*>(samples.data()),
              static_cast<std::streamsize>(samples.size() * sizeof(float)));
    return samples;
  }

  static std::uintmax_t size_of(const std::string& path) {
    std::error_code problem;
    const auto size = std::filesystem::file_size(path, problem);
    return problem ? 0 : size;
  }

  const std::string channels_, map_;
  std::filesystem::path folder_;
  std::unique_ptr<Program> daemon_;
  bool ready_ = false;
};

// Must be constructed before anything uses ALSA in this process.
class Alsa : public Pulse {
 public:
  static constexpr const char* kDevice = "alsa: default";

  static std::string missing() {
    const bool there = std::system(
                           "ls /usr/lib/*/alsa-lib/libasound_module_pcm_pulse.so "
                           "> /dev/null 2>&1") == 0;
    return there ? Pulse::missing() : "libasound2-plugins is not installed";
  }

  explicit Alsa(int channels = 2) : Pulse(channels) {
    const std::string settings = (folder() / "asound.conf").string();
    std::ofstream(settings) << "pcm.!default { type pulse }\nctl.!default { type pulse }\n";
    ::setenv("ALSA_CONFIG_PATH", ("/usr/share/alsa/alsa.conf:" + settings).c_str(), 1);
  }
};

}  // namespace clamor::testing
