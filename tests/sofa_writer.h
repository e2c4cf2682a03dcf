// sofa_writer.h: writes HRTFs as SOFA files (AES69), in the simplest HDF5 that libmysofa reads.
//
// One group of uncompressed tables; lists of dimensions are the strings that libmysofa makes of
// references. (The HDF Group. HDF5 File Format Specification, version 3.0.)
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "common/vec.h"

namespace clamor::testing {

struct SofaContent {
  double rate_hz = 48000;
  std::uint32_t frames = 0;
  std::vector<Vec3> directions;         // x ahead, y to the left, z up
  std::vector<double> responses;        // [direction][left, right][frames]
  std::vector<double> delays = {0, 0};  // frames: [left, right], or one pair per direction
  std::string convention = "SimpleFreeFieldHRIR";
  std::string data_type = "FIR";
  std::int64_t says_directions = -1;  // claims another number than there is
  bool right_first = false;           // order of the receivers
  Vec3 view = {1, 0, 0}, up = {0, 0, 1};
};

class SofaWriter {
 public:
  explicit SofaWriter(const SofaContent& content) {
    const std::size_t count = content.directions.size();
    file_.resize(48);  // the superblock is written last
    dimension("I", 1);
    dimension("C", 3);
    dimension("R", 2);
    dimension("E", 1);
    dimension("N", content.frames);
    dimension("M", content.says_directions < 0 ? static_cast<std::int64_t>(count)
                                               : content.says_directions);
    table("ListenerPosition", {1, 3}, {0, 0, 0}, "I,C", "cartesian", "metre");
    const double first = content.right_first ? -0.09 : 0.09;
    table("ReceiverPosition", {2, 3, 1}, {0, first, 0, 0, -first, 0}, "R,C,I", "cartesian",
          "metre");
    std::vector<double> places;
    for (const Vec3& d : content.directions) {
      constexpr double kDegrees = 57.29577951308232;
      places.push_back(std::fmod(kDegrees * std::atan2(d.y, d.x) + 360, 360));
      places.push_back(kDegrees * std::atan2(d.z, std::hypot(d.x, d.y)));
      places.push_back(1.4);
    }
    table("SourcePosition", {count, 3}, places, "M,C", "spherical", "degree, degree, metre");
    table("EmitterPosition", {1, 3, 1}, {0, 0, 0}, "E,C,I", "cartesian", "metre");
    const auto row = [](const Vec3& v) { return std::vector<double>{v.x, v.y, v.z}; };
    table("ListenerUp", {1, 3}, row(content.up), "I,C", "cartesian", "metre");
    table("ListenerView", {1, 3}, row(content.view), "I,C", "cartesian", "metre");
    table("Data.IR", {count, 2, content.frames}, content.responses, "M,R,N");
    table("Data.SamplingRate", {1}, {content.rate_hz}, "I", "", "hertz");
    table("Data.Delay", {content.delays.size() / 2, 2}, content.delays,
          content.delays.size() == 2 ? "I,R" : "M,R");
    finish(content);
  }

  const std::string& bytes() const { return file_; }

 private:
  // A little-endian integer of `bytes` bytes.
  static std::string number(std::uint64_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(value >> (8 * i)));
    return text;
  }
  static std::string zeros(std::size_t count) { return std::string(count, '\0'); }
  static std::string message(int type, const std::string& body) {
    return number(static_cast<std::uint64_t>(type), 1) + number(body.size(), 2) + zeros(1) + body;
  }
  static std::string attribute(const std::string& name, const std::string& value) {
    return message(12, std::string("\3\0", 2) + number(name.size() + 1, 2) + number(8, 2) +
                           number(4, 2) + zeros(1) + name + zeros(1) +
                           std::string("\x13\0\0\0", 4) + number(value.size(), 4) +
                           std::string("\2\0\0\0", 4) + value);
  }
  std::uint64_t append(const std::string& bytes) {
    const std::uint64_t at = file_.size();
    file_ += bytes;
    return at;
  }
  std::uint64_t object(const std::string& messages) {
    return append("OHDR" + std::string("\2\2", 2) + number(messages.size(), 4) + messages +
                  zeros(4));
  }

