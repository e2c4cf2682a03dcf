#include <gmock/gmock.h>

#include "formats/audio/audio_file.h"
#include "formats/gltf/khr_audio.h"
#include "formats/level/emitter_spec.h"
#include "formats/level/signal_table.h"
#include "tests/formats/level_builder.h"

namespace clamor::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class Sounds : public LevelTest {
 protected:
  // A KHR emitter with one source on a node that looks along +X at (1, 2, 3).
  void khr(json emitter = json::object()) {
    write("tone.wav", wav());
    emitter["sources"] = {0};
    emitter["type"] = "positional";
    level_["extensions"]["KHR_audio_emitter"] = {
        {"audio", {{{"uri", "tone.wav"}}}},
        {"sources", {{{"audio", 0}, {"gain", 0.5}, {"loop", true}}}},
        {"emitters", {emitter}}};
    const double half = std::sqrt(0.5);
    node({{"name", "Radio"},
          {"translation", {1, 2, 3}},
          {"rotation", {0, -half, 0, half}},
          {"extensions", {{"KHR_audio_emitter", {{"emitters", {0}}}}}}});
  }
};

TEST_F(Sounds, StandWhereTheirNodeStandsAndFaceItsMinusZ) {
  khr({{"gain", 0.5}, {"positional", {{"refDistance", 2}}}});
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 1u);
  const Emitter& emitter = result.emitters[0];
  EXPECT_EQ(emitter.name, "Radio");
  EXPECT_LT(length(emitter.position_m - Vec3(1, 2, 3)), 1e-9);
  EXPECT_LT(length(emitter.axis - Vec3(1, 0, 0)), 1e-9);
  EXPECT_DOUBLE_EQ(emitter.gain, 0.5 * 0.5 * 2);
  EXPECT_TRUE(result.signals.at(0).loop);
  EXPECT_EQ(result.signals.at(0).samples.size(), 24000u);
}

TEST_F(Sounds, OfSeveralChannelsAreFoldedWithAWord) {
  khr();
  EXPECT_THAT(import()->report.ignored, Not(Contains(HasSubstr("channels"))));
  std::string stereo = wav();
  stereo[22] = 2;  // channels
  stereo[32] = 4;  // bytes a frame
  write("tone.wav", stereo);
  const auto of_level = import();
  ASSERT_TRUE(of_level.ok());
  EXPECT_EQ(of_level->level.signals.at(0).samples.size(), 12000u);
  EXPECT_THAT(of_level->report.ignored,
              Contains(HasSubstr("all but the mean of the 2 channels of 'tone.wav'")));
  const auto added = import({.emitters = {"name=Radio,at=0,0,0,signal=" + folder_ + "/tone.wav"}});
  ASSERT_TRUE(added.ok());
  EXPECT_THAT(added->report.ignored, Contains(HasSubstr("2 channels of '" + folder_)));
}

TEST_F(Sounds, AreReadInTheOldSpelling) {
  khr();
  level_["nodes"][0]["extensions"]["KHR_audio_emitter"] = {{"emitter", 0}};
  level_["extensions"]["KHR_audio_emitter"]["sources"][0]["autoPlay"] = true;
  EXPECT_EQ(level().emitters.size(), 1u);
}

// The form of Khronos' sample AudioSimple.
TEST_F(Sounds, AreReadFromKhrAudio) {
  khr({{"gain", 0.5}});
  level_["extensions"] = {{"KHR_audio", level_["extensions"]["KHR_audio_emitter"]}};
  level_["nodes"][0]["extensions"] = {{"KHR_audio", {{"emitter", 0}}}};
  level_["extensionsRequired"] = {"KHR_audio"};
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 1u);
  EXPECT_DOUBLE_EQ(imported->level.emitters[0].gain, 0.25);
  EXPECT_THAT(imported->report.found, Contains(HasSubstr("KHR_audio, read as")));
}

