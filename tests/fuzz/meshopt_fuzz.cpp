// meshopt_fuzz.cpp: buffer views compressed by meshopt. Input: a byte that chooses mode and filter,
// the stride, the count in two bytes, and the stream.
#include "formats/gltf/meshopt_codec.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr const char* kModes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES", "MESHLETS"};
  constexpr const char* kFilters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"};
  if (size < 4) return 0;
  MeshoptView view;
  view.mode = kModes[data[0] & 3];
  view.filter = kFilters[data[0] >> 2 & 3];
  view.stride = data[1];
  view.count = data[2] | data[3] << 8;
  const auto unpacked = decode_meshopt(view, std::as_bytes(std::span(data + 4, size - 4)));
  if (unpacked.ok() ? unpacked->size() != view.count * view.stride
                    : unpacked.error().message.empty())
    std::abort();
  return 0;
}
