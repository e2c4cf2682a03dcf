#include "stadium_walk.h"

#include <cmath>
#include <cstdio>

#include "bowl.h"
#include "stands.h"

namespace clamor::assets {

namespace {

constexpr double kEyes_m = 1.7;                            // above the feet
constexpr double kOnFlat_mps = 1.4, kOnStairs_mps = 0.75;  // along the way
constexpr double kTurning_s = 1.5;                         // by a quarter
constexpr double kAmongFans_m = 4.6;                       // out: between rows six and seven
constexpr double kNorth_deg = 0, kWest_deg = 90, kSouth_deg = 180;

// Writes points one after the other, as somebody walks, stands and turns.
class WalkWriter {
 public:
  WalkWriter(const Vec3& feet_m, double yaw_deg) : feet_m_(feet_m), yaw_deg_(yaw_deg) { write(); }

  void walk_to(const Vec3& feet_m, double speed_mps) {
    time_s_ += length(feet_m - feet_m_) / speed_mps;
    feet_m_ = feet_m;
    write();
  }
  void stand(double seconds) {
    time_s_ += seconds;
    write();
  }
  void turn_to(double yaw_deg) {
    time_s_ += kTurning_s * std::abs(yaw_deg - yaw_deg_) / 90;
    yaw_deg_ = yaw_deg;
    write();
  }

  std::string json() const {
    return "{ \"comment\": \"From the middle of the pitch of stadium.glb up the stairs into the "
           "fans\",\n  \"points\": [\n" +
           points_ + " ] }\n";
  }

 private:
  void write() {
    char point[128];
    std::snprintf(point, sizeof point,
                  "    { \"time_s\": %.2f, \"position_m\": [%.3f, %.3f, %.3f], \"yaw_deg\": %.0f }",
                  time_s_, feet_m_.x + 0.0, feet_m_.y + kEyes_m, feet_m_.z, yaw_deg_);
    points_ += (points_.empty() ? "" : ",\n") + std::string(point);
  }

  double time_s_ = 0;
  Vec3 feet_m_;
  double yaw_deg_;
  std::string points_;
};

}  // namespace

std::string make_stadium_walk() {
  const Bowl bowl;
  const auto on_stairs = [&](std::size_t aisle, double out_m) {
    return bowl.at(static_cast<double>(aisle) + 0.5, out_m, stairs_height_m(out_m));
  };
  // Aisles are numbered as one turns left, so the next one is to the west.
  const std::size_t gate = bowl.north_gate();
  std::size_t next = gate + 1;
  while (!bowl.is_aisle(next)) ++next;

  WalkWriter walk(Vec3(0), kNorth_deg);
  walk.stand(3);
  walk.walk_to(on_stairs(gate, kFootOfGate_m), kOnFlat_mps);
  walk.walk_to(on_stairs(gate, kFirstTread_m), kOnStairs_mps);
  walk.walk_to(on_stairs(gate, kLastTread_m), kOnStairs_mps);
  walk.walk_to(on_stairs(gate, kWalkwayMiddle_m), kOnFlat_mps);
  walk.turn_to(kWest_deg);
  walk.walk_to(on_stairs(next, kWalkwayMiddle_m), kOnFlat_mps);
  walk.turn_to(kSouth_deg);
  walk.walk_to(on_stairs(next, kLastTread_m), kOnFlat_mps);
  walk.walk_to(on_stairs(next, kAmongFans_m), kOnStairs_mps);
  walk.stand(3);
  for (int quarter = 1; quarter <= 4; ++quarter) walk.turn_to(kSouth_deg + 90 * quarter);
  walk.stand(2);
  return walk.json();
}

}  // namespace clamor::assets
