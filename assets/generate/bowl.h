// bowl.h: the plan of the stands: a rounded rectangle and its parallels, cut into blocks by aisles.
//
// The front edge of the stands runs through stations. A station is a point and the outward normal
// there, so the parallel at distance d outward is every point moved by d along its normal; rows,
// walls and roof all use the same stations and meet without gaps.
#pragma once

#include <vector>

#include "common/vec.h"

namespace clamor::assets {

class Bowl {
 public:
  Bowl();

  std::size_t station_count() const { return stations_.size(); }

  // Point of the parallel at `out_m` and height `up_m`; station may be between two (it is a
  // straight line from one to the next) and wraps round.
  Vec3 at(double station, double out_m, double up_m) const;
  Vec3 outward(double station) const;

  // Whether the segment from this station to the next is a stair aisle.
  bool is_aisle(std::size_t station) const { return stations_[station].aisle_follows; }

  // An aisle that also leads down to the pitch: the middle one of each long side.
  bool is_gate(std::size_t station) const { return stations_[station].is_gate; }
  std::size_t north_gate() const;  // of the side where -Z is

  // First station of every aisle, in order round the bowl.
  const std::vector<std::size_t>& aisles() const { return aisles_; }

 private:
  struct Station {
    Vec3 front_m, outward;
    bool aisle_follows, is_gate = false;
  };
  void add_side(const Vec3& from_m, const Vec3& to_m, int aisle_count, bool has_gate);
  void add_corner(const Vec3& centre_m, double from_rad);

  std::vector<Station> stations_;
  std::vector<std::size_t> aisles_;
};

}  // namespace clamor::assets
