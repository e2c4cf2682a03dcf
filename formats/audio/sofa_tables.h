// sofa_tables.h: reads the tables of SOFA files, unvalidated. libmysofa is visible only here.
//
// The file is read in a child process: of 18 000 randomly damaged files none crashed
// libmysofa 1.3.1, but one kept it in an endless loop, and crafted files crash it
// (github.com/hoene/libmysofa, issue 231).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/result.h"

namespace clamor {

// Positions and directions are cartesian, x, y and z for each row.
struct SofaTables {
  struct Shape {
    std::int32_t problem = 0;  // error code of libmysofa
    std::uint32_t directions = 0, ears = 0, coordinates = 0, frames = 0;
    std::array<char, 40> convention{}, data_type{};
  } shape;
  std::vector<float> rate, delay, sources, samples;
  std::vector<float> receivers, listeners, views, ups;  // may be empty
};

// Whether this build has libmysofa.
bool has_mysofa();

enum class SofaLibrary { kMysofa, kHdf5 };

// The Error is a predicate: "crashes". kMysofa needs has_mysofa(), kHdf5 load_hdf5().
Result<SofaTables> read_sofa_tables(const std::string& path, std::uint64_t file_bytes,
                                    SofaLibrary library);

}  // namespace clamor
