// Tests programs that are stopped or killed: recordings stay playable, other outputs are not there.
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>

#include "formats/audio/audio_file.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

namespace fs = std::filesystem;
using testing::clamor;
using testing::Folder;
using testing::read;

class StoppedProgram : public ::testing::Test {
 protected:
  StoppedProgram() {
    const auto empty = folder_.write("void.gltf", testing::kEmptyLevel);
    EXPECT_EQ(clamor({"bake", empty, "-o", bake_, "--emitter", "name=hiss,signal=noise,at=0,0,0",
                      "--no-journal"})
                  .code,
              0);
  }

  const Folder folder_;
  const std::string bake_ = folder_ / "a.clamor";
};

// Runs the program in a process of its own, with standard error in a file or where the caller says.
class ChildProgram {
 public:
  // `blocks_sigpipe`: blocks SIGPIPE, as the JACK library does in the thread that opens a device.
  ChildProgram(std::vector<std::string> words, int error, bool blocks_sigpipe = false) {
    words.insert(words.begin(), testing::kProgram);
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    id_ = ::fork();
    if (id_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // a test that crashes leaves no process behind
    const int null = ::open("/dev/null", O_RDWR);
    ::dup2(null, STDIN_FILENO);
    ::dup2(null, STDOUT_FILENO);
    ::dup2(error, STDERR_FILENO);
    std::signal(SIGHUP, SIG_DFL);  // in case the test runs under nohup
    sigset_t blocked;
    ::sigemptyset(&blocked);
    if (blocks_sigpipe) ::sigaddset(&blocked, SIGPIPE);
    ::sigprocmask(SIG_SETMASK, &blocked, nullptr);
    ::execv(pointers[0], pointers.data());
    ::_exit(127);
  }
  ~ChildProgram() {
    if (id_ <= 0) return;
    ::kill(id_, SIGKILL);
    ::waitpid(id_, nullptr, 0);
  }

  void signal(int number) const { ::kill(id_, number); }

  // Exit code, or minus the signal that killed it.
  int ended() {
    int status = 0;
    ::waitpid(std::exchange(id_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  bool runs() const {
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(id_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == 0;
  }

  // Returns whether the process catches a signal, according to the kernel.
  bool catches(int number) const {
    std::ifstream status("/proc/" + std::to_string(id_) + "/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("SigCgt:"))
        return (std::stoull(line.substr(7), nullptr, 16) >> (number - 1) & 1) != 0;
    return false;
  }

 private:
  pid_t id_ = -1;
};

template <class Condition>
bool comes_true(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

std::size_t recorded_frames(const std::string& path) {
  if (!fs::exists(path)) return 0;
  const auto sound = read_channels(path, 2);
  return sound.ok() ? sound->frames() : 0;
}

TEST_F(StoppedProgram, LeavesARecordingThatCanBePlayed_NoAsan) {
  const std::vector<std::pair<const char*, std::vector<int>>> stops = {
      {"r.wav", {SIGKILL, SIGTERM}}, {"r.flac", {SIGKILL, SIGINT, SIGHUP, SIGPIPE}}};
  for (const auto& [name, signals] : stops) {
    const std::string path = folder_ / name;
    for (const int number : signals) {
      fs::remove(path);
      int error[2];
      ASSERT_EQ(::pipe2(error, O_CLOEXEC), 0);
      const auto names = folder_.names();
      ChildProgram player({"play", bake_, "--listener", "1,0,2", "--device", "none", "--seconds",
                           "600", "--receivers", "omni", "--record", path},
                          error[1], path.ends_with(".flac"));
      ::close(error[1]);
      std::size_t seen = 0;
      ASSERT_TRUE(comes_true([&] { return (seen = recorded_frames(path)) > 24000; })) << name;
      EXPECT_TRUE(player.runs());
      if (number == SIGPIPE)
        ::close(error[0]);  // as `| head` does
      else
        player.signal(number);
      EXPECT_EQ(player.ended(), number == SIGKILL ? -SIGKILL : 0) << strsignal(number);
      if (number != SIGPIPE) ::close(error[0]);
      EXPECT_GE(recorded_frames(path), seen) << name << " after " << strsignal(number);
      EXPECT_EQ(folder_.names().size(), names.size() + 1) << strsignal(number);
    }
  }
}

TEST_F(StoppedProgram, LeavesNoRenderAndTheNextOneRemovesWhatAKillLeft_NoAsan) {
  const std::string path = folder_ / "r.wav";
  const auto names = folder_.names();
  const auto render = [&](const std::string& seconds) {
    return std::vector<std::string>{"render", bake_,         "--listener", "1,0,2", "--seconds",
                                    seconds,  "--receivers", "omni",       "-o",    path};
  };
  const int log = ::open((folder_ / "log").c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  for (const int number : {SIGHUP, SIGTERM, SIGKILL}) {
    ChildProgram program(render("86400"), log);
    ASSERT_TRUE(comes_true([&] { return folder_.names().size() > names.size() + 1; }));
    program.signal(number);
    EXPECT_EQ(program.ended(), number == SIGKILL ? -SIGKILL : 130);
    EXPECT_FALSE(fs::exists(path));
    EXPECT_EQ(folder_.names().size(), names.size() + (number == SIGKILL ? 2 : 1));
  }
  ::close(log);
  ASSERT_EQ(clamor(render("0.1")).code, 0);
  EXPECT_EQ(folder_.names().size(), names.size() + 2) << "the sound and the log";
}

TEST_F(StoppedProgram, LeavesNoOutputAndExitsAsInterrupted_NoAsan) {
  const std::string room = folder_ / "room.clamor", sound = folder_ / "hiss.wav";
  ASSERT_EQ(clamor({"bake", testing::violin_room(), "-o", room, "--photons", "20000", "--sources",
                    "100000", "--emitter", "signal=impulse,at=1,1.2,1", "--quiet", "--no-journal"})
                .code,
            0);
  ASSERT_EQ(clamor({"render", bake_, "--listener", "1,0,2", "--seconds", "3", "-o", sound}).code,
            0);
  const std::string out = folder_ / "out", log = folder_ / "log";
  const std::vector<std::pair<std::vector<std::string>, std::vector<int>>> stops = {
      {{"impulse", room, "--listener", "0,1.7,0", "-o", out + ".wav"}, {SIGINT, SIGTERM, SIGHUP}},
      {{"experiment", "walk", room, "--quick", "-o", out}, {SIGTERM}},
      {{"compare", sound, sound, "--null", "10000"}, {SIGINT}}};
  for (const auto& [command, signals] : stops)
    for (const int number : signals) {
      int code = 0;
      // On a busy machine the command may have finished before the signal comes.
      for (int attempt = 0; code != 130 && attempt < 20; ++attempt) {
        const int error = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
        ChildProgram program(command, error);
        ::close(error);
        ASSERT_TRUE(comes_true([&] { return program.catches(number) || !program.runs(); }));
        program.signal(number);
        code = program.ended();
        if (code == 130) break;
        fs::remove(out + ".wav");
        fs::remove_all(out);
      }
      EXPECT_EQ(code, 130) << command[0] << " and " << strsignal(number);
      EXPECT_NE(read(log).find("clamor " + command[0] + ": stopped"), std::string::npos)
          << read(log);
      EXPECT_FALSE(fs::exists(out) || fs::exists(out + ".wav"));
    }
}

}  // namespace
}  // namespace clamor
