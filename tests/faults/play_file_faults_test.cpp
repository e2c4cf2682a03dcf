// Files that fail while they are played: one message, and the sound goes on.
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <functional>
#include <sstream>
#include <streambuf>
#include <thread>

#include "common/random.h"
#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_writer.h"
#include "runtime/player/render.h"
#include "tests/baked_room.h"
#include "tests/build_paths.h"
#include "tests/faults/fault_injection.h"
#include "tests/sanitized.h"
#include "tests/tools/run_clamor.h"
#include "tools/commands/bake_file_watcher.h"

namespace clamor::testing {

namespace {

// A room with noise in it, so that loudness does not hang on how tones interfere.
const BakeContents& room() {
  static const BakeContents contents = [] {
    BakeContents made = baked_contents(4000);
    for (std::uint32_t s = 0; s < made.signals.size(); ++s) {
      made.signals[s].loop = true;
      made.signals[s].samples.resize(24000);
      for (std::uint32_t i = 0; i < 24000; ++i)
        made.signals[s].samples[i] =
            static_cast<float>(0.02 * (unit(philox(7, {i, s, 0, 0})[0]) - 0.5));
    }
    return made;
  }();
  return contents;
}

// Made beforehand, so that it strikes at once while something plays.
const BakeContents& other_room() {
  static const BakeContents contents = baked_contents(100);
  return contents;
}

const std::string& other_bytes() {
  static const std::string bytes = [] {
    const Folder folder;
    EXPECT_TRUE(write_bake(folder / "other.clamor", other_room(), 1).ok());
    return read(folder / "other.clamor");
  }();
  return bytes;
}

// What may become of the file under whoever reads it.
struct FileFault {
  const char* what;
  std::function<void(const std::string& path)> strike;
  bool is_noticed;
};

std::vector<FileFault> calamities() {
  other_bytes();
  const auto size = [](const std::string& path) { return std::filesystem::file_size(path); };
  return {
      {"cut in half", [=](auto& path) { std::filesystem::resize_file(path, size(path) / 2); },
       true},
      {"cut to nothing", [](auto& path) { std::filesystem::resize_file(path, 0); }, true},
      {"overwritten with garbage",
       [=](auto& path) {
         std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
         file << std::string(size(path), '\xa5');
       },
       true},
      {"overwritten in place by another bake",
       [](auto& path) { std::ofstream(path, std::ios::binary | std::ios::trunc) << other_bytes(); },
       true},
      // These leave the reader the file it has open.
      {"replaced by another bake",
       [](auto& path) { ASSERT_TRUE(write_bake(path, other_room(), 1).ok()); }, false},
      {"deleted", [](auto& path) { std::filesystem::remove(path); }, false}};
}

double energy_of(std::span<const float> samples) {
  double sum = 0;
  for (const float sample : samples) sum += static_cast<double>(sample) * sample;
  return sum;
}

struct Heard {
  double energy = 0;
  PageStatistics pages;
};

// Two seconds of a walk through the room, with next to no memory, so that pages come and go. Half a
// second on, something strikes.
Heard walked(const std::string& path, const std::function<void()>& strike,
             FileAccess access = FileAccess::kRead) {
  auto file = BakeFile::open(path, access);
  EXPECT_TRUE(file.ok());
  AuralizerOptions options;
  options.voices = 300;
  options.wait_for_pages = true;
  options.memory_bytes = 300'000;
  auto auralizer = Auralizer::create(std::make_shared<const BakeFile>(std::move(*file)), options);
  EXPECT_TRUE(auralizer.ok());
  Heard heard;
  std::vector<float> block(2 * 960);
  for (int i = 0; i < 100; ++i) {
    if (i == 25) strike();
    while ((*auralizer)->wants_keyframe()) {
      const double t = (*auralizer)->next_keyframe_time_s();
      (*auralizer)
          ->make_keyframe({{3 + 2.5 * std::sin(3 * t), 4 + 3 * std::cos(3 * t), 1.5}, t, 0});
    }
    (*auralizer)->mix(block);
    const double energy = energy_of(block);
    EXPECT_TRUE(std::isfinite(energy));
    if (i >= 25) heard.energy += energy;
  }
  heard.pages = (*auralizer)->statistics().pages;
  return heard;
}

TEST(FileUnderAPlayer, MayBeCutOverwrittenReplacedOrDeletedAndSoundsAsLoudAsBefore) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const std::string whole = read(path);
  const Heard undisturbed = walked(path, [] {});
  ASSERT_GT(undisturbed.pages.dropped, 20u);  // so that they are read again
  for (const FileAccess access : {FileAccess::kRead, FileAccess::kMap})
    for (const FileFault& calamity : calamities()) {
      std::ofstream(path, std::ios::binary) << whole;
      const Heard heard = walked(
          path, [&] { calamity.strike(path); }, access);
      EXPECT_EQ(heard.pages.failed > 0, calamity.is_noticed) << calamity.what;
      EXPECT_EQ(heard.pages.failure.find(path) == 0, calamity.is_noticed) << heard.pages.failure;
      // What has been read stands in for the rest: unbiased, with a spread of 0.8 dB from one page.
      EXPECT_NEAR(10 * std::log10(heard.energy / undisturbed.energy), 0,
                  calamity.is_noticed ? 2.5 : 1e-9)
          << calamity.what;
    }
}

// Pages alone: sounds are read meanwhile, and a sound that fails is silent.
constexpr const char* kPageLoader = "page loader";

TEST(FileUnderAPlayer, WhoseDiskFailsSoundsAsLoudAsBefore) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const Heard undisturbed = walked(path, [] {});
  for (const long at : {20, 40, 80}) {
    if (kSanitized && at != 40) continue;  // slow
    for (const FaultKind fate : {FaultKind::kFails, FaultKind::kPersistentFailure}) {
      const FaultInjection faults({.folder = folder.path(),
                                   .calls = "pread",
                                   .thread = kPageLoader,
                                   .fail_at_call = at,
                                   .fate = fate,
                                   .error = EIO});
      const Heard heard = walked(path, [] {});
      EXPECT_TRUE(faults.struck());
      EXPECT_EQ(heard.pages.failed, fate == FaultKind::kFails ? 1u : heard.pages.failed);
      EXPECT_NE(heard.pages.failure.find(std::strerror(EIO)), std::string::npos)
          << heard.pages.failure;
      EXPECT_NEAR(10 * std::log10(heard.energy / undisturbed.energy), 0, 2.5) << at;
    }
  }
  // Interrupted and short reads are none.
  for (const FaultKind fate : {FaultKind::kFails, FaultKind::kPartialTransfer}) {
    const FaultInjection faults({.folder = folder.path(),
                                 .calls = "pread",
                                 .thread = kPageLoader,
                                 .fail_at_call = 40,
                                 .fate = fate,
                                 .error = EINTR});
    const Heard heard = walked(path, [] {});
    EXPECT_TRUE(faults.struck());
    EXPECT_EQ(heard.pages.failed, 0u);
    EXPECT_EQ(heard.energy, undisturbed.energy);
  }
}

