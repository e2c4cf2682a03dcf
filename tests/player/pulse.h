// pulse.h: a private PulseAudio with a null sink, and what comes out of its monitor.
//
// No sound card, no root, no session: own folder, own socket. Bit-exact at the sink's rate.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace clamor::testing {

// Starts a program with its output in a file; killed when this goes.
class Program {
 public:
  Program(const std::vector<std::string>& words, const std::string& output) {
    std::vector<char*> pointers;
    for (const auto& word : words) pointers.push_back(const_cast<char*>(word.c_str()));
    pointers.push_back(nullptr);
    const std::string errors = output + ".log";
    id_ = ::fork();
    if (id_ != 0) return;
    ::dup2(::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
    ::dup2(::open(errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
    ::execvp(pointers[0], pointers.data());
    ::_exit(127);
  }
  ~Program() { stop(); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void signal(int number) { ::kill(id_, number); }

  void stop(int number = SIGTERM) {
    if (id_ <= 0) return;
    signal(number);
    ::waitpid(id_, nullptr, 0);
    id_ = -1;
  }

 private:
  pid_t id_ = -1;
};

inline bool installed(const std::string& program) {
  return std::system(("command -v " + program + " > /dev/null 2>&1").c_str()) == 0;
}

class Pulse {
 public:
  Pulse()
      : folder_(std::filesystem::temp_directory_path() /
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
    std::filesystem::remove(socket);  // of one that was killed
    daemon_ = std::make_unique<Program>(
        std::vector<std::string>{
            "pulseaudio", "-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1",
            "--disallow-exit", "--realtime=no", "--high-priority=no", "--disable-shm=yes", "-L",
            "module-native-protocol-unix socket=" + socket + " auth-anonymous=1", "-L",
            "module-null-sink sink_name=clamor norewinds=1 format=float32le rate=48000 channels=2 "
            "sink_properties=device.description=clamor"},
        (folder_ / "daemon").string());
    for (int i = 0; i < 500 && !std::filesystem::exists(socket); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ready_ = std::filesystem::exists(socket);
  }
  ~Pulse() {
    daemon_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  bool ready() const { return ready_; }

  // It hangs, or goes on where it hung.
  void freeze() { daemon_->signal(SIGSTOP); }
  void thaw() { daemon_->signal(SIGCONT); }

  // As a crash would: no word to those who are connected.
  void kill() {
    daemon_->stop(SIGKILL);
    ready_ = false;
  }

  // Waits until there is sound at the monitor, but not for ever.
  bool sounds() {
    const std::string path = (folder_ / "sounds.raw").string();
    std::filesystem::remove(path);  // what was heard the last time
    Program recorder(recording(), path);
    for (int i = 0; i < 2000; ++i) {
      const auto samples = samples_of(path);
      if (std::any_of(samples.begin(), samples.end(), [](float x) { return x != 0; })) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  // Runs `play` while the sink's monitor is recorded; returns what was heard, interleaved.
  template <class Play>
  std::vector<float> heard(Play play) {
    const std::string path = (folder_ / "heard.raw").string();
    {
      Program recorder(recording(), path);
      for (int i = 0; i < 100 && size_of(path) == 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      play();
      std::this_thread::sleep_for(std::chrono::milliseconds(400));  // the monitor's own latency
    }
    return samples_of(path);
  }

 private:
  static std::vector<std::string> recording() {
    return {"parec",        "-d",           "clamor.monitor", "--format=float32le",
            "--rate=48000", "--channels=2", "--raw",          "--latency-msec=20"};
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

  std::filesystem::path folder_;
  std::unique_ptr<Program> daemon_;
  bool ready_ = false;
};

}  // namespace clamor::testing