TEST_F(Sounds, AreReadFromTheFirstDraftOfKhrAudio) {
  khr();
  level_["extensions"] = {{"KHR_audio",
                           {{"sources", {{{"uri", "tone.wav"}}}},
                            {"emitters",
                             {{{"type", "positional"},
                               {"gain", 0.5},
                               {"loop", true},
                               {"source", 0},
                               {"positional", {{"refDistance", 3}}}}}}}}};
  level_["nodes"][0]["extensions"] = {{"KHR_audio", {{"emitter", 0}}}};
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 1u);
  EXPECT_DOUBLE_EQ(result.emitters[0].gain, 1.5);
  EXPECT_TRUE(result.signals.at(0).loop);
}

// MSFT emitters face +Z and have half angles: a hemisphere is p = 1.
TEST_F(Sounds, AreReadFromMsftAudioEmitter) {
  khr();
  level_["extensions"] = {{"MSFT_audio_emitter",
                           {{"clips", {{{"uri", "tone.wav"}}, {{"uri", "other.wav"}}}},
                            {"emitters",
                             {{{"name", "foot"},
                               {"volume", 0.5},
                               {"loop", true},
                               {"innerAngle", M_PI / 2},
                               {"outerAngle", M_PI / 2},
                               {"clips", {{{"clip", 0}}, {{"clip", 1}}}}}}}}}};
  level_["nodes"][0]["extensions"] = {{"MSFT_audio_emitter", {{"emitters", {0}}}}};
  const auto imported = import();
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  ASSERT_EQ(imported->level.emitters.size(), 1u);
  const Emitter& emitter = imported->level.emitters[0];
  EXPECT_LT(length(emitter.axis - Vec3(-1, 0, 0)), 1e-9);
  EXPECT_DOUBLE_EQ(emitter.gain, 0.5);
  EXPECT_NEAR(emitter.directivity[0], 1, 1e-6);
  EXPECT_TRUE(imported->level.signals.at(0).loop);
  EXPECT_THAT(imported->report.ignored, Contains(HasSubstr("first of 2 clips")));
  EXPECT_THAT(imported->report.ignored, ::testing::Not(Contains(HasSubstr("distance model"))));
}

TEST_F(Sounds, AreReadFromOmiAudioEmitter) {
  khr();
  level_["extensions"] = {{"OMI_audio_emitter",
                           {{"audioSources", {{{"uri", "tone.wav"}}}},
                            {"audioEmitters",
                             {{{"type", "global"}, {"source", 0}},
                              {{"type", "positional"},
                               {"volume", 0.25},
                               {"loop", false},
                               {"source", 0},
                               {"coneInnerAngle", M_PI},
                               {"coneOuterAngle", M_PI},
                               {"refDistance", 2}}}}}}};
  level_["nodes"][0]["extensions"] = {{"OMI_audio_emitter", {{"audioEmitter", 1}}}};
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 1u);
  EXPECT_LT(length(result.emitters[0].axis - Vec3(1, 0, 0)), 1e-9);
  EXPECT_DOUBLE_EQ(result.emitters[0].gain, 0.5);
  EXPECT_NEAR(result.emitters[0].directivity[0], 1, 1e-6);
  EXPECT_FALSE(result.signals.at(0).loop);
}

TEST_F(Sounds, AreRefusedWithASentenceInOlderExtensionsToo) {
  khr();
  level_["extensions"] = {{"MSFT_audio_emitter",
                           {{"clips", {{{"uri", "tone.wav"}}}},
                            {"emitters", {{{"volume", "loud"}, {"clips", {{{"clip", 7}}}}}}}}}};
  level_["nodes"][0]["extensions"] = {{"MSFT_audio_emitter", {{"emitters", {0}}}}};
  EXPECT_THAT(refusal(), HasSubstr("none of the 1 there are"));
  for (const char* broken : {"7", "[1]", "{}", "\"x\"", "null"}) {
    level_["extensions"]["MSFT_audio_emitter"]["emitters"] = json::parse(broken);
    (void)import();  // must terminate
    level_["extensions"]["MSFT_audio_emitter"]["emitters"] = {json::parse(broken)};
    (void)import();
  }
}

