// hrtf_from_sofa_test.cpp: HRTFs with other sample rates, lengths and sets of directions than
// KEMAR's, and invalid ones.
#include <cmath>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "runtime/hrtf/hrtf.h"
#include "tests/sanitized.h"
#include "tests/sofa_writer.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::plain_head;
using testing::SofaContent;

Result<std::shared_ptr<const Hrtf>> head_of(const SofaContent& content) {
  const testing::TemporaryFile file(".sofa", testing::SofaWriter(content).bytes());
  return Hrtf::read(file.path());
}

double level_db(const HrtfGains& levels, std::size_t band) {
  return 20 * std::log10(static_cast<double>(levels[band]));
}

TEST(HrtfFromSofa, KeepsLevelsAndTimesAtAnySampleRateAndLength) {
  constexpr double kHalfLag_s = 0.0003, kHalfLevel_db = 6;
  struct Case {
    double rate_hz;
    std::size_t directions;
    std::uint32_t frames;
    bool told_apart;
  };
  for (const auto& [rate_hz, directions, frames, told_apart] :
       {Case{44100, 100, 64, false}, Case{48000, 16, 256, false}, Case{96000, 64, 2000, false},
        Case{192000, 30, 512, true}, Case{44100, 100, 64, true}}) {
    SCOPED_TRACE(rate_hz);
    const auto head =
        head_of(plain_head(rate_hz, directions, frames, kHalfLag_s, kHalfLevel_db, told_apart));
    ASSERT_TRUE(head.ok()) << head.error().message;
    for (const Vec3& to : testing::directions_all_round(directions)) {
      const auto from = Vec3f(to);
      const auto levels = (*head)->gains(from);
      // Within a band, the levels at the ears differ as those of the responses do.
      for (std::size_t band = 4; band < kHrtfBands; ++band)
        EXPECT_NEAR(level_db(levels[0], band) - level_db(levels[1], band), 2 * kHalfLevel_db * to.y,
                    0.5)
            << "band " << band << " from y = " << to.y;
      const double lag_s =
          ((*head)->delay_frames(from, 1) - (*head)->delay_frames(from, 0)) / kSampleRate_hz;
      // The error is at most a frame at that rate plus 20 us.
      EXPECT_NEAR(lag_s, 2 * kHalfLag_s * to.y, 20e-6 + 1 / rate_hz) << to.y;
    }
  }
}

TEST(HrtfFromSofa, RejectsSetsThatDoNotSurroundTheListener) {
  const auto expect_refused = [](const std::vector<Vec3>& directions) {
    SofaContent content = plain_head(48000, directions.size(), 64);
    content.directions = directions;
    const auto head = head_of(content);
    ASSERT_FALSE(head.ok());
    EXPECT_NE(head.error().message.find("was not measured from all sides"), std::string::npos)
        << head.error().message;
  };
  std::vector<Vec3> above, ring, two, point;
  for (const Vec3& to : testing::directions_all_round(200))
    if (to.z > -0.1) above.push_back(to);
  const Vec3 diagonal = normalize(Vec3(1, 1, 1)), aside = normalize(Vec3(1, -1, 0));
  const Vec3 other = cross(diagonal, aside);
  for (int i = 0; i < 36; ++i) {
    ring.push_back(std::cos(0.1745 * i) * aside + std::sin(0.1745 * i) * other);  // on all sides
    two.push_back(i % 2 == 0 ? diagonal : -1.0 * diagonal);                       // of each axis
    point.push_back(diagonal);
  }
  for (const auto& directions : {above, ring, two, point}) expect_refused(directions);
}

// The responses are silent from some directions or all, or have a click at one ear only.
TEST(HrtfFromSofa, IsFiniteForSilentResponses) {
  for (const int kind : {0, 1, 2}) {
    SofaContent content = plain_head(48000, 20, 64);
    for (std::size_t i = 0; i < content.responses.size(); ++i) {
      const std::size_t direction = i / 128, ear = i / 64 % 2;
      if (kind == 0 || (kind == 1 && direction % 2 == 0) || (kind == 2 && ear == 1))
        content.responses[i] = 0;
    }
    const auto head = head_of(content);
    ASSERT_TRUE(head.ok()) << head.error().message;
    for (const Vec3& to : testing::directions_all_round(50)) {
      const auto from = Vec3f(to);
      const auto place = (*head)->place(from);
      for (const HrtfGains& ear : (*head)->gains(place))
        for (const float level : ear) EXPECT_TRUE(std::isfinite(level));
      for (const QuadratureGains& ear : (*head)->quadrature_gains(place))
        for (const float level : ear) EXPECT_TRUE(std::isfinite(level));
      EXPECT_TRUE(std::isfinite((*head)->delay_frames(from, 1)));
      EXPECT_TRUE(std::isfinite((*head)->low_itd_frames(place)));
    }
  }
}

}  // namespace
}  // namespace clamor
