#include "formats/gltf/draco_codec.h"

#include <fmt/format.h>

#ifdef CLAMOR_HAS_DRACO
#include <algorithm>
#include <cstring>
#include <optional>
#include <string>

#include <draco/attributes/attribute_quantization_transform.h>
#include <draco/compression/decode.h>

#include "common/platform/child_process.h"
#include "formats/gltf/gltf_accessor.h"
#endif

namespace clamor {

#ifdef CLAMOR_HAS_DRACO

namespace {

// A plane of two million triangles takes 138 elements per byte, at 21 bytes of memory each; other
// meshes less than 10.
constexpr std::uint64_t kMaxElementsPerByte = 50, kMemoryPerElement_bytes = 60;
constexpr std::uint64_t kMinMemory_bytes = 1'000'000'000;
constexpr std::uint64_t kSlowest_elements_per_s = 500'000;  // of 10 million
constexpr unsigned kMinTime_s = 5, kWallPerCpu = 10;
constexpr std::uint64_t kFailed = ~std::uint64_t{0};

// What the child process writes before each geometry, or once, instead of all geometries, before
// the text of its error.
struct Header {
  std::uint64_t vertices = 0;  // kFailed before an error
  std::uint64_t indices = 0;   // before an error the number of the primitive
};

void put(FileBytes& out, const void* from, std::size_t count) {
  const std::size_t at = out.size();
  out.resize(at + count);
  std::memcpy(out.data() + at, from, count);
}

// Appends the values of all vertices, converted to T; false if they cannot be.
template <class T>
bool put_values(const draco::PointAttribute& attribute, int components, std::uint32_t vertices,
                FileBytes& out) {
  T values[4] = {};
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const auto index = attribute.mapped_index(draco::PointIndex(v));
    if (!attribute.ConvertValue<T>(index, static_cast<std::int8_t>(components), values))
      return false;
    put(out, values, sizeof(T) * static_cast<std::size_t>(components));
  }
  return true;
}

// Appends positions that the stream holds as whole steps from a corner, as Draco itself would.
bool put_positions(const draco::PointAttribute& attribute,
                   const draco::AttributeQuantizationTransform& rounding, float step,
                   std::uint32_t vertices, FileBytes& out) {
  std::int32_t steps[3] = {};
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (!attribute.ConvertValue<std::int32_t>(attribute.mapped_index(draco::PointIndex(v)), 3,
                                              steps))
      return false;
    for (int c = 0; c < 3; ++c) {
      const float value = static_cast<float>(steps[c]) * step + rounding.min_value(c);
      put(out, &value, sizeof value);
    }
  }
  return true;
}

bool put_attribute(const draco::PointAttribute& from, const DracoAttribute& as,
                   std::uint32_t vertices, FileBytes& out) {
  draco::AttributeQuantizationTransform rounding;
  double step = 0;
  const bool rounded =
      from.GetAttributeTransformData() != nullptr && rounding.InitFromAttribute(from);
  if (rounded)
    step = rounding.range() / static_cast<float>((1u << rounding.quantization_bits()) - 1);
  put(out, &step, sizeof step);
  if (rounded)
    return as.component_type == kGltfFloat && as.components == 3 && from.num_components() == 3 &&
           put_positions(from, rounding, static_cast<float>(step), vertices, out);
  switch (as.component_type) {
    case 5120:
      return put_values<std::int8_t>(from, as.components, vertices, out);
    case 5121:
      return put_values<std::uint8_t>(from, as.components, vertices, out);
    case 5122:
      return put_values<std::int16_t>(from, as.components, vertices, out);
    case 5123:
      return put_values<std::uint16_t>(from, as.components, vertices, out);
    case 5125:
      return put_values<std::uint32_t>(from, as.components, vertices, out);
    default:
      return put_values<float>(from, as.components, vertices, out);
  }
}

