// sofa_file_test.cpp: heads other than KEMAR, and invalid files.
#include "formats/audio/sofa_file.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "common/random.h"
#include "formats/audio/hdf5_file.h"
#include "tests/build_paths.h"
#include "tests/formats/audio/hdf5_writer.h"
#include "tests/sanitized.h"
#include "tests/sofa_writer.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::plain_head;
using testing::SofaContent;

Result<HrirSet> read_bytes(const std::string& bytes) {
  const testing::TemporaryFile file(".sofa", bytes);
  return read_sofa(file.path());
}

Result<HrirSet> read(const SofaContent& content) {
  return read_bytes(testing::SofaWriter(content).bytes());
}

std::string refusal(const SofaContent& content) {
  const auto responses = read(content);
  return responses.ok() ? "" : responses.error().message;
}

TEST(SofaFile, RoundTripsAtAnyRateLengthAndNumberOfDirections) {
  struct Case {
    double rate_hz;
    std::size_t directions;
    std::uint32_t frames;
  };
  for (const auto& [rate_hz, directions, frames] :
       {Case{44100, 16, 64}, Case{48000, 200, 128}, Case{96000, 24, 1000}, Case{8000, 17, 32},
        Case{384000, 16, 2048}}) {
    SCOPED_TRACE(rate_hz);
    const SofaContent content = plain_head(rate_hz, directions, frames);
    const auto read_back = read(content);
    ASSERT_TRUE(read_back.ok()) << read_back.error().message;
    EXPECT_EQ(read_back->rate_hz, rate_hz);
    ASSERT_EQ(read_back->frames, frames);
    ASSERT_EQ(read_back->directions.size(), directions);
    for (std::size_t d = 0; d < directions; ++d) {
      EXPECT_LT(length(Vec3(read_back->directions[d]) - content.directions[d]), 1e-5);
      for (std::size_t ear = 0; ear < 2; ++ear)
        for (std::size_t f = 0; f < frames; ++f)
          ASSERT_EQ(read_back->response(d, ear)[f],
                    static_cast<float>(content.responses[(2 * d + ear) * frames + f]));
    }
  }
}

TEST(SofaFile, WithSeparateDelaysIsEquivalent) {
  const auto within = read(plain_head(44100, 50, 100));
  const auto apart = read(plain_head(44100, 50, 100, 0.0003, 6, true));
  ASSERT_TRUE(within.ok() && apart.ok());
  ASSERT_EQ(apart->frames, 100u + 26);  // 0.6 ms
  for (std::size_t d = 0; d < 50; ++d)
    for (std::size_t ear = 0; ear < 2; ++ear)
      for (std::size_t f = 0; f < apart->frames; ++f)
        ASSERT_EQ(apart->response(d, ear)[f], f < 100 ? within->response(d, ear)[f] : 0);
  // One delay per ear for all directions.
  SofaContent content = plain_head(44100, 50, 100);
  content.delays = {3, 5};
  const auto late = read(content);
  ASSERT_TRUE(late.ok());
  EXPECT_EQ(late->frames, 105u);
  EXPECT_EQ(late->response(7, 1)[5 + 10], within->response(7, 1)[10]);
}

// Compares two heads within what 32-bit floats hold.
void expect_same(const HrirSet& read, const HrirSet& expected) {
  ASSERT_EQ(read.directions.size(), expected.directions.size());
  ASSERT_EQ(read.frames, expected.frames);
  for (std::size_t d = 0; d < read.directions.size(); ++d)
    EXPECT_LT(length(read.directions[d] - expected.directions[d]), 1e-5f) << d;
  for (std::size_t i = 0; i < read.samples.size(); ++i)
    ASSERT_NEAR(read.samples[i], expected.samples[i], 1e-6f) << i;
}

TEST(SofaFile, WithReceiversInTheOrderRightLeftIsEquivalent) {
  SofaContent content = plain_head(48000, 40, 64);
  const auto left_first = read(content);
  content.right_first = true;
  for (std::size_t d = 0; d < 40; ++d)
    std::swap_ranges(content.responses.begin() + static_cast<std::ptrdiff_t>(128 * d),
                     content.responses.begin() + static_cast<std::ptrdiff_t>(128 * d + 64),
                     content.responses.begin() + static_cast<std::ptrdiff_t>(128 * d + 64));
  const auto right_first = read(content);
  ASSERT_TRUE(left_first.ok() && right_first.ok());
  expect_same(*right_first, *left_first);
}

// A head that looks along +y hears a source at (x, y, z) as one that looks along +x hears one at
// (y, -x, z).
TEST(SofaFile, WhoseListenerLooksElsewhereIsTurned) {
  SofaContent content = plain_head(48000, 40, 64);
  const auto ahead = read(content);
  content.view = {0, 2, 0};
  for (Vec3& direction : content.directions) direction = {-direction.y, direction.x, direction.z};
  const auto aside = read(content);
  ASSERT_TRUE(ahead.ok() && aside.ok());
  expect_same(*aside, *ahead);
}

