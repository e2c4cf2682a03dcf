#include "stands.h"

#include <algorithm>
#include <cmath>

namespace clamor::assets {

namespace {

struct Tier {
  double front_m, first_tread_m, rise_m;
  int rows;
};
constexpr double kTread_m = 0.8;
constexpr Tier kLower{0, 1.2, 0.38, 14};
constexpr Tier kUpper{13.7, 9.7, 0.52, 12};
constexpr double kParapet_m = 0.85;
constexpr double kSeatPitch_m = 0.5;
constexpr double kDoorHeight_m = 2.3;
constexpr double kGateTread_m = 0.35, kGateRise_m = 0.2;  // of the stairs from the pitch
constexpr int kGateSteps = 5;                             // and the last leads to the first tread

constexpr double tread_height_m(const Tier& tier, int row) {
  return tier.first_tread_m + tier.rise_m * row;
}
constexpr double back_m(const Tier& tier) { return tier.front_m + kTread_m * tier.rows; }

constexpr double kWalkway_m = tread_height_m(kLower, 13);    // height of walkway and concourse
constexpr double kUpperBack_m = back_m(kUpper) + 1.6;        // behind the last row's gangway
constexpr double kUpperTop_m = tread_height_m(kUpper, 11);   // height of that gangway
constexpr double kBackWallTop_m = 18.4;                      // the wind passes above it
constexpr double kRoofFront_m = 1, kRoofFrontHeight_m = 23;  // over the first row
constexpr double kRoofBack_m = 26.5, kRoofBackHeight_m = 20.2;
constexpr double kRoofThickness_m = 0.5;

struct Edge {
  double out_m, up_m;
};

// One segment of the surface that joins two parallels. Seen from the side that lies to the left of
// the way from a to b when out is right and up is up, so upward for a tread, inward for a riser.
void segment(MeshBuilder& mesh, const Bowl& bowl, MaterialIndex material, std::size_t station,
             Edge a, Edge b) {
  const double s = static_cast<double>(station);
  mesh.quad(material, bowl.at(s, a.out_m, a.up_m), bowl.at(s, b.out_m, b.up_m),
            bowl.at(s + 1, b.out_m, b.up_m), bowl.at(s + 1, a.out_m, a.up_m));
}

void sweep(MeshBuilder& mesh, const Bowl& bowl, MaterialIndex material, Edge a, Edge b) {
  for (std::size_t s = 0; s < bowl.station_count(); ++s) segment(mesh, bowl, material, s, a, b);
}

// A stair step: riser, tread, and both its sides down to `foot_m`.
void step(MeshBuilder& mesh, const Bowl& bowl, MaterialIndex material, std::size_t station,
          Edge front, Edge back, double foot_m) {
  segment(mesh, bowl, material, station, front, {front.out_m, back.up_m});
  segment(mesh, bowl, material, station, {front.out_m, back.up_m}, back);
  const double s = static_cast<double>(station);
  mesh.quad(material, bowl.at(s, front.out_m, foot_m), bowl.at(s, back.out_m, foot_m),
            bowl.at(s, back.out_m, back.up_m), bowl.at(s, front.out_m, back.up_m));
  mesh.quad(material, bowl.at(s + 1, back.out_m, foot_m), bowl.at(s + 1, front.out_m, foot_m),
            bowl.at(s + 1, front.out_m, back.up_m), bowl.at(s + 1, back.out_m, back.up_m));
}

// Half as high as the rows, on the back half of a tread.
void half_step(MeshBuilder& mesh, const Bowl& bowl, MaterialIndex material, std::size_t station,
               Edge tread, double rise_m) {
  step(mesh, bowl, material, station, {tread.out_m + kTread_m / 2, tread.up_m},
       {tread.out_m + kTread_m, tread.up_m + rise_m / 2}, tread.up_m);
}

// From the pitch to the first tread, where the parapet is open.
void add_gate_stairs(MeshBuilder& mesh, const Bowl& bowl, MaterialIndex material,
                     std::size_t station) {
  for (int i = 0; i < kGateSteps; ++i) {
    const double out_m = kLower.front_m - kGateTread_m * (kGateSteps - i);
    step(mesh, bowl, material, station, {out_m, kGateRise_m * i},
         {out_m + kGateTread_m, kGateRise_m * (i + 1)}, 0);
  }
  segment(mesh, bowl, material, station, {kLower.front_m, kGateRise_m * kGateSteps},
          {kLower.front_m, kLower.first_tread_m});
}

void add_rows(MeshBuilder& mesh, const Bowl& bowl, const StandMaterials& materials,
              const Tier& tier) {
  for (int row = 0; row < tier.rows; ++row) {
    const Edge front{tier.front_m + kTread_m * row, tread_height_m(tier, row)};
    const Edge back{front.out_m + kTread_m, front.up_m};
    const bool is_last = row + 1 == tier.rows;
    const Edge next{back.out_m, back.up_m + tier.rise_m};
    for (std::size_t s = 0; s < bowl.station_count(); ++s) {
      const bool aisle = bowl.is_aisle(s);
      segment(mesh, bowl, aisle ? materials.stairs : materials.seats, s, front, back);
      if (is_last) continue;
      segment(mesh, bowl, aisle ? materials.stairs : materials.wall, s, back, next);
      if (aisle) half_step(mesh, bowl, materials.stairs, s, front, tier.rise_m);
    }
  }
}

// The wall in front of the first row, both sides and the top of what stands above its tread.
void add_parapet(MeshBuilder& mesh, const Bowl& bowl, const StandMaterials& materials,
                 const Tier& tier, double foot_m) {
  const double out = tier.front_m, top = tier.first_tread_m + kParapet_m, inside = out + 0.15;
  const MaterialIndex wall = materials.wall;
  for (std::size_t s = 0; s < bowl.station_count(); ++s) {
    if (bowl.is_gate(s)) {
      add_gate_stairs(mesh, bowl, materials.stairs, s);
      const double from = static_cast<double>(s), to = from + 1;
      const double low = tier.first_tread_m;
      mesh.quad(wall, bowl.at(from, inside, low), bowl.at(from, out, low), bowl.at(from, out, top),
                bowl.at(from, inside, top));
      mesh.quad(wall, bowl.at(to, out, low), bowl.at(to, inside, low), bowl.at(to, inside, top),
                bowl.at(to, out, top));
      continue;
    }
    segment(mesh, bowl, wall, s, {out, foot_m}, {out, top});
    segment(mesh, bowl, wall, s, {out, top}, {inside, top});
    segment(mesh, bowl, wall, s, {inside, top}, {inside, tier.first_tread_m});
  }
}

// A beam under the roof and the column it rests on, where a station is.
void add_frame(MeshBuilder& mesh, const Bowl& bowl, MaterialIndex material, double station) {
  const double width = 0.2;  // half of it
  const Vec3 out = bowl.outward(station), side(-out.z * width, 0, out.x * width);
  const Vec3 front = bowl.at(station, kRoofFront_m + 0.5, kRoofFrontHeight_m - kRoofThickness_m);
  const Vec3 back = bowl.at(station, kRoofBack_m - 0.5, kRoofBackHeight_m - kRoofThickness_m);
  const Vec3 slim(0, -0.5, 0), deep(0, -1.2, 0);
  mesh.hexahedron(material,
                  {front - side + slim, back - side + deep, back + side + deep, front + side + slim,
                   front - side, back - side, back + side, front + side},
                  MeshBuilder::Bottom::kClosed);
  const auto column = [&](double out_m, double up_m) { return bowl.at(station, out_m, up_m); };
  const double near = kUpperBack_m + 0.1, far = near + 0.6;
  const double top = kRoofBackHeight_m - kRoofThickness_m - 0.8;
  mesh.hexahedron(material,
                  {column(near, 0) - side, column(far, 0) - side, column(far, 0) + side,
                   column(near, 0) + side, column(near, top) - side, column(far, top) - side,
                   column(far, top) + side, column(near, top) + side},
                  MeshBuilder::Bottom::kClosed);
}

void add_seats(const Bowl& bowl, const Tier& tier, int first_block, std::vector<Seat>& seats) {
  const std::vector<std::size_t>& aisles = bowl.aisles();
  for (int row = 0; row < tier.rows; ++row) {
    const double out = tier.front_m + kTread_m * row + 0.4, up = tread_height_m(tier, row);
    for (std::size_t block = 0; block < aisles.size(); ++block) {
      const std::size_t begin = aisles[block] + 1;
      const std::size_t end =
          block + 1 < aisles.size() ? aisles[block + 1] : aisles[0] + bowl.station_count();
      double next_m = kSeatPitch_m;  // along the row to the next seat
      for (std::size_t s = begin; s < end; ++s) {
        const double at = static_cast<double>(s);
        const double length_m = length(bowl.at(at + 1, out, 0) - bowl.at(at, out, 0));
        const double room_m = s + 1 == end ? length_m - kSeatPitch_m : length_m;
        for (; next_m < room_m; next_m += kSeatPitch_m) {
          const double station = at + next_m / length_m;
          seats.push_back({bowl.at(station, out, up), bowl.outward(station),
                           first_block + static_cast<int>(block)});
        }
        next_m -= length_m;
      }
    }
  }
}

}  // namespace

MeshBuilder make_lower_tier(const Bowl& bowl, const StandMaterials& materials) {
  MeshBuilder mesh;
  add_parapet(mesh, bowl, materials, kLower, 0);
  add_rows(mesh, bowl, materials, kLower);
  sweep(mesh, bowl, materials.floor, {back_m(kLower), kWalkway_m}, {kUpper.front_m, kWalkway_m});
  return mesh;
}

MeshBuilder make_upper_tier(const Bowl& bowl, const StandMaterials& materials) {
  MeshBuilder mesh;
  // The wall behind the walkway; each aisle ends at a door to the concourse.
  const double parapet_top = kUpper.first_tread_m + kParapet_m,
               door_top = kWalkway_m + kDoorHeight_m;
  for (std::size_t s = 0; s < bowl.station_count(); ++s) {
    if (!bowl.is_aisle(s))
      segment(mesh, bowl, materials.wall, s, {kUpper.front_m, kWalkway_m},
              {kUpper.front_m, door_top});
  }
  sweep(mesh, bowl, materials.wall, {kUpper.front_m, door_top}, {kUpper.front_m, parapet_top});
  const double inside = kUpper.front_m + 0.15;
  sweep(mesh, bowl, materials.wall, {kUpper.front_m, parapet_top}, {inside, parapet_top});
  sweep(mesh, bowl, materials.wall, {inside, parapet_top}, {inside, kUpper.first_tread_m});
  add_rows(mesh, bowl, materials, kUpper);
  sweep(mesh, bowl, materials.floor, {back_m(kUpper), kUpperTop_m}, {kUpperBack_m, kUpperTop_m});
  return mesh;
}

MeshBuilder make_concourse(const Bowl& bowl, const StandMaterials& materials) {
  MeshBuilder mesh;
  sweep(mesh, bowl, materials.floor, {kUpper.front_m, kWalkway_m}, {kUpperBack_m, kWalkway_m});
  // The slab that carries the upper tier, seen from below.
  sweep(mesh, bowl, materials.wall, {kUpperBack_m, kUpperTop_m - 0.6},
        {kUpper.front_m, kUpper.first_tread_m - 0.4});
  // The outer wall, from the ground to above the last row.
  for (const auto& [low, high] :
       {Edge{0, kWalkway_m}, Edge{kWalkway_m, kUpperTop_m - 0.6},
        Edge{kUpperTop_m - 0.6, kUpperTop_m}, Edge{kUpperTop_m, kBackWallTop_m}})
    sweep(mesh, bowl, materials.wall, {kUpperBack_m, low}, {kUpperBack_m, high});
  return mesh;
}

MeshBuilder make_roof(const Bowl& bowl, const StandMaterials& materials) {
  MeshBuilder mesh;
  const Edge front{kRoofFront_m, kRoofFrontHeight_m}, back{kRoofBack_m, kRoofBackHeight_m};
  const Edge front_low{front.out_m, front.up_m - kRoofThickness_m};
  const Edge back_low{back.out_m, back.up_m - kRoofThickness_m};
  sweep(mesh, bowl, materials.roof, front, back);
  sweep(mesh, bowl, materials.roof, back_low, front_low);
  sweep(mesh, bowl, materials.roof, front_low, front);
  sweep(mesh, bowl, materials.roof, back, back_low);
  for (const std::size_t aisle : bowl.aisles())
    add_frame(mesh, bowl, materials.beams, static_cast<double>(aisle) + 0.5);
  return mesh;
}

// Up to the first tread at a gate, and from there to the walkway.
double stairs_height_m(double out_m) {
  const auto share = [out_m](double from_m, double to_m) {
    return std::clamp((out_m - from_m) / (to_m - from_m), 0.0, 1.0);
  };
  return kLower.first_tread_m * share(kFootOfGate_m, kFirstTread_m) +
         (kWalkway_m - kLower.first_tread_m) * share(kFirstTread_m, kLastTread_m);
}

std::vector<Seat> seats_of(const Bowl& bowl) {
  std::vector<Seat> seats;
  add_seats(bowl, kLower, 0, seats);
  add_seats(bowl, kUpper, static_cast<int>(bowl.aisles().size()), seats);
  return seats;
}

}  // namespace clamor::assets
