// page_statistics.h: what a page loader counts.
#pragma once

#include <cstdint>
#include <string>

namespace clamor {

struct PageStatistics {
  std::uint64_t asked = 0, loaded = 0, dropped = 0, failed = 0;
  std::uint64_t late = 0;      // looked for by a sample before they were here
  std::uint64_t resident = 0;  // pages,
  std::uint64_t bytes = 0;     // and their memory
  std::string failure;         // the first, as a sentence
};

}  // namespace clamor