TEST_F(Sounds, AreReadFromBufferViews) {
  khr();
  const int at = view(wav());
  level_["extensions"]["KHR_audio_emitter"]["audio"][0] = {{"bufferView", at}};
  EXPECT_EQ(level().signals.at(0).samples.size(), 24000u);
}

TEST_F(Sounds, OfAnEmitterWithTwoSourcesAreTwoEmitters) {
  khr();
  json& extension = level_["extensions"]["KHR_audio_emitter"];
  extension["sources"].push_back({{"audio", 0}, {"name", "quiet"}, {"gain", 0.1}});
  extension["emitters"][0]["sources"] = {0, 1};
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 2u);
  EXPECT_DOUBLE_EQ(result.emitters[1].gain, 0.1);
  EXPECT_FALSE(result.signals.at(result.emitters[1].signal).loop);
}

TEST_F(Sounds, OfACrowdComeFromEveryInstanceEachAtItsOwnTime) {
  khr();
  level_["nodes"][0]["extensions"]["CLAMOR_emitter"] = {{"directivity", {1, 1, 1, 2, 2, 2, 3, 3}},
                                                        {"gain_db", -20},
                                                        {"delay_s", 1},
                                                        {"random_delay_s", 0.3}};
  std::vector<float> moves;
  for (int i = 0; i < 200; ++i) moves.insert(moves.end(), {static_cast<float>(i), 0, 0});
  level_["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = {
      {"attributes", {{"TRANSLATION", floats(moves)}}}};
  const Level result = level();
  ASSERT_EQ(result.emitters.size(), 200u);
  EXPECT_EQ(result.signals.size(), 1u);
  double mean = 0;
  for (const Emitter& emitter : result.emitters) {
    EXPECT_GE(emitter.delay_s, 1);
    EXPECT_LT(emitter.delay_s, 1.3);
    mean += (emitter.delay_s - 1) / 200;
  }
  // Standard deviation of the mean of 200 uniform values from [0, 0.3): 0.0061.
  EXPECT_NEAR(mean, 0.15, 0.025);
  EXPECT_NE(result.emitters[0].delay_s, result.emitters[1].delay_s);
  EXPECT_NEAR(result.emitters[0].gain, 0.05, 1e-12);
  EXPECT_EQ(result.emitters[0].directivity[3], 2);
  EXPECT_LT(length(result.emitters[7].position_m - Vec3(1, 2, 10)), 1e-5);  // rotated from +X to +Z
  EXPECT_EQ(level({.seed = 1}).emitters, result.emitters);
  EXPECT_NE(level({.seed = 2}).emitters, result.emitters);
}

TEST_F(Sounds, TakeClamorsExtrasOnTheKhrEmitterToo) {
  khr({{"extras", {{"clamor_emitter", {{"directivity", 4}}}}}});
  EXPECT_EQ(level().emitters.at(0).directivity, same_in_all_bands(4));
  level_["nodes"][0]["extensions"]["CLAMOR_emitter"] = {{"directivty", 4}};
  EXPECT_THAT(refusal(), HasSubstr("nearest name is 'directivity'"));
}

TEST_F(Sounds, OfAConeRadiateItsPower) {
  // A hemispherical cone radiates half the power: 1 / (p + 1) = 1 / 2.
  EXPECT_NEAR(exponent_of_cone(M_PI, M_PI, 0), 1, 1e-9);
  EXPECT_NEAR(exponent_of_cone(2 * M_PI, 2 * M_PI, 0), 0, 1e-9);
  // A gain of 1/4 outside a cone without width has the mean square 1 / 16.
  EXPECT_NEAR(exponent_of_cone(0, 0, 0.25), 15, 1e-9);
  khr({{"positional",
        {{"coneInnerAngle", M_PI}, {"coneOuterAngle", M_PI}, {"distanceModel", "linear"}}}});
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  EXPECT_NEAR(imported->level.emitters.at(0).directivity[0], 1, 1e-6);
  EXPECT_THAT(imported->report.ignored, Contains(HasSubstr("cone")));
  EXPECT_THAT(imported->report.ignored, Contains(HasSubstr("'linear'")));
}

