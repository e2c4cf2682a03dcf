#include "formats/gltf/gltf_document.h"

#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "formats/files/file_kind.h"
#include "formats/gltf/gltf_check.h"
#include "formats/gltf/required_extensions.h"

namespace clamor {

namespace {

constexpr std::uint32_t kGlbMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinChunk = 0x004e4942;

struct Container {
  std::string_view json;
  std::span<const std::byte> bin;
  bool has_bin = false;
};

std::uint32_t word_at(std::span<const std::byte> bytes, std::size_t offset) {
  std::uint32_t word;
  std::memcpy(&word, bytes.data() + offset, sizeof word);
  return word;
}

std::string_view as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// glTF 2.0, section 4.4: a header of 12 bytes, then chunks of length, type and bytes.
Result<Container> unpack(std::span<const std::byte> file) {
  if (file.size() < 4 || word_at(file, 0) != kGlbMagic) return Container{as_text(file), {}, false};
  const Error cut("is cut short: its parts are longer than the file; copy or export it again.");
  if (file.size() < 20) return cut;
  if (word_at(file, 4) != 2)
    return Error(fmt::format(
        "is GLB version {}, but only version 2 is read; export it as glTF 2.0.", word_at(file, 4)));
  const std::size_t length = word_at(file, 8);
  if (length > file.size() || length < 20) return cut;
  file = file.first(length);

  Container result;
  bool has_json = false;
  for (std::size_t at = 12; at + 8 <= file.size();) {
    const std::size_t size = word_at(file, at);
    const std::uint32_t type = word_at(file, at + 4);
    if (size > file.size() - at - 8) return cut;
    const auto chunk = file.subspan(at + 8, size);
    if (type == kJsonChunk && !has_json) {
      result.json = as_text(chunk);
      has_json = true;
    } else if (type == kBinChunk && !result.has_bin) {
      result.bin = chunk;
      result.has_bin = true;
    }
    at += 8 + size;
  }
  if (!has_json) return Error("has no JSON chunk; export the level again.");
  return result;
}

// Whether views of the buffer are compressed as well, and are unpacked if it is not there.
bool is_fallback(const Json& buffer) {
  for (const char* extension : {"KHR_meshopt_compression", "EXT_meshopt_compression"})
    if (const Json* fallback = buffer.find({"extensions", extension, "fallback"}))
      if (fallback->boolean() != nullptr && *fallback->boolean()) return true;
  return false;
}

Result<FileBytes> read_buffer(const Json& buffer, std::size_t index, const Container& container,
                              LevelFolder& folder) {
  const Json* uri = buffer.find("uri");
  const auto length = static_cast<std::size_t>(*buffer.find("byteLength")->number());
  FileBytes bytes;
  if (uri != nullptr && uri->string() != nullptr) {
    auto read = folder.read(*uri->string());
    if (!read.ok()) return read.error().in(fmt::format("buffer {}", index));
    bytes = std::move(*read);
  } else if (index == 0 && container.has_bin) {
    bytes.assign(container.bin.begin(), container.bin.end());
  } else if (length > 0) {
    return Error(
        fmt::format("buffer {} has no data: neither a uri nor the GLB's binary chunk; "
                    "export the level again.",
                    index));
  }
  if (bytes.size() < length) {
    const std::string other = other_kind(bytes, FileKind::kUnknown);
    if (!other.empty()) return Error(fmt::format("buffer {} {}.", index, other));
    return Error(
        fmt::format("buffer {} is cut short: {} bytes where the level says {}; copy or "
                    "export it again.",
                    index, bytes.size(), length));
  }
  bytes.resize(length);
  return bytes;
}

}  // namespace

Result<GltfScene> read_gltf_document(const std::string& path, LevelFolder& folder,
                                     std::span<const std::string> ignored_extensions) {
  const auto file = folder.read_anywhere(path);
  if (!file.ok()) return file.error();
  const auto container = unpack(*file);
  if (!container.ok()) return container.error().in(path);
  auto json = parse_json(container->json);
  if (!json.ok()) return Error(path + ": " + json.error().message + ".");
  shorten_names(*json);

  GltfScene scene;
  scene.json = std::move(*json);
  if (const auto ok = check_required_extensions(scene.json, ignored_extensions); !ok.ok())
    return ok.error().in(path);
  if (const auto ok = read_gltf_lists(scene); !ok.ok()) return ok.error().in(path);
  for (const Json& buffer : scene.json.list("buffers")) {
    auto bytes = is_fallback(buffer) && buffer.find("uri") == nullptr
                     ? Result(FileBytes{})
                     : read_buffer(buffer, scene.buffers.size(), *container, folder);
    if (!bytes.ok() && is_fallback(buffer)) bytes = FileBytes{};
    if (!bytes.ok()) return bytes.error().in(path);
    scene.buffers.push_back(std::move(*bytes));
  }
  return scene;
}

}  // namespace clamor
