// text_format.h: formats names and numbers for the terminal.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "common/printable.h"

namespace clamor {

// Cuts a long name and appends "...".
inline std::string shortened(const std::string& name, std::size_t width) {
  const std::string whole = printable(name);
  if (whole.size() <= width) return whole;
  const std::string beginning = whole.substr(0, width - 3);
  return beginning.substr(0, beginning.size() - incomplete_bytes(beginning)) + "...";
}

// Formats as "16 416".
inline std::string grouped(double number) {
  std::string digits = std::to_string(std::llround(number));
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, " ");
  return digits;
}

// Formats as "1 photon" or "16 416 photons".
inline std::string counted(std::uint64_t number, const std::string& thing) {
  return grouped(static_cast<double>(number)) + " " + thing + (number == 1 ? "" : "s");
}

inline double decibels_of(double power) { return power > 0 ? 10 * std::log10(power) : -INFINITY; }

}  // namespace clamor