TEST_F(Sounds, WithoutAPlaceAreIgnoredWithAWarning) {
  khr();
  level_["extensions"]["KHR_audio_emitter"]["emitters"][0]["type"] = "global";
  const auto imported = import();
  ASSERT_TRUE(imported.ok());
  EXPECT_TRUE(imported->level.emitters.empty());
  EXPECT_THAT(imported->report.warnings, Contains(HasSubstr("global emitter")));
  EXPECT_THAT(imported->report.warnings, Contains(HasSubstr("--emitter")));
}

TEST_F(Sounds, OfTheSidecarAndTheCommandLineReplaceThoseOfTheirName) {
  khr();
  write("level.acoustics.json", R"({"emitters": [
      {"name": "Radio", "signal": "tone.wav", "at": [0, 0, 0], "gain": "6dB", "loop": false},
      {"signal": "noise", "at": [9, 9, 9], "facing": [0, 2, 0], "delay": 0.5}],
      "settings": {"photons": 5000, "seed": 7, "air": {"temperature_c": 0}}})");
  const auto imported = import({.emitters = {"name=noise,signal=impulse,at=1,1,1"}});
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  const Level& result = imported->level;
  ASSERT_EQ(result.emitters.size(), 2u);
  EXPECT_NEAR(result.emitters[0].gain, 1.9953, 1e-4);
  EXPECT_EQ(result.emitters[1].position_m, Vec3(1, 1, 1));
  EXPECT_EQ(result.signals.at(result.emitters[1].signal).samples, std::vector<float>{1.0f});
  EXPECT_EQ(result.signals.size(), 2u) << "sounds that nothing plays are kept";
  EXPECT_EQ(imported->settings.photons, 5000u);
  EXPECT_EQ(imported->settings.seed, 7u);
  EXPECT_EQ(result.air.temperature_c, 0);
}

// A plain number is an amplitude in a sidecar, so a 0 that was meant as 0 dB is silent.
TEST_F(Sounds, OfGainZeroAreWarnedOf) {
  write("level.acoustics.json", R"({"emitters": [
      {"name": "Choir", "signal": "noise", "at": [0, 0, 0], "gain": 0},
      {"name": "Organ", "signal": "noise", "at": [9, 9, 9]}]})");
  const auto one = import();
  ASSERT_TRUE(one.ok()) << one.error().message;
  EXPECT_THAT(one->report.warnings, Contains(HasSubstr("'Choir' is silent, with a gain of 0")));
  const auto two = import({.emitters = {"name=Flute,signal=noise,at=1,1,1,gain=x0"}});
  ASSERT_TRUE(two.ok()) << two.error().message;
  EXPECT_THAT(two->report.warnings,
              Contains(HasSubstr("'Choir' and 1 other emitter of 3 are silent")));
  const auto none = import({.emitters = {"name=Choir,signal=noise,at=1,1,1,gain=0dB"}});
  ASSERT_TRUE(none.ok()) << none.error().message;
  EXPECT_THAT(none->report.warnings, ::testing::Not(Contains(HasSubstr("silent"))));
}

TEST_F(Sounds, ThatChangeChangeTheHashAndNothingElseDoes) {
  khr();
  const auto hash = [&](const ImportOptions& options = {}) { return import(options)->input_hash; };
  const auto before = hash();
  EXPECT_EQ(hash(), before);
  EXPECT_NE(hash({.emitters = {"signal=impulse,at=1,1,1"}}), before);
  write("tone.wav", wav(24001));
  EXPECT_NE(hash(), before);
}

