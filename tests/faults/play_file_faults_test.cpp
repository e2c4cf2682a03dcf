// Tests clamor play and clamor render on files that fail or are replaced: one message, and the
// player continues while a render writes nothing.
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <streambuf>
#include <thread>

#include "formats/audio/audio_file.h"
#include "tests/build_paths.h"
#include "tests/faults/fault_injection.h"
#include "tests/faults/file_faults.h"
#include "tools/program/bake_file_watcher.h"

namespace clamor::testing {

namespace {

// Returns whether 10 000 frames were recorded, under any name, without silence at the end.
bool is_heard(const Folder& folder) {
  constexpr std::size_t kRecorded_bytes = 10000 * 2 * sizeof(float), kEnd_bytes = 4800;
  for (const std::string& name : folder.names()) {
    const std::string bytes = name.starts_with("heard.wav") ? read(folder / name) : "";
    if (bytes.size() > kRecorded_bytes &&
        bytes.find_first_not_of('\0', bytes.size() - kEnd_bytes) != std::string::npos)
      return true;
  }
  return false;
}

// Plays without a device. The first page sounds; the fault happens before the first streamed page
// arrives, so the result does not depend on the load of the machine.
Outcome played(const Folder& folder, const std::string& path, const std::function<void()>& strike,
               FileAccess access) {
  const std::string walk = folder.write("walk.json", R"({"loop": false, "points": [
    {"time_s": 0, "position_m": [1, 1, 1.5]}, {"time_s": 1, "position_m": [5, 7, 1.5]}]})");
  const std::string wav = folder / "heard.wav";
  std::filesystem::remove(wav);
  const FaultInjection faults({.folder = folder.path(),
                               .calls = access == FileAccess::kMap ? "madvise" : "pread",
                               .thread = kPageLoader,
                               .fail_at_call = 0,
                               .fate = FaultKind::kRunCallback,
                               .meanwhile = [&] {
                                 for (int i = 0; i < 2000 && !is_heard(folder); ++i)
                                   std::this_thread::sleep_for(std::chrono::milliseconds(10));
                                 strike();
                               }});
  std::vector<std::string> words = {"play",     path,          "--device", "none",     "--walk",
                                    walk,       "--receivers", "omni",     "--memory", "4MB",
                                    "--voices", "300",         "--record", wav};
  if (access == FileAccess::kRead) words.push_back("--no-mmap");
  const Outcome outcome = clamor(words);
  EXPECT_TRUE(faults.struck()) << outcome.err;
  return outcome;
}

void expect_it_is_said_once_and_plays_to_the_end(const FileFault& fault, FileAccess access) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const Outcome outcome = played(
      folder, path, [&] { fault.strike(path); }, access);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(lines_with(outcome.err, "warning: " + path), fault.is_noticed) << outcome.err;
  EXPECT_EQ(lines_with(outcome.err, "pages could not be read"), fault.is_noticed) << outcome.err;
  EXPECT_NE(outcome.err.find("played 1.0 s"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("pages: "), std::string::npos) << outcome.err;
  const std::string wav = read(folder / "heard.wav");
  const auto heard = decode_audio(std::as_bytes(std::span(wav)), "heard");
  ASSERT_TRUE(heard.ok()) << heard.error().message;
  // The sound continues, wherever the walk is.
  std::array<double, 4> quarters;
  for (std::size_t q = 0; q < 4; ++q)
    quarters[q] = energy_of(std::span(*heard).subspan(q * (heard->size() / 4), heard->size() / 4));
  EXPECT_NEAR(10 * std::log10(quarters[3] / std::max({quarters[0], quarters[1], quarters[2]})), 0,
              10)
      << fault.what;
}

TEST(PlayCommand, SaysOnceThatItsFileIsGoneAndPlaysToTheEnd_NoAsan) {
  for (const FileAccess access : {FileAccess::kRead, FileAccess::kMap})
    for (const FileFault& fault : file_faults())
      if (std::string(fault.what) != "overwritten with garbage")  // same as the next
        expect_it_is_said_once_and_plays_to_the_end(fault, access);
}

