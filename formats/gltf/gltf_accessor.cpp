#include "formats/gltf/gltf_accessor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

namespace clamor {

namespace {

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123,
              kUnsignedInt = 5125;

// Buffers need not be aligned, so values are copied.
template <class T>
T load(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

double component(const std::byte* from, int type, bool normalized) {
  switch (type) {
    case kByte: {
      const double value = load<std::int8_t>(from);
      return normalized ? std::max(value / 127, -1.0) : value;
    }
    case kUnsignedByte:
      return load<std::uint8_t>(from) / (normalized ? 255.0 : 1.0);
    case kShort: {
      const double value = load<std::int16_t>(from);
      return normalized ? std::max(value / 32767, -1.0) : value;
    }
    case kUnsignedShort:
      return load<std::uint16_t>(from) / (normalized ? 65535.0 : 1.0);
    case kUnsignedInt:
      return load<std::uint32_t>(from) / (normalized ? 4294967295.0 : 1.0);
    default:
      return load<float>(from);
  }
}

std::uint32_t unsigned_value(const std::byte* from, int type) {
  if (type == kUnsignedByte) return load<std::uint8_t>(from);
  if (type == kUnsignedShort) return load<std::uint16_t>(from);
  return load<std::uint32_t>(from);
}

// Returns the first of `count` elements, or null if they do not fit into the view. Cannot overflow:
// offsets and lengths are below 1e15 (gltf_check.cpp).
const std::byte* range(const GltfScene& scene, int view_index, std::size_t offset,
                       std::size_t stride, std::size_t element_bytes, std::size_t count) {
  const GltfView& view = scene.views[static_cast<std::size_t>(view_index)];
  const FileBytes& buffer = scene.buffers[static_cast<std::size_t>(view.buffer)];
  if (count == 0) return buffer.data();
  if (offset > view.length || view.length - offset < element_bytes) return nullptr;
  if ((view.length - offset - element_bytes) / stride < count - 1) return nullptr;
  return buffer.data() + view.offset + offset;
}

}  // namespace

std::size_t component_bytes(int component_type) {
  switch (component_type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kGltfFloat:
      return 4;
    default:
      return 0;
  }
}

bool is_unsigned(const GltfAccessor& accessor) {
  return accessor.component_type == kUnsignedByte || accessor.component_type == kUnsignedShort ||
         accessor.component_type == kUnsignedInt;
}

Result<GltfReader> GltfReader::open(const GltfScene& scene, int index, int components) {
  const GltfAccessor& accessor = scene.accessors[static_cast<std::size_t>(index)];
  const auto wrong = [&](const std::string& what) {
    return Error(fmt::format("accessor {} {}; export the level again.", index, what));
  };

  GltfReader reader;
  reader.accessor_ = &accessor;
  reader.component_bytes_ = component_bytes(accessor.component_type);
  if (reader.component_bytes_ == 0)
    return wrong(
        fmt::format("has component type {}, which glTF does not have", accessor.component_type));
  if (accessor.components != components)
    return wrong(
        fmt::format("has {} components where {} are needed", accessor.components, components));
  reader.element_bytes_ = reader.component_bytes_ * static_cast<std::size_t>(components);
  reader.stride_ = reader.element_bytes_;

  if (accessor.view != kNone) {
    const GltfView& view = scene.views[static_cast<std::size_t>(accessor.view)];
    if (view.stride != 0) reader.stride_ = view.stride;
    if (reader.stride_ < reader.element_bytes_)
      return wrong(fmt::format("has a stride of {} bytes for elements of {}", reader.stride_,
                               reader.element_bytes_));
    reader.base_ = range(scene, accessor.view, accessor.offset, reader.stride_,
                         reader.element_bytes_, accessor.count);
    if (reader.base_ == nullptr && accessor.count > 0)
      return wrong(fmt::format("has {} elements, more than fit into its buffer view of {} bytes",
                               accessor.count, view.length));
  } else if (accessor.count > scene.bytes()) {
    return wrong(fmt::format("has {} elements and no data for them", accessor.count));
  }

  if (accessor.sparse_count == 0) return reader;
  const int index_type = accessor.sparse_index_type;
  if (index_type != kUnsignedByte && index_type != kUnsignedShort && index_type != kUnsignedInt)
    return wrong(
        fmt::format("has sparse indices of component type {}, not 5121, 5123 or 5125", index_type));
  const std::size_t index_bytes = component_bytes(index_type);
  const std::byte* indices = range(scene, accessor.sparse_index_view, accessor.sparse_index_offset,
                                   index_bytes, index_bytes, accessor.sparse_count);
  reader.sparse_values_ =
      range(scene, accessor.sparse_value_view, accessor.sparse_value_offset, reader.element_bytes_,
            reader.element_bytes_, accessor.sparse_count);
  if (indices == nullptr || reader.sparse_values_ == nullptr)
    return wrong(fmt::format("has {} sparse values, more than fit into their buffer views",
                             accessor.sparse_count));
  for (std::size_t i = 0; i < accessor.sparse_count; ++i) {
    const std::uint32_t at = unsigned_value(indices + i * index_bytes, accessor.sparse_index_type);
    if (at >= accessor.count || (i > 0 && at <= reader.sparse_indices_.back()))
      return wrong(
          fmt::format("has a sparse index {} that is out of order or beyond its {} elements", at,
                      accessor.count));
    reader.sparse_indices_.push_back(at);
  }
  return reader;
}

const std::byte* GltfReader::element(std::size_t i) const {
  if (!sparse_indices_.empty()) {
    const auto it = std::lower_bound(sparse_indices_.begin(), sparse_indices_.end(), i);
    if (it != sparse_indices_.end() && *it == i)
      return sparse_values_ +
             static_cast<std::size_t>(it - sparse_indices_.begin()) * element_bytes_;
  }
  return base_ == nullptr ? nullptr : base_ + i * stride_;
}

std::array<double, 4> GltfReader::at(std::size_t i) const {
  std::array<double, 4> values{};
  const std::byte* from = element(i);
  if (from == nullptr) return values;
  for (std::size_t c = 0; c < static_cast<std::size_t>(accessor_->components); ++c)
    values[c] =
        component(from + c * component_bytes_, accessor_->component_type, accessor_->normalized);
  return values;
}

// Tools round to fewer bits than 16-bit integers have, usually 14, and repeat the highest bits of a
// value in the lowest.
double GltfReader::step() const {
  const int type = accessor_->component_type;
  if (type == kGltfFloat) return accessor_->step;
  if (!accessor_->normalized) return 1;
  const int whole = static_cast<int>(8 * component_bytes_) - (type == kByte || type == kShort);
  const auto largest = [](int bits) { return std::ldexp(1.0, bits) - 1; };
  const auto has_bits = [&](int bits) {
    for (std::size_t i = 0; i < count(); ++i)
      for (const double part : at(i)) {
        const auto value = static_cast<std::uint32_t>(std::lround(std::abs(part) * largest(whole)));
        const std::uint32_t kept = value >> (whole - bits);
        if (value != (kept << (whole - bits) | kept >> (2 * bits - whole))) return false;
      }
    return true;
  };
  constexpr int kMostMissing = 2;
  for (int bits = whole - kMostMissing; component_bytes_ == 2 && bits < whole; ++bits)
    if (has_bits(bits)) return 1 / largest(bits);
  return 1 / largest(whole);
}

glm::dmat4 GltfReader::matrix_at(std::size_t i) const {
  glm::dmat4 matrix(0.0);
  const std::byte* from = element(i);
  if (from == nullptr) return matrix;
  for (std::size_t c = 0; c < 16; ++c)
    matrix[static_cast<int>(c / 4)][static_cast<int>(c % 4)] =
        component(from + c * component_bytes_, accessor_->component_type, accessor_->normalized);
  return matrix;
}

std::uint32_t GltfReader::index_at(std::size_t i) const {
  const std::byte* from = element(i);
  return from == nullptr ? 0 : unsigned_value(from, accessor_->component_type);
}

}  // namespace clamor
