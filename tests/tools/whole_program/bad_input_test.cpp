// Tests that every user error ends in exit code 1 or 2 and one sentence with the next step, and
// leaves nothing half-written.
#include <cmath>
#include <cstdint>
#include <cstring>

#include <gtest/gtest.h>

#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;
using testing::Outcome;

// Units are case-insensitive: the error that remains is about the missing file.
TEST(Units, AreTakenInAnyCaseAndGainsNeedThem) {
  const auto render = [](const std::string& option, const std::string& value) {
    return clamor({"render", "none.clamor", "-o", "none.wav", "--listener", "0,0,0", "--seconds",
                   "1", option, value});
  };
  for (const char* size : {"64MB", "64mb", "1Gb"}) EXPECT_EQ(render("--memory", size).code, 1);
  EXPECT_EQ(render("--memory", "64").code, 2);
  for (const char* gain : {"-6dB", "-6DB", "0.5db", "x2"})
    EXPECT_EQ(render("--gain", gain).code, 1) << gain;
  const Outcome alone = render("--gain", "6");
  EXPECT_EQ(alone.code, 2);
  EXPECT_NE(alone.err.find("write 6dB or x6"), std::string::npos) << alone.err;
}

constexpr const char* kNoise = "name=n,signal=noise,at=1,1,1";

// Expects one line from this program that mentions `what`.
void expect_sentence(const Outcome& outcome, int code, const std::string& what) {
  EXPECT_EQ(outcome.code, code) << outcome.err;
  EXPECT_TRUE(outcome.out.empty()) << outcome.out;
  const auto last = outcome.err.rfind("clamor");
  ASSERT_NE(last, std::string::npos) << outcome.err;
  const auto start = outcome.err.find("clamor ");
  EXPECT_NE(start, std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find(what), std::string::npos) << "no '" << what << "' in: " << outcome.err;
  EXPECT_EQ(outcome.err.back(), '\n');
}

Outcome bake(const Folder& folder, const std::string& level, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {"bake",      level, "-o", folder / "out.clamor",
                                        "--photons", "100"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return clamor(arguments);
}

// A glTF with one triangle whose vertices are `floats`, in an embedded buffer.
std::string triangle_gltf(const std::vector<float>& floats, std::size_t count = 3,
                          const std::string& uri = "") {
  std::string raw(floats.size() * 4, '\0');
  std::memcpy(raw.data(), floats.data(), raw.size());
  static const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string encoded;
  for (std::size_t i = 0; i < raw.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < raw.size() ? static_cast<unsigned char>(raw[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      encoded += i + k <= raw.size() ? digits[(word >> (18 - 6 * k)) & 63] : '=';
  }
  const std::string where = uri.empty() ? "data:application/octet-stream;base64," + encoded : uri;
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"name":"Wall"}],)"
         R"("meshes":[{"name":"Wall","primitives":[{"attributes":{"POSITION":0}}]}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" +
         std::to_string(count) + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" +
         std::to_string(raw.size()) + R"(}],"buffers":[{"byteLength":)" +
         std::to_string(raw.size()) + R"(,"uri":")" + where + R"("}]})";
}

const std::vector<float> kTriangle = {0, 0, 0, 1, 0, 0, 0, 1, 0};

TEST(BadInput, AGoodTriangleBakesSoThatTheOthersFailForTheirOwnReason) {
  const Folder folder;
  const auto level = folder.write("level.gltf", triangle_gltf(kTriangle));
  const auto outcome = bake(folder, level, {"--emitter", kNoise});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
}

TEST(BadInput, MissingLevel) {
  const Folder folder;
  expect_sentence(bake(folder, folder / "nowhere.glb", {"--emitter", kNoise}), 1, "nowhere.glb");
  EXPECT_TRUE(folder.names().empty());
}