TEST(BakeFileWatcher, TellsOfEachVersionOnceAndOnlyWhenItHasSettled) {
  using Change = BakeFileWatcher::Change;
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const auto file = BakeFile::open(path);
  ASSERT_TRUE(file.ok());
  BakeFileWatcher watch(*file);
  const auto looks = [&watch](int count) {
    std::vector<Change> changes;
    for (int i = 0; i < count; ++i) changes.push_back(watch.check());
    return changes;
  };
  const auto nothing = [](std::size_t count) { return std::vector<Change>(count, Change::kNone); };
  EXPECT_EQ(looks(3), nothing(3));
  // A copy still being written is ignored.
  for (std::size_t part = 1; part < 4; ++part) {
    std::filesystem::remove(path);
    folder.write("a.clamor", other_bytes().substr(0, 100 * part));
    EXPECT_EQ(looks(1), nothing(1));
  }
  EXPECT_EQ(looks(3), (std::vector{Change::kReplaced, Change::kNone, Change::kNone}));
  std::filesystem::remove(path);
  EXPECT_EQ(looks(2), nothing(2));
  ASSERT_TRUE(write_bake(path, other_room(), 1).ok());
  EXPECT_EQ(looks(3), (std::vector{Change::kNone, Change::kReplaced, Change::kNone}));
  const auto other = BakeFile::open(path);
  ASSERT_TRUE(other.ok());
  watch.plays(*other);
  EXPECT_EQ(looks(2), nothing(2));
  std::ofstream(path, std::ios::app) << "more";
  EXPECT_EQ(looks(3), (std::vector{Change::kNone, Change::kOverwritten, Change::kNone}));
}

// A stream buffer that watches the output of the program and runs actions when given texts appear
// in order.
class Listening final : public std::streambuf {
 public:
  struct Cue {
    std::string words;
    std::function<void()> act;
  };
  explicit Listening(std::vector<Cue> cues) : cues_(std::move(cues)) {}
  const std::string& heard() const { return heard_; }
  bool all_said() const { return next_ == cues_.size(); }

 private:
  int_type overflow(int_type letter) override {
    const char one = traits_type::to_char_type(letter);
    xsputn(&one, 1);
    return letter;
  }
  std::streamsize xsputn(const char* text, std::streamsize size) override {
    heard_.append(text, static_cast<std::size_t>(size));
    if (next_ == cues_.size()) return size;
    const auto found = heard_.find(cues_[next_].words, from_);
    if (found == std::string::npos) return size;
    from_ = found + cues_[next_].words.size();
    cues_[next_++].act();
    return size;
  }

  const std::vector<Cue> cues_;
  std::size_t next_ = 0, from_ = 0;
  std::string heard_;
};

// A copy of the room at a hundredth of the amplitude.
BakeContents quiet_room() {
  BakeContents quiet = room();
  for (Signal& signal : quiet.signals)
    for (float& sample : signal.samples) sample *= 0.01f;
  return quiet;
}

// Plays until all texts have appeared, for at most a minute.
std::string played_until(const std::string& path, const std::vector<std::string>& words,
                         std::vector<Listening::Cue> cues) {
  cues.back().act = [] { std::raise(SIGINT); };  // as Ctrl-C
  Listening listening(std::move(cues));
  std::ostream err(&listening);
  std::ostringstream out;
  std::vector<std::string> arguments = {"play",     path,  "--device",   "none",
                                        "--voices", "300", "--seconds",  "60",
                                        "--memory", "4MB", "--listener", "3,4,1.5"};
  arguments.insert(arguments.end(), words.begin(), words.end());
  EXPECT_EQ(run_clamor(arguments, out, err), 0) << listening.heard();
  EXPECT_TRUE(listening.all_said()) << listening.heard();
  return listening.heard();
}

TEST(PlayCommand, SaysOnceThatItsBakeWasReplacedAndPlaysTheOldOne_NoAsan) {
  const Folder folder;
  const std::string path = folder / "a.clamor", wav = folder / "heard.wav";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const auto replace = [&] { ASSERT_TRUE(write_bake(path, quiet_room(), 1).ok()); };
  const std::string said = played_until(
      path, {"--record", wav},
      {{"playing " + path, replace}, {path + " was replaced on disk", [] {}}, {"dBFS", {}}});
  EXPECT_EQ(lines_with(said, "was replaced"), 1) << said;
  EXPECT_EQ(lines_with(said, "--follow"), 1) << said;
  EXPECT_EQ(lines_with(said, "warning"), 0) << said;
  EXPECT_EQ(lines_with(said, "could not be read"), 0) << said;
  const auto heard = read_audio(wav);
  ASSERT_TRUE(heard.ok());
  const std::span<const float> all(*heard);
  EXPECT_NEAR(10 * std::log10(energy_of(all.last(9600)) / energy_of(all.subspan(9600, 9600))), 0,
              3);
}

