// input_file.h: a file that a bake was made from.
#pragma once

#include <cstdint>
#include <string>

namespace clamor {

struct InputFile {
  std::string name;  // without its folder
  std::uint64_t bytes = 0;
  std::uint64_t hash = 0;  // xxHash3, 64 bits, seed 0

  bool operator==(const InputFile&) const = default;
};

}  // namespace clamor
