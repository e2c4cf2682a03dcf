// level_builder.h: small glTF levels in a temporary folder.
#pragma once

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/gltf/level_import.h"

namespace clamor::testing {

using nlohmann::json;

inline std::string base64(const std::string& bytes) {
  constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kAlphabet[bits >> (18 - 6 * k) & 63];
  }
  return out;
}

template <class T>
std::string raw(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

inline std::string glb(const json& document, const std::string& bin) {
  std::string text = document.dump(), data = bin;
  while (text.size() % 4 != 0) text += ' ';
  while (data.size() % 4 != 0) data += '\0';
  const auto word = [](std::size_t value) {
    return raw(std::vector<std::uint32_t>{static_cast<std::uint32_t>(value)});
  };
  return "glTF" + word(2) + word(28 + text.size() + data.size()) + word(text.size()) + "JSON" +
         text + word(data.size()) + std::string("BIN\0", 4) + data;
}

// A 16-bit WAV file with half a second of a tone.
inline std::string wav(int frames = 24000, int rate_hz = 48000) {
  const auto u32 = [](std::size_t v) {
    return raw(std::vector<std::uint32_t>{static_cast<std::uint32_t>(v)});
  };
  std::vector<std::int16_t> samples(static_cast<std::size_t>(frames));
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<std::int16_t>(
        16384 * std::sin(2 * 3.14159265358979 * 1000 * static_cast<double>(i) / rate_hz));
  const std::string data = raw(samples);
  return "RIFF" + u32(36 + data.size()) + "WAVEfmt " + u32(16) +
         raw(std::vector<std::uint16_t>{1, 1}) + u32(static_cast<std::size_t>(rate_hz)) +
         u32(static_cast<std::size_t>(rate_hz) * 2) + raw(std::vector<std::uint16_t>{2, 16}) +
         "data" + u32(data.size()) + data;
}

class LevelTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = ::testing::TempDir() + "clamor_level_XXXXXX";
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) const {
    const std::string path = folder_ + "/" + name;
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }

  // Appends data to buffer 0 and returns the view on it.
  int view(const std::string& bytes, int stride = 0) {
    while (bin_.size() % 4 != 0) bin_ += '\0';
    json v = {{"buffer", 0}, {"byteOffset", bin_.size()}, {"byteLength", bytes.size()}};
    if (stride != 0) v["byteStride"] = stride;
    bin_ += bytes;
    level_["bufferViews"].push_back(v);
    return static_cast<int>(level_["bufferViews"].size()) - 1;
  }
  int accessor(int view, int component, std::size_t count, const char* type,
               json more = json::object()) {
    json a = {{"componentType", component}, {"count", count}, {"type", type}};
    if (view >= 0) a["bufferView"] = view;
    a.update(more);
    level_["accessors"].push_back(a);
    return static_cast<int>(level_["accessors"].size()) - 1;
  }
  int floats(const std::vector<float>& values, const char* type = "VEC3", std::size_t width = 3) {
    return accessor(view(raw(values)), 5126, values.size() / width, type);
  }
  int mesh(json primitive) {
    level_["meshes"].push_back({{"name", "Shape"}, {"primitives", {primitive}}});
    return static_cast<int>(level_["meshes"].size()) - 1;
  }
  int node(json n) {
    level_["nodes"].push_back(n);
    return static_cast<int>(level_["nodes"].size()) - 1;
  }

  // One right triangle in the plane z = 0, on a node.
  void triangle() {
    positions_ = floats({0, 0, 0, 1, 0, 0, 0, 1, 0});
    mesh({{"attributes", {{"POSITION", positions_}}}});
    node({{"mesh", 0}, {"name", "Thing"}});
  }

  json finished() const {
    json out = level_;
    if (!out.contains("buffers"))
      out["buffers"] = {{{"byteLength", bin_.size()},
                         {"uri", "data:application/octet-stream;base64," + base64(bin_)}}};
    return out;
  }
  Result<ImportedLevel> import(const ImportOptions& options = {}) const {
    return import_level(write("level.gltf", finished().dump()), options);
  }
  Level level(const ImportOptions& options = {}) const {
    auto imported = import(options);
    EXPECT_TRUE(imported.ok()) << (imported.ok() ? "" : imported.error().message);
    return imported.ok() ? imported->level : Level{};
  }
  std::string refusal(const ImportOptions& options = {}) const {
    auto imported = import(options);
    EXPECT_FALSE(imported.ok());
    return imported.ok() ? "" : imported.error().message;
  }

  std::string folder_, bin_;
  json level_ = {{"asset", {{"version", "2.0"}}}};
  int positions_ = -1;
};

}  // namespace clamor::testing
