#include "formats/gltf/texture_image.h"

#include <algorithm>

namespace clamor {

namespace {

// The item of a list of the document, or null.
const Json* item(const Json& document, const char* list, const Json* index) {
  const Json* const items = document.find(list);
  if (items == nullptr || items->array() == nullptr || index == nullptr) return nullptr;
  const double* const number = index->number();
  if (number == nullptr || !(*number >= 0) ||
      *number >= static_cast<double>(items->array()->size()))
    return nullptr;
  return &(*items->array())[static_cast<std::size_t>(*number)];
}

std::size_t size_in(const Json& view, const char* key) {
  const Json* const value = view.find(key);
  constexpr double kMost = 1e15;  // beyond every buffer
  return value != nullptr && value->number() != nullptr && *value->number() > 0
             ? static_cast<std::size_t>(std::min(*value->number(), kMost))
             : 0;
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

std::optional<FileBytes> read_image(const Json& document, std::span<const FileBytes> buffers,
                                    const Json& image, LevelFolder& folder) {
  if (const Json* const uri = image.find("uri"); uri != nullptr && uri->string() != nullptr) {
    auto bytes = folder.read(*uri->string());
    return bytes.ok() ? std::optional(std::move(*bytes)) : std::nullopt;
  }
  const Json* const view = item(document, "bufferViews", image.find("bufferView"));
  if (view == nullptr) return std::nullopt;
  const std::size_t buffer = size_in(*view, "buffer"), offset = size_in(*view, "byteOffset"),
                    length = size_in(*view, "byteLength");
  if (buffer >= buffers.size()) return std::nullopt;
  const std::span<const std::byte> bytes = buffers[buffer];
  if (offset > bytes.size() || length > bytes.size() - offset) return std::nullopt;
  const auto part = bytes.subspan(offset, length);
  return FileBytes(part.begin(), part.end());
}

}  // namespace clamor
