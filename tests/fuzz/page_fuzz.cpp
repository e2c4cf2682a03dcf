// page_fuzz.cpp: the contents of a page frame. The first two bytes are the number of sources of the
// node, the third the sizes of the tables; without emitters it is the page of a probe.
#include <cmath>
#include <memory>

#include "formats/bake_file/first_leg.h"
#include "formats/bake_file/page.h"
#include "formats/level/emitter.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  static PageDecoder decoder;
  static const auto columns = std::make_unique<PageColumns>();
  OctreeNode node;
  node.low_m = {-5, 0, -7.5f};
  node.high_m = {5, 4, 7.5f};
  node.source_count = data[0] | data[1] << 8;
  const std::vector<Emitter> emitters(data[2] % 8);
  const std::size_t materials = data[2] / 8;
  const std::uint32_t first_legs = emitters.empty() ? kFirstLegCodes : 0;
  const std::size_t origins = emitters.empty() ? kFirstLegCodes : emitters.size();
  const auto page = std::as_bytes(std::span(data, size)).subspan(3);
  if (!decoder.decode_unpacked(node, page, emitters, materials, *columns, first_legs).ok())
    return 0;
  if (columns->count != node.source_count) std::abort();
  for (const Source& source : sources_of(*columns)) {
    double sum = source.delay_s + source.patch_radius_m;
    for (const float power : source.power) sum += power;
    for (int axis = 0; axis < 3; ++axis)
      sum += source.position_m[axis] + source.normal[axis] + source.mirror[axis];
    if (!std::isfinite(sum) || source.emitter >= origins) std::abort();
    if (!(source.u > 0 && source.u <= 1)) std::abort();
    if (!source.is_emitter && source.material >= materials) std::abort();
    if (source.is_emitter && first_legs > 0) std::abort();
  }
  return 0;
}
