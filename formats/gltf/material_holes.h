// material_holes.h: how much of a surface is open, by the alpha channel of its material.
//
// A fence, a grating or foliage is a few triangles with an alpha-masked texture. The share of its
// area that the mask cuts out is 1 - the mean alpha; sound passes there. Of a blended material only
// pixels that are fully transparent are open, because a pane of glass is blended as well.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/material.h"
#include "formats/files/level_folder.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/import_report.h"

namespace clamor {

struct MaterialHoles {
  double open_share = 0;
  double alpha = 1;        // mean
  bool is_masked = false;  // or blended
  bool is_read = true;     // false: the texture could not be decoded
};

// Nothing for opaque materials. Reads the texture from `folder`.
std::optional<MaterialHoles> material_holes(const GltfScene& scene, const Json& material,
                                            LevelFolder& folder);

// Opens a material: what does not hit it is absorbed and transmitted.
void open_material(double open_share, Material& material);

// Opens a material whose values come from its name, and says so. Values that were written for it
// (`is_explicit`) stay.
void apply_holes(const MaterialHoles& holes, const std::string& preset, bool is_explicit,
                 Material& material, ImportReport& report);

}  // namespace clamor
