// section_writer.h: appends checksummed sections to a file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "common/result.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/files/byte_sink.h"

namespace clamor {

// A range of the file.
struct FileSection {
  std::uint64_t offset = 0, bytes = 0, hash = 0;
};

class SectionWriter {
 public:
  explicit SectionWriter(ByteSink& file) : file_(file) {}

  Result<FileSection> append(std::span<const std::byte> bytes) {
    const FileSection section{offset_, bytes.size(), hash_of(bytes)};
    if (const auto written = file_.write(bytes); !written.ok()) return written.error();
    offset_ += bytes.size();
    return section;
  }

  // Pads with zeros to a multiple of 8.
  Result<void> align() {
    static constexpr std::array<std::byte, 8> kZeros{};
    const auto padding = append(std::span(kZeros).first((8 - offset_ % 8) % 8));
    return padding.ok() ? Result<void>() : Result<void>(padding.error());
  }

  std::uint64_t offset() const { return offset_; }
  const std::string& path() const { return file_.path(); }

 private:
  ByteSink& file_;
  std::uint64_t offset_ = 0;
};

}  // namespace clamor
