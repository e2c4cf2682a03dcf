#include "formats/gltf/texture_colour.h"

#include <array>
#include <string>

#include <tiny_gltf.h>

#include "common/maths.h"

namespace clamor {

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
