// level_fuzz.cpp: glTF as text and as GLB. Input: the JSON and, after a NUL, the binary chunk,
// combined to a GLB with valid lengths. After a first byte of 1 the rest is a raw .glb, after 2 a
// .gltf.
#include <algorithm>
#include <cstring>

#include "formats/gltf/level_import.h"
#include "tests/fuzz/fuzz_target.h"

using namespace clamor;

namespace {

std::string glb_of(std::string json, std::string binary) {
  const auto number = [](std::size_t value) {
    const auto word = static_cast<std::uint32_t>(value);
    std::string bytes(4, '\0');
    std::memcpy(bytes.data(), &word, 4);
    return bytes;
  };
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  std::string chunks = number(json.size()) + "JSON" + json;
  if (!binary.empty()) chunks += number(binary.size()) + std::string("BIN\0", 4) + binary;
  return "glTF" + number(2) + number(12 + chunks.size()) + chunks;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  std::string path;
  if (!text.empty() && text[0] == 1) {
    path = fuzz::file_with(text.substr(1), ".glb");
  } else if (!text.empty() && text[0] == 2) {
    path = fuzz::file_with(text.substr(1), ".gltf");
  } else {
    const std::size_t end = std::min(text.find('\0'), text.size());
    path = fuzz::file_with(
        glb_of(std::string(text.substr(0, end)),
               end < text.size() ? std::string(text.substr(end + 1)) : std::string()),
        ".glb");
  }
  ImportOptions options;
  options.emitters = {"name=n,signal=impulse,at=0,1,0"};
  const auto level = import_level(path, options);
  if (!level.ok() && level.error().message.empty()) std::abort();
  return 0;
}