TEST(PlayCommand, FollowsABakeThatIsReplacedAndStaysWithTheOldOneWhereTheNewOneIsDamaged) {
  const Folder folder;
  const std::string path = folder / "a.clamor", wav = folder / "heard.wav";
  for (const char* const access : {"--no-mmap", ""}) {
    ASSERT_TRUE(write_bake(path, room(), 1).ok());
    const auto damage = [&] {
      std::filesystem::remove(path);
      folder.write("a.clamor", other_bytes().substr(0, 1000));
    };
    const auto replace = [&] { ASSERT_TRUE(write_bake(path, quiet_room(), 1).ok()); };
    std::vector<std::string> words = {"--follow", "--record", wav};
    if (*access != '\0') words.emplace_back(access);
    const std::string said = played_until(
        path, words,
        {{"playing " + path, damage},
         {path + " was replaced on disk, but the old one keeps playing: " + path, replace},
         {path + " was replaced on disk; the new one plays", [] {}},
         {"dBFS", [] {}},  // a second later the fade is over
         {"dBFS", {}}});
    EXPECT_EQ(lines_with(said, "was replaced"), 2) << said;
    EXPECT_EQ(lines_with(said, "warning"), 0) << said;
    EXPECT_EQ(lines_with(said, "could not be read"), 0) << said;
    const auto heard = read_audio(wav);
    ASSERT_TRUE(heard.ok());
    const std::span<const float> all(*heard);
    EXPECT_NEAR(10 * std::log10(energy_of(all.last(9600)) / energy_of(all.subspan(9600, 9600))),
                -40, 3);
  }
}

TEST(RenderCommand, OfAFileThatCannotBeReadToTheEndWritesNothing_NoAsan) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  std::vector<std::string> words = {"render",  path,        "-o",  folder / "out.wav", "--listener",
                                    "3,4,1.5", "--seconds", "0.2", "--receivers",      "omni"};
  {  // mapped, and truncated while it is read
    const FaultInjection faults({.folder = folder.path(),
                                 .calls = "madvise",
                                 .fail_at_call = 2,
                                 .fate = FaultKind::kRunCallback,
                                 .meanwhile = [&] { std::filesystem::resize_file(path, 0); }});
    const Outcome outcome = clamor(words);
    EXPECT_TRUE(faults.struck());
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    EXPECT_NE(outcome.err.find(path), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("cut short while it was open"), std::string::npos) << outcome.err;
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.clamor"});
  }
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  words.push_back("--no-mmap");
  const FaultInjection faults({.folder = folder.path(),
                               .calls = "pread",
                               .fail_at_call = 20,
                               .fate = FaultKind::kPersistentFailure,
                               .error = EIO});
  const Outcome outcome = clamor(words);
  EXPECT_TRUE(faults.struck());
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_NE(outcome.err.find(path), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find(std::strerror(EIO)), std::string::npos) << outcome.err;
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.clamor"});
}

// A walk among furniture with almost no memory for pages, which arrive at arbitrary times.
TEST(RenderCommand, WritesTheSameBytesHoweverSlowTheDiskIs_NoAsan) {
  const Folder folder;
  const std::string path = folder / "a.clamor", wav = folder / "a.wav", walk = folder / "walk.json";
  const std::string level = std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb";
  ASSERT_EQ(clamor({"bake", level, "-o", path, "--photons", "2000", "--sources", "20000",
                    "--no-journal", "--quiet"})
                .code,
            0);
  folder.write("walk.json", R"({"points": [{"time_s": 0, "position_m": [0, 1.7, 0]},
                                           {"time_s": 1, "position_m": [-2, 1.7, 1]}]})");
  const auto rendered = [&](FileAccess access) {
    std::vector<std::string> words = {"render",   path,          "-o",       wav,         "--walk",
                                      walk,       "--receivers", "omni",     "--seconds", "0.5",
                                      "--voices", "500",         "--memory", "9MB"};
    if (access == FileAccess::kRead) words.push_back("--no-mmap");
    const Outcome outcome = clamor(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return read(wav);
  };
  const std::string at_once = rendered(FileAccess::kRead);
  EXPECT_TRUE(rendered(FileAccess::kMap) == at_once);
  for (const auto& [delay_ms, access] :
       {std::pair(1u, FileAccess::kRead), std::pair(4u, FileAccess::kRead),
        std::pair(4u, FileAccess::kMap)}) {
    std::atomic<unsigned> reads{0};
    const FaultInjection faults({.folder = folder.path(),
                                 .calls = access == FileAccess::kMap ? "madvise" : "pread",
                                 .fail_at_call = 0,
                                 .fate = FaultKind::kRunCallbackFromThenOn,
                                 .meanwhile = [&, delay = delay_ms] {
                                   const unsigned n = reads++;
                                   const auto bits = philox(delay, {n, 0, 0, 0});
                                   std::this_thread::sleep_for(
                                       std::chrono::microseconds(bits[0] % (1000 * delay)));
                                 }});
    EXPECT_TRUE(rendered(access) == at_once) << delay_ms << " ms";
    EXPECT_GT(reads, 20u);
  }
}

}  // namespace

}  // namespace clamor::testing