TEST(SofaFile, InAnyFormOfHdf5IsEquivalent) {
  if (!load_hdf5()) GTEST_SKIP() << "libhdf5 is not installed";
  SofaContent content = plain_head(48000, 40, 64);
  for (double& sample : content.responses) sample = std::trunc(1000 * sample);
  const auto expected = read(content);
  ASSERT_TRUE(expected.ok());
  for (const testing::Hdf5Form& form : {testing::Hdf5Form{},
                                        {.type = "H5T_IEEE_F32LE_g"},
                                        {.type = "H5T_STD_I16LE_g"},
                                        {.type = "H5T_IEEE_F32BE_g"},
                                        {.deflated = true},
                                        {.variable_text = true}}) {
    SCOPED_TRACE(std::string(form.type) + (form.deflated ? ", deflated" : ""));
    const testing::TemporaryFile file(".sofa", "");
    const testing::Hdf5Writer writer(file.path(), content, form);
    const auto head = read_sofa(file.path());
    ASSERT_TRUE(head.ok()) << head.error().message;
    expect_same(*head, *expected);
  }
  content.convention = "SimpleFreeFieldHRSOS";
  const testing::TemporaryFile file(".sofa", "");
  const testing::Hdf5Writer writer(file.path(), content, {});
  EXPECT_NE(read_sofa(file.path()).error().message.find("second-order sections"),
            std::string::npos);
}

// Heads that netCDF-4 wrote, where they are at hand.
TEST(SofaFile, OfNetcdfIsEquivalentInAllItsForms) {
  const std::string folder = testing::shared_case("sofa/");
  const auto plain = read_sofa(folder + "plain.sofa");
  if (!plain.ok()) GTEST_SKIP() << "no shared cases here";
  for (const char* name : {"right_first.sofa", "float32.sofa", "no_shuffle.sofa"}) {
    const auto head = read_sofa(folder + name);
    if (head.ok())
      expect_same(*head, *plain);
    else
      EXPECT_NE(head.error().message.find("install libhdf5"), std::string::npos) << name;
  }
}

TEST(SofaFile, ThatIsInvalidIsRejectedWithAReason) {
  SofaContent room = plain_head(48000, 20, 64);
  room.convention = "MultiSpeakerBRIR";
  EXPECT_NE(refusal(room).find("is of the convention MultiSpeakerBRIR; give one of "
                               "SimpleFreeFieldHRIR."),
            std::string::npos)
      << refusal(room);
  SofaContent transfer = plain_head(48000, 20, 64);
  transfer.data_type = "TF";
  EXPECT_NE(refusal(transfer).find("holds transfer functions over frequency (SimpleFreeFieldHRIR)"),
            std::string::npos)
      << refusal(transfer);
  EXPECT_NE(refusal(plain_head(48000, 9, 64)).find("holds 9 directions of 64 frames; 16 to 20000"),
            std::string::npos);
  EXPECT_NE(refusal(plain_head(1000, 20, 64)).find("has a sampling rate of 1000 Hz; 8000 to"),
            std::string::npos);
  SofaContent fewer = plain_head(48000, 20, 64);
  fewer.says_directions = 30;
  EXPECT_NE(refusal(fewer).find("tables that do not fit together"), std::string::npos)
      << refusal(fewer);
  SofaContent delayed = plain_head(48000, 20, 64);
  for (const double frames : {-1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    delayed.delays = {0, frames};
    EXPECT_NE(refusal(delayed).find("delay that is negative or beyond 0.1 s"), std::string::npos);
  }
  for (const double sample :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e30}) {
    SofaContent broken = plain_head(48000, 20, 64);
    broken.responses[1234] = sample;
    EXPECT_NE(refusal(broken).find("no finite numbers"), std::string::npos) << sample;
  }
  const auto text = read_bytes("Not a head, but long enough to be looked at all the same.");
  ASSERT_FALSE(text.ok());
  EXPECT_NE(text.error().message.find("is no SOFA file that can be read"), std::string::npos);
  EXPECT_FALSE(read_bytes("").ok());
}

TEST(SofaFile, ThatIsTruncatedIsRejected) {
  const std::string whole = testing::SofaWriter(plain_head(48000, 16, 16)).bytes();
  for (std::size_t size = 0; size < whole.size(); size += testing::kSanitized ? 997 : 97)
    EXPECT_FALSE(read_bytes(whole.substr(0, size)).ok()) << size;
}

// Damaged files return finite values or an error sentence within limited time.
TEST(SofaFile, ThatIsDamagedIsReadOrRejected) {
  const std::string whole = testing::SofaWriter(plain_head(48000, 16, 16)).bytes();
  constexpr std::uint32_t kFiles = testing::kSanitized ? 100 : 600;
  int read_well = 0;
  for (std::uint32_t i = 0; i < kFiles; ++i) {
    std::string damaged = whole;
    for (std::uint32_t change = 0; change <= i % 6; ++change) {
      const RandomBits bits = philox(3, {i, change, 0, 0});
      constexpr unsigned char kWorst[] = {0, 1, 255, 127, 128, 16, 64, 9};
      damaged[bits[0] % damaged.size()] =
          static_cast<char>(bits[1] % 2 == 0 ? bits[2] : kWorst[bits[2] % 8]);
    }
    const auto responses = read_bytes(damaged);
    if (!responses.ok()) {
      ASSERT_GT(responses.error().message.size(), 20u);
      continue;
    }
    ++read_well;
    for (const float sample : responses->samples) ASSERT_TRUE(std::isfinite(sample)) << i;
    for (const Vec3f& direction : responses->directions)
      ASSERT_NEAR(length(direction), 1, 1e-5) << i;
  }
  EXPECT_GT(read_well, static_cast<int>(kFiles / 5));  // enough files are only lightly damaged
}

}  // namespace
}  // namespace clamor
