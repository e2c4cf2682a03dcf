// page.h: the sources of one octree node, packed to the bit. bake_format.md draws it.
//
// Sources that lie on one plane are kept together, sorted along it: then the normal and the
// material are told once, and of the position one coordinate, small steps in the second, and next
// to nothing in the third. A band's power is told as its difference from what the two bands below
// suggest. The order of the octree (descending keys) is not told but found again, and neither are u
// and polarity: they are hashes of the rest (source_quantization.h).
//
// Threads: a PageDecoder belongs to one thread. decode() allocates nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/bake_file/source_octree.h"
#include "formats/level/level.h"

namespace clamor {

// No page is larger, unpacked; one that says so is refused before a byte of it is touched.
constexpr std::size_t max_page_bytes(std::size_t sources) { return 256 + 104 * sources; }

// What a source takes as columns.
inline constexpr std::size_t kColumnBytes = 88;

// The sources of a page, column by column, by descending key.
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

// What an emitter is as a source, from the emitter table. u is left alone.
void set_from_emitter(Source& source, const Emitter& emitter);

// The page of a node, not yet a zstd frame. Sources that quantize_sources() has seen come back as
// they are; others as their nearest neighbours. u, polarity and order are stored where they are not
// what they would be found to be.
std::vector<std::byte> encode_page(const NodeSummary& node, std::span<const Source> sources,
                                   int mirror_bits);

struct PageWorkspace;

class PageDecoder {
 public:
  PageDecoder();
  PageDecoder(PageDecoder&&) noexcept;
  PageDecoder& operator=(PageDecoder&&) noexcept;
  ~PageDecoder();

  // From the zstd frame. Every index and number is checked against the tables and the node's box.
  Result<void> decode(const NodeSummary& node, std::span<const std::byte> frame,
                      std::span<const Emitter> emitters, std::size_t materials,
                      PageColumns& columns);

  // From what is in the frame.
  Result<void> decode_unpacked(const NodeSummary& node, std::span<const std::byte> page,
                               std::span<const Emitter> emitters, std::size_t materials,
                               PageColumns& columns);

 private:
  std::unique_ptr<PageWorkspace> workspace_;
};

// The same for those who read one page now and then.
Result<std::vector<Source>> decode_page(const NodeSummary& node, std::span<const std::byte> page,
                                        std::span<const Emitter> emitters, std::size_t materials);

}  // namespace clamor
