// page_decoder.cpp: implementation of PageDecoder (page.h). Decompresses the frame and calls
// page_kernel.cpp.
#include <algorithm>

#include "formats/bake_file/page.h"
#include "formats/bake_file/page_workspace.h"
#include "formats/bake_file/source_quantization.h"

namespace clamor {

namespace {

std::size_t room_for(const NodeSummary& node) {
  return max_page_bytes(std::min(node.source_count, kLeafSources));
}

Result<void> decode(PageWorkspace& workspace, std::size_t bytes, const NodeSummary& node,
                    std::span<const Emitter> emitters, std::size_t materials,
                    std::uint32_t first_legs, PageColumns& columns) {
  columns.count = 0;
  const PageTables tables{emitters, materials, power_table().data(), radius_table().data(),
                          first_legs};
  if (const char* const wrong = decode_page_with(workspace, bytes, node, tables, columns))
    return Error(wrong);
  return {};
}

}  // namespace

PageDecoder::PageDecoder() : workspace_(std::make_unique<PageWorkspace>()) {}
PageDecoder::PageDecoder(PageDecoder&&) noexcept = default;
PageDecoder& PageDecoder::operator=(PageDecoder&&) noexcept = default;
PageDecoder::~PageDecoder() = default;

Result<void> PageDecoder::decode(const NodeSummary& node, std::span<const std::byte> frame,
                                 std::span<const Emitter> emitters, std::size_t materials,
                                 PageColumns& columns, std::uint32_t first_legs) {
  PageWorkspace& workspace = *workspace_;
  const auto bytes =
      workspace.unpacker.unpack(frame, std::span(workspace.page).first(room_for(node)));
  if (!bytes.ok()) return bytes.error();
  return clamor::decode(workspace, *bytes, node, emitters, materials, first_legs, columns);
}

Result<void> PageDecoder::decode_unpacked(const NodeSummary& node, std::span<const std::byte> page,
                                          std::span<const Emitter> emitters, std::size_t materials,
                                          PageColumns& columns, std::uint32_t first_legs) {
  if (page.size() > room_for(node)) return Error("has the wrong size for its sources");
  std::copy(page.begin(), page.end(), workspace_->page.begin());
  return clamor::decode(*workspace_, page.size(), node, emitters, materials, first_legs, columns);
}

}  // namespace clamor
