// input_file.h: an input file of a bake, for its provenance.
#pragma once

#include <cstdint>
#include <string>

namespace clamor {

struct InputFile {
  std::string name;  // without its folder
  std::uint64_t bytes = 0;
  std::uint64_t hash = 0;  // 64-bit xxHash3 with seed 0

  bool operator==(const InputFile&) const = default;
};

}  // namespace clamor
