// page.h: encodes the sources of an octree node. bake_format.md documents the layout.
//
// Sources on the same plane are grouped and sorted along it, so normal and material are stored once
// per plane, and positions as one coordinate, small steps of a second, and small residuals of the
// third. The power of a band is stored as the residual of a prediction from the two bands below.
// The order by descending keys is not stored but restored by sorting; u and polarity are hashes of
// the other values (source_quantization.h).
//
// Threads: a PageDecoder is not thread-safe. decode() does not allocate.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/source_octree.h"

namespace clamor {

struct Emitter;

// Upper bound of an unpacked page. Larger claims are an Error before any byte is read.
constexpr std::size_t max_page_bytes(std::size_t sources) { return 256 + 104 * sources; }

// Size of a source in columns.
inline constexpr std::size_t kColumnBytes = 88;

// The sources of a page as columns, by descending key.
struct PageColumns {
  template <class T>
  using Column = std::array<T, kLeafSources>;

  std::uint32_t count = 0;
  alignas(64) std::array<Column<float>, 3> position_m, normal, mirror;  // x, y, z
  alignas(64) std::array<Column<float>, kBandCount> power;
  alignas(64) Column<float> delay_s, patch_radius_m, u;
  alignas(64) Column<std::uint32_t> emitter;
  alignas(64) Column<std::uint16_t> material;
  alignas(64) Column<std::int8_t> polarity;
  alignas(64) Column<std::uint8_t> is_emitter;

  Source source(std::size_t index) const;
};

std::vector<Source> sources_of(const PageColumns& columns);

// Sets everything but u from an entry of the emitter table.
void set_from_emitter(Source& source, const Emitter& emitter);

// Encodes a page, not yet compressed. Quantized sources are preserved exactly; others are rounded.
// u, polarity and order are stored only if they differ from what the decoder would derive.
std::vector<std::byte> encode_page(const NodeSummary& node, std::span<const Source> sources,
                                   int mirror_bits);

struct PageWorkspace;

class PageDecoder {
 public:
  PageDecoder();
  PageDecoder(PageDecoder&&) noexcept;
  PageDecoder& operator=(PageDecoder&&) noexcept;
  ~PageDecoder();

  // Decodes a zstd frame. Validates every index and value against the tables and the bounds of the
  // node. The sources of a probe have first legs (first_leg.h) in place of emitters, with
  // values below `first_legs`; 0: this is no page of a probe.
  Result<void> decode(const NodeSummary& node, std::span<const std::byte> frame,
                      std::span<const Emitter> emitters, std::size_t materials,
                      PageColumns& columns, std::uint32_t first_legs = 0);

  // Decodes the contents of a frame.
  Result<void> decode_unpacked(const NodeSummary& node, std::span<const std::byte> page,
                               std::span<const Emitter> emitters, std::size_t materials,
                               PageColumns& columns, std::uint32_t first_legs = 0);

 private:
  std::unique_ptr<PageWorkspace> workspace_;
};

// The buffers of a reader of pages, which takes longer to make than to read a page with.
struct PageReader {
  PageDecoder decoder;
  PageColumns columns;
  std::vector<std::byte> copy;  // of bytes that might change while they are read
};

// Decodes the contents of a frame into sources, for occasional use.
Result<std::vector<Source>> decode_page(const NodeSummary& node, std::span<const std::byte> page,
                                        std::span<const Emitter> emitters, std::size_t materials);

}  // namespace clamor