  void add(const std::string& name, const std::vector<std::size_t>& sizes,
           const std::vector<double>& values, const std::string& attributes) {
    std::string data(values.size() * sizeof(double), '\0');
    std::memcpy(data.data(), values.data(), data.size());
    std::string space = std::string("\2", 1) + number(sizes.size(), 1) + std::string("\0\1", 2);
    for (const std::size_t size : sizes) space += number(size, 8);
    const std::string doubles = std::string("\x11\x20\x3f\0", 4) + number(8, 4) + number(0, 2) +
                                number(64, 2) + std::string("\x34\x0b\0\x34", 4) + number(1023, 4);
    const std::string layout =
        std::string("\3\1", 2) + number(append(data), 8) + number(data.size(), 8);
    objects_.emplace_back(
        name, object(message(1, space) + message(3, doubles) + message(8, layout) + attributes));
  }
  void table(const std::string& name, const std::vector<std::size_t>& sizes,
             const std::vector<double>& values, const std::string& dimensions,
             const std::string& type = "", const std::string& units = "") {
    std::string attributes = attribute("DIMENSION_LIST", dimensions);
    if (!type.empty()) attributes += attribute("Type", type);
    if (!units.empty()) attributes += attribute("Units", units);
    add(name, sizes, values, attributes);
  }
  void dimension(const std::string& name, std::int64_t size) {
    std::string digits = std::to_string(size);
    digits.insert(0, std::string(10 - std::min<std::size_t>(10, digits.size()), ' '));
    add(name, {1}, {0},
        attribute("CLASS", "DIMENSION_SCALE") +
            attribute("NAME", "This is a netCDF dimension but not a netCDF variable." + digits));
  }

  void finish(const SofaContent& content) {
    // A fractal heap of one block that contains the group's links.
    const std::uint64_t heap = file_.size();
    const std::string head = "FRHP" + zeros(1) + number(8, 2) + number(0, 2) + number(2, 1) +
                             number(4096, 4) + zeros(8) + number(~0ULL, 8) + zeros(8) +
                             number(~0ULL, 8) + zeros(64) + number(4, 2) + number(1024, 8) +
                             number(65536, 8) + number(40, 2) + number(1, 2);
    append(head + number(heap + head.size() + 14, 8) + number(0, 2) + zeros(4));
    append("FHDB" + zeros(1) + number(heap, 8) + zeros(5 + 4));
    for (std::size_t i = 0; i < objects_.size(); ++i)
      append(std::string("\1\4", 2) + number(i, 8) + number(objects_[i].first.size(), 1) +
             objects_[i].first + number(objects_[i].second, 8));
    append(zeros(64));
    const std::uint64_t root =
        object(message(2, zeros(2) + number(heap, 8) + number(~0ULL, 8)) +
               attribute("Conventions", "SOFA") + attribute("SOFAConventions", content.convention) +
               attribute("DataType", content.data_type) + attribute("RoomType", "free field"));
    file_.replace(0, 48,
                  "\x89HDF\r\n\x1a\n" + std::string("\2\x8\x8\0", 4) + zeros(8) + number(~0ULL, 8) +
                      number(file_.size(), 8) + number(root, 8) + zeros(4));
  }

  std::string file_;
  std::vector<std::pair<std::string, std::uint64_t>> objects_;  // with their addresses
};

// Evenly distributed over the sphere.
inline std::vector<Vec3> directions_all_round(std::size_t count) {
  std::vector<Vec3> all;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = (2.0 * static_cast<double>(i) + 1) / static_cast<double>(count) - 1;
    const double turn = 2.4 * static_cast<double>(i), r = std::sqrt(1 - z * z);
    all.push_back({r * std::cos(turn), r * std::sin(turn), z});
  }
  return all;
}

// Two ears in a plane wave: the nearer ear is earlier by up to `half_lag_s` and louder by up to
// `half_level_db`, alike at all frequencies. Pulses are whole frames; with `told_apart`,
// early_frames of the delay are in Data.Delay.
inline SofaContent plain_head(double rate_hz, std::size_t directions, std::uint32_t frames,
                              double half_lag_s = 0.0003, double half_level_db = 6,
                              bool told_apart = false) {
  SofaContent content;
  content.rate_hz = rate_hz;
  content.frames = frames;
  content.directions = directions_all_round(directions);
  content.responses.resize(2 * directions * frames);
  if (told_apart) content.delays.clear();
  for (std::size_t d = 0; d < directions; ++d)
    for (std::size_t ear = 0; ear < 2; ++ear) {
      const double side = ear == 0 ? content.directions[d].y : -content.directions[d].y;
      const auto late = static_cast<std::size_t>(std::lround((1 - side) * half_lag_s * rate_hz));
      if (told_apart) content.delays.push_back(static_cast<double>(late));
      content.responses[(2 * d + ear) * frames + (told_apart ? 0 : late)] =
          0.5 * std::pow(10, half_level_db * side / 20);
    }
  return content;
}

}  // namespace clamor::testing
