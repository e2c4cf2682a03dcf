#include "formats/page.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>

#include "common/directivity.h"
#include "common/maths.h"
#include "common/random.h"

namespace clamor {

namespace {

constexpr double kDelaySteps_per_s = kSampleRate_hz * 16.0;
constexpr int kSilent = 0;  // power code; others are half decibels below the page's loudest, from 1
constexpr int kLowestTop = -1'000'000;  // of a page without power
constexpr int kHighestTop = 480;        // a power of 1e24, so that power / u stays finite
constexpr std::uint8_t kEmitterFlag = 1, kNegativeFlag = 2;

// 10 lg power in half decibels: a whole number for snapped powers. 20 lg 2 = 6.02...
double half_decibels(double power) { return 6.0205999132796239 * log2_of(power); }
double power_of(int steps) { return power(10.0, steps / 20.0); }

// Multi-byte values are kept one byte of all of them at a time: high bytes are alike and pack well.
class Columns {
 public:
  explicit Columns(std::size_t rows) : rows_(rows) {}

  template <class T, class Get>
  void add(Get get) {
    const std::size_t start = bytes_.size();
    bytes_.resize(start + rows_ * sizeof(T));
    for (std::size_t i = 0; i < rows_; ++i) {
      const T value = get(i);
      for (std::size_t k = 0; k < sizeof(T); ++k)
        bytes_[start + k * rows_ + i] = static_cast<std::byte>((value >> (8 * k)) & 0xff);
    }
  }

  std::vector<std::byte> take() { return std::move(bytes_); }
  void prepend(std::uint32_t a, std::int32_t b) {
    bytes_.resize(kPageHeaderBytes);
    std::memcpy(bytes_.data(), &a, 4);
    std::memcpy(bytes_.data() + 4, &b, 4);
  }

 private:
  std::size_t rows_;
  std::vector<std::byte> bytes_;
};

class ColumnReader {
 public:
  ColumnReader(std::span<const std::byte> bytes, std::size_t rows)
      : at_(bytes.data()), rows_(rows) {}

  template <class T, class Set>
  void read(Set set) {
    for (std::size_t i = 0; i < rows_; ++i) {
      T value = 0;
      for (std::size_t k = 0; k < sizeof(T); ++k)
        value = static_cast<T>(value | (static_cast<T>(at_[k * rows_ + i]) << (8 * k)));
      set(i, value);
    }
    at_ += rows_ * sizeof(T);
  }

 private:
  const std::byte* at_;
  std::size_t rows_;
};

std::uint16_t as_fraction(double value) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0, 1.0) * 65535));
}

// The octahedron's faces folded flat. Q. Meyer et al. On Floating-Point Normal Vectors. EGSR 2010.
std::array<std::uint16_t, 2> octahedral(const Vec3f& v) {
  const double sum = std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
  double x = v.x / sum, y = v.y / sum;
  if (v.z < 0) {
    const double folded = (1 - std::abs(y)) * std::copysign(1.0, x);
    y = (1 - std::abs(x)) * std::copysign(1.0, y);
    x = folded;
  }
  return {as_fraction(0.5 + 0.5 * x), as_fraction(0.5 + 0.5 * y)};
}

Vec3f from_octahedral(std::uint16_t a, std::uint16_t b) {
  const double x = a / 65535.0 * 2 - 1, y = b / 65535.0 * 2 - 1;
  const double z = 1 - std::abs(x) - std::abs(y);
  if (z >= 0) return Vec3f(normalize(Vec3(x, y, z)));
  return Vec3f(normalize(Vec3((1 - std::abs(y)) * std::copysign(1.0, x),
                              (1 - std::abs(x)) * std::copysign(1.0, y), z)));
}

// 1 mm times 2^(1/16) per step; 0 is none.
std::uint8_t radius_code(double radius_m) {
  if (!(radius_m > 0)) return 0;
  return static_cast<std::uint8_t>(
      std::clamp(std::lround(1 + 16 * log2_of(static_cast<double>(radius_m) / 1e-3)), 1l, 255l));
}
float radius_m_of(std::uint8_t code) {
  return code == 0 ? 0 : static_cast<float>(1e-3 * exp2_of((code - 1) / 16.0));
}

}  // namespace

void snap_powers(Source& source) {
  const auto key = std::uint64_t{std::bit_cast<std::uint32_t>(source.u)} << 32 |
                   std::bit_cast<std::uint32_t>(source.delay_s);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    if (!(source.power[b] > 0)) continue;
    const int below = static_cast<int>(std::floor(half_decibels(source.power[b])));
    const double low = power_of(below), high = power_of(below + 1);
    const double odds = (source.power[b] - low) / (high - low);
    const RandomBits bits = philox(key, {static_cast<std::uint32_t>(b), 0x5a9u, 0, 0});
    source.power[b] = static_cast<float>(unit(bits[0]) < odds ? high : low);
  }
}

