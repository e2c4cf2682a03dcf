// draco_fuzz.cpp: Draco streams. The library runs in a child process, and what it returns must lie
// within the bytes. Input: the component type and count of the attribute that is read, then the
// stream.
#include "formats/gltf/draco_codec.h"
#include "formats/gltf/gltf_accessor.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  DracoPrimitive primitive;
  primitive.name = "mesh 0";
  primitive.stream = std::as_bytes(std::span(data + 2, size - 2));
  const int type = 5120 + data[0] % 6;
  primitive.attributes = {{0, type == 5124 ? 5126 : type, 1 + data[1] % 4}};
  primitive.stated_elements = 1'000'000'000;  // more than a stream of this size may allocate
  const auto decoded = decode_draco(std::span(&primitive, 1), size);
  if (!decoded.ok()) {
    if (decoded.error().message.empty()) std::abort();
    return 0;
  }
  const DracoGeometry& geometry = decoded->geometries.at(0);
  const DracoAttribute& attribute = primitive.attributes[0];
  const std::size_t vertex_bytes =
      component_bytes(attribute.component_type) * static_cast<std::size_t>(attribute.components);
  const std::size_t step_bytes = sizeof(double);
  if (geometry.index_offset + 4 * geometry.indices + step_bytes !=
          geometry.attribute_offsets.at(0) ||
      geometry.attribute_offsets[0] + vertex_bytes * geometry.vertices != decoded->bytes.size())
    std::abort();
  return 0;
}