TEST(BadInput, TruncatedGlb) {
  const Folder folder;
  const std::string json = testing::kEmptyLevel;
  std::string glb = "glTF";
  const auto word = [](std::uint32_t value) {
    return std::string(reinterpret_cast<char*>(&value), 4);
  };
  glb += word(2) + word(static_cast<std::uint32_t>(20 + json.size())) +
         word(static_cast<std::uint32_t>(json.size())) + "JSON" + json;
  for (std::size_t size = 0; size + 1 < glb.size(); size += 7) {
    const auto level = folder.write("cut.glb", glb.substr(0, size));
    expect_sentence(bake(folder, level, {"--emitter", kNoise}), 1, "cut.glb");
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"cut.glb"});
}

TEST(BadInput, AccessorOutOfBounds) {
  const Folder folder;
  const auto level = folder.write("level.gltf", triangle_gltf(kTriangle, 300));
  expect_sentence(bake(folder, level, {"--emitter", kNoise}), 1, "level.gltf");
}

TEST(BadInput, VerticesThatAreNoNumbers) {
  const Folder folder;
  auto vertices = kTriangle;
  vertices[4] = NAN;
  const auto level = folder.write("level.gltf", triangle_gltf(vertices));
  expect_sentence(bake(folder, level, {"--emitter", kNoise}), 1, "Wall");
}

TEST(BadInput, NoEmitters) {
  const Folder folder;
  const auto level = folder.write("level.gltf", triangle_gltf(kTriangle));
  expect_sentence(bake(folder, level), 1, "--emitter");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"level.gltf"});
}

TEST(BadInput, UnreadableAudio) {
  const Folder folder;
  const auto level = folder.write("level.gltf", triangle_gltf(kTriangle));
  const auto sound = folder.write("broken.flac", "this is no sound");
  expect_sentence(bake(folder, level, {"--emitter", "signal=" + sound + ",at=0,0,0"}), 1,
                  "broken.flac");
  expect_sentence(
      bake(folder, level, {"--emitter", "signal=" + (folder / "gone.wav") + ",at=0,0,0"}), 1,
      "gone.wav");
}

TEST(BadInput, PathsThatLeaveTheLevelsFolder) {
  const Folder folder;
  std::filesystem::create_directory(folder / "inner");
  folder.write("secret.bin", std::string(36, '\0'));
  for (const std::string uri : {"../secret.bin", "%2e%2e/secret.bin", "/etc/hostname",
                                "file:///etc/hostname", "inner/../../secret.bin"}) {
    const auto level = folder.write("inner/level.gltf", triangle_gltf(kTriangle, 3, uri));
    expect_sentence(bake(folder, level, {"--emitter", kNoise}), 1, "level.gltf");
  }
}

TEST(BadInput, UnknownOptionsAndCommands) {
  const Folder folder;
  expect_sentence(bake(folder, "level.gltf", {"--photon", "5"}), 2, "--help");
  expect_sentence(clamor({"bak", "level.gltf"}), 2, "'bake'");
  expect_sentence(clamor({"inspect"}), 2, "--help");
  expect_sentence(clamor({"render", "x.clamor"}), 2, "--help");
  EXPECT_EQ(clamor({}).code, 2);
  // A misspelled required option and one written with its value are found, too.
  expect_sentence(bake(folder, "level.gltf", {"--emiter", kNoise}), 2,
                  "there is no option '--emiter'; the nearest is '--emitter'");
  expect_sentence(bake(folder, "level.gltf", {"--photon=5"}), 2, "the nearest is '--photons'");
  expect_sentence(clamor({"impulse", "x.clamor", "--listner", "0,1.7,3"}), 2,
                  "the nearest is '--listener'");
}

