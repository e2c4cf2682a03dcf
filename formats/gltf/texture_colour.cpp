#include "formats/gltf/texture_colour.h"

#include <array>
#include <string>
#include <utility>

#include <tiny_gltf.h>

#include "common/maths.h"

namespace clamor {

namespace {

// The item of a list of the document that an index names, or null.
const Json* item(const Json& document, const char* list, const Json* index) {
  const auto items = document.list(list);
  const auto known = index_below(index, items.size());
  return known ? &items[*known] : nullptr;
}

// The bytes of an image: a file of the level, a data URI or a buffer view; nothing if that fails.
std::optional<FileBytes> read_image(const GltfScene& scene, const Json& image,
                                    LevelFolder& folder) {
  if (const Json* const uri = image.find("uri"); uri != nullptr && uri->string() != nullptr) {
    auto bytes = folder.read(*uri->string());
    return bytes.ok() ? std::optional(std::move(*bytes)) : std::nullopt;
  }
  const auto view = index_below(image.find("bufferView"), scene.views.size());
  const auto bytes = view ? scene.bytes_of(scene.views[*view]) : std::nullopt;
  return bytes ? std::optional(FileBytes(bytes->begin(), bytes->end())) : std::nullopt;
}

}  // namespace

const Json* texture_image(const Json& document, const Json* index) {
  const Json* const texture = item(document, "textures", index);
  if (texture == nullptr) return nullptr;
  if (const Json* image = item(document, "images", texture->find("source"))) return image;
  for (const char* extension :
       {"KHR_texture_basisu", "EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds"})
    if (const Json* image =
            item(document, "images", texture->find({"extensions", extension, "source"})))
      return image;
  return nullptr;
}

std::optional<TextureMeans> image_means(const GltfScene& scene, const Json& image,
                                        LevelFolder& folder) {
  const auto bytes = read_image(scene, image, folder);
  return bytes ? texture_means(*bytes) : std::nullopt;
}

#ifdef TINYGLTF_NO_STB_IMAGE

std::optional<TextureMeans> texture_means(std::span<const std::byte>) { return std::nullopt; }

#else

namespace {

constexpr std::size_t kMaxImage_bytes = std::size_t{1} << 28;

// IEC 61966-2-1.
std::array<double, 256> linear_of_srgb() {
  std::array<double, 256> linear;
  for (std::size_t i = 0; i < linear.size(); ++i) {
    const double value = static_cast<double>(i) / 255;
    linear[i] = value <= 0.04045 ? value / 12.92 : power((value + 0.055) / 1.055, 2.4);
  }
  return linear;
}

}  // namespace

std::optional<TextureMeans> texture_means(std::span<const std::byte> image) {
  if (image.empty() || image.size() > kMaxImage_bytes) return std::nullopt;
  tinygltf::Image decoded;
  std::string error, warning;
  if (!tinygltf::LoadImageData(&decoded, 0, &error, &warning, 0, 0,
                               reinterpret_cast<const unsigned char*>(image.data()),
                               static_cast<int>(image.size()), nullptr))
    return std::nullopt;
  if (decoded.component != 4 || decoded.bits != 8 || decoded.image.empty() ||
      decoded.image.size() % 4 != 0)
    return std::nullopt;
  static const std::array<double, 256> kLinear = linear_of_srgb();
  Vec3 sum(0);
  double weight = 0;
  std::size_t clear = 0;
  for (std::size_t i = 0; i < decoded.image.size(); i += 4) {
    const double alpha = decoded.image[i + 3] / 255.0;
    for (int c = 0; c < 3; ++c)
      sum[c] += alpha * kLinear[decoded.image[i + static_cast<std::size_t>(c)]];
    weight += alpha;
    clear += decoded.image[i + 3] == 0 ? 1 : 0;
  }
  const auto pixels = static_cast<double>(decoded.image.size() / 4);
  TextureMeans means{std::nullopt, weight / pixels, static_cast<double>(clear) / pixels};
  if (weight > 0) means.colour = Vec3f(sum / weight);
  return means;
}

#endif

}  // namespace clamor