std::vector<std::byte> encode_page(const OctreeNode& node, std::span<const Source> sources) {
  assert(sources.size() <= kNodeSources);
  int top = kLowestTop;
  for (const Source& source : sources) {
    if (source.is_emitter)
      continue;  // its power is the table's; here it would cost the others range
    for (const float power : source.power)
      if (power > 0) top = std::max(top, static_cast<int>(std::lround(half_decibels(power))));
  }

  Columns columns(sources.size());
  columns.prepend(static_cast<std::uint32_t>(sources.size()), top);
  columns.add<std::uint8_t>([&](std::size_t i) {
    return static_cast<std::uint8_t>((sources[i].is_emitter ? kEmitterFlag : 0) |
                                     (sources[i].polarity < 0 ? kNegativeFlag : 0));
  });
  for (int axis = 0; axis < 3; ++axis)
    columns.add<std::uint16_t>([&](std::size_t i) {
      const double edge_m = static_cast<double>(node.high_m[axis]) - node.low_m[axis];
      return edge_m > 0 ? as_fraction((sources[i].position_m[axis] - node.low_m[axis]) / edge_m)
                        : std::uint16_t{0};
    });
  for (std::size_t half = 0; half < 2; ++half) {
    columns.add<std::uint16_t>([&](std::size_t i) { return octahedral(sources[i].normal)[half]; });
    columns.add<std::uint16_t>([&](std::size_t i) { return octahedral(sources[i].mirror)[half]; });
  }
  for (std::size_t b = 0; b < kBandCount; ++b)
    columns.add<std::uint8_t>([&](std::size_t i) {
      if (sources[i].is_emitter || !(sources[i].power[b] > 0)) return std::uint8_t{kSilent};
      const long code = top - std::lround(half_decibels(sources[i].power[b])) + 1;
      return code > 255 ? std::uint8_t{kSilent} : static_cast<std::uint8_t>(code);
    });
  columns.add<std::uint32_t>([&](std::size_t i) {
    return static_cast<std::uint32_t>(std::llround(sources[i].delay_s * kDelaySteps_per_s));
  });
  columns.add<std::uint8_t>([&](std::size_t i) { return radius_code(sources[i].patch_radius_m); });
  columns.add<std::uint32_t>(
      [&](std::size_t i) { return std::bit_cast<std::uint32_t>(sources[i].u); });
  columns.add<std::uint16_t>([&](std::size_t i) { return sources[i].material; });
  columns.add<std::uint32_t>([&](std::size_t i) { return sources[i].emitter; });
  return columns.take();
}

void set_from_emitter(Source& source, const Emitter& emitter) {
  source.is_emitter = true;
  source.polarity = 1;
  source.position_m = Vec3f(emitter.position_m);
  source.normal = source.mirror = Vec3f(emitter.axis);
  source.delay_s = 0;
  source.patch_radius_m = 0;
  source.material = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    source.power[b] =
        static_cast<float>(emitter.gain * emitter.gain * emission_power(emitter.directivity[b]));
}

Result<std::vector<Source>> decode_page(const OctreeNode& node, std::span<const std::byte> bytes,
                                        const std::vector<Emitter>& emitters,
                                        std::size_t materials) {
  const std::size_t count = node.source_count;
  std::uint32_t stored_count = 0;
  std::int32_t top = 0;
  if (bytes.size() != page_bytes(count)) return Error("has the wrong size for its sources");
  std::memcpy(&stored_count, bytes.data(), 4);
  std::memcpy(&top, bytes.data() + 4, 4);
  if (stored_count != count) return Error("holds another number of sources than its node");
  if (top < kLowestTop || top > kHighestTop) return Error("has a power beyond all bounds");

  std::vector<Source> sources(count);
  ColumnReader columns(bytes.subspan(kPageHeaderBytes), count);
  columns.read<std::uint8_t>([&](std::size_t i, std::uint8_t flags) {
    sources[i].is_emitter = (flags & kEmitterFlag) != 0;
    sources[i].polarity = (flags & kNegativeFlag) != 0 ? -1 : 1;
  });
  for (int axis = 0; axis < 3; ++axis)
    columns.read<std::uint16_t>([&](std::size_t i, std::uint16_t code) {
      const double low_m = node.low_m[axis], high_m = node.high_m[axis];
      sources[i].position_m[axis] = static_cast<float>(low_m + code / 65535.0 * (high_m - low_m));
    });
  std::vector<std::uint16_t> normal(count), mirror(count);
  columns.read<std::uint16_t>([&](std::size_t i, std::uint16_t code) { normal[i] = code; });
  columns.read<std::uint16_t>([&](std::size_t i, std::uint16_t code) { mirror[i] = code; });
  columns.read<std::uint16_t>([&](std::size_t i, std::uint16_t code) {
    sources[i].normal = from_octahedral(normal[i], code);
  });
  columns.read<std::uint16_t>([&](std::size_t i, std::uint16_t code) {
    sources[i].mirror = from_octahedral(mirror[i], code);
  });
  for (std::size_t b = 0; b < kBandCount; ++b)
    columns.read<std::uint8_t>([&](std::size_t i, std::uint8_t code) {
      sources[i].power[b] = code == kSilent ? 0 : static_cast<float>(power_of(top - code + 1));
    });
  columns.read<std::uint32_t>([&](std::size_t i, std::uint32_t code) {
    sources[i].delay_s = static_cast<float>(code / kDelaySteps_per_s);
  });
  columns.read<std::uint8_t>(
      [&](std::size_t i, std::uint8_t code) { sources[i].patch_radius_m = radius_m_of(code); });
  columns.read<std::uint32_t>(
      [&](std::size_t i, std::uint32_t bits) { sources[i].u = std::bit_cast<float>(bits); });
  columns.read<std::uint16_t>(
      [&](std::size_t i, std::uint16_t material) { sources[i].material = material; });
  columns.read<std::uint32_t>(
      [&](std::size_t i, std::uint32_t emitter) { sources[i].emitter = emitter; });

  for (Source& source : sources) {
    if (source.emitter >= emitters.size()) return Error("names an emitter that does not exist");
    if (!(source.u > 0 && source.u <= 1)) return Error("has a permanent number outside (0, 1]");
    if (source.is_emitter)
      set_from_emitter(source, emitters[source.emitter]);
    else if (source.material >= materials)
      return Error("names a material that does not exist");
  }
  return sources;
}

}  // namespace clamor