TEST(BadInput, OptionValuesOutOfRange) {
  const Folder folder;
  const auto level = folder.write("level.gltf", triangle_gltf(kTriangle));
  expect_sentence(bake(folder, level, {"--photons", "-3"}), 2, "photons");
  expect_sentence(bake(folder, level, {"--photons", "many"}), 2, "photons");
  expect_sentence(bake(folder, level, {"--seed", "1.5"}), 2, "seed");
  expect_sentence(bake(folder, level, {"--kappa", "7"}), 2, "kappa");
  expect_sentence(bake(folder, level, {"--emitter", "signal=noise"}), 2, "at");
  expect_sentence(bake(folder, level, {"--emitter", "at=0,0,0"}), 2, "signal");
  expect_sentence(bake(folder, level, {"--emitter", "signal=noise,at=0,0,0,gian=3dB"}), 2, "gain");
  expect_sentence(bake(folder, level, {"--emitter", "signal=noise,at=0,nan,0"}), 2, "at");
  expect_sentence(bake(folder, level, {"--emitter", kNoise, "--material", "plastr"}), 1, "plaster");
}

// All errors here are found before any file is read: there is no bake of that name.
TEST(BadInput, SoundFilesThatCannotBeWrittenAreBadUsage) {
  const Folder folder;
  const auto file = folder / "none.clamor";
  const auto expect = [&](const std::string& name, const std::vector<std::string>& more,
                          const std::string& what) {
    std::vector<std::string> render = {"render", file, "--listener", "0,0,0", "-o", folder / name};
    std::vector<std::string> play = {"play",     file,   "--seconds", "1",
                                     "--device", "none", "--record",  folder / name};
    for (auto* arguments : {&render, &play}) {
      arguments->insert(arguments->end(), more.begin(), more.end());
      expect_sentence(clamor(*arguments), 2, what);
    }
  };
  for (const char* name : {"o.mp3", "o.ogg", "o"}) expect(name, {}, "end in .wav or .flac");
  expect("o.flac", {"--ambisonics"}, "at most 8 channels, not 16");
  expect("o.flac", {"--layout", "7.1.4"}, "at most 8 channels, not 12");
  expect("o.flac", {"--format", "float"}, "16 or 24 bits");
  for (const char* name : {"ir.mp3", "ir.flac"})
    expect_sentence(clamor({"impulse", file, "--listener", "0,0,0", "-o", folder / name}), 2,
                    ".wav");
  EXPECT_TRUE(folder.names().empty());
}

TEST(BadInput, NumbersOutOfRangeAreBadUsageThatNamesTheRange) {
  const Folder folder;
  const auto file = folder / "none.clamor";
  const auto expect = [&](const std::string& option, const std::string& value,
                          const std::string& range) {
    const std::string what =
        option + ": '" + value + "' is not a whole number between " + range + ";";
    expect_sentence(
        clamor({"render", file, "--listener", "0,0,0", "-o", folder / "o.wav", option, value}), 2,
        what);
    expect_sentence(clamor({"play", file, "--device", "none", option, value}), 2, what);
  };
  for (const char* rays : {"0", "-5", "1.5", "few"}) expect("--rays", rays, "1 and 1000000000");
  for (const char* voices :
       {"0", "-1", "1000001", "100000000000", "1e3", "99999999999999999999999"})
    expect("--voices", voices, "1 and 1000000");
  expect_sentence(clamor({"play", file, "--device", "none", "--frames", "8"}), 2, "16 and 8192");
}

TEST(BadInput, WordsThatMakeNoCommandAreNamed) {
  const Folder folder;
  const auto expect = [&](std::vector<std::string> words, const std::string& sentence) {
    words.insert(words.begin(), {"render", folder / "none.clamor", "--listener", "0,0,0"});
    expect_sentence(clamor(words), 2, sentence);
  };
  expect({"-o", "o.wav", "--seconds", "few"}, "--seconds: 'few' is not a number;");
  expect({"-o", "o.wav", "--seconds", ""}, "--seconds: '' is not a number;");
  expect({"-o", "o.wav", "--seconds", "0"}, "at least one sample");
  expect({"-o", "o.wav", "--mixer", "field", "--strategy", "all"}, "takes the strategy 'priority'");
  expect({"-o", "o.wav", "--late", "dense", "--mixer", "voices"}, "late sound as stored");
  expect({"-o", "o.wav", "--gain", "0dB", "--gain", "1dB"}, "--gain is given 2 times;");
  expect({"-o"}, "--output needs a value;");
  expect({"-o", "o.wav", "p.wav"}, "'p.wav' is one word too many;");
  expect_sentence(clamor({"render", "x.clamor", "-o", "o.wav", "--listener", "0,1e10,0"}), 2,
                  "1e9");
}

