// Tests clamor compare as a designer and a script use it.
#include <cmath>
#include <cstring>
#include <numbers>
#include <regex>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/audio/audio_file.h"
#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using nlohmann::json;
using testing::clamor;
using testing::Folder;
using testing::Outcome;

struct Shape {
  double seconds = 1, left = 0.1, right = 0.1;
  int channels = 2, rate_hz = 48000;
  double decay_s = 0;  // 0: no decay
  std::uint64_t seed = 1;
};

// Noise that is the same in both ears except for their gains.
std::string write_noise(const Folder& folder, const std::string& name, const Shape& shape) {
  std::vector<float> samples;
  for (std::uint32_t i = 0; i < shape.seconds * shape.rate_hz; ++i) {
    const RandomBits bits = philox(shape.seed, {i, 0, 0, 0});
    double x = std::sqrt(-2 * std::log(unit_above_zero(bits[0]))) *
               std::cos(2 * std::numbers::pi * unit(bits[1]));
    if (shape.decay_s > 0) x *= std::pow(10, -3.0 * i / shape.rate_hz / shape.decay_s);
    for (int c = 0; c < shape.channels; ++c)
      samples.push_back(static_cast<float>(x * (c == 0 ? shape.left : shape.right)));
  }
  auto wav =
      WavWriter::create(folder / name, shape.channels, shape.rate_hz, SampleFormat::kFloat32);
  EXPECT_TRUE(wav.ok() && wav->write(samples).ok() && wav->finish().ok());
  return folder / name;
}

json json_of(std::vector<std::string> words) {
  words.insert(words.begin(), "compare");
  words.emplace_back("--json");
  const Outcome outcome = clamor(words);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  return json::parse(outcome.out, nullptr, false);
}

