#include "formats/gltf/material_holes.h"

#include <algorithm>

#include <fmt/format.h>

#include "formats/gltf/texture_colour.h"

namespace clamor {

namespace {

constexpr double kWorthSaying = 0.005;  // a smaller open share changes no decibel

// The first of the paths that the material has; the second is that of an archived extension.
const Json* either(const Json& material, const char* metallic, const char* glossy) {
  if (const Json* value = material.find({"pbrMetallicRoughness", metallic})) return value;
  return material.find({"extensions", "KHR_materials_pbrSpecularGlossiness", glossy});
}

double alpha_factor(const Json& material) {
  const Json* factor = either(material, "baseColorFactor", "diffuseFactor");
  if (factor == nullptr || factor->array() == nullptr || factor->array()->size() != 4) return 1;
  const double* alpha = (*factor->array())[3].number();
  return alpha == nullptr ? 1 : std::clamp(*alpha, 0.0, 1.0);
}

}  // namespace

std::optional<MaterialHoles> material_holes(const GltfScene& scene, const Json& material,
                                            LevelFolder& folder) {
  const std::string mode = material.text("alphaMode");
  if (mode.empty() || mode == "OPAQUE") return std::nullopt;
  MaterialHoles holes;
  holes.is_masked = mode == "MASK";
  const double factor = alpha_factor(material);
  const Json* const texture = either(material, "baseColorTexture", "diffuseTexture");
  if (texture == nullptr) {
    const double* const cutoff = material.number("alphaCutoff");
    holes.alpha = factor;
    holes.open_share =
        factor <= 0 || (holes.is_masked && factor < (cutoff == nullptr ? 0.5 : *cutoff)) ? 1 : 0;
    return holes;
  }
  std::optional<TextureMeans> means;
  if (const Json* image = texture_image(scene.json, texture->find("index")))
    means = image_means(scene, *image, folder);
  holes.is_read = means.has_value();
  if (!means) return holes;
  holes.alpha = factor * means->alpha;
  holes.open_share = holes.is_masked ? 1 - holes.alpha : factor <= 0 ? 1 : means->clear_share;
  return holes;
}

void open_material(double open_share, Material& material) {
  const auto open = static_cast<float>(open_share);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    material.absorption[b] = open + (1 - open) * material.absorption[b];
    material.transmission[b] = open + (1 - open) * material.transmission[b];
  }
}

void apply_holes(const MaterialHoles& holes, const std::string& preset, bool is_explicit,
                 Material& material, ImportReport& report) {
  const std::string who = fmt::format("material '{}' is {}", material.name,
                                      holes.is_masked ? "alpha-masked" : "blended");
  const auto sidecar_line = [&](double open) {
    return fmt::format(
        R"(the sidecar's "materials": {{ "{}": {{ "preset": "{}", "absorption": {:.2g}, "transmission": {:.2g} }} }})",
        material.name, preset, open, open);
  };
  if (!holes.is_read) {
    if (is_explicit || !holes.is_masked) return;
    report.warnings.push_back(fmt::format(
        "{}, but its texture cannot be read, so that it is taken for solid; say what passes, as in "
        "{}",
        who, sidecar_line(0.5)));
    return;
  }
  if (holes.open_share < kWorthSaying) {
    if (!is_explicit && !holes.is_masked && preset != "glass" && holes.alpha < 1 - kWorthSaying)
      report.found.push_back(fmt::format(
          "{} with a mean alpha of {:.2f} and taken for a solid pane; if sound passes it, write {}",
          who, holes.alpha, sidecar_line(1 - holes.alpha)));
    return;
  }
  if (is_explicit) {
    report.found.push_back(fmt::format("{}, {:.0f} % open, but has acoustic values, which count",
                                       who, 100 * holes.open_share));
    return;
  }
  open_material(holes.open_share, material);
  report.found.push_back(
      fmt::format("{}, {:.0f} % open by its alpha, and transmits that share of the sound", who,
                  100 * holes.open_share));
}

}  // namespace clamor