TEST(EmitterSpecs, AreReadWithCommasInsideTheirLists) {
  const auto spec = parse_emitter(
      "name=violin,signal=my, old-violin=1.flac,at=1,1.2,-3,facing=0,0,2,gain=-6dB,"
      "directivity=1,2,3,4,5,6,7,8,delay=0.25,loop=no");
  ASSERT_TRUE(spec.ok()) << spec.error().message;
  EXPECT_EQ(spec->name, "violin");
  EXPECT_EQ(spec->signal, "my, old-violin=1.flac");
  EXPECT_EQ(spec->at_m, Vec3(1, 1.2, -3));
  EXPECT_EQ(spec->facing, Vec3(0, 0, 1));
  EXPECT_NEAR(spec->gain, 0.50119, 1e-5);
  EXPECT_EQ(spec->directivity[7], 8);
  EXPECT_EQ(spec->delay_s, 0.25);
  EXPECT_EQ(spec->loop, false);
}

// A bare number is ambiguous: a factor in sidecars, decibels in --gain.
TEST(EmitterSpecs, HaveGainsInDecibelsOrAsFactorsAndNeverAsNumbersAlone) {
  EXPECT_DOUBLE_EQ(*parse_gain("20dB"), 10);
  EXPECT_DOUBLE_EQ(*parse_gain("-20 DB"), 0.1);
  EXPECT_DOUBLE_EQ(*parse_gain("40db"), 100);
  EXPECT_DOUBLE_EQ(*parse_gain("x2"), 2);
  EXPECT_DOUBLE_EQ(*parse_gain("X0.5"), 0.5);
  const auto alone = parse_gain("6");
  ASSERT_FALSE(alone.ok());
  EXPECT_THAT(alone.error().message, HasSubstr("6dB or x6"));
  EXPECT_FALSE(parse_gain("x6dB").ok());
  EXPECT_FALSE(parse_gain("x-1").ok());
  EXPECT_FALSE(parse_gain("81dB").ok());
  EXPECT_TRUE(parse_gain("81dB", 1e10).ok());
}

TEST(EmitterSpecs, ThatAreWrongSayWhatToWrite) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "nearest"},
      {"at=1,2,3", "signal= is missing"},
      {"signal=a.wav", "at= is missing"},
      {"signal=a.wav,at=1,2", "three numbers"},
      {"signal=a.wav,at=1,2,nan", "three numbers"},
      {"signal=a.wav,at=1,2,1e300", "three numbers"},
      {"signal=a.wav,at=1,2,3,facing=0,0,0", "no direction"},
      {"signal=a.wav,at=1,2,3,gain=loud", "decibels"},
      {"signal=a.wav,at=1,2,3,gain=-1", "decibels"},
      {"signal=a.wav,at=1,2,3,gain=900dB", "decibels"},
      {"signal=a.wav,at=1,2,3,directivity=1,2", "2 values"},
      {"signal=a.wav,at=1,2,3,directivity=-1", "must be from 0"},
      {"signal=a.wav,at=1,2,3,delay=-1", "seconds"},
      {"signal=a.wav,at=1,2,3,loop=maybe", "loop=yes or loop=no"},
      {"signal=a.wav,at=1,2,3,at=1,2,3", "twice"},
      {"signal=a.wav,at=1,2,3,direktivity=2", "'directivity'"},
      {"signal=,at=1,2,3", "is empty"}};
  for (const auto& [text, part] : cases) {
    const auto spec = parse_emitter(text);
    ASSERT_FALSE(spec.ok()) << text;
    EXPECT_THAT(spec.error().message, HasSubstr(part)) << text;
  }
}