// A mapped page that the disk cannot deliver raises SIGBUS, as one beyond the end of its file does;
// reading it then tells the reason.
TEST(FileUnderAPlayer, WhoseDiskFailsUnderAMappingSoundsAsLoudAsBefore) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const Heard undisturbed = walked(path, [] {});
  const FaultInjection faults({.folder = folder.path(),
                               .calls = "pread",
                               .thread = kPageLoader,
                               .fail_at_call = 0,
                               .fate = FaultKind::kPersistentFailure,
                               .error = EIO});
  EXPECT_EQ(walked(
                path, [] {}, FileAccess::kMap)
                .energy,
            undisturbed.energy);
  EXPECT_FALSE(faults.struck());  // nothing is read that can be touched
  const Heard heard = walked(
      path, [&] { std::filesystem::resize_file(path, 0); }, FileAccess::kMap);
  EXPECT_TRUE(faults.struck());
  EXPECT_GT(heard.pages.failed, 0u);
  EXPECT_NE(heard.pages.failure.find(std::strerror(EIO)), std::string::npos) << heard.pages.failure;
  EXPECT_NEAR(10 * std::log10(heard.energy / undisturbed.energy), 0, 2.5);
}

long lines_with(const std::string& text, const std::string& part) {
  std::istringstream lines(text);
  long count = 0;
  for (std::string line; std::getline(lines, line);) count += line.find(part) != std::string::npos;
  return count;
}

// Has so much been recorded, under whatever name, and is the end of it no silence?
bool is_heard(const Folder& folder) {
  constexpr std::size_t kHeard_bytes = 10000 * 2 * sizeof(float), kEnd_bytes = 4800;
  for (const std::string& name : folder.names()) {
    const std::string bytes = name.starts_with("heard.wav") ? read(folder / name) : "";
    if (bytes.size() > kHeard_bytes &&
        bytes.find_first_not_of('\0', bytes.size() - kEnd_bytes) != std::string::npos)
      return true;
  }
  return false;
}

// Plays to nowhere. What the player has to begin with sounds; before the first page comes that is
// streamed, something strikes. Nothing hangs on how busy the machine is.
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

