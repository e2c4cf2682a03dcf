// far_level_test.cpp: a level far from the world's origin is baked, heard and described as one at
// it.
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "formats/bake_file/bake_file.h"
#include "tests/box_level.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

using testing::clamor;
using testing::Folder;
using ::testing::HasSubstr;

// A bake of a closed box of 4 x 3 x 5 m that is moved, and what is heard in it.
class MovedBox {
 public:
  explicit MovedBox(const Vec3& moved_m) : moved_m_(moved_m) {
    std::string level = testing::read(testing::level_of(folder_, testing::box({4, 3, 5}),
                                                        R"(, "materials": [{"name": "plaster"}])",
                                                        R"(, "material": 0)"));
    const std::string node = R"("nodes": [{"mesh": 0)";
    level.insert(level.find(node) + node.size(), ", \"translation\": [" + at(0, 0, 0) + "]");
    folder_.write("box.gltf", level);
    const auto baked = clamor({"bake", folder_ / "box.gltf", "-o", bake(), "--no-journal",
                               "--strict", "--photons", "3000", "--sources", "5000", "--emitter",
                               "name=click,signal=noise,at=" + at(1, 1.2, 1)});
    EXPECT_EQ(baked.code, 0) << baked.err;
  }

  std::string bake() const { return folder_ / "box.clamor"; }
  std::string at(double x, double y, double z) const {
    return std::to_string(moved_m_.x + x) + "," + std::to_string(moved_m_.y + y) + "," +
           std::to_string(moved_m_.z + z);
  }
  std::string answer(std::vector<std::string> command) const {
    const auto outcome = clamor(command);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  }
  std::string impulse() const {
    return answer({"impulse", bake(), "--listener", at(3, 1.5, 4), "--json"});
  }
  // Samples of both channels.
  std::vector<float> heard(const std::vector<std::string>& listener) const {
    std::vector<std::string> command{"render",    bake(), "-o",       folder_ / "heard.wav",
                                     "--seconds", "0.5",  "--format", "float"};
    command.insert(command.end(), listener.begin(), listener.end());
    answer(command);
    const std::string file = testing::read(folder_ / "heard.wav");
    const std::size_t data = file.find("data") + 8;
    std::vector<float> samples((file.size() - data) / sizeof(float));
    std::memcpy(samples.data(), file.data() + data, samples.size() * sizeof(float));
    return samples;
  }
  std::string walk() const {
    return folder_.write("walk.json", R"({"points": [{"time_s": 0, "position_m": [)" +
                                          at(3, 1.5, 4) + R"(]}, {"time_s": 1, "position_m": [)" +
                                          at(1, 1.5, 3) + "]}]}");
  }

 private:
  const Vec3 moved_m_;
  const Folder folder_;
};

// The level of the difference of two sounds, relative to the first.
double difference_db(const std::vector<float>& a, const std::vector<float>& b) {
  EXPECT_EQ(a.size(), b.size());
  double power = 0, of_difference = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    power += std::pow(static_cast<double>(a[i]), 2);
    of_difference += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
  }
  EXPECT_GT(power, 0);
  return 10 * std::log10(of_difference / power + 1e-20);
}

TEST(FarLevel, SoundsAsItDoesAtTheOrigin) {
  const MovedBox near({0, 0, 0});
  const auto standing = near.heard({"--listener", near.at(3, 1.5, 4)}),
             walking = near.heard({"--walk", near.walk()});
  const auto responses = nlohmann::json::parse(near.impulse());
  for (const Vec3& moved_m : {Vec3(1000, 0, -700), Vec3(500'000, 400, -2'600'000)}) {
    const MovedBox far(moved_m);
    // 0.01 dB is a difference of -59 dB.
    EXPECT_LT(difference_db(standing, far.heard({"--listener", far.at(3, 1.5, 4)})), -59);
    EXPECT_LT(difference_db(walking, far.heard({"--walk", far.walk()})), -59);
    const auto moved = nlohmann::json::parse(far.impulse());
    for (const char* key : {"g_db", "t30_s"})
      for (std::size_t b = 0; b < 8; ++b)
        EXPECT_NEAR(moved["energy"][key][b].get<double>(),
                    responses["energy"][key][b].get<double>(), 0.005)
            << key << ' ' << b;
  }
}

TEST(FarLevel, IsDescribedInTheWorld) {
  const MovedBox far({560'000, 0, -2'600'000});
  const auto json = nlohmann::json::parse(far.answer({"inspect", far.bake(), "--json"}));
  EXPECT_EQ(json["origin_m"], (nlohmann::json{560'000, 0, -2'600'000}));
  EXPECT_NEAR(json["emitters"][0]["position_m"][2].get<double>(), -2'599'999, 1e-6);
  EXPECT_THAT(far.answer({"inspect", far.bake()}), HasSubstr("560001.00 1.20 -2599999.00"));
  const auto outside = clamor({"impulse", far.bake(), "--listener", far.at(-3, 1.5, 4)});
  EXPECT_THAT(outside.err, HasSubstr("hardly anything is heard at 559997.00,1.5,-2599996.00"));
}

}  // namespace
}  // namespace clamor
