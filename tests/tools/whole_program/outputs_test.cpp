// Where results go: no output replaces an input, links and devices stay what they are, what is lost
// on standard output is said, and whatever ends a recording leaves it playable.
#include <chrono>
#include <csignal>
#include <cstring>
#include <functional>
#include <thread>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "formats/audio/audio_file.h"
#include "tests/sofa_writer.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

namespace fs = std::filesystem;
using testing::clamor;
using testing::Folder;
using testing::Outcome;
using testing::read;

constexpr const char* kHiss = "name=hiss,signal=noise,at=0,0,0";

class Outputs : public ::testing::Test {
 protected:
  static std::vector<std::string> with(std::vector<std::string> words,
                                       const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  // A level of several files, and a bake of another.
  Outputs() {
    std::string corners(36, '\0');
    const float ones[] = {1, 1};
    std::memcpy(corners.data() + 12, &ones[0], 4);
    std::memcpy(corners.data() + 28, &ones[1], 4);
    folder_.write("corners.bin", corners);
    folder_.write("level.acoustics.json", "{}");
    level_ = folder_.write("level.gltf", R"({"asset": {"version": "2.0"}, "scene": 0,
      "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
      "bufferViews": [{"buffer": 0, "byteLength": 36}],
      "buffers": [{"byteLength": 36, "uri": "corners.bin"}]})");
    auto sound = WavWriter::create(folder_ / "click.wav", 1, 48000, SampleFormat::kFloat32);
    EXPECT_TRUE(sound.ok() && sound->write(std::vector<float>{0.5f, 0, 0}).ok() &&
                sound->finish().ok());
    const auto empty = folder_.write("void.gltf", testing::kEmptyLevel);
    EXPECT_EQ(clamor({"bake", empty, "-o", bake_, "--emitter", kHiss, "--no-journal"}).code, 0);
  }

  std::vector<std::string> bake_to(const std::string& output) const {
    return {
        "bake",      level_,      "-o",        output,
        "--photons", "50",        "--emitter", "signal=" + (folder_ / "click.wav") + ",at=1,1,1",
        "--quiet",   "--longest", "0.02"};
  }

  // Each input, under its own name and through a link, as the output of a command.
  void expect_spared(const std::vector<std::string>& inputs,
                     const std::function<std::vector<std::string>(const std::string&)>& command,
                     const std::string& ending = "") {
    for (const std::string& input : inputs) {
      const std::string before = read(input), link = folder_ / ("link" + ending);
      ASSERT_FALSE(before.empty()) << input;
      fs::remove(link);
      fs::create_symlink(input, link);
      for (const std::string& output : {input, link}) {
        if (!output.ends_with(ending)) continue;
        const auto names = folder_.names();
        const Outcome outcome = clamor(command(output));
        EXPECT_EQ(outcome.code, 1) << output << " for " << input << ": " << outcome.err;
        EXPECT_NE(outcome.err.find(output + ": is "), std::string::npos) << outcome.err;
        EXPECT_NE(outcome.err.find("name another output"), std::string::npos) << outcome.err;
        EXPECT_TRUE(read(input) == before) << input;
        EXPECT_EQ(folder_.names(), names);
      }
      fs::remove(link);
    }
  }

  const Folder folder_;
  const std::string bake_ = folder_ / "void.clamor";
  std::string level_;
};

TEST_F(Outputs, OfABakeNeverReplaceTheLevelItsBuffersSoundsOrSidecar) {
  const std::vector<std::string> inputs = {level_, folder_ / "corners.bin", folder_ / "click.wav",
                                           folder_ / "level.acoustics.json"};
  expect_spared(inputs, [&](const std::string& output) { return bake_to(output); });
  expect_spared(inputs, [&](const std::string& output) {
    return with(bake_to(output), {"--shard", "1/2"});
  });
  // The journal is an output as well.
  fs::rename(folder_ / "click.wav", folder_ / "out.journal");
  auto words = bake_to(folder_ / "out");
  words[7] = "signal=" + (folder_ / "out.journal") + ",at=1,1,1";
  const Outcome outcome = clamor(words);
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("out.journal: is read by this command"), std::string::npos)
      << outcome.err;
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(Outputs, OfAMergeNeverReplaceAShardOrTheLevel) {
  const std::string one = folder_ / "1.shard", two = folder_ / "2.shard";
  ASSERT_EQ(clamor(with(bake_to(one), {"--shard", "1/2"})).code, 0);
  ASSERT_EQ(clamor(with(bake_to(two), {"--shard", "2/2"})).code, 0);
  expect_spared({one, two, level_, folder_ / "corners.bin"}, [&](const std::string& output) {
    return std::vector<std::string>{"merge", one, two, "-o", output, "--quiet"};
  });
  EXPECT_EQ(clamor({"merge", one, two, "-o", folder_ / "out.clamor", "--quiet"}).code, 0);
}