void expect_it_is_said_once_and_plays_to_the_end(const FileFault& calamity, FileAccess access) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const Outcome outcome = played(
      folder, path, [&] { calamity.strike(path); }, access);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(lines_with(outcome.err, "warning: " + path), calamity.is_noticed) << outcome.err;
  EXPECT_EQ(lines_with(outcome.err, "pages could not be read"), calamity.is_noticed) << outcome.err;
  EXPECT_NE(outcome.err.find("played 1.0 s"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("pages: "), std::string::npos) << outcome.err;
  const std::string wav = read(folder / "heard.wav");
  const auto heard = decode_audio(std::as_bytes(std::span(wav)), "heard");
  ASSERT_TRUE(heard.ok()) << heard.error().message;
  // It goes on, wherever in the room the walk has come.
  std::array<double, 4> quarters;
  for (std::size_t q = 0; q < 4; ++q)
    quarters[q] = energy_of(std::span(*heard).subspan(q * (heard->size() / 4), heard->size() / 4));
  EXPECT_NEAR(10 * std::log10(quarters[3] / std::max({quarters[0], quarters[1], quarters[2]})), 0,
              10)
      << calamity.what;
}

TEST(PlayCommand, SaysOnceThatItsFileIsGoneAndPlaysToTheEnd) {
  for (const FileAccess access : {FileAccess::kRead, FileAccess::kMap})
    for (const FileFault& calamity : calamities())
      if (std::string(calamity.what) != "overwritten with garbage")  // as the next
        expect_it_is_said_once_and_plays_to_the_end(calamity, access);
}

TEST(BakeFileWatcher, TellsOfEachVersionOnceAndOnlyWhenItHasSettled) {
  using News = BakeFileWatcher::News;
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  const auto file = BakeFile::open(path);
  ASSERT_TRUE(file.ok());
  BakeFileWatcher watch(*file);
  const auto looks = [&watch](int count) {
    std::vector<News> news;
    for (int i = 0; i < count; ++i) news.push_back(watch.look());
    return news;
  };
  const auto nothing = [](std::size_t count) { return std::vector<News>(count, News::kNone); };
  EXPECT_EQ(looks(3), nothing(3));
  // A copy that is still being written.
  for (std::size_t part = 1; part < 4; ++part) {
    std::filesystem::remove(path);
    folder.write("a.clamor", other_bytes().substr(0, 100 * part));
    EXPECT_EQ(looks(1), nothing(1));
  }
  EXPECT_EQ(looks(3), (std::vector{News::kReplaced, News::kNone, News::kNone}));
  std::filesystem::remove(path);
  EXPECT_EQ(looks(2), nothing(2));
  ASSERT_TRUE(write_bake(path, other_room(), 1).ok());
  EXPECT_EQ(looks(3), (std::vector{News::kNone, News::kReplaced, News::kNone}));
  const auto other = BakeFile::open(path);
  ASSERT_TRUE(other.ok());
  watch.plays(*other);
  EXPECT_EQ(looks(2), nothing(2));
  std::ofstream(path, std::ios::app) << "more";
  EXPECT_EQ(looks(3), (std::vector{News::kNone, News::kOverwritten, News::kNone}));
}

// Takes what the program says, and does something when it has said this, and something else when it
// has said that afterwards.
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

// The room a hundredth as loud.
BakeContents quiet_room() {
  BakeContents quiet = room();
  for (Signal& signal : quiet.signals)
    for (float& sample : signal.samples) sample *= 0.01f;
  return quiet;
}

// Plays until it has said all of that. A minute is for a machine that never does.
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

TEST(PlayCommand, SaysOnceThatItsBakeWasReplacedAndPlaysTheOldOne) {
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
    const std::string said =
        played_until(path, words,
                     {{"playing " + path, damage},
                      {path + " was replaced on disk, but the old one plays on: " + path, replace},
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

TEST(RenderCommand, OfAFileThatCannotBeReadToTheEndWritesNothing) {
  const Folder folder;
  const std::string path = folder / "a.clamor";
  ASSERT_TRUE(write_bake(path, room(), 1).ok());
  std::vector<std::string> words = {"render",  path,        "-o",  folder / "out.wav", "--listener",
                                    "3,4,1.5", "--seconds", "0.2", "--receivers",      "omni"};
  {  // mapped, and cut short on the way
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

// Pages come when they come; a walk among furniture, with next to no memory for them.
TEST(RenderCommand, WritesTheSameBytesHoweverSlowTheDiskIs) {
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
  for (const auto& [most_ms, access] :
       {std::pair(1u, FileAccess::kRead), std::pair(4u, FileAccess::kRead),
        std::pair(4u, FileAccess::kMap)}) {
    std::atomic<unsigned> reads{0};
    const FaultInjection faults({.folder = folder.path(),
                                 .calls = access == FileAccess::kMap ? "madvise" : "pread",
                                 .fail_at_call = 0,
                                 .fate = FaultKind::kRunCallbackFromThenOn,
                                 .meanwhile = [&, most = most_ms] {
                                   const unsigned n = reads++;
                                   const auto bits = philox(most, {n, 0, 0, 0});
                                   std::this_thread::sleep_for(
                                       std::chrono::microseconds(bits[0] % (1000 * most)));
                                 }});
    EXPECT_TRUE(rendered(access) == at_once) << most_ms << " ms";
    EXPECT_GT(reads, 20u);
  }
}

}  // namespace

}  // namespace clamor::testing
