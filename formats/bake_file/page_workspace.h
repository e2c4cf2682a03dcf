// page_workspace.h: scratch memory of page decoding, internal to page_decoder.cpp and
// page_kernel.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "formats/bake_file/bake_layout.h"
#include "formats/bake_file/bit_reader.h"
#include "formats/bake_file/page.h"
#include "formats/level/emitter.h"

namespace clamor {

struct PageWorkspace {
  using Place = std::uint16_t;
  using Numbers = std::array<std::int32_t, kLeafSources + 4>;  // vector stores write groups of four
  using PlaneRecord = std::array<float, 4>;                    // normal; bits of the material index
  // Axes (0 to 2; u and v follow w cyclically) and slopes of a plane, and the position of its first
  // source.
  struct PlaneOrigin {
    std::uint32_t axis_u, axis_v, axis_w;
    std::int32_t slope_u, slope_v;
    std::int32_t first_u, first_v, first_w;  // on the grid; v relative to the lower bound
  };

  ZstdDecompressor unpacker;
  alignas(64) std::array<std::byte, max_page_bytes(kLeafSources) + BitReader::kSlackBytes> page;

  BitReader bits{{}};
  std::size_t rows = 0, emitter_rows = 0, planes = 0;
  std::uint32_t flags = 0;
  int mirror_bits = 0;
  std::int32_t top = 0, silent = 0;

  // In stored order: secondary sources plane by plane, then emitters.
  alignas(64) PageColumns::Column<PlaneRecord> plane;
  PageColumns::Column<PlaneOrigin> plane_origin;
  PageColumns::Column<Place> plane_of_row;
  PageColumns::Column<std::uint8_t> begins_plane;    // 1 for the first row of a plane
  std::array<PageColumns::Column<float>, 3> normal;  // per plane, like the following up to slope_v
  Numbers more, first_u, first_w, longest, slope_u, slope_v;
  std::array<Numbers, 3> position, column;
  std::array<Numbers, kBandCount> steps;  // half decibels below the maximum
  alignas(64) PageColumns::Column<std::array<float, kBandCount>> power;  // one array per row
  Numbers radius, delay, emitter, scratch;
  std::array<Numbers, 2> mirror;
  PageColumns::Column<float> number;
  PageColumns::Column<std::int8_t> sign;
  PageColumns::Column<Source> emitter_sources;

  // For sorting.
  PageColumns::Column<double> power_sum;
  PageColumns::Column<std::uint32_t> keys;
  Numbers slots;
  PageColumns::Column<std::uint64_t> entries;  // key and row
  PageColumns::Column<Place> order;            // rows by descending key
};

// Tables that pages refer to.
struct PageTables {
  std::span<const Emitter> emitters;
  std::size_t materials = 0;
  const float* power = nullptr;   // power_table()
  const float* radius = nullptr;  // radius_table()
};

// Decodes the first `bytes` of workspace.page. Returns a predicate that describes the error, or
// null.
const char* decode_page_with(PageWorkspace& workspace, std::size_t bytes, const NodeSummary& node,
                             const PageTables& tables, PageColumns& columns);

}  // namespace clamor