// Appends the header, indices and attributes of a primitive, or returns what is wrong.
std::optional<std::string> put_geometry(const DracoPrimitive& primitive, FileBytes& out) {
  draco::DecoderBuffer stream;
  stream.Init(reinterpret_cast<const char*>(primitive.stream.data()), primitive.stream.size());
  draco::Decoder decoder;
  decoder.SetSkipAttributeTransform(draco::GeometryAttribute::POSITION);  // tells their step
  const auto decoded = decoder.DecodeMeshFromBuffer(&stream);
  if (!decoded.ok())
    return fmt::format("is damaged ({}); copy or write the level again.",
                       decoded.status().error_msg_string());
  const draco::Mesh& mesh = *decoded.value();
  const std::uint32_t vertices = mesh.num_points(), triangles = mesh.num_faces();
  const Header header{vertices, std::uint64_t{3} * triangles};
  put(out, &header, sizeof header);
  for (std::uint32_t t = 0; t < triangles; ++t)
    for (const draco::PointIndex& corner : mesh.face(draco::FaceIndex(t))) {
      const std::uint32_t index = corner.value();
      put(out, &index, sizeof index);
    }
  for (const DracoAttribute& attribute : primitive.attributes) {
    const draco::PointAttribute* from = mesh.GetAttributeByUniqueId(attribute.id);
    if (from == nullptr)
      return fmt::format("has no attribute {}; write the level again.", attribute.id);
    if (from->num_components() != attribute.components ||
        !put_attribute(*from, attribute, vertices, out))
      return fmt::format(
          "has an attribute {} that differs from its accessor, of component type {} and {} "
          "components; write the level again.",
          attribute.id, attribute.component_type, attribute.components);
  }
  return std::nullopt;
}

FileBytes decode_all(std::span<const DracoPrimitive> primitives) {
  FileBytes out;
  for (std::size_t p = 0; p < primitives.size(); ++p)
    if (const auto problem = put_geometry(primitives[p], out)) {
      const Header header{kFailed, p};
      FileBytes error;
      put(error, &header, sizeof header);
      put(error, problem->data(), problem->size());
      return error;
    }
  return out;
}

// Finds the geometries in the bytes of the child process, which may have gone astray.
Result<DecodedDraco> located(FileBytes bytes, std::span<const DracoPrimitive> primitives) {
  const Error astray(
      "what Draco compressed crashes the library that reads it; write the level again without it.");
  DecodedDraco result;
  std::size_t at = 0;
  const auto skip = [&](std::uint64_t count, std::size_t element_bytes) {
    if (element_bytes > 0 && count > (bytes.size() - at) / element_bytes) return false;
    at += count * element_bytes;
    return true;
  };
  for (const DracoPrimitive& primitive : primitives) {
    Header header;
    if (!skip(1, sizeof header)) return astray;
    std::memcpy(&header, bytes.data() + at - sizeof header, sizeof header);
    if (header.vertices == kFailed) {
      const auto* text = reinterpret_cast<const char*>(bytes.data() + at);
      const std::string_view problem(text, bytes.size() - at);
      return header.indices < primitives.size()
                 ? Error(primitives[header.indices].name + ": its stream " + std::string(problem))
                 : astray;
    }
    DracoGeometry geometry{header.vertices, header.indices, at, {}, {}};
    if (!skip(header.indices, sizeof(std::uint32_t))) return astray;
    for (const DracoAttribute& attribute : primitive.attributes) {
      double step = 0;
      if (!skip(1, sizeof step)) return astray;
      std::memcpy(&step, bytes.data() + at - sizeof step, sizeof step);
      geometry.steps.push_back(step);
      geometry.attribute_offsets.push_back(at);
      if (!skip(header.vertices, component_bytes(attribute.component_type) *
                                     static_cast<std::size_t>(attribute.components)))
        return astray;
    }
    result.geometries.push_back(std::move(geometry));
  }
  result.bytes = std::move(bytes);
  return result;
}

}  // namespace

Result<DecodedDraco> decode_draco(std::span<const DracoPrimitive> primitives,
                                  std::size_t level_bytes) {
  std::uint64_t elements = 0;
  for (const DracoPrimitive& primitive : primitives)
    elements += std::min(primitive.stated_elements, kMaxElementsPerByte * level_bytes);
  elements = std::min(elements, kMaxElementsPerByte * level_bytes);
  ChildLimits limits;
  limits.memory_bytes = kMinMemory_bytes + kMemoryPerElement_bytes * elements;
  limits.max_result_bytes = limits.memory_bytes;
  limits.cpu_s = kMinTime_s + static_cast<unsigned>(elements / kSlowest_elements_per_s);
  limits.wall_s = kWallPerCpu * limits.cpu_s;
  auto bytes = in_child_process(limits, [&] { return decode_all(primitives); });
  if (!bytes.ok())
    return Error("what Draco compressed " + bytes.error().message +
                 "; write the level again without it.");
  return located(std::move(*bytes), primitives);
}

#else

Result<DecodedDraco> decode_draco(std::span<const DracoPrimitive>, std::size_t) {
  return Error(
      "this build of Clamor has no Draco library, which decodes its geometry; build Clamor with "
      "it, "
      "or write the level again without compression.");
}

#endif

}  // namespace clamor
