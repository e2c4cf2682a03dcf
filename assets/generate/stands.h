// stands.h: the stadium's stands, back wall and roof, swept round the bowl; and where one can
// stand.
#pragma once

#include <vector>

#include "bowl.h"
#include "mesh_builder.h"

namespace clamor::assets {

struct StandMaterials {
  MaterialIndex seats, stairs, wall, floor, roof, beams;
};

MeshBuilder make_lower_tier(const Bowl& bowl, const StandMaterials& materials);
MeshBuilder make_upper_tier(const Bowl& bowl, const StandMaterials& materials);
MeshBuilder make_concourse(const Bowl& bowl, const StandMaterials& materials);
MeshBuilder make_roof(const Bowl& bowl, const StandMaterials& materials);

struct Seat {
  Vec3 feet_m;
  Vec3 outward;  // away from the pitch
  int block;     // between two aisles of one tier
};

// Walking height on the stairs of an aisle at `out_m`, from the pitch (at a gate) to the walkway
// behind the lower tier: the straight line through the middle of the steps, so at most half a step
// above or below them.
constexpr double kFootOfGate_m = -1.925, kFirstTread_m = 0.2, kLastTread_m = 10.6;
constexpr double kWalkwayMiddle_m = 12.45;
double stairs_height_m(double out_m);

// Every seat of both tiers, row by row.
std::vector<Seat> seats_of(const Bowl& bowl);

}  // namespace clamor::assets
