// furniture.h: furniture, drapes and people of the presentation room.
#pragma once

#include "mesh_builder.h"

namespace clamor::assets {

struct FurnitureMaterials {
  MaterialIndex upholstery, wood, lacquer, metal, screen, curtain, person, stage;
};

// The figure faces -Z, with its feet at the origin.
MeshBuilder make_chair(const FurnitureMaterials& m);
MeshBuilder make_violinist(const FurnitureMaterials& m);
MeshBuilder make_lectern(const FurnitureMaterials& m);
MeshBuilder make_music_stand(const FurnitureMaterials& m);
MeshBuilder make_piano(const FurnitureMaterials& m);  // keyboard towards -X, lid open towards -X

MeshBuilder make_table(const FurnitureMaterials& m, double width_m, double depth_m);
MeshBuilder make_shelf(const FurnitureMaterials& m);

// One drape in pleats, along Z from the origin, its hem at height 0.
MeshBuilder make_drape(const FurnitureMaterials& m, double width_m, double height_m);

}  // namespace clamor::assets
