// gltf_accessor.h: validated access to the elements of a glTF accessor.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

// All elements of an opened accessor lie inside its buffer. Elements are converted when they are
// read (normalized integers to [-1, 1]), so buffers are not copied.
//
// A reader refers to the scene, which must outlive it. Const functions are thread-safe.
class GltfReader {
 public:
  // Errors name the accessor: a wrong number of components, an unknown component type, a stride
  // smaller than an element, an end beyond the view, sparse indices out of range or not ascending,
  // or more elements without data than the file has bytes.
  static Result<GltfReader> open(const GltfScene& scene, int accessor, int components);

  std::size_t count() const { return accessor_->count; }

  // The distance of neighbouring values: of integers, as far as they are used, normalized or not,
  // and of numbers in floating point that compression has rounded, else 0.
  double step() const;

  // Element i < count() of at most four components, padded with zeros.
  std::array<double, 4> at(std::size_t i) const;

  // Element i < count() of an accessor of 16 components, column by column.
  glm::dmat4 matrix_at(std::size_t i) const;

  // Element i < count() of an unsigned integer accessor.
  std::uint32_t index_at(std::size_t i) const;

 private:
  const std::byte* element(std::size_t i) const;

  const GltfAccessor* accessor_ = nullptr;
  const std::byte* base_ = nullptr;  // null if all elements are zero
  std::size_t stride_ = 0, component_bytes_ = 0;
  std::vector<std::uint32_t> sparse_indices_;  // ascending
  const std::byte* sparse_values_ = nullptr;
  std::size_t element_bytes_ = 0;
};

// Returns 0 for a type that glTF does not have.
std::size_t component_bytes(int component_type);

// Returns whether the component type is an unsigned integer.
bool is_unsigned(const GltfAccessor& accessor);

}  // namespace clamor
