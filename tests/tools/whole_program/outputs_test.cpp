// Tests that no output replaces an input, that links and devices stay what they are, that lost
// results on standard output are reported.
#include <csignal>
#include <cstring>
#include <functional>
#include <thread>

#include <fcntl.h>
#include <sys/stat.h>

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

  // A level of several files and a bake of another one.
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

  // Uses each input, under its own name and through a link, as the output of a command.
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
  // The journal is an output, too.
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
  const std::vector<std::string> options = {"--walk",    walk,  "--moving",    script,
                                            "--seconds", "0.1", "--receivers", "omni"};
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

TEST_F(Outputs, HoldASampleOfAWalkThatIsShorter) {
  const std::string walk = folder_.write("walk.json", R"({"points": [
    {"time_s": 0, "position_m": [1, 0, 2]}, {"time_s": 1e-9, "position_m": [1, 0, 1]}]})");
  const Outcome outcome =
      clamor({"render", bake_, "-o", folder_ / "o.wav", "--walk", walk, "--receivers", "omni"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.err.find("nan"), std::string::npos) << outcome.err;
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

  // The device is behind a link, so that a failing test creates nothing in /dev.
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

  // A pipe with a reader.
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

}  // namespace
}  // namespace clamor