void expect_sentence(const std::vector<std::string>& words, int code, const std::string& what) {
  const Outcome outcome = clamor(words);
  EXPECT_EQ(outcome.code, code) << outcome.err;
  EXPECT_TRUE(outcome.out.empty()) << outcome.out;
  EXPECT_TRUE(outcome.err.starts_with("clamor compare: ")) << outcome.err;
  EXPECT_NE(outcome.err.find(what), std::string::npos) << "no '" << what << "' in: " << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

TEST(Compare, SaysInOneTableByWhatTheEarTellsTwoSoundsApart) {
  const Folder folder;
  const auto a = write_noise(folder, "a.wav", {});
  const auto b = write_noise(folder, "b.wav", {.right = 0.2});
  const Outcome same = clamor({"compare", a, a});
  EXPECT_EQ(same.code, 0) << same.err;
  EXPECT_NE(same.out.find("no measure tells"), std::string::npos) << same.out;
  EXPECT_EQ(same.out.find("  audible"), std::string::npos) << same.out;

  const Outcome apart = clamor({"compare", a, b});
  EXPECT_EQ(apart.code, 0) << apart.err;
  EXPECT_NE(apart.out.find("ILD"), std::string::npos);
  EXPECT_NE(apart.out.find("+6.0 dB"), std::string::npos) << apart.out;
  EXPECT_NE(apart.out.find("\naudible: "), std::string::npos) << apart.out;
  for (std::size_t begin = 0; begin < apart.out.size();) {
    const std::size_t end = apart.out.find('\n', begin);
    const std::string row = apart.out.substr(begin, end - begin);
    EXPECT_TRUE(row.size() <= 100 || row.starts_with("A ") || row.starts_with("B ")) << row;
    begin = end + 1;
  }
}

TEST(Compare, SaysTheSameToProgramsWithEverySourceAndJnd) {
  const Folder folder;
  const auto a = write_noise(folder, "a.wav", {});
  const auto b = write_noise(folder, "b.wav", {.left = 0.2, .right = 0.2});
  const json result = json_of({a, b});
  EXPECT_EQ(result.at("kind"), "programme");
  EXPECT_EQ(result.at("a").at("seconds"), 1);
  EXPECT_EQ(result.at("b").at("channels"), 2);
  EXPECT_EQ(result.at("audible"), (json{"integrated_loudness", "momentary_loudness", "spectrum"}));
  for (const char* level : {"integrated_loudness", "momentary_loudness", "spectrum"}) {
    const json& measure = result.at("measures").at(level);
    EXPECT_NEAR(measure.at("difference").get<double>(), 6.02, 0.01) << level;
    EXPECT_EQ(measure.at("jnd"), 1);
    EXPECT_EQ(measure.at("verdict"), "audible");
    EXPECT_FALSE(measure.at("source").get<std::string>().empty());
    EXPECT_FALSE(measure.at("jnd_source").get<std::string>().empty());
  }
  EXPECT_EQ(result.at("measures").at("ild").at("verdict"), "ok");
  EXPECT_EQ(result.at("measures").at("ild").at("points").size(), 8u);
  EXPECT_EQ(result.at("measures").at("spectrum").at("points").size(), 39u);
  EXPECT_NEAR(result.at("measures").at("l2").at("difference").get<double>(), 1, 1e-6);
  EXPECT_TRUE(result.at("measures").at("l2").at("verdict").is_null());
  EXPECT_FALSE(result.at("measures").contains("t30"));
}

TEST(Compare, RecognisesImpulseResponsesAndTakesAnotherWord) {
  const Folder folder;
  const auto a = write_noise(folder, "a.wav", {.channels = 1, .decay_s = 0.5});
  const auto b = write_noise(folder, "b.wav", {.channels = 1, .decay_s = 0.6});
  const json result = json_of({a, b});
  EXPECT_EQ(result.at("kind"), "response");
  EXPECT_NEAR(result.at("measures").at("t30").at("points").at(7).at("difference").get<double>(), 20,
              3);
  EXPECT_EQ(result.at("measures").at("t30").at("verdict"), "audible");
  EXPECT_FALSE(result.at("measures").contains("clicks"));
  EXPECT_FALSE(result.at("measures").contains("ild"));  // the recording is mono
  EXPECT_FALSE(result.at("measures").at("t30").contains("channel"));
  const json programme = json_of({a, b, "--as", "programme"});
  EXPECT_EQ(programme.at("kind"), "programme");
  EXPECT_TRUE(programme.at("measures").contains("clicks"));
  EXPECT_FALSE(programme.at("measures").contains("t30"));
}

TEST(Compare, MeasuresTexturesByWhatChanceDoesTheSameEveryTime) {
  const Folder folder;
  const auto noise = [&](const std::string& name, double gain, std::uint64_t seed) {
    return write_noise(folder, name,
                       {.seconds = 0.5, .left = 0.1 * gain, .channels = 1, .seed = seed});
  };
  const auto a = noise("a.wav", 1, 1), other = noise("other.wav", 1, 3);
  const auto louder = noise("louder.wav", 1.5, 3);
  // Another random draw: single bands differ audibly, but not beyond chance.
  EXPECT_EQ(json_of({a, other}).at("audible"), json{"spectrum"});
  const json by_chance = json_of({a, other, "--null", "39"});
  EXPECT_TRUE(by_chance.at("audible").empty()) << by_chance.at("audible");
  EXPECT_EQ(by_chance.at("null"), (json{{"rolls", 39}, {"seed", 1}}));
  const json& spectrum = by_chance.at("measures").at("spectrum");
  EXPECT_GT(spectrum.at("null_95").get<double>(),
            std::abs(spectrum.at("difference").get<double>()));
  EXPECT_NEAR(by_chance.at("measures").at("l2").at("null_95").get<double>(), std::sqrt(2), 0.03);
  EXPECT_EQ(by_chance, json_of({a, other, "--null", "39"}));
  EXPECT_NE(by_chance, json_of({a, other, "--null", "39", "--seed", "2"}));
  // A difference of 3.5 dB is beyond chance.
  const Outcome table = clamor({"compare", a, louder, "--null", "19"});
  EXPECT_NE(table.out.find("chance 95%"), std::string::npos) << table.out;
  EXPECT_NE(table.out.find("audible: loudness, whole; loudness, 400 ms"), std::string::npos)
      << table.out;
}

TEST(Compare, MeasuresByExactRenderingsWhereAFolderHoldsThem) {
  const Folder folder, rolls;
  const auto noise = [](const Folder& where, const std::string& name, double gain,
                        std::uint64_t seed) {
    return write_noise(where, name,
                       {.seconds = 0.5, .left = 0.1 * gain, .channels = 1, .seed = seed});
  };
  const auto a = noise(folder, "a.wav", 1, 1), other = noise(folder, "other.wav", 1, 3);
  const auto louder = noise(folder, "louder.wav", 1.5, 3);
  const std::string where = std::filesystem::path(rolls / "x").parent_path().string();
  for (std::uint64_t roll = 0; roll < 18; ++roll)
    noise(rolls, std::to_string(roll) + ".wav", 1, 100 + roll);
  expect_sentence({"compare", a, other, "--rolls", where}, 1, "18 files");
  noise(rolls, "18.wav", 1, 118);

  const json inside = json_of({a, other, "--rolls", where});
  EXPECT_TRUE(inside.at("audible").empty()) << inside.at("audible");
  EXPECT_EQ(inside.at("null").at("rolls"), 19);
  EXPECT_EQ(inside.at("null").at("folder"), where);
  EXPECT_FALSE(json_of({a, louder, "--rolls", where}).at("audible").empty());

  expect_sentence({"compare", a, other, "--rolls", where, "--null", "19"}, 2, "--rolls");
  expect_sentence({"compare", a, other, "--rolls", folder / "none"}, 1, "none");
  rolls.write("5.wav", "broken");
  const Outcome broken = clamor({"compare", a, other, "--rolls", where});
  EXPECT_EQ(broken.code, 1);
  EXPECT_NE(broken.err.find("5.wav"), std::string::npos) << broken.err;
}

TEST(Compare, TakesOtherRatesAndLengthsAndSaysSo) {
  const Folder folder;
  const auto a = write_noise(folder, "a.wav", {});
  const auto cut = write_noise(folder, "cut.wav", {.seconds = 0.5});
  const Outcome outcome = clamor({"compare", a, cut});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.err.find("padded with silence"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.out.find("-40.0 LU"), std::string::npos) << outcome.out;
  const auto slow = write_noise(folder, "slow.wav", {.rate_hz = 24000});
  EXPECT_EQ(json_of({a, slow}).at("b").at("rate_hz"), 24000);
  EXPECT_TRUE(json_of({slow, slow}).at("audible").empty());
}

TEST(Compare, OfSilenceIsAResult) {
  const Folder folder;
  const auto silent = write_noise(folder, "silent.wav", {.left = 0, .right = 0});
  const auto sound = write_noise(folder, "sound.wav", {});
  EXPECT_TRUE(json_of({silent, silent}).at("audible").empty());
  EXPECT_FALSE(json_of({silent, sound}).at("audible").empty());
  const json lost = json_of({sound, silent, "--null", "19"});
  EXPECT_EQ(lost.at("measures").at("integrated_loudness").at("verdict"), "audible");
  EXPECT_EQ(lost.at("measures").at("l2").at("difference"), 1);
  EXPECT_EQ(clamor({"compare", silent, sound}).code, 0);
  const auto faint = write_noise(folder, "faint.wav", {.left = 1e-42, .right = 1e-30});
  EXPECT_TRUE(json_of({faint, faint, "--null", "19"}).at("audible").empty());
  EXPECT_FALSE(json_of({faint, sound}).at("audible").empty());
}

TEST(Compare, RefusesWhatCannotBeComparedWithOneSentence) {
  const Folder folder;
  const auto good = write_noise(folder, "good.wav", {.seconds = 0.1});
  const auto mono = write_noise(folder, "mono.wav", {.seconds = 0.1, .channels = 1});
  const auto many = write_noise(folder, "many.wav", {.seconds = 0.1, .channels = 6});
  const auto empty = write_noise(folder, "empty.wav", {.seconds = 0});
  const auto text = folder.write("text.wav", "this is no sound");
  const auto nothing = folder.write("nothing.wav", "");
  expect_sentence({"compare", good, mono}, 1, "mono.wav: is mono, but");
  expect_sentence({"compare", mono, good}, 1, "stereo");
  expect_sentence({"compare", many, many}, 1, "6 channels");
  expect_sentence({"compare", good, empty}, 1, "empty.wav");
  expect_sentence({"compare", nothing, good}, 1, "nothing.wav");
  expect_sentence({"compare", good, text}, 1, "text.wav");
  expect_sentence({"compare", good, folder / "gone.wav"}, 1, "gone.wav");
  expect_sentence({"compare", folder / "", good}, 1, "clamor compare");

  // Overwrites the last sample with a NaN.
  std::string bytes = testing::read(good);
  const float nan = NAN;
  std::memcpy(bytes.data() + bytes.size() - 4, &nan, 4);
  expect_sentence({"compare", good, folder.write("nan.wav", bytes)}, 1, "NaN");

  const auto loud = write_noise(folder, "loud.wav", {.seconds = 0.1, .left = 1e30, .right = 1});
  expect_sentence({"compare", loud, good}, 1, "full scale");

  expect_sentence({"compare", good}, 2, "--help");
  expect_sentence({"compare", good, good, "--null", "5"}, 2, "--null");
  expect_sentence({"compare", good, good, "--null", "-1"}, 2, "--null");
  expect_sentence({"compare", good, good, "--null", "many"}, 2, "null");
  expect_sentence({"compare", good, good, "--as", "music"}, 2, "--as");
  expect_sentence({"compare", good, good, "--jsn"}, 2, "--help");
}

TEST(Compare, HelpNamesEveryMeasureWithItsSource) {
  Outcome help = clamor({"compare", "--help"});
  EXPECT_EQ(help.code, 0);
  help.out = std::regex_replace(help.out, std::regex(R"(\n +)"), " ");  // lines are wrapped
  for (const char* word :
       {"BS.1770", "Glasberg and Moore 1990", "ISO 3382-1", "Abel and Huang 2006", "annex B",
        "Vaseghi and Rayner 1990", "Klumpp and Eady 1956", "--null", "--as", "--seed", "--json",
        "JND 0.075"})
    EXPECT_NE(help.out.find(word), std::string::npos) << word;
  const auto example = help.out.rfind("example: clamor compare");
  ASSERT_NE(example, std::string::npos);
  EXPECT_EQ(help.out.find('\n', example), help.out.size() - 1);
}

TEST(Compare, TellsHowMuchOfEitherNoFixedFilterMakesOfTheDrySignal) {
  const Folder folder;
  const auto dry =
      write_noise(folder, "dry.wav",
                  {.seconds = 3, .channels = 1});  // shorter than the recordings, so repeated
  const auto write_again = [&](const std::string& name, double swing) {
    const auto samples = read_audio(dry);
    EXPECT_TRUE(samples.ok());
    std::vector<float> again;
    for (std::size_t i = 0; i < 6 * kSampleRate_hz; ++i)
      again.push_back((*samples)[i % samples->size()] *
                      static_cast<float>(1 + swing * std::sin(0.9e-4 * static_cast<double>(i))));
    auto wav = WavWriter::create(folder / name, 1, kSampleRate_hz, SampleFormat::kFloat32);
    EXPECT_TRUE(wav.ok() && wav->write(again).ok() && wav->finish().ok());
    return folder / name;
  };
  const auto a = write_again("a.wav", 0), b = write_again("b.wav", 0.3);
  const json measure = json_of({a, b, "--dry", dry}).at("measures").at("time_varying_part");
  EXPECT_LT(measure.at("a").get<double>(), -50);
  EXPECT_NEAR(measure.at("b").get<double>(), -13.7, 1.5);  // 0.3^2 / 2 of the total power
  EXPECT_TRUE(measure.at("verdict").is_null());
  EXPECT_FALSE(json_of({a, b}).at("measures").contains("time_varying_part"));
  expect_sentence({"compare", dry, dry, "--dry", dry}, 1, "at least 5 s");
}

}  // namespace
}  // namespace clamor
