// gltf_accessor.h: numbers out of a glTF buffer, nothing read before it is checked.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

// An accessor whose every element has been found to lie inside its buffer. Elements are converted
// as they are read (normalized integers to [-1, 1]), so a large buffer is never copied.
//
// Refers into the scene, which must outlive it. All const functions may be called from any thread.
class GltfReader {
 public:
  // Errors name the accessor: wrong number of components, an integer type that glTF does not have,
  // a stride smaller than an element, an end beyond the view, sparse indices out of range or not
  // ascending, a count that no byte of the file stands behind.
  static Result<GltfReader> open(const GltfScene& scene, int accessor, int components);

  std::size_t count() const { return accessor_->count; }

  // Element i < count(), its components first and the rest zero.
  std::array<double, 4> at(std::size_t i) const;

  // The same, of an unsigned integer accessor.
  std::uint32_t index_at(std::size_t i) const;

 private:
  const std::byte* element(std::size_t i) const;

  const GltfAccessor* accessor_ = nullptr;
  const std::byte* base_ = nullptr;  // null for all zeros
  std::size_t stride_ = 0, component_bytes_ = 0;
  std::vector<std::uint32_t> sparse_indices_;  // ascending
  const std::byte* sparse_values_ = nullptr;
  std::size_t element_bytes_ = 0;
};

// Whether the accessor's component type is one of the unsigned integers.
bool is_unsigned(const GltfAccessor& accessor);

}  // namespace clamor