// An Error ends in a full stop, but a usage error continues after it.
TEST(BadInput, StrategiesThatDoNotExistAreNamedInASentenceThatGoesOn) {
  const auto outcome = clamor({"render", "x.clamor", "-o", "x.wav", "--strategy", "priorty"});
  expect_sentence(outcome, 2, "the nearest is 'priority'; there are 'priority', 'all'");
  EXPECT_NE(outcome.err.find("'octree-diffusion'; see 'clamor render --help'\n"), std::string::npos)
      << outcome.err;
  const auto other = clamor({"render", "x.clamor", "-o", "x.wav", "--estimator", "loud"});
  expect_sentence(other, 2, "not 'loud'; see");
}

TEST(BadInput, UnwritableOutput) {
  const Folder folder;
  const auto level = folder.write("level.gltf", triangle_gltf(kTriangle));
  expect_sentence(clamor({"bake", level, "-o", folder / "no/such/folder/out.clamor", "--photons",
                          "100", "--emitter", kNoise}),
                  1, "folder");
  expect_sentence(clamor({"bake", level, "-o", "", "--emitter", kNoise}), 1, "-o is empty");
  std::filesystem::create_directory(folder / "taken.clamor");
  expect_sentence(clamor({"bake", level, "-o", folder / "taken.clamor", "--photons", "100",
                          "--emitter", kNoise}),
                  1, "taken.clamor");
  expect_sentence(
      clamor({"bake", level, "-o", "/proc/out.clamor", "--photons", "100", "--emitter", kNoise}), 1,
      "/proc/out.clamor");
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"level.gltf", "taken.clamor"}));
}

TEST(BadInput, FilesThatAreNoBakes) {
  const Folder folder;
  const auto text = folder.write("text.clamor", "hello");
  const auto empty = folder.write("empty.clamor", "");
  for (const std::string& file : {text, empty, folder / "gone.clamor", folder / ""}) {
    expect_sentence(clamor({"inspect", file}), 1, "clamor inspect");
    expect_sentence(
        clamor({"render", file, "-o", folder / "out.wav", "--listener", "0,0,0", "--seconds", "1"}),
        1, "clamor render");
    expect_sentence(clamor({"impulse", file, "-o", folder / "ir.wav", "--listener", "0,0,0"}), 1,
                    "clamor impulse");
    expect_sentence(clamor({"play", file, "--device", "none", "--seconds", "1"}), 1, "clamor play");
  }
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"empty.clamor", "text.clamor"}));
}

TEST(BadInput, ListenersThatAreNoPlaces) {
  const Folder folder;
  const auto level = folder.write("level.gltf", triangle_gltf(kTriangle));
  ASSERT_EQ(bake(folder, level, {"--emitter", kNoise}).code, 0);
  for (const char* listener : {"1,2", "1,2,x", "", "1,2,3,4,5,6", "nan,0,0"})
    expect_sentence(clamor({"render", folder / "out.clamor", "-o", folder / "out.wav", "--listener",
                            listener, "--seconds", "1"}),
                    2, "listener");
  expect_sentence(clamor({"render", folder / "out.clamor", "-o", folder / "no/out.wav",
                          "--listener", "0,0,0", "--seconds", "1"}),
                  1, "out.wav");
  expect_sentence(
      clamor({"impulse", folder / "out.clamor", "--json", "--listener", "0,0,0", "--from", "x"}), 1,
      "'n'");
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"level.gltf", "out.clamor"}));
}

TEST(FreeFieldLevel, ALevelWithoutTrianglesBakesWithOneNoteAndTracesNothing) {
  const Folder folder;
  const auto level = folder.write("void.gltf", testing::kEmptyLevel);
  const auto outcome = bake(folder, level, {"--emitter", kNoise});
  EXPECT_EQ(outcome.code, 0);
  const std::size_t note = outcome.err.find("free field");
  EXPECT_NE(note, std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("free field", note + 1), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("traced "), std::string::npos) << outcome.err;
}