TEST_F(Outputs, OfRenderPlayAndImpulseNeverReplaceBakesWalksScriptsSoundsOrHeads) {
  const std::string path = R"("points": [{"time_s": 0, "position_m": [1, 0, 2]}])";
  const std::string walk = folder_.write("walk.json", "{" + path + "}");
  const std::string script = folder_.write(
      "script.json", R"({"sources": [{"signal": "click.wav", "path": {)" + path + "}}]}");
  const std::string head =
      folder_.write("head.sofa", testing::SofaWriter(testing::plain_head(48000, 20, 64)).bytes());
  const std::vector<std::string> inputs = {bake_, walk, script, folder_ / "click.wav"};
  const std::vector<std::string> options = {"--walk", walk, "--moving", script, "--seconds", "0.1"};
  expect_spared(
      inputs,
      [&](const std::string& output) {
        return with({"render", bake_, "-o", output}, options);
      },
      ".wav");
  expect_spared(
      inputs,
      [&](const std::string& output) {
        return with({"play", bake_, "--device", "none", "--record", output}, options);
      },
      ".wav");
  expect_spared(
      {head},
      [&](const std::string& output) {
        return std::vector<std::string>{"render", bake_,    "--listener", "1,0,2", "--seconds",
                                        "0.1",    "--hrtf", head,         "-o",    output};
      },
      ".wav");
  expect_spared(
      {bake_},
      [&](const std::string& output) {
        return std::vector<std::string>{"impulse", bake_, "--listener", "1,0,2", "-o", output};
      },
      ".wav");
}

TEST_F(Outputs, OfReportsNeverReplaceWhatTheyReportOn) {
  fs::create_directory(folder_ / "report");
  const std::string walk =
      folder_.write("report/play.json", R"({"points": [{"time_s": 0, "position_m": [1, 0, 2]}]})");
  const std::string before = read(walk);
  const Outcome played = clamor({"play", bake_, "--device", "none", "--seconds", "0.1", "--walk",
                                 walk, "--report", folder_ / "report"});
  EXPECT_EQ(played.code, 1);
  EXPECT_NE(played.err.find("play.json: is read by this command"), std::string::npos) << played.err;
  EXPECT_EQ(read(walk), before);

  fs::create_hard_link(bake_, folder_ / "report/walk_table.csv");
  const Outcome found = clamor({"experiment", "walk", bake_, "--quick", "-o", folder_ / "report"});
  EXPECT_EQ(found.code, 1);
  EXPECT_NE(found.err.find("walk_table.csv: is the same file"), std::string::npos) << found.err;
}

