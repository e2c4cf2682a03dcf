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
  template <class T>
  using Column = PageColumns::Column<T>;

  // Axes (0 to 2; u and v follow w cyclically) and slopes of a plane, and the position of its first
  // source.
  struct PlaneOrigin {
    std::uint32_t axis_u, axis_v, axis_w;
    std::int32_t slope_u, slope_v;
    std::int32_t first_u, first_v, first_w;  // on the grid; v relative to the lower bound
  };

  struct Header {
    std::uint32_t flags = 0;
    int mirror_bits = 0;
    std::int32_t max_power = 0, silent_step = 0;  // half decibels; steps below max_power
  };

  struct Planes {
    std::size_t count = 0;
    alignas(64) Column<PlaneRecord> record;
    Column<PlaneOrigin> origin;
    std::array<Column<float>, 3> normal;
    Numbers extra_rows, first_u, first_w, dominant_axis, slope_u, slope_v;
  };

  // Secondary sources plane by plane, then emitters, for which only emitter, u, polarity and plane
  // are stored.
  struct Rows {
    std::size_t count = 0;  // of secondary sources
    Column<Place> plane;
    Column<std::uint8_t> begins_plane;  // 1 for the first row of a plane
    std::array<Numbers, 3> position;
    std::array<Numbers, kBandCount> steps;  // half decibels below the maximum
    alignas(64) Column<std::array<float, kBandCount>> power;
    Numbers radius, delay, emitter;
    std::array<Numbers, 2> mirror;
    Column<float> u;
    Column<std::int8_t> polarity;
  };

  struct Emitters {
    std::size_t count = 0;
    Column<Source> sources;
  };

  struct Sorting {
    Column<double> power_sum;
    Column<std::uint32_t> keys;
    Numbers buckets;
    Column<std::uint64_t> entries;  // key and row
    Column<Place> order;            // rows by descending key
  };

  ZstdDecompressor unpacker;
  alignas(64) std::array<std::byte, max_page_bytes(kLeafSources) + BitReader::kSlackBytes> page;
  BitReader bits{{}};

  Header header;
  Planes planes;
  Rows rows;
  Emitters emitters;
  Sorting sorting;
  std::array<Numbers, 3> column;
  Numbers scratch;
};

// Tables that pages refer to.
struct PageTables {
  std::span<const Emitter> emitters;
  std::size_t materials = 0;
  const float* power = nullptr;   // power_table()
  const float* radius = nullptr;  // radius_table()
  // If not 0, sources have first legs (first_leg.h) below this in place of emitters.
  std::uint32_t first_legs = 0;
};

// Decodes the first `bytes` of workspace.page. Returns a predicate that describes the error, or
// null.
const char* decode_page_with(PageWorkspace& workspace, std::size_t bytes, const NodeSummary& node,
                             const PageTables& tables, PageColumns& columns);

}  // namespace clamor