TEST(Help, OfEachCommandEndsWithALineToCopy) {
  for (const char* command : {"bake", "inspect", "render", "impulse", "play", "devices", "bench"}) {
    const auto outcome = clamor({command, "--help"});
    EXPECT_EQ(outcome.code, 0);
    const auto last_line = outcome.out.rfind("example: clamor " + std::string(command));
    ASSERT_NE(last_line, std::string::npos) << outcome.out;
    // A backslash continues the line.
    std::size_t end = outcome.out.find('\n', last_line);
    while (end != std::string::npos && outcome.out[end - 1] == '\\')
      end = outcome.out.find('\n', end + 1);
    EXPECT_EQ(end, outcome.out.size() - 1) << outcome.out;
  }
}

TEST(BadUsage, OfPositionsWithBlanksIsAnsweredWithTheWordsToWrite) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"play", "a.clamor", "--listener", "3", "1.7", "2"},
        {"render", "--listener", "3", "1.7", "2", "a.clamor", "-o", "a.wav"},
        {"impulse", "a.clamor", "--listener", "3", "1.7", "2"}})
    expect_sentence(clamor(words), 2, "commas between them, not blanks: --listener 3,1.7,2");
  expect_sentence(
      clamor({"render", "a.clamor", "-o", "a.wav", "--listener", "3", "-1.7", "2", "90"}), 2,
      "--listener 3,-1.7,2,90");
}

TEST(OutputNames, SayWhatTheyAreInEveryCommand) {
  const Folder folder;
  const std::string level = folder.write("level.gltf", testing::kEmptyLevel);
  const std::string bake = folder / "a.clamor";
  ASSERT_EQ(clamor({"bake", level, "-o", bake, "--emitter", kNoise, "--no-journal"}).code, 0);
  const std::string kept = folder.write("music.wav", "mine");
  expect_sentence(clamor({"bake", level, "-o", kept, "--emitter", kNoise}), 1,
                  "music.wav': bake files end in .clamor");
  expect_sentence(clamor({"bake", level, "-o", kept, "--emitter", kNoise, "--shard", "1/2"}), 1,
                  "music.wav': shards end in .shard");
  expect_sentence(clamor({"farm", level, "-o", kept, "--emitter", kNoise, "--shards", "2"}), 1,
                  "music.wav': bake files end in .clamor");
  expect_sentence(clamor({"view", level, "-o", kept}), 2, "music.wav': bake files end in .clamor");
  expect_sentence(clamor({"report", bake, "-o", kept}), 1, "music.wav': report pages end in .html");
  expect_sentence(clamor({"impulse", bake, "-o", folder / "a.html", "--listener", "1,1,1"}), 2,
                  "sound files end in .wav or .flac");
  expect_sentence(clamor({"render", bake, "-o", folder / "a.html", "--listener", "1,1,1"}), 2,
                  "sound files end in .wav or .flac");
  EXPECT_EQ(testing::read(kept), "mine");
}

TEST(Quiet, PrintsNothingUnlessSomethingIsWrong) {
  const Folder folder;
  const std::string level = folder.write("level.gltf", testing::kEmptyLevel);
  const std::string bake = folder / "a.clamor";
  ASSERT_EQ(clamor({"bake", level, "-o", bake, "--emitter", kNoise, "--no-journal"}).code, 0);
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"render", bake, "-o", folder / "a.wav", "--listener", "0,1,1",
                                 "--seconds", "0.1"},
        {"report", bake, "-o", folder / "a.html", "--listener", "0,1,1"}}) {
    auto quiet = words;
    quiet.push_back("--quiet");
    EXPECT_NE(clamor(words).err, "") << words[0];
    EXPECT_EQ(clamor(quiet).err, "") << words[0];
  }
}

}  // namespace
}  // namespace clamor