TEST_F(Outputs, ThatCannotBeAReportAreRefusedBeforeAnythingIsPlayed) {
  const std::string file = folder_.write("file", "mine");
  for (const std::string& report : {file, file + "/below"}) {
    const Outcome outcome =
        clamor({"play", bake_, "--device", "none", "--seconds", "0.1", "--report", report});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_NE(outcome.err.find("is not a folder"), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find("playing"), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(read(file), "mine");
}

TEST_F(Outputs, GoThroughLinksAndLeaveNothingBesideDevices) {
  fs::create_directory(folder_ / "far");
  fs::create_symlink("far/level.clamor", folder_ / "link.clamor");
  ASSERT_EQ(clamor(bake_to(folder_ / "plain.clamor")).code, 0);
  const std::string whole = read(folder_ / "plain.clamor");
  const Outcome outcome = clamor(bake_to(folder_ / "link.clamor"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.clamor"));
  EXPECT_TRUE(read(folder_ / "far/level.clamor") == whole);

  // A device behind a link, so that nothing would be made in /dev.
  fs::create_symlink("/dev/null", folder_ / "null");
  const auto names = folder_.names();
  auto talkative = bake_to(folder_ / "null");
  std::erase(talkative, "--quiet");
  const Outcome gone = clamor(talkative);
  EXPECT_EQ(gone.code, 0) << gone.err;
  EXPECT_NE(gone.err.find("wrote"), std::string::npos) << gone.err;
  EXPECT_EQ(gone.err.find("MB"), std::string::npos) << "a device has no size: " << gone.err;
  EXPECT_EQ(gone.err.find("listen"), std::string::npos) << gone.err;
  EXPECT_EQ(
      clamor({"render", bake_, "-o", folder_ / "null", "--listener", "1,0,2", "--seconds", "0.1"})
          .code,
      0);
  EXPECT_EQ(folder_.names(), names);
  EXPECT_TRUE(fs::is_symlink(folder_ / "null"));
  EXPECT_EQ(clamor(with(bake_to(folder_ / "null"), {"--shard", "1/2"})).code, 1);
  EXPECT_EQ(clamor(bake_to("/dev/full")).code, 1);
  EXPECT_FALSE(fs::exists("/dev/full.journal"));

  // A pipe, which somebody reads.
  const std::string pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::string received;
  std::thread reader([&] { received = read(pipe); });
  const Outcome piped = clamor(bake_to(pipe));
  reader.join();
  EXPECT_EQ(piped.code, 0) << piped.err;
  EXPECT_TRUE(received == whole);
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_FALSE(fs::exists(pipe + ".journal"));
}

TEST_F(Outputs, ThatAreForeignWhereAShardOrAJournalGoesAreLeftAlone) {
  for (const std::string& foreign : {std::string("note"), std::string(200, 'x')}) {
    folder_.write("out.clamor.journal", foreign);
    folder_.write("out.shard", foreign);
    const Outcome whole = clamor(bake_to(folder_ / "out.clamor"));
    EXPECT_EQ(whole.code, 1);
    EXPECT_NE(whole.err.find("out.clamor.journal: is no journal"), std::string::npos) << whole.err;
    const Outcome part = clamor(with(bake_to(folder_ / "out.shard"), {"--shard", "1/2"}));
    EXPECT_EQ(part.code, 1);
    EXPECT_NE(part.err.find("out.shard: is no journal"), std::string::npos) << part.err;
    EXPECT_EQ(read(folder_ / "out.clamor.journal"), foreign);
    EXPECT_EQ(read(folder_ / "out.shard"), foreign);
    EXPECT_FALSE(fs::exists(folder_ / "out.clamor"));
  }
}

TEST_F(Outputs, ThatStandardOutputCannotTakeAreMissed) {
  const std::string sound = folder_ / "click.wav";
  const std::vector<std::vector<std::string>> commands = {
      {"--help"},
      {"--version"},
      {"bake", "--help"},
      {"inspect", bake_},
      {"inspect", bake_, "--json"},
      {"diff", bake_, bake_},
      {"diff", bake_, bake_, "--json"},
      {"impulse", bake_, "--listener", "1,0,2"},
      {"compare", sound, sound, "--as", "programme"},
      {"devices", "--json"}};
  for (const auto& command : commands) {
    std::ostringstream err;
    std::ostringstream out;
    EXPECT_EQ(run_clamor(command, out, err), 0) << command[0] << ": " << err.str();
    std::ofstream full("/dev/full");
    const int code = run_clamor(command, full, err);
    EXPECT_EQ(code, 1) << command[0];
    EXPECT_NE(err.str().find("standard output could not be written"), std::string::npos)
        << command[0] << ": " << err.str();
  }
}

// The program itself, with its standard error in a file or where the caller says.
class ChildProgram {
 public:
  // `blocks_sigpipe`: as the JACK library does to the thread that opens a device.
  ChildProgram(std::vector<std::string> words, int error, bool blocks_sigpipe = false) {
    words.insert(words.begin(), testing::kProgram);
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    id_ = ::fork();
    if (id_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // a test that crashes leaves none behind
    const int null = ::open("/dev/null", O_RDWR);
    ::dup2(null, STDIN_FILENO);
    ::dup2(null, STDOUT_FILENO);
    ::dup2(error, STDERR_FILENO);
    std::signal(SIGHUP, SIG_DFL);  // a test under nohup
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

  // Its exit code, or minus the signal that killed it.
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

  // Whether it catches a signal, as the kernel says.
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

TEST_F(Outputs, ThatAreRecordedCanBePlayedWhateverEndsTheProgram) {
  for (const char* name : {"r.wav", "r.flac"}) {
    const std::string path = folder_ / name;
    for (const int number : {SIGKILL, SIGTERM, SIGINT, SIGHUP, SIGPIPE}) {
      fs::remove(path);
      int error[2];
      ASSERT_EQ(::pipe2(error, O_CLOEXEC), 0);
      const auto names = folder_.names();
      ChildProgram player({"play", bake_, "--listener", "1,0,2", "--device", "none", "--seconds",
                           "600", "--record", path},
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

TEST_F(Outputs, OfARenderThatIsStoppedAreNotThereAndAfterAKillGoWithTheNext) {
  const std::string path = folder_ / "r.wav";
  const auto names = folder_.names();
  const auto render = [&](const std::string& seconds) {
    return std::vector<std::string>{"render",    bake_,   "--listener", "1,0,2",
                                    "--seconds", seconds, "-o",         path};
  };
  const int log = ::open((folder_ / "log").c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  for (const int number : {SIGHUP, SIGTERM, SIGKILL}) {
    ChildProgram program(render("86400"), log);
    ASSERT_TRUE(comes_true([&] { return folder_.names().size() > names.size() + 1; }));
    program.signal(number);
    EXPECT_EQ(program.ended(), number == SIGKILL ? -SIGKILL : 1);
    EXPECT_FALSE(fs::exists(path));
    EXPECT_EQ(folder_.names().size(), names.size() + (number == SIGKILL ? 2 : 1));
  }
  ::close(log);
  ASSERT_EQ(clamor(render("0.1")).code, 0);
  EXPECT_EQ(folder_.names().size(), names.size() + 2) << "the sound and the log";
}

TEST_F(Outputs, OfCommandsThatAreStoppedAreNoneAndTheExitCodeIsOne) {
  const std::string room = folder_ / "room.clamor", sound = folder_ / "hiss.wav";
  ASSERT_EQ(clamor({"bake", testing::violin_room(), "-o", room, "--photons", "20000", "--sources",
                    "100000", "--emitter", "signal=impulse,at=1,1.2,1", "--quiet", "--no-journal"})
                .code,
            0);
  ASSERT_EQ(clamor({"render", bake_, "--listener", "1,0,2", "--seconds", "3", "-o", sound}).code,
            0);
  const std::string out = folder_ / "out", log = folder_ / "log";
  const std::vector<std::vector<std::string>> commands = {
      {"impulse", room, "--listener", "0,1.7,0", "-o", out + ".wav"},
      {"experiment", "walk", room, "--quick", "-o", out},
      {"compare", sound, sound, "--null", "10000"}};
  for (const auto& command : commands)
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
      int code = 0;
      // On a busy machine the command may have done its work when the signal comes.
      for (int attempt = 0; code != 1 && attempt < 20; ++attempt) {
        const int error = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
        ChildProgram program(command, error);
        ::close(error);
        ASSERT_TRUE(comes_true([&] { return program.catches(number) || !program.runs(); }));
        program.signal(number);
        code = program.ended();
        if (code == 1) break;
        fs::remove(out + ".wav");
        fs::remove_all(out);
      }
      EXPECT_EQ(code, 1) << command[0] << " and " << strsignal(number);
      EXPECT_NE(read(log).find("clamor " + command[0] + ": stopped"), std::string::npos)
          << read(log);
      EXPECT_FALSE(fs::exists(out) || fs::exists(out + ".wav"));
    }
}

}  // namespace
}  // namespace clamor