TEST(BuiltInNoise, IsPinkAndAsLoudAsItSays) {
  const auto noise = built_in_signal("noise");
  ASSERT_EQ(noise.size(), 192000u);
  double power = 0;
  for (const float sample : noise) {
    power += double{sample} * sample / 192000;
    ASSERT_LT(std::fabs(sample), 0.99f);
  }
  EXPECT_NEAR(10 * std::log10(power), -20, 0.001);
  // Octave powers from every 8th Fourier coefficient, which are equal in pink noise. With at least
  // 600 coefficients per octave, two standard deviations are 0.35 dB.
  std::vector<double> octave_db;
  for (double low_hz = 300; low_hz < 5000; low_hz *= 2) {
    double sum = 0;
    int count = 0;
    const int step = static_cast<int>(low_hz / 300) * 8;
    for (int k = static_cast<int>(low_hz * 4); k < static_cast<int>(low_hz * 8);
         k += step, ++count) {
      double re = 0, im = 0, c = 1, s = 0;
      const double dc = std::cos(2 * M_PI * k / 192000), ds = std::sin(2 * M_PI * k / 192000);
      for (const float sample : noise) {
        re += sample * c;
        im += sample * s;
        const double next = c * dc - s * ds;
        s = s * dc + c * ds;
        c = next;
      }
      sum += re * re + im * im;
    }
    octave_db.push_back(10 * std::log10(sum / count * low_hz));
  }
  // 150 coefficients per octave have 10 log10(1 + 1 / sqrt(150)) = 0.34 dB, so 1.2 dB is 3.5 sigma.
  for (const double db : octave_db) EXPECT_NEAR(db, octave_db[0], 1.2);
}

class AudioFiles : public LevelTest {};

TEST_F(AudioFiles, OfOtherRatesAreResampledToTheSameTone) {
  const auto samples = read_audio(write("tone.wav", wav(44100, 44100)));
  ASSERT_TRUE(samples.ok());
  ASSERT_NEAR(static_cast<double>(samples->size()), 48000, 1);
  double worst = 0;
  for (std::size_t i = 2000; i < 46000; ++i)
    worst = std::max(worst, std::fabs((*samples)[i] - 0.5 * std::sin(2 * M_PI * i / 48.0)));
  EXPECT_LT(worst, 4e-5);  // half a step of 16 bits is 1.5e-5
}

TEST_F(AudioFiles, SurviveFlacTo24Bits) {
  std::vector<float> samples;
  for (int i = 0; i < 5000; ++i) samples.push_back(static_cast<float>(std::sin(i * 0.1)));
  const auto flac = encode_flac(samples);
  ASSERT_TRUE(flac.ok()) << flac.error().message;
  const auto back = decode_audio(*flac, "flac");
  ASSERT_TRUE(back.ok());
  ASSERT_EQ(back->size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_NEAR((*back)[i], samples[i], 3e-7);
  EXPECT_FALSE(encode_flac(std::vector<float>{1.01f}).ok());
  EXPECT_FALSE(encode_flac(std::vector<float>{NAN}).ok());
}

TEST_F(AudioFiles, ThatAreNoSoundAreRefused) {
  const std::string whole = wav(1000);
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{12}, std::size_t{44}})
    EXPECT_FALSE(read_audio(write("cut.wav", whole.substr(0, size))).ok()) << size;
  EXPECT_FALSE(read_audio(write("text.wav", "this is no sound")).ok());
  EXPECT_FALSE(read_audio(folder_ + "/missing.wav").ok());
  EXPECT_FALSE(read_audio(folder_).ok());
}

TEST_F(AudioFiles, AppearWholeOrNotAtAllAndAreTheSameBytesEachTime) {
  const std::string path = folder_ + "/out.wav";
  const std::vector<float> samples = {0.5f, -0.5f, 0.25f, 2.0f};
  {
    auto writer = WavWriter::create(path, 2, 48000, SampleFormat::kFloat32);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    ASSERT_TRUE(writer->write(samples).ok());
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
  std::string bytes[2];
  for (std::string& text : bytes) {
    auto writer = WavWriter::create(path, 2, 48000, SampleFormat::kFloat32);
    ASSERT_TRUE(writer->write(samples).ok());
    ASSERT_TRUE(writer->finish().ok());
    std::ifstream in(path, std::ios::binary);
    text.assign(std::istreambuf_iterator<char>(in), {});
  }
  EXPECT_EQ(bytes[0], bytes[1]);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
  EXPECT_FALSE(WavWriter::create(folder_ + "/none/x.wav", 1, 48000, SampleFormat::kPcm16).ok());
  EXPECT_FALSE(WavWriter::create(folder_, 1, 48000, SampleFormat::kPcm16).ok());
}

}  // namespace
}  // namespace clamor::testing
