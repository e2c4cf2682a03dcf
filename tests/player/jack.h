// jack.h: a private JACK server without a sound card.
//
// The server waits for its clients, so each block is heard exactly once even on a busy machine.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/build_paths.h"
#include "tests/player/program.h"
#include "tests/shell.h"

namespace clamor::testing {

class Jack {
 public:
  static constexpr const char* kDevice = "jack: system";

  static std::string missing() {
    if (!has("jackd")) return "jackd2 is not installed";
    std::error_code problem;
    const auto space = std::filesystem::space("/dev/shm", problem);
    const bool fits = !problem && space.available > kShared_bytes;
    return fits ? "" : "JACK's server needs 50 MB of shared memory, and the machine has less";
  }

  explicit Jack(int rate_hz = 48000, int block_frames = 256)
      : rate_hz_(rate_hz), block_frames_(block_frames) {
    ::setenv("JACK_DEFAULT_SERVER", name_.c_str(), 1);
    start();
  }
  // JACK supports eight servers per machine. One that was killed is forgotten only after it has
  // been started again under its name and has ended properly.
  ~Jack() {
    if (!ready_) start();
    daemon_.reset();
    std::error_code ignored;  // and what a killed server shared with its clients
    for (const auto& shared : std::filesystem::directory_iterator("/dev/shm", ignored))
      if (shared.path().string().find(name_) != std::string::npos)
        std::filesystem::remove(shared.path(), ignored);
    for (const char* ending : {"", ".log"}) std::filesystem::remove(log_ + ending);
  }

  void start() {
    daemon_ = std::make_unique<Program>(
        std::vector<std::string>{"jackd", "--no-realtime", "--no-mlock", "--port-max", "64", "-S",
                                 "-t", "5000", "-n", name_, "-d", "dummy", "-r",
                                 std::to_string(rate_hz_), "-p", std::to_string(block_frames_)},
        log_);
    ready_ = listener_succeeds("");
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

  // Waits until the player sounds, with a time limit.
  bool sounds() { return listener_succeeds(" clamor"); }

 private:
  // The listener gives up after ten seconds, but libjack may wait for a server for ever.
  static bool listener_succeeds(const std::string& arguments) {
    const std::string listener = "timeout -k 1 40 " + std::string(testing::kJackListener);
    return std::system((listener + arguments + " > /dev/null 2>&1").c_str()) == 0;
  }

  static constexpr std::uintmax_t kShared_bytes = 50'000'000;  // with few ports it takes 40 MB

  const std::string name_ = "clamor_test_" + std::to_string(::getpid());
  const std::string log_ = (std::filesystem::temp_directory_path() / name_).string();
  const int rate_hz_, block_frames_;
  std::unique_ptr<Program> daemon_;
  bool ready_ = false;
};

}  // namespace clamor::testing
